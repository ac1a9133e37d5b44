"""An IOC that serves for a long time: 100,000 puts and 1,000 reconnects, without a growth of its memory.

A client puts values one after the other: one put in ten begins a motion, and the others set the length of a
tweak. Another client connects, monitors, reads an event and drops its connection. The memory of the IOC at
the end is compared with that after a tenth of the work.

    python benchmarks/ioc_soak.py
    python benchmarks/ioc_soak.py --puts 5000 --reconnects 50
"""

from __future__ import annotations

import argparse
import asyncio
import sys
import time

from ca_client import Circuit, IocProcess, controllers, ioc
from measure import holds

PUTS, RECONNECTS = 100_000, 1_000
ROUNDS = 100
MOTIONS = 10  # one put of so many begins a motion
SHORT = 0.001  # mm
MOST_GROWTH = 5.0  # MB
SUCCESS = 1


async def put_values(client: Circuit, tweak: int, value: int, number: int) -> int:
    """Put values into two channels, and return how many puts failed."""
    failed = 0
    for at in range(number):
        if at % MOTIONS:
            failed += await client.put(tweak, 0.1 + at % 7) != SUCCESS
        else:  # the next one replaces it
            client.put_only(value, 5 + at % 3 * SHORT)
    return failed


async def reconnect(served: IocProcess, number: int) -> None:
    """Connect, receive an event and drop the connection."""
    for _ in range(number):
        client = await Circuit.open(served.port)
        await client.monitor(await client.channel("m1.RBV"))
        client.close()


async def soak(served: IocProcess, puts: int, reconnects: int) -> bool:
    """Work, and return whether all bounds hold."""
    client = await Circuit.open(served.port)
    await client.monitor(await client.channel("m1.RBV"))
    channels = [await client.channel(name) for name in ("m0.TWV", "m1")]
    failed, warm, began = 0, 0.0, time.monotonic()
    for at in range(ROUNDS):
        if at == ROUNDS // 10:
            warm = served.memory
        failed += await put_values(client, *channels, puts // ROUNDS)
        await reconnect(served, reconnects // ROUNDS)
    took = time.monotonic() - began
    print(f"{puts:,} puts and {reconnects:,} reconnects in {took:.0f} s; {served.memory:.1f} MB")
    client.close()
    return all(
        [
            holds("failed puts", failed, 0),
            holds("growth of memory", served.memory - warm, MOST_GROWTH, "MB"),
        ]
    )


def main(puts: int, reconnects: int) -> bool:
    """Run an IOC with two motors; return whether all bounds hold."""
    with controllers(2) as urls, ioc(urls) as served:
        return asyncio.run(soak(served, puts, reconnects))


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--puts", type=int, default=PUTS)
    parser.add_argument("--reconnects", type=int, default=RECONNECTS)
    given = parser.parse_args()
    sys.exit(0 if main(given.puts, given.reconnects) else 1)
