"""A channel with its parameters and its part of the EEPROM, and its behaviour.

A controller answers by the registry alone: it stores what a SET brings and gives it back to the REQ. A
:class:`Behaviour` is the part of a virtual controller that is written by hand: what a channel does over time,
which no table can say. It takes messages that start something (:func:`handles`), gives the values of sets
that live (:func:`live`), is called with sets that were stored (:func:`stored`), and fills the status.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Mapping, MutableMapping
from typing import Any, ClassVar, NamedTuple, TypeVar

from stagewire import Frame, FramedMessage
from stagewire_virtual.clock import Clock
from stagewire_virtual.instrument import Unit, ignore
from stagewire_virtual.options import Settings


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
        self.send: Callable[[FramedMessage, Frame], None] = ignore
        """Say something that a frame of the host caused; addresses and muting are the controller's."""
        self.report_fault: Callable[[Frame, str], None] = ignore
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

    def initialize(self, defaults: Mapping[str, Mapping[str, Any]]) -> None:
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


_Method = TypeVar("_Method", bound=Callable[..., Any])


def handles(*messages: str) -> Callable[[_Method], _Method]:
    """Mark a method that takes messages: ``def move_home(self, frame: Frame) -> None``."""
    return _mark("handles", messages)


def live(*sets: str) -> Callable[[_Method], _Method]:
    """Mark a method that gives the values of a set at this instant, without the channel.

    ``def position(self) -> dict[str, int]``, with ``@live("MOT_POSCOUNTER")``: what is answered to the
    REQ. Also for ``MOT_STATUSBITS`` and ``PZ_PZSTATUSBITS``; status messages are filled by
    :meth:`Behaviour.status`.
    """
    return _mark("live", sets)


def stored(*sets: str) -> Callable[[_Method], _Method]:
    """Mark a method that is called when a SET has been stored.

    ``def counter_was_set(self, frame: Frame) -> None``.
    """
    return _mark("stored", sets)


class LiveState(NamedTuple):
    """What the live table shows of a channel; see :class:`~stagewire_virtual.instrument.Row`."""

    position: str = ""
    state: str = ""


class Behaviour:
    """Base of the behaviours of one channel; does nothing of its own.

    :param channel: its parameters, its clock, and the way to the host.
    """

    can_stick: ClassVar[bool] = False
    """Whether it moves something that may stick."""

    _marked: ClassVar[Mapping[str, Mapping[str, str]]] = {"handles": {}, "live": {}, "stored": {}}

    def __init_subclass__(cls) -> None:
        marked = {kind: dict(names) for kind, names in cls._marked.items()}
        for name, method in vars(cls).items():
            for kind, wanted in getattr(method, "_stagewire_marks", ()):
                marked[kind].update(dict.fromkeys(wanted, name))
        cls._marked = marked

    def __init__(self, channel: Channel) -> None:
        self.channel = channel
        channel.behaviour = self

    @classmethod
    def defaults(cls, channel: Channel) -> Mapping[str, Mapping[str, Any]]:
        """Return the values that parameter sets have in a new controller: set -> field -> value.

        What is not named is the default of the registry, or else zero.
        """
        return {}

    def power_on(self) -> None:
        """Begin anew after a power cycle; the parameters are those of the EEPROM again."""

    def enabled_changed(self) -> None:
        """Hear that the channel has been enabled or disabled."""

    def stuck_changed(self) -> None:
        """Hear that the axis has begun to stick, or is free again."""

    def refusal(self, frame: Frame) -> str | None:
        """Return why a SET that the registry allows cannot be stored now; None if it can.

        ``frame`` carries a SET that no method of the behaviour handles.
        """
        return None

    def status(self) -> Mapping[str, int]:
        """Return the fields of the status message of this instant, without the channel and reserved ones."""
        return {}

    def row(self) -> LiveState:
        """Return what the live table shows of the channel."""
        return LiveState()

    def method(self, kind: str, name: str) -> Callable[..., Any] | None:
        """Return the method that is marked for a message or set; ``kind`` is the name of the mark."""
        found = self._marked[kind].get(name)
        return getattr(self, found) if found else None


def _mark(kind: str, names: tuple[str, ...]) -> Callable[[_Method], _Method]:
    def mark(method: _Method) -> _Method:
        marks = getattr(method, "_stagewire_marks", ())
        method._stagewire_marks = (*marks, (kind, names))  # type: ignore[attr-defined]
        return method

    return mark
