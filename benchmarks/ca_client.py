"""A small client of Channel Access, of which one process can run a thousand, and the IOC that it measures."""

from __future__ import annotations

import asyncio
import os
import re
import socket
import struct
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

HEADER = struct.Struct(">HHHHII")
VERSION, EVENT_ADD, WRITE, CLEAR, CREATE, WRITE_NOTIFY = 0, 1, 4, 12, 18, 19
CLIENT_NAME, HOST_NAME, FAILED = 20, 21, 26
DOUBLE, VALUES = 6, 1
TIMEOUT = 20.0
COMMAND = [sys.executable, "-c", "from stagewire_cli.main import run; run()"]


def message(
    command: int, payload: bytes = b"", kind: int = 0, count: int = 0, one: int = 0, two: int = 0
) -> bytes:
    """Return a message of Channel Access."""
    payload += bytes(-len(payload) % 8)
    return HEADER.pack(command, len(payload), kind, count, one, two) + payload


GREETING = (
    message(VERSION, count=13)
    + message(HOST_NAME, b"localhost\0")
    + message(CLIENT_NAME, b"benchmark\0")
)


class Circuit(asyncio.Protocol):
    """The connection of a client.

    :ivar values: number of events by subscription.
    """

    def __init__(self) -> None:
        self.values: dict[int, int] = {}
        self._data = b""
        self._waiting: dict[tuple[int, int], asyncio.Future[tuple[int, ...]]] = {}
        self._number = 0
        self._transport: asyncio.Transport | None = None

    @classmethod
    async def open(cls, port: int, host: str = "127.0.0.1") -> Circuit:
        """Connect to an IOC."""
        loop = asyncio.get_running_loop()
        _, circuit = await loop.create_connection(cls, host, port)
        circuit.send(GREETING)
        return circuit

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Note the transport."""
        assert isinstance(transport, asyncio.Transport)
        self._transport = transport

    def connection_lost(self, error: Exception | None) -> None:
        """Fail what waits for an answer."""
        for waiting in self._waiting.values():
            if not waiting.done():
                waiting.set_exception(
                    ConnectionError(f"the IOC has closed the connection: {error}")
                )

    def send(self, data: bytes) -> None:
        """Send messages."""
        assert self._transport is not None
        self._transport.write(data)

    def close(self) -> None:
        """Close the connection."""
        assert self._transport is not None
        self._transport.close()

    def data_received(self, data: bytes) -> None:
        """Count events and pass on answers."""
        data = self._data + data
        at = 0
        while len(data) - at >= HEADER.size:
            command, size, *fields = HEADER.unpack_from(data, at)
            if len(data) - at < HEADER.size + size:
                break
            at += HEADER.size + size
            if command == EVENT_ADD:
                number = fields[3]
                self.values[number] = self.values.get(number, 0) + 1
            key = (command, fields[2] if command in (CREATE, FAILED) else fields[3])
            if (waiting := self._waiting.pop(key, None)) is not None:
                waiting.set_result(tuple(fields))
        self._data = data[at:]

    async def _answer(self, command: int, number: int, request: bytes) -> tuple[int, ...]:
        waiting = asyncio.get_running_loop().create_future()
        self._waiting[command, number] = waiting
        self.send(request)
        return await asyncio.wait_for(waiting, TIMEOUT)

    async def channel(self, name: str) -> int:
        """Open a channel and return its number."""
        self._number += 1
        request = message(CREATE, name.encode() + b"\0", one=self._number, two=13)
        return (await self._answer(CREATE, self._number, request))[3]

    async def monitor(self, channel: int) -> int:
        """Subscribe to a channel; return after the first event, with its number in :attr:`values`."""
        self._number += 1
        payload = struct.pack(">fffHH", 0, 0, 0, VALUES, 0)
        request = message(EVENT_ADD, payload, DOUBLE, 1, channel, self._number)
        await self._answer(EVENT_ADD, self._number, request)
        return self._number

    async def put(self, channel: int, value: float) -> int:
        """Put a value, and return the status at the end; 1 is success."""
        self._number += 1
        payload = struct.pack(">d", value)
        request = message(WRITE_NOTIFY, payload, DOUBLE, 1, channel, self._number)
        return (await self._answer(WRITE_NOTIFY, self._number, request))[2]

    def put_only(self, channel: int, value: float) -> None:
        """Put a value without waiting."""
        self.send(message(WRITE, struct.pack(">d", value), DOUBLE, 1, channel, 0))


class IocProcess:
    """An IOC in another process.

    :param process: the process.
    :param port: its port.
    """

    def __init__(self, process: subprocess.Popen[bytes], port: int) -> None:
        self.process = process
        self.port = port

    @property
    def processor(self) -> float:
        """The processor time in seconds since the start."""
        fields = Path(f"/proc/{self.process.pid}/stat").read_text().rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    @property
    def memory(self) -> float:
        """The resident memory in MB."""
        status = Path(f"/proc/{self.process.pid}/status").read_text()
        [found] = re.findall(r"VmRSS:\s+(\d+) kB", status)
        return int(found) * 1024 / 1e6


@contextmanager
def controllers(number: int) -> Iterator[list[str]]:
    """Serve virtual TDC001s in another process, and yield their URLs."""
    words = [sys.executable, __file__, str(number)]
    with subprocess.Popen(
        words, stdout=subprocess.PIPE, stdin=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        try:
            yield [process.stdout.readline().strip() for _ in range(number)]
        finally:
            process.kill()


@contextmanager
def ioc(urls: list[str]) -> Iterator[IocProcess]:
    """Run an IOC with the motors ``m0`` and so on; yield it when it has opened all controllers."""
    tables = "".join(
        f'[controllers.c{at}]\nunit = "TDC001"\nurl = "{url}"\nstage = "Z8"\ntravel_mm = 12\n'
        f'[motors.m{at}]\ncontroller = "c{at}"\nacceleration_time = 0.5\n'
        for at, url in enumerate(urls)
    )
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
    with tempfile.TemporaryDirectory() as folder:
        bench, log = Path(folder, "bench.toml"), Path(folder, "log")
        bench.write_text(tables)
        words = [*COMMAND, "ioc", str(bench), "--port", str(port)]
        with log.open("wb") as output, subprocess.Popen(words, stderr=output) as process:
            try:
                end = time.monotonic() + TIMEOUT
                while log.read_text().count("is open") < len(urls):
                    assert time.monotonic() < end, log.read_text()
                    assert process.poll() is None, log.read_text()
                    time.sleep(0.05)
                yield IocProcess(process, port)
                assert "Traceback" not in log.read_text(), log.read_text()
            finally:
                process.terminate()
                process.wait()


def percentile(values: list[float], percent: float) -> float:
    """Return the value that a percentage of all do not exceed."""
    return sorted(values)[max(0, -(-len(values) * percent // 100).__trunc__() - 1)]


def _serve(number: int) -> None:
    import stagewire_virtual as virtual
    from stagewire_apt import stages

    served = [virtual.TDC001(stage=stages.Z8, serial_number=83000000 + at) for at in range(number)]
    for one in served:
        print(one.tcp().__enter__().url, flush=True)
    sys.stdin.read()


if __name__ == "__main__":
    _serve(int(sys.argv[1]))
