"""Clients of Channel Access that break the protocol, flood the IOC or do not read.

The IOC serves the others, and a stop reaches the controller.
"""

from __future__ import annotations

import asyncio
import random
import socket
import struct
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import ca
import pytest
from iocs import bench_of
from lines import Line, recorded

import stagewire_virtual as virtual
from checkout import ROOT
from stagewire_apt import stages

sys.path.append(str(ROOT / "benchmarks"))
from ca_client import (
    CLEAR,
    CREATE,
    DOUBLE,
    EVENT_ADD,
    GREETING,
    HEADER,
    WRITE,
    WRITE_NOTIFY,
    Circuit,
    message,
)  # fmt: skip

MOVE, STOP = b"\x53\x04", b"\x65\x04"
SOON = 3.0
"""Seconds from the put of STOP to the stop frame, on a busy machine; `make bench` has a stricter bound."""
SEARCH, CANCEL, READ_NOTIFY, ECHO, EVENTS_OFF = 6, 2, 15, 23, 8
NAMES = (
    "LAB:x",
    "LAB:x.RBV",
    "LAB:x.EGU",
    "LAB:x.FOFF",  # not SPMG, because a valid Stop there makes the IOC refuse the moves of others
    "LAB:x.DESC$",
    'LAB:x.RBV{"dbnd":{"d":1}}',
)
Attack = Callable[[threading.Event], None]


@pytest.fixture
def line() -> Iterator[Line]:
    with virtual.TDC001(stage=stages.Z8).tcp() as tdc, recorded(tdc.url) as found:
        yield found


@pytest.fixture
def one(line: Line, tmp_path: Path) -> Iterator[ca.IocProcess]:
    with ca.ioc(tmp_path, 'prefix = "LAB:"\n' + bench_of(line.url)) as found:
        yield found


def connect() -> socket.socket:
    return socket.create_connection(("127.0.0.1", ca.PORT), timeout=5)


def create(name: str, number: int) -> bytes:
    return message(CREATE, name.encode() + b"\0", one=number, two=13)


def subscribe(channel: int, number: int, kind: int = DOUBLE, count: int = 1) -> bytes:
    return message(EVENT_ADD, struct.pack(">fffHH", 0, 0, 0, 7, 0), kind, count, channel, number)


def put(channel: int, number: int, value: float) -> bytes:
    return message(WRITE_NOTIFY, struct.pack(">d", value), DOUBLE, 1, channel, number)


MONITORING = GREETING + create("LAB:x.RBV", 1) + subscribe(1, 1)


def datagrams(end: threading.Event) -> None:
    """Send malformed datagrams and searches for names that are invalid."""
    chance = random.Random(1)
    search = message(SEARCH, b"LAB:x.RBV\0", kind=5, count=13, one=1, two=1)
    names = [
        b"",
        b"\0",
        b"\xff\xfe",
        b"LAB:x.{bad",
        b"LAB:x.RBV{}",
        b"LAB:x.RBV[9:1:0]",
        b"." * 400,
    ]
    searches = [message(SEARCH, name + b"\0", 5, 13, 1, 1) for name in names]
    whole = [
        *searches,
        search * 2000,
        message(0, count=13) + search,
        HEADER.pack(6, 0xFFFF, 5, 13, 1, 1),
    ]
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        while not end.is_set():
            data = bytearray(chance.choice(whole))
            for _ in range(chance.randrange(4)):
                data[chance.randrange(len(data))] = chance.randrange(256)
            if chance.random() < 0.3:
                data = bytearray(chance.randbytes(chance.randrange(1, 200)))
            with suppress(OSError):
                sender.sendto(data[: chance.randrange(1, len(data) + 1)], ("127.0.0.1", ca.PORT))


def garbage(end: threading.Event) -> None:
    """Connect and send bytes that are not Channel Access, or commands of impossible sizes."""
    chance = random.Random(2)
    huge = struct.pack(">HHHHIIII", EVENT_ADD, 0xFFFF, 6, 0, 1, 1, 0xFFFFFFF0, 0xFFFFFFFF)
    while not end.is_set():
        with suppress(OSError), connect() as client:
            client.sendall(
                chance.choice(
                    [
                        b"GET / HTTP/1.1\r\n\r\n",
                        chance.randbytes(500),
                        huge + bytes(200_000),
                        HEADER.pack(99, 0, 0, 0, 0, 0),
                        GREETING + HEADER.pack(WRITE, 0xFFF0, 6, 9999, 1, 1) + bytes(100),
                        GREETING[:7],
                    ]
                )
            )
            time.sleep(0.005)


