"""A virtual controller on a pseudo-terminal, which programs open like a serial port."""

from __future__ import annotations

import asyncio
import contextlib
import os
import struct
from pathlib import Path

from stagewire_virtual.errors import ServingError
from stagewire_virtual.serving.link import FarEnd, Observer, Run, ServedLink

_CHUNK = 64 * 1024
_GRACE = 1.0  # seconds in which a program can read what was sent before a hang-up
_LOOK = 0.01  # seconds between checks; bytes written to a pseudo-terminal take a moment to arrive


class PtyLink(ServedLink):
    """A link on a pseudo-terminal, on systems that have them.

    It cannot detect whether a program has opened it, so it always counts as connected. Unread bytes are
    buffered up to the limit; pyserial discards them when it opens the port.

    :param symlink: a symbolic link to create, and to remove at the end.
    """

    def __init__(
        self,
        far_end: FarEnd,
        symlink: Path | None = None,
        *,
        label: str = "",
        observer: Observer | None = None,
    ) -> None:
        super().__init__(far_end, label=label, observer=observer)
        self.symlink = symlink
        self._terminal: _Terminal | None = None
        self._leaving: set[_Terminal] = set()

    @property
    def url(self) -> str:
        """The symbolic link, or else the device, such as ``/dev/pts/7``."""
        return str(self.symlink or (self._terminal.name if self._terminal else "pty"))

    @property
    def connected(self) -> bool:
        """Whether the pseudo-terminal exists."""
        return self._terminal is not None

    async def open(self, run: Run) -> None:
        """Create the pseudo-terminal and the symbolic link; see :meth:`ServedLink.open`."""
        self._run = run
        self._plug_in()

    async def close(self) -> None:
        """Hang up, and remove the symbolic link."""
        self._hang_up()
        for terminal in list(self._leaving):
            terminal.close()

    def disconnect(self) -> None:
        """Hang up; a program that has it open gets an error, as when a cable is unplugged.

        For one second the program can still read what was sent before, because systems discard unread bytes
        when a terminal hangs up. A new pseudo-terminal is immediately available through the same symbolic
        link; without a link, :attr:`url` changes.
        """
        if self._terminal is not None:
            self._hang_up(at_once=False)
            try:
                self._plug_in()
            except ServingError as error:
                self.note(f"hung up permanently: {error}")
            else:
                self.note(f"hung up; now at {self.url}")

    def _plug_in(self) -> None:
        terminal = _Terminal(self)
        try:
            if self.symlink is not None:
                _point(self.symlink, terminal.name)
        except OSError as error:
            terminal.close()
            raise ServingError(
                f"cannot create the symbolic link {self.symlink}: {error.strerror or error}; "
                "choose an unused name in a directory that you can write to"
            ) from error
        self._terminal = terminal
        self._greet()

    def _hang_up(self, at_once: bool = True) -> None:
        terminal, self._terminal = self._terminal, None
        if terminal is not None:
            self._leaving.add(terminal)
            if at_once:
                terminal.close()
            else:
                terminal.leave()
            if self.symlink is not None and _points_to(self.symlink, terminal.name):
                with contextlib.suppress(OSError):  # its directory may no longer be writable
                    self.symlink.unlink()

    def _backlog(self) -> int:
        return len(self._terminal.waiting) if self._terminal else 0

    def _put(self, data: bytes) -> None:
        if self._terminal is not None:
            self._terminal.write(data)


class _Terminal:
    """A pseudo-terminal in raw mode on the running event loop."""

    def __init__(self, link: PtyLink) -> None:
        try:
            import pty
            import tty
        except ImportError:
            raise ServingError("this system has no pseudo-terminals; use TCP instead") from None

        self._link = link
        self._loop = asyncio.get_running_loop()
        self.waiting = bytearray()
        """Bytes that the system has not accepted yet."""
        self._looking: asyncio.TimerHandle | None = None
        try:
            self._master, self._slave = pty.openpty()
        except OSError as error:
            raise ServingError(f"cannot open a pseudo-terminal: {error.strerror}") from error
        # Keep the slave side open: the master reads an error while no process has it open.
        tty.setraw(self._slave)
        self.name = os.ttyname(self._slave)
        os.set_blocking(self._master, False)
        self._loop.add_reader(self._master, self._readable)

    def write(self, data: bytes) -> None:
        """Send bytes as soon as the system accepts them."""
        self.waiting += data
        if len(self.waiting) == len(data):
            self._flush()

    def leave(self) -> None:
        """Stop reading and writing, and hang up once the program has read everything or the time is over."""
        self._fall_silent()
        self._look_again(self._loop.time() + _GRACE)

    def close(self) -> None:
        """Hang up; unread bytes are lost."""
        self._fall_silent()
        if self._looking is not None:
            self._looking.cancel()
        os.close(self._master)
        os.close(self._slave)
        self._link._leaving.discard(self)

    def _fall_silent(self) -> None:
        self._loop.remove_reader(self._master)
        self._loop.remove_writer(self._master)

    def _look_again(self, end: float) -> None:
        self._looking = self._loop.call_later(_LOOK, self._look, end)

    def _look(self, end: float) -> None:
        if self._unread() and self._loop.time() < end:
            self._look_again(end)
        else:
            self.close()

    def _unread(self) -> int:
        """Return the number of bytes that the program has not read yet."""
        import fcntl
        import termios

        (count,) = struct.unpack("i", fcntl.ioctl(self._slave, termios.FIONREAD, bytes(4)))
        return int(count)

    def _flush(self) -> None:
        with contextlib.suppress(BlockingIOError):
            del self.waiting[: os.write(self._master, self.waiting)]
        if self.waiting:
            self._loop.add_writer(self._master, self._flush)
        else:
            self._loop.remove_writer(self._master)

    def _readable(self) -> None:
        try:
            data = os.read(self._master, _CHUNK)
        except BlockingIOError:
            return
        self._link._take(data)


def _point(symlink: Path, device: str) -> None:
    """Create a symbolic link to a device; replace a link that a previous server left.

    The pseudo-terminal of such a link no longer exists, or has the same name as the new one, because systems
    reuse the numbers. Raises :class:`OSError` if the name is in use by another server or another file.
    """
    if _points_to(symlink, device):
        return
    beside = symlink.is_symlink() and Path(os.readlink(symlink)).parent == Path(device).parent
    if beside and not symlink.exists():
        symlink.unlink()
    symlink.symlink_to(device)


def _points_to(symlink: Path, device: str) -> bool:
    return symlink.is_symlink() and os.readlink(symlink) == device
