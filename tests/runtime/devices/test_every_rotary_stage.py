"""Every rotary stage of the registry, on each unit that drives it, in degrees."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import pytest
from recording_link import RecordingLink

import stagewire_apt
import stagewire_virtual as virtual
from stagewire.errors import LimitError, UnknownScaleError
from stagewire.quantities import EndlessTravel, Limit, ScaleConflict, Stage
from stagewire_apt import stages
from stagewire_virtual.factory import simulated_units

ROTARY = [
    stage
    for stage in vars(stages).values()
    if isinstance(stage, Stage) and stage.rotary and stage.name != "MPC_Paddle"
]
"""All rotary stages, except the paddles, which have neither relative moves nor velocities."""


def drives() -> list[tuple[str, str]]:
    """Return each stage with each unit that has a device class, can be simulated and drives it."""
    return [
        (stage.name, unit)
        for stage in ROTARY
        for units in stage.controllers.values()
        for unit in units
        if hasattr(stagewire_apt, unit) and unit in simulated_units()
    ]


def opened(unit: str, stage: str, **options: Any) -> tuple[Any, Any]:
    """Open a unit with a stage; return the device and its part that moves."""
    controller = getattr(virtual, unit)(stage=getattr(stages, stage))
    device = getattr(stagewire_apt, unit).open(RecordingLink(controller), stage=stage, **options)
    part = device
    if device.unit.kind == "rack":
        part = device.bay(1)
    if device.unit.channels > 1:
        part = part.channel(1)
    return device, part


def source_of(stage: str) -> dict[str, str]:
    """Return the choice of a source for a stage whose sources contradict each other."""
    scales = getattr(stages, stage).scales.values()
    doubtful = any(isinstance(scale, ScaleConflict) for group in scales for scale in group.values())
    return {"scale_source": "vendor"} if doubtful else {}


def test_the_registry_has_rotary_stages_on_units_with_classes() -> None:
    assert {"PRM1_Z8", "K10CR1", "DDR100", "HDR50", "NR360", "GNL10_Z8", "PY004Z8_Yaw"} <= {
        stage for stage, _ in drives()
    }


@pytest.mark.parametrize(("stage", "unit"), drives())
def test_a_rotary_stage_moves_in_degrees(stage: str, unit: str) -> None:
    device, part = opened(unit, stage, **source_of(stage))
    with device:
        scale = part.scales.of("position", "deg")
        half = Fraction(1, 2) / scale.counts_per_unit  # rounding
        end = part.move_absolute(deg="0.7")
        assert abs(end.values.exact("position_deg") - Fraction(7, 10)) <= half
        end = part.move_relative(deg="-0.2")
        assert abs(end.values.exact("position_deg") - Fraction(1, 2)) <= 2 * half
        assert end.message.position == scale.to_counts("0.7") - scale.to_counts("0.2")
        with pytest.raises(UnknownScaleError, match=f"{stage} is a rotary stage: .* use deg="):
            part.move_absolute(mm=1)
        assert part.get_pos_counter().deg == float(scale.from_counts(end.message.position))


@pytest.mark.parametrize(("stage", "unit"), drives())
def test_the_limits_of_a_rotary_stage_are_in_degrees(stage: str, unit: str) -> None:
    limits = getattr(stages, stage).limits
    device, part = opened(unit, stage, **source_of(stage))
    with device:
        shown, travel = str(device), limits["travel"]
        if isinstance(travel, EndlessTravel):
            assert f"travel: endless ({stage}, " in shown
        else:
            assert isinstance(travel, Limit)
            with pytest.raises(LimitError, match="deg is longer than the travel"):
                part.move_relative(deg=travel.value + 1)
        velocity = limits["max_velocity"]
        assert f"maximum velocity: {float(velocity.value):.10g} deg/s ({stage}, " in shown
        with pytest.raises(LimitError, match=r"deg/s \(.* exceeds the maximum velocity"):
            part.change_vel_params(max_velocity_deg_per_s=velocity.value * 2)


@pytest.mark.parametrize(("stage", "unit"), drives())
def test_a_rotary_stage_homes_to_0_degrees(stage: str, unit: str) -> None:
    device, part = opened(unit, stage, **source_of(stage))
    with device:
        part.move_absolute(deg="0.5")
        part.home()
        offset = part.get_home_params().offset_distance_deg
        assert part.get_pos_counter().deg == pytest.approx(0, abs=0.1 + abs(offset))


ENDLESS = [
    (stage, unit)
    for stage, unit in drives()
    if isinstance(getattr(stages, stage).limits["travel"], EndlessTravel)
]


@pytest.mark.parametrize(("stage", "unit"), ENDLESS)
def test_an_endless_stage_turns_past_360_degrees_without_wrapping(stage: str, unit: str) -> None:
    device, part = opened(unit, stage, motion_timeout=600, **source_of(stage))
    with device:
        half = Fraction(1, 2) / part.scales.of("position", "deg").counts_per_unit
        for angle in (400, -30):
            end = part.move_absolute(deg=angle)
            assert abs(end.values.exact("position_deg") - angle) <= half
