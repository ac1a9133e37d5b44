"""What a user may tell of a virtual unit when it is made."""

from __future__ import annotations

import enum
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from stagewire import Stage
from stagewire_virtual.errors import BadOptionError

__all__ = ["Line", "Options", "Settings", "known_only"]


class Line(enum.StrEnum):
    """What a controller believes to be connected by; it decides whether it wants to be kept alive."""

    USB = "usb"
    RS232 = "rs232"


@dataclass(frozen=True, slots=True)
class Settings:
    """What is told of one channel or axis; what is None, its behaviour chooses.

    :param stage: the stage on it, which gives the scales; without one everything moves in counts.
    :param travel: of a stage in counts, of a piezo actuator in steps of 100 nm, of an axis of an MS-2000 in
        tenths of a micrometre.
    :param position: where it stands at the beginning, in the same unit, from the reverse end.
    """

    stage: Stage | None = None
    travel: int | None = None
    position: int | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """All that may be told of a unit; what does not concern it is refused when it is made.

    :param seed: decides whatever is left to chance.
    :param serial_number: of the unit, of a rack its motherboard's; None: made of the prefix and the seed.
    :param line: USB, or RS-232, where a controller does not ask for signs of life.
    :param quirks: deviations of real controllers, by name; see :mod:`stagewire_virtual.thorlabs_apt.quirks`.
    :param answer_unsupported: answer HW_RESPONSE to what is refused or not understood, instead of silence.
    :param channels: settings channel by channel, of a rack bay by bay; the last one stands for those
        that follow; () is the default for all.
    :param empty_bays: bays of a rack without a card, counted from 0.
    :param strategies: readings of the MS-2000's document, name -> value.
    """

    seed: int = 0
    serial_number: int | None = None
    line: Line = Line.USB
    quirks: frozenset[str] = frozenset()
    answer_unsupported: bool = False
    channels: tuple[Settings, ...] = ()
    empty_bays: frozenset[int] = frozenset()
    strategies: Mapping[str, str] = field(default_factory=lambda: MappingProxyType({}))

    def settings(self, index: int) -> Settings:
        """Return the settings of the channel that is ``index``-th, counted from 0."""
        if not self.channels:
            return Settings()
        return self.channels[min(index, len(self.channels) - 1)]


def known_only(what: str, given: Iterable[str], known: Iterable[str], unit: str) -> None:
    """Refuse names of some kind of option that the unit does not know.

    Raises :class:`~stagewire_virtual.errors.BadOptionError`, which lists those that it knows.
    """
    names = sorted(known)
    for name in sorted(given):
        if name not in names:
            there = f"there are: {', '.join(names)}" if names else "there is none"
            raise BadOptionError(f"{unit} has no {what} {name} ({there})")
