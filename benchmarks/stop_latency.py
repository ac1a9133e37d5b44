"""The time until a stop arrives at the controller, under 10,000 messages a second and 100 waiting commands.

The other end is a separate process. It sends status updates, answers no request, and records the arrival of
each stop. All commands therefore keep waiting, half of them while they hold a lock. The time of a stop begins
with its call; in asyncio with the intended time of the call, so that a late event loop counts. It ends with
the arrival, on the clock that both processes share.

    python benchmarks/stop_latency.py
"""

from __future__ import annotations

import argparse
import asyncio
import logging
import random
import sys
import threading
import time
from collections.abc import Callable, Coroutine, Sequence
from contextlib import suppress
from itertools import cycle, islice
from statistics import median
from typing import Any

from measure import holds
from peer import UPDATES_A_SECOND, Peer, peer

from stagewire.errors import SessionClosedError
from stagewire_apt import TDC001, aio
from stagewire_apt import messages as m

STOPS = 300
RUNS = 5
WAITING = 100
LONG = 600.0  # seconds; no waiting command times out
LONGEST_PAUSE = 0.010
AT_MOST = 5.0  # ms, 99th percentile
FEWER = UPDATES_A_SECOND / 50  # otherwise the updates were not read fast enough
KEPT = 100  # updates; no subscriber reads them


def threads(other: Peer, stops: int) -> list[float]:
    """Stop a device for threads; return the time of each call."""
    device = TDC001.open(other.url, identify=False)
    device.subscribe(m.MotGetDcStatusUpdate, limit=KEPT)

    def wait(command: Callable[[], object]) -> None:
        with suppress(SessionClosedError):
            command()

    commands: list[Callable[[], object]] = [
        lambda: device.get_vel_params(timeout=LONG),
        lambda: device.change_vel_params(max_velocity=1, timeout=LONG),
    ]
    waiting = [
        threading.Thread(target=wait, args=(command,))
        for command in islice(cycle(commands), WAITING)
    ]
    for thread in waiting:
        thread.start()
    chance = random.Random(1)
    began = []
    for _ in range(stops):
        time.sleep(chance.uniform(0, LONGEST_PAUSE))
        began.append(time.monotonic())
        device.stop()
    assert all(thread.is_alive() for thread in waiting)
    device.close()
    for thread in waiting:
        thread.join()
    return began


async def tasks(other: Peer, stops: int) -> list[float]:
    """Stop an asyncio device; return the intended time of each call."""
    device = await aio.TDC001.open(other.url, identify=False)
    device.subscribe(m.MotGetDcStatusUpdate, limit=KEPT)
    commands: list[Callable[[], Coroutine[Any, Any, object]]] = [
        lambda: device.get_vel_params(timeout=LONG),
        lambda: device.change_vel_params(max_velocity=1, timeout=LONG),
    ]
    waiting = [asyncio.create_task(command()) for command in islice(cycle(commands), WAITING)]
    chance = random.Random(1)
    began = []
    for _ in range(stops):
        meant = time.monotonic() + chance.uniform(0, LONGEST_PAUSE)
        await asyncio.sleep(meant - time.monotonic())
        began.append(meant)
        await device.stop()
    assert not any(task.done() for task in waiting)
    await device.close()
    ends = await asyncio.gather(*waiting, return_exceptions=True)
    assert {type(end) for end in ends} == {SessionClosedError}
    return began


def p99(began: Sequence[float], said: dict[str, Any]) -> tuple[float, float]:
    """Return the 99th percentile of the stops in ms, and the updates per second."""
    late = sorted(end - start for start, end in zip(began, said["stops"], strict=True))
    return late[len(late) * 99 // 100] * 1e3, said["rate"]


def main(stops: int) -> bool:
    """Measure; return whether all bounds hold."""
    logging.getLogger("stagewire").setLevel(logging.ERROR)  # dropping updates is intended
    kept = True
    with peer("flood") as other:
        contenders: dict[str, Callable[[], list[float]]] = {
            "threads": lambda: threads(other, stops),
            "asyncio": lambda: asyncio.run(tasks(other, stops)),
        }
        for name, stop in contenders.items():
            runs = [p99(stop(), other.said()) for _ in range(RUNS)]
            rate = min(rate for _, rate in runs)
            print(f"{name}: {RUNS} x {stops} stops, {WAITING} commands waiting")
            kept &= holds("p99, median of the runs", median(run for run, _ in runs), AT_MOST, "ms")
            kept &= holds("updates a second that did not come", UPDATES_A_SECOND - rate, FEWER)
    return kept


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--stops", type=int, default=STOPS)
    sys.exit(0 if main(parser.parse_args().stops) else 1)
