"""The time from the stop key on a terminal until the stop arrives at the line, in ``stagewire panel``.

A panel with two axes runs on a pseudo-terminal. The time begins when the space bar is written to the
terminal, and ends when the stop of the moving axis arrives at a relay in this process. Esc is not measured:
terminals begin other keys with it, so programs wait up to 0.1 s for the rest.

    python benchmarks/panel_stop.py
    python benchmarks/panel_stop.py --stops 5
"""

from __future__ import annotations

import argparse
import fcntl
import os
import pty
import socket
import struct
import subprocess
import sys
import termios
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress

from measure import holds

import stagewire_virtual as virtual
from stagewire_apt import stages

STOPS = 20
AT_MOST = 50.0  # ms, the longest of all
PATIENCE = 20.0
STOP = bytes.fromhex("65 04")
MOVE = bytes.fromhex("48 04")
RELEASE = 0.8  # s after a stop, in which the panel refuses motions
COMMAND = [sys.executable, "-c", "from stagewire_cli.main import run; run()"]


class Relay:
    """A TCP port that passes bytes on to a controller, and notes when messages arrive.

    :param target: URL of the controller.
    """

    def __init__(self, target: str) -> None:
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.url = f"socket://127.0.0.1:{self._listener.getsockname()[1]}"
        self.is_silent = False
        self.arrived: dict[bytes, list[float]] = {STOP: [], MOVE: []}
        self.changed = threading.Condition()
        host, _, port = target.removeprefix("socket://").partition(":")
        self._target = (host, int(port))
        threading.Thread(target=self._serve, daemon=True).start()

    def _serve(self) -> None:
        while True:
            try:
                panel, _ = self._listener.accept()
            except OSError:
                return
            controller = socket.create_connection(self._target)
            for one in (panel, controller):
                one.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            for pair in ((panel, controller, self._note), (controller, panel, None)):
                threading.Thread(target=self._pass_on, args=pair, daemon=True).start()

    def _pass_on(
        self, source: socket.socket, sink: socket.socket, note: Callable[[bytes], None] | None
    ) -> None:
        with suppress(OSError):
            while data := source.recv(4096):
                if note is not None:
                    note(data)
                elif self.is_silent:
                    continue
                sink.sendall(data)
        sink.close()

    def _note(self, data: bytes) -> None:
        now = time.monotonic()
        with self.changed:
            for message, times in self.arrived.items():
                times += [now] * data.count(message)
            self.changed.notify_all()

    def wait_for(self, message: bytes, after: float) -> float:
        """Return when a message arrived that was sent after a time."""

        def found() -> float | None:
            return next((when for when in self.arrived[message] if when >= after), None)

        with self.changed:
            assert self.changed.wait_for(lambda: found() is not None, PATIENCE), message
            return found() or 0.0

    def close(self) -> None:
        """Accept no further connection."""
        self._listener.close()


class Screen:
    """A terminal on which a panel runs.

    :param urls: the lines of the panel.
    """

    def __init__(self, *urls: str) -> None:
        self.master, slave = pty.openpty()
        self.size(0)
        words = ["panel", *urls, "--unit", "TDC001", "--stage", "Z8", "--travel", "-1000,1000"]
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
        self.reads = threading.Event()
        self.reads.set()
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self) -> None:
        while self.reads.wait():
            try:
                self.output += os.read(self.master, 65536)
            except OSError:
                return

    def size(self, more: int) -> None:
        """Change the number of rows, so that the panel draws the whole screen."""
        size = struct.pack("HHHH", 30 + more, 100, 0, 0)
        fcntl.ioctl(self.master, termios.TIOCSWINSZ, size)

    def press(self, keys: bytes) -> float:
        """Write keys to the terminal, and return when."""
        now = time.monotonic()
        os.write(self.master, keys)
        return now

    def wait_for(self, text: bytes) -> None:
        """Wait until the panel has written a text."""
        end = time.monotonic() + PATIENCE
        while text not in self.output:
            assert time.monotonic() < end, self.output[-500:]
            time.sleep(0.01)

    def close(self) -> None:
        """End the panel."""
        self.reads.set()
        self.process.terminate()
        self.process.wait()
        os.close(self.master)


def draw(screen: Screen) -> None:
    """Make the panel draw its whole screen ten times in a row."""
    for number in range(10):
        screen.size(number % 2)


def freeze(screen: Screen) -> None:
    """Let the panel draw until it waits for the terminal."""
    screen.reads.clear()
    for number in range(60):
        screen.size(number % 2)
        time.sleep(0.02)


def type_position(screen: Screen) -> None:
    """Open a dialogue and type a position."""
    screen.press(b"g12")
    time.sleep(0.3)


def silence(other: Relay) -> None:
    """Let the requests of another axis wait for answers that never arrive."""
    other.is_silent = True
    time.sleep(0.3)


@contextmanager
def panel() -> Iterator[tuple[Screen, Relay, Relay]]:
    """Run a panel on two axes; yield the terminal and both lines."""
    with ExitStack() as stack:
        relays = []
        for number in (1, 2):
            controller = virtual.TDC001(stage=stages.Z8, serial_number=83000000 + number)
            relays.append(Relay(stack.enter_context(controller.tcp()).url))
            stack.callback(relays[-1].close)
        screen = Screen(*(relay.url for relay in relays))
        stack.callback(screen.close)
        screen.wait_for(b"stops all axes")
        yield screen, relays[0], relays[1]


CASES: dict[str, Callable[[Screen, Relay], None]] = {
    "nothing else happens": lambda screen, other: None,
    "a dialogue is open": lambda screen, other: type_position(screen),
    "the screen is drawn": lambda screen, other: draw(screen),
    "another axis times out": lambda screen, other: silence(other),
    "the terminal accepts no output": lambda screen, other: freeze(screen),
}


def delays(case: Callable[[Screen, Relay], None], stops: int) -> list[float]:
    """Return the time of each stop in ms."""
    found = []
    with panel() as (screen, line, other):
        screen.press(b"++++")  # the largest step
        for number in range(stops):
            time.sleep(RELEASE)
            began = screen.press(b"\x1b[C" if number % 2 else b"\x1b[D")
            line.wait_for(MOVE, began)
            time.sleep(0.05)
            case(screen, other)
            pressed = screen.press(b" ")
            found.append((line.wait_for(STOP, pressed) - pressed) * 1e3)
            if not screen.reads.is_set():
                screen.reads.set()
    return found


def main(stops: int) -> bool:
    """Measure; return whether all bounds hold."""
    kept = True
    for name, case in CASES.items():
        found = delays(case, stops)
        print(f"{name}: {stops} stops, median {sorted(found)[len(found) // 2]:.1f} ms")
        kept &= holds("longest", max(found), AT_MOST, "ms")
    return kept


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--stops", type=int, default=STOPS)
    sys.exit(0 if main(parser.parse_args().stops) else 1)
