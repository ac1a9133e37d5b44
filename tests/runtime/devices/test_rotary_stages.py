"""Rotary stages in degrees, stages with contradicting sources, and stages named as in the catalogue."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from fractions import Fraction
from typing import Any

import pytest
from recording_link import RecordingLink

import stagewire_virtual as virtual
from stagewire import Scale, Stage
from stagewire.errors import (
    BadValueError,
    LimitError,
    MissingFieldError,
    TargetNotReachedError,
    UnknownScaleError,
)
from stagewire.quantities import EndlessTravel, Limit, ScaleConflict, find_stages
from stagewire_apt import TDC001, aio, stages

ON_TDC001 = {"controllers": {"TDC001": ("TDC001",)}}
PRM1 = Stage(
    "PRM1_Z8",
    "a rotation mount",
    page=39,
    scales={
        "TDC001": {
            "position": Scale.counts_per("deg", 1920),
            "velocity": Scale.counts_per("deg/s", 42950),
            "acceleration": Scale.counts_per("deg/s^2", 15),
        }
    },
    limits={
        "travel": EndlessTravel("a data sheet"),
        "max_velocity": Limit.of(25, "deg/s", "a data sheet"),
    },
    catalogue=("PRM1-Z8", "PRM1/M-Z8"),
    rotary=True,
    **ON_TDC001,
)
GNL18 = Stage(
    "GNL18",
    "a goniometer",
    page=39,
    scales={"TDC001": {"position": Scale.counts_per("deg", 1000)}},
    limits={"travel": Limit.of(20, "deg", "a data sheet")},
    rotary=True,
    **ON_TDC001,
)
DOUBTFUL = Stage(
    "DOUBTFUL",
    "a stage with two figures",
    page=39,
    scales={
        "TDC001": {
            "position": ScaleConflict.of(
                "mm",
                {
                    "document": Scale.counts_per("mm", 2000, source="page 39"),
                    "vendor": Scale.counts_per("mm", 20000, source="its settings file"),
                },
            ),
        }
    },
    **ON_TDC001,
)


@pytest.fixture(autouse=True)
def registered(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Add the stages to those of the package, on its unit."""
    for stage in (PRM1, GNL18, DOUBTFUL):
        monkeypatch.setattr(stages, stage.name, stage, raising=False)
    known = (*TDC001.unit.stages, PRM1.name, GNL18.name, DOUBTFUL.name)
    before = TDC001.unit.stages
    object.__setattr__(TDC001.unit, "stages", known)
    yield
    object.__setattr__(TDC001.unit, "stages", before)


def opened(stage: Stage | str, **options: Any) -> Any:
    own = stage if isinstance(stage, Stage) and not stage.by_user else None
    return TDC001.open(RecordingLink(virtual.TDC001(stage=own)), stage=stage, **options)


def test_a_rotary_stage_moves_in_degrees() -> None:
    with opened(PRM1) as device:
        end = device.move_absolute(deg="1.5")
        assert (end.message.position, end.values.position_deg) == (2880, 1.5)
        assert device.move_relative(deg=-0.5).values.position_deg == 1
        device.change_jog_params(step_size_deg=0.25)
        assert device.get_jog_params().step_size_deg == 0.25
        assert device.jog("forward").values.position_deg == 1.25
        motion = device.start_move_absolute(deg=1)
        assert motion.wait().values.position_deg == 1
        assert device.get_dc_status_update().position_deg == 1


def test_a_rotary_stage_moves_in_degrees_with_asyncio() -> None:
    async def run() -> None:
        async with aio.K10CR1.open("virtual://K10CR1") as device:
            end = await device.move_absolute(deg="0.375")
            assert end.values is not None
            assert end.values.exact("position_deg") == Fraction(3, 8)
            motion = await device.start_move_relative(deg="-0.375")
            assert (await motion.wait()).message.position == 0  # type: ignore[union-attr]
            with pytest.raises(
                UnknownScaleError, match=r"mm: K10CR1 is a rotary stage: .* use deg="
            ):
                await device.move_absolute(mm=1)

    asyncio.run(run())


def test_velocities_of_a_rotary_stage_are_in_degrees() -> None:
    with opened(PRM1) as device:
        device.change_vel_params(max_velocity_deg_per_s=20, acceleration_deg_per_s2=10)
        profile = device.get_vel_params()
        assert (profile.max_velocity, profile.acceleration) == (20 * 42950, 150)
        assert (profile.max_velocity_deg_per_s, profile.acceleration_deg_per_s2) == (20, 10)
        device.change_home_params(velocity_deg_per_s=2, offset_distance_deg=4)
        homing = device.get_home_params()
        assert (homing.velocity_deg_per_s, homing.offset_distance) == (2, 4 * 1920)


