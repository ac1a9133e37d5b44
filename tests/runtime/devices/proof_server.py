"""A far end on TCP, in real time, that hangs up on request and accepts a second connection."""

from __future__ import annotations

import os
import socket
import struct
import threading
import time
from typing import Any


class Server:
    """A controller on TCP that hangs up on its first host when ``controller`` does, and serves others.

    :param controller: a :class:`proof_line.FarEnd` with ``plug_in()``, which starts a new line.
    :param hosts: number of hosts that it serves, one after another.
    """

    def __init__(self, controller: Any, hosts: int = 2) -> None:
        self._controller = controller
        self._hosts = hosts
        controller.put = lambda delay, data: None
        controller.pulled = lambda: None
        controller.now = time.monotonic
        self._listening = socket.create_server(("127.0.0.1", 0))
        self._listening.settimeout(10)
        self.url = f"socket://127.0.0.1:{self._listening.getsockname()[1]}"
        self._thread = threading.Thread(target=self._serve)
        self._thread.start()

    def _serve(self) -> None:
        for _ in range(self._hosts):
            host, _ = self._listening.accept()
            with host:
                host.settimeout(10)
                self._controller.plug_in()
                while not self._controller.unplugged and (data := host.recv(4096)):
                    for _, said in self._controller.take(data):
                        if said is None:
                            self._controller.unplug()
                        elif not self._controller.unplugged:
                            host.sendall(said)
                if (
                    self._controller.unplugged
                ):  # reset the connection, as if the plug of an adapter were pulled
                    linger = struct.pack("hh" if os.name == "nt" else "ii", 1, 0)
                    host.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, linger)

    def __enter__(self) -> Server:
        return self

    def __exit__(self, *_: object) -> None:
        self._thread.join(20)
        self._listening.close()
        assert not self._thread.is_alive()
