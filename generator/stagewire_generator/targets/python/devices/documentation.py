"""Docstrings of device classes: values, parts and methods."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from decimal import Decimal
from fractions import Fraction

from stagewire_generator.model import Message, Protocol
from stagewire_generator.model_fields import Field
from stagewire_generator.model_scales import (
    Factor,
)
from stagewire_generator.targets.documentation import (
    errata_of,
    field_facts,
    first_sentence,
    sentence,
    title_of,
    where_all,
)
from stagewire_generator.targets.python.devices.arguments import Argument, Way
from stagewire_generator.targets.python.devices.plan import Call
from stagewire_generator.targets.python.source import MARKUP, WIDTH, docstring, paragraph

_FIRST = {
    "get_": "Read the {}.",
    "set_": "Set the {}.",
    "change_": "Change the {}.",
}
_HOW = {
    "get_": "",
    "set_": "All values are written in one frame.",
    "change_": (
        "Reads the current values, replaces the given ones and writes all of them in one frame, under one "
        "lock. Returns the values written."
    ),
    "action": "Waits until the motion has ended.",
    "halt": "Sent ahead of all waiting requests.",
    "query": "Waits for the reply.",
    "start_": "Returns a handle for the motion as soon as the message is sent.",
}
_ROLES = {"get_": ("req", "get"), "set_": ("set",), "change_": ("req", "get", "set")}

_VALUES = {
    "MissingFieldError": "if a value is missing; nothing is sent",
    "OutOfRangeError": "if a value is out of range; nothing is sent",
    "BadValueError": "if a value has the wrong type; nothing is sent",
    "UnknownScaleError": "if a value is in a unit whose scale is unknown; nothing is sent",
}
_CHANGED = {
    "MissingFieldError": "if the value of a field is unknown; nothing is written",
    "OutOfRangeError": "if a given value or a current one is out of range; nothing is written",
    "BadValueError": "if a value has the wrong type; nothing is written",
    "UnknownScaleError": "if a value is in a unit whose scale is unknown; nothing is written",
}
_OUTSIDE = {"LimitError": "if the target is outside the known travel; nothing is sent"}
_BUSY = {"MotionUnderWayError": "if a motion is under way; nothing is sent"}
_LATE = {"ReplyTimeoutError": "if no reply arrives in time"}
_NO_END = {"ReplyTimeoutError": "if the end of the motion is not reported in time"}
_MISSED = {"TargetNotReachedError": "if the motion ends at another position"}
_FAULT = {"ControllerFaultError": "if the controller reports a fault"}
_ENDS = {
    "MotionStoppedError": "if the motion is stopped",
    "MotionTimeoutError": "if the end is not reported in time; the axis may still be moving",
}
_LINK = {
    "TransportLostError": "if the connection is lost",
    "SessionClosedError": "if the session is closed",
}
_PLACES = 10**9
_TIMEOUT = ":param timeout: in seconds; default: the timeout of the device."


def raw_text(field: Field) -> str:
    """Return the description of a raw value."""
    return field_facts(field, MARKUP)


def unit_text(argument: Argument, way: Way) -> str:
    """Return the description of a value in a unit: its range, or what its scale depends on."""
    field, quantity = argument.field, argument.field.quantity
    assert quantity
    case = f", if {quantity.rule['setting']} is {way.case}" if way.case else ""
    text = f"``{argument.keyword}`` in {way.unit}{case}"
    if way.rotary:
        return f"{text}, for a rotary stage"
    scale = quantity.factor or quantity.rule
    ends = field.minimum, field.maximum
    if way.case:
        chosen = quantity.rule["cases"][way.case]
        scale = chosen["scale"]
        ends = chosen.get("minimum", field.minimum), chosen.get("maximum", field.maximum)
    if isinstance(scale, Factor):
        low, high = (_number(n, scale) for n in ends)
        return f"{text}; from {low} to {high}"
    if "unknown" in scale:
        return f"{text}; not available, because the scale is unknown: {scale['unknown']}"
    decides = {"stage": "the stage and its controller", "unit": "the controller model"}
    return f"{text}; the scale depends on {decides.get(scale['by'], scale.get('setting'))}"


def _number(counts: int, factor: Factor) -> str:
    """Return counts in a unit: as an exact decimal if possible, else with ten digits."""
    value = Fraction(counts) / factor.counts_per_unit
    if (value * _PLACES).denominator == 1:
        return f"{Decimal(value.numerator) / Decimal(value.denominator):f}"
    return f"{float(value):.10g}"


def part_doc(protocol: Protocol, call: Call) -> str:
    """Return the docstring of a part, escaped."""
    names = ", ".join(f"``{message.name}``" for message in call.members.values())
    found = where_all(protocol, _places(call.members.values()))
    first = paragraph(_opening(call, start=False)[0], 4)
    return docstring(f"{first}\n\n    {paragraph(f'{names}; {found}.', 4)}\n    ")


def _title(call: Call) -> str:
    """Return the title of a call as the beginning of a sentence."""
    title = title_of(call.message) if call.message.kind == "message" else " ".join(call.words)
    stored = " that the controller has stored" if call.words[-1:] == ("stored",) else ""
    return title[:1].upper() + title[1:] + stored


def method_doc(
    protocol: Protocol, call: Call, verb: str, arguments: Sequence[Argument], timeout: bool
) -> str:
    """Return the docstring of a method, escaped.

    :param arguments: the arguments of the method, without its timeout.
    :param timeout: whether the method has a timeout.
    """
    if call.kind == "set":
        members = [call.members[role] for role in _ROLES[verb]]
        first = _FIRST[verb].format(title_of(call.message))
        summary, how = members[0].summary, _HOW[verb]
    else:
        members = [call.message]
        first, summary = _opening(call, verb == "start_")
        how = _HOW["start_"] if verb == "start_" else _HOW.get(call.kind, "")
    texts = filter(None, (sentence(summary) if summary else "", how))
    parts = [first, *_paragraphs(protocol, call, members, " ".join(texts))]
    lines = [paragraph(line, 8, 4) for line in _parameters(arguments)]
    if timeout:
        lines.append(_TIMEOUT)
    errors = _errors(call, verb, arguments)
    lines += [paragraph(f":raises {name}: {case}.", 8, 4) for name, case in errors.items()]
    parts.append("\n        ".join(lines))
    return docstring("\n\n        ".join(filter(None, parts)) + "\n        ")


def _opening(call: Call, start: bool) -> tuple[str, str]:
    """Return the first line of the docstring of a method that sends one message, and the rest of its summary.

    The first line of a command is its summary: its title is the printed heading, which is not a sentence.
    """
    end = " without waiting for the end" if start else ""
    message = call.message
    if message.kind == "message":
        return f"{_title(call)}{end}.", message.summary
    head, rest = first_sentence(sentence(message.summary))
    head = head.removesuffix(".")
    first = f"{head}{',' if start and ',' in head else ''}{end}."
    if len(first) + 8 + len('"""') > WIDTH:
        return f"{_title(call)}{end}.", message.summary
    return first, rest


