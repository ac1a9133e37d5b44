"""``stagewire panel`` on a terminal: signals, a hang-up, and a terminal that accepts no output."""

from __future__ import annotations

import os
import re
import signal
import struct
import subprocess
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest
from served_controller import COMMAND, serving, wait_for

fcntl = pytest.importorskip("fcntl", reason="needs pseudo-terminals")
pty = pytest.importorskip("pty", reason="needs pseudo-terminals")
termios = pytest.importorskip("termios", reason="needs pseudo-terminals")

Z8 = ("TDC001", "--stage", "Z8")
_DRAWINGS = 60
"""How often the panel must draw the whole screen to fill the buffers of the terminal and of Textual."""


class Terminal:
    """A pseudo-terminal of 80 columns and 24 rows on which a panel runs."""

    def __init__(self, url: str) -> None:
        self._master, slave = pty.openpty()
        fcntl.ioctl(slave, termios.TIOCSWINSZ, struct.pack("HHHH", 24, 80, 0, 0))
        words = ["panel", url, "--unit", "TDC001", "--stage", "Z8", "--travel", "50"]
        self.process = subprocess.Popen(
            [*COMMAND, *words],
            stdin=slave,
            stdout=slave,
            stderr=slave,
            start_new_session=True,
            preexec_fn=lambda: fcntl.ioctl(0, termios.TIOCSCTTY, 0),
            env={**os.environ, "TERM": "xterm-256color"},
        )
        os.close(slave)
        self.output = b""
        self._reads = threading.Event()
        self._reads.set()
        self._changed = threading.Condition()
        self._thread = threading.Thread(target=self._read)
        self._thread.start()

    def _read(self) -> None:
        while self._reads.wait():
            try:
                data = os.read(self._master, 4096)
            except OSError:
                return
            with self._changed:
                self.output += data
                self._changed.notify_all()
            if not data:
                return

    def type(self, keys: bytes) -> None:
        os.write(self._master, keys)

    def wait_for(self, text: bytes) -> None:
        with self._changed:
            assert self._changed.wait_for(lambda: text in self.output, 30), self.output[-2000:]

    def freeze(self) -> None:
        """Accept no further output, and let the panel draw until it waits for the terminal."""
        self._reads.clear()
        self.type(b"?")  # the reading thread may still wait for one answer
        for number in range(_DRAWINGS):
            size = struct.pack("HHHH", 24 + number % 2, 80, 0, 0)
            fcntl.ioctl(self._master, termios.TIOCSWINSZ, size)
            time.sleep(0.05)

    def close(self) -> None:
        """Hang up."""
        self._reads.set()
        if self._master >= 0:
            os.close(self._master)
            self._master = -1


@contextmanager
def running(log: Path, *, moving: bool = True) -> Iterator[Terminal]:
    """Run a panel on a terminal; its axis is on a long way."""
    with serving(*Z8, "--log", log) as url:
        terminal = Terminal(url)
        try:
            terminal.wait_for(b"stops all axes")
            if moving:
                terminal.type(b"g")
                terminal.wait_for(b"Go to position")
                terminal.type(b"50\r")
                wait_for(log, "MOT_MOVE_ABSOLUTE")
            yield terminal
        finally:
            with suppress(ProcessLookupError):
                terminal.process.kill()
            terminal.process.wait()
            terminal.close()
            terminal._thread.join()


@pytest.mark.parametrize("name", ["SIGTERM", "SIGINT"])
def test_a_signal_stops_the_axes_and_restores_the_terminal(tmp_path: Path, name: str) -> None:
    log = tmp_path / "log.txt"
    with running(log) as terminal:
        terminal.process.send_signal(signal.Signals[name])
        assert terminal.process.wait(30) == 128 + signal.Signals[name]
        assert "MOT_MOVE_STOP" in log.read_text()
        terminal.wait_for(b"\x1b[?1049l")  # back to the main screen
        assert b"Traceback" not in terminal.output


def test_the_end_of_the_terminal_stops_the_axes(tmp_path: Path) -> None:
    log = tmp_path / "log.txt"
    with running(log) as terminal:
        terminal.process.send_signal(signal.SIGHUP)
        os.close(terminal._master)
        terminal._master = -1
        wait_for(log, "MOT_MOVE_STOP")
        terminal.process.wait(30)


def test_the_stop_is_sent_while_the_terminal_accepts_no_output(tmp_path: Path) -> None:
    log = tmp_path / "log.txt"
    with running(log) as terminal:
        terminal.freeze()
        terminal.type(b" ")
        wait_for(log, "MOT_MOVE_STOP")


def test_quitting_leaves_the_last_position_on_the_terminal(tmp_path: Path) -> None:
    log = tmp_path / "log.txt"
    with running(log, moving=False) as terminal:
        terminal.type(b"q")
        assert terminal.process.wait(30) == 0
        terminal.wait_for(b": at 0.0000 mm")
        assert re.search(rb"TDC001 83\d{6}: at 0.0000 mm", terminal.output)
