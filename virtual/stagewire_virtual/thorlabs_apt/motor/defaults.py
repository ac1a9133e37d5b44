"""The parameters of a new motor controller."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from stagewire.quantities import EndlessTravel, Limit, find_stages
from stagewire_apt.enumerations import (
    ButtonMode,
    CurrentPhase,
    HardLimit,
    JogMode,
    MoveDirection,
    ProfileMode,
    SoftwareLimitMode,
    StageAxis,
    StopMode,
)
from stagewire_apt.flags import LedMode
from stagewire_virtual.errors import BadOptionError
from stagewire_virtual.thorlabs_apt.channel import Channel
from stagewire_virtual.thorlabs_apt.identity import reported_id
from stagewire_virtual.thorlabs_apt.motor.moves import Scales

_NOMINAL = 100_000
"""Counts per millimetre, or per degree of a rotary stage, to assume if they are unknown."""
_TURN = 360
"""The travel in degrees of a rotary stage that has no ends, or whose ends are unknown."""
_LONGEST = 0x7FFF_FFFF
"""The longest travel in counts: positions are signed, with 32 bits (page 28)."""


_PART_NUMBER = 16
"""The number of characters of a stage's name (page 76)."""
_AXES = {"rotary": 0x03, "x": 0x10, "y": 0x11, "single": 0x12}
"""The axis of a stage, for which page 76 has no values: those of StageAxisId in thorlabs_xa 1.9.1.28993."""


@dataclass(frozen=True, slots=True)
class _Plausible:
    """Plausible properties of a stage: lengths in millimetres, times in seconds."""

    travel: float
    velocity: float
    acceleration: float
    home_velocity: float
    jog_step: float
    jog_velocity: float
    jerk: float


_BRUSHLESS = _Plausible(110, 100, 1000, 25, 0.05, 50, 10_000)
"""The MLS203: travel of its data sheet, homing of page 38, jog step of page 33, jerk of page 70."""
_SCREW = _Plausible(25, 2, 4, 1, 0.1, 1, 0)
"""An actuator with a lead screw, which takes a quarter of a minute for its travel."""


def is_brushless(channel: Channel) -> bool:
    """Return whether a channel drives a brushless stage, which has the parameters of the PMD chip."""
    return channel.answers("MOT_REQ_PMDSTAGEAXISPARAMS")


def is_endless(channel: Channel) -> bool:
    """Return whether the stage has no ends; its travel is then a turn."""
    settings = channel.settings
    if settings.stage is None or settings.travel is not None:
        return False
    return isinstance(settings.stage.limits.get("travel"), EndlessTravel)


def travel_of(channel: Channel, scales: Scales) -> int:
    """Return the travel in counts, from the settings, from the stage in the registry, or a plausible one.

    Raises :class:`~stagewire_virtual.errors.BadOptionError` if positions cannot represent it.
    """
    told = channel.settings.travel
    if told is None:
        stage = channel.settings.stage
        own = None if stage is None else stage.limits.get("travel")
        length = own.value if isinstance(own, Limit) else _plausible_travel(channel)
        return round(float(length) * _counts_per_mm(scales))
    if not 0 < told <= _LONGEST:
        raise BadOptionError(
            f"{channel.unit.name} requires a travel of 1 to {_LONGEST} counts, not {told}"
        )
    return told


def _plausible_travel(channel: Channel) -> float:
    stage = channel.settings.stage
    return _TURN if stage is not None and stage.rotary else _plausible(channel).travel


def starting_place(channel: Channel, travel: int) -> int:
    """Return the first position of a stage, from the settings, or a fifth of its travel.

    Raises :class:`~stagewire_virtual.errors.BadOptionError` for a position outside the travel.
    """
    told = channel.settings.position
    if told is None:
        return travel // 5
    if not 0 <= told <= travel:
        raise BadOptionError(
            f"{channel.unit.name} cannot start at {told} within a travel of {travel}"
        )
    return told


