"""Texts of generated comments about messages and fields; each target adds its own markup.

Nothing is escaped here: a target escapes the whole text when it makes a comment of it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass

from stagewire_generator.model import (
    Enumeration,
    EnumValue,
    Erratum,
    Field,
    FlagTable,
    Layout,
    Message,
    Protocol,
)

DIRECTIONS = {
    "to_controller": "to the controller",
    "to_host": "to the host",
    "both": "either way",
}
"""Direction of a message -> how a sentence names it."""

_ROLES = {"set": "Sets the {}.", "req": "Requests the {}.", "get": "Reports the {}."}
_EXCHANGES = {
    "answered_by": "Answered by",
    "completes_with": "Completes with",
    "stops_with": "Stops with",
    "muted_by": "Muted by",
    "announces": "Announces",
    "starts": "Starts",
    "stops": "Stops",
}


@dataclass(frozen=True, slots=True)
class Markup:
    """How the comments of a target write names.

    :param name: marks a name of the registry, such as that of a message.
    :param table: refers to an enumeration or to the bits of a flag table.
    """

    name: Callable[[str], str]
    table: Callable[[Enumeration | FlagTable], str]


def message_paragraphs(
    protocol: Protocol, message: Message, layout: Layout | None, markup: Markup
) -> Iterator[str]:
    """Yield what is said of a message of a layout: its meaning, its exchange, and notes."""
    yield " ".join(filter(None, (role_sentence(message), sentence(message.summary))))
    facts = [exchange(message, markup)]
    if layout is not None and layout.when:
        choice = ", ".join(f"{k} {v}" for k, v in layout.when.items())
        facts.append(f"This layout: {choice}.")
    yield " ".join(filter(None, facts))
    notes = [message.note, layout.note if layout else ""]
    if message.overlay:
        notes.append(f"From {where(protocol, message.pages, markup, message.overlay)}")
    yield from (sentence(note) for note in notes if note)


def command_paragraphs(
    protocol: Protocol, message: Message, layout: Layout, markup: Markup, dummy: str
) -> Iterator[str]:
    """Yield what is said of a command or a setup command; some of it may be empty.

    :param dummy: what is said of a dummy function.
    """
    yield message.summary
    yield exchange(message, markup)
    if message.dummy:
        yield dummy
    yield from (sentence(note) for note in (message.note, layout.note) if note)
    yield from (f"Firmware {fact.version}: {sentence(fact.note)}" for fact in message.firmware)
    found = sentence(where(protocol, message.pages, markup, message.overlay))
    behind = " after the prefix" if message.kind == "setup" else ""
    typed = f" Typed as {markup.name(message.keyboard)}{behind}." if message.keyboard else ""
    yield found + typed


def title_of(message: Message) -> str:
    """Return what documentation calls the parameters of a message, or what sending it does."""
    words = message.words[1:] if message.group else message.words
    if not message.set:
        return message.title or " ".join(words).lower().capitalize()
    return message.title or " ".join(word for word in words if word.lower() != message.set[1])


def role_sentence(message: Message) -> str:
    """Return what a message of a parameter set does; nothing for another message."""
    return _ROLES[message.set[1]].format(title_of(message)) if message.set else ""


def sentence(text: str) -> str:
    """Return a note of the registry as a sentence that stands alone."""
    text = text[:1].upper() + text[1:]
    return text if text.endswith(".") else text + "."


def errata_of(protocol: Protocol, slugs: Iterable[str]) -> list[Erratum]:
    """Return the errata by their slugs, in the order of the registry; cosmetic ones are left out."""
    wanted = set(slugs)
    return [e for e in protocol.errata if e.id in wanted and e.kind != "cosmetic"]


def erratum_text(erratum: Erratum, markup: Markup) -> str:
    """Return what is said of an erratum."""
    printed, encoded = erratum.printed, erratum.encoded
    text = f"Erratum {markup.name(erratum.id)}: printed {printed}; encoded {encoded}"
    return text if text.endswith(".") else text + "."


def exchange(message: Message, markup: Markup) -> str:
    """Return the messages that answer a message, or that it stops, and so on, as sentences."""
    return " ".join(
        f"{text} {', '.join(markup.name(name) for name in message.exchange[key])}."
        for key, text in _EXCHANGES.items()
        if key in message.exchange
    )


def where(protocol: Protocol, pages: Sequence[int], markup: Markup, overlay: str = "") -> str:
    """Return the pages of the document that describe something, or the titles of its sections.

    :param overlay: the overlay that it comes from, which is named; its own document has the pages.
    """
    document = protocol.document_of(overlay)
    named = f" of the overlay {markup.name(overlay)}" if overlay else ""
    if "sections" in document:
        titles = ", ".join(document["sections"][page - 1] for page in pages)
        return f"section{'s' if len(pages) > 1 else ''} {titles}{named}"
    return f"page{'s' if len(pages) > 1 else ''} {', '.join(str(page) for page in pages)}{named}"


def field_facts(field: Field, markup: Markup, *, given: bool = False) -> str:
    """Return what is said of a field: meaning, unit and scale, names of its values, range.

    :param given: whether it describes an argument of a device class, which lists its choices.
    """
    facts = []
    if field.note:
        facts.append(field.note.rstrip("."))
    if field.role == "reserved":
        facts.append("reserved, sent as zero")
    if field.constant is not None:
        facts.append(f"always {field.constant:#04x}")
    if field.quantity:
        facts.append(_unit(field))
    for table in (field.enum, field.flags):
        if table:
            facts.append(markup.table(table) + (f": {_choices(table, markup)}" if given else ""))
    if field.format.kind == "text":
        facts.append(f"text of at most {field.format.size} characters")
    elif field.format.kind == "bytes":
        facts.append(f"{field.format.size} bytes")
    elif not (given and field.lists_all):
        facts.append(f"from {field.minimum} to {field.maximum}")
    if field.default is not None:
        facts.append(f"by default {field.default}")
    return "; ".join(facts)


def _choices(table: Enumeration | FlagTable, markup: Markup) -> str:
    """Return the names that a caller may give, with their numbers."""
    bar = markup.name("|")
    if isinstance(table, FlagTable):
        bits = ", ".join(f"{bit.name} ({bit.mask:#x})" for bit in table.bits)
        return f"{bits}, or several joined by {bar}"
    values = ", ".join(_numbered(value) for value in table.values if not value.modifier)
    modifiers = " and ".join(map(_numbered, table.modifiers))
    return f"{values}; {modifiers} may be added by {bar}" if modifiers else values


def _numbered(value: EnumValue) -> str:
    number = value.value
    return f"{value.name} ({number if 0 <= number < 10 else hex(number)})"


def _unit(field: Field) -> str:
    quantity = field.quantity
    assert quantity
    unit = quantity.unit
    if quantity.factor:
        key, value = quantity.factor.key, quantity.factor.value
        return (
            f"in counts of {value} {unit}"
            if key.endswith("_per_count")
            else f"in counts, {value} per {unit}"
        )
    if "unknown" in quantity.rule:
        return f"in counts; the scale to {unit} is unknown"
    by = quantity.rule.get("setting") or f"the {quantity.rule['by']}"
    return (
        f"in counts; {f'the scale to {unit} depends' if unit else 'unit and scale depend'} on {by}"
    )
