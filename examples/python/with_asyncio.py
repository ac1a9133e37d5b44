"""Move two axes with asyncio, and record and print both meanwhile.

    python examples/python/with_asyncio.py
    python examples/python/with_asyncio.py socket://10.0.0.5:4001

Without an argument the rack is virtual.
"""

from __future__ import annotations

import asyncio
import sys

from stagewire_apt import stages
from stagewire_apt.aio import BBD102, BBD102Bay
from stagewire_apt.devices.values import DcStatusUpdate


async def watch(bay: BBD102Bay, name: str) -> None:
    """Print the position of an axis with every status update, ten times a second."""
    async with bay.subscribe(DcStatusUpdate) as updates:
        async for status in updates:
            print(f"{name} {status.position_mm:8.4f} mm")


async def main(url: str = "virtual://BBD102?stage=MLS203", file: str = "axes.csv") -> None:
    """Home both axes and move them, while they are recorded and watched."""
    async with BBD102.open(url, stage=stages.MLS203, travel_mm=100) as rack:
        x, y = rack.bays
        watchers = [asyncio.create_task(watch(x, "x")), asyncio.create_task(watch(y, "y"))]
        async with rack.record(file, overwrite=True) as recording:
            await asyncio.gather(x.home(), y.home())
            await asyncio.gather(x.move_absolute(mm=3), y.move_absolute(mm=5))
        for watcher in watchers:
            watcher.cancel()
    print(f"{recording.rows} rows in {file}")


if __name__ == "__main__":
    asyncio.run(main(*sys.argv[1:]))
