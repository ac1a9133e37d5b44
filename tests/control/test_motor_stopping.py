"""A stop of a motor always gets through: in plans that are paused, aborted or fail, and before a move."""

from __future__ import annotations

import asyncio
import gc
import logging
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import bluesky.plan_stubs as bps
import bluesky.plans as bp
import pytest
from bluesky import RunEngine
from bluesky.utils import FailedStatus, RunEngineInterrupted
from conftest import Documents
from lines import connected, run
from ophyd_async.core import FlyMotorInfo

import stagewire_virtual as virtual
from stagewire.errors import MotionStoppedError, TargetNotReachedError
from stagewire_apt import stages
from stagewire_apt.aio import BBD102, TDC001
from stagewire_bluesky import Controller, Motor
from stagewire_ms2000.aio import MS2000

URL = "virtual://TDC001?stage=Z8"
FLIGHT = FlyMotorInfo(start_position=10, end_position=40, time_for_move=3)


def cube(name: str = "x", url: str = URL, **options: Any) -> Motor:
    return Motor(Controller(TDC001, url, stage="Z8", **options), name)


def bay(**options: Any) -> Motor:
    return Motor(
        Controller(BBD102, "virtual://BBD102?stage=MLS203", stage="MLS203", **options).bay(1), "x"
    )


def at_rest(motor: Motor) -> float:
    """Return the position of a motor, which must be at rest."""
    first = run(motor.read)[motor.name]["value"]
    time.sleep(0.1)
    assert run(motor.read)[motor.name]["value"] == first
    return float(first)


@contextmanager
def after(seconds: float, action: Callable[[], object]) -> Iterator[None]:
    """Do something during the block, in another thread."""
    timer = threading.Timer(seconds, action)
    timer.start()
    yield
    timer.join()


def test_stop_fails_the_move_and_no_later_move_begins_at_its_target() -> None:
    motor = cube()

    async def stopped() -> None:
        status = motor.set(6.0)
        while (await motor.readback.get_value(cached=False)) < 0.2:
            pass
        await motor.stop()
        with pytest.raises(RuntimeError, match="was stopped"):
            await status
        where = await motor.locate()
        assert where["setpoint"] == where["readback"] < 6.0
        await motor.set(0.0)
        assert abs(await motor.readback.get_value(cached=False)) < 0.001

    with connected(motor):
        run(stopped)


@pytest.mark.parametrize("ticks", [0, 1, 2, 5])
@pytest.mark.parametrize("verb", ["set", "prepare"])
def test_a_stop_that_comes_before_the_motion_prevents_it(
    verb: str, ticks: int, tmp_path: Path
) -> None:
    log = tmp_path / "line.txt"
    motor = bay(log=log)

    async def stopped() -> None:
        status = motor.set(20.0) if verb == "set" else motor.prepare(FLIGHT)
        for _ in range(ticks):
            await asyncio.sleep(0)
        await motor.stop()
        with pytest.raises((RuntimeError, MotionStoppedError, asyncio.CancelledError)):
            await status
        with pytest.raises((AssertionError, RuntimeError)):
            await motor.kickoff()

    with connected(motor):
        run(stopped)
        assert " > 53 04 " not in log.read_text()  # MOT_MOVE_ABSOLUTE
        run(lambda: motor.set(0.5))  # a later move is free


def test_a_resumed_plan_records_only_positions_that_were_reached(
    plans: RunEngine, documents: Documents
) -> None:
    motor = cube()
    with connected(motor):
        with after(0.8, plans.request_pause), pytest.raises(RunEngineInterrupted):
            plans(bp.list_scan([], motor, [0.0, 3.0]))
        assert [data["x"] for data in documents.data] == [0.0]
        assert at_rest(motor) < 2.9
        plans.resume()
        assert [round(data["x"], 3) for data in documents.data] == [0.0, 3.0]


