"""Settings of an axis: which command writes what another one reads, and how one is put back."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from random import Random
from typing import Final

from stagewire.protocols import Command
from stagewire_conformance.device.checks.ms2000.axis import Axis
from stagewire_conformance.device.checks.ms2000.harmless import harmless_value
from stagewire_conformance.device.trial import EnoughError
from stagewire_ms2000 import PROTOCOL
from stagewire_ms2000 import messages as m

_NEAR: Final = 10_000
"""Counts, a millimetre, from the present increment to those that are tried."""
_LEAST_RAMP: Final = 51
"""Milliseconds; section 22 advises more than 50."""


@dataclass(frozen=True)
class Stored:
    """A setting that can be written and read.

    :param write: the command that writes it; it has one field.
    :param read: the one that reads it.
    :param draw: draws values to try, given the present one.
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
        """What writes it, and what reads it."""
        return self.name, self.read.layout.message

    def written(self, value: int) -> Command:
        """Return the command that writes a value."""
        [field] = self.write.layout.fields
        return self.write(**{field: value})

    def of(self, axis: Axis) -> int:
        """Return what an axis has."""
        return axis.number(self.read)

    def set(self, axis: Axis, value: int) -> None:
        """Write it, and see that nothing is answered."""
        axis.tell(self.written(value))

    def put_back(self, axis: Axis, value: int) -> None:
        """Write what an axis had, and see that it has it again."""
        axis.line.settle()
        axis.line.send(self.written(value), axis.address)
        found = self.of(axis)
        axis.trial.must(
            found == value,
            f"not restored: {self.read.layout.message} of axis {axis.name} was {value}, and is {found} "
            f"although {self.name} wrote {value}",
        )


def _increments(random: Random, present: int) -> list[int]:
    """Return increments near the present one, and one of the other sign."""
    low, high = max(present - _NEAR, -(1 << 23)), min(present + _NEAR, (1 << 23) - 1)
    return [
        harmless_value(random, low, high, 3),
        harmless_value(random, low, high, 3),
        harmless_value(random, -_NEAR, -1, 3),
        harmless_value(random, 0x10000, 0x3FFFF, 3),  # with an upper byte
    ]


def _ramp_times(random: Random, present: int) -> list[int]:
    return [harmless_value(random, _LEAST_RAMP, 0xFE, 1) for _ in range(3)]


def _top_speeds(random: Random, present: int) -> list[int]:
    """Return speeds that are no faster than the present one."""
    return [harmless_value(random, (present + 1) // 2, present, 2) for _ in range(3)]


INCREMENT: Final = Stored(m.WriteIncrementValue, m.ReadIncrementValue(), _increments)
RAMP_TIME: Final = Stored(m.WriteRampingTime, m.ReadRampTime(), _ramp_times)
TOP_SPEED: Final = Stored(m.WriteTopSpeed, m.ReadMaximumSpeed(), _top_speeds)
STORED: Final = (INCREMENT, RAMP_TIME, TOP_SPEED)


def keep(axis: Axis, stored: Stored) -> int:
    """Return what an axis has, and let it be put back at the end of the check.

    Ends the check before anything is written where that could not be: a value that no command writes, or one
    whose bytes a controller may take for a setup command.
    """
    value = stored.of(axis)
    trial, prefix = axis.trial, PROTOCOL.marks.prefix
    size = stored.write.layout.length
    raw = (value % 256**size).to_bytes(size, "little")
    [entry] = trial.declared.registry.fields(stored.name, "request").values()
    trial.need(
        entry["minimum"] <= value <= entry["maximum"],
        f"axis {axis.name} has {value}, which {stored.name} could not put back; nothing was written",
        came=raw,
    )
    if any(first == prefix and second in PROTOCOL.marks.setup for first, second in pairwise(raw)):
        trial.inconclusive(
            f"axis {axis.name} has {value}, whose bytes {raw.hex(' ')} a controller may take for a setup "
            f"command; {stored.name} is not tried, since it could not be put back"
        )
        raise EnoughError
    trial.undo(
        f"{stored.read.layout.message} of axis {axis.name}: {value}",
        lambda: stored.put_back(axis, value),
    )
    return value
