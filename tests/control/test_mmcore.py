"""Stages, piezos and shutters by UniMMCore, and an acquisition by its MDA engine."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator, Mapping
from contextlib import ExitStack
from typing import Any

import numpy as np
import pytest
import useq
from lines import recorded
from pymmcore_plus.experimental.unicore import SimpleCameraDevice, UniMMCore

import stagewire_virtual as virtual
from stagewire.errors import (
    LimitError,
    MotionStoppedError,
    NotReadyError,
    SessionClosedError,
    StagewireError,
    TransportLostError,
    UnsupportedError,
)
from stagewire_apt import BBD102, TDC001, TPZ001, TSC001, stages
from stagewire_ms2000 import MS2000
from stagewire_pymmcore import PiezoStage, Shutter, Stage, XYStage

MOVE = bytes((0x53, 0x04, 0x06, 0x00))
SET_SOL_STATE = bytes((0xCB, 0x04))


class Camera(SimpleCameraDevice):  # type: ignore[misc]
    """A camera that notes where the devices are while it exposes."""

    def __init__(self, look: Any) -> None:
        super().__init__()
        self._look = look
        self.seen: list[Any] = []

    def get_exposure(self) -> float:
        return 1.0

    def set_exposure(self, exposure: float) -> None:
        pass

    def sensor_shape(self) -> tuple[int, int]:
        return (4, 4)

    def dtype(self) -> Any:
        return np.uint8

    def snap(self, buffer: np.ndarray) -> Mapping[str, Any]:
        buffer[:] = 1
        self.seen.append(self._look())
        return {}


@pytest.fixture
def core() -> Iterator[UniMMCore]:
    made = UniMMCore()
    made.setTimeoutMs(20_000)
    yield made
    made.unloadAllDevices()


@pytest.fixture
def opened() -> Iterator[ExitStack]:
    with ExitStack() as stack:
        yield stack


def load(core: UniMMCore, **devices: Any) -> None:
    for label, device in devices.items():
        core.loadPyDevice(label, device)
        core.initializeDevice(label)


def focus_on(core: UniMMCore, opened: ExitStack) -> tuple[Any, Any]:
    """Load a TDC001 as the stage ``Z``; return the virtual controller and the line."""
    tdc = opened.enter_context(virtual.TDC001(stage=stages.Z8).tcp())
    line = opened.enter_context(recorded(tdc.url))
    part = opened.enter_context(TDC001.open(line.url, stage="Z8", travel_mm=12))
    load(core, Z=Stage(part))
    core.setFocusDevice("Z")
    return tdc, line


def test_a_stage_moves_in_um_and_waits_for_the_end(core: UniMMCore, opened: ExitStack) -> None:
    _, line = focus_on(core, opened)
    core.setPosition(500.0)
    assert core.deviceBusy("Z")
    core.waitForDevice("Z")
    assert core.getPosition() == pytest.approx(500.0, abs=0.1)
    core.setRelativePosition(-100.0)
    core.waitForDevice("Z")
    assert core.getPosition() == pytest.approx(400.0, abs=0.1)
    assert line.sent.count(MOVE) == 2


def test_a_target_outside_the_travel_is_refused_and_sends_nothing(
    core: UniMMCore, opened: ExitStack
) -> None:
    _, line = focus_on(core, opened)
    with pytest.raises(LimitError, match="outside the travel, 0 to 12000 µm"):
        core.setPosition(12_500.0)
    assert MOVE not in line.sent


def test_an_origin_moves_nothing_and_shifts_positions(core: UniMMCore, opened: ExitStack) -> None:
    _, line = focus_on(core, opened)
    core.setPosition(500.0)
    core.waitForDevice("Z")
    core.setOrigin()
    assert core.getPosition() == 0.0
    core.setAdapterOrigin(100.0)
    assert core.getPosition() == pytest.approx(100.0)
    assert line.sent.count(MOVE) == 1
    core.setPosition(150.0)
    core.waitForDevice("Z")
    assert core.getPosition() == pytest.approx(150.0, abs=0.1)
    with pytest.raises(LimitError):
        core.setPosition(-500.0)


def test_a_stop_from_another_thread_ends_the_wait_with_an_error(
    core: UniMMCore, opened: ExitStack
) -> None:
    focus_on(core, opened)
    core.setPosition(8000.0)
    threading.Timer(0.5, core.stop, args=["Z"]).start()
    began = time.monotonic()
    with pytest.raises(MotionStoppedError):
        core.waitForDevice("Z")
    assert time.monotonic() - began < 3
    with pytest.raises(MotionStoppedError):  # it is still at a wrong position
        core.waitForSystem()
    core.setPosition(1000.0)
    core.waitForDevice("Z")
    assert core.getPosition() == pytest.approx(1000.0, abs=0.1)


def test_a_lost_line_ends_the_wait_with_an_error(core: UniMMCore, opened: ExitStack) -> None:
    tdc, _ = focus_on(core, opened)
    core.setPosition(8000.0)
    threading.Timer(0.5, tdc.unplug).start()
    with pytest.raises((TransportLostError, SessionClosedError)):
        core.waitForDevice("Z")


def test_a_silent_controller_ends_the_wait_with_an_error(
    core: UniMMCore, opened: ExitStack
) -> None:
    _, line = focus_on(core, opened)
    core.setPosition(8000.0)
    time.sleep(0.3)
    line.silence()
    began = time.monotonic()
    with pytest.raises(StagewireError, match="fell silent during a motion"):
        core.waitForDevice("Z")
    assert time.monotonic() - began < 5


def test_a_new_target_stops_the_motion_under_way(core: UniMMCore, opened: ExitStack) -> None:
    focus_on(core, opened)
    core.setPosition(8000.0)
    time.sleep(0.4)
    core.setPosition(300.0)
    core.waitForDevice("Z")
    assert core.getPosition() == pytest.approx(300.0, abs=0.1)


def test_homing_and_unloading(core: UniMMCore, opened: ExitStack) -> None:
    _, line = focus_on(core, opened)
    core.home("Z")
    core.waitForDevice("Z")
    core.setPosition(8000.0)
    time.sleep(0.3)
    core.unloadDevice("Z")
    assert bytes((0x65, 0x04)) in line.sent


def test_if_one_target_of_two_is_outside_neither_axis_moves(
    core: UniMMCore, opened: ExitStack
) -> None:
    bbd = opened.enter_context(virtual.BBD102(stage=stages.MLS203).tcp())
    line = opened.enter_context(recorded(bbd.url))
    rack = opened.enter_context(BBD102.open(line.url, stage="MLS203", travel_mm=110))
    load(core, XY=XYStage(rack.bay(1), rack.bay(2)))
    core.setXYStageDevice("XY")
    with pytest.raises(LimitError):
        core.setXYPosition(1000.0, -5.0)
    assert MOVE not in line.sent
    core.setXYPosition(1000.0, 2000.0)
    core.waitForDevice("XY")
    assert core.getXYPosition() == pytest.approx((1000.0, 2000.0), abs=0.1)
    core.setOriginXY()
    assert core.getXYPosition() == (0.0, 0.0)
    core.setXYPosition(50_000.0, 50_000.0)
    time.sleep(0.2)
    core.stop("XY")
    with pytest.raises(MotionStoppedError):
        core.waitForDevice("XY")


def test_a_piezo_sets_measured_positions_in_closed_loop_only(
    core: UniMMCore, opened: ExitStack
) -> None:
    part = opened.enter_context(TPZ001.open("virtual://TPZ001", max_travel_um=20))
    load(core, Z=PiezoStage(part))
    core.setFocusDevice("Z")
    with pytest.raises(NotReadyError, match="not closed loop"):
        core.setPosition(5.0)
    part.set_pos_control_mode(mode="CLOSED_LOOP")
    core.setPosition(5.0)
    core.waitForDevice("Z")
    assert core.getPosition() == pytest.approx(5.0, abs=0.1)
    with pytest.raises(LimitError):
        core.setPosition(1e6)
    with pytest.raises(UnsupportedError):
        core.home("Z")


def test_a_shutter_opens_on_request_and_is_closed_when_it_is_unloaded(
    core: UniMMCore, opened: ExitStack
) -> None:
    part = opened.enter_context(TSC001.open("virtual://TSC001"))
    load(core, Shutter=Shutter(part))
    core.setShutterDevice("Shutter")
    assert core.getShutterOpen() is False
    core.setShutterOpen(True)
    assert part.get_sol_state().state.name == "SOLENOID_ON"
    core.unloadDevice("Shutter")
    assert part.get_sol_state().state.name == "SOLENOID_OFF"


def test_a_shutter_is_closed_in_every_mode_and_opened_in_the_manual_one_only(
    core: UniMMCore, opened: ExitStack
) -> None:
    tsc = opened.enter_context(virtual.TSC001().tcp())
    line = opened.enter_context(recorded(tsc.url))
    part = opened.enter_context(TSC001.open(line.url))
    load(core, Shutter=Shutter(part))
    part.set_sol_operating_mode(operating_mode="SOLENOID_TRIGGER")
    with pytest.raises(NotReadyError, match="not SOLENOID_MANUAL"):
        core.setShutterOpen("Shutter", True)
    assert SET_SOL_STATE not in line.sent
    core.unloadDevice("Shutter")
    assert SET_SOL_STATE in line.sent


@pytest.mark.parametrize("device", [Stage, PiezoStage, Shutter])
def test_another_part_is_refused(device: Any) -> None:
    with pytest.raises(TypeError, match="expected"):
        device(object())


def acquire(core: UniMMCore, sequence: useq.MDASequence) -> list[Exception]:
    """Run a sequence to its end, and return the errors that ended it."""
    found: list[Exception] = []
    try:
        core.mda.run(sequence)
    except Exception as error:
        found.append(error)
    return found


def test_an_acquisition_visits_each_position_with_the_shutter_open(
    core: UniMMCore, opened: ExitStack
) -> None:
    rack = opened.enter_context(
        BBD102.open("virtual://BBD102?stage=MLS203", stage="MLS203", travel_mm=110)
    )
    microscope = opened.enter_context(MS2000.open("virtual://MS2000"))
    microscope.switch_to_low_level()
    focus = microscope.axis("Z")
    solenoid = opened.enter_context(TSC001.open("virtual://TSC001"))

    def look() -> tuple[float, float, float, str]:
        return (
            round(rack.bay(1).position_mm * 1000),
            round(rack.bay(2).position_mm * 1000),
            round(focus.position),
            solenoid.get_sol_state().state.name,
        )

    camera = Camera(look)
    load(
        core,
        XY=XYStage(rack.bay(1), rack.bay(2)),
        Z=Stage(focus),
        Shutter=Shutter(solenoid),
        Camera=camera,
    )
    core.setXYStageDevice("XY")
    core.setFocusDevice("Z")
    core.setShutterDevice("Shutter")
    core.setCameraDevice("Camera")
    sequence = useq.MDASequence(
        axis_order="pz",
        stage_positions=[(1000, 2000, 100), (3000, 1000, 200)],
        z_plan={"range": 20, "step": 10},
        keep_shutter_open_across=("z",),
    )
    assert acquire(core, sequence) == []
    where = [(1000, 2000, z) for z in (90, 100, 110)] + [(3000, 1000, z) for z in (190, 200, 210)]
    assert [seen[:3] for seen in camera.seen] == where
    assert {seen[3] for seen in camera.seen} == {"SOLENOID_ON"}
    assert solenoid.get_sol_state().state.name == "SOLENOID_OFF"


def test_an_acquisition_focuses_with_a_piezo(core: UniMMCore, opened: ExitStack) -> None:
    part = opened.enter_context(TPZ001.open("virtual://TPZ001", max_travel_um=20))
    part.set_pos_control_mode(mode="CLOSED_LOOP")
    camera = Camera(lambda: core.getPosition("Z"))
    load(core, Z=PiezoStage(part), Camera=camera)
    core.setFocusDevice("Z")
    core.setCameraDevice("Camera")
    core.setAutoShutter(False)
    sequence = useq.MDASequence(stage_positions=[(None, None, 10)], z_plan={"range": 4, "step": 2})
    assert acquire(core, sequence) == []
    assert camera.seen == [pytest.approx(z, abs=0.1) for z in (8, 10, 12)]


@pytest.mark.parametrize("event", ["stop", "loss"])
def test_an_acquisition_that_is_disturbed_exposes_nothing_at_a_wrong_position(
    core: UniMMCore, opened: ExitStack, event: str
) -> None:
    tdc, _ = focus_on(core, opened)
    camera = Camera(lambda: core.getPosition("Z"))
    load(core, Camera=camera)
    core.setCameraDevice("Camera")
    core.setAutoShutter(False)
    disturb = tdc.unplug if event == "loss" else lambda: core.stop("Z")
    threading.Timer(1.0, disturb).start()
    positions = [(None, None, 100), (None, None, 9000), (None, None, 200)]
    [error] = acquire(core, useq.MDASequence(stage_positions=positions))
    assert isinstance(error, MotionStoppedError if event == "stop" else TransportLostError)
    assert camera.seen == [pytest.approx(100.0, abs=0.1)]


def test_an_ms2000_moves_again_after_stops_and_newer_targets(
    core: UniMMCore, opened: ExitStack
) -> None:
    microscope = opened.enter_context(MS2000.open("virtual://MS2000"))
    microscope.switch_to_low_level()
    load(core, Z=Stage(microscope.axis("Z")))
    core.stop("Z")  # at rest
    core.setPosition("Z", 20_000)
    time.sleep(0.2)
    core.setPosition("Z", 100)
    core.waitForDevice("Z")
    assert core.getPosition("Z") == pytest.approx(100, abs=0.2)
    core.setPosition("Z", 20_000)
    time.sleep(0.2)
    core.stop("Z")
    with pytest.raises(MotionStoppedError):
        core.waitForDevice("Z")
    here = core.getPosition("Z")
    assert 100 < here < 19_000
    core.setPosition("Z", here - 50)
    core.waitForDevice("Z")
    assert core.getPosition("Z") == pytest.approx(here - 50, abs=0.2)
