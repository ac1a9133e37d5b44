"""Move two axes at once with asyncio and watch them, on a virtual BBD102.

    python examples/python/two_axes_asyncio.py

Each axis is a controller of its own behind one line; what one says never ends the move of the other.
"""

from __future__ import annotations

import asyncio

from stagewire_apt import stages
from stagewire_apt.aio import BBD102, BBD102Bay
from stagewire_apt.devices import values


async def watch(bay: BBD102Bay, name: str) -> None:
    """Print where an axis is whenever its controller says so, ten times a second."""
    async with bay.subscribe(values.DcStatusUpdate) as updates:
        async for status in updates:
            print(f"{name} {status.position_mm:8.4f} mm")


async def main() -> None:
    """Let both axes go at the same time, each to its own place, and wait for both."""
    url = "virtual://BBD102?stage=MLS203"
    async with BBD102.open(url, stage=stages.MLS203, travel_mm=100) as bbd:
        x, y = bbd.bay(1), bbd.bay(2)
        watchers = [asyncio.create_task(watch(x, "x")), asyncio.create_task(watch(y, "y"))]
        for axis in (x, y):
            await axis.start_updates(10)
        await asyncio.gather(x.move_absolute(mm=3), y.move_absolute(mm=5))
        for watcher in watchers:
            watcher.cancel()


if __name__ == "__main__":
    asyncio.run(main())