def test_mm_of_a_rotary_stage_and_degrees_of_a_linear_one_are_refused() -> None:
    with opened(PRM1) as device:
        status = device.get_dc_status_update()
        with pytest.raises(
            UnknownScaleError,
            match=r"PRM1_Z8 is a rotary stage: position is in deg, not in mm; read position_deg",
        ):
            _ = status.position_mm
        assert "position 0 deg" in repr(status)
        assert "mm" not in repr(status)
        with pytest.raises(
            UnknownScaleError,
            match=r"change_vel_params: max_velocity_mm_per_s: .*use max_velocity_deg_per_s=",
        ) as caught:
            device.change_vel_params(max_velocity_mm_per_s=1)
        assert caught.value.instead == "max_velocity_deg_per_s"
        with pytest.raises(MissingFieldError, match=r"requires counts or deg$"):
            device.move_absolute()
    with opened("Z8") as device:
        with pytest.raises(
            UnknownScaleError,
            match=r"deg: Z8 is a linear stage: position is in mm, not in deg; use mm=",
        ):
            device.move_absolute(deg=1)
        with pytest.raises(UnknownScaleError, match="read position_mm"):
            _ = device.get_dc_status_update().position_deg
        with pytest.raises(MissingFieldError, match=r"requires counts or mm$"):
            device.move_absolute()
    with TDC001.open(RecordingLink(virtual.TDC001())) as device:
        with pytest.raises(UnknownScaleError, match=r"position in deg on TDC001 .* pass stage="):
            device.move_absolute(deg=1)
        with pytest.raises(MissingFieldError, match=r"requires counts or mm or deg$"):
            device.move_absolute()


def test_positions_of_an_endless_stage_do_not_wrap() -> None:
    with opened(PRM1) as device:
        device.set_pos_counter(deg=359)
        assert device.move_relative(deg=2).values.position_deg == 361
        device.set_pos_counter(deg=-720)
        assert device.get_pos_counter().deg == -720


def test_limits_of_a_rotary_stage_are_in_degrees() -> None:
    with opened(PRM1) as device:
        lines = str(device)
        assert "travel: endless (PRM1_Z8, a data sheet)" in lines
        assert "maximum velocity: 25 deg/s (PRM1_Z8, a data sheet)" in lines
        assert (
            "maximum acceleration: unknown; not checked; set it with max_acceleration_deg_per_s2="
            in lines
        )
        device.change_vel_params(max_velocity=25 * 42950)
        with pytest.raises(
            LimitError,
            match=r"30 deg/s \(1288500 counts\) exceeds the maximum velocity, 25 deg/s .*"
            "max_velocity_deg_per_s=",
        ):
            device.change_vel_params(max_velocity_deg_per_s=30)
    with opened(GNL18) as device, pytest.raises(LimitError, match=r"21 deg is longer than the"):
        device.move_relative(counts=21_000)
    with opened(GNL18) as device, pytest.raises(LimitError, match=r"pass travel_deg= to open"):
        device.move_absolute(deg=21)


def test_limits_in_degrees_are_options_of_open() -> None:
    with opened(
        PRM1,
        travel_deg=(-10, 90),
        max_velocity_deg_per_s=30,
        max_acceleration_deg_per_s2={1: 20},
    ) as device:
        lines = str(device)
        assert "travel: -10 to 90 deg (set by travel_deg)" in lines
        assert "maximum velocity: 30 deg/s (set by max_velocity_deg_per_s)" in lines
        assert "maximum acceleration: 20 deg/s^2 (set by max_acceleration_deg_per_s2)" in lines
        device.change_vel_params(max_velocity_deg_per_s=30)
        with pytest.raises(LimitError, match=r"21 deg/s.2 .* exceeds the maximum acceleration, 20"):
            device.change_vel_params(acceleration_deg_per_s2=21)
        for call, angle in ((device.move_absolute, 91), (device.move_relative, -11)):
            with pytest.raises(LimitError, match="outside the travel, -10 to 90 deg"):
                call(deg=angle)
        with pytest.raises(LimitError, match="101 deg is longer than the travel"):
            device.move_relative(deg=101)


@pytest.mark.parametrize(("stage", "unit"), [("PRM1_Z8", "mm"), ("Z8", "deg")])
def test_limits_for_the_other_kind_of_stage_are_refused(stage: str, unit: str) -> None:
    right = "deg" if unit == "mm" else "mm"
    for option in (
        "travel_{}",
        "target_tolerance_{}",
        "max_velocity_{}_per_s",
        "max_acceleration_{}_per_s2",
    ):
        with pytest.raises(
            UnknownScaleError,
            match=f"does not apply to {stage}, a .* stage; use {option.format(right)}",
        ) as caught:
            opened(stage, **{option.format(unit): 1})
        assert caught.value.instead == option.format(right)