def _errors(call: Call, verb: str, arguments: Sequence[Argument]) -> dict[str, str]:
    """Return the errors that a method raises, each with its condition."""
    values = _errors_of_values(_VALUES, arguments) if arguments else {}
    if call.kind == "action":
        targets = _OUTSIDE if any(a.field.target for a in call.arguments) else {}
        started = values | targets | _BUSY
        if verb == "start_":
            return started | _LINK
        exchange = call.message.exchange
        missed = _MISSED if targets or "stored" in exchange else {}
        fault = _FAULT if "completes_with" in exchange else {}
        return started | missed | fault | _ENDS | _LINK
    if call.kind == "halt":
        return values | (_NO_END if call.message.exchange.get("completes_with") else {}) | _LINK
    if verb == "change_":
        return _errors_of_values(_CHANGED, arguments) | _LATE | _LINK
    return values | (_LATE if verb == "get_" or call.kind == "query" else {}) | _LINK


def _errors_of_values(errors: dict[str, str], arguments: Sequence[Argument]) -> dict[str, str]:
    """Return the errors of values, without the one of units if no argument is in a unit."""
    in_units = any(argument.ways for argument in arguments)
    return {k: v for k, v in errors.items() if in_units or k != "UnknownScaleError"}


def _paragraphs(
    protocol: Protocol, call: Call, members: Sequence[Message], how: str
) -> Iterator[str]:
    """Yield the description of a method: meaning and sequence, messages and pages, notes, errata.

    :param members: the messages that the method exchanges.
    :param how: sentences on its meaning and sequence.
    """
    found = where_all(protocol, _places(members))
    names = ", ".join(f"``{member.name}``" for member in members)
    yield paragraph(how, 8)
    notes = [note for note in (members[-1].note, call.layout.note) if note]
    yield paragraph(" ".join(map(sentence, notes)), 8)
    slugs = dict.fromkeys(slug for member in members for slug in member.errata)
    errata = [f"``{erratum.id}``" for erratum in errata_of(protocol, slugs)]
    listed = f" {'Errata' if len(errata) > 1 else 'Erratum'} {', '.join(errata)}." if errata else ""
    yield paragraph(f"{names}, {found}.{listed}", 8)


def _places(members: Iterable[Message]) -> Iterator[tuple[int, str]]:
    """Yield each page of the messages, with its overlay."""
    return ((page, member.overlay) for member in members for page in member.pages)


def _parameters(arguments: Sequence[Argument]) -> Iterator[str]:
    for argument in arguments:
        yield f":param {argument.keyword}: {field_facts(argument.field, MARKUP, given=True)}."
        for way in argument.ways:
            yield f":param {way.keyword}: {unit_text(argument, way)}."
