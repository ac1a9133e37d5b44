"""Every command that reads: exactly its bytes come back, and the same again while nothing changes.

The identification of an axis is read as well (section 7).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from stagewire.protocols import Command, Reply
from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.ms2000.axis import Axis
from stagewire_conformance.device.checks.ms2000.axis_check import (
    SETTINGS_READ,
    AxisCase,
    axis_check,
    requests_of,
)
from stagewire_conformance.device.declaration import Declaration
from stagewire_conformance.device.permissions import Permissions
from stagewire_ms2000 import messages as m

_MOTORS: Final = ("X", "Y", "Z")
"""The axes of which the document says what they answer."""
_MOTOR: Final = b"EMOT "
_LAST: Final = b": "
"""The sixth byte: the colon of the example, or the blank of the text."""


IDENTIFICATION: Final = Kind(
    name="identification",
    title="Every axis says what it is",
    rules=("identification-reply", "identification-blanks", "axis-identifiers"),
)


@axis_check(
    IDENTIFICATION,
    "{axis} says in six bytes what it is",
    messages=("READ_IDENTIFICATION",),
    seconds=0.2,
)
def _identification(axis: Axis) -> None:
    came = axis.ask(m.ReadIdentification(), quiet=0.2).pack()
    if axis.name not in _MOTORS:
        axis.trial.info(
            f"axis {axis.name} says that it is {came!r}; the document does not say what is due"
        )
        return
    axis.trial.must(
        came[:5] == _MOTOR,
        f"axis {axis.name} says that it is {came!r}; it has to say EMOT and a blank",
        wanted=_MOTOR + _LAST[:1],
        came=came,
    )
    axis.trial.must(
        came[5] in _LAST,
        f"the identification of axis {axis.name} ends with {came[5]:#04x}; it ends with a colon or a blank",
        wanted=_MOTOR + _LAST[:1],
        came=came,
    )
    if came[5:] == b" ":
        axis.trial.info("its sixth byte is the blank of the text, not the colon of the example")


_OWN: Final = ("READ_IDENTIFICATION",)
"""Has a kind of its own."""


READS: Final = Kind(
    name="reads",
    title="Every command that reads is answered by exactly its bytes",
    rules=(
        "no-ascii", "command-parts", "ends-with-colon", "command-identifiers", "size-of-data",
        "data-of-command", "no-blanks-in-replies", "status-answered", "position-reply", "position-size",
        "increment-reply", "position-and-status-reply", "position-and-status-size",
        "current-speed-reply", "ramp-time-reply", "ramp-time-reply-range", "maximum-speed-reply",
        "target-reply", "status-byte-reply",
    ),
)  # fmt: skip


def _requests(declared: Declaration, allowed: Permissions) -> Iterator[AxisCase]:
    requests = requests_of(declared)
    for place in declared.places:
        for name in sorted(requests.keys() - {*_OWN}, key=list(requests).index):
            reply = requests[name].reply
            assert reply is not None
            size = f"{reply.layout.length} byte{'s'[: reply.layout.length - 1]}"
            yield AxisCase(
                place=place,
                name=name,
                words={"size": size},
                arguments={"request": requests[name]},
                messages=(name,),
            )


@axis_check(
    READS,
    "{request.layout.message} of {axis} is answered by {size}, and nothing else",
    each=_requests,
)
def _reads(axis: Axis, request: Command) -> None:
    name = request.layout.message
    first = axis.ask(request)
    _values_are_known(axis, first)
    second = axis.ask(request, after="asked again")
    if name in SETTINGS_READ:
        axis.trial.must(
            first == second,
            f"{name} of axis {axis.name} answers {second!r} where it answered {first!r}, and nothing was set",
            wanted=first.pack(),
            came=second.pack(),
        )


def _values_are_known(axis: Axis, reply: Reply) -> None:
    """Hold the values of a reply against the ranges and names that the document has for them."""
    name = reply.layout.message
    for field, entry in axis.trial.declared.registry.fields(name, "reply").items():
        value = getattr(reply, field)
        if entry.get("enum"):
            known = ", ".join(f"{value:#04x}" for value in entry["enum"].values())
            axis.trial.must(
                value in entry["enum"].values(),
                f"{name} of axis {axis.name} answers {value:#04x}; it is one of {known}",
                came=reply.pack(),
            )
        elif isinstance(value, int):
            axis.trial.must(
                entry["minimum"] <= value <= entry["maximum"],
                f"{name} of axis {axis.name} answers {field} {value}; it lies within {entry['minimum']} to "
                f"{entry['maximum']}",
                came=reply.pack(),
            )
