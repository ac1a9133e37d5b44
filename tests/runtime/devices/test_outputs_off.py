"""Outputs that can burn or heat are off after `open` and after `close`, however the program ends."""

from __future__ import annotations

import asyncio
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from output_controller import (
    INTERLOCK,
    KEY,
    LASERS,
    UNITS_THAT_HEAT,
    OutputController,
)
from proof_line import SIDES, AsyncMemoryLink, Side, settled
from proof_server import Server

from stagewire.errors import (
    BadValueError,
    MotionUnderWayError,
    NotReadyError,
    ReplyTimeoutError,
    WrongUnitError,
)
from stagewire_apt import aio, devices
from stagewire_apt.devices.facts import UNITS
from stagewire_virtual import stepped

PROGRAM = Path(__file__).with_name("output_program.py")
SWITCHES = {0x0812: 0, 0x0840: 0}
"""Messages that switch an output off."""

each_side = pytest.mark.parametrize("side", SIDES, ids=repr)
each_unit = pytest.mark.parametrize("unit", UNITS_THAT_HEAT)


def test_every_unit_with_a_safe_state_is_tested() -> None:
    assert {name for name, unit in UNITS.items() if unit.safe_state} == {*UNITS_THAT_HEAT}


@each_side
@each_unit
@pytest.mark.parametrize("identify", [True, False], ids=["identified", "unidentified"])
def test_an_output_that_was_left_on_is_off_after_open(
    unit: str, side: Side, identify: bool
) -> None:
    far = OutputController(unit)

    async def scenario(bench: Any) -> None:
        async with bench.open(unit, identify=identify):
            assert not far.on
            requests = {0x0005, 0x0841}  # they change nothing
            assert next(id for id in far.ids if id not in requests) in SWITCHES

    side.run(far, scenario)


@each_side
@each_unit
@pytest.mark.parametrize("leave", [False, True], ids=["stop", "leave"])
def test_an_output_that_another_program_switched_on_is_off_after_close(
    unit: str, side: Side, leave: bool
) -> None:
    far = OutputController(unit)

    async def scenario(bench: Any) -> None:
        async with bench.open(unit, on_close="leave" if leave else "stop"):
            assert far.on == leave
            far.switch_on()

    side.run(far, scenario)
    assert far.on == leave
    assert not (leave and SWITCHES.keys() & {*far.ids})


@each_side
@each_unit
def test_an_exception_in_a_with_block_switches_the_output_off(unit: str, side: Side) -> None:
    far = OutputController(unit)

    async def scenario(bench: Any) -> None:
        async with bench.open(unit):
            far.switch_on()
            raise KeyError(unit)

    with pytest.raises(KeyError):
        side.run(far, scenario)
    assert not far.on


@each_unit
def test_a_cancelled_task_switches_the_output_off(unit: str) -> None:
    far = OutputController(unit)

    async def main() -> None:
        async def work() -> None:
            async with getattr(aio, unit).open(AsyncMemoryLink(far)):
                far.switch_on()
                await asyncio.sleep(1000)

        task = asyncio.create_task(work())
        await asyncio.sleep(10)
        assert far.on
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)

    stepped.run(main())
    assert not far.on


@pytest.mark.skipif(sys.platform == "win32", reason="Windows ends a process without a signal")
@pytest.mark.parametrize("world", ["threads", "loop"])
@pytest.mark.parametrize(
    "unit",
    [
        pytest.param(unit, marks=[pytest.mark.matrix] * (unit not in ("KLD101", "TTC001")))
        for unit in UNITS_THAT_HEAT
    ],
)
def test_a_signal_switches_the_output_off(unit: str, world: str) -> None:
    far = OutputController(unit)
    with Server(far, hosts=1) as server:
        command = [sys.executable, str(PROGRAM), world, unit, server.url]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as program:
            assert program.stdout is not None
            assert program.stdout.readline() == "open\n"
            far.switch_on()
            program.send_signal(signal.SIGTERM)
            assert program.wait(20) == -signal.SIGTERM
    assert not far.on


@each_side
@each_unit
def test_stop_switches_the_output_off(unit: str, side: Side) -> None:
    far = OutputController(unit)

    async def scenario(bench: Any) -> None:
        async with bench.open(unit, identify=False, on_close="leave") as device:
            await settled(device.stop())
            assert not far.on
            far.switch_on()
            with pytest.raises(BadValueError, match="the stop was sent"):
                await settled(device.stop(timeout="soon"))
            assert not far.on

    side.run(far, scenario)


