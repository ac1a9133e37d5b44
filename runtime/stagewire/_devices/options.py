"""The options of ``open``."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from math import inf
from pathlib import Path
from typing import Any, Final, Literal, TypeAlias, TypedDict

from stagewire._devices.limits import Ceiling
from stagewire._devices.ratings import has_rated
from stagewire._devices.scales import ByStage, settings_of
from stagewire._devices.stated_limits import (
    TOLERANCES,
    by_name,
    ceilings_in,
    positive,
    tolerances_in,
    travels_in,
)
from stagewire._devices.travel import POSITION, Travel
from stagewire._devices.unit import Facts, Unit
from stagewire.errors import BadValueError, UnknownScaleError
from stagewire.quantities import (
    Number,
    Scale,
    ScaleConflict,
    Stage,
    find_stages,
    stages_of,
)

__all__ = ["SETTINGS", "Choices", "Length", "OpenOptions", "check_guest", "choose", "settable"]

SETTINGS: Final = {"maximum_travel": "max_travel_um"}
"""Setting with a keyword of its own in ``open`` -> the keyword."""

Length: TypeAlias = Number | tuple[Number, Number]


class OpenOptions(TypedDict, total=False):
    """The keywords of ``open``, for functions that pass them on. :meth:`Device.open` describes them."""

    stage: Stage | str | None
    scale_source: str | None
    stages: Mapping[Any, Stage | str] | None
    travel_mm: Length | Mapping[Any, Length] | None
    travel_deg: Length | Mapping[Any, Length] | None
    max_velocity_mm_per_s: Number | Mapping[Any, Number] | None
    max_acceleration_mm_per_s2: Number | Mapping[Any, Number] | None
    max_velocity_deg_per_s: Number | Mapping[Any, Number] | None
    max_acceleration_deg_per_s2: Number | Mapping[Any, Number] | None
    target_tolerance_mm: Number | None
    target_tolerance_deg: Number | None
    target_tolerance_counts: int | None
    max_volts: Number | None
    max_travel_um: Number | None
    settings: Mapping[str, Number] | None
    serial_number: int | None
    model: str | None
    address: int | None
    baudrate: int | None
    rtscts: bool | None
    line: Literal["usb", "rs232"]
    timeout: float
    motion_timeout: float
    pacing: float | None
    reconnect_pause: float
    on_close: Literal["stop", "leave"]
    background: bool
    identify: bool
    log: str | Path | None
    refuse_prefix_bytes: bool


@dataclass(frozen=True, slots=True)
class Choices:
    """The options after validation."""

    stages: Mapping[Any, Stage] = field(default_factory=dict)
    chose_stage: bool = False
    scale_source: str | None = None
    travels: Mapping[Any, Travel] = field(default_factory=dict)
    ceilings: Mapping[Any, Mapping[str, Ceiling]] = field(default_factory=dict)
    target_tolerances: Mapping[str, Fraction] = field(default_factory=dict)
    target_tolerance_counts: int | None = None
    max_volts: Fraction | None = None
    max_travel_um: Fraction | None = None
    settings: Mapping[str, Fraction] = field(default_factory=dict)
    serial_number: int | None = None
    model: str | None = None
    address: int | None = None
    baudrate: int | None = None
    rtscts: bool | None = None
    usb: bool = True
    timeout: float = 1.0
    motion_timeout: float = 60.0
    pacing: float | None = None
    reconnect_pause: float = 1.5
    stop_on_close: bool = True
    background: bool = True
    identify: bool = True
    log: str | Path | None = None
    refuse_prefix_bytes: bool = False

    def stage_of(self, name: object) -> Stage | None:
        """Return the stage on a channel, bay or axis."""
        return self.stages.get(name)

    def travel_of(self, name: object) -> Travel | None:
        """Return the travel on a channel, bay or axis."""
        return self.travels.get(name)

    def ceilings_of(self, name: object) -> Mapping[str, Ceiling]:
        """Return the other limits on a channel, bay or axis, by name."""
        return self.ceilings.get(name, {})


def choose(facts: Facts, unit: Unit, names: tuple[Any, ...], given: OpenOptions) -> Choices:
    """Return the choices of a user, validated as far as possible without the controller.

    Options without effect are also refused, because a user who sets a limit relies on it.

    :param names: names of the channels, bays or axes.

    Raise :class:`~stagewire.errors.BadValueError`, and :class:`~stagewire.errors.UnknownScaleError` for a
    stage that is not known on this unit.
    """
    _check_useful(facts, unit, given)
    stage = given.get("stage")
    if stage is None and not given.get("stages"):
        stage = unit.built_in
    named = by_name("stages", given.get("stages"), stage, names)
    stages = {name: _stage(facts, unit, stage) for name, stage in named.items()}
    line = _one_of("line", given["line"], ("usb", "rs232"))
    on_close = _one_of("on_close", given["on_close"], ("stop", "leave"))
    return Choices(
        stages=stages,
        chose_stage=given.get("stage") is not None or bool(given.get("stages")),
        scale_source=_scale_source(
            stages.values() or _reportable(facts, unit), given.get("scale_source")
        ),
        travels=travels_in(given, names),
        ceilings=ceilings_in(given, names),
        target_tolerances=tolerances_in(given),
        target_tolerance_counts=given.get("target_tolerance_counts"),
        max_volts=positive("max_volts", given.get("max_volts"), "V"),
        max_travel_um=positive("max_travel_um", given.get("max_travel_um"), "um"),
        settings=_settings(facts, unit, given.get("settings") or {}),
        serial_number=given.get("serial_number"),
        model=_model(facts, unit, given.get("model")),
        address=given.get("address"),
        baudrate=given.get("baudrate"),
        rtscts=given.get("rtscts"),
        usb=line == "usb",
        timeout=given["timeout"],
        motion_timeout=given["motion_timeout"],
        pacing=given.get("pacing"),
        reconnect_pause=_pause(given["reconnect_pause"]),
        stop_on_close=on_close == "stop",
        background=given["background"],
        identify=given["identify"],
        log=given.get("log"),
        refuse_prefix_bytes=given["refuse_prefix_bytes"],
    )


def check_guest(unit: Unit, given: OpenOptions, owner: str) -> None:
    """Raise an error for a unit that cannot share an open line, and for options of that line.

    :param owner: unit that opened the line, for messages.

    Raise :class:`~stagewire.errors.BadValueError`.
    """
    if unit.kind != "bay":
        raise BadValueError(
            f"a {unit.name} cannot share the line of a {owner}: pass its own URL to open; only modules in "
            "one rack share a line"
        )
    for option in ("baudrate", "rtscts", "pacing", "background", "log"):
        if given.get(option) not in (None, True):
            raise BadValueError(f"{option}: the line was opened by {owner}; set this option there")


def _check_useful(facts: Facts, unit: Unit, given: OpenOptions) -> None:
    """Raise an error for an option that would have no effect on this unit."""
    depended_on = _depended_on(facts, unit)
    for setting, option in SETTINGS.items():
        if given.get(option) is not None and setting not in depended_on:
            raise BadValueError(f"{option}: no value of a {unit.name} depends on it; leave it out")
    if given.get("max_volts") is not None and not has_rated(facts, unit):
        raise BadValueError(
            f"max_volts: a {unit.name} sets no voltage at an actuator; leave it out"
        )
    for option in TOLERANCES.values():
        if given.get(option) is not None and POSITION not in unit.quantities:
            raise BadValueError(f"{option}: a {unit.name} does not report positions; leave it out")
    wanted = given.get("serial_number")
    if wanted is None:
        return
    if isinstance(wanted, bool) or not isinstance(wanted, int):
        raise BadValueError(f"serial_number must be an integer, not {wanted!r}")
    if facts.identity is None or not given["identify"]:
        why = "is not asked for it" if facts.identity else "cannot report it"
        raise BadValueError(
            f"serial_number cannot be checked, because the controller {why}; leave it out"
        )


def _depended_on(facts: Facts, unit: Unit) -> set[str]:
    """Return the settings on which scales of a unit depend."""
    rules = (facts.quantities[quantity] for quantity in unit.quantities)
    return {setting for rule in rules for setting in settings_of(rule)}


def settable(facts: Facts, unit: Unit) -> list[str]:
    """Return the settings of a unit that ``settings`` may contain: numbers without a keyword of their own."""
    wanted = _depended_on(facts, unit) - SETTINGS.keys()
    known = {name: facts.settings[name] for name in wanted if name in facts.settings}
    return sorted(name for name, setting in known.items() if setting.unit)


def _settings(facts: Facts, unit: Unit, given: Mapping[str, object]) -> dict[str, Fraction]:
    """Return the given settings in their units."""
    known = settable(facts, unit)
    found = {}
    for name, value in given.items():
        if name not in known:
            names = f"choose {', '.join(known)}" if known else "no value depends on one"
            raise BadValueError(f"settings: unknown setting {name!r} of a {unit.name} ({names})")
        number = positive(f"settings: {name}", value, facts.settings[name].unit)
        if number is not None:
            found[name] = number
    return found


def _stage(facts: Facts, unit: Unit, stage: Stage | str) -> Stage:
    if isinstance(stage, str):
        found = find_stages(facts.package, stage)
        if not found:
            known = ", ".join(unit.stages) or "none"
            raise UnknownScaleError(
                f"unknown stage {stage} (known on {unit.name}: {known}); use Stage.of_user(...) for others"
            )
        usable = [one for one in found if one.name in unit.stages] or found
        if len(usable) > 1:
            several = ", ".join(f"{one.name} ({one.title})" for one in usable)
            raise BadValueError(
                f"{stage} is the catalogue name of several stages; choose {several}"
            )
        stage = usable[0]
    if not isinstance(stage, Stage):
        raise BadValueError(f"stage must be a Stage or the name of one, not {stage!r}")
    if stage.by_user:
        _check_stage(facts, stage)
    elif stage.name not in unit.stages and not any(
        stage.is_known_on(alias.name) for alias in facts.aliases_of(unit)
    ):
        known = ", ".join(unit.stages) or "none"
        raise UnknownScaleError(
            f"the scales of {stage.name} on {unit.name} are unknown (known stages: {known}); "
            "use Stage.of_user(...) to give its scales yourself"
        )
    return stage


def _reportable(facts: Facts, unit: Unit) -> list[Stage]:
    """Return the stages that a unit can report."""
    return [
        stage
        for stage in stages_of(facts.package)
        if unit.reports_stage is not None and unit.reports_stage.field in stage.ids
    ]


def _scale_source(stages: Iterable[Stage], wanted: object) -> str | None:
    """Return the source of scales; raise an error if no scale of the stages has such a source."""
    if wanted is None:
        return None
    known = {
        source
        for stage in stages
        for scales in stage.scales.values()
        for scale in scales.values()
        if isinstance(scale, ScaleConflict)
        for source in scale.scales
    }
    if not known:
        raise BadValueError(
            "scale_source: no scale of the stage has sources that contradict each other; leave it out"
        )
    return _one_of("scale_source", wanted, tuple(sorted(known)))


def _model(facts: Facts, unit: Unit, model: object) -> str | None:
    """Return the name of a unit or alias that the class opens; ``model`` may be in any case."""
    if model is None:
        return None
    known = {name.upper(): name for name in (unit.name, *(a.name for a in facts.aliases_of(unit)))}
    if not isinstance(model, str) or model.upper() not in known:
        raise BadValueError(
            f"model {model!r} cannot be opened as a {unit.name} (choose {', '.join(known.values())})"
        )
    return known[model.upper()]


def _check_stage(facts: Facts, stage: Stage) -> None:
    """Raise an error for scales of a user that have an unknown quantity or the wrong unit."""
    rules = {name: rule for name, rule in facts.quantities.items() if isinstance(rule, ByStage)}
    for quantity, scale in (
        (quantity, scale) for scales in stage.scales.values() for quantity, scale in scales.items()
    ):
        if quantity not in rules:
            raise BadValueError(
                f"stage {stage.name}: unknown quantity {quantity} (choose {', '.join(rules)})"
            )
        unit = rules[quantity].unit_on(stage)
        if not isinstance(scale, Scale) or scale.unit != unit:
            rotary = "; rotary=True allows scales in degrees" if not stage.rotary else ""
            raise BadValueError(
                f"stage {stage.name}: {quantity} must be a Scale in {unit}, not {scale!r}{rotary}"
            )


def _pause(value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 <= value < inf:
        raise BadValueError(
            f"reconnect_pause must be a number of seconds, 0 or more, not {value!r}"
        )
    return float(value)


def _one_of(option: str, value: object, known: tuple[str, ...]) -> str:
    """Return the known word that ``value`` is in any case."""
    word = value.lower() if isinstance(value, str) else value
    if word not in known:
        raise BadValueError(f"{option} {value!r} is not one of {', '.join(known)}")
    assert isinstance(word, str)
    return word
