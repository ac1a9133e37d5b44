"""Move two axes of a virtual BBD102 at the same time with asyncio, and print their positions.

    python examples/python/two_axes_asyncio.py

Each axis has its own controller on a shared line. A report of one never ends the move of the other.
"""

from __future__ import annotations

import asyncio

from stagewire_apt import stages
from stagewire_apt.aio import BBD102, BBD102Bay
from stagewire_apt.devices import values


async def watch(bay: BBD102Bay, name: str) -> None:
    """Print the position of an axis with every status update, ten times a second."""
    async with bay.subscribe(values.DcStatusUpdate) as updates:
        async for status in updates:
            print(f"{name} {status.position_mm:8.4f} mm")


async def main() -> None:
    """Start both moves at the same time and wait for both."""
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
