"""A line in memory, for tests: the host writes and reads, and lets time go on."""

from __future__ import annotations

from typing import ClassVar, Final

from stagewire.errors import BadValueError
from stagewire_virtual.clock import nanoseconds, passes
from stagewire_virtual.errors import UnpluggedError
from stagewire_virtual.serving.link import FarEnd, Link, Observer

__all__ = ["MemoryLink"]

_LIMIT: Final = 16 * 1024 * 1024  # a test may let hours pass before it reads


class MemoryLink(Link):
    """A line whose host is a test in the same thread.

    What the host writes is taken at once, at the instant at which the clock stands; what the far end says
    waits until it is read, 16 MiB of it at most.
    """

    limit: ClassVar = _LIMIT

    def __init__(
        self, far_end: FarEnd, *, label: str = "", observer: Observer | None = None
    ) -> None:
        super().__init__(far_end, label=label, observer=observer)
        self._waiting = bytearray()
        self._connected = True
        self._greet()

    @property
    def connected(self) -> bool:
        """Whether the line is plugged in."""
        return self._connected

    @property
    def in_waiting(self) -> int:
        """How many bytes can be read without letting time pass."""
        return len(self._waiting)

    def disconnect(self) -> None:
        """Pull the plug: what was said before can still be read, nothing else."""
        self._connected = False

    def connect(self) -> None:
        """Plug the line in again; nothing of what was said before waits any more."""
        self._waiting.clear()
        self._connected = True
        self._greet()

    def write(self, data: bytes) -> int:
        """Send bytes to the controller, and return how many.

        Raises :class:`~stagewire_virtual.errors.UnpluggedError`, and
        :class:`~stagewire.errors.BadValueError` for what is not bytes.
        """
        if not isinstance(data, (bytes, bytearray, memoryview)):
            raise BadValueError(f"a line carries bytes, not {type(data).__name__}")
        if not self._connected:
            raise UnpluggedError("the line to the controller is unplugged; plug_in() connects it")
        self._take(bytes(data))
        return len(data)

    def read(self, size: int | None = None, timeout: float = 0) -> bytes:
        """Return what the controller said, and let time pass for it if need be.

        :param size: how many bytes are wanted; None: all that there are, and one at least.
        :param timeout: seconds by the clock of the controller; no more time passes than until there are
            enough. What there is by then is returned.

        Raises :class:`~stagewire_virtual.errors.UnpluggedError` when nothing can come any more.
        """
        if not (size is None or (isinstance(size, int) and size >= 0)) or not passes(timeout):
            raise BadValueError(
                "read takes a size of 0 or more, and a time in seconds that has an end, "
                f"not {size!r}, {timeout!r}"
            )
        wanted = 1 if size is None else size
        end = self.clock.now + nanoseconds(timeout)
        while len(self._waiting) < wanted and self._connected and self.clock.now < end:
            due = self.clock.next_due
            self.clock.run_until(end if due is None else min(due, end))
        if not self._waiting and not self._connected:
            raise UnpluggedError("the line to the controller is unplugged; nothing will come")
        taken = bytes(self._waiting if size is None else self._waiting[:size])
        del self._waiting[: len(taken)]
        return taken

    def _backlog(self) -> int:
        return len(self._waiting)

    def _put(self, data: bytes) -> None:
        self._waiting += data
