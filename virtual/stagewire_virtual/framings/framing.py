"""What virtual controllers, their faults and their recordings ask of a framing."""

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
"""How long the rest of a frame is waited for. The APT document has no such time; without one, a length that
was damaged would swallow what comes after it. A command without a header ends by its terminator, a
line of text by its carriage return: they are waited for."""

Share: TypeAlias = tuple[int, int]
"""How many of the bytes that were said belong to which request, as an index."""


class StreamFramer(typing.Protocol):
    """What cuts a stream into events; the bytes of all events are the bytes that were fed."""

    @property
    def pending(self) -> bytes:
        """The bytes that wait for more."""
        ...

    def feed(self, data: bytes) -> list[Event]:
        """Take the next bytes and return what they complete."""
        ...


Abandon: TypeAlias = Callable[[], list[Event]]
"""Gives up the frame that a framer waits for."""


class ReplyReader:
    """Reads a conversation from the side of the host; the base of those of all framings."""

    def wrote(self, data: bytes) -> None:
        """Note what the host has sent."""

    def read(self, data: bytes) -> list[Event]:
        """Return what bytes of the controller complete."""
        raise NotImplementedError


class Framing:
    """The framing of a protocol; this base is that of a protocol which is framed in no known way.

    :param protocol: whose frames they are.
    """

    replies_are_named_by_requests = False
    """Whether a reply does not say itself of which message it is."""

    def __init__(self, protocol: Protocol) -> None:
        self.protocol = protocol

    def request_framer(self) -> tuple[StreamFramer, Abandon | None]:
        """Return a framer of what a host sends, and what gives up the frame that it waits for.

        Raises :class:`~stagewire.errors.UnsupportedError` where nothing can cut it.
        """
        raise UnsupportedError(f"nothing cuts {self.protocol!r} into frames")

    def reply_framer(self) -> StreamFramer | None:
        """Return a framer of what a controller says; None where replies have no frame that shows its end."""
        return None

    def reply_reader(self, statuses: Collection[str | None]) -> ReplyReader:
        """Return what reads a conversation from the side of the host.

        :param statuses: which status blocks the far end sends; of those that bytes do not tell apart, one.

        Raises :class:`~stagewire_virtual.errors.VirtualError` for a protocol that cannot be read.
        """
        raise VirtualError(
            f"{self.protocol.name} has no frames that could be read; read() returns bytes"
        )

    def is_text(self, request: bytes) -> bool:
        """Say whether a request is a line of text, which ends as no command does."""
        return False

    def message_name(self, raw: bytes) -> str | None:
        """Return the name of the message that a frame carries; None when it is none that is known."""
        return None

    def shares(self, requests: Sequence[bytes], data: bytes, unit: Unit) -> list[Share]:
        """Return which of several requests an answer belongs to, from the last of its bytes to the first.

        What is not shared out belongs to the last request.
        """
        return []

    def never_passes(self, unit: Unit, message: str, direction: Direction | None) -> str | None:
        """Return why a message of a unit never goes in a direction; None where it does."""
        goes = unit.message(message)["direction"]
        passes = {"to_host": Direction.TO_HOST, "to_controller": Direction.TO_CONTROLLER}
        if goes == "both" or passes[goes] is direction:
            return None
        return f"{message} goes {goes} and never the other way"

    def status_frame(self, unit: Unit) -> bytes | None:
        """Return the status message that a unit sends unsolicited; None for a unit that sends none.

        It is that of its first channel, with all values zero.
        """
        return None


class RequestReader:
    """Cuts what the host sends into frames and lines of text, without waiting for ever for the rest of one.

    :param framing: of the protocol whose frames they are.
    :param clock: the time.
    :param take: takes each event of the framer.

    Raises :class:`~stagewire.errors.UnsupportedError` for a protocol that is framed in no known way.
    """

    def __init__(self, framing: Framing, clock: Clock, take: Callable[[Event], None]) -> None:
        self._framing = framing
        self._clock = clock
        self._take = take
        self._fed = 0  # when the last bytes came
        self._waits = False  # one timer at most, however finely the bytes are cut
        self.clear()

    def clear(self) -> None:
        """Forget what has come of a frame."""
        self._framer, self._abandon = self._framing.request_framer()

    @property
    def pending(self) -> bytes:
        """What has come of a frame whose rest is waited for."""
        return self._framer.pending

    def feed(self, data: bytes) -> None:
        """Take what the host sends, cut at any byte."""
        self._fed = self._clock.now
        for event in self._framer.feed(data):
            self._take(event)
        if self._abandon and self._framer.pending and not self._waits:
            self._waits = True
            self._clock.call_later(PATIENCE, self._look)

    def _look(self) -> None:
        """Give up what waits if nothing has come for long; frames after a damaged length are found so."""
        due = self._fed + PATIENCE
        self._waits = bool(self._framer.pending) and self._clock.now < due
        if self._waits:
            self._clock.call_at(due, self._look)
        elif self._abandon:
            for event in self._abandon():
                self._take(event)


def decoded(decode: Callable[[bytes], _T], raw: bytes) -> _T | None:
    """Return what bytes decode to; None where they are no frame of a message that is known."""
    try:
        return decode(raw)
    except CodecError:
        return None
