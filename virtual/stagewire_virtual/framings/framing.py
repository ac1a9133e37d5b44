"""The interface of a framing for virtual controllers, their faults and their recordings."""

from __future__ import annotations

import typing
from collections.abc import Callable, Collection, Sequence
from typing import Final, TypeAlias, TypeVar

from stagewire.errors import CodecError, UnsupportedError
from stagewire.framing import Event
from stagewire.protocols import Direction, Protocol
from stagewire_virtual.clock import SECOND, Clock
from stagewire_virtual.errors import VirtualError
from stagewire_virtual.instrument import Unit

_T = TypeVar("_T")

PATIENCE: Final = SECOND
"""How long a reader waits for the rest of a frame. The APT document has no such timeout; without one, a
damaged length would swallow the following frames. Commands without a header and lines of text have no
timeout, because they end with a terminator or a carriage return."""

Share: TypeAlias = tuple[int, int]
"""A number of bytes, and the index of the request that they answer."""


class StreamFramer(typing.Protocol):
    """Cuts a stream into events, without losing a byte."""

    @property
    def pending(self) -> bytes:
        """The bytes of an incomplete event."""
        ...

    def feed(self, data: bytes) -> list[Event]:
        """Add bytes and return the events that they complete."""
        ...


Abandon: TypeAlias = Callable[[], list[Event]]
"""Gives up an incomplete frame and returns the resulting events."""


class ReplyReader:
    """Decodes the replies of a controller for the host; the base of the readers of all framings."""

    def wrote(self, data: bytes) -> None:
        """Note bytes that the host has sent."""

    def read(self, data: bytes) -> list[Event]:
        """Add bytes from the controller and return the events that they complete."""
        raise NotImplementedError


class Framing:
    """The framing of a protocol; this base class is for protocols with an unknown kind of framing.

    :param protocol: the protocol.
    """

    replies_are_named_by_requests = False
    """Whether the message of a reply can only be derived from its request."""

    def __init__(self, protocol: Protocol) -> None:
        self.protocol = protocol

    def request_framer(self) -> tuple[StreamFramer, Abandon | None]:
        """Return a framer for the bytes of a host, and a function that gives up its incomplete frame.

        Raises :class:`~stagewire.errors.UnsupportedError` if the protocol has no framer.
        """
        raise UnsupportedError(f"{self.protocol!r} has no framer")

    def reply_framer(self) -> StreamFramer | None:
        """Return a framer for the bytes of a controller; None if replies have no frames."""
        return None

    def reply_reader(self, statuses: Collection[str | None]) -> ReplyReader:
        """Return a reader that decodes replies for the host.

        :param statuses: the status blocks that the far end sends, to distinguish layouts that have the same
            bytes.

        Raises :class:`~stagewire_virtual.errors.VirtualError` if the replies of the protocol have no frames.
        """
        raise VirtualError(
            f"the replies of {self.protocol.name} have no frames; use read(), which returns bytes"
        )

    def is_text(self, request: bytes) -> bool:
        """Return whether a request is a line of text."""
        return False

    def message_name(self, raw: bytes) -> str | None:
        """Return the name of the message in a frame; None for an unknown message."""
        return None

    def shares(self, requests: Sequence[bytes], data: bytes, unit: Unit) -> list[Share]:
        """Assign the bytes of an answer to requests, from the last byte to the first.

        Bytes that are not assigned belong to the last request.
        """
        return []

    def never_passes(self, unit: Unit, message: str, direction: Direction | None) -> str | None:
        """Return why a message of a unit is never sent in a direction; None if it may be."""
        goes = unit.message(message)["direction"]
        passes = {"to_host": Direction.TO_HOST, "to_controller": Direction.TO_CONTROLLER}
        if goes == "both" or passes[goes] is direction:
            return None
        return f"{message} is only sent {goes}"

    def status_frame(self, unit: Unit) -> bytes | None:
        """Return the frame of a unit's unsolicited status message; None for a unit that sends none.

        The message is that of the first channel, with all values zero.
        """
        return None


class RequestReader:
    """Cuts the bytes of a host into frames and lines of text, and gives up incomplete frames after a timeout.

    :param framing: the framing of the protocol.
    :param clock: the clock.
    :param take: called with each event of the framer.

    Raises :class:`~stagewire.errors.UnsupportedError` for a protocol with an unknown kind of framing.
    """

    def __init__(self, framing: Framing, clock: Clock, take: Callable[[Event], None]) -> None:
        self._framing = framing
        self._clock = clock
        self._take = take
        self._fed = 0  # the instant of the last bytes
        self._waits = False  # whether the timer is set; one is enough for any number of chunks
        self.clear()

    def clear(self) -> None:
        """Discard an incomplete frame."""
        self._framer, self._abandon = self._framing.request_framer()

    @property
    def pending(self) -> bytes:
        """The bytes of an incomplete frame."""
        return self._framer.pending

    def feed(self, data: bytes) -> None:
        """Process bytes from the host, in any chunks."""
        self._fed = self._clock.now
        for event in self._framer.feed(data):
            self._take(event)
        if self._abandon and self._framer.pending and not self._waits:
            self._waits = True
            self._clock.call_later(PATIENCE, self._look)

    def _look(self) -> None:
        """Give up an incomplete frame after the timeout, so that frames after a damaged length are found."""
        due = self._fed + PATIENCE
        self._waits = bool(self._framer.pending) and self._clock.now < due
        if self._waits:
            self._clock.call_at(due, self._look)
        elif self._abandon:
            for event in self._abandon():
                self._take(event)


def decoded(decode: Callable[[bytes], _T], raw: bytes) -> _T | None:
    """Return the decoded bytes; None if they are not the frame of a known message."""
    try:
        return decode(raw)
    except CodecError:
        return None
