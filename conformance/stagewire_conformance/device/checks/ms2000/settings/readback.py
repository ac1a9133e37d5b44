"""Settings of an axis are read back as written, and nothing else changes (sections 21, 22 and 24).

Write commands that are truncated or have a wrong size must change nothing (section 2).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from stagewire_conformance.device.causes import EFFECT, UNSOLICITED, Cause
from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.ms2000.axis import Axis, Clean
from stagewire_conformance.device.checks.ms2000.axis_check import AxisCase, axis_check, first_place
from stagewire_conformance.device.checks.ms2000.broken_rules import rule_of_silence, rule_of_write
from stagewire_conformance.device.checks.ms2000.harmless import END, harmless_bytes
from stagewire_conformance.device.checks.ms2000.stored import (
    BYTE_ORDER,
    STORED,
    TOP_SPEED,
    Stored,
    keep,
)
from stagewire_conformance.device.declaration import Declaration
from stagewire_conformance.device.lines.command_line import QUIET
from stagewire_conformance.device.permissions import Need, Permissions

_ROUNDING: Final = 0.02
"""The relative difference of a speed that may be due to rounding: servos have their own steps."""


READBACK: Final = Kind(
    name="readback",
    title="Settings are read back as written, and nothing else changes",
    rules=(
        "data-order", "twos-complement", "data-of-command", "increment-written",
        "increment-write-no-reply", "ramp-time-written", "ramp-time-range", "ramp-time-no-reply",
        "top-speed-written", "top-speed-no-reply",
    ),
)  # fmt: skip


def _stored_of_all_axes(declared: Declaration, allowed: Permissions) -> Iterator[AxisCase]:
    for place in declared.places:
        for stored in STORED:
            yield AxisCase(
                place=place,
                name=stored.name,
                arguments={"stored": stored},
                messages=stored.messages,
            )


@axis_check(
    READBACK,
    "{stored.read.layout.message} of {axis} returns the value that {stored.name} wrote, "
    "and nothing else changes",
    needs={Need.SETTINGS},
    does="writes increment, ramp time and top speed of every axis, and restores them",
    seconds=0.6,
    each=_stored_of_all_axes,
)
def _readback(axis: Axis, stored: Stored) -> None:
    trial = axis.trial
    others = _others(axis, stored)
    before = [each.of(other) for other, each in others]
    present = keep(axis, stored)
    for value in stored.draw(trial.random, present):
        stored.set(axis, value)
        _is_there(axis, stored, value)
        for (other, each), was in zip(others, before, strict=True):
            found = each.of(other)
            if not trial.must(
                found == was,
                f"{stored.name} of axis {axis.name} changed {each.read.layout.message} of axis "
                f"{other.name} from {was} to {found}; it should change only its own setting",
                rule=rule_of_write(stored.name),
                cause=Cause(stored.name, "another setting"),
            ):
                each.put_back(other, was)


def _others(axis: Axis, stored: Stored) -> list[tuple[Axis, Stored]]:
    """Return all other settings of all axes that can be written and read."""
    return [
        (Axis(axis.trial, place), each)
        for place in axis.trial.declared.places
        for each in STORED
        if (place, each) != (axis.place, stored) and place.messages.issuperset(each.messages)
    ]


def _is_there(axis: Axis, stored: Stored, value: int) -> None:
    size = stored.write.layout.length
    found = stored.of(axis)
    read = stored.read.layout.message
    text = f"{stored.name} of axis {axis.name} wrote {value}, but {read} then returned {found}"
    raw, came = ((each % 256**size).to_bytes(size, "little") for each in (value, found))
    reversed_order = found != value and came == raw[::-1]
    if stored is TOP_SPEED and abs(found - value) <= max(1, _ROUNDING * value):
        axis.trial.should(
            found == value,
            f"{text}: the value was rounded",
            wanted=raw,
            came=came,
            rule=rule_of_write(stored.name),
            cause=Cause(stored.name, EFFECT),
        )
    else:
        axis.trial.must(
            found == value,
            text,
            wanted=raw,
            came=came,
            rule="data-order" if reversed_order else rule_of_write(stored.name),
            cause=BYTE_ORDER if reversed_order else Cause(stored.name, EFFECT),
        )


_LARGE: Final = 7
"""A size that is not supported up to firmware 3.3."""


WRITTEN_SIZE: Final = Kind(
    name="written-size",
    title="A write command with a wrong size changes nothing",
    rules=(
        "size-of-data", "sizes-supported", "errors-ignored", "colon-after-command-aborts",
        "data-of-command",
    ),
)  # fmt: skip


def _stored_of_one_axis(declared: Declaration, allowed: Permissions) -> Iterator[AxisCase]:
    for stored in STORED:
        yield AxisCase(
            place=first_place(declared, *stored.messages),
            name=stored.name,
            arguments={"stored": stored},
            messages=stored.messages,
        )


@axis_check(
    WRITTEN_SIZE,
    "{stored.name} with a wrong size changes nothing",
    needs={Need.SETTINGS},
    does="sends write commands with a wrong size, which should be ignored",
    seconds=1.0,
    each=_stored_of_one_axis,
)
def _written_size(axis: Axis, stored: Stored) -> None:
    trial, clean = axis.trial, Clean(axis.trial)
    present = keep(axis, stored)
    id, own = stored.write.layout.id, stored.write.layout.size
    assert own is not None  # every write command has data
    begin = bytes((axis.address, id))
    _is_ignored(axis, stored, present, begin + END, "without size and data")
    clean.again(f"after {stored.name} without size and data")
    for size in (own - 1, own + 1, _LARGE):
        data = harmless_bytes(trial.random, size)
        about = f"with the size {size} and as many bytes"
        _is_ignored(axis, stored, present, begin + bytes((size,)) + data + END, about)
        clean.again(f"after {stored.name} {about}")


def _is_ignored(axis: Axis, stored: Stored, present: int, raw: bytes, about: str) -> None:
    trial = axis.trial
    axis.line.send_bytes(raw, f"{stored.name} {about}")
    came = axis.line.listen(QUIET)
    trial.must(
        not came,
        f"{stored.name} {about} was answered; it should get no reply",
        wanted=b"",
        came=came,
        rule=rule_of_silence(stored.name),
        cause=Cause(stored.name, UNSOLICITED),
    )
    found = stored.of(axis)
    trial.should(
        found == present,
        f"{stored.name} of axis {axis.name} {about} ({raw.hex(' ')}) changed {present} to "
        f"{found}; a command with an error should be ignored",
        rule="errors-ignored",
        cause=Cause("wrong sizes", "written"),
    )
    if found != present:
        axis.line.settle()
        stored.set(axis, present)
