"""One channel of a controller, as its behaviour sees it."""

from __future__ import annotations

import random
from collections.abc import Callable, MutableMapping
from dataclasses import dataclass

from stagewire import Frame, FramedMessage, Stage
from stagewire_virtual.clock import Clock
from stagewire_virtual.units import Unit

__all__ = ["Channel", "Settings"]


@dataclass(frozen=True, slots=True)
class Settings:
    """What is told of one channel when a virtual controller is made; what is None, its behaviour chooses.

    :param stage: the stage on it, which gives the scales; without one everything moves in counts.
    :param travel: of a stage in counts, of a piezo actuator in steps of 100 nm.
    :param position: where the stage stands at the beginning, in counts from its reverse end.
    """

    stage: Stage | None = None
    travel: int | None = None
    position: int | None = None


class Channel:
    """What a behaviour may know of its channel, and how it speaks to the host.

    :param ident: the channel ident on the wire, 1 or 2.
    :param unit: what the registry says of the unit.
    :param clock: the time.
    :param settings: what the user told.
    :param random: for whatever is left to chance; seeded by the instrument, its own for each channel.
    """

    def __init__(
        self, ident: int, unit: Unit, clock: Clock, settings: Settings, random: random.Random
    ) -> None:
        self.ident = ident
        self.unit = unit
        self.clock = clock
        self.settings = settings
        self.random = random
        self.enabled = True
        self.stuck = False
        """Set by a fault: the axis does not move, whatever the motor does."""
        self.parameters: MutableMapping[str, dict[str, int]] = {}
        """The values of each parameter set, ``MOT_VELPARAMS`` -> field -> value, without the channel."""
        self.send: Callable[[FramedMessage, Frame], None] = _nobody_listens
        """Say something that a frame of the host caused; addresses, muting and quirks are the controller's."""
        self.report_fault: Callable[[Frame, str], None] = _no_fault
        """Tell the host that a message was refused, if the controller answers such things; why, for the log."""

    def answers(self, message: str) -> bool:
        """Say whether the unit has a message."""
        return message in self.unit.messages

    def parameter(self, set_name: str, field: str, otherwise: int = 0) -> int:
        """Return a value of a parameter set, or ``otherwise`` where the unit does not have the set."""
        return self.parameters.get(set_name, {}).get(field, otherwise)


def _nobody_listens(message: FramedMessage, cause: Frame) -> None:
    """Take what is said before the channel is built in."""


def _no_fault(cause: Frame, why: str) -> None:
    """Take what is refused before the channel is built in."""
