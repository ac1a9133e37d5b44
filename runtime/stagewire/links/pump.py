"""A thread that reads a port for which the system cannot wait: ``rfc2217://``, ``loop://``, COM ports."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable

from stagewire.links.loss import HUNG_UP, because
from stagewire.links.serial_port import Port

__all__ = ["Pump", "write_all"]

_WRITTEN_AT_ONCE = 256  # bytes: so the time that a port has for a write is time for a few bytes
_LONGEST_END = 10.0  # seconds; pyserial needs up to 7 to close a line over a network


class Pump:
    """Reads a port in a thread of its own, and waits there without a time limit.

    :param port: open.
    :param received: called in the thread with what came.
    :param lost: called in the thread, once, with why the port can be read no more; not after :meth:`stop`.
    """

    def __init__(
        self, port: Port, received: Callable[[bytes], None], lost: Callable[[str], None]
    ) -> None:
        self._port = port
        self._received = received
        self._lost = lost
        self._stopping = False
        self._thread = threading.Thread(target=self._run, name=f"reads {port.port}", daemon=True)

    def start(self) -> None:
        """Begin to read."""
        self._thread.start()

    def stop(self) -> None:
        """Close the port, and wait for the thread to end, if it began."""
        self._stopping = True
        with contextlib.suppress(
            Exception
        ):  # what can be cancelled, and what is gone, differs from port to port
            self._port.cancel_read()
        if not hasattr(self._port, "cancel_read"):
            self._close()
        if self._thread.is_alive():
            self._thread.join(_LONGEST_END)
        self._close()

    def _close(self) -> None:
        with contextlib.suppress(Exception):  # that of a port that is gone
            self._port.close()

    def _run(self) -> None:
        why = HUNG_UP
        try:
            while not self._stopping and self._pass_on():
                pass
        except (
            Exception
        ) as error:  # what pyserial raises for a port that is gone differs from port to port
            why = because(error)
        if not self._stopping:
            self._lost(why)

    def _pass_on(self) -> bool:
        """Pass on what comes next; return whether more can come.

        A read without a time limit that returns too little was cancelled, or its port is gone.
        """
        data = self._port.read(1)
        waiting = self._port.in_waiting if data else 0
        whole = len(data) + waiting if data else 1
        if waiting:
            data += self._port.read(waiting)
        if data:
            self._received(bytes(data))
        return len(data) == whole


def write_all(port: Port, data: bytes) -> None:
    """Write everything, or raise what the port raises."""
    for start in range(0, len(data), _WRITTEN_AT_ONCE):
        port.write(data[start : start + _WRITTEN_AT_ONCE])
