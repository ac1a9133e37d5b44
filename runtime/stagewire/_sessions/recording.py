"""``log=path``: records the bytes of a session in a capture that ``stagewire decode`` reads."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from pathlib import Path

from stagewire._codec.events import Event, Garbage
from stagewire._codec.message import Direction
from stagewire._framings.header.protocol import FramedProtocol
from stagewire._framings.header.table import End
from stagewire._framings.slots.frame import TextReceived
from stagewire._framings.slots.protocol import CommandProtocol
from stagewire._framings.slots.replies import ReplyReceived
from stagewire._framings.slots.streams import HostListener, ReplyListener
from stagewire.capture import CaptureWriter, Heading
from stagewire.errors import CodecError, TransportError

_SECOND = 1_000_000_000

_log = logging.getLogger("stagewire")


class Recording:
    """A recorder of both directions of a session, for several threads.

    Each write or read becomes a line of the capture, even if it is not whole frames, with the names of the
    messages that it completes. Each line is flushed immediately, so a process that crashes loses none. If the
    disk is full, the recording ends with a warning and the session continues.

    :param path: the file; existing contents are replaced.
    :param protocol: the protocol of the line.
    :param now: the clock, in seconds; the capture begins at 0.
    :param unit: name of the unit, if it is known.

    Raises :class:`~stagewire.errors.TransportError` for a file that cannot be written.
    """

    def __init__(
        self,
        path: str | Path,
        protocol: FramedProtocol | CommandProtocol,
        now: Callable[[], float],
        unit: str | None = None,
    ) -> None:
        self._path = path
        self._now = now
        self._start = now()
        self._lock = threading.Lock()
        self._over = False
        self._cut = _cutters(protocol)
        try:
            # Line-buffered: each line is passed to the system when it is written.
            self._out = open(path, "w", encoding="utf-8", newline="\n", buffering=1)  # noqa: SIM115
            self._writer = CaptureWriter(self._out, Heading(protocol.name, unit))
        except OSError as error:
            raise TransportError(
                f"log={str(path)!r} cannot be written: {error.strerror or error}; give a file in an existing "
                "directory with write permission"
            ) from None

    def sent(self, data: bytes) -> None:
        """Record bytes to the controller."""
        self._passed(Direction.TO_CONTROLLER, data)

    def received(self, data: bytes) -> None:
        """Record bytes from the controller."""
        self._passed(Direction.TO_HOST, data)

    def note(self, text: str) -> None:
        """Record a comment, such as the loss of the link."""
        with self._lock:
            self._try(lambda when: self._writer.note(when, text))

    def close(self) -> None:
        """End the recording. Harmless if called twice."""
        with self._lock:
            self._over = True
            try:
                self._out.close()
            except OSError as error:
                self._give_up(error)

    def _passed(self, direction: Direction, data: bytes) -> None:
        with self._lock:
            names = ", ".join(filter(None, map(_name, self._cut[direction](data))))
            self._try(lambda when: self._writer.write(when, direction, data, names))

    def _try(self, write: Callable[[int], None]) -> None:
        if self._over:
            return
        try:
            write(round((self._now() - self._start) * _SECOND))
        except OSError as error:
            self._over = True
            self._give_up(error)

    def _give_up(self, error: OSError) -> None:
        _log.warning("%s: the recording ended: %s", self._path, error.strerror or error)


def _cutters(
    protocol: FramedProtocol | CommandProtocol,
) -> dict[Direction, Callable[[bytes], list[Event]]]:
    """Return the function that cuts each direction into events."""
    if isinstance(protocol, CommandProtocol):
        replies = ReplyListener()
        asking = HostListener(protocol, replies)
        return {Direction.TO_CONTROLLER: asking.feed, Direction.TO_HOST: replies.feed}
    return {
        Direction.TO_CONTROLLER: protocol.framer(End.DEVICE).feed,
        Direction.TO_HOST: protocol.framer(End.HOST).feed,
    }


def _name(event: Event) -> str:
    """Return the comment for an event in the capture."""
    match event:
        case Garbage():
            return "no frame"
        case TextReceived():
            return "text"
        case ReplyReceived():
            return f"reply to {event.request.message.layout.message}"
    try:
        frame = event.frame  # type: ignore[attr-defined]  # only decodable events have one
    except (AttributeError, CodecError):
        return type(event).__name__
    name: str = frame.message.layout.message
    return name
