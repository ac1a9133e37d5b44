"""Many virtual controllers in one process: timing, memory, and the use of one core.

One process serves controllers of all kinds that send status updates, each on its own TCP port, all on one
clock. This process is the host: it starts the updates, sends a keep-alive once a second, and records each
arrival. An update is due a whole number of periods after the request for updates. Any time after that is its
delay, whichever process caused it.

The cost of a controller is the processor time of the serving process per update, with few controllers before
and after, and with many. Waking the process costs more than sending an update. Controllers therefore come in
groups with updates at the same instant: one group, or several in sequence. The process then wakes equally
often per update in both runs, and the comparison is fair.

    python benchmarks/virtual_soak.py
    python benchmarks/virtual_soak.py --controllers 32 --seconds 2 --quick    # counts and memory only
"""

from __future__ import annotations

import argparse
import asyncio
import json
import statistics
import sys
import time
from collections.abc import Iterator
from contextlib import asynccontextmanager
from dataclasses import dataclass
from itertools import cycle, islice
from typing import Any

from measure import holds, memory

from stagewire.framing import End, Received
from stagewire_apt import PROTOCOL, TDC001
from stagewire_apt import messages as m
from stagewire_virtual.factory import make_instrument, why_not
from stagewire_virtual.instrument import Unit, units_of
from stagewire_virtual.options import Options
from stagewire_virtual.serving.endpoints import TcpEndpoint
from stagewire_virtual.serving.server import Server
from stagewire_virtual.thorlabs_apt.facts import class_of

PERIOD = 0.1
FEW = 16  # also the size of a group
WARM_UP = 3.0
PATIENCE = 30.0  # s to wait for missing updates
MOST_GROWTH = 1.0  # MiB
MOST_PROCESSOR = 0.9  # of one core
MOST_RATIO = 1.25  # between the cost of a controller among many and among few
HOST = 1


def kinds() -> list[Unit]:
    """Return the simulated units that send updates of each channel."""
    units = [unit for unit in units_of(PROTOCOL).values() if not why_not(unit)]
    return [unit for unit in units if "HW_START_UPDATEMSGS" in unit.messages and updates_of(unit)]


def updates_of(unit: Unit) -> frozenset[int]:
    """Return the ids of the updates that a unit sends."""
    starts = unit.message("HW_START_UPDATEMSGS")["exchange"]["starts"]
    return frozenset(unit.message(name)["id"] for name in starts if name in unit.messages)


def channels_in_updates(unit: Unit) -> list[int]:
    """Return the values that name a channel in the updates of a unit; 0 if an update is for all channels."""
    starts = unit.message("HW_START_UPDATEMSGS")["exchange"]["starts"]
    updates = [class_of(unit, name) for name in starts if name in unit.messages]
    if not all("chan_ident" in update.layout.fields for update in updates):
        return [0]
    return list(TDC001.facts.units[unit.name].channel_idents)


# The process that serves


async def serve(controllers: int) -> None:
    """Serve controllers until standard input ends; answer each line with the resources used."""
    async with Server() as server:
        for number, unit in enumerate(islice(cycle(kinds()), controllers)):
            instrument = make_instrument(unit, server.clock, Options(seed=number))
            await server.open(TcpEndpoint().link(instrument, label=unit.name))
        say([[link.label, link.url] for link in server.links])
        lines = asyncio.StreamReader()
        await asyncio.get_running_loop().connect_read_pipe(
            lambda: asyncio.StreamReaderProtocol(lines), sys.stdin
        )
        while await lines.readline():
            say({"processor": time.process_time(), "memory": memory()})


def say(what: Any) -> None:
    """Write a line to the other process."""
    print(json.dumps(what), flush=True)


# The process that listens


class Listener(asyncio.Protocol):
    """The host of one controller."""

    def __init__(self, unit: Unit) -> None:
        self.address = 0x50 if unit.facts["address"] == "generic_usb" else 0x21
        self.alive = b""
        if unit.facts["keep_alive"] != "none":
            self.alive = PROTOCOL.message_class(unit.facts["keep_alive"])().pack(self.address, HOST)
        self.expected = updates_of(unit)
        self.framer = PROTOCOL.framer(End.HOST)
        self.arrivals: dict[int, list[float]] = {each: [] for each in channels_in_updates(unit)}

    def connection_made(self, transport: Any) -> None:
        """Record the connection."""
        self.transport = transport

    def start(self) -> None:
        """Request updates."""
        self.began = time.monotonic()
        self.transport.write(m.HwStartUpdateMsgs(round(1 / PERIOD)).pack(self.address, HOST))

    def acknowledge(self) -> None:
        """Send a keep-alive."""
        self.transport.write(self.alive)

    def data_received(self, data: bytes) -> None:
        """Record each update and its time."""
        now = time.monotonic()
        for event in self.framer.feed(data):
            if not isinstance(event, Received) or event.id not in self.expected:
                raise SystemExit(f"not an update: {event}")
            self.arrivals[getattr(event.frame.message, "chan_ident", 0)].append(now)

    def latenesses(self) -> Iterator[float]:
        """Yield the delay of each update in seconds."""
        for arrivals in self.arrivals.values():
            for number, arrival in enumerate(arrivals, 1):
                yield arrival - self.began - number * PERIOD

    @property
    def received(self) -> int:
        """The number of updates of the channel with the fewest."""
        return min(map(len, self.arrivals.values()))


