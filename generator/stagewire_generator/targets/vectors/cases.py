"""All cases of a protocol: of each layout, of each message, and of the protocol."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache

from stagewire_generator.framing import part
from stagewire_generator.model import Protocol
from stagewire_generator.targets.vectors.case import Case
from stagewire_generator.targets.vectors.contents import UNNAMED, contents
from stagewire_generator.targets.vectors.framing import Framing
from stagewire_generator.targets.vectors.requests import bad_requests
from stagewire_generator.targets.vectors.subject import Subject
from stagewire_generator.targets.vectors.values import bad_values, is_optional, unfit_values


@lru_cache(maxsize=2)
def cases_of(protocol: Protocol) -> tuple[Case, ...]:
    """Return the cases of a protocol: those of its messages in the order of the registry, then the rest."""
    order = {message.name: place for place, message in enumerate(protocol.messages)}
    # What holds for all messages is in part looked at in one of them.
    cases = sorted(
        _cases(framing_of(protocol)),
        key=lambda case: order.get(case.id.partition("/")[0], len(order)),
    )
    return tuple(cases)


def framing_of(protocol: Protocol) -> Framing:
    """Return what frames the messages of a protocol, for its cases."""
    framing: type[Framing] = part(protocol.framing["kind"], "vectors")
    return framing(protocol)


def _cases(framing: Framing) -> Iterator[Case]:
    for message in framing.protocol.messages:
        for layout in message.layouts:
            of = framing.subject(message, layout)
            yield from _held(framing, of)
            yield from _refused(of)
            yield from framing.of_layout(of)
        yield from framing.of_message(message)
    yield from framing.of_protocol()
    yield from bad_requests()


def _held(framing: Framing, of: Subject) -> Iterator[Case]:
    """Yield what can be held in both directions; an encoder refuses what is out of its range."""
    for content in contents(of.fields, of.plain):
        raw = framing.frame(of, content.held)
        expected = raw if content.ranged else "out_of_range"
        yield of.encode(content.name, "", expected, content.given)
        if content.decoded:
            yield of.decode(content.name, "", raw, of.answer(content))


def _refused(of: Subject) -> Iterator[Case]:
    """Yield values that are refused, and fields that are missing or unknown."""
    given = of.plain.given
    kinds = set()
    for field in of.fields:
        if field.role == "reserved" and field.name in UNNAMED:
            continue  # in most headers both parameters are; one is as good as another
        refused = [(*case, "out_of_range") for case in unfit_values(field)]
        if field.format.kind not in kinds:  # what is no number is none in any field
            kinds.add(field.format.kind)
            refused += [(*case, "bad_value") for case in bad_values(field)]
        for name, value, code in refused:
            yield of.encode(field.name + name, "", code, {**given, field.name: value})
        if not is_optional(field):
            others = {name: value for name, value in given.items() if name != field.name}
            yield of.encode(f"{field.name}.missing", "", "missing_field", others)
    yield of.encode("unknown_field", "", "unknown_field", {**given, "no_such_field": 0})
