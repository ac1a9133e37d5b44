"""``stagewire serve``: one client writes, the others listen, and a stop is taken from everyone."""

from __future__ import annotations

import asyncio
import os
import re
import signal
import subprocess
import sys
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import asynccontextmanager, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from stagewire.capture import read_capture
from stagewire.errors import MotionStoppedError, TransportLostError
from stagewire.links import AsyncLink
from stagewire.protocols import load_protocol
from stagewire_apt import TDC001
from stagewire_cli.line_server import LineServer

if TYPE_CHECKING:
    from conftest import Stagewire

COMMAND = [sys.executable, "-c", "from stagewire_cli.main import run; run()"]
MOVE = bytes.fromhex("53040600D0010100400D0300")
STOP = bytes.fromhex("650401025001")
ASK = bytes.fromhex("900401005001")
ALIVE = bytes.fromhex("920400005001")
START_UPDATES = bytes.fromhex("110000005001")
STATUS = bytes.fromhex("640401000150")


class Line(AsyncLink):
    """A line that keeps what is written."""

    url = "line"

    def __init__(self) -> None:
        self.written: list[bytes] = []

    def start(
        self, received: Callable[[bytes], None], lost: Callable[[TransportLostError], None]
    ) -> None:
        self.received, self.lost = received, lost

    def write(self, data: bytes) -> None:
        self.written.append(data)

    def write_now(self, data: bytes) -> None:
        self.write(data)

    async def close(self) -> None:
        pass


class Client:
    """A client of the server."""

    def __init__(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self.read, self.writer = reader, writer
        host, port, *_ = writer.get_extra_info("sockname")
        self.name = f"{host}:{port}"

    def send(self, data: bytes) -> None:
        self.writer.write(data)


class Bench:
    """A server on a line, its log, and its clients."""

    def __init__(self, protocol: str, unit: str, baudrate: int) -> None:
        self.line = Line()
        self.log: list[str] = []
        self.server = LineServer(
            self.line, load_protocol(protocol), unit, lambda dest: ALIVE, baudrate, self.log.append
        )
        self._clients: list[Client] = []
        self.port = 0

    async def client(self) -> Client:
        found = Client(*await asyncio.open_connection("127.0.0.1", self.port))
        self._clients.append(found)
        await self.until(lambda: f"{found.name} connected" in self.log)
        return found

    async def until(self, condition: Callable[[], object]) -> None:
        async with asyncio.timeout(20):
            while not condition():
                await asyncio.sleep(0.001)

    async def close(self) -> None:
        for client in self._clients:
            client.writer.close()


@asynccontextmanager
async def serving(
    protocol: str = "thorlabs_apt", unit: str = "TDC001", baudrate: int = 0
) -> AsyncIterator[Bench]:
    bench = Bench(protocol, unit, baudrate)
    ready: asyncio.Future[int] = asyncio.get_running_loop().create_future()
    task = asyncio.create_task(bench.server.run("127.0.0.1", 0, ready.set_result))
    bench.port = await ready
    try:
        yield bench
    finally:
        await bench.close()
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)


def test_the_first_client_that_sends_holds_the_line() -> None:
    async def run() -> None:
        async with serving() as bench:
            listener, writer = await bench.client(), await bench.client()
            writer.send(ASK)
            await bench.until(lambda: bench.line.written == [ASK])
            bench.line.received(STATUS)
            assert await listener.read.readexactly(6) == STATUS
            assert await writer.read.readexactly(6) == STATUS
            listener.send(MOVE)
            assert await listener.read.read() == b""
            refused = (
                f"{listener.name} was disconnected: it sent MOT_MOVE_ABSOLUTE, but {writer.name}"
            )
            assert f"{refused} holds the line" in bench.log
            assert bench.line.written == [ASK]

    asyncio.run(run())


