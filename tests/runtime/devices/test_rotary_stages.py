"""Rotary stages, stages whose sources contradict each other, and stages named as in the catalogue."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
from recording_link import RecordingLink

import stagewire_virtual as virtual
from stagewire import Scale, Stage
from stagewire.errors import BadValueError, LimitError, UnknownScaleError
from stagewire.quantities import EndlessTravel, Limit, ScaleConflict, find_stages
from stagewire_apt import TDC001, stages

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


def test_a_position_of_a_rotary_stage_is_refused_in_mm() -> None:
    with opened(PRM1) as device:
        status = device.get_dc_status_update()
        with pytest.raises(
            UnknownScaleError,
            match=r"PRM1_Z8 is a rotary stage: position is in deg, not in mm; use raw counts",
        ):
            _ = status.position_mm
        with pytest.raises(UnknownScaleError, match="is a rotary stage: position is in deg"):
            device.move_absolute(mm=1)


def test_a_position_of_a_rotary_stage_can_be_read_in_degrees() -> None:
    with opened(PRM1) as device:
        counts = device.get_dc_status_update().position
        assert device.scales.of("position", "deg").from_counts(counts) * 1920 == counts
        assert "position: 1920 counts per deg (PRM1_Z8, page 39" in str(device)


def test_a_rotary_stage_moves_in_counts() -> None:
    with opened(PRM1) as device:
        device.move_absolute(counts=3840)
        assert abs(device.get_dc_status_update().position - 3840) < 500


def test_limits_of_a_rotary_stage_apply_to_counts() -> None:
    with opened(PRM1) as device:
        lines = str(device)
        assert "travel: endless (PRM1_Z8, a data sheet)" in lines
        assert "maximum velocity: 25 deg/s (PRM1_Z8, a data sheet)" in lines
        device.change_vel_params(max_velocity=25 * 42950)
        with pytest.raises(
            LimitError,
            match=r"30 deg/s \(1288500 counts\) exceeds the maximum velocity, 25 deg/s .*Stage\.of_user",
        ):
            device.change_vel_params(max_velocity=30 * 42950)
    with opened(GNL18) as device, pytest.raises(LimitError, match=r"21 deg is longer than the"):
        device.move_relative(counts=21_000)


def test_a_limit_in_mm_is_refused_for_a_rotary_stage() -> None:
    for option in ("travel_mm", "target_tolerance_mm"):
        with pytest.raises(
            UnknownScaleError, match=r"values in deg cannot be compared with a limit in mm"
        ):
            opened(PRM1, **{option: 1})
    with pytest.raises(UnknownScaleError, match=r"with <Stage PRM1_Z8: .*> has no values in mm/s"):
        opened(PRM1, max_velocity_mm_per_s=1)
    with pytest.raises(BadValueError, match="a rotary stage has no limits in mm"):
        Stage.of_user("mine", rotary=True, travel_mm=12)


def test_a_user_can_describe_a_rotary_stage() -> None:
    mine = Stage.of_user("mine", rotary=True, position=Scale.counts_per("deg", 1920))
    with opened(mine) as device:
        assert device.scales.of("position", "deg").to_counts(2) == 3840
    with pytest.raises(BadValueError, match=r"must be a Scale in mm, .*rotary=True"):
        opened(Stage.of_user("mine", position=Scale.counts_per("deg", 1920)))


def test_contradicting_sources_are_refused_until_one_is_chosen() -> None:
    with opened(DOUBTFUL) as device:
        status = device.get_dc_status_update()
        with pytest.raises(
            UnknownScaleError,
            match=r"document: 2000 counts per mm \(page 39\); vendor: 20000 counts per mm .*"
            r'pass scale_source="document" or scale_source="vendor" to open',
        ):
            _ = status.position_mm
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
