"""A move of a motor fails soon when anything goes wrong, and no event has a wrong position."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Iterator
from typing import Any

import bluesky.plan_stubs as bps
import bluesky.plans as bp
import pytest
from bluesky import RunEngine
from bluesky.utils import FailedStatus
from conftest import Documents
from lines import Served, cause_of, connected, run, served
from ophyd_async.core import derived_signal_r

import stagewire_virtual as virtual
from stagewire.errors import (
    LimitError,
    MotionStoppedError,
    MotionTimeoutError,
    MotionUnderWayError,
    NotReadyError,
    ReplyTimeoutError,
    SessionClosedError,
    TargetNotReachedError,
    TransportLostError,
)
from stagewire_apt import stages
from stagewire_apt.aio import BBD102, BSC203, KDC101, TDC001
from stagewire_bluesky import Controller, Motor
from stagewire_ms2000.aio import MS2000

SOON = 5.0
"""Seconds in which a move must fail."""
URL = "virtual://TDC001?stage=Z8"


def motor_at(url: str, name: str = "x", **options: Any) -> Motor:
    chosen: dict[str, Any] = {"stage": "Z8", "travel_mm": 12, **options}
    return Motor(Controller(TDC001, url, **chosen), name)


def interrupted(
    plans: RunEngine,
    motor: Motor,
    interrupt: Callable[[], object],
    *,
    far: float = 10.0,
    after: float = 0.6,
) -> tuple[BaseException, float]:
    """Scan to a distant point, interrupt its move, and return the cause and the seconds until the failure.

    The plan itself must also end soon.
    """
    times: list[float] = []

    def later() -> None:
        time.sleep(after)
        interrupt()
        times.append(time.monotonic())

    thread = threading.Thread(target=later)

    def plan() -> Any:
        yield from bps.open_run()
        yield from bps.mv(motor, 0.0)
        yield from bps.trigger_and_read([motor])
        status = yield from bps.abs_set(motor, far, group="move")
        status.add_callback(lambda _: times.append(time.monotonic()))
        thread.start()
        yield from bps.wait("move")
        yield from bps.trigger_and_read([motor])

    with pytest.raises(FailedStatus) as failure:
        plans(plan())
    thread.join()
    assert time.monotonic() - min(times) < SOON
    return cause_of(failure.value), max(times) - min(times)


def positions(documents: Documents) -> list[float]:
    return [round(data["x"], 3) for data in documents.data]


@pytest.fixture
def line() -> Iterator[Served]:
    with served(URL) as found:
        yield found


def test_a_stop_of_another_program_fails_the_move(
    plans: RunEngine, documents: Documents, line: Served
) -> None:
    motor = motor_at(line.url)
    with connected(motor):
        cause, seconds = interrupted(plans, motor, lambda: line.stop_axis("TDC001"))
        assert isinstance(cause, MotionStoppedError)
        assert seconds < SOON
        assert positions(documents) == [0.0]
        assert documents.of("stop")[0]["exit_status"] == "fail"


def test_a_killed_server_fails_the_move(
    plans: RunEngine, documents: Documents, line: Served
) -> None:
    motor = motor_at(line.url)
    with connected(motor):
        cause, seconds = interrupted(plans, motor, line.kill)
        assert isinstance(cause, TransportLostError | SessionClosedError)
        assert seconds < SOON
        assert positions(documents) == [0.0]


def test_a_server_that_falls_silent_fails_the_move(
    plans: RunEngine, documents: Documents, line: Served
) -> None:
    motor = motor_at(line.url)
    with connected(motor):
        cause, seconds = interrupted(plans, motor, line.silence)
        assert isinstance(cause, ReplyTimeoutError)
        assert "fell silent during a move" in str(cause)
        assert seconds < SOON
        assert positions(documents) == [0.0]


OTHERS: dict[str, tuple[str, Callable[[str], Motor], float]] = {
    "BBD102": (
        "?stage=MLS203",
        lambda url: Motor(Controller(BBD102, url, stage="MLS203").bay(2), "x"),
        70,
    ),
    "BSC203": (
        "?stage=NRT150",
        lambda url: Motor(Controller(BSC203, url, stage="NRT150").bay(1), "x"),
        100,
    ),
    "KDC101": ("?stage=Z825B", lambda url: Motor(Controller(KDC101, url, stage="Z825B"), "x"), 20),
    "MS2000": ("", lambda url: Motor(Controller(MS2000, url).axis("X"), "x"), 20_000),
}


@pytest.mark.parametrize("end", [Served.kill, Served.silence])
@pytest.mark.parametrize("unit", OTHERS)
def test_every_kind_of_motor_fails_when_its_server_ends(
    unit: str, end: Callable[[Served], None], plans: RunEngine, documents: Documents
) -> None:
    options, make, far = OTHERS[unit]
    with served(f"virtual://{unit}{options}") as line:
        motor = make(line.url)
        with connected(motor):
            cause, seconds = interrupted(plans, motor, lambda: end(line), far=far, after=0.4)
            assert isinstance(cause, TransportLostError | SessionClosedError | ReplyTimeoutError)
            assert seconds < SOON
            assert positions(documents) == [0.0]


def test_a_controller_that_is_silent_before_the_move_ends_the_plan_soon(
    plans: RunEngine, line: Served
) -> None:
    motor = motor_at(line.url)
    with connected(motor):
        plans(bps.mv(motor, 0.1))
        line.silence()
        began = time.monotonic()
        with pytest.raises(FailedStatus) as failure:
            plans(bp.list_scan([], motor, [0.2]))
        assert isinstance(cause_of(failure.value), ReplyTimeoutError)
        assert time.monotonic() - began < SOON


@pytest.mark.parametrize("unit", ["BBD102", "KDC101"])
def test_a_stop_of_another_program_fails_the_move_of_every_kind(
    unit: str, plans: RunEngine, documents: Documents
) -> None:
    options, make, far = OTHERS[unit]
    with served(f"virtual://{unit}{options}") as line:
        motor = make(line.url)
        with connected(motor):
            run(lambda: motor.vel_params.max_velocity.set(2))  # type: ignore[attr-defined]
            cause, seconds = interrupted(plans, motor, lambda: line.stop_axis(unit), far=far)
            assert isinstance(cause, MotionStoppedError)
            assert seconds < SOON
            assert positions(documents) == [0.0]


def test_a_stop_by_the_panel_fails_the_move_of_an_ms2000(
    plans: RunEngine, documents: Documents
) -> None:
    with virtual.MS2000().tcp() as ms2000:
        motor = OTHERS["MS2000"][1](ms2000.url)
        instrument: Any = ms2000.instrument
        stop = instrument.axes["X"].stop
        with connected(motor):
            cause, seconds = interrupted(plans, motor, lambda: ms2000.call(stop), far=20_000)
            assert isinstance(cause, TargetNotReachedError)
            assert seconds < SOON
            assert positions(documents) == [0.0]


def test_an_unplugged_line_fails_the_move(plans: RunEngine, documents: Documents) -> None:
    with virtual.TDC001(stage=stages.Z8).tcp() as tdc:
        motor = motor_at(tdc.url)
        with connected(motor):
            cause, seconds = interrupted(plans, motor, tdc.unplug)
            assert isinstance(cause, TransportLostError)
            assert seconds < SOON
            assert positions(documents) == [0.0]


def test_a_target_outside_the_travel_is_refused_and_sends_nothing(
    plans: RunEngine, documents: Documents, tmp_path: Any
) -> None:
    log = tmp_path / "line.txt"
    motor = motor_at(URL, log=log)
    with connected(motor), pytest.raises(FailedStatus) as failure:
        plans(bp.list_scan([], motor, [12.5]))
    assert isinstance(cause_of(failure.value), LimitError)
    assert "12.5 mm is outside the travel, 0 to 12 mm" in str(cause_of(failure.value))
    assert documents.data == []
    assert "HW_REQ_INFO" in log.read_text()
    assert "MOT_MOVE_ABSOLUTE" not in log.read_text()


def test_check_value_refuses_a_target_outside_the_travel() -> None:
    motor = motor_at(URL)
    with connected(motor):
        run(lambda: motor.check_value(12))
        with pytest.raises(LimitError):
            run(lambda: motor.check_value(-0.1))


def test_a_disabled_channel_refuses_the_move(plans: RunEngine, documents: Documents) -> None:
    motor = Motor(Controller(KDC101, "virtual://KDC101?stage=Z825B", stage="Z825B"), "x")
    with connected(motor):
        run(lambda: motor.reference.part.disable())
        with pytest.raises(FailedStatus) as failure:
            plans(bp.list_scan([], motor, [1.0]))
        assert isinstance(cause_of(failure.value), NotReadyError)
        assert documents.data == []


def test_a_stage_that_hits_its_end_fails_the_move(plans: RunEngine, documents: Documents) -> None:
    motor = motor_at("virtual://TDC001?stage=Z8&travel=68608", travel_mm=(-12, 12))
    with connected(motor), pytest.raises(FailedStatus) as failure:
        plans(bp.list_scan([], motor, [0.0, 3.0]))
    assert isinstance(cause_of(failure.value), TargetNotReachedError)
    assert positions(documents) == [0.0]


def test_a_lost_report_of_the_end_fails_the_move(plans: RunEngine, documents: Documents) -> None:
    faults = ["to_host drop frame message=MOT_MOVE_COMPLETED"]
    with virtual.TDC001(stage=stages.Z8, faults=faults).tcp() as tdc:
        motor = motor_at(tdc.url)
        with connected(motor):
            began = time.monotonic()
            with pytest.raises(FailedStatus) as failure:
                plans(bp.list_scan([], motor, [0.2]))
            assert isinstance(cause_of(failure.value), MotionTimeoutError)
            assert "has not reported the end of its move" in str(cause_of(failure.value))
            assert time.monotonic() - began < SOON + 1  # the move itself takes up to a second
            assert documents.data == []
            assert motor.reference.controller.device.left_moving == ()


def test_a_line_lost_between_move_and_reading_records_no_event(
    plans: RunEngine, documents: Documents
) -> None:
    with virtual.TDC001(stage=stages.Z8).tcp() as tdc:
        motor = motor_at(tdc.url)

        def plan() -> Any:
            yield from bps.stage(motor)
            yield from bps.open_run()
            yield from bps.mv(motor, 0.1)
            yield from bps.trigger_and_read([motor])
            tdc.unplug()
            yield from bps.trigger_and_read([motor])

        with connected(motor):
            with pytest.raises((TransportLostError, SessionClosedError)):
                plans(plan())
            assert positions(documents) == [0.1]


def square(position: float) -> float:
    return position * position


def test_a_signal_derived_from_the_position_has_the_final_one_and_none_on_a_lost_line(
    plans: RunEngine, documents: Documents
) -> None:
    with virtual.TDC001(stage=stages.Z8).tcp() as tdc:
        motor = motor_at(tdc.url)
        derived = derived_signal_r(square, position=motor.readback)
        derived.set_name("derived")

        def lost() -> Any:
            yield from bps.stage(derived)
            yield from bps.sleep(0.3)
            tdc.unplug()
            yield from bps.sleep(0.5)
            yield from bps.open_run()
            yield from bps.trigger_and_read([derived])
            yield from bps.close_run()
            yield from bps.unstage(derived)

        with connected(motor):
            plans(bp.scan([derived], motor, 0, 0.4, 5))
            for data in documents.data:
                assert data["derived"] == pytest.approx(data["x"] ** 2, abs=1e-9)
            plans(lost())
            assert math.isnan(documents.data[-1]["derived"])


def test_a_second_move_is_refused_while_one_is_under_way(plans: RunEngine) -> None:
    motor = motor_at(URL)

    async def twice() -> None:
        first = motor.set(6.0)
        with pytest.raises(MotionUnderWayError):
            await motor.set(1.0)
        assert (await motor.locate())["setpoint"] == 6.0
        await motor.stop()
        with pytest.raises((RuntimeError, MotionStoppedError)):
            await first

    with connected(motor):
        run(twice)