def mutations(end: threading.Event) -> None:
    """Send commands with wrong numbers, types, counts and orders."""
    chance = random.Random(3)
    commands = (
        0,
        EVENT_ADD,
        CANCEL,
        WRITE,
        EVENTS_OFF,
        9,
        CLEAR,
        READ_NOTIFY,
        CREATE,
        WRITE_NOTIFY,
        20,
        21,
        ECHO,
    )
    while not end.is_set():
        with suppress(OSError), connect() as client:
            client.sendall(GREETING + b"".join(create(name, at) for at, name in enumerate(NAMES)))
            for number in range(60):
                sid = chance.choice([0, 1, 2, 3, 4, 5, 6, 77, 0xFFFFFFFF])
                kind, count = chance.choice([*range(42), 65535]), chance.choice([0, 1, 2, 500])
                client.sendall(
                    chance.choice(
                        [
                            subscribe(sid, number, kind, count),
                            subscribe(sid, chance.randrange(3), kind, count),
                            message(READ_NOTIFY, b"", kind, count, sid, number),
                            message(CLEAR, b"", 0, 0, sid, chance.randrange(8)),
                            message(CANCEL, b"", kind, count, sid, chance.randrange(4)),
                            message(
                                chance.choice(commands), chance.randbytes(32), kind, count, sid, 1
                            ),
                            create('LAB:x.RBV{"arr":{"s":"a"}}', 99),
                            create("LAB:x.{", 98),
                        ]
                    )
                )
            time.sleep(0.005)


def puts(end: threading.Event) -> None:
    """Put invalid values without reading the answers."""
    while not end.is_set():
        with suppress(OSError), connect() as client:
            client.sendall(GREETING + create("LAB:x.OFF", 1) + create("LAB:x.RBV", 2))
            flood(client, end, put(1, 7, float("nan")) + put(2, 8, 1.0))


def echoes(end: threading.Event) -> None:
    """Request echoes, and never read them."""
    with suppress(OSError), connect() as client:
        flood(client, end, message(ECHO))


def subscriptions(end: threading.Event) -> None:
    """Subscribe again and again, and never read."""
    while not end.is_set():
        with suppress(OSError), connect() as client:
            client.sendall(GREETING + create("LAB:x.RBV", 1))
            flood(client, end, b"".join(subscribe(1, number) for number in range(50_000)))


def channels(end: threading.Event) -> None:
    """Open channels without end."""
    while not end.is_set():
        with suppress(OSError), connect() as client:
            flood(client, end, GREETING + b"".join(create("LAB:x", at) for at in range(20_000)))


def flood(client: socket.socket, end: threading.Event, data: bytes) -> None:
    client.settimeout(0.2)
    while not end.is_set():
        try:
            client.sendall(data)
        except TimeoutError:
            time.sleep(0.05)


def half_open(end: threading.Event) -> None:
    """Keep connections: silent, after half a command, closed in one direction, with unread events."""
    kept = []
    for at in range(40):
        client = connect()
        client.sendall((b"", GREETING[:20], GREETING, MONITORING)[at % 4])
        if at % 3 == 0:
            client.shutdown(socket.SHUT_WR)
        kept.append(client)
    end.wait()
    for client in kept:
        client.close()


def drops(end: threading.Event) -> None:
    """Open and drop connections, with and without a reset."""
    open_and_drop(1_000_000, end)


def open_and_drop(number: int, end: threading.Event) -> int:
    done = 0
    while done < number and not end.is_set():
        client = connect()
        if done % 2:
            client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        if done % 3 == 0:
            client.sendall(MONITORING)
        client.close()
        done += 1
    return done


@contextmanager
def attacked(attack: Attack) -> Iterator[None]:
    end = threading.Event()
    thread = threading.Thread(target=attack, args=(end,))
    thread.start()
    try:
        yield
    finally:
        end.set()
        thread.join()


