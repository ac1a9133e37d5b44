"""Texts of generated comments about messages and fields; each target adds its own markup.

Nothing is escaped here. A target escapes the whole text when it turns it into a comment.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import lru_cache
from typing import NamedTuple

from stagewire_generator.model import Chapter, Erratum, Layout, Message, Protocol
from stagewire_generator.model_evidence import spelled
from stagewire_generator.model_fields import Array, Enumeration, EnumValue, Field, FlagTable
from stagewire_generator.model_scales import Quantity
from stagewire_generator.real import number_of

DIRECTIONS = {
    "to_controller": "to the controller",
    "to_host": "to the host",
    "both": "in both directions",
}
"""Direction of a message -> its phrase in a sentence."""

_SENTENCE_END = re.compile(r"(?<=\.)\s+(?=[A-Z])")
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


class Markup(NamedTuple):
    """How a target writes names in comments.

    :param name: marks a name from the registry, such as the name of a message.
    :param table: refers to an enumeration or to the bits of a flag table.
    """

    name: Callable[[str], str]
    table: Callable[[Enumeration | FlagTable], str]


def meaning(message: Message) -> str:
    """Return what a message does, in one or more sentences.

    The SET and the GET of a parameter set describe its parameters. The REQ does not repeat that.
    """
    role = role_sentence(message)
    summary = sentence(message.summary)
    if message.set and message.set[1] == "req":
        return role
    return f"{role} {summary}" if role else summary


def first_sentence(text: str) -> tuple[str, str]:
    """Split a text after its first sentence."""
    found = _SENTENCE_END.search(text)
    return (text[: found.start()], text[found.end() :]) if found else (text, "")


def shown_id(protocol: Protocol, message: Message) -> str:
    """Return the id of a message in hex, with its sub-message if it has one."""
    id = f"0x{message.id:0{protocol.id_digits}X}"
    return id if message.sub_message is None else f"{id}, sub-message {message.sub_message}"


def message_paragraphs(
    protocol: Protocol, message: Message, layout: Layout | None, markup: Markup, facts: str
) -> Iterator[str]:
    """Yield the paragraphs on a message in one of its layouts: meaning, exchange and notes.

    :param facts: a sentence with its name, id, direction, length and pages.
    """
    yield meaning(message)
    yield " ".join(filter(None, [facts, *_exchange_facts(message, layout, markup)]))
    notes = [message.note, layout.note if layout else ""]
    if message.not_sent:
        notes.append(f"Stagewire does not send it: {message.not_sent}")
    if message.without_flag:
        notes.append(f"Also received without the data flag: {message.without_flag}")
    if message.aliases:
        notes.append(f"Also named {' and '.join(map(markup.name, message.aliases))}")
    for overlay in protocol.overlays:
        if overlay.name in message.later_pages:
            pages = [message.later_pages[overlay.name]]
            notes.append(f"Also described in {where(protocol, pages, overlay.name)}")
    part = f"layouts/{layout.form.replace(':', '_')}" if layout else ""
    notes.append(evidence_text(protocol, "messages", message.name, part))
    yield from (sentence(note) for note in notes if note)


def evidence_text(protocol: Protocol, section: str, name: str, part: str = "") -> str:
    """Return the classes of the evidence of an entry besides the document; empty if there is none.

    :param part: a part of the entry; evidence of other parts is then left out.
    """
    classes = protocol.evidence.classes(section, name, part)
    return f"Evidence: {spelled(classes)}" if classes else ""


def _exchange_facts(message: Message, layout: Layout | None, markup: Markup) -> Iterator[str]:
    yield exchange(message, markup)
    if layout is not None and layout.when:
        choice = " and ".join(f"{k} is {v}" for k, v in layout.when.items())
        yield f"This layout is used if {choice}."


def command_paragraphs(
    protocol: Protocol, message: Message, layout: Layout, markup: Markup, facts: str, dummy: str
) -> Iterator[str]:
    """Yield the paragraphs on a command or a setup command; some of them may be empty.

    :param facts: its name, bytes and length; the beginning of a sentence.
    :param dummy: the paragraph for a dummy function.
    """
    yield sentence(message.summary)
    found = where(protocol, message.pages, message.overlay)
    after = " after the prefix" if message.kind == "setup" else ""
    typed = f"Typed as {markup.name(message.keyboard)}{after}." if message.keyboard else ""
    yield " ".join(filter(None, (f"{facts}; {found}.", typed, exchange(message, markup))))
    if message.dummy:
        yield dummy
    notes = (message.note, layout.note, evidence_text(protocol, "messages", message.name))
    yield from (sentence(note) for note in notes if note)
    yield from (f"Firmware {fact.version}: {sentence(fact.note)}" for fact in message.firmware)


def title_of(message: Message) -> str:
    """Return the title of a message for documentation: its parameters, or what it does."""
    words = message.words[1:] if message.group else message.words
    if not message.set:
        return message.title or " ".join(words).lower().capitalize()
    return message.title or " ".join(word for word in words if word.lower() != message.set[1])


def role_sentence(message: Message) -> str:
    """Return what a message of a parameter set does; empty for other messages."""
    return _ROLES[message.set[1]].format(title_of(message)) if message.set else ""


def sentence(text: str) -> str:
    """Return a note from the registry with a capital letter and a full stop."""
    text = text[:1].upper() + text[1:]
    return text if text.endswith(".") else text + "."


@lru_cache(maxsize=1)
def _noted_errata(protocol: Protocol) -> dict[str, tuple[int, Erratum]]:
    """Return slug -> position and erratum, without cosmetic ones."""
    numbered = enumerate(protocol.errata)
    return {e.id: (number, e) for number, e in numbered if e.kind != "cosmetic"}


def errata_of(protocol: Protocol, slugs: Iterable[str]) -> list[Erratum]:
    """Return the errata with these slugs, without cosmetic ones, in the order of the registry."""
    noted = _noted_errata(protocol)
    return [erratum for _, erratum in sorted(noted[slug] for slug in {*slugs} & noted.keys())]


def erratum_text(erratum: Erratum, markup: Markup) -> str:
    """Return the text of an erratum: its id and subject, and the printed and the encoded form."""
    named = f"Erratum {markup.name(erratum.id)} ({erratum.subject})"
    text = f"{named}: printed {erratum.printed}; encoded {erratum.encoded}"
    return text if text.endswith(".") else text + "."


def exchange(message: Message, markup: Markup) -> str:
    """Return sentences on the messages that answer, complete or stop a message, and so on."""
    return " ".join(
        f"{text} {', '.join(markup.name(name) for name in message.exchange[key])}."
        for key, text in _EXCHANGES.items()
        if key in message.exchange
    )


def where(protocol: Protocol, pages: Sequence[int], overlay: str = "") -> str:
    """Return the pages of a document, or the titles of its sections, such as ``Issue 37, page 58``.

    The document is named only if there are several.

    :param overlay: the overlay whose document has the pages; empty for the document of the protocol.
    """
    document = protocol.document_of(overlay)
    name = protocol.document_name(overlay)
    of = f"{name}, " if name else ""
    plural = "s" if len(pages) > 1 else ""
    if "sections" in document:
        return f"{of}section{plural} {', '.join(document['sections'][page - 1] for page in pages)}"
    return f"{of}page{plural} {', '.join(map(str, pages))}"


def where_all(protocol: Protocol, places: Iterable[tuple[int, str]]) -> str:
    """Return the pages of several documents, in the order of the documents.

    :param places: each page, with the overlay whose document has it.
    """
    pages: dict[str, set[int]] = {
        name: set() for name in ("", *(o.name for o in protocol.overlays))
    }
    for page, overlay in places:
        pages[overlay].add(page)
    found = (
        where(protocol, sorted(pages[overlay]), overlay) for overlay in pages if pages[overlay]
    )
    return "; ".join(found)


def chapter_place(protocol: Protocol, chapter: Chapter) -> str:
    """Return the page of a chapter, as the end of its title."""
    found = where(protocol, [chapter.page], chapter.overlay)
    return found if protocol.overlays else f"document {found}"


def field_facts(field: Field, markup: Markup, *, given: bool = False) -> str:
    """Return the description of a field: meaning, unit and scale, names of its values, range.

    :param given: whether the field is an argument of a device class, which lists its choices.
    """
    note = field.note.rstrip(".")
    facts = "; ".join(_facts(field, markup, given))
    if not note or not facts:
        return note or facts
    if ". " in note:  # a note of several sentences ends with a full stop
        return f"{note}. {facts[:1].upper()}{facts[1:]}"
    return f"{note}; {facts}"


def _facts(field: Field, markup: Markup, given: bool) -> Iterator[str]:
    if field.role == "reserved":
        yield "reserved, sent as zero"
    if field.constant is not None:
        yield f"always {field.constant:#04x}"
    if field.quantity:
        yield _unit(field.quantity)
    for table in (field.enum, field.flags):
        if table:
            yield markup.table(table) + (f": {_choices(table, markup)}" if given else "")
    if given:
        yield from _named_by_unit(field, markup)
    if field.format.kind == "text":
        yield f"text of at most {field.format.size} characters"
    elif field.format.kind == "bytes":
        yield f"{field.format.size} bytes"
    elif field.array:
        yield _rows(field.array, markup)
        yield f"each from {field.minimum} to {field.maximum}"
    elif field.format.real:
        yield from _real(field, given)
    elif field.role == "value" and not (given and field.lists_all):
        yield f"from {field.minimum} to {field.maximum}"
    if field.default is not None:
        yield f"default {field.default}"


def _named_by_unit(field: Field, markup: Markup) -> Iterator[str]:
    """Yield each enumeration of individual units, with these units and its values."""
    for table in {own.name: own for own in field.enums_by_unit.values()}.values():
        units = ", ".join(unit for unit, own in field.enums_by_unit.items() if own is table)
        yield f"on {units}: {markup.table(table)}: {_choices(table, markup)}"


def _real(field: Field, given: bool) -> Iterator[str]:
    """Yield the facts of a real number: in messages it is a bit pattern, in device classes a number."""
    size = field.format.size
    if field.role != "value":
        return
    if not given:
        yield "the bit pattern of an IEEE 754 number"
    if field.ranged:
        ends = (field.minimum, field.maximum)
        low, high = (number_of(end, size) for end in ends)
        patterns = "" if given else f" ({ends[0]:#x} to {ends[1]:#x})"
        yield f"from {low} to {high}{patterns}"


def _rows(array: Array, markup: Markup) -> str:
    """Return the description of an array: its rows and columns."""
    columns = []
    for column in array.columns:
        each = f" for each bit of {markup.name(column.each)}" if column.each else ""
        unit = f" ({_unit(column.quantity)})" if column.quantity else ""
        note = f", {column.note.rstrip('.')}" if column.note else ""
        columns.append(f"{markup.name(column.name)}{each}{unit}{note}")
    return f"{markup.name(array.rows)} rows of {', '.join(columns)}"


def _choices(table: Enumeration | FlagTable, markup: Markup) -> str:
    """Return the names that a caller may pass, with their numbers."""
    bar = markup.name("|")
    if isinstance(table, FlagTable):
        bits = ", ".join(f"{bit.name} ({bit.mask:#x})" for bit in table.bits)
        return f"{bits}, or several joined by {bar}"
    values = ", ".join(_numbered(value) for value in table.values if not value.modifier)
    modifiers = " and ".join(map(_numbered, table.modifiers))
    return f"{values}; {modifiers} may be added with {bar}" if modifiers else values


def _numbered(value: EnumValue) -> str:
    number = value.value
    return f"{value.name} ({number if 0 <= number < 10 else hex(number)})"


def _unit(quantity: Quantity) -> str:
    unit = quantity.unit
    if quantity.factor:
        key, value = quantity.factor.key, quantity.factor.value
        return (
            f"in counts of {value} {unit}"
            if key.endswith("_per_count")
            else f"in counts, {value} per {unit}"
        )
    if "unknown" in quantity.rule:
        return f"in counts; scale to {unit} unknown"
    by = quantity.rule.get("setting") or f"the {quantity.rule['by']}"
    return f"in counts; {f'scale to {unit} depends' if unit else 'unit and scale depend'} on {by}"