def test_a_limit_in_degrees_needs_a_stage() -> None:
    with pytest.raises(
        UnknownScaleError, match=r"travel_deg cannot be checked: .* in deg .* stage="
    ):
        TDC001.open(RecordingLink(virtual.TDC001()), travel_deg=90)
    with pytest.raises(BadValueError, match="travel_mm and travel_deg limit the same stage"):
        opened(PRM1, travel_mm=1, travel_deg=1)


def test_a_target_at_the_end_of_the_travel_is_allowed_although_its_counts_are_rounded() -> None:
    third = Stage.of_user("third", rotary=True, position=Scale.counts_per("deg", 1000, 3))
    with opened(third, travel_deg=2) as device:
        assert device.move_absolute(deg=2).message.position == 667  # 2.001 degrees
        with pytest.raises(LimitError, match=r"2\.004 deg is outside the travel, 0 to 2 deg"):
            device.move_absolute(counts=668)


def test_a_rotary_stage_may_miss_its_target_by_a_tenth_of_a_degree() -> None:
    for options, counts in (({}, 192), ({"target_tolerance_deg": 0.5}, 960)):
        virtual_unit = virtual.TDC001(stage=PRM1, travel=19_200)  # 5 degrees to each end
        with TDC001.open(RecordingLink(virtual_unit), stage=PRM1, **options) as device:
            with pytest.raises(TargetNotReachedError) as caught:
                device.move_absolute(deg=11)
            assert (caught.value.unit, caught.value.tolerance) == ("deg", counts)
    for option in ("target_tolerance_deg", "target_tolerance_mm"):
        with pytest.raises(BadValueError, match="and target_tolerance_counts set the same limit"):
            opened(PRM1, **{option: 1, "target_tolerance_counts": 1})


def test_a_user_can_describe_a_rotary_stage() -> None:
    mine = Stage.of_user(
        "mine",
        rotary=True,
        travel_deg=90,
        max_velocity_deg_per_s=5,
        max_acceleration_deg_per_s2=7,
        position=Scale.counts_per("deg", 1920),
        velocity=Scale.counts_per("deg/s", 42950),
        acceleration=Scale.counts_per("deg/s^2", 15),
    )
    with opened(mine) as device:
        assert device.move_absolute(deg=2).message.position == 3840
        assert "travel: 90 deg (mine, your own stage)" in str(device)
        with pytest.raises(LimitError, match="91 deg is longer than the travel"):
            device.move_relative(deg=91)
    with pytest.raises(BadValueError, match="mine: a rotary stage has limits in deg only"):
        Stage.of_user("mine", rotary=True, travel_mm=12)
    with pytest.raises(BadValueError, match="mine: a linear stage has limits in mm only"):
        Stage.of_user("mine", max_velocity_deg_per_s=12)
    with pytest.raises(BadValueError, match=r"must be a Scale in mm, .*rotary=True"):
        opened(Stage.of_user("mine", position=Scale.counts_per("deg", 1920)))


def test_contradicting_sources_are_refused_until_one_is_chosen() -> None:
    with opened(DOUBTFUL) as device:
        status = device.get_dc_status_update()
        with pytest.raises(
            UnknownScaleError,
            match=r"document: 2000 counts per mm \(page 39\); vendor: 20000 counts per mm .*"
            r'pass scale_source="document" or scale_source="vendor" to open',
        ) as caught:
            _ = status.position_mm
        assert caught.value.sources == ("document", "vendor")
    for source, counts in (("document", 2000), ("Vendor", 20000)):
        with opened(DOUBTFUL, scale_source=source) as device:
            assert device.scales.of("position", "mm").counts_per_unit == counts
    with pytest.raises(BadValueError, match="scale_source 'user' is not one of document, vendor"):
        opened(DOUBTFUL, scale_source="user")
    with pytest.raises(BadValueError, match="no scale of the stage has sources that contradict"):
        opened(PRM1, scale_source="vendor")


def test_a_stage_is_found_by_its_name_in_the_catalogue(monkeypatch: pytest.MonkeyPatch) -> None:
    with opened("prm1/m-z8") as device:
        assert device.scales.stage is PRM1
    assert find_stages("stagewire_apt", "prm1-z8") == [PRM1]
    assert find_stages("stagewire_apt", "z8") == [stages.Z8]
    for axis in (GNL18, DOUBTFUL):
        object.__setattr__(axis, "catalogue", ("XY-1",))
    try:
        with pytest.raises(
            BadValueError, match=r"XY-1 is the catalogue name of several stages; choose GNL18 \(a"
        ):
            opened("XY-1")
    finally:
        for axis in (GNL18, DOUBTFUL):
            object.__setattr__(axis, "catalogue", ())
