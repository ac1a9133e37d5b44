"""A virtual controller on a pseudo-terminal, which programs take for a serial port."""

from __future__ import annotations

import asyncio
import contextlib
import os
import struct
from pathlib import Path

from stagewire_virtual.errors import ServingError
from stagewire_virtual.serving.link import FarEnd, Observer, Run, ServedLink

_CHUNK = 64 * 1024
_GRACE = 1.0  # seconds in which a program may read what came before the plug was pulled
_LOOK = 0.01  # seconds; what is written to a pseudo-terminal takes a moment to be there


class PtyLink(ServedLink):
    """A far end behind a pseudo-terminal; only where the system has them.

    Nobody can tell whether a program has it open, so it always counts as connected; what nobody reads
    waits, within bounds, and pyserial throws it away when it opens the port.

    :param symlink: a symbolic link that is made, and removed at the end.
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
        """The symbolic link, or the device, such as ``/dev/pts/7``."""
        return str(self.symlink or (self._terminal.name if self._terminal else "pty"))

    @property
    def connected(self) -> bool:
        """Whether the pseudo-terminal is there."""
        return self._terminal is not None

    async def open(self, run: Run) -> None:
        """Make the pseudo-terminal and the symbolic link; see :meth:`ServedLink.open`."""
        self._run = run
        self._plug_in()

    async def close(self) -> None:
        """Hang up, and remove the symbolic link."""
        self._hang_up()
        for terminal in list(self._leaving):
            terminal.close()

    def disconnect(self) -> None:
        """Hang up: a program that has it open meets an error, as when a plug is pulled.

        It can read what was said before, for a second: when a terminal hangs up, systems throw away
        what waits there.
        Another pseudo-terminal is there at once, behind the same symbolic link; without one,
        :attr:`url` changes.
        """
        if self._terminal is not None:
            self._hang_up(at_once=False)
            try:
                self._plug_in()
            except ServingError as error:
                self.note(f"hung up for good: {error}")
            else:
                self.note(f"hung up; from now on at {self.url}")

    def _plug_in(self) -> None:
        terminal = _Terminal(self)
        try:
            if self.symlink is not None:
                _point(self.symlink, terminal.name)
        except OSError as error:
            terminal.close()
            raise ServingError(
                f"cannot make the symbolic link {self.symlink}: {error.strerror or error}; "
                "choose a name that is free, in a folder that you may write to"
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
                with contextlib.suppress(OSError):  # its folder may be somebody else's by now
                    self.symlink.unlink()

    def _backlog(self) -> int:
        return len(self._terminal.waiting) if self._terminal else 0

    def _put(self, data: bytes) -> None:
        if self._terminal is not None:
            self._terminal.write(data)


class _Terminal:
    """A pseudo-terminal in raw mode, read and written by the running event loop."""

    def __init__(self, link: PtyLink) -> None:
        try:
            import pty
            import tty
        except ImportError:
            raise ServingError("this system has no pseudo-terminals; serve it by TCP") from None

        self._link = link
        self._loop = asyncio.get_running_loop()
        self.waiting = bytearray()
        """What the system does not take yet."""
        self._looking: asyncio.TimerHandle | None = None
        try:
            self._master, self._slave = pty.openpty()
        except OSError as error:
            raise ServingError(f"no pseudo-terminal is to be had: {error.strerror}") from error
        # Our own end of the program's side stays open: the master reads an error while nobody has it open.
        tty.setraw(self._slave)
        self.name = os.ttyname(self._slave)
        os.set_blocking(self._master, False)
        self._loop.add_reader(self._master, self._readable)

    def write(self, data: bytes) -> None:
        """Send bytes as soon as the system takes them."""
        self.waiting += data
        if len(self.waiting) == len(data):
            self._flush()

    def leave(self) -> None:
        """Hear and say nothing any more; hang up when the program has read what is there, or had its time."""
        self._fall_silent()
        self._look_again(self._loop.time() + _GRACE)

    def close(self) -> None:
        """Hang up; what waits is lost."""
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
        """Return how many bytes the program has not read yet."""
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
    """Make a symbolic link to a device, in place of one that a server left behind.

    Its pseudo-terminal is gone, or is the new one: systems number them anew. One that is there belongs to
    another server. Raises :class:`OSError` for that, and for whatever else has the name.
    """
    if _points_to(symlink, device):
        return
    beside = symlink.is_symlink() and Path(os.readlink(symlink)).parent == Path(device).parent
    if beside and not symlink.exists():
        symlink.unlink()
    symlink.symlink_to(device)


def _points_to(symlink: Path, device: str) -> bool:
    return symlink.is_symlink() and os.readlink(symlink) == device
