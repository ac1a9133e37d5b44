"""The server: it wakes up for timers and bytes, and runs everything at exact instants."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from typing import Any

import pytest
from echo_instrument import TICK, EchoInstrument, Notebook

from stagewire_virtual.clock import SECOND, RealClock, SteppedClock
from stagewire_virtual.errors import ServingError
from stagewire_virtual.serving.endpoints import TcpEndpoint, parse_tcp
from stagewire_virtual.serving.link import at_this_instant
from stagewire_virtual.serving.server import Server
from stagewire_virtual.serving.tcp import TcpLink

PATIENCE = 20  # seconds after which a test that waits in real time fails


def run(test: Callable[[], Coroutine[Any, Any, None]]) -> None:
    asyncio.run(asyncio.wait_for(test(), PATIENCE))


async def connect(link: TcpLink) -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
    return await asyncio.open_connection(link.host, link.port)


async def hear(reader: asyncio.StreamReader, data: bytes) -> None:
    assert await reader.readexactly(len(data)) == data


def test_served_timers_run_at_their_own_instants() -> None:
    async def test() -> None:
        book = Notebook()
        async with Server() as server:
            link = TcpLink(EchoInstrument(server.clock, period=0.02), "127.0.0.1", 0, observer=book)
            await server.open(link)
            reader, writer = await connect(link)
            writer.write(b"t")
            for _ in range(5):
                await hear(reader, TICK)
            writer.close()
        ((_, began, _),) = (line for line in book.lines if line[0] == ">")
        ticks = [when - began for kind, when, _ in book.lines if kind == "<"]
        assert ticks == [SECOND // 50 * number for number in range(1, len(ticks) + 1)]

    run(test)


def test_a_server_sets_an_alarm_only_for_the_next_timer(monkeypatch: pytest.MonkeyPatch) -> None:
    """The only timer of the event loop is for the next timer of the clock."""

    async def test() -> None:
        alarms: list[float] = []
        loop = asyncio.get_running_loop()
        call_later = loop.call_later

        def counted(delay: float, *rest: Any) -> asyncio.TimerHandle:
            alarms.append(delay)
            return call_later(delay, *rest)

        monkeypatch.setattr(loop, "call_later", counted)
        async with Server() as server:
            instrument = EchoInstrument(server.clock, period=30)
            await server.open(TcpLink(instrument, "127.0.0.1", 0))
            assert alarms == []
            server.run(lambda: instrument.receive(b"t"))
            assert [round(delay) for delay in alarms] == [30]
            server.run(lambda: None)
            assert len(alarms) == 1  # the next timer is the same

    run(test)


def test_an_earlier_timer_wakes_the_server_earlier() -> None:
    async def test() -> None:
        rung = asyncio.Event()
        async with Server() as server:
            server.run(lambda: None)
            server.clock.call_later(30 * SECOND, lambda: None)
            server.clock.call_later(SECOND // 100, rung.set)  # outside of run()
            await rung.wait()

    run(test)


def test_an_error_in_a_timer_does_not_stop_the_clock() -> None:
    async def test() -> None:
        errors: list[dict[str, Any]] = []
        asyncio.get_running_loop().set_exception_handler(lambda _, context: errors.append(context))
        rung = asyncio.Event()
        async with Server() as server:
            server.clock.call_later(1000, lambda: 1 / 0)  # type: ignore[arg-type, return-value]
            server.clock.call_later(2000, rung.set)
            await rung.wait()
        assert [type(context["exception"]) for context in errors] == [ZeroDivisionError]

    run(test)


def test_timers_that_are_due_run_before_received_bytes() -> None:
    clock = SteppedClock()
    order: list[str] = []
    clock.call_later(0, lambda: order.append("due"))
    at_this_instant(clock, lambda: order.append("received"))
    assert order == ["due", "received"]


def test_real_time_stands_still_while_bytes_are_processed() -> None:
    clock = RealClock()
    times: set[int] = set()

    def receive() -> None:
        times.update(clock.now for _ in range(100))

    at_this_instant(clock, receive)
    assert len(times) == 1


def test_a_stepped_clock_is_served_without_alarms() -> None:
    async def test() -> None:
        clock = SteppedClock()
        async with Server(clock) as server:
            link = TcpLink(EchoInstrument(clock, period=1), "127.0.0.1", 0)
            await server.open(link)
            reader, writer = await connect(link)
            writer.write(b"tx")
            await hear(reader, b"tx")
            server.run(lambda: link.far_end.receive(b"t"))
            clock.advance(3)
            await hear(reader, 3 * TICK)
            writer.close()

    run(test)


def test_closing_frees_the_port_and_can_be_repeated() -> None:
    async def test() -> None:
        server = Server()
        link = TcpLink(EchoInstrument(server.clock), "127.0.0.1", 0)
        await server.open(link)
        reader, writer = await connect(link)
        await server.close()
        await server.close()
        with pytest.raises(OSError, match=r".+"):
            await connect(link)
        with pytest.raises((asyncio.IncompleteReadError, ConnectionError)):
            await reader.readexactly(1)
        writer.close()
        again = Server()
        await again.open(TcpLink(EchoInstrument(again.clock), "127.0.0.1", link.port))
        await again.close()

    run(test)


@pytest.mark.parametrize(
    ("text", "bind", "place"),
    [
        ("4001", None, TcpEndpoint(4001)),
        (":4001", None, TcpEndpoint(4001)),
        ("127.0.0.1:0", None, TcpEndpoint(0)),
        ("127.0.0.9:1", None, TcpEndpoint(1, "127.0.0.9")),
        ("localhost:1", None, TcpEndpoint(1)),
        ("[::1]:1", None, TcpEndpoint(1, "::1")),
        ("65535", "0.0.0.0", TcpEndpoint(65535, "0.0.0.0")),
        ("192.168.0.5:1", "192.168.0.5", TcpEndpoint(1, "192.168.0.5")),
        ("127.0.0.1:1", "0.0.0.0", TcpEndpoint(1)),
    ],
)
def test_endpoints_are_parsed(text: str, bind: str | None, place: TcpEndpoint) -> None:
    assert parse_tcp(text, bind) == place


@pytest.mark.parametrize(
    ("text", "bind", "why"),
    [
        ("", None, "is not a TCP address"),
        ("x", None, "is not a TCP address"),
        ("127.0.0.1", None, "is not a TCP address"),
        ("65536", None, "is not a TCP address"),
        ("-1", None, "is not a TCP address"),
        ("٣", None, "is not a TCP address"),
        ("0.0.0.0:4001", None, "--bind 0.0.0.0"),
        ("[::]:4001", None, "--bind ::"),
        ("example.org:4001", None, "--bind example.org"),
        ("10.0.0.1:4001", "10.0.0.2", "--bind 10.0.0.1"),
    ],
)
def test_invalid_endpoints_are_refused(text: str, bind: str | None, why: str) -> None:
    with pytest.raises(ServingError, match=why):
        parse_tcp(text, bind)
