"""What a run may do beyond asking, as the user allowed it."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from stagewire_conformance.device.ranges import Range

_ALWAYS: Final = ("none", "stream", "stop")
"""Effects of messages that may always be sent."""


class Need(StrEnum):
    """What a check does beyond asking, so that it runs only where that was allowed."""

    SETTINGS = "settings"
    MOTION = "motion"
    EEPROM = "eeprom"


@dataclass(frozen=True)
class Permissions:
    """What was allowed. Asking always is.

    :param settings: change settings, and put them back.
    :param motion: move, and whatever else does something to what is connected, within a range.
    :param eeprom: write the memory that outlasts a power cycle.
    """

    settings: bool = False
    motion: Range | None = None
    eeprom: bool = False

    @property
    def granted(self) -> frozenset[Need]:
        """The needs that are met."""
        met = {
            Need.SETTINGS: self.settings,
            Need.MOTION: self.motion is not None,
            Need.EEPROM: self.eeprom,
        }
        return frozenset(need for need, is_met in met.items() if is_met)

    def opens(self, effect: str | None) -> bool:
        """Return whether a message of this effect may be sent to a controller.

        The effects are those of the registry; ``connection`` and ``reset`` are opened by nothing.
        """
        return effect in _ALWAYS or effect in self.granted