def test_a_stopped_motor_of_an_ms2000_is_enabled_by_hand_and_the_plan_resumes(
    plans: RunEngine, documents: Documents
) -> None:
    motor = Motor(Controller(MS2000, "virtual://MS2000").axis("X"), "x")
    with connected(motor):
        for enable in (False, True):
            with after(0.5, plans.request_pause), pytest.raises(RunEngineInterrupted):
                plans(bp.list_scan([], motor, [0, 10_000]))
            if enable:
                run(lambda: motor.reference.part.start_motor())
                plans.resume()
            else:
                with pytest.raises(FailedStatus) as failure:
                    plans.resume()
                assert isinstance(failure.value.__cause__, TargetNotReachedError)
                assert "enable it with start_motor()" in failure.value.__cause__.__notes__[0]
                run(lambda: motor.reference.part.start_motor())
                run(lambda: motor.set(0))
    assert [data["x"] for data in documents.data] == [0, 0, 10_000]


@pytest.mark.parametrize("verb", ["abort", "stop", "halt"])
def test_the_motor_of_an_ended_plan_is_at_rest(
    verb: str, plans: RunEngine, documents: Documents, caplog: pytest.LogCaptureFixture
) -> None:
    motor = cube()
    caplog.set_level(logging.ERROR, "asyncio")
    with connected(motor):
        with after(0.6, plans.request_pause), pytest.raises(RunEngineInterrupted):
            plans(bp.list_scan([], motor, [0.0, 5.0]))
        getattr(plans, verb)()
        assert 0 < at_rest(motor) < 4
    assert [data["x"] for data in documents.data] == [0.0]
    gc.collect()
    assert "never retrieved" not in caplog.text


def test_a_failed_motor_stops_the_other(plans: RunEngine, documents: Documents) -> None:
    with virtual.TDC001(stage=stages.Z8).tcp() as tdc:
        lost = cube("lost", tdc.url)
        other = cube("other", f"{URL}&serial_number=83000002")
        with connected(lost, other):
            with after(0.6, tdc.unplug), pytest.raises(FailedStatus):
                plans(bp.list_scan([], lost, [0, 8], other, [0, 8]))
            assert 0 < at_rest(other) < 7
    assert len(documents.data) == 1


def flown(motor: Motor) -> Any:
    yield from bps.open_run()
    yield from bps.prepare(motor, FLIGHT, wait=True)
    yield from bps.checkpoint()
    yield from bps.kickoff(motor, wait=True)
    yield from bps.complete(motor, wait=True)
    yield from bps.close_run()


@pytest.mark.parametrize("seconds", [0.1, 1.0], ids=["to the start", "in flight"])
def test_a_pause_stops_a_flight_which_then_fails(plans: RunEngine, seconds: float) -> None:
    motor = bay()
    with connected(motor):
        with after(seconds, plans.request_pause), pytest.raises(RunEngineInterrupted):
            plans(flown(motor))
        assert 0 < at_rest(motor) < 30
        with pytest.raises(FailedStatus):
            plans.resume()
        assert round(run(motor.vel_params.max_velocity.get_value)) == 100  # type: ignore[attr-defined]


def test_a_flight_that_was_stopped_before_its_start_is_refused() -> None:
    motor = bay()

    async def stopped() -> None:
        await motor.prepare(FLIGHT)
        await motor.stop()
        with pytest.raises(MotionStoppedError, match="prepare it again"):
            await motor.kickoff()

    with connected(motor):
        run(stopped)


PROGRAM = """
import sys
from bluesky import RunEngine
from bluesky.plans import list_scan
from ophyd_async.core import init_devices
from stagewire_apt.aio import TDC001
from stagewire_bluesky import Controller, Motor
RE = RunEngine()
with init_devices():
    x = Motor(Controller(TDC001, sys.argv[1], stage="Z8"))
RE.subscribe(lambda name, document: print("event", document["data"]["x"], flush=True), "event")
RE(list_scan([], x, [0, 10]))
"""


def test_ctrl_c_twice_stops_the_stage() -> None:
    with virtual.TDC001(stage=stages.Z8).tcp() as tdc:
        words = [sys.executable, "-c", PROGRAM, tdc.url]
        with subprocess.Popen(
            words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        ) as program:
            assert program.stdout is not None
            assert program.stdout.readline() == "event 0.0\n"
            time.sleep(0.5)
            for _ in range(2):
                program.send_signal(signal.SIGINT)
                time.sleep(0.3)
            out, error = program.communicate(timeout=20)
        assert out.count("event") == 0
        assert "RunEngineInterrupted" in error
        motor = cube(url=tdc.url)
        with connected(motor):
            assert 0 < at_rest(motor) < 4
