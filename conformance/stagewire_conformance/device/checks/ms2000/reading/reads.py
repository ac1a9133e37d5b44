"""Every command that reads: the reply has the right length, and is the same again while nothing changes.

The identification of an axis is also checked (section 7).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from stagewire.protocols import Command, Reply
from stagewire_conformance.device.causes import Cause
from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.ms2000.axis import Axis
from stagewire_conformance.device.checks.ms2000.axis_check import (
    SETTINGS_READ,
    AxisCase,
    axis_check,
    requests_of,
)
from stagewire_conformance.device.checks.ms2000.broken_rules import rule_of_value
from stagewire_conformance.device.declaration import Declaration
from stagewire_conformance.device.permissions import Permissions
from stagewire_ms2000 import messages as m

_MOTORS: Final = ("X", "Y", "Z")
"""The axes whose identification the document defines."""
_MOTOR: Final = b"EMOT "
_LAST: Final = b": "
"""The sixth byte: the colon of the example, or the blank of the text."""


IDENTIFICATION: Final = Kind(
    name="identification",
    title="Every axis identifies itself",
    rules=("identification-reply", "identification-blanks", "axis-identifiers"),
)


@axis_check(
    IDENTIFICATION,
    "{axis} identifies itself with six bytes",
    messages=("READ_IDENTIFICATION",),
    seconds=0.2,
)
def _identification(axis: Axis) -> None:
    came = axis.ask(m.ReadIdentification(), quiet=0.2).pack()
    if axis.name not in _MOTORS:
        axis.trial.info(
            f"axis {axis.name} identifies itself as {came!r}; the document does not define "
            "its identification"
        )
        return
    axis.trial.must(
        came[:5] == _MOTOR,
        f"axis {axis.name} identifies itself as {came!r}; it should be EMOT and a blank",
        wanted=_MOTOR + _LAST[:1],
        came=came,
        rule="identification-reply",
        cause=Cause("READ_IDENTIFICATION", "text"),
    )
    axis.trial.must(
        came[5] in _LAST,
        f"the identification of axis {axis.name} ends with {came[5]:#04x}; it should end "
        "with a colon or a blank",
        wanted=_MOTOR + _LAST[:1],
        came=came,
        rule="identification-blanks",
        cause=Cause("READ_IDENTIFICATION", "end"),
    )
    if came[5:] == b" ":
        axis.trial.info("the sixth byte is the blank of the text, not the colon of the example")


_OWN: Final = ("READ_IDENTIFICATION",)
"""Commands that have a kind of their own."""


READS: Final = Kind(
    name="reads",
    title="Every read command gets a reply of the correct length",
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
    "{request.layout.message} of {axis} is answered with exactly {size}",
    each=_requests,
)
def _reads(axis: Axis, request: Command) -> None:
    name = request.layout.message
    first = axis.ask(request)
    _values_are_known(axis, first)
    second = axis.ask(request, after="at the second request")
    if name in SETTINGS_READ:
        axis.trial.must(
            first == second,
            f"{name} of axis {axis.name} was answered with {second!r} after {first!r}, "
            "though nothing was set in between",
            wanted=first.pack(),
            came=second.pack(),
            rule=rule_of_value(name),
            cause=Cause(name, "values"),
        )


def _values_are_known(axis: Axis, reply: Reply) -> None:
    """Compare the values of a reply with the documented ranges and names."""
    name = reply.layout.message
    for field, entry in axis.trial.declared.registry.fields(name, "reply").items():
        value = getattr(reply, field)
        if entry.get("enum"):
            known = ", ".join(f"{value:#04x}" for value in entry["enum"].values())
            axis.trial.must(
                value in entry["enum"].values(),
                f"{name} of axis {axis.name} returned {value:#04x}; it should be one of {known}",
                came=reply.pack(),
                rule=rule_of_value(name),
                cause=Cause(name, "letter"),
            )
        elif isinstance(value, int):
            axis.trial.must(
                entry["minimum"] <= value <= entry["maximum"],
                f"{name} of axis {axis.name} returned {field} {value}; it should be from "
                f"{entry['minimum']} to {entry['maximum']}",
                came=reply.pack(),
                rule=rule_of_value(name),
                cause=Cause(name, "range"),
            )
