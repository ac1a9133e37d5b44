"""An IOC publishes the parameters and the status of motors and of other parts, as the bench asks."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest
from iocs import bench_of, running
from lines import Line, recorded

import stagewire_virtual as virtual
from stagewire.errors import MotionStoppedError
from stagewire_apt import stages
from stagewire_epics.bench import BenchError
from stagewire_epics.records import PutRefusedError, Record, Severity

CHANGE = bytes((0x13, 0x04, 0x0E, 0x00))
"""MOT_SET_VELPARAMS."""
PIEZO = """
[controllers.p]
unit = "TPZ001"
url = "{url}"
[parts.focus]
controller = "p"
parameters = ["output_volts", "pos_control_mode"]
"""


async def until(record: Any, value: Any) -> None:
    async with asyncio.timeout(5):
        while record.value != value:
            await asyncio.sleep(0.01)


def test_a_motor_has_records_of_its_parameters_and_status() -> None:
    async def body(line: Line) -> None:
        more = 'parameters = ["vel_params"]\nstatus = true'
        async with running(bench_of(line.url, motor=more)) as x:
            records = x.ioc.records
            velocity = records["x:VEL_PARAMS:MAX_VELOCITY"]
            await until(records["x:STATUS:TRACKING"], 1)
            async with asyncio.timeout(5):
                while velocity.alarm.severity is not Severity.NO_ALARM:
                    await asyncio.sleep(0.01)
            assert velocity.unit == "mm/s"
            await velocity.put(1.5)
            assert line.sent.count(CHANGE) == 1
            assert velocity.value == pytest.approx(1.5, rel=1e-4)
            moving = x.begin("VAL", 0.6)
            await until(records["x:STATUS:MOVING_FORWARD"], 1)
            await moving
            await until(records["x:STATUS:MOVING_FORWARD"], 0)

    with virtual.TDC001(stage=stages.Z8).tcp() as tdc, recorded(tdc.url) as line:
        asyncio.run(body(line))


def test_a_part_without_a_motor_has_parameters_that_a_lost_line_makes_invalid() -> None:
    async def body(line: Line) -> None:
        async with running(bench_of("virtual://TDC001?stage=Z8") + PIEZO.format(url=line.url)) as x:
            mode = x.ioc.records["focus:POS_CONTROL_MODE:MODE"]
            async with asyncio.timeout(5):
                while mode.alarm.severity is not Severity.NO_ALARM:
                    await asyncio.sleep(0.01)
            await mode.put("CLOSED_LOOP")
            assert mode.choices[mode.value] == "CLOSED_LOOP"
            line.cut()
            async with asyncio.timeout(5):
                while mode.alarm.severity is not Severity.INVALID:
                    await asyncio.sleep(0.01)
            async with asyncio.timeout(5):
                while mode.alarm.severity is not Severity.NO_ALARM:
                    await asyncio.sleep(0.01)

    with virtual.TPZ001().tcp() as tpz, recorded(tpz.url) as line:
        asyncio.run(body(line))


def test_the_records_of_a_lost_motor_are_invalid_until_it_is_back() -> None:
    async def body(line: Line) -> None:
        more = 'parameters = ["vel_params"]\nstatus = true'
        async with running(bench_of(line.url, motor=more)) as x:
            some = [
                x.ioc.records[f"x:{name}"] for name in ("VEL_PARAMS:MAX_VELOCITY", "STATUS:HOMED")
            ]
            await severity(some, Severity.NO_ALARM)
            line.cut()
            await severity(some, Severity.INVALID)
            with pytest.raises(PutRefusedError, match="is not connected; nothing was sent"):
                await some[0].put(1)
            await severity(some, Severity.NO_ALARM)
            await some[0].put(1)
            assert line.sent.count(CHANGE) == 1

    with virtual.TDC001(stage=stages.Z8).tcp() as tdc, recorded(tdc.url) as line:
        asyncio.run(body(line))


async def severity(records: list[Record], wanted: Severity) -> None:
    """Wait until all records have a severity."""
    async with asyncio.timeout(10):
        while any(record.alarm.severity is not wanted for record in records):
            await asyncio.sleep(0.01)


def test_the_status_of_a_part_without_a_motor_is_read() -> None:
    async def body() -> None:
        bench = PIEZO.format(url="virtual://BPC203").replace("TPZ001", "BPC203")
        bench += "bay = 2\nstatus = true\n"
        async with running(bench_of("virtual://TDC001?stage=Z8") + bench) as x:
            closed = x.ioc.records["focus:STATUS:CLOSED_LOOP"]
            await severity(
                [closed, x.ioc.records["focus:POS_CONTROL_MODE:MODE"]], Severity.NO_ALARM
            )
            assert closed.value == 0
            await x.ioc.records["focus:POS_CONTROL_MODE:MODE"].put("CLOSED_LOOP")
            await until(closed, 1)

    asyncio.run(body())


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ('parameters = ["speed"]', "has no parameter set 'speed'"),
        ("bay = 1", "a TPZ001 has no bay"),
        ("status = true", "reports no status bits"),
        ("", "nothing of it is published; state parameters or status = true"),
    ],
)
def test_a_bench_that_asks_for_missing_parts_is_refused(more: str, said: str) -> None:
    async def body() -> None:
        bench = bench_of("virtual://TDC001") + PIEZO.format(url="virtual://TPZ001")
        bench = bench.replace('parameters = ["output_volts", "pos_control_mode"]', more)
        with pytest.raises(BenchError, match=said):
            async with running(bench):
                pass

    asyncio.run(body())


def test_a_set_of_a_motor_is_not_changed_during_a_motion() -> None:
    async def body(line: Line) -> None:
        sets = 'parameters = ["vel_params", "pos_counter"]'
        async with running(bench_of(line.url, motor=sets)) as x:
            moving = x.begin("VAL", 6.0)
            await x.beyond(0.1)
            sent = len(line.sent)
            for name, value in (("VEL_PARAMS:MAX_VELOCITY", 2.5), ("POS_COUNTER:POSITION", 0.0)):
                with pytest.raises(PutRefusedError, match="the axis moves"):
                    await x.ioc.records[f"x:{name}"].put(value)
            assert CHANGE not in line.sent[sent:]
            await x.put("STOP", 1)
            with pytest.raises(MotionStoppedError):
                await moving
            await x.until("DMOV", 1)
            await x.ioc.records["x:VEL_PARAMS:MAX_VELOCITY"].put(1.5)
            assert CHANGE in line.sent[sent:]

    with virtual.TDC001(stage=stages.Z8).tcp() as tdc, recorded(tdc.url) as line:
        asyncio.run(body(line))
