"""Settings of an axis: the commands that write and read them, and how they are restored."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from random import Random
from typing import Final

from stagewire.protocols import Command
from stagewire_conformance.device.causes import EFFECT, Cause
from stagewire_conformance.device.checks.ms2000.axis import Axis
from stagewire_conformance.device.checks.ms2000.broken_rules import rule_of_value, rule_of_write
from stagewire_conformance.device.checks.ms2000.harmless import harmless_value
from stagewire_conformance.device.trial import EnoughError
from stagewire_ms2000 import PROTOCOL
from stagewire_ms2000 import messages as m

_NEAR: Final = 10_000
"""Counts (1 mm) by which new increments differ from the current one."""
_LEAST_RAMP: Final = 51
"""Milliseconds; section 22 advises more than 50."""


BYTE_ORDER: Final = Cause("numbers", "byte order")
"""The defect that numbers of several bytes have the wrong order, so that none of them can be relied on."""


@dataclass(frozen=True)
class Stored:
    """A setting that can be written and read.

    :param write: the command that writes the setting; it has one field.
    :param read: the command that reads the setting.
    :param draw: draws values to write, given the current one.
    """

    write: type[Command]
    read: Command
    draw: Callable[[Random, int], list[int]]

    @property
    def name(self) -> str:
        """The name of the command that writes it."""
        return self.write.layout.message

    @property
    def messages(self) -> tuple[str, ...]:
        """The names of the commands that write and read the setting."""
        return self.name, self.read.layout.message

    @property
    def defects(self) -> tuple[Cause, ...]:
        """The defects with which the setting does not get the value that is written."""
        return Cause(self.name, EFFECT), Cause(self.name, "another setting"), BYTE_ORDER

    def written(self, value: int) -> Command:
        """Return the command that writes a value."""
        [field] = self.write.layout.fields
        return self.write(**{field: value})

    def of(self, axis: Axis) -> int:
        """Return the current value of an axis."""
        return axis.number(self.read)

    def set(self, axis: Axis, value: int) -> None:
        """Write a value, and check that there is no reply."""
        axis.tell(self.written(value))

    def put_back(self, axis: Axis, value: int) -> None:
        """Restore a value, and check that it is in effect."""
        axis.line.settle()
        axis.tell(self.written(value))
        found = self.of(axis)
        axis.trial.must(
            found == value,
            f"not restored: {self.read.layout.message} of axis {axis.name} was {value}, but is "
            f"{found} after {self.name} wrote {value}",
            rule=rule_of_write(self.name),
            cause=Cause(self.name, EFFECT),
            because=self.defects,
        )


def _increments(random: Random, present: int) -> list[int]:
    """Return increments near the current one, one with the opposite sign, and one with an upper byte."""
    low, high = max(present - _NEAR, -(1 << 23)), min(present + _NEAR, (1 << 23) - 1)
    return [
        harmless_value(random, low, high, 3),
        harmless_value(random, low, high, 3),
        harmless_value(random, -_NEAR, -1, 3),
        harmless_value(random, 0x10000, 0x3FFFF, 3),  # sets the upper byte
    ]


def _ramp_times(random: Random, present: int) -> list[int]:
    return [harmless_value(random, _LEAST_RAMP, 0xFE, 1) for _ in range(3)]


def _top_speeds(random: Random, present: int) -> list[int]:
    """Return speeds that are not faster than the current one."""
    return [harmless_value(random, (present + 1) // 2, present, 2) for _ in range(3)]


INCREMENT: Final = Stored(m.WriteIncrementValue, m.ReadIncrementValue(), _increments)
RAMP_TIME: Final = Stored(m.WriteRampingTime, m.ReadRampTime(), _ramp_times)
TOP_SPEED: Final = Stored(m.WriteTopSpeed, m.ReadMaximumSpeed(), _top_speeds)
STORED: Final = (INCREMENT, RAMP_TIME, TOP_SPEED)


def keep(axis: Axis, stored: Stored) -> int:
    """Return the current value of an axis, and restore it at the end of the check.

    End the check before anything is written if the value could not be restored: because no command can write
    it, or because a controller may take its bytes for a setup command.
    """
    axis.trial.depends_on(BYTE_ORDER)
    value = stored.of(axis)
    trial, prefix = axis.trial, PROTOCOL.marks.prefix
    size = stored.write.layout.length
    raw = (value % 256**size).to_bytes(size, "little")
    [entry] = trial.declared.registry.fields(stored.name, "request").values()
    trial.need(
        entry["minimum"] <= value <= entry["maximum"],
        f"axis {axis.name} has the value {value}, which {stored.name} could not restore; "
        "nothing was written",
        came=raw,
        rule=rule_of_value(stored.read.layout.message),
        cause=Cause(stored.read.layout.message, "range"),
    )
    if any(first == prefix and second in PROTOCOL.marks.setup for first, second in pairwise(raw)):
        trial.inconclusive(
            f"axis {axis.name} has the value {value}, whose bytes {raw.hex(' ')} a controller "
            f"may take for a setup command; {stored.name} was not sent, because the value could "
            "not be restored"
        )
        raise EnoughError
    trial.undo(
        f"{stored.read.layout.message} of axis {axis.name}: {value}",
        lambda: stored.put_back(axis, value),
    )
    return value
