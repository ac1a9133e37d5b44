"""Plans of bluesky move motors of both protocols, and emit valid documents."""

from __future__ import annotations

import threading
from typing import Any

import bluesky.plan_stubs as bps
import bluesky.plans as bp
import pytest
from bluesky import RunEngine, protocols
from bluesky.utils import FailedStatus
from conftest import Documents
from lines import connected, run
from ophyd_async.core import FlyMotorInfo

from stagewire.errors import LimitError, UnknownScaleError
from stagewire_apt.aio import BBD102, K10CR1, TDC001, TSG001
from stagewire_bluesky import Controller, Motor, StrainGauge
from stagewire_ms2000.aio import MS2000


def rack() -> Controller:
    return Controller(BBD102, "virtual://BBD102?stage=MLS203", stage="MLS203", travel_mm=(0, 110))


def cube(**options: Any) -> Controller:
    return Controller(TDC001, "virtual://TDC001?stage=Z8", **{"stage": "Z8", **options})


def rounded(documents: Documents, *names: str) -> list[tuple[float, ...]]:
    return [tuple(round(data[name], 3) + 0.0 for name in names) for data in documents.data]


def test_a_motor_has_the_protocols_of_bluesky() -> None:
    motor = Motor(cube())
    for protocol in (
        protocols.Readable,
        protocols.Configurable,
        protocols.Movable,
        protocols.Locatable,
        protocols.Checkable,
        protocols.Stoppable,
        protocols.Stageable,
        protocols.Subscribable,
        protocols.Preparable,
        protocols.Flyable,
        protocols.HasHints,
        protocols.HasName,
    ):
        assert isinstance(motor, protocol), protocol


def test_a_scan_records_each_point(plans: RunEngine, documents: Documents) -> None:
    gauge = StrainGauge(Controller(TSG001, "virtual://TSG001"), "gauge")
    x = Motor(rack().bay(1), "x")
    with connected(x, gauge):
        plans(bp.scan([gauge], x, 0, 2, 3))
    assert rounded(documents, "x", "gauge") == [(0.0, 0.0), (1.0, 0.0), (2.0, 0.0)]
    assert [kind for kind, _ in documents] == ["start", "descriptor", *["event"] * 3, "stop"]


def test_a_grid_scan_moves_two_bays_of_a_rack(plans: RunEngine, documents: Documents) -> None:
    controller = rack()
    x, y = Motor(controller.bay(1), "x"), Motor(controller.bay(2), "y")
    with connected(x, y):
        plans(bp.grid_scan([], x, 0, 1, 2, y, 0, 2, 3))
    expected = [(0, 0), (0, 1), (0, 2), (1, 0), (1, 1), (1, 2)]
    assert rounded(documents, "x", "y") == expected


def test_a_grid_scan_moves_two_axes_of_an_ms2000(plans: RunEngine, documents: Documents) -> None:
    controller = Controller(MS2000, "virtual://MS2000")
    x, y = Motor(controller.axis("X"), "x"), Motor(controller.axis("Y"), "y")
    with connected(x, y):
        plans(bp.grid_scan([], x, 0, 20, 2, y, 0, 20, 2))
        plans(bp.rel_scan([], x, -5, 5, 2))
    assert rounded(documents, "x")[:4] == [(0,), (0,), (20,), (20,)]
    assert rounded(documents, "x")[4:] == [(15,), (25,)]
    keys = documents.of("descriptor")[0]["data_keys"]
    assert keys["x"]["units"] == "um"
    assert keys["x"]["precision"] == 1


def test_a_relative_scan_ends_where_it_began(plans: RunEngine, documents: Documents) -> None:
    x = Motor(rack().bay(1), "x")
    with connected(x):
        plans(bps.mv(x, 5))
        plans(bp.rel_scan([], x, -1, 1, 3))
        assert round(run(x.locate)["readback"], 3) == 5
    assert rounded(documents, "x") == [(4,), (5,), (6,)]


def test_an_adaptive_scan_takes_small_steps_where_the_signal_changes(
    plans: RunEngine, documents: Documents
) -> None:
    x = Motor(rack().bay(1), "x")
    with connected(x):
        plans(
            bp.adaptive_scan(
                [],
                "x",
                x,
                start=0,
                stop=4,
                min_step=0.25,
                max_step=2,
                target_delta=0.5,
                backstep=False,
            )
        )
    points = [point for (point,) in rounded(documents, "x")]
    assert len(points) > 4
    assert points == sorted(points)


def test_a_rotary_mount_has_degrees(plans: RunEngine, documents: Documents) -> None:
    mount = Motor(Controller(K10CR1, "virtual://K10CR1"), "mount")
    with connected(mount):
        plans(bp.scan([], mount, 0, 0.5, 2))
    assert documents.of("descriptor")[0]["data_keys"]["mount"]["units"] == "deg"
    assert rounded(documents, "mount") == [(0,), (0.5,)]


def test_a_stage_without_a_scale_has_counts(plans: RunEngine, documents: Documents) -> None:
    motor = Motor(Controller(TDC001, "virtual://TDC001"), "x")
    with connected(motor):
        plans(bp.scan([], motor, 0, 2000, 2))
    assert documents.of("descriptor")[0]["data_keys"]["x"]["units"] == "counts"
    assert rounded(documents, "x") == [(0,), (2000,)]


