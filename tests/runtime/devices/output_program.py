"""A program that opens a controller and waits for a signal; run by test_outputs_off.

Usage: output_program.py WORLD UNIT URL
"""

from __future__ import annotations

import asyncio
import sys
import time

from stagewire_apt import aio, devices


async def loop(unit: str, url: str) -> None:
    async with getattr(aio, unit).open(url):
        print("open", flush=True)
        await asyncio.sleep(30)


world, unit, url = sys.argv[1:]
if world == "loop":
    asyncio.run(loop(unit, url))
else:
    with getattr(devices, unit).open(url):
        print("open", flush=True)
        time.sleep(30)