def test_the_line_is_free_when_its_holder_leaves() -> None:
    async def run() -> None:
        async with serving() as bench:
            first, second = await bench.client(), await bench.client()
            first.send(ASK)
            await bench.until(lambda: bench.line.written)
            first.writer.close()
            await bench.until(
                lambda: "the line is free; a motion that was started continues" in bench.log
            )
            second.send(MOVE)
            await bench.until(lambda: bench.line.written == [ASK, MOVE])

    asyncio.run(run())


def test_a_stop_of_a_listener_overtakes_and_drops_motions_that_wait() -> None:
    async def run() -> None:
        async with serving(baudrate=300) as bench:  # a frame takes a third of a second
            listener, writer = await bench.client(), await bench.client()
            writer.send(ASK + MOVE + ASK + MOVE)
            await bench.until(lambda: bench.line.written)
            listener.send(STOP)
            await bench.until(lambda: len(bench.line.written) == 3)
            assert bench.line.written == [ASK, STOP, ASK]
            assert bench.log.count("not sent, because of the stop: MOT_MOVE_ABSOLUTE") == 2
            assert f"{listener.name} stops: MOT_MOVE_STOP" in bench.log
            assert f"{listener.name} holds the line" not in bench.log

    asyncio.run(run())


def test_a_stop_of_a_refused_client_still_gets_through() -> None:
    async def run() -> None:
        async with serving() as bench:
            writer, other = await bench.client(), await bench.client()
            writer.send(ASK)
            await bench.until(lambda: bench.line.written)
            other.send(MOVE + STOP)
            await bench.until(lambda: bench.line.written == [ASK, STOP])

    asyncio.run(run())


def test_a_holder_that_sends_invalid_bytes_loses_its_waiting_motions() -> None:
    async def run() -> None:
        async with serving(baudrate=300) as bench:
            writer = await bench.client()
            writer.send(ASK + MOVE + ASK + b"rubbish" * 9)
            await bench.until(lambda: len(bench.line.written) == 2)
            assert bench.line.written == [ASK, ASK]

    asyncio.run(run())


def test_half_a_frame_of_a_client_never_reaches_the_line() -> None:
    async def run() -> None:
        async with serving() as bench:
            dying, other = await bench.client(), await bench.client()
            dying.send(ASK + MOVE[:7])
            await bench.until(lambda: bench.line.written)
            other.send(STOP)
            await bench.until(lambda: len(bench.line.written) == 2)
            dying.writer.close()
            await bench.until(lambda: f"{dying.name} left" in bench.log)
            other.send(ASK)
            await bench.until(lambda: len(bench.line.written) == 3)
            assert bench.line.written == [ASK, STOP, ASK]

    asyncio.run(run())


def test_invalid_bytes_disconnect_their_client() -> None:
    async def run() -> None:
        async with serving() as bench:
            client = await bench.client()
            client.send(b"hello, world, this is not a frame")
            assert await client.read.read() == b""
            assert bench.log[1].startswith(
                f"{client.name} was disconnected: it sent invalid bytes: "
            )
            assert bench.line.written == []

    asyncio.run(run())


def test_the_server_keeps_the_controller_alive_for_listeners() -> None:
    async def run() -> None:
        async with serving() as bench:
            listener, other = await bench.client(), await bench.client()
            listener.send(ALIVE)  # does not hold the line
            other.send(START_UPDATES)
            await bench.until(lambda: bench.line.written.count(ALIVE) == 2)
            assert bench.line.written[0] == START_UPDATES
            assert f"{other.name} holds the line" in bench.log

    asyncio.run(run())


def test_a_slow_listener_is_disconnected() -> None:
    async def run() -> None:
        async with serving() as bench:
            slow, writer = await bench.client(), await bench.client()
            writer.send(ASK)
            slow.writer.transport.pause_reading()  # type: ignore[attr-defined]
            block = STATUS * 20_000

            def is_gone() -> bool:
                bench.line.received(block)
                return any(
                    f"{slow.name} was disconnected: it has not read the last 1 MiB" in x
                    for x in bench.log
                )

            async def drain() -> None:
                while await writer.read.read(1 << 20):
                    pass

            draining = asyncio.create_task(drain())
            await bench.until(is_gone)
            assert f"{writer.name} left" not in bench.log
            draining.cancel()

    asyncio.run(run())


