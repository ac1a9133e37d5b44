"""Far ends of lines that echo what they receive, one of each kind."""

from __future__ import annotations

import contextlib
import os
import select
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

KINDS = ["loop", "socket", "rfc2217", *(["pty"] if os.name == "posix" else [])]
CAN_BE_LOST = [kind for kind in KINDS if kind != "loop"]


@dataclass
class FarEnd:
    url: str
    hang_up: Callable[[], None]


@contextmanager
def loop() -> Iterator[FarEnd]:
    yield FarEnd("loop://", lambda: None)


@contextmanager
def tcp() -> Iterator[FarEnd]:
    with _served(_say_again) as far:
        yield FarEnd(f"socket://127.0.0.1:{far.port}", far.hang_up)


@contextmanager
def rfc2217() -> Iterator[FarEnd]:
    with _served(_serve_rfc2217) as far:
        yield FarEnd(f"rfc2217://127.0.0.1:{far.port}", far.hang_up)


@contextmanager
def pty() -> Iterator[FarEnd]:
    master, slave = os.openpty()
    url = os.ttyname(slave)
    stop, stopped = socket.socketpair()

    def say_again() -> None:
        while stopped not in select.select([master, stopped], [], [])[0]:
            heard = memoryview(os.read(master, 4096))
            while heard and stopped not in (ready := select.select([stopped], [master], []))[0]:
                heard = heard[os.write(master, heard) if ready[1] else 0 :]

    os.set_blocking(master, False)
    thread = threading.Thread(target=say_again)
    thread.start()

    def hang_up() -> None:
        if thread.is_alive():
            stop.send(b"!")
            thread.join()
            os.close(master)
            os.close(slave)

    with stop, stopped:
        yield FarEnd(url, hang_up)
        hang_up()


FAR_ENDS = {"loop": loop, "socket": tcp, "rfc2217": rfc2217, "pty": pty}


class _Served:
    """A TCP server that runs a function for each connection, in a thread."""

    def __init__(self, serve: Callable[[socket.socket], None]) -> None:
        self._serve = serve
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port = self._listener.getsockname()[1]
        self._connections: list[socket.socket] = []
        self._threads = [threading.Thread(target=self._accept)]
        self._threads[0].start()

    def _accept(self) -> None:
        with contextlib.suppress(OSError):
            while True:
                connection = self._listener.accept()[0]
                self._connections.append(connection)
                self._threads.append(threading.Thread(target=self._run, args=(connection,)))
                self._threads[-1].start()

    def _run(self, connection: socket.socket) -> None:
        with contextlib.suppress(OSError):  # the host hung up, or the test did
            self._serve(connection)

    def hang_up(self) -> None:
        with contextlib.suppress(OSError):
            self._listener.shutdown(socket.SHUT_RDWR)
        self._listener.close()
        self._threads[0].join()
        for connection in self._connections:
            with contextlib.suppress(OSError):
                connection.shutdown(socket.SHUT_RDWR)
        for thread in self._threads[1:]:
            thread.join()
        for connection in self._connections:
            connection.close()


@contextmanager
def _served(serve: Callable[[socket.socket], None]) -> Iterator[_Served]:
    far = _Served(serve)
    try:
        yield far
    finally:
        far.hang_up()


def _say_again(connection: socket.socket) -> None:
    while heard := connection.recv(4096):
        connection.sendall(heard)


def _serve_rfc2217(connection: socket.socket) -> None:
    """Serve a line whose far end echoes, using pyserial's ``loop://``."""
    import serial
    import serial.rfc2217

    class Telnet:
        write = staticmethod(connection.sendall)

    port = serial.serial_for_url("loop://", timeout=None)
    manager = serial.rfc2217.PortManager(port, Telnet)

    def to_host() -> None:
        with contextlib.suppress(OSError, TypeError):
            while heard := port.read(1):
                heard += port.read(port.in_waiting)
                connection.sendall(b"".join(manager.escape(heard)))

    thread = threading.Thread(target=to_host)
    thread.start()
    try:
        while heard := connection.recv(4096):
            port.write(b"".join(manager.filter(heard)))
    finally:
        port.cancel_read()
        thread.join()
        port.close()
