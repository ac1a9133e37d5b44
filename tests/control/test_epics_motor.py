"""The fields of a motor record that move behave as in the motor record of EPICS, without a network."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest
from iocs import SOON, Running, running
from lines import Line
from motors import MS2000, STOP, motor_test, starts

import stagewire_virtual as virtual
from stagewire.errors import (
    MotionStoppedError,
    StagewireError,
)
from stagewire_epics.records import PutRefusedError, Severity


@motor_test
async def test_a_put_of_val_completes_at_the_end_after_the_last_readback_and_dmov(
    x: Running, tdc: Any, line: Line
) -> None:
    x.posts.clear()
    await x.put("VAL", 0.5)
    assert abs(x["RBV"] - 0.5) < 0.0001
    assert x.posts.of("DMOV") == [("DMOV", 0), ("DMOV", 1)]
    assert x.posts[-1][:2] == ("DMOV", 1)
    assert ("VAL", 0.5) in x.posts.of("VAL")[:1]
    ends = [index for index, post in enumerate(x.posts) if post[0] == "RBV"]
    assert x.posts[ends[-1]][1] == x["RBV"]
    assert starts(line) == 1


@motor_test
async def test_a_null_move_pulses_dmov_and_sends_no_move(x: Running, tdc: Any, line: Line) -> None:
    await x.put("VAL", 0.2)
    x.posts.clear()
    await x.put("VAL", 0.2)
    assert x.posts.of("DMOV") == [("DMOV", 0), ("DMOV", 1)]
    assert starts(line) == 1


@motor_test
async def test_the_newest_target_wins_and_the_former_put_fails(
    x: Running, tdc: Any, line: Line
) -> None:
    first = x.begin("VAL", 6.0)
    await x.beyond(0.1)
    x.posts.clear()
    await x.put("VAL", 0.2)
    with pytest.raises(MotionStoppedError, match="replaced by a newer one"):
        await first
    assert abs(x["RBV"] - 0.2) < 0.0001
    assert x.posts.of("DMOV") == [("DMOV", 0), ("DMOV", 1)]
    assert x.severity() is Severity.NO_ALARM


@motor_test
async def test_stop_fails_the_put_and_sets_the_alarm_before_dmov(
    x: Running, tdc: Any, line: Line
) -> None:
    order: list[str] = []
    moving = x.begin("VAL", 8.0)
    moving.add_done_callback(lambda _: order.append("put"))

    async def note(record: Any) -> None:
        if record.value == 1:
            order.append("DMOV")

    x.motor.records["DMOV"].listen(note)
    await x.beyond(0.1)
    x.posts.clear()
    await x.put("STOP", 1)
    with pytest.raises(MotionStoppedError, match="STOP was put"):
        await moving
    await x.until("DMOV", 1)
    assert order == ["put", "DMOV"]
    severities = [post[2] for post in x.posts if post[0] == "RBV"]
    assert severities[-1] is Severity.MINOR
    assert x["VAL"] == x["RBV"] < 8.0
    assert x["STOP"] == 0
    assert starts(line) == 1


@motor_test
async def test_stop_of_an_axis_at_rest_sends_no_stop(x: Running, tdc: Any, line: Line) -> None:
    await x.put("STOP", 1)
    assert STOP not in line.sent


@motor_test
async def test_dial_raw_relative_and_tweak_move(x: Running, tdc: Any, line: Line) -> None:
    await x.put("DVAL", 0.1)
    assert x["DRBV"] == pytest.approx(0.1, abs=1e-4)
    await x.put("RVAL", 6860)
    assert x["RRBV"] == 6860
    await x.put("RLV", 0.1)
    assert x["RBV"] == pytest.approx(0.3, abs=1e-3)
    assert x["RLV"] == 0.0
    await x.put("TWV", 0.05)
    await x.put("TWF", 1)
    assert x["RBV"] == pytest.approx(0.35, abs=1e-3)
    await x.put("TWR", 1)
    assert x["RBV"] == pytest.approx(0.3, abs=1e-3)
    assert (x["TWF"], x["TWR"]) == (0, 0)
    assert starts(line) == 5


@motor_test
async def test_a_jog_moves_until_it_is_0_and_ends_without_alarm(
    x: Running, tdc: Any, line: Line
) -> None:
    jogging = x.begin("JOGF", 1)
    await x.beyond(0.2)
    assert x["JOGF"] == 1
    await x.put("JOGF", 0)
    await jogging
    await x.until("DMOV", 1)
    assert (x["JOGF"], x["MOVN"], x.severity()) == (0, 0, Severity.NO_ALARM)
    assert x["VAL"] == x["RBV"]
    back = x.begin("JOGR", 1)
    await back
    assert x["RBV"] == pytest.approx(0.0, abs=1e-3)


@motor_test
async def test_stop_of_spmg_stops_and_refuses_until_go(x: Running, tdc: Any, line: Line) -> None:
    moving = x.begin("VAL", 8.0)
    await x.beyond(0.1)
    await x.put("SPMG", "Stop")
    with pytest.raises(MotionStoppedError, match="SPMG is Stop"):
        await moving
    with pytest.raises(PutRefusedError, match="put Go first"):
        await x.put("VAL", 0.1)
    await x.put("SPMG", "Go")
    await asyncio.sleep(0.3)
    assert starts(line) == 1
    await x.put("VAL", 0.1)
    assert starts(line) == 2


@motor_test
async def test_a_paused_motion_waits_and_its_put_completes_after_go(
    x: Running, tdc: Any, line: Line
) -> None:
    moving = x.begin("VAL", 0.8)
    await x.beyond(0.1)
    await x.put("SPMG", "Pause")
    await x.until("MOVN", 0)
    await asyncio.sleep(0.4)
    assert x["RBV"] < 0.79
    assert (x["DMOV"], moving.done()) == (0, False)
    await x.put("SPMG", "Go")
    await moving
    assert x["RBV"] == pytest.approx(0.8, abs=1e-3)
    assert starts(line) == 2


@motor_test
async def test_move_of_spmg_allows_one_motion(x: Running, tdc: Any, line: Line) -> None:
    await x.put("SPMG", "Move")
    await x.put("VAL", 0.1)
    assert x.motor.records["SPMG"].choices[x["SPMG"]] == "Pause"
    waiting = x.begin("VAL", 0.2)
    await asyncio.sleep(0.3)
    assert x["RBV"] == pytest.approx(0.1, abs=1e-3)
    await x.put("SPMG", "Move")
    await waiting
    assert x["RBV"] == pytest.approx(0.2, abs=1e-3)


@motor_test
async def test_stop_ends_a_paused_motion(x: Running, tdc: Any, line: Line) -> None:
    await x.put("SPMG", "Pause")
    waiting = x.begin("VAL", 0.2)
    await asyncio.sleep(0.1)
    await x.put("STOP", 1)
    with pytest.raises(MotionStoppedError):
        await waiting
    await x.put("SPMG", "Go")
    await asyncio.sleep(0.3)
    assert starts(line) == 0


@motor_test
async def test_homing_ends_with_dmov_and_msta(x: Running, tdc: Any, line: Line) -> None:
    await x.put("HOMF", 1)
    assert (x["HOMF"], x["DMOV"], x["VAL"]) == (0, 1, x["RBV"])
    assert x["MSTA"] & 1 << 14
    assert (x["MSTA"] & 1 << 13, x["LLS"], x.severity()) == (1 << 13, 0, Severity.NO_ALARM)


@motor_test
async def test_puts_take_effect_in_the_order_in_which_they_came(
    x: Running, tdc: Any, line: Line
) -> None:
    for _ in range(5):
        sent = starts(line)
        puts = [x.begin("SET", 1), x.begin("VAL", 3.0), x.begin("SET", 0), x.begin("VAL", 3.1)]
        await asyncio.gather(*puts)
        assert starts(line) == sent + 1
        assert x["RBV"] == pytest.approx(3.1, abs=1e-4)
    moving, slow = x.begin("VAL", 6.0), x.begin("VELO", 1.0)
    with pytest.raises(PutRefusedError, match="the axis moves"):
        await slow
    await x.put("STOP", 1)
    with pytest.raises(MotionStoppedError):
        await moving


@motor_test
async def test_velocity_is_set_in_units_per_second_and_not_during_a_motion(
    x: Running, tdc: Any, line: Line
) -> None:
    await x.put("VELO", 1.0)
    assert x["VELO"] == pytest.approx(1.0, rel=1e-4)
    with pytest.raises(PutRefusedError, match="not above 0"):
        await x.put("VELO", 0)
    moving = x.begin("VAL", 1.0)
    await x.beyond(0.05)
    with pytest.raises(PutRefusedError, match="the axis moves"):
        await x.put("VELO", 2.0)
    await x.put("STOP", 1)
    with pytest.raises(MotionStoppedError):
        await moving
    with pytest.raises(PutRefusedError, match="the bench states it"):
        await x.put("ACCL", 0.2)


@motor_test
async def test_every_field_without_an_effect_is_read_only(x: Running, tdc: Any, line: Line) -> None:
    writable = {field for field, record in x.motor.records.items() if record.writable}
    assert writable == {
        "VAL", "DVAL", "RVAL", "RLV", "OFF", "DIR", "FOFF", "SET", "HLM", "LLM", "DHLM", "DLLM", "HLSV",
        "STOP", "SPMG", "HOMF", "HOMR", "JOGF", "JOGR", "TWF", "TWR", "TWV", "VELO", "ACCL", "CNEN",
    }  # fmt: skip
    for field in set(x.motor.records) - writable:
        with pytest.raises(PutRefusedError, match="is read-only"):
            await x.put(field, x[field])


@motor_test
async def test_a_stop_by_another_program_fails_the_put_and_sets_the_alarm(
    x: Running, tdc: Any, line: Line
) -> None:
    moving = x.begin("VAL", 8.0)
    await x.beyond(0.1)
    line.inject(bytes((0x65, 0x04, 0x01, 0x01, 0x50, 0x01)))
    async with asyncio.timeout(SOON):
        with pytest.raises(MotionStoppedError):
            await moving
    assert x.severity() is Severity.MINOR
    await x.until("DMOV", 1)
    assert x["VAL"] == x["RBV"] < 8.0


def test_an_axis_of_an_ms2000_moves_again_after_a_stop_when_it_is_enabled() -> None:
    async def body(url: str) -> None:
        async with running(MS2000.format(url=url)) as x:
            assert (x["EGU"], x["VELO"], x["ACCL"]) == ("um", 6000.0, 0.1)
            moving = x.begin("VAL", 20000)
            await x.beyond(500)
            await x.put("STOP", 1)
            with pytest.raises(MotionStoppedError):
                await moving
            await x.until("DMOV", 1)
            await asyncio.sleep(0.7)
            here = x["RBV"]
            assert x["CNEN"] == 0
            with pytest.raises(PutRefusedError, match="put CNEN = 1 first"):
                await x.put("VAL", 100)
            await x.put("CNEN", "Enable")
            await asyncio.sleep(0.7)
            assert (x["RBV"], x["CNEN"]) == (here, 1)
            await x.put("VAL", here - 100)
            assert x["RBV"] == pytest.approx(here - 100, abs=0.2)
            with pytest.raises(PutRefusedError, match="cannot home"):
                await x.put("HOMF", 1)

    with virtual.MS2000().tcp() as ms2000:
        asyncio.run(body(ms2000.url))


@motor_test
async def test_a_disabled_channel_fails_the_put_until_it_is_enabled(
    x: Running, tdc: Any, line: Line
) -> None:
    await x.put("CNEN", 0)
    with pytest.raises(StagewireError, match="disabled"):
        await x.put("VAL", 0.1)
    assert starts(line) == 0
    await x.put("CNEN", 1)
    await x.put("VAL", 0.1)
    assert starts(line) == 1
