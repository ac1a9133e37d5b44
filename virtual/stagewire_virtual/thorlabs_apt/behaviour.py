"""What a channel does over time: the part of a virtual controller that is written by hand.

A controller answers by the registry alone: it stores what a SET brings and gives it back to the REQ. A
behaviour adds what no table can say. It takes messages that start something (:func:`handles`), gives the
values of sets that live (:func:`live`), hears of sets that were stored (:func:`stored`), and fills the
status messages.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, TypeVar

if TYPE_CHECKING:
    from stagewire import Frame
    from stagewire_virtual.thorlabs_apt.channel import Channel

__all__ = ["Behaviour", "Shown", "handles", "live", "stored"]

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


class Shown(NamedTuple):
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

    def row(self) -> Shown:
        """Return what the live table shows of the channel."""
        return Shown()

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
