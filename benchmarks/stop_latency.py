"""How long a stop takes to the other end, while 10,000 messages a second come in and 100 commands wait.

The other end is a process of its own: it sends status updates, answers no request, so that all that are made
go on waiting (half of them hold what they change locked), and notes when each stop has come. A stop begins
when it is called; in asyncio when the program meant to call it, so that an event loop that is late counts.
It ends when the other end has it, by the clock that both processes share.

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
LONG = 600.0  # seconds; nothing that waits gives up
LONGEST_PAUSE = 0.010
AT_MOST = 5.0  # ms, of 99 in 100
FEWER = UPDATES_A_SECOND / 50  # or they were not taken as fast as they were to come
KEPT = 100  # updates, of which nobody takes any


def threads(other: Peer, stops: int) -> list[float]:
    """Stop a device for threads; return when each stop was called."""
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
    """Stop a device of asyncio; return when each stop was meant to be called."""
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
    """Return what 99 stops in 100 took at most, in ms, and how many updates came in a second."""
    late = sorted(end - start for start, end in zip(began, said["stops"], strict=True))
    return late[len(late) * 99 // 100] * 1e3, said["rate"]


def main(stops: int) -> bool:
    """Measure; return whether the bounds are kept."""
    logging.getLogger("stagewire").setLevel(logging.ERROR)  # that updates are dropped is meant
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
