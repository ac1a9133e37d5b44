"""The channels of a controller with framed messages, as parts that can be brought to rest."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Final, Protocol

from stagewire.protocols import FramedMessage
from stagewire_apt.enumerations import SolenoidState
from stagewire_conformance.device.causes import DELIVERY, MOTION_AT_REST, Cause, silence
from stagewire_conformance.device.lines.dialogue import addressed_text
from stagewire_conformance.device.lines.motions import STATUS_BITS, Ending, Moved, reports_motion
from stagewire_conformance.device.lines.standstill import Measure, Part, Sighting

if TYPE_CHECKING:
    from stagewire_conformance.device.declaration import Declaration
    from stagewire_conformance.device.lines.dialogue import Incoming
    from stagewire_conformance.device.targets import Target

_SOLENOID: Final = "MOT_REQ_SOL_STATE"
_SIGHT: Final = 0.5
"""Seconds to wait for the status of a motor that is brought to rest."""


class Asks(Protocol):
    """A line on which the state of a channel can be requested."""

    declared: Declaration
    disabled: set[str]

    def ask(self, request: FramedMessage, dest: int, wait: float = ...) -> Incoming | None:
        """Send a request and return its reply."""
        ...


class AptParts:
    """Makes parts of channels.

    :param line: requests the state of a channel.
    :param moved: the motions that were started.
    :param write_now: sends the bytes of a stop, with a function that describes them for the log.
    """

    def __init__(
        self, line: Asks, moved: Moved, write_now: Callable[[bytes, Callable[[], str]], None]
    ) -> None:
        self._line = line
        self._moved = moved
        self._write_now = write_now

    def moved(self, *, going: bool = False) -> list[Part]:
        """Return the channels that were set in motion.

        :param going: whether to return only those whose end was not reported.
        """
        channels = self._moved.channels(going=going)
        return [part for each in channels if (part := self.part(*each)).measures]

    def others(self) -> list[Part]:
        """Return the other channels with a motor whose motion can be observed and ended."""
        moved = self._moved.channels()
        motors = [
            (place, channel)
            for place in self._line.declared.places
            if place.reports_position
            for channel in place.channels
        ]
        parts = [self.part(*motor) for motor in motors if motor not in moved]
        return [part for part in parts if part.look and part.measures]

    def part(self, place: Target, channel: int) -> Part:
        """Return a channel as a part."""
        name = f"{place.name} channel {channel}"
        measures = [
            Measure(ending.text, partial(self._end, ending, place, name), ending.disables)
            for ending in self._moved.endings(place, channel)
        ]
        if _SOLENOID in place.messages:
            return self._solenoid(
                Part(name, tuple(measures), None, active="switched on"), place, channel
            )
        query = place.unit.status_query
        if query is None or query.req is None:
            return Part(name, tuple(measures), None, active="switched on")
        request = self._line.declared.make(query.req.layout.message, channel)
        exchange = self._line.declared.registry.messages[request.layout.message]["exchange"]
        replies = tuple(exchange["answered_by"])
        silent = (silence(place.name), *(Cause(status, DELIVERY) for status in replies))
        stuck = tuple(Cause(status, MOTION_AT_REST) for status in replies)
        listed = request.layout.message in place.messages
        look = self._look(place, request)
        active = "moving" if look else "switched on"
        return Part(name, tuple(measures), look, silent, stuck, listed, active)

    def _solenoid(self, part: Part, place: Target, channel: int) -> Part:
        """Return the part of a solenoid, whose state is requested."""
        request = self._line.declared.make(_SOLENOID, channel)

        def look() -> Sighting | None:
            heard = self._line.ask(request, place.address, _SIGHT)
            if heard is None:
                return None
            return Sighting(heard.time, 0, heard.message.state != SolenoidState.SOLENOID_OFF)

        return replace(part, look=look, silent=(silence(place.name),))

    def _end(self, ending: Ending, place: Target, name: str) -> None:
        host = self._line.declared.framed.host
        for message in ending.messages:
            told = partial(addressed_text, message, place.address, host)
            self._write_now(message.pack(place.address, host), told)
        if ending.disables:
            self._line.disabled.add(name)

    def _look(self, place: Target, request: FramedMessage) -> Callable[[], Sighting | None] | None:
        """Return a function that reads the state of a motor; None for a channel without a position."""
        if not place.reports_position or place.status is None:
            return None
        bits = STATUS_BITS[place.status]

        def look() -> Sighting | None:
            heard = self._line.ask(request, place.address, _SIGHT)
            if heard is None:
                return None
            message = heard.message
            if not hasattr(message, "position"):  # the status of four channels
                return None
            # the position counter of an inertial drive has no status bits
            moving = reports_motion(bits(getattr(message, "status_bits", 0)))
            return Sighting(heard.time, message.position, moving)

        return look
