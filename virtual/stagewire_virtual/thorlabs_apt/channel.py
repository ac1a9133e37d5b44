"""A channel with its parameters, its part of the EEPROM and its behaviour.

A controller answers parameter messages from the registry alone: a SET stores values, and a REQ returns them.
A :class:`Behaviour` is written by hand and simulates a channel over time. It handles messages that start
actions (:func:`handles`), computes the values of live sets (:func:`live`), is called when a set was stored
(:func:`stored`), fills reserved bytes (:func:`amends`), and fills the status.
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
    """A channel: the state that its behaviour uses, and the functions that send to the host.

    :param ident: the channel ident on the wire, 1 or 2.
    :param unit: the unit in the registry.
    :param clock: the clock.
    :param settings: the settings of the user.
    :param random: random numbers of this channel, seeded by the instrument.
    :param clockwise: 1 if the position counter rises clockwise, -1 if it falls. Clockwise (CW) is direction
        1, forward, of jogs and velocity moves, of the motion and limit bits of the status, and of the limit
        switch parameters; the document gives it no sign. Homing, positions and distances do not depend on it.
    :param first: the first channel of its controller; None if it is the first itself.
    """

    behaviour: Behaviour
    """The behaviour, which sets this attribute when it is created."""

    def __init__(
        self,
        ident: int,
        unit: Unit,
        clock: Clock,
        settings: Settings,
        random: random.Random,
        clockwise: int = 1,
        first: Channel | None = None,
    ) -> None:
        self.ident = ident
        self.unit = unit
        self.clock = clock
        self.settings = settings
        self.random = random
        self.clockwise = clockwise
        self.first = first or self
        self.enabled = True
        self.parameters: MutableMapping[str, dict[str, Any]] = {}
        """The values of each parameter set, ``MOT_VELPARAMS`` -> field -> value, without the channel.

        All are integers, except the part number of the stage, which is a string. A set that exists once
        for each connector has more entries, such as ``MOT_IOCONFIG 2``.
        """
        self._defaults: Mapping[str, Mapping[str, Any]] = {}
        self._saved: dict[str, dict[str, Any]] = {}
        self._stuck = False
        self.send: Callable[[FramedMessage, Frame], None] = ignore
        """Sends a message that a frame of the host caused; the controller adds addresses and mutes."""
        self.report_fault: Callable[[Frame, str], None] = ignore
        """Reports why a message was refused; the controller notifies the host if that option is set."""
        self.panel_is_locked: Callable[[], bool] = lambda: False
        """Returns whether the host has locked the controls on the top panel."""

    @property
    def stuck(self) -> bool:
        """Whether a fault blocks the axis, whatever its motor does."""
        return self._stuck

    @stuck.setter
    def stuck(self, stuck: bool) -> None:
        if stuck != self._stuck:
            self._stuck = stuck
            self.behaviour.stuck_changed()

    def answers(self, message: str) -> bool:
        """Return whether the unit has a message."""
        return message in self.unit.messages

    def parameter(self, set_name: str, field: str, otherwise: int = 0) -> int:
        """Return a value of a parameter set, or ``otherwise`` if the unit does not have the set."""
        value: int = self.parameters.get(set_name, {}).get(field, otherwise)
        return value

    def values_for(self, set_name: str, which: Mapping[str, int]) -> dict[str, Any]:
        """Return the values of a set; ``which`` has the fields that select one of several, such as a port."""
        if not which:
            return self.parameters[set_name]
        name = " ".join([set_name, *map(str, which.values())])
        return self.parameters.setdefault(name, {**self._defaults[set_name], **which})

    def initialize(self, defaults: Mapping[str, Mapping[str, Any]]) -> None:
        """Set the parameters of a new controller, whose EEPROM is empty."""
        self._defaults = defaults
        self.restore()

    def save(self, set_name: str) -> None:
        """Save the values of a parameter set to the EEPROM, for all its connectors."""
        for name, values in self.parameters.items():
            if name.partition(" ")[0] == set_name:
                self._saved[name] = dict(values)

    def restore(self) -> None:
        """Restore the saved parameters, and the defaults of those that were not saved."""
        self.parameters.clear()
        for name, values in {**self._defaults, **self._saved}.items():
            self.parameters[name] = {**self._defaults.get(name, {}), **values}


_Method = TypeVar("_Method", bound=Callable[..., Any])


def handles(*messages: str) -> Callable[[_Method], _Method]:
    """Mark a method that handles messages: ``def move_home(self, frame: Frame) -> None``."""
    return _mark("handles", messages)


def live(*sets: str) -> Callable[[_Method], _Method]:
    """Mark a method that returns the present values of a set, without the channel, for the answer to a REQ.

    For example ``def position(self) -> dict[str, int]`` with ``@live("MOT_POSCOUNTER")``. Also for
    ``MOT_STATUSBITS`` and ``PZ_PZSTATUSBITS``; :meth:`Behaviour.status` fills status messages.
    """
    return _mark("live", sets)


def stored(*sets: str) -> Callable[[_Method], _Method]:
    """Mark a method that is called when a SET has been stored.

    ``def counter_was_set(self, frame: Frame) -> None``.
    """
    return _mark("stored", sets)


def amends(*messages: str) -> Callable[[_Method], _Method]:
    """Mark a method that fills the reserved bytes of a GET before it is sent.

    ``def with_scales(self, message: FramedMessage) -> FramedMessage``.
    """
    return _mark("amends", messages)


class LiveState(NamedTuple):
    """The position and state of a channel for its :class:`~stagewire_virtual.instrument.Row`."""

    position: str = ""
    state: str = ""


class Behaviour:
    """The base of the behaviours of a channel, which does nothing.

    :param channel: its channel.
    """

    can_stick: ClassVar[bool] = False
    """Whether the channel has a moving part that can be blocked."""
    enables_by_mask: ClassVar[bool] = False
    """Whether MOD_SET_CHANENABLESTATE names channels by a mask, and disables those that are not in it."""

    _marked: ClassVar[Mapping[str, Mapping[str, str]]] = {
        kind: {} for kind in ("handles", "live", "stored", "amends")
    }

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
        """Return the parameters of a new controller: set -> field -> value.

        Missing values are the default of the registry, or else zero.
        """
        return {}

    def power_on(self) -> None:
        """Reset to the power-on state; the parameters have been restored from the EEPROM."""

    def enabled_changed(self) -> None:
        """React to a channel that has been enabled or disabled."""

    def stuck_changed(self) -> None:
        """React to an axis that has been blocked or released."""

    def refusal(self, frame: Frame) -> str | None:
        """Return why a SET that the registry allows cannot be stored now; None if it can.

        ``frame`` carries a SET that no method of the behaviour handles.
        """
        return None

    def status(self) -> Mapping[str, int]:
        """Return the present fields of the status message, without the channel and reserved fields."""
        return {}

    def row(self) -> LiveState:
        """Return the position and state for the live table."""
        return LiveState()

    def method(self, kind: str, name: str) -> Callable[..., Any] | None:
        """Return the method marked for a message or set; ``kind`` is the name of the decorator."""
        found = self._marked[kind].get(name)
        return getattr(self, found) if found else None


def _mark(kind: str, names: tuple[str, ...]) -> Callable[[_Method], _Method]:
    def mark(method: _Method) -> _Method:
        marks = getattr(method, "_stagewire_marks", ())
        method._stagewire_marks = (*marks, (kind, names))  # type: ignore[attr-defined]
        return method

    return mark