async def moved_and_stopped(client: Circuit, line: Line) -> float:
    """Move and stop; return the seconds from the put of STOP to the stop frame."""

    async def arrived(frame: bytes, former: int) -> None:
        async with asyncio.timeout(30):
            while line.sent.count(frame) == former:
                await asyncio.sleep(0.001)

    value, stop = await client.channel("LAB:x"), await client.channel("LAB:x.STOP")
    moves, stops = line.sent.count(MOVE), line.sent.count(STOP)
    client.put_only(value, 1.0 if moves % 2 else 11.0)
    await arrived(MOVE, moves)
    await asyncio.sleep(0.3)
    began = time.monotonic()
    client.put_only(stop, 1)
    await arrived(STOP, stops)
    took = time.monotonic() - began
    await asyncio.sleep(0.5)
    return took


def files(one: ca.IocProcess) -> int:
    return len(list(Path(f"/proc/{one.process.pid}/fd").iterdir()))


def survives(one: ca.IocProcess, line: Line, attack: Attack) -> None:
    async def body() -> None:
        client = await Circuit.open(ca.PORT)
        events = await client.monitor(await client.channel("LAB:x.RBV"))
        before = files(one)
        with attacked(attack):
            await asyncio.sleep(0.5)
            for _ in range(2):
                assert await moved_and_stopped(client, line) < SOON
            newer = await Circuit.open(ca.PORT)
            assert await moved_and_stopped(newer, line) < SOON
            newer.close()
        seen = client.values[events]
        assert await client.put(await client.channel("LAB:x"), 5.0) == 1
        assert client.values[events] > seen + 3  # the events of the motion
        async with asyncio.timeout(10):
            while files(one) > before:
                await asyncio.sleep(0.1)
        client.close()

    asyncio.run(body())
    assert one.process.poll() is None
    assert not any("Traceback" in text or "Task " in text for text in one.log), "".join(
        one.log[-40:]
    )


@pytest.mark.parametrize(
    "attack",
    [datagrams, garbage, mutations, puts, echoes, subscriptions, channels, half_open, drops],
    ids=lambda attack: attack.__name__,
)
def test_a_stop_gets_through_and_others_are_served(
    one: ca.IocProcess, line: Line, attack: Attack
) -> None:
    survives(one, line, attack)


def test_a_subscription_of_an_impossible_type_does_not_stop_the_readbacks(
    one: ca.IocProcess, line: Line
) -> None:
    async def body() -> None:
        hostile = await Circuit.open(ca.PORT)
        for name in ("LAB:x.RBV", "LAB:x.EGU"):
            channel = await hostile.channel(name)
            hostile.send(subscribe(channel, 1, kind=36))  # DBR_PUT_ACKS
            hostile.send(subscribe(channel, 2, kind=3))
        client = await Circuit.open(ca.PORT)
        assert await client.put(await client.channel("LAB:x"), 0.5) == 1
        hostile.close()
        client.close()

    asyncio.run(body())
    assert not any("Traceback" in text for text in one.log)


def test_a_cleared_channel_with_a_subscription_keeps_the_connection(one: ca.IocProcess) -> None:
    async def body() -> None:
        client = await Circuit.open(ca.PORT)
        first, second = await client.channel("LAB:x.RBV"), await client.channel("LAB:x.RBV")
        await client.monitor(first)
        events = await client.monitor(second)
        client.send(message(CLEAR, one=first, two=1))
        seen = client.values[events]
        assert await client.put(await client.channel("LAB:x"), 0.3) == 1
        assert client.values[events] > seen
        client.close()

    asyncio.run(body())


@pytest.mark.matrix
def test_ten_thousand_connections_are_opened_and_dropped(one: ca.IocProcess, line: Line) -> None:
    dropped: list[int] = []
    survives(one, line, lambda end: dropped.append(open_and_drop(500, end)))
    open_and_drop(4_000, threading.Event())  # the memory of the process settles
    before = _memory(one)
    dropped.append(open_and_drop(10_000, threading.Event()))
    survives(one, line, lambda end: None)
    assert dropped[-1] == 10_000
    assert _memory(one) - before < 10e6


def _memory(one: ca.IocProcess) -> float:
    text = Path(f"/proc/{one.process.pid}/statm").read_text()
    return int(text.split()[1]) * 4096.0
