"""Serve a simulated controller of the vendor's XA SDK on a TCP port of this machine.

    python interop/xa_bridge.py '{"PartNumber": "LTS300C", "SerialNumber": "45000001"}'

It prints the URL, and serves one host after the other until it is ended. It is a process of its own for each
controller, because the native library keeps the hardware information of the first one.

The Python interface of the package has no function for raw packets. The C functions ``TLMC_WritePacket`` and
``TLMC_RegisterPacketHandler`` are in the vendor's public C example for the SDK, and are called with ctypes.
The operating mode keeps the line silent: the SDK loads no parameters and asks for no status of its own.
"""

from __future__ import annotations

import ctypes
import json
import os
import socket
import sys
from collections.abc import Iterator

from thorlabs_xa.native_sdks.c_native_functions import CNativeFunctions
from thorlabs_xa.shared.enums import TLMC_OperatingMode as Mode

from stagewire.framing import End
from stagewire_apt import PROTOCOL

MODE = (
    Mode.TLMC_OperatingMode_ManualStatusPolling
    | Mode.TLMC_OperatingMode_DoNotLoadParamsOnConnect
    | Mode.TLMC_OperatingMode_DoNotSendDisconnectOnFinalClose
)
HANDLER = ctypes.CFUNCTYPE(None, ctypes.POINTER(ctypes.c_ubyte), ctypes.c_size_t, ctypes.c_size_t)
"""The C type of a packet handler: the bytes, their number, and a value of the user."""


class Simulation:
    """A simulated controller and its handle.

    :param description: the description of the SDK: part number, serial number, and actuator or channels.
    """

    def __init__(self, description: dict[str, object]) -> None:
        self._functions = CNativeFunctions()
        self._functions.startup(None)
        self._functions.create_simulation(description)
        self.host: socket.socket | None = None
        """The connected host, which gets the packets of the controller."""
        self._handler = HANDLER(self._received)
        self._handle = self._functions.open(str(description["SerialNumber"]), "", MODE)
        status = self._functions.xa_lib.TLMC_RegisterPacketHandler(
            ctypes.c_ulong(self._handle), self._handler, ctypes.c_size_t(0)
        )
        self._functions.wrap_error_code(status)

    def send(self, frame: bytes) -> None:
        """Send a frame to the controller."""
        status = self._functions.xa_lib.TLMC_WritePacket(
            ctypes.c_ulong(self._handle), frame, ctypes.c_size_t(len(frame))
        )
        self._functions.wrap_error_code(status)

    def _received(self, data: ctypes._Pointer[ctypes.c_ubyte], length: int, _value: int) -> None:
        print("<", bytes(data[:length]).hex(" "), file=sys.stderr)
        if self.host is not None:
            try:
                self.host.sendall(bytes(data[:length]))
            except OSError:
                self.host = None


def frames(host: socket.socket) -> Iterator[bytes]:
    """Yield the frames of a host until it disconnects."""
    framer = PROTOCOL.framer(End.DEVICE)
    while True:
        try:
            data = host.recv(4096)
        except OSError:
            return
        if not data:
            return
        for event in framer.feed(data):
            yield event.raw


def main(description: str) -> None:
    """Start the simulation, print the URL, and serve hosts."""
    out = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # the native library prints its errors to standard output
    simulation = Simulation(json.loads(description))
    with socket.create_server(("127.0.0.1", 0)) as server:
        print(f"socket://127.0.0.1:{server.getsockname()[1]}", file=out, flush=True)
        while True:
            host = server.accept()[0]
            with host:
                simulation.host = host
                for frame in frames(host):
                    print(">", frame.hex(" "), file=sys.stderr)
                    simulation.send(frame)
                simulation.host = None


if __name__ == "__main__":
    main(sys.argv[1])
