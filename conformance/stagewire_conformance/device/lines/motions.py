"""Motions that a check may have started, and the messages that stop them."""

from __future__ import annotations

from typing import Any, Final, NamedTuple

from stagewire.protocols import FramedMessage
from stagewire.sessions import Matching
from stagewire_conformance.device.declaration import Declaration
from stagewire_conformance.device.targets import Target

_MANNER: Final = "PROFILED"
"""The stop mode if there are several: without losing steps, as in the library."""


class _Where(NamedTuple):
    """An address and a channel; None for all channels."""

    dest: int
    channel: int | None


class Moved:
    """The motions started since the last check began.

    :param declared: the controller.
    :param matching: finds the source and the channel of a message.
    """

    def __init__(self, declared: Declaration, matching: Matching) -> None:
        self._declared = declared
        self._matching = matching
        self._entries = declared.registry.messages
        self._ends = frozenset[str]().union(*map(self._ends_of, self._entries))
        # Place of a motion -> the messages that report its end; an empty set if only a stop ends it.
        # None: the motion has ended.
        self._going: dict[_Where, frozenset[str] | None] = {}

    def _ends_of(self, message: str) -> frozenset[str]:
        exchange = self._entries[message]["exchange"]
        return frozenset(exchange.get("completes_with", ())) | set(exchange.get("stops_with", ()))

    def sends(self, message: FramedMessage, dest: int, effect: str | None) -> None:
        """Note a message that is about to be sent."""
        where = _Where(dest, self._matching.channel_of(message))
        name = message.layout.message
        if effect == "motion":
            goes_on = bool(self._entries[name]["exchange"].get("halted_by"))
            ends = self._ends_of(name) if goes_on else self._going.get(where)
            self._going[where] = ends
        elif effect == "stop" and self._going.get(where) == frozenset():
            self._going[where] = None

    def hears(self, message: FramedMessage, raw: bytes) -> None:
        """Note a received message, which may be the end of a motion."""
        if message.layout.message not in self._ends:
            return
        source, channel = self._matching.source_of(raw), self._matching.channel_of(message)
        for where, ends in self._going.items():
            if ends and message.layout.message in ends and where == _Where(source or -1, channel):
                self._going[where] = None

    def all(self) -> list[tuple[FramedMessage, int]]:
        """Return the stops for everything that was set in motion, ended or not, with their destinations."""
        return [stop for where in self._going for stop in self._stops(where)]

    def going_on(self) -> list[tuple[FramedMessage, int]]:
        """Return the stops for motions whose end was not reported."""
        going = [where for where, ends in self._going.items() if ends is not None]
        return [stop for where in going for stop in self._stops(where)]

    def forget(self) -> None:
        """Forget all motions, before the next check."""
        self._going.clear()

    def _stops(self, where: _Where) -> list[tuple[FramedMessage, int]]:
        place = self._declared.place_at(where.dest)
        if place is None:
            return []
        channels = place.channels if where.channel is None else (where.channel,)
        return [
            (self._make(name, channel), where.dest)
            for name in self._names(place)
            for channel in channels
        ]

    def _names(self, place: Target) -> list[str]:
        """Return the stop messages of a place, including those that the PICS lists as unsupported."""
        return sorted(name for name in place.listed if self._entries[name]["effect"] == "stop")

    def _make(self, name: str, channel: int) -> FramedMessage:
        [layout] = self._entries[name]["layouts"]
        fields = self._declared.registry.fields(name, layout["form"])
        manners: dict[str, Any] = {
            field: entry["enum"][_MANNER]
            for field, entry in fields.items()
            if _MANNER in entry.get("enum", ())
        }
        made: FramedMessage = self._declared.make(name, channel, **manners)
        return made