def test_the_descriptor_has_unit_precision_limits_and_configuration(
    plans: RunEngine, documents: Documents
) -> None:
    x = Motor(rack().bay(1), "x", parameters=("vel_params", "home_params"))
    with connected(x):
        plans(bp.count([x]))
    [descriptor] = documents.of("descriptor")
    key = descriptor["data_keys"]["x"]
    assert (key["units"], key["precision"]) == ("mm", 5)
    assert key["limits"]["control"] == {"low": 0.0, "high": 110.0}
    assert key["source"] == "stagewire virtual://BBD102?stage=MLS203 bay 1 x"
    configuration = descriptor["configuration"]["x"]
    assert round(configuration["data"]["x-vel_params-max_velocity"]) == 100
    assert configuration["data_keys"]["x-vel_params-max_velocity"]["units"] == "mm/s"
    assert "x-home_params-offset_distance" in configuration["data"]


def test_a_move_reports_its_progress(plans: RunEngine) -> None:
    motor = Motor(cube(), "x")
    seen: list[dict[str, Any]] = []

    async def move() -> None:
        status = motor.set(1.0)
        status.watch(lambda **update: seen.append(update))
        await status

    with connected(motor):
        run(move)
    assert len(seen) > 2
    assert {update["unit"] for update in seen} == {"mm"}
    assert {update["target"] for update in seen} == {1.0}
    currents = [update["current"] for update in seen]
    assert currents == sorted(currents)


def test_a_long_move_may_take_longer_than_the_timeout_of_motions(plans: RunEngine) -> None:
    motor = Motor(cube(motion_timeout=1), "x")
    with connected(motor):
        plans(bps.mv(motor, 2.5))
        assert round(run(motor.locate)["readback"], 3) == 2.5


def flight(motor: Motor, start: float, end: float, seconds: float) -> Any:
    yield from bps.open_run()
    yield from bps.stage(motor)
    yield from bps.prepare(
        motor,
        FlyMotorInfo(start_position=start, end_position=end, time_for_move=seconds),
        wait=True,
    )
    yield from bps.trigger_and_read([motor])
    yield from bps.kickoff(motor, wait=True)
    yield from bps.complete(motor, wait=True)
    yield from bps.trigger_and_read([motor])
    yield from bps.unstage(motor)
    yield from bps.close_run()


def test_a_flight_passes_the_range_and_restores_the_velocity(
    plans: RunEngine, documents: Documents
) -> None:
    x = Motor(rack().bay(1), "x")
    with connected(x):
        plans(flight(x, 10, 20, 0.5))
        velocity = run(x.vel_params.max_velocity.get_value)  # type: ignore[attr-defined]
    run_up = 20 / 1000 * 20 / 2  # 20 mm/s at 1000 mm/s²
    assert rounded(documents, "x") == [(round(10 - run_up, 3),), (round(20 + run_up, 3),)]
    assert round(velocity) == 100


def test_a_flight_needs_an_acceleration(plans: RunEngine, documents: Documents) -> None:
    motor = Motor(cube(), "x")
    with connected(motor):
        with pytest.raises(FailedStatus) as failure:
            plans(flight(motor, 1, 1.5, 1))
        assert isinstance(failure.value.__cause__, UnknownScaleError)
        assert "acceleration_time=SECONDS" in str(failure.value.__cause__)
        assert run(motor.locate)["readback"] == 0


def test_a_stage_whose_acceleration_is_stated_can_fly(
    plans: RunEngine, documents: Documents
) -> None:
    motor = Motor(cube(), "x", acceleration_time=0.5)
    with connected(motor):
        plans(flight(motor, 1, 1.5, 1))
    assert rounded(documents, "x") == [(0.875,), (1.625,)]


@pytest.mark.parametrize(("start", "end", "seconds"), [(0, 10, 0.2), (50, 120, 1), (50, 100, 0.01)])
def test_a_flight_beyond_a_limit_is_refused_before_anything_moves(
    plans: RunEngine, start: float, end: float, seconds: float
) -> None:
    x = Motor(rack().bay(1), "x")
    with connected(x):
        with pytest.raises(FailedStatus) as failure:
            plans(flight(x, start, end, seconds))
        assert isinstance(failure.value.__cause__, LimitError)
        assert run(x.locate)["readback"] == 0
        assert round(run(x.vel_params.max_velocity.get_value)) == 100  # type: ignore[attr-defined]


def test_a_stopped_flight_fails_and_restores_the_velocity(plans: RunEngine) -> None:
    x = Motor(rack().bay(1), "x")
    with connected(x):
        threading.Timer(1, lambda: run(x.reference.part.stop)).start()
        with pytest.raises(FailedStatus):
            plans(flight(x, 10, 30, 4))
        assert 10 < run(x.locate)["readback"] < 29
        assert round(run(x.vel_params.max_velocity.get_value)) == 100  # type: ignore[attr-defined]


def test_staging_does_not_stop_a_move(plans: RunEngine, documents: Documents) -> None:
    motor = Motor(cube(), "x")

    def plan() -> Any:
        yield from bps.abs_set(motor, 1.0, group="move")
        yield from bp.count([motor])
        yield from bps.wait("move")
        yield from bp.count([motor])

    with connected(motor):
        plans(plan())
    first, last = (position for (position,) in rounded(documents, "x"))
    assert first < last == 1.0