def test_commands_of_an_ms2000_are_shared() -> None:
    ask, stop, move = (
        bytes.fromhex(text) for text in ("18 61 03 3A", "18 42 00 3A", "18 54 03 A0 86 01 3A")
    )

    async def run() -> None:
        async with serving("asi_ms2000", "MS2000") as bench:
            writer, other = await bench.client(), await bench.client()
            writer.send(move)
            await bench.until(lambda: bench.line.written == [move])
            other.send(stop)
            await bench.until(lambda: bench.line.written == [move, stop])
            other.send(ask)
            assert await other.read.read() == b""

    asyncio.run(run())


def test_a_lost_line_ends_the_server() -> None:
    async def run() -> None:
        async with serving() as bench:
            client = await bench.client()
            bench.line.lost(TransportLostError("the line is lost"))
            assert await client.read.read() == b""

    asyncio.run(run())


@contextmanager
def shared(*words: str) -> Iterator[tuple[subprocess.Popen[str], str]]:
    with subprocess.Popen(
        [*COMMAND, "serve", *words, "--tcp", "0"], stderr=subprocess.PIPE, text=True, env=os.environ
    ) as process:
        assert process.stderr is not None
        line = process.stderr.readline()
        found = re.search(r"socket://127\.0\.0\.1:\d+", line)
        assert found is not None, line
        try:
            yield process, found[0]
        finally:
            process.send_signal(signal.SIGINT)
            process.stderr.read()


@pytest.mark.skipif(sys.platform == "win32", reason="sends SIGINT")
def test_a_device_moves_while_the_command_listens_and_stops_it(stagewire: Stagewire) -> None:
    with shared("virtual://TDC001?stage=Z8") as (process, url), TDC001.open(url, stage="Z8") as tdc:
        tdc.start_updates()
        watched = stagewire(
            "monitor", url, "--unit", "TDC001", "--stage", "Z8", "--listen", "--for", "0.5"
        )
        assert "position_mm=" in watched.out
        motion = tdc.start_move_velocity("FORWARD")
        assert stagewire("stop", url, "--unit", "TDC001").out == "TDC001: stopped\n"
        with pytest.raises(MotionStoppedError):
            motion.wait(20)
    assert process.returncode == 0


def test_a_listener_sends_nothing_at_all(stagewire: Stagewire, tmp_path: Path) -> None:
    log, table = tmp_path / "log.txt", tmp_path / "run.csv"
    words = ("--unit", "TDC001", "--listen", "--for", "1.2", "--log", log, "--csv", table)
    stagewire("monitor", "virtual://TDC001", *words)
    assert read_capture(log).recorded == ()


def test_a_listener_must_name_the_unit(stagewire: Stagewire) -> None:
    result = stagewire("monitor", "socket://127.0.0.1:1", "--listen")
    assert (result.code, "--listen requires --unit" in result.err) == (2, True)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--tcp", "0.0.0.0:4001"), "--bind 0.0.0.0"),
        (("--tcp", "nothing"), "is not a TCP address"),
        (("--tcp", "4001", "--unit", "TDC009"), "unknown unit TDC009"),
        ((), "Missing option '--tcp'"),
    ],
)
def test_wrong_arguments_are_refused(
    stagewire: Stagewire, words: tuple[str, ...], said: str
) -> None:
    result = stagewire("serve", "virtual://TDC001", *words)
    assert result.code == 2
    assert said in result.err


def test_a_port_in_use_is_refused(stagewire: Stagewire) -> None:
    with shared("virtual://TDC001") as (_, url):
        result = stagewire("serve", "virtual://TDC001", "--tcp", url.rpartition(":")[2])
    assert result.code == 2
    assert "cannot listen on 127.0.0.1:" in result.err
