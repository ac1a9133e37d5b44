"""The time to open a device and get its first reply, without the delays of hardware.

Opening requests the identity of the controller and the settings that its scales need; then a parameter set
is read. The controllers are virtual, served over TCP or in memory. The library is already imported;
``start_up.py`` measures the import.

    python benchmarks/opening.py
"""

from __future__ import annotations

import asyncio
import statistics
import sys
import time
from contextlib import ExitStack

from measure import Runner, holds, interleave

import stagewire_virtual as virtual
from stagewire_apt import TDC001, TPZ001, aio

AT_MOST = 50  # ms, the median
ROUNDS = 21
"""Repetitions for each contender; every one opens a new connection."""


def motor(url: str) -> Runner:
    """Open a motor controller."""

    def run() -> float:
        start = time.perf_counter()
        with TDC001.open(url, stage="Z8") as device:
            device.get_vel_params()
            return time.perf_counter() - start

    return run


def piezo(url: str) -> Runner:
    """Open a piezo controller, whose scales depend on settings."""

    def run() -> float:
        start = time.perf_counter()
        with TPZ001.open(url) as device:
            device.get_output_volts()
            return time.perf_counter() - start

    return run


def asynchronous(url: str, runner: asyncio.Runner) -> Runner:
    """Open a motor controller in asyncio."""

    async def run() -> float:
        start = time.perf_counter()
        async with aio.TDC001.open(url, stage="Z8") as device:
            await device.get_vel_params()
            return time.perf_counter() - start

    return lambda: runner.run(run())


def main() -> bool:
    """Measure; return whether all bounds hold."""
    with ExitStack() as stack:
        tdc = stack.enter_context(virtual.TDC001().tcp()).url
        tpz = stack.enter_context(virtual.TPZ001().tcp()).url
        runner = stack.enter_context(asyncio.Runner())
        contenders = {
            "TDC001 by TCP": motor(tdc),
            "TPZ001 by TCP": piezo(tpz),
            "TDC001 by TCP, asyncio": asynchronous(tdc, runner),
            "TDC001 in memory": motor("virtual://TDC001"),
            "TDC001 in memory, asyncio": asynchronous("virtual://TDC001", runner),
        }
        costs = interleave(contenders, ROUNDS)
    print("Open a device, and its first reply")
    kept = [
        holds(name, statistics.median(each[name] for each in costs) * 1e3, AT_MOST, "ms")
        for name in contenders
    ]
    return all(kept)


if __name__ == "__main__":
    sys.exit(0 if main() else 1)