@each_side
def test_the_sensor_of_a_heater_is_kept(side: Side) -> None:
    far = OutputController("TTC001")
    far.sensor = 2

    async def scenario(bench: Any) -> None:
        async with bench.open("TTC001") as tec:
            assert far.sensor == 2
            await settled(tec.set_io_settings(sensor="SENSOR_IC_AD59X", ma=500))
            assert (far.sensor, far.limit) == (0, 500)

    side.run(far, scenario)
    assert (far.sensor, far.limit) == (0, 0)


@each_side
def test_a_heater_whose_sensor_is_unknown_is_not_opened(side: Side) -> None:
    far = OutputController("TTC001")
    far.silent = (0x0841,)

    async def scenario(bench: Any) -> None:
        with pytest.raises(ReplyTimeoutError, match="TTC001 were not switched off, because TEC_"):
            async with bench.open("TTC001"):
                pass

    side.run(far, scenario)


@each_side
@pytest.mark.parametrize("unit", ["TTC001", "KLS101"])
def test_another_unit_is_left_alone(side: Side, unit: str) -> None:
    far = OutputController("TLD001")

    async def scenario(bench: Any) -> None:
        with pytest.raises(WrongUnitError):
            async with bench.open(unit):
                pass

    side.run(far, scenario)
    assert far.ids == [0x0005]


@each_side
@pytest.mark.parametrize("unit", LASERS)
@pytest.mark.parametrize(
    ("bits", "cause"),
    [
        (KEY, "the safety interlock is open"),
        (INTERLOCK, "the key switch is off"),
        (0, "the key switch is off; the safety interlock is open"),
    ],
)
def test_a_laser_whose_interlock_is_open_is_not_switched_on(
    unit: str, side: Side, bits: int, cause: str
) -> None:
    far = OutputController(unit)

    async def scenario(bench: Any) -> None:
        async with bench.open(unit) as laser:
            far.interlock = bits
            with pytest.raises(
                NotReadyError, match=rf"{cause} \(LA_GET_STATUSBITS\). Change"
            ) as no:
                await settled(laser.enable_output())
            assert "; ".join(no.value.causes) == cause
            assert 0x0811 not in far.ids
            far.interlock = KEY | INTERLOCK
            await settled(laser.enable_output())
            assert far.on
            await settled(laser.disable_output())
            assert not far.on

    side.run(far, scenario)


def test_a_laser_that_does_not_report_its_interlock_is_not_switched_on() -> None:
    far = OutputController("KLD101")

    async def scenario(bench: Any) -> None:
        async with bench.open("KLD101") as laser:
            far.silent = (0x0801,)
            with pytest.raises(ReplyTimeoutError):
                await settled(laser.enable_output())

    SIDES[0].run(far, scenario)
    assert 0x0811 not in far.ids


@pytest.mark.parametrize("unit", LASERS)
def test_a_laser_can_be_switched_on_again_after_reconnecting(unit: str) -> None:
    far = OutputController(unit)
    with Server(far) as server, getattr(devices, unit).open(server.url) as laser:
        laser.enable_output()
        laser.close()
        laser.reconnect()
        assert not far.on
        laser.enable_output()
        laser.get_status_bits()  # the controller has received what was sent before
        assert far.on
    assert not far.on


@pytest.mark.parametrize("unit", LASERS)
def test_a_laser_can_be_switched_on_again_after_reconnecting_in_asyncio(unit: str) -> None:
    far = OutputController(unit)

    async def main(url: str) -> None:
        async with getattr(aio, unit).open(url) as laser:
            await laser.enable_output()
            await laser.close()
            await laser.reconnect()
            assert not far.on
            await laser.enable_output()
            await laser.get_status_bits()
            assert far.on

    with Server(far) as server:
        asyncio.run(main(server.url))
    assert not far.on


def test_a_laser_that_is_left_on_is_named_in_the_log(caplog: pytest.LogCaptureFixture) -> None:
    far = OutputController("KLD101", on=False)
    with Server(far) as server:
        with devices.KLD101.open(server.url, on_close="leave") as laser:
            laser.enable_output()
        assert "may still be on: KLD101: enable_output" in caplog.text
        laser.reconnect()
        with pytest.raises(MotionUnderWayError, match=r"may still be; stop it$"):
            laser.enable_output()
        laser.close()
    assert far.on
