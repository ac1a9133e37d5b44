"""What the docstrings of generated classes say."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from stagewire_generator.model import Erratum, Field, Layout, Message, Protocol
from stagewire_generator.naming import camel
from stagewire_generator.targets.python.source import docstring, paragraph, sentence

__all__ = ["class_doc", "errata_of", "exchange", "message_doc", "where"]

_ROLES = {"set": "Set", "req": "Request", "get": "Report"}
_DIRECTIONS = {
    "to_controller": "to the controller",
    "to_host": "to the host",
    "both": "either way",
}

_EXCHANGES = {
    "answered_by": "Answered by",
    "completes_with": "Completes with",
    "stops_with": "Stops with",
    "muted_by": "Muted by",
    "announces": "Announces",
    "starts": "Starts",
    "stops": "Stops",
}


def class_doc(
    first: str,
    paragraphs: Iterable[str],
    fields: Iterable[Field] = (),
    errata: Iterable[Erratum] = (),
) -> str:
    """Return the docstring of a message class, escaped.

    :param first: the first line: what it is, which way it goes, how long it is.
    :param paragraphs: what follows; empty ones are left out.
    :param errata: those of the message; cosmetic ones are left out.
    """
    parts = [first, *(paragraph(text, 4) for text in paragraphs if text)]
    lines = [paragraph(_param(field), 4, 4) for field in fields]
    lines_of_errata = [paragraph(_erratum(e), 4, 4) for e in errata if e.kind != "cosmetic"]
    parts += ["\n    ".join(block) for block in (lines, lines_of_errata) if block]
    return docstring("\n\n    ".join(parts))


def message_doc(
    protocol: Protocol, message: Message, layout: Layout | None, named: str, size: str
) -> str:
    """Return the docstring of a class of a message, escaped.

    :param layout: the layout that the class is for; None where the message has none.
    :param named: the message and its id.
    :param size: how long it is, in words.
    """
    direction, pages = (
        _DIRECTIONS[message.direction],
        where(protocol, message.pages, message.overlay),
    )
    role = f"{_ROLES[message.set[1]]}: " if message.set else ""
    facts = [exchange(message)]
    if layout is not None and layout.when:
        choice = ", ".join(f"{k} {v}" for k, v in layout.when.items())
        facts.append(f"This layout: {choice}.")
    notes = [message.note, layout.note if layout else ""]
    first = f"{named}, {direction}, {size}; {pages}."
    if message.overlay:  # two names make a line long
        first = f"{named}, {direction}, {size}."
        notes.append(f"From {pages}")
    return class_doc(
        first,
        [
            role + _lower(message.summary, role),
            " ".join(filter(None, facts)),
            *(sentence(note) for note in notes if note),
        ],
        layout.all_fields if layout else (),
        errata_of(protocol, message.errata),
    )


def _lower(text: str, role: str) -> str:
    """Return a summary as it continues after a role; an acronym keeps its capitals."""
    return text[:1].lower() + text[1:] if role and not text[1:2].isupper() else text


def errata_of(protocol: Protocol, slugs: Iterable[str]) -> list[Erratum]:
    """Return the errata by their slugs, in the order of the registry."""
    wanted = set(slugs)
    return [erratum for erratum in protocol.errata if erratum.id in wanted]


def exchange(message: Message) -> str:
    """Return the messages that answer a message, or that it stops, and so on, as sentences."""
    return " ".join(
        f"{text} {', '.join(f'``{name}``' for name in message.exchange[key])}."
        for key, text in _EXCHANGES.items()
        if key in message.exchange
    )


def where(protocol: Protocol, pages: Sequence[int], overlay: str = "") -> str:
    """Return where in the document something stands: its pages, or the titles of its sections.

    :param overlay: the overlay that it comes from, whose document then has the pages, and is named.
    """
    document = protocol.document_of(overlay)
    named = f" of the overlay ``{overlay}``" if overlay else ""
    if "sections" in document:
        titles = ", ".join(document["sections"][page - 1] for page in pages)
        return f"section{'s' if len(pages) > 1 else ''} {titles}{named}"
    return f"page{'s' if len(pages) > 1 else ''} {', '.join(str(page) for page in pages)}{named}"


def _param(field: Field) -> str:
    facts = []
    if field.note:
        facts.append(field.note.rstrip("."))
    if field.role == "reserved":
        facts.append("reserved, sent as zero")
    if field.constant is not None:
        facts.append(f"always {field.constant:#04x}")
    if field.quantity:
        facts.append(_unit(field))
    if field.enum:
        facts.append(f":class:`~.{camel(field.enum.name)}`")
    if field.flags:
        facts.append(f":class:`~.{camel(field.flags.name)}`")
    if field.format.kind == "text":
        facts.append(f"text of at most {field.format.size} characters")
    elif field.format.kind == "bytes":
        facts.append(f"{field.format.size} bytes")
    else:
        facts.append(f"{field.minimum} to {field.maximum}")
    if field.default is not None:
        facts.append(f"by default {field.default}")
    return f":param {field.name}: {'; '.join(facts)}."


def _unit(field: Field) -> str:
    quantity = field.quantity
    assert quantity
    unit = quantity.unit or "unit by setting"
    if quantity.factor:
        factor = quantity.factor
        return f"raw counts of {unit}, {factor.key} {factor.value}"
    if "unknown" in quantity.rule:
        return f"raw counts of {unit}, scale unknown"
    by = quantity.rule.get("by")
    setting = quantity.rule.get("setting")
    return f"raw counts of {unit}, scale by {setting or by}"


def _erratum(erratum: Erratum) -> str:
    text = f"Erratum ``{erratum.id}``: printed {erratum.printed}; encoded {erratum.encoded}"
    return text if text.endswith(".") else text + "."