def motor_defaults(channel: Channel) -> Mapping[str, Mapping[str, Any]]:
    """Return the parameters of a new controller, for the sets that the unit has.

    Velocities suit the stage. The parameters of loops are those in the examples of the document.
    """
    scales = Scales(channel.settings.stage, channel.unit.name)
    stage = _plausible(channel)
    counts = _counts_per_mm(scales)
    brushless = is_brushless(channel)
    travel = travel_of(channel, scales)
    endless = is_endless(channel)

    def velocity(mm_per_s: float) -> int:
        return round(mm_per_s * counts / scales.velocity)

    def acceleration(mm_per_s2: float) -> int:
        return round(mm_per_s2 * counts / scales.acceleration)

    sets: dict[str, dict[str, Any]] = {
        "MOT_VELPARAMS": {
            "acceleration": acceleration(stage.acceleration),
            "max_velocity": velocity(stage.velocity),
        },
        "MOT_JOGPARAMS": {
            "jog_mode": JogMode.SINGLE_STEP,
            "jog_step_size": round(stage.jog_step * counts),
            "jog_acceleration": acceleration(stage.acceleration),
            "jog_max_velocity": velocity(stage.jog_velocity),
            "jog_stop_mode": StopMode.PROFILED,
        },
        "MOT_HOMEPARAMS": {
            # Brushless stages ignore both (page 37), and the example of page 38 has zero.
            "home_direction": 0 if brushless else MoveDirection.REVERSE,
            "limit_switch": 0 if brushless else 1,
            "home_velocity": velocity(stage.home_velocity),
        },
        "MOT_LIMSWITCHPARAMS": {
            "cw_hard_limit": HardLimit.MAKES,
            "ccw_hard_limit": HardLimit.MAKES,
            "cw_soft_limit": travel if channel.clockwise > 0 else 0,
            "ccw_soft_limit": 0 if channel.clockwise > 0 else travel,
            "software_limit_mode": SoftwareLimitMode.IGNORE,
        },
        "MOT_DCPIDPARAMS": {  # page 52
            "proportional": 65,
            "integral": 175,
            "differential": 600,
            "integral_limit": 20_000,
            "filter_control": 0x0F,
        },
        "MOT_AVMODES": {  # "all modes are enabled by default" (page 53)
            "mode_bits": LedMode.of(
                ledmode_ident=True, ledmode_limitswitch=True, ledmode_moving=True
            )
        },
        "MOT_POTPARAMS": {  # page 56
            "zero_wnd": 20,
            "vel1": round(0.1 * counts),
            "wnd1": 50,
            "vel2": round(0.2 * counts),
            "wnd2": 80,
            "vel3": round(0.3 * counts),
            "wnd3": 100,
            "vel4": round(0.5 * counts),
        },
        "MOT_BUTTONPARAMS": {  # page 59
            "mode": ButtonMode.JOG,
            "position1": round(0.5 * counts),
            "position2": round(1.2 * counts),
            "time_out": 2000,
        },
        "MOT_PMDPOSITIONLOOPPARAMS": {  # page 62
            "proportional": 65,
            "integral": 175,
            "integral_limit": 80_000,
            "differential": 600,
            "kd_time_pos": 5,
            "kout_pos": 3277,
            "kaff_pos": 1000,
            "pos_err_lim": 65_535,
        },
        "MOT_PMDMOTOROUTPUTPARAMS": {  # page 65, with the motor limit from its text
            "cont_current_lim": 6553,
            "energy_lim": 4800,
            "motor_lim": 32_767,
        },
        "MOT_PMDTRACKSETTLEPARAMS": {"settle_window": 20},  # page 67
        "MOT_PMDPROFILEMODEPARAMS": {  # page 70
            "mode": ProfileMode.TRAPEZOIDAL,
            "jerk": round(stage.jerk * counts / scales.jerk),
        },
        "MOT_PMDCURRENTLOOPPARAMS": {  # page 72
            "phase": CurrentPhase.PHASEA_AND_B,
            "kp_current": 35,
            "ki_current": 80,
            "i_lim_current": 32_767,
            "i_dead_band": 50,
        },
        "MOT_PMDSETTLEDCURRENTLOOPPARAMS": {  # page 74
            "phase": CurrentPhase.PHASEA_AND_B,
            "ki_settled": 40,
            "i_lim_settled": 30_000,
            "i_dead_band_settled": 50,
            "kff_settled": 500,
        },
        "MOT_PMDSTAGEAXISPARAMS": {  # page 76: twice the initial velocity and acceleration
            **_names_of_stage(channel),
            "serial_num": channel.random.randrange(1, 10_000_000),
            "cnts_per_unit": round(counts),
            "min_pos": -_LONGEST if endless else 0,
            "max_pos": _LONGEST if endless else travel,
            "max_accn": acceleration(2 * stage.acceleration),
            "max_dec": acceleration(2 * stage.acceleration),
            "max_vel": velocity(2 * stage.velocity),
        },
    }
    return {
        name: values
        for name, values in sets.items()
        if channel.answers(name.replace("MOT_", "MOT_REQ_", 1))
    }


def _names_of_stage(channel: Channel) -> Mapping[str, Any]:
    """Return how a brushless controller names its stage: that of the example on page 76, if it has none."""
    stage = channel.settings.stage
    if stage is None:
        return {
            "stage_id": StageAxis.MLS203_X_AXIS,
            "axis_id": _AXES["x"],
            "part_no_axis": "MLS203 X Axis",
        }
    for first in find_stages(channel.unit.protocol.package, f"{stage.name}_X"):
        stage = first  # a stage with two axes
    name, _, axis = stage.name.partition("_")
    kind = "rotary" if stage.rotary else axis.lower()
    return {
        "stage_id": reported_id(channel.unit, stage, "MOT_GET_PMDSTAGEAXISPARAMS.stage_id"),
        "axis_id": _AXES.get(kind, _AXES["single"]),
        "part_no_axis": (f"{name} {axis} Axis" if axis else name)[:_PART_NUMBER],
    }


def _plausible(channel: Channel) -> _Plausible:
    """Return plausible properties of the stage.

    A stage that is rotary, or built into its unit, moves at a part of its limits in the registry.
    """
    if is_brushless(channel):
        return _BRUSHLESS
    stage = channel.settings.stage
    if stage is None or not (stage.rotary or "built_in" in channel.unit.facts):
        return _SCREW
    limits = stage.limits
    velocity, acceleration = limits.get("max_velocity"), limits.get("max_acceleration")
    if not (isinstance(velocity, Limit) and isinstance(acceleration, Limit)):
        return _SCREW
    fastest = float(velocity.value)
    return replace(
        _SCREW,
        velocity=fastest / 2,
        acceleration=float(acceleration.value) / 2,
        home_velocity=fastest / 4,
        jog_velocity=fastest / 4,
    )


def _counts_per_mm(scales: Scales) -> float:
    return float(scales.counts_per_mm or _NOMINAL)
