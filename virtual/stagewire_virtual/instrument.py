"""What sits at the far end of a line: bytes in, bytes out, and a clock."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from stagewire_virtual.clock import Clock
from stagewire_virtual.units import Unit

__all__ = ["Instrument", "Row"]


@dataclass(frozen=True, slots=True)
class Row:
    """One line of the live table: a channel or axis, and what it does at this instant.

    :param part: such as ``bay 1, channel 1`` or ``axis X``.
    :param position: where it is, with its unit, such as ``1.2500 mm`` or ``34304 counts``.
    :param state: what it does, in words: ``moving forward``, ``homed``.
    """

    part: str
    position: str
    state: str


class Instrument:
    """A virtual controller without a line: the base of all of them, and of what is played in place of one.

    Whoever serves it feeds what the host sends to :meth:`receive`, sets :attr:`on_send` to take what the
    controller says, one call for each frame, and lets the clock go on. Nothing that a host sends makes it
    raise.

    :param unit: what the registry says of it.
    :param clock: its time; several may share one.
    """

    def __init__(self, unit: Unit, clock: Clock) -> None:
        self.unit = unit
        self.clock = clock
        self.on_send: Callable[[bytes], None] = _nobody_listens
        self.on_refusal: Callable[[str], None] = _nobody_asks
        """Told in a sentence why something that the host sent was not done; for logs."""

    @property
    def units(self) -> Sequence[Unit]:
        """All that speak here: the unit, and what is in its bays."""
        return [self.unit]

    def host_came(self) -> None:
        """Hear that a host has come; what has no wire for that does not notice."""

    def receive(self, data: bytes) -> None:
        """Take what the host sends, cut at any byte."""
        raise NotImplementedError

    def power_cycle(self) -> None:
        """Switch it off and on: all is forgotten but what is in its EEPROM and where its stages stand."""
        raise NotImplementedError

    def rows(self) -> Sequence[Row]:
        """Return what the live table shows."""
        raise NotImplementedError

    def stick(self, part: str, stuck: bool) -> None:
        """Let an axis stick, or free it; ``part`` is named as in :class:`Row`.

        Raises :class:`~stagewire_virtual.errors.UnknownPartError` for a part that it has not, and for one
        that moves nothing.
        """
        raise NotImplementedError


def _nobody_listens(data: bytes) -> None:
    """Take what is said while no line is connected."""


def _nobody_asks(why: str) -> None:
    """Take why something was refused when nobody keeps a log."""
