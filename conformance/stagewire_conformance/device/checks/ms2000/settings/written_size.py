"""Commands that write, cut short or with another size than their own: nothing changes (section 2)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from stagewire_conformance.device.check import Kind, Need
from stagewire_conformance.device.checks.ms2000.axis import Axis
from stagewire_conformance.device.checks.ms2000.axis_check import AxisCase, axis_check, first_place
from stagewire_conformance.device.checks.ms2000.clean import Clean
from stagewire_conformance.device.checks.ms2000.harmless import END, harmless_bytes
from stagewire_conformance.device.checks.ms2000.stored import STORED, Stored, keep
from stagewire_conformance.device.declared import Declared
from stagewire_conformance.device.lines.command_line import QUIET
from stagewire_conformance.device.permissions import Permissions

_LARGE: Final = 7
"""A size that is not supported up to firmware 3.3."""


KIND: Final = Kind(
    name="written-size",
    title="A command that writes with another size than its own changes nothing",
    rules=(
        "size-of-data", "sizes-supported", "errors-ignored", "colon-after-command-aborts",
        "data-of-command",
    ),
)  # fmt: skip


def _settings(declared: Declared, allowed: Permissions) -> Iterator[AxisCase]:
    for stored in STORED:
        yield AxisCase(
            place=first_place(declared, *stored.messages),
            name=stored.name,
            words={"write": stored.name},
            arguments={"stored": stored},
            messages=stored.messages,
        )


@axis_check(
    KIND,
    "{write} with another size than its own changes nothing",
    needs={Need.SETTINGS},
    does="sends commands that write with a wrong size, which are to be ignored",
    seconds=1.0,
    each=_settings,
)
def _look(axis: Axis, stored: Stored) -> None:
    trial, clean = axis.trial, Clean(axis.trial)
    present = keep(axis, stored)
    id, own = stored.write.layout.id, stored.write.layout.size
    assert own is not None  # what writes has data
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
    trial.must(not came, f"{stored.name} {about} was answered", wanted=b"", came=came)
    found = stored.of(axis)
    trial.should(
        found == present,
        f"{stored.name} of axis {axis.name} {about} ({raw.hex(' ')}) changed {present} to {found}; what has "
        "an error is ignored",
    )
    if found != present:
        axis.line.settle()
        stored.set(axis, present)
