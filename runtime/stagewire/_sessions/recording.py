"""``log=path``: what a session says and hears, as a capture that ``stagewire decode`` reads back."""

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
    """Writes a capture of both directions; for several threads.

    A line of the capture is what was written or read at once, whole frames or not, with the names of the
    messages that it completes. Each line is handed to the system at once, so that a process that ends
    badly loses none. A disk that is full ends the recording with a warning, and not what is recorded.

    :param path: the file; what was in it is replaced.
    :param protocol: what is spoken.
    :param now: tells the time in seconds; the capture begins at 0.
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
            # By lines: each is with the system when it has been written.
            self._out = open(path, "w", encoding="utf-8", newline="\n", buffering=1)  # noqa: SIM115
            self._writer = CaptureWriter(self._out, Heading(protocol.name, unit))
        except OSError as error:
            raise TransportError(
                f"log={str(path)!r} cannot be written: {error.strerror or error}; name a file in a "
                "folder that is there and that you may write to"
            ) from None

    def sent(self, data: bytes) -> None:
        """Record what was said to the controller."""
        self._passed(Direction.TO_CONTROLLER, data)

    def received(self, data: bytes) -> None:
        """Record what the controller said."""
        self._passed(Direction.TO_HOST, data)

    def note(self, text: str) -> None:
        """Record something for people, such as that the line was lost."""
        with self._lock:
            self._try(lambda when: self._writer.note(when, text))

    def close(self) -> None:
        """End the recording; harmless when done twice."""
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
        _log.warning("%s: nothing is recorded any more: %s", self._path, error.strerror or error)


def _cutters(
    protocol: FramedProtocol | CommandProtocol,
) -> dict[Direction, Callable[[bytes], list[Event]]]:
    """Return what cuts each direction into events."""
    if isinstance(protocol, CommandProtocol):
        replies = ReplyListener()
        asking = HostListener(protocol, replies)
        return {Direction.TO_CONTROLLER: asking.feed, Direction.TO_HOST: replies.feed}
    return {
        Direction.TO_CONTROLLER: protocol.framer(End.DEVICE).feed,
        Direction.TO_HOST: protocol.framer(End.HOST).feed,
    }


def _name(event: Event) -> str:
    """Return what a line of a capture says of an event."""
    match event:
        case Garbage():
            return "no frame"
        case TextReceived():
            return "text"
        case ReplyReceived():
            return f"reply to {event.request.message.layout.message}"
    try:
        frame = event.frame  # type: ignore[attr-defined]  # of what can be decoded
    except (AttributeError, CodecError):
        return type(event).__name__
    name: str = frame.message.layout.message
    return name
