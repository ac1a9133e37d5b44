"""A stop gets through, and nothing moves after it; a motion continues after a pause only."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest
from iocs import Running, bench_of, running
from lines import Line, recorded
from motors import MOVE, MS2000, STOP, motor_test, starts

import stagewire_virtual as virtual
from stagewire.errors import LimitError, MotionStoppedError
from stagewire_apt import stages
from stagewire_epics.records import PutRefusedError


@motor_test
async def test_no_move_is_sent_after_a_stop_that_follows_at_once(
    x: Running, tdc: Any, line: Line
) -> None:
    for turn in range(24):
        sent = len(line.sent)
        moving = x.begin("VAL", 6.0)
        await asyncio.sleep(0)
        await asyncio.sleep(0.0005 * (turn % 6))
        await x.put("STOP", 1)
        with pytest.raises(MotionStoppedError):
            await moving
        await asyncio.sleep(0.02)
        frames = line.sent[sent:]
        assert frames.rfind(MOVE) <= frames.find(STOP), turn
    assert x["RBV"] < 0.5


@motor_test
async def test_a_motion_continues_after_a_pause_that_ends_before_it_is_at_rest(
    x: Running, tdc: Any, line: Line
) -> None:
    moving = x.begin("VAL", 1.0)
    await x.beyond(0.2)
    pausing = x.begin("SPMG", "Pause")
    await asyncio.sleep(0.01)
    await x.put("SPMG", "Go")
    await moving
    await pausing
    assert x["RBV"] == pytest.approx(1.0, abs=1e-4)
    assert (x["DMOV"], x["MISS"], starts(line)) == (1, 0, 2)


@motor_test
async def test_of_two_puts_during_a_pause_the_newest_moves_once(
    x: Running, tdc: Any, line: Line
) -> None:
    await x.put("SPMG", "Pause")
    first = x.begin("VAL", 1.0)
    await asyncio.sleep(0.05)
    second = x.begin("VAL", 0.5)
    with pytest.raises(MotionStoppedError, match="replaced by a newer one"):
        await first
    assert (x["DMOV"], starts(line)) == (0, 0)
    await x.put("SPMG", "Go")
    await second
    assert x["RBV"] == pytest.approx(0.5, abs=1e-4)
    assert starts(line) == 1


@motor_test
async def test_a_stop_that_cannot_be_sent_is_refused(x: Running, tdc: Any, line: Line) -> None:
    tdc.unplug()
    await x.connected(now=False)
    for field, value in (("STOP", 1), ("SPMG", "Stop"), ("SPMG", "Pause")):
        with pytest.raises(PutRefusedError, match="not connected; no stop was sent"):
            await x.put(field, value)


@pytest.mark.parametrize("first", ["HOMF", "JOGF"])
def test_a_button_is_released_when_its_motion_is_replaced(first: str) -> None:
    @motor_test
    async def body(x: Running, tdc: Any, line: Line) -> None:
        await x.put("VAL", 0.5)
        replaced = x.begin(first, 1)
        await asyncio.sleep(0.1)
        jogging = x.begin("JOGR", 1)
        await x.until("JOGR", 1)
        assert x[first] == 0
        with pytest.raises(MotionStoppedError):
            await replaced
        await x.put("JOGR", 0)
        await jogging

    body()


def test_a_put_while_the_ioc_ends_moves_nothing() -> None:
    async def body(line: Line) -> None:
        async with running(bench_of(line.url)) as x:
            await x.motor.close()
            with pytest.raises(PutRefusedError, match="the IOC ends"):
                await x.put("VAL", 1.0)
            assert starts(line) == 0

    with virtual.TDC001(stage=stages.Z8).tcp() as tdc, recorded(tdc.url) as line:
        asyncio.run(body(line))


def test_an_ms2000_moves_on_after_a_newer_target_a_pause_and_a_jog_but_not_after_a_stop() -> None:
    async def body(url: str) -> None:
        async with running(MS2000.format(url=url)) as x:
            replaced = x.begin("VAL", 20000)
            await x.beyond(200)
            await x.put("VAL", 100)
            assert x["RBV"] == pytest.approx(100, abs=0.2)
            with pytest.raises(MotionStoppedError, match="replaced"):
                await replaced
            paused = x.begin("VAL", 2000)
            await x.beyond(300)
            await x.put("SPMG", "Pause")
            await x.until("CNEN", 0)
            await x.put("SPMG", "Go")
            await paused
            assert x["RBV"] == pytest.approx(2000, abs=0.2)
            await x.put("HLM", 30000)
            jogging = x.begin("JOGF", 1)
            await x.beyond(2200)
            await x.put("JOGF", 0)
            await jogging
            await x.put("VAL", 2000)
            stopped = x.begin("VAL", 20000)
            await x.beyond(2200)
            await x.put("STOP", 1)
            with pytest.raises(MotionStoppedError, match="STOP was put"):
                await stopped
            with pytest.raises(PutRefusedError, match="put CNEN = 1 first"):
                await x.put("VAL", 100)

    with virtual.MS2000().tcp() as ms2000:
        asyncio.run(body(ms2000.url))


@motor_test
async def test_limits_that_change_during_a_pause_apply_to_the_motion_that_waits(
    x: Running, tdc: Any, line: Line
) -> None:
    await x.put("SPMG", "Pause")
    waiting = x.begin("VAL", 5.0)
    await x.until("DMOV", 0)
    await x.put("HLM", 3.0)
    await x.put("SPMG", "Go")
    with pytest.raises(LimitError, match="5 mm is outside the limits, 0 to 3 mm"):
        await waiting
    await x.until("DMOV", 1)
    assert (starts(line), x["MISS"]) == (0, 1)


@pytest.mark.parametrize(("direction", "away", "back"), [(0, "JOGR", "JOGF"), (1, "JOGF", "JOGR")])
def test_a_jog_beyond_its_limit_does_not_move_the_other_way(
    direction: int, away: str, back: str
) -> None:
    @motor_test
    async def body(x: Running, tdc: Any, line: Line) -> None:
        await x.put("DIR", direction)
        await x.put("DLLM", 1.0)
        with pytest.raises(LimitError, match="the position is beyond this limit"):
            await x.put(away, 1)
        assert starts(line) == 0
        jogging = x.begin(back, 1)
        async with asyncio.timeout(5):
            while x["DRBV"] < 0.1:
                await asyncio.sleep(0.01)
        await x.put(back, 0)
        await jogging

    body()