@dataclass(frozen=True)
class Run:
    """The counts of several controllers."""

    controllers: int
    updates: int
    missing: int
    latest: float
    median: float
    processor: float
    share: float
    growth: float
    memory: float

    @property
    def cost(self) -> float:
        """Processor time per update, in microseconds."""
        return self.processor / self.updates * 1e6


@asynccontextmanager
async def serving(controllers: int) -> Any:
    """Run the serving process."""
    process = await asyncio.create_subprocess_exec(
        sys.executable,
        __file__,
        "--serve",
        str(controllers),
        stdin=asyncio.subprocess.PIPE,
        stdout=asyncio.subprocess.PIPE,
        limit=1 << 20,
    )
    try:
        yield process
    finally:
        process.stdin.close()
        await process.wait()


async def run(controllers: int, seconds: float) -> Run:
    """Serve controllers in another process and receive their updates."""
    units = {unit.name: unit for unit in kinds()}
    loop = asyncio.get_running_loop()
    async with serving(controllers) as process:

        async def used() -> dict[str, float]:
            process.stdin.write(b"\n")
            answer: dict[str, float] = json.loads(await process.stdout.readline())
            return answer

        listeners: list[Listener] = []
        places = await process.stdout.readline()
        if not places:
            raise SystemExit("the process that serves did not start")
        for name, url in json.loads(places):
            listener = Listener(units[name])
            host, _, port = url.removeprefix("socket://").rpartition(":")
            await loop.create_connection(lambda found=listener: found, host, int(port))
            listeners.append(listener)
        groups = [listeners[at : at + FEW] for at in range(0, controllers, FEW)]
        for group in groups:
            for listener in group:
                listener.start()
            await asyncio.sleep(PERIOD / len(groups))
        alive = asyncio.create_task(keep_alive(groups))
        warm_up = min(WARM_UP, seconds / 2)
        await asyncio.sleep(warm_up)
        warm, began, before = await used(), time.monotonic(), count(listeners)
        wanted = round((warm_up + seconds) / PERIOD)
        end = began + seconds + PATIENCE
        await asyncio.sleep(seconds)
        while min(listener.received for listener in listeners) < wanted and time.monotonic() < end:
            await asyncio.sleep(PERIOD / 10)
        done, ended, after = await used(), time.monotonic(), count(listeners)
        alive.cancel()
        for listener in listeners:
            listener.transport.close()
    lateness = [late for listener in listeners for late in listener.latenesses()]
    return Run(
        controllers=controllers,
        updates=after - before,
        missing=sum(max(0, wanted - listener.received) for listener in listeners),
        latest=max(lateness),
        median=statistics.median(lateness),
        processor=done["processor"] - warm["processor"],
        share=(done["processor"] - warm["processor"]) / (ended - began),
        growth=done["memory"] - warm["memory"],
        memory=done["memory"],
    )


def count(listeners: list[Listener]) -> int:
    """Return the number of updates received."""
    return sum(len(arrivals) for listener in listeners for arrivals in listener.arrivals.values())


async def keep_alive(groups: list[list[Listener]]) -> None:
    """Send each controller a keep-alive once a second, group by group."""
    while True:
        for group in groups:
            for listener in group:
                listener.acknowledge()
            await asyncio.sleep(1 / len(groups))


# The report


def show(found: Run) -> None:
    """Print the figures of a run."""
    print(
        f"  {found.controllers:>4} controllers  {found.updates:>7} updates  {found.missing} missing  "
        f"late {found.median * 1e3:.1f} ms (median), {found.latest * 1e3:.1f} ms (most)  "
        f"{found.share:.1%} of a core, {found.cost:.1f} us an update  "
        f"{found.memory:.1f} MiB, {found.growth:+.2f} since it was warm",
        flush=True,
    )


def soak(controllers: int, seconds: float, *, quick: bool) -> bool:
    """Run everything; return whether all bounds hold."""
    print(f"Virtual controllers of {len(kinds())} kinds by TCP, 10 updates a second each")
    few: list[Run] = []
    if not quick:
        few.append(asyncio.run(run(FEW, seconds / 3)))
        show(few[0])
    many = asyncio.run(run(controllers, seconds))
    show(many)
    kept = [
        holds("updates missing", many.missing, 0),
        holds("memory grown", many.growth, MOST_GROWTH, "MiB"),
    ]
    if not quick:
        few.append(asyncio.run(run(FEW, seconds / 3)))
        show(few[1])
        ratio = many.cost / statistics.mean(found.cost for found in few)
        kept += [
            holds("latest update", many.latest * 1e3, PERIOD * 1e3, "ms"),
            holds("share of one core", many.share, MOST_PROCESSOR),
            holds(
                f"cost of an update, {controllers} : {FEW} or {FEW} : {controllers}",
                max(ratio, 1 / ratio),
                MOST_RATIO,
                "x",
            ),
        ]
    return all(kept)


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--controllers", type=int, default=256)
    parser.add_argument("--seconds", type=float, default=60)
    parser.add_argument("--quick", action="store_true", help="counts and memory only")
    parser.add_argument("--serve", type=int, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.serve is not None:
        asyncio.run(serve(given.serve))
        sys.exit(0)
    sys.exit(0 if soak(given.controllers, given.seconds, quick=given.quick) else 1)
