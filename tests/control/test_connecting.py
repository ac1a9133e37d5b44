"""Devices connect, connect again, and need no port in mock mode."""

from __future__ import annotations

import asyncio
import subprocess
import sys
from pathlib import Path
from typing import Any

import bluesky.plan_stubs as bps
import bluesky.plans as bp
import pytest
from bluesky import RunEngine
from bluesky.utils import FailedStatus
from conftest import Documents
from lines import connected, run
from ophyd_async.core import FlyMotorInfo, NotConnectedError, init_devices
from ophyd_async.plan_stubs import ensure_connected

import stagewire_virtual as virtual
from stagewire_apt import stages
from stagewire_apt.aio import BBD102, TDC001, TPZ001, TSC001, TSG001
from stagewire_bluesky import Controller, Motor, Piezo, Shutter, ShutterState, StrainGauge

NOWHERE = "socket://127.0.0.1:9"


def test_mock_devices_open_no_port_and_move(plans: RunEngine, documents: Documents) -> None:
    with init_devices(mock=True):
        x = Motor(Controller(TDC001, NOWHERE, stage="Z8", travel_mm=12))
        piezo = Piezo(Controller(TPZ001, NOWHERE))
        shutter = Shutter(Controller(TSC001, NOWHERE))
        gauge = StrainGauge(Controller(TSG001, NOWHERE))
    plans(bp.scan([gauge], x, 0, 5, 3))
    plans(bps.mv(piezo, 10, shutter, ShutterState.OPEN))
    plans(bps.stop(x))
    assert [data["x"] for data in documents.data] == [0, 2.5, 5]
    assert run(piezo.locate)["readback"] == 10
    assert run(shutter.locate)["readback"] == ShutterState.OPEN
    assert not x.reference.controller.is_open


def test_a_mock_motor_flies_without_a_port(plans: RunEngine) -> None:
    with init_devices(mock=True):
        x = Motor(Controller(TDC001, NOWHERE, stage="Z8", travel_mm=12))

    async def fly() -> list[float]:
        seen = []
        flight = FlyMotorInfo(start_position=1, end_position=2, time_for_move=1)
        for begin in (lambda: x.prepare(flight), x.kickoff, x.complete):
            await begin()
            seen.append((await x.locate())["readback"])
        return seen

    assert run(fly) == [1, 2, 2]


def test_a_device_that_is_not_connected_says_so() -> None:
    motor = Motor(Controller(TDC001, NOWHERE), "x")
    with pytest.raises(NotConnectedError, match="connect first"):
        run(motor.read)


def test_an_unreachable_controller_is_not_connected() -> None:
    motor = Motor(Controller(TDC001, NOWHERE), "x")
    with pytest.raises(NotConnectedError, match=r"127\.0\.0\.1:9"):
        run(motor.connect)


def test_connecting_moves_and_changes_nothing(tmp_path: Path) -> None:
    log = tmp_path / "line.txt"
    motor = Motor(Controller(TDC001, "virtual://TDC001?stage=Z8", stage="Z8", log=log), "x")
    with connected(motor):
        run(motor.read)
        run(motor.describe_configuration)
    sent = [line.split(" > ")[1] for line in log.read_text().splitlines() if " > " in line]
    assert any(frame.startswith("14 04") for frame in sent)  # MOT_REQ_VELPARAMS
    assert not [frame for frame in sent if frame.startswith(("53 04", "43 04", "13 04"))]


def test_a_lost_line_is_opened_again_on_request(plans: RunEngine, documents: Documents) -> None:
    with virtual.TDC001(stage=stages.Z8).tcp() as tdc:
        motor = Motor(Controller(TDC001, tdc.url, stage="Z8"), "x")
        with connected(motor):
            plans(bp.list_scan([], motor, [0.1]))
            tdc.unplug()
            with pytest.raises(FailedStatus):
                plans(bp.list_scan([], motor, [0.2]))
            plans(ensure_connected(motor, force_reconnect=True))
            plans(bp.list_scan([], motor, [0.3]))
    assert [round(data["x"], 2) for data in documents.data] == [0.1, 0.3]


def test_reconnecting_one_bay_does_not_stop_another() -> None:
    controller = Controller(BBD102, "virtual://BBD102?stage=MLS203", stage="MLS203")
    x, y = Motor(controller.bay(1), "x"), Motor(controller.bay(2), "y")

    async def move() -> None:
        moving = x.set(30)
        await asyncio.sleep(0.1)
        await y.connect(force_reconnect=True)
        await moving

    with connected(x, y):
        run(move)
        assert round(run(x.locate)["readback"], 3) == 30


def test_a_controller_belongs_to_one_event_loop() -> None:
    motor = Motor(Controller(TDC001, "virtual://TDC001?stage=Z8", stage="Z8"), "x")
    with connected(motor):
        other = Motor(motor.reference, "y")
        with pytest.raises(NotConnectedError, match="another event loop"):
            asyncio.run(other.connect())


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: Motor(Controller(BBD102, NOWHERE)), r"BBD102 cannot be a motor.*use a part of it: \.bay"),
        (lambda: Motor(Controller(TPZ001, NOWHERE)), "TPZ001 cannot be a motor: it has no move_absolute"),
        (lambda: Shutter(Controller(TDC001, NOWHERE)), "TDC001 cannot be a shutter"),
        (lambda: StrainGauge(Controller(TDC001, NOWHERE)), "TDC001 cannot be a strain gauge"),
        (lambda: Motor(Controller(TDC001, NOWHERE), parameters=("speed",)), "has no get_speed"),
    ],
)  # fmt: skip
def test_a_part_that_cannot_be_the_device_is_refused(make: Any, text: str) -> None:
    with pytest.raises(TypeError, match=text):
        make()


def test_a_bare_install_never_imports_it_and_the_error_names_the_extra() -> None:
    code = (
        "import sys; sys.modules['ophyd_async'] = None\n"
        "import stagewire, stagewire_apt.aio, stagewire_ms2000.aio, stagewire_virtual, stagewire_cli.main\n"
        "assert not {'bluesky', 'event_model', 'stagewire_bluesky'} & sys.modules.keys()\n"
        "import stagewire_bluesky"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert "pip install 'stagewire[bluesky]'" in done.stderr
