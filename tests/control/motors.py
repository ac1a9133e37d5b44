"""Tests of a motor record over a virtual TDC001 whose line is recorded."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from typing import Any

from iocs import Running, bench_of, running
from lines import Line, recorded

import stagewire_virtual as virtual
from stagewire_apt import stages

MOVE = bytes((0x53, 0x04, 0x06, 0x00, 0xD0, 0x01))
STOP = bytes((0x65, 0x04))
STARTS = (MOVE, bytes((0x43, 0x04)), bytes((0x48, 0x04)), bytes((0x57, 0x04)), bytes((0x6A, 0x04)))
"""Frames, or their first bytes, that start a motion of a TDC001."""

MS2000 = """
[controllers.m]
unit = "MS2000"
url = "{url}"
[motors.x]
controller = "m"
axis = "X"
"""
"""A bench with an axis of an MS-2000."""

Body = Callable[[Running, Any, Line], Awaitable[None]]


def motor_test(body: Body) -> Callable[[], None]:
    """Run a test with an IOC over a virtual TDC001 and a line that is recorded."""

    async def within(tdc: Any, line: Line) -> None:
        async with running(bench_of(line.url)) as x:
            await body(x, tdc, line)

    def test() -> None:
        with virtual.TDC001(stage=stages.Z8).tcp() as tdc, recorded(tdc.url) as line:
            asyncio.run(within(tdc, line))

    test.__name__ = test.__qualname__ = body.__name__  # type: ignore[attr-defined]
    return test


def starts(line: Line) -> int:
    return sum(line.sent.count(one) for one in STARTS)
