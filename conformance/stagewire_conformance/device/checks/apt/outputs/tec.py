"""``tec-status``, ``tec-set-point`` and ``tec-limit``: temperature controllers (Issue 37, pages 355 to 368).

Nothing is written while the output is on, and no message switches it on.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from stagewire_apt.enumerations import TecSensor
from stagewire_conformance.device.causes import Cause
from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.apt.outputs.light import Light, drawn, light_check

if TYPE_CHECKING:
    from collections.abc import Mapping

    from stagewire_conformance.device.targets import Target
    from stagewire_conformance.device.trial import Trial

_DISPLAYS: Final = ("display_actual", "display_set_point", "display_difference", "display_current")
_NAME: Final = "TEC_GET_STATUSUPDATE"
_STEP: Final = 10
_NEAR: Final = 20

STATUS = Kind(
    name="tec-status",
    title="The readings and the status of a temperature controller agree",
    rules=(
        "tec-temperature-ranges",
        "tec-sensor-units",
        "tec-current-range",
        "tec-status-on-request",
    ),
)
SET_POINT = Kind(
    name="tec-set-point",
    title="The set point of the temperature is kept",
    rules=("tec-temperature-ranges", "get-answers-request"),
)
LIMIT = Kind(
    name="tec-limit",
    title="The limit of the current is kept",
    rules=("tec-limit-range", "get-answers-request"),
)


@light_check(
    STATUS,
    "The status of {place.name} agrees with its readings",
    messages=(
        "TEC_REQ_READINGS", "TEC_GET_READINGS", "TEC_REQ_TEMPSETPOINT", "TEC_GET_TEMPSETPOINT",
        "TEC_REQ_IOSETTINGS", "TEC_GET_IOSETTINGS", "TEC_REQ_DISPSETTINGS", "TEC_GET_DISPSETTINGS",
    ),
    seconds=0.2,
)  # fmt: skip
def _status(trial: Trial, place: Target) -> None:
    light = Light(trial, place)
    status, bits = light.status()
    reading = light.ask("TEC_REQ_READINGS")
    point = light.ask("TEC_REQ_TEMPSETPOINT").t_set
    settings = light.ask("TEC_REQ_IOSETTINGS")
    trial.must(
        "output_enabled" in bits or not drawn(status),
        f"{_NAME} reports a current of {status.i_tec} mA while the output is off",
        rule="tec-current-range",
        cause=Cause(_NAME, "i_tec"),
    )
    ranges = _ranges(trial)
    low, high = _range(ranges, settings.sensor)
    for message, told in ((_NAME, status), ("TEC_GET_READINGS", reading)):
        trial.must(
            abs(told.i_tec) <= settings.i_lim,
            f"{message} reports a current of {told.i_tec} mA, above the limit of {settings.i_lim} mA",
            rule="tec-current-range",
            cause=Cause(message, "i_tec"),
        )
        trial.must(
            low <= told.t_act <= high,
            f"{message} reports t_act = {told.t_act}; the range of the sensor is {low} to {high}",
            rule="tec-sensor-units"
            if _suits_another(told.t_act, ranges)
            else "tec-temperature-ranges",
            cause=Cause(message, "t_act"),
        )
        trial.must(
            told.t_set == point,
            f"{message} reports t_set = {told.t_set}, but TEC_GET_TEMPSETPOINT {point}",
            rule="tec-status-on-request",
            cause=Cause(message, "t_set"),
        )
    trial.must(
        abs(status.t_act - reading.t_act) <= _NEAR,
        f"{_NAME} reports t_act = {status.t_act}, but TEC_GET_READINGS {reading.t_act}; they should agree",
        rule="tec-status-on-request",
        cause=Cause(_NAME, "t_act"),
    )
    mode = light.ask("TEC_REQ_DISPSETTINGS").disp_mode
    shown = [name for name in _DISPLAYS if name in bits]
    wanted = _DISPLAYS[mode : mode + 1]
    trial.must(
        shown == list(wanted),
        f"{_NAME} reports {' and '.join(shown) or 'no display'}, but TEC_GET_DISPSETTINGS the mode {mode}",
        rule="tec-status-on-request",
        cause=Cause(_NAME, "display"),
    )


@light_check(
    SET_POINT,
    "TEC_SET_TEMPSETPOINT sets the set point of {place.name}",
    messages=(
        "TEC_SET_TEMPSETPOINT", "TEC_REQ_TEMPSETPOINT", "TEC_GET_TEMPSETPOINT", "TEC_REQ_READINGS",
        "TEC_GET_READINGS", "TEC_REQ_IOSETTINGS", "TEC_GET_IOSETTINGS",
    ),
    does="changes the set point by 0.1 while the output is off, and restores it",
    seconds=0.2,
    bound="the output stays off",
)  # fmt: skip
def _set_point(trial: Trial, place: Target) -> None:
    light = Light(trial, place)
    light.begin()
    point = light.set_of("TEC_TEMPSETPOINT")
    before = point.read(trial)
    point.undo(trial, before)
    low, high = _range(_ranges(trial), light.ask("TEC_REQ_IOSETTINGS").sensor)
    for step in (_STEP, -_STEP):
        value = before["t_set"] + step
        if not low <= value <= high or not light.keeps(point, {"t_set": value}):
            continue
        told = light.ask("TEC_REQ_READINGS").t_set
        trial.must(
            told == value,
            f"TEC_SET_TEMPSETPOINT wrote {value}, but TEC_GET_READINGS then returned t_set = {told}",
            rule="tec-temperature-ranges",
            cause=Cause("TEC_GET_READINGS", "t_set"),
        )
    _judge_off(light, "TEC_SET_TEMPSETPOINT")


@light_check(
    LIMIT,
    "TEC_SET_IOSETTINGS limits the current of {place.name}",
    messages=("TEC_SET_IOSETTINGS", "TEC_REQ_IOSETTINGS", "TEC_GET_IOSETTINGS"),
    does="lowers the limit of the current while the output is off, and restores it",
    seconds=0.2,
    bound="the output stays off",
)
def _limit(trial: Trial, place: Target) -> None:
    light = Light(trial, place)
    light.begin()
    settings = light.set_of("TEC_IOSETTINGS")
    before = settings.read(trial)
    settings.undo(trial, before)
    for limit in (before["i_lim"] // 2, before["i_lim"] // 4):
        light.keeps(settings, {**before, "i_lim": limit}, "tec-limit-range")
    _judge_off(light, "TEC_SET_IOSETTINGS")


def _ranges(trial: Trial) -> dict[int, tuple[int, int]]:
    """Return the range of temperatures of each sensor, by its number (page 356)."""
    cases = trial.declared.registry.table("quantities")["tec_temperature"]["scale"]["cases"]
    return {TecSensor[name]: (case["minimum"], case["maximum"]) for name, case in cases.items()}


def _range(ranges: Mapping[int, tuple[int, int]], sensor: int) -> tuple[int, int]:
    """Return the range of a sensor; for one that the document does not list, that of all sensors together."""
    every = min(low for low, _ in ranges.values()), max(high for _, high in ranges.values())
    return ranges.get(sensor, every)


def _suits_another(value: int, ranges: Mapping[int, tuple[int, int]]) -> bool:
    """Return whether a value is one of another sensor, perhaps in its unit."""
    return any(low <= value <= high for low, high in ranges.values())


def _judge_off(light: Light, message: str) -> None:
    status, bits = light.status()
    light.trial.must(
        "output_enabled" not in bits and not drawn(status),
        f"{message} was sent with the output off, and then {_NAME} reported an output that is on",
        rule="tec-current-range",
        cause=Cause(message, "output"),
    )
