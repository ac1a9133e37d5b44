"""A motor record whose controller is off, lost or silent, and an IOC that ends."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest
from iocs import SOON, Running, bench_of, running
from lines import Line, recorded
from motors import STOP, motor_test, starts

import stagewire_virtual as virtual
from stagewire.errors import (
    MotionStoppedError,
    ReplyTimeoutError,
    TransportLostError,
)
from stagewire_apt import stages
from stagewire_epics.records import PutRefusedError, Severity


@motor_test
async def test_an_unplugged_line_fails_the_put_soon_and_makes_everything_invalid(
    x: Running, tdc: Any, line: Line
) -> None:
    moving = x.begin("VAL", 8.0)
    await x.beyond(0.1)
    tdc.unplug()
    async with asyncio.timeout(SOON):
        with pytest.raises(TransportLostError):
            await moving
    await x.until("DMOV", 1)
    await x.connected(now=False)
    assert {record.alarm.severity for record in x.motor.records.values()} == {Severity.INVALID}
    with pytest.raises(PutRefusedError, match="the controller is not connected"):
        await x.put("VAL", 1.0)


@motor_test
async def test_a_controller_that_falls_silent_fails_the_put_and_makes_the_readback_invalid(
    x: Running, tdc: Any, line: Line
) -> None:
    moving = x.begin("VAL", 8.0)
    await x.beyond(0.1)
    line.silence()
    async with asyncio.timeout(SOON):
        with pytest.raises(ReplyTimeoutError, match="fell silent during a motion"):
            await moving
    await x.until("DMOV", 1)
    assert x.severity() is Severity.INVALID


@motor_test
async def test_a_line_that_comes_back_moves_nothing(x: Running, tdc: Any, line: Line) -> None:
    moving = x.begin("VAL", 8.0)
    await x.beyond(0.1)
    line.cut()
    with pytest.raises(TransportLostError):
        await moving
    await x.connected(now=False)
    sent = starts(line)
    await x.connected()
    await asyncio.sleep(0.5)
    await x.until("MOVN", 0)
    await asyncio.sleep(0.1)
    assert starts(line) == sent == 1
    assert x["VAL"] == x["RBV"]
    await x.put("VAL", 0.5)
    assert x["RBV"] == pytest.approx(0.5, abs=1e-3)


def test_the_end_of_an_ioc_stops_the_axis_and_fails_the_put() -> None:
    async def body(url: str, line: Line) -> None:
        async with running(bench_of(url)) as x:
            moving = x.begin("VAL", 8.0)
            await x.beyond(0.1)
        with pytest.raises(MotionStoppedError, match="the IOC ends"):
            await moving
        assert STOP in line.sent

    with virtual.TDC001(stage=stages.Z8).tcp() as tdc, recorded(tdc.url) as line:
        asyncio.run(body(line.url, line))


def test_a_controller_that_is_off_is_opened_when_it_is_there() -> None:
    async def body() -> None:
        with virtual.TDC001(stage=stages.Z8).tcp() as tdc:
            url = tdc.url
        async with running(bench_of(url), connected=False) as x:
            await asyncio.sleep(0.3)
            assert x.severity() is Severity.INVALID
            with pytest.raises(PutRefusedError, match="the controller is not connected"):
                await x.put("VAL", 1.0)
            port = int(url.rpartition(":")[2])
            with virtual.TDC001(stage=stages.Z8).tcp(port):
                await x.connected()
                await x.put("VAL", 0.1)
                assert x["RBV"] == pytest.approx(0.1, abs=1e-3)

    asyncio.run(body())
