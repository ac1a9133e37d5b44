"""An IOC with ten motors that move: updates, processor time, memory, the time to a stop, and 1,000 clients.

The IOC, its virtual controllers and the clients are three processes. The time to a stop begins when a client
puts STOP, and ends when the stop of the axis arrives at a relay before the controller.

    python benchmarks/ioc_load.py
    python benchmarks/ioc_load.py --seconds 3 --stops 10 --clients 50
"""

from __future__ import annotations

import argparse
import asyncio
import resource
import sys
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from ca_client import Circuit, IocProcess, controllers, ioc, percentile
from measure import holds
from panel_stop import STOP, Relay

MOTORS = 10
SECONDS, STOPS, CLIENTS = 20.0, 100, 1000
LEAST_READBACKS, MOST_CORE, MOST_MEMORY = 9.0, 15.0, 120.0  # 1/s, %, MB
MOST_STOP = 20.0  # ms
LEAST_OF_MANY, MOST_MEMORY_OF_MANY, MOST_CONNECTING = 5.0, 200.0, 10.0  # 1/s, MB, s
MOVE_ABSOLUTE = bytes.fromhex("53 04")
SLOW = 0.02  # mm/s: ten minutes for the travel of 12 mm


@asynccontextmanager
async def moving(served: IocProcess) -> AsyncIterator[Circuit]:
    """Let all motors move slowly; yield a client."""
    client = await Circuit.open(served.port)
    for at in range(MOTORS):
        await client.put(await client.channel(f"m{at}.VELO"), SLOW)
        client.put_only(await client.channel(f"m{at}"), 11.0)
    yield client
    for at in range(MOTORS):
        await client.put(await client.channel(f"m{at}.STOP"), 1)
    client.close()


async def clients_of(served: IocProcess, number: int) -> list[Circuit]:
    """Connect clients, each with a monitor of the position of a motor."""

    async def connect(at: int) -> Circuit:
        one = await Circuit.open(served.port)
        await one.monitor(await one.channel(f"m{at % MOTORS}.RBV"))
        return one

    return list(await asyncio.gather(*map(connect, range(number))))


async def slowest(clients: list[Circuit], seconds: float) -> float:
    """Return the lowest number of updates a second that a client receives."""
    before = [sum(one.values.values()) for one in clients]
    began = time.monotonic()
    await asyncio.sleep(seconds)
    took = time.monotonic() - began
    return (
        min(sum(one.values.values()) - was for one, was in zip(clients, before, strict=True)) / took
    )


async def load(served: IocProcess, seconds: float) -> bool:
    """Measure ten motors with one client for each."""
    async with moving(served):
        clients = await clients_of(served, MOTORS)
        await asyncio.sleep(1)
        processor, began = served.processor, time.monotonic()
        updates = await slowest(clients, seconds)
        core = (served.processor - processor) / (time.monotonic() - began) * 100
        print(f"{MOTORS} motors, {updates:.1f} readbacks a second for the slowest")
        for one in clients:
            one.close()
        return all(
            [
                holds("between two readbacks", 1e3 / updates, 1e3 / LEAST_READBACKS, "ms"),
                holds("processor", core, MOST_CORE, "% of a core"),
                holds("memory", served.memory, MOST_MEMORY, "MB"),
            ]
        )


async def stops(served: IocProcess, relay: Relay, number: int, clients: int) -> bool:
    """Measure the time to a stop while other clients monitor positions."""
    async with moving(served) as client:
        others = await clients_of(served, clients)
        value, stop = [await client.channel(name) for name in ("m0", "m0.STOP")]
        found = []
        for turn in range(number):
            await client.put(stop, 1)
            began = time.monotonic()
            client.put_only(value, 1.0 if turn % 2 else 11.0)
            await asyncio.to_thread(relay.wait_for, MOVE_ABSOLUTE, began)
            await asyncio.sleep(0.12 + turn % 10 / 100)
            began = time.monotonic()
            client.put_only(stop, 1)
            found.append((await asyncio.to_thread(relay.wait_for, STOP, began) - began) * 1e3)
        for one in others:
            one.close()
        what = f"STOP to the line, {clients} clients, 99 in 100"
        print(f"{number} stops, median {percentile(found, 50):.1f} ms, longest {max(found):.1f} ms")
        return holds(what, percentile(found, 99), MOST_STOP, "ms")


async def many(served: IocProcess, seconds: float, number: int) -> bool:
    """Measure many clients with a monitor each."""
    async with moving(served):
        began = time.monotonic()
        clients = await clients_of(served, number)
        connecting = time.monotonic() - began
        await asyncio.sleep(1)
        processor, began = served.processor, time.monotonic()
        updates = await slowest(clients, seconds)
        core = (served.processor - processor) / (time.monotonic() - began) * 100
        print(
            f"{number} clients, {updates:.1f} updates a second for the slowest, {core:.0f} % of a core"
        )
        kept = [
            holds("between two updates", 1e3 / updates, 1e3 / LEAST_OF_MANY, "ms"),
            holds("memory", served.memory, MOST_MEMORY_OF_MANY, "MB"),
            holds("connected in", connecting, MOST_CONNECTING, "s"),
        ]
        for one in clients:
            one.close()
        return all(kept)


def main(seconds: float, number: int, clients: int) -> bool:
    """Measure; return whether all bounds hold."""
    hard = resource.getrlimit(resource.RLIMIT_NOFILE)[1]
    resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))
    with controllers(MOTORS) as urls:
        relay = Relay(urls[0])
        relay.arrived[MOVE_ABSOLUTE] = []
        with ioc([relay.url, *urls[1:]]) as served:
            kept = [asyncio.run(load(served, seconds))]
            for circuits in (1, 10, 100):
                kept.append(asyncio.run(stops(served, relay, number, circuits)))
            kept.append(asyncio.run(many(served, seconds, clients)))
        relay.close()
    return all(kept)


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--seconds", type=float, default=SECONDS)
    parser.add_argument("--stops", type=int, default=STOPS)
    parser.add_argument("--clients", type=int, default=CLIENTS)
    given = parser.parse_args()
    sys.exit(0 if main(given.seconds, given.stops, given.clients) else 1)
