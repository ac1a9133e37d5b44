"""``--log`` of a conformance run: a line that records what passes."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from stagewire.links import Link
from stagewire.protocols import CommandProtocol, FramedProtocol, Protocol
from stagewire.sessions import Recording

__all__ = ["recorded"]


class _Recorded(Link):
    """A line of which everything is recorded.

    :param link: what does the work.
    """

    def __init__(self, link: Link, recording: Recording) -> None:
        self.url = link.url
        self.clock = link.clock
        self._link = link
        self._recording = recording

    def read(self, timeout: float) -> bytes:
        """Read, and record what came."""
        data = self._link.read(timeout)
        if data:
            self._recording.received(data)
        return data

    def write(self, data: bytes) -> None:
        """Record, and write."""
        self._recording.sent(data)
        self._link.write(data)

    def write_now(self, data: bytes) -> None:
        """Write without waiting for anything, the recording included."""
        self._link.write_now(data)

    def wake(self) -> None:
        """Let a read that waits return soon."""
        self._link.wake()

    def close(self) -> None:
        """Close the line; the recording is closed by who made it."""
        self._link.close()


@contextmanager
def recorded(link: Link, path: Path | None, protocol: Protocol, unit: str) -> Iterator[Link]:
    """Give a line that is recorded until the block ends; the line itself without a path.

    Raises :class:`~stagewire.errors.TransportError` for a file that cannot be written.
    """
    if path is None:
        yield link
        return
    assert isinstance(protocol, FramedProtocol | CommandProtocol)  # the suite knows no others
    recording = Recording(path, protocol, link.clock or time.monotonic, unit)
    try:
        yield _Recorded(link, recording)
    finally:
        recording.close()
