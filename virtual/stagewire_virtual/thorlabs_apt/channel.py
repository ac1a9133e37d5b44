"""One channel of a controller, as its behaviour sees it, with its parameters and its part of the EEPROM."""

from __future__ import annotations

import random
from collections.abc import Callable, Mapping, MutableMapping
from typing import TYPE_CHECKING, Any

from stagewire import Frame, FramedMessage
from stagewire_virtual.clock import Clock
from stagewire_virtual.options import Settings
from stagewire_virtual.units import Unit

if TYPE_CHECKING:
    from stagewire_virtual.thorlabs_apt.behaviour import Behaviour

__all__ = ["Channel"]


class Channel:
    """What a behaviour may know of its channel, and how it speaks to the host.

    :param ident: the channel ident on the wire, 1 or 2.
    :param unit: what the registry says of the unit.
    :param clock: the time.
    :param settings: what the user told.
    :param random: for whatever is left to chance; seeded by the instrument, its own for each channel.
    :param clockwise: 1 where the position counter rises clockwise, -1 where it falls. Clockwise (CW) is
        direction 1, forward, of jogs and velocity moves, of the motion and limit bits of the status, and of
        the limit switch parameters; the document gives it no sign. Homing, positions and distances do not
        depend on it.
    """

    behaviour: Behaviour
    """What it does over time; a behaviour puts itself here when it is made."""

    def __init__(
        self,
        ident: int,
        unit: Unit,
        clock: Clock,
        settings: Settings,
        random: random.Random,
        clockwise: int = 1,
    ) -> None:
        self.ident = ident
        self.unit = unit
        self.clock = clock
        self.settings = settings
        self.random = random
        self.clockwise = clockwise
        self.enabled = True
        self.parameters: MutableMapping[str, dict[str, Any]] = {}
        """The values of each parameter set, ``MOT_VELPARAMS`` -> field -> value, without the channel.

        All are integers but the part number of the stage, which is text.
        """
        self._defaults: Mapping[str, Mapping[str, Any]] = {}
        self._saved: dict[str, dict[str, Any]] = {}
        self._stuck = False
        self.send: Callable[[FramedMessage, Frame], None] = _nobody_listens
        """Say something that a frame of the host caused; addresses and muting are the controller's."""
        self.report_fault: Callable[[Frame, str], None] = _no_fault
        """Say why a message was refused; the controller tells the host if it answers such things."""

    @property
    def stuck(self) -> bool:
        """Whether the axis does not move, whatever its motor does; set by a fault."""
        return self._stuck

    @stuck.setter
    def stuck(self, stuck: bool) -> None:
        if stuck != self._stuck:
            self._stuck = stuck
            self.behaviour.stuck_changed()

    def answers(self, message: str) -> bool:
        """Say whether the unit has a message."""
        return message in self.unit.messages

    def parameter(self, set_name: str, field: str, otherwise: int = 0) -> int:
        """Return a value of a parameter set, or ``otherwise`` where the unit does not have the set."""
        value: int = self.parameters.get(set_name, {}).get(field, otherwise)
        return value

    def begin_with(self, defaults: Mapping[str, Mapping[str, Any]]) -> None:
        """Take the parameters of a new controller, whose EEPROM is empty."""
        self._defaults = defaults
        self.restore()

    def save(self, set_name: str) -> None:
        """Write the values of a parameter set into the EEPROM."""
        self._saved[set_name] = dict(self.parameters[set_name])

    def restore(self) -> None:
        """Take the parameters of the EEPROM again, and of a new controller where nothing was saved."""
        for set_name, values in self._defaults.items():
            self.parameters[set_name] = {**values, **self._saved.get(set_name, {})}


def _nobody_listens(message: FramedMessage, cause: Frame) -> None:
    """Take what is said before the channel is built in."""


def _no_fault(cause: Frame, why: str) -> None:
    """Take what is refused before the channel is built in."""
