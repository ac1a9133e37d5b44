"""SET, FOFF, OFF, DIR and the limits of a motor record behave as in the motor record of EPICS."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest
from iocs import Running, bench_of, running
from lines import Line
from motors import motor_test, starts

import stagewire_virtual as virtual
from stagewire.errors import (
    LimitError,
    StagewireError,
)
from stagewire_apt import stages
from stagewire_epics.records import PutRefusedError, Severity


@motor_test
async def test_a_target_beyond_the_limits_is_refused_and_sends_nothing(
    x: Running, tdc: Any, line: Line
) -> None:
    x.posts.clear()
    sent = starts(line)
    with pytest.raises(LimitError, match=r"12\.5 mm is outside the limits, 0 to 12 mm"):
        await x.put("VAL", 12.5)
    assert starts(line) == sent
    assert (x["VAL"], x["LVIO"]) == (0.0, 1)
    kinds = [post for post in x.posts if post[0] in ("RBV", "DMOV")]
    assert [(kinds[0][0], kinds[0][2])] == [("RBV", Severity.MINOR)]
    assert [post[:2] for post in kinds[1:]] == [("DMOV", 0), ("DMOV", 1)]
    await x.put("VAL", 0.1)
    assert (x["LVIO"], x.severity()) == (0, Severity.NO_ALARM)


@pytest.mark.parametrize("frozen", [0, 1])
def test_with_set_a_target_sets_the_position_and_moves_nothing(frozen: int) -> None:
    @motor_test
    async def body(x: Running, tdc: Any, line: Line) -> None:
        await x.put("VAL", 0.5)
        sent = starts(line)
        await x.put("FOFF", frozen)
        await x.put("SET", 1)
        await x.put("VAL", 3.0)
        await x.put("SET", "Use")
        assert starts(line) == sent
        assert x["RBV"] == x["VAL"] == pytest.approx(3.0, abs=1e-4)
        if frozen:
            assert x["OFF"] == 0.0
            assert x["DRBV"] == pytest.approx(3.0, abs=1e-4)
        else:
            assert x["OFF"] == pytest.approx(2.5, abs=1e-4)
            assert x["DRBV"] == pytest.approx(0.5, abs=1e-4)
            assert (x["LLM"], x["HLM"]) == pytest.approx((2.5, 14.5), abs=1e-4)
        await x.put("VAL", 3.2)
        assert x["RBV"] == pytest.approx(3.2, abs=1e-4)
        assert starts(line) == sent + 1

    body()


@motor_test
async def test_with_set_a_dial_or_raw_target_changes_the_controller(
    x: Running, tdc: Any, line: Line
) -> None:
    await x.put("SET", 1)
    await x.put("DVAL", 2.0)
    assert (x["DRBV"], x["RBV"], x["OFF"]) == pytest.approx((2.0, 0.0, -2.0), abs=1e-4)
    await x.put("RVAL", 34304)
    assert (x["RRBV"], x["DRBV"], x["RBV"]) == pytest.approx((34304, 1.0, 0.0), abs=1e-4)
    await x.put("SET", 0)
    assert starts(line) == 0


@motor_test
async def test_with_set_motions_by_distance_are_refused(x: Running, tdc: Any, line: Line) -> None:
    await x.put("SET", 1)
    for field in ("TWF", "TWR", "JOGF", "JOGR", "HOMF", "HOMR"):
        with pytest.raises(PutRefusedError, match="SET is Set; put Use first"):
            await x.put(field, 1)
    assert starts(line) == 0


@motor_test
async def test_offset_and_direction_change_user_coordinates_and_limits(
    x: Running, tdc: Any, line: Line
) -> None:
    await x.put("OFF", 1.0)
    assert (x["RBV"], x["LLM"], x["HLM"], x["DLLM"], x["DHLM"]) == (1.0, 1.0, 13.0, 0.0, 12.0)
    await x.put("FOFF", "Frozen")
    await x.put("DIR", "Neg")
    assert (x["RBV"], x["LLM"], x["HLM"]) == (1.0, -11.0, 1.0)
    await x.put("VAL", 0.5)
    assert x["DRBV"] == pytest.approx(0.5, abs=1e-4)
    assert x["TDIR"] == 1
    await x.put("FOFF", "Variable")
    await x.put("DIR", "Pos")
    assert x["RBV"] == pytest.approx(0.5, abs=1e-4)
    assert x["OFF"] == pytest.approx(0.0, abs=1e-4)
    assert starts(line) == 1


@motor_test
async def test_limits_narrow_but_do_not_exceed_the_travel(x: Running, tdc: Any, line: Line) -> None:
    await x.put("HLM", 0.5)
    await x.put("DLLM", 0.1)
    assert (x["DLLM"], x["DHLM"], x["LLM"], x["HLM"]) == (0.1, 0.5, 0.1, 0.5)
    assert x.motor.records["VAL"].limits == (0.1, 0.5)
    with pytest.raises(LimitError):
        await x.put("VAL", 0.6)
    for field, value in (("HLM", 13.0), ("LLM", -1.0), ("DLLM", 0.5), ("DHLM", 0.05)):
        with pytest.raises(PutRefusedError):
            await x.put(field, value)
    assert (x["DLLM"], x["DHLM"]) == (0.1, 0.5)
    assert starts(line) == 0


def test_limits_of_an_axis_without_travel_are_set_or_refused_and_never_removed_by_chance() -> None:
    async def body(url: str) -> None:
        async with running(bench_of(url).replace("travel_mm = 12", "")) as x:
            with pytest.raises(PutRefusedError, match="5 mm is above the upper one, 0 mm"):
                await x.put("LLM", 5)
            await x.put("HLM", 5)
            with pytest.raises(PutRefusedError, match="both dial limits would be 5 mm"):
                await x.put("LLM", 5)
            with pytest.raises(LimitError):
                await x.put("VAL", 6)
            await x.put("HLM", 0)
            assert (x["DLLM"], x["DHLM"]) == (0.0, 0.0)

    with virtual.TDC001(stage=stages.Z8).tcp() as tdc:
        asyncio.run(body(tdc.url))


def test_a_limit_switch_that_stops_a_motion_is_reported_with_its_severity() -> None:
    async def body(url: str) -> None:
        bench = bench_of(url).replace("travel_mm = 12", "travel_mm = [-12, 12]")
        async with running(bench) as x:
            with pytest.raises(StagewireError):
                await x.put("VAL", 3.0)
            assert (x["HLS"], x["LLS"], x.severity()) == (1, 0, Severity.MAJOR)
            await x.put("VAL", 1.0)
            assert (x["HLS"], x.severity()) == (0, Severity.NO_ALARM)
            jogging = x.begin("JOGF", 1)
            with pytest.raises(StagewireError):
                await jogging
            await x.put("HLSV", "INVALID")
            await asyncio.sleep(0.7)
            assert x.severity() is Severity.INVALID

    with virtual.TDC001(stage=stages.Z8, travel=68608).tcp() as tdc:
        asyncio.run(body(tdc.url))
