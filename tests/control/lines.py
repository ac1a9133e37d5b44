"""Controllers of tests of control systems: served, stopped, silenced and killed by the test."""

from __future__ import annotations

import os
import re
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Awaitable, Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any

from bluesky.run_engine import call_in_bluesky_event_loop
from ophyd_async.core import Device

COMMAND = [sys.executable, "-c", "from stagewire_cli.main import run; run()"]


class Served:
    """A virtual controller that ``stagewire serve`` shares, in another process."""

    def __init__(self, process: subprocess.Popen[str], url: str) -> None:
        self.process = process
        self.url = url

    def kill(self) -> None:
        """Kill the server; its clients get an end of file."""
        self.process.kill()

    def silence(self) -> None:
        """Suspend the server; its clients get nothing at all."""
        os.kill(self.process.pid, signal.SIGSTOP)

    def stop_axis(self, unit: str) -> None:
        """Stop the axis as another program would."""
        subprocess.run(
            [*COMMAND, "stop", self.url, "--unit", unit],
            check=True,
            capture_output=True,
            timeout=30,
        )


@contextmanager
def served(url: str) -> Iterator[Served]:
    """Serve a controller until the end of the block."""
    words = [*COMMAND, "serve", url, "--tcp", "0"]
    with subprocess.Popen(words, stderr=subprocess.PIPE, text=True) as process:
        try:
            assert process.stderr is not None
            first = process.stderr.readline()
            found = re.search(r"socket://[\d.:]+", first)
            assert found is not None, first
            yield Served(process, found[0])
        finally:
            process.kill()


@contextmanager
def connected(*devices: Device, mock: bool = False) -> Iterator[None]:
    """Connect devices in the event loop of plans; close their controllers at the end."""

    async def connect() -> None:
        for device in devices:
            await device.connect(mock=mock)

    async def close() -> None:
        for controller in controllers:
            await controller.close()

    controllers = {one.reference.controller for one in devices}  # type: ignore[attr-defined]
    try:
        call_in_bluesky_event_loop(connect(), timeout=30)
        yield
    finally:
        call_in_bluesky_event_loop(close(), timeout=30)


def run(call: Callable[[], Awaitable[Any]], timeout: float = 60) -> Any:
    """Await the result of a call in the event loop of plans."""

    async def wait() -> Any:
        return await call()

    return call_in_bluesky_event_loop(wait(), timeout=timeout)


class Line:
    """A line that records everything before it passes it on."""

    def __init__(self, url: str, listener: socket.socket | None = None) -> None:
        self._listener = listener or socket.create_server(("127.0.0.1", 0))
        host, port = url.removeprefix("socket://").split(":")
        self._target = (host, int(port))
        self.url = f"socket://127.0.0.1:{self._listener.getsockname()[1]}"
        self.sent = b""
        self.received = b""
        self._sockets = [self._listener]
        self._ends: tuple[socket.socket, ...] = ()
        self._silent = False
        self._threads = [threading.Thread(target=self._accept)]
        self._threads[0].start()

    def _accept(self) -> None:
        with suppress(OSError):
            while True:
                client, _ = self._listener.accept()
                server = socket.create_connection(self._target)
                self._ends = (client, server)
                self._sockets += self._ends
                for args in ((client, server, "sent"), (server, client, "received")):
                    self._threads.append(threading.Thread(target=self._pass, args=args))
                    self._threads[-1].start()

    def _pass(self, source: socket.socket, sink: socket.socket, name: str) -> None:
        with suppress(OSError):
            while data := source.recv(4096):
                if not self._silent:
                    setattr(self, name, getattr(self, name) + data)
                    sink.sendall(data)
        with suppress(OSError):  # a line that is lost at one end is lost at both
            sink.shutdown(socket.SHUT_RDWR)

    def inject(self, data: bytes) -> None:
        """Send bytes to the controller, as another program on a shared line would."""
        self._ends[1].sendall(data)

    def silence(self) -> None:
        """Pass nothing on, in either direction."""
        self._silent = True

    def cut(self) -> None:
        """Cut the present connection; the next one is passed on."""
        for one in self._ends:
            with suppress(OSError):
                one.shutdown(socket.SHUT_RDWR)

    def close(self) -> None:
        """Cut the line."""
        for one in self._sockets:
            with suppress(OSError):
                one.shutdown(socket.SHUT_RDWR)
            one.close()
        for thread in self._threads:
            thread.join()


@contextmanager
def recorded(url: str) -> Iterator[Line]:
    line = Line(url)
    try:
        yield line
    finally:
        line.close()


def cause_of(error: BaseException) -> BaseException:
    """Return the error for which a plan failed."""
    while error.__cause__ is not None:
        error = error.__cause__
    return error
