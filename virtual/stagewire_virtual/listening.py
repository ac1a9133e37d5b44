"""What a host sends, cut into frames and lines of text, without waiting for ever for the rest of one."""

from __future__ import annotations

import typing
from collections.abc import Callable
from typing import Final

from stagewire.errors import CodecError, UnsupportedError
from stagewire.framing import End, Event, host_framer
from stagewire.protocols import CommandProtocol, FramedProtocol, PacketProtocol, Protocol
from stagewire_virtual.clock import SECOND, Clock

PATIENCE: Final = SECOND
"""How long the rest of a frame is waited for. The APT document has no such time; without one, a length that
was damaged would swallow what comes after it. A command without a header ends by its terminator, a
line of text by its carriage return: they are waited for."""


class _Framer(typing.Protocol):
    """What cuts a stream into events; the bytes of all events are the bytes that were fed."""

    @property
    def pending(self) -> bytes:
        """The bytes that wait for more."""
        ...

    def feed(self, data: bytes) -> list[Event]:
        """Take the next bytes and return what they complete."""
        ...


class Listener:
    """Cuts what the host sends into frames, of whichever protocol.

    :param protocol: whose frames they are.
    :param clock: the time.
    :param take: takes each event of the framer.

    Raises :class:`~stagewire.errors.UnsupportedError` for a protocol that is framed in no known way.
    """

    def __init__(self, protocol: Protocol, clock: Clock, take: Callable[[Event], None]) -> None:
        self._protocol = protocol
        self._clock = clock
        self._take = take
        self._heard = 0  # when the last bytes came
        self._waits = False  # one timer at most, however finely the bytes are cut
        self.begin_anew()

    def begin_anew(self) -> None:
        """Forget what has come of a frame."""
        self._framer, self._abandon = _framer(self._protocol)

    @property
    def pending(self) -> bytes:
        """What has come of a frame whose rest is waited for."""
        return self._framer.pending

    def hear(self, data: bytes) -> None:
        """Take what the host sends, cut at any byte."""
        self._heard = self._clock.now
        for event in self._framer.feed(data):
            self._take(event)
        if self._abandon and self._framer.pending and not self._waits:
            self._waits = True
            self._clock.call_later(PATIENCE, self._look)

    def _look(self) -> None:
        """Give up what waits if nothing has come for long; frames behind a damaged length are found so."""
        due = self._heard + PATIENCE
        self._waits = bool(self._framer.pending) and self._clock.now < due
        if self._waits:
            self._clock.call_at(due, self._look)
        elif self._abandon:
            for event in self._abandon():
                self._take(event)


def _framer(protocol: Protocol) -> tuple[_Framer, Callable[[], list[Event]] | None]:
    """Return a framer of what a host sends, and what gives up the frame that it waits for."""
    if isinstance(protocol, CommandProtocol):
        return host_framer(protocol), None
    if isinstance(protocol, FramedProtocol):
        framer = protocol.framer(End.DEVICE)
        return framer, framer.abandon
    if isinstance(protocol, PacketProtocol):
        packets = protocol.framer()
        return packets, packets.abandon
    raise UnsupportedError(f"nothing cuts {protocol!r} into frames")


def is_text(protocol: Protocol, request: bytes) -> bool:
    """Say whether a request is a line of text, which ends as no command does."""
    if not isinstance(protocol, CommandProtocol):
        return False
    return request[-1:] in (b"\r", b"\n") and request[-1] != protocol.marks.terminator


def message_name(protocol: Protocol, raw: bytes) -> str | None:
    """Return the name of the message that a frame carries; None when it is none that is known.

    A reply of a protocol of commands does not say what it is.
    """
    if not isinstance(protocol, (FramedProtocol, CommandProtocol, PacketProtocol)):
        return None
    try:
        return protocol.decode(raw).message.layout.message
    except CodecError:
        return None
