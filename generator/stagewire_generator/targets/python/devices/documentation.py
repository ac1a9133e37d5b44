"""What docstrings of device classes say of a value, and of a method."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from decimal import Decimal
from fractions import Fraction

from stagewire_generator.model import Factor, Field, Message, Protocol
from stagewire_generator.targets.documentation import errata_of, field_facts, sentence
from stagewire_generator.targets.python.devices.arguments import Argument, Way
from stagewire_generator.targets.python.devices.plan import Call
from stagewire_generator.targets.python.source import MARKUP, docstring, paragraph, where

_FIRST = {
    "get_": "Read the {}.",
    "set_": "Write the {}: every value, in one frame.",
    "change_": "Change some of the {}.",
}
_WAITS = {
    "action": "Waits for the end.",
    "halt": "Goes before whatever waits to be sent.",
    "query": "Waits for the answer.",
}
_STARTS = "Returns as soon as it is sent, with a handle to wait on."
_ROLES = {"get_": ("req", "get"), "set_": ("set",), "change_": ("req", "get", "set")}

_VALUE = "MissingFieldError, OutOfRangeError, BadValueError and UnknownScaleError"
_LINK = "TransportLostError and SessionClosedError when there is no line (any more)"
_WRONG = (
    f"{_VALUE}, before a byte is sent, for a value that is not given, out of range, no number, or in a "
    "unit whose scale is not known"
)
_BUSY = "MotionUnderWayError, before a byte is sent, while something moves"
_OUTSIDE = "LimitError, before it moves, for a target outside a travel that is known"
_LATE = "ReplyTimeoutError when no answer came in time"
_MISSED = "TargetNotReachedError when it ended elsewhere"
_FAULT = "ControllerFaultError when the controller reported a fault"
_ENDS = (
    "MotionStoppedError when it was stopped; MotionTimeoutError when no end came in time, and then it may "
    "still be moving"
)
_CHANGED = (
    f"{_VALUE}, before anything is written, for a value that is out of range (also one that was only "
    "read), no number, or in a unit whose scale is not known"
)
_CHANGE = "Reads, changes what is given, writes all in one frame, under one lock; returns what was written."
_PLACES = 10**9
_TIMEOUT = ":param timeout: in seconds; None for that of the device."


def raw_text(field: Field) -> str:
    """Return what is said of a raw value."""
    return field_facts(field, MARKUP)


def unit_text(argument: Argument, way: Way) -> str:
    """Return what is said of a value in a unit: its range, or what decides on its scale."""
    field, quantity = argument.field, argument.field.quantity
    assert quantity
    case = f", where {quantity.rule['setting']} is {way.case}" if way.case else ""
    text = f"``{argument.keyword}`` in {way.unit}{case}"
    scale = quantity.factor or quantity.rule
    if way.case:
        scale = quantity.rule["cases"][way.case]["scale"]
    if isinstance(scale, Factor):
        low, high = (_number(n, scale) for n in (field.minimum, field.maximum))
        return f"{text}; {low} to {high}"
    if "unknown" in scale:
        return f"{text}; refused, since its scale is not known: {scale['unknown']}"
    decides = {"stage": "the stage on its controller", "unit": "the kind of unit"}
    return f"{text}; its scale depends on {decides.get(scale['by'], scale.get('setting'))}"


def _number(counts: int, factor: Factor) -> str:
    """Return counts in a unit: as a decimal if it is one, else in ten digits."""
    value = Fraction(counts) / factor.counts_per_unit
    if (value * _PLACES).denominator == 1:
        return f"{Decimal(value.numerator) / Decimal(value.denominator):f}"
    return f"{float(value):.10g}"


def part_doc(protocol: Protocol, call: Call) -> str:
    """Return the docstring of a part, escaped."""
    names = ", ".join(f"``{message.name}``" for message in call.members.values())
    found = where(protocol, _pages(call.members.values()), call.message.overlay)
    return docstring(
        f"{' '.join(call.words).capitalize()}.\n\n    {paragraph(f'{names}; {found}.', 4)}\n    "
    )


def method_doc(
    protocol: Protocol, call: Call, verb: str, arguments: Sequence[Argument], timeout: bool
) -> str:
    """Return the docstring of a method, escaped.

    :param arguments: those that the caller may give.
    :param timeout: whether he may give that, too.
    """
    if call.kind == "set":
        roles = _ROLES[verb]
        members = [call.members[role] for role in roles]
        parts = [_FIRST[verb].format(" ".join(call.words)), *_paragraphs(protocol, call, members)]
    else:
        waits = _STARTS if verb == "start_" else _WAITS.get(call.kind, "")
        parts = [
            f"Send ``{call.message.name}``.",
            *_paragraphs(protocol, call, [call.message], waits),
        ]
    lines = [paragraph(line, 8, 4) for line in _parameters(arguments)]
    if timeout:
        lines.append(_TIMEOUT)
    parts.append("\n        ".join(lines))
    parts.append(paragraph(_errors(call, verb, bool(arguments)), 8))
    return docstring("\n\n        ".join(filter(None, parts)) + "\n        ")


def _errors(call: Call, verb: str, given: bool) -> str:
    """Return which errors a method raises, in which case.

    :param given: whether the caller gives it a value.
    """
    wrong = [_WRONG] if given else []
    if call.kind == "action":
        targets = [_OUTSIDE] if any(a.field.target for a in call.arguments) else []
        exchange = call.message.exchange
        ended = [_MISSED] if targets or "stored" in exchange else []
        ended += [_FAULT] if "completes_with" in exchange else []
        errors = [*wrong, *targets, _BUSY, *([] if verb == "start_" else [*ended, _ENDS])]
    elif call.kind == "halt":
        ends = call.message.exchange.get("completes_with")
        errors = [*wrong, *(["ReplyTimeoutError when no end came in time"] if ends else [])]
    elif verb == "change_":
        errors = [_CHANGED, _LATE]
    else:
        errors = [*wrong, *([_LATE] if verb == "get_" or call.kind == "query" else [])]
    text = f"Raises {'; '.join([*errors, _LINK])}."
    return f"{_CHANGE} {text}" if verb == "change_" else text


def _paragraphs(
    protocol: Protocol, call: Call, members: Sequence[Message], waits: str = ""
) -> Iterator[str]:
    """Yield what is said of the messages of a method.

    :param waits: what the method waits for, where its first line names the message.
    """
    found = where(protocol, _pages(members), members[0].overlay)
    names = ", ".join(f"``{member.name}``" for member in members)
    place = f"{names}, {found}." if call.kind == "set" else sentence(found)
    text = " ".join(filter(None, (sentence(members[0].summary), waits, place)))
    yield paragraph(text, 8)
    notes = [note for note in (members[0].note, call.layout.note) if note]
    yield paragraph(" ".join(map(sentence, notes)), 8)
    slugs = dict.fromkeys(slug for member in members for slug in member.errata)
    errata = [f"``{erratum.id}``" for erratum in errata_of(protocol, slugs)]
    if errata:
        yield paragraph(f"{'Errata' if len(errata) > 1 else 'Erratum'} {', '.join(errata)}.", 8)


def _pages(members: Iterable[Message]) -> list[int]:
    return sorted({page for member in members for page in member.pages})


def _parameters(arguments: Sequence[Argument]) -> Iterator[str]:
    for argument in arguments:
        yield f":param {argument.keyword}: {field_facts(argument.field, MARKUP, given=True)}."
        for way in argument.ways:
            yield f":param {way.keyword}: {unit_text(argument, way)}."
