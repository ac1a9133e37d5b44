"""What a user may say when a device is opened."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from importlib import import_module
from math import inf
from pathlib import Path
from typing import Any, Final, Literal, TypeAlias, TypedDict

from stagewire._devices.arguments import in_unit
from stagewire._devices.limits import CEILINGS, POSITION, Travel, parse_travel
from stagewire._devices.scales import ByStage, settings_of
from stagewire._devices.unit import Facts, Unit
from stagewire.errors import BadValueError, UnknownScaleError
from stagewire.quantities import Number, Scale, Stage, exact

__all__ = ["SETTINGS", "Choices", "OpenOptions", "check_guest", "choose"]

SETTINGS: Final = {"maximum_volts": "max_volts", "maximum_travel": "max_travel_um"}
"""Settings that may be given when a device is opened, and the keywords for it."""

_TOLERANCES: Final = ("target_tolerance_mm", "target_tolerance_counts")

Length: TypeAlias = Number | tuple[Number, Number]


class OpenOptions(TypedDict, total=False):
    """The keywords of ``open``; all may be left out."""

    stage: Stage | str | None
    """What stands on every channel, by itself or by its name in the registry; it decides on the scales.
    Without it there are raw counts only."""
    stages: Mapping[Any, Stage | str] | None
    """Where channels differ: number of the channel or bay, or name of the axis -> stage."""
    travel_mm: Length | Mapping[Any, Length] | None
    """Where the stage can go: from 0 to this, or ``(low, high)``; or by channel as ``stages``. Targets
    outside are refused. Without it the length of the travel that the stage has in the registry is the limit,
    where that is known."""
    max_velocity_mm_per_s: Number | Mapping[Any, Number] | None
    """The highest velocity that may be set; or by channel as ``stages``. It replaces the limit that the stage
    has in the registry, and may be higher."""
    max_acceleration_mm_per_s2: Number | Mapping[Any, Number] | None
    """The highest acceleration, likewise."""
    target_tolerance_mm: Number | None
    """How far from its target a motion may end, on every channel whose scale is known; further away raises
    :class:`~stagewire.errors.TargetNotReachedError`. 0.01 mm when nothing is said, and 500 counts where no
    scale is known."""
    target_tolerance_counts: int | None
    """The same in counts, whatever is known; give one of the two."""
    max_volts: Number | None
    """The maximum output voltage, where the controller is not asked for it or does not say it."""
    max_travel_um: Number | None
    """The travel of the actuator, likewise."""
    serial_number: int | None
    """That of the controller; another one is refused."""
    model: str | None
    """Name of the controller, where it is newer than the document: ``BSC203`` for one that is opened as
    ``BSC103``. Its scales hold, and another controller is refused. Without it, serial number and reported
    model decide which it is."""
    address: int | None
    """That of the controller, where it is not the one of the document."""
    baudrate: int | None
    """Of a serial port; None: 115200, and 9600 where commands have no frame."""
    rtscts: bool | None
    """Hardware handshake; None: as the port asks."""
    line: Literal["usb", "rs232"]
    """On USB, the default, a controller needs keep-alive messages."""
    timeout: float
    """Seconds that a call may last; 1.0 when nothing is said."""
    motion_timeout: float
    """Seconds that a motion may last; 60.0 when nothing is said."""
    pacing: float | None
    """Seconds after what has no reply; None: as the unit needs it."""
    reconnect_pause: float
    """Seconds that ``reconnect()`` lets pass after a line was lost before it sends anything: longer than the
    controller waits for the rest of a message; 1.5 when nothing is said."""
    on_close: Literal["stop", "leave"]
    """What becomes of motion that was started here when the device is closed or the program ends; it is
    stopped when nothing is said."""
    background: bool
    """Whether a thread reads and keeps the controller alive, as when nothing is said; never in asyncio."""
    identify: bool
    """Whether the controller is asked what it is, and for the settings that its scales need. Without asking,
    the scales are those of ``model``, or else those of the class."""
    log: str | Path | None
    """A file for a capture of both directions."""
    refuse_prefix_bytes: bool
    """Whether a value is refused whose bytes look like a setup command (protocols of commands)."""


@dataclass(frozen=True, slots=True)
class Choices:
    """The same, checked."""

    stages: Mapping[Any, Stage] = field(default_factory=dict)
    travels: Mapping[Any, Travel] = field(default_factory=dict)
    ceilings: Mapping[str, Mapping[Any, Fraction]] = field(default_factory=dict)
    target_tolerance_mm: Fraction | None = None
    target_tolerance_counts: int | None = None
    max_volts: Fraction | None = None
    max_travel_um: Fraction | None = None
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
        """Return what stands on a channel, bay or axis."""
        return self.stages.get(name)

    def travel_of(self, name: object) -> Travel | None:
        """Return the travel there."""
        return self.travels.get(name)

    def ceilings_of(self, name: object) -> dict[str, Fraction]:
        """Return the other limits stated there, by name."""
        return {limit: values[name] for limit, values in self.ceilings.items() if name in values}


def choose(facts: Facts, unit: Unit, names: tuple[Any, ...], given: OpenOptions) -> Choices:
    """Return the choices of a user, checked as far as they can be without the controller.

    :param names: how channels, bays or axes are called.

    What would have no effect is refused, too: who gives a limit relies on it.

    Raises :class:`~stagewire.errors.BadValueError`, and :class:`~stagewire.errors.UnknownScaleError` for a
    stage that is not known on this unit.
    """
    unknown = given.keys() - OpenOptions.__annotations__.keys()
    if unknown:
        known = ", ".join(OpenOptions.__annotations__)
        raise BadValueError(f"open has no option {', '.join(sorted(unknown))} (there are: {known})")
    _check_useful(facts, unit, given)
    stages = _by_name("stages", given.get("stages"), given.get("stage"), names)
    travels = _one_or_several("travel_mm", given.get("travel_mm"), names)
    line = _one_of("line", given.get("line", "usb"), ("usb", "rs232"))
    on_close = _one_of("on_close", given.get("on_close", "stop"), ("stop", "leave"))
    return Choices(
        stages={name: _stage(facts, unit, stage) for name, stage in stages.items()},
        travels={name: parse_travel(length) for name, length in travels.items()},
        ceilings={
            limit: _ceiling(option, given.get(option), unit_of_limit, names)
            for limit, (_, option, unit_of_limit) in CEILINGS.items()
        },
        target_tolerance_mm=_tolerance(given),
        target_tolerance_counts=given.get("target_tolerance_counts"),
        max_volts=_setting("max_volts", given.get("max_volts"), "V"),
        max_travel_um=_setting("max_travel_um", given.get("max_travel_um"), "um"),
        serial_number=given.get("serial_number"),
        model=_model(facts, unit, given.get("model")),
        address=given.get("address"),
        baudrate=given.get("baudrate"),
        rtscts=given.get("rtscts"),
        usb=line == "usb",
        timeout=given.get("timeout", 1.0),
        motion_timeout=given.get("motion_timeout", 60.0),
        pacing=given.get("pacing"),
        reconnect_pause=_pause(given.get("reconnect_pause", 1.5)),
        stop_on_close=on_close == "stop",
        background=given.get("background", True),
        identify=given.get("identify", True),
        log=given.get("log"),
        refuse_prefix_bytes=given.get("refuse_prefix_bytes", False),
    )


def check_guest(unit: Unit, given: OpenOptions, owner: str) -> None:
    """Raise for what cannot share a line that is open already, and for options about that line.

    :param owner: of the line, for people.

    Raises :class:`~stagewire.errors.BadValueError`.
    """
    if unit.kind != "bay":
        raise BadValueError(
            f"a {unit.name} has a line of its own: open takes its URL, and not a {owner}; modules of one "
            "rack share a line"
        )
    for option in ("baudrate", "rtscts", "pacing", "background", "log"):
        if option in given:
            raise BadValueError(
                f"{option}: the line is that of {owner}, which has one; give it there"
            )


def _check_useful(facts: Facts, unit: Unit, given: OpenOptions) -> None:
    """Raise for an option that would be without effect on this unit."""
    depended_on = {
        setting
        for quantity in unit.quantities
        for setting in settings_of(facts.quantities[quantity])
    }
    for setting, option in SETTINGS.items():
        if given.get(option) is not None and setting not in depended_on:
            raise BadValueError(
                f"{option}: no value of a {unit.name} depends on it, and it would limit nothing; leave it out"
            )
    for option in _TOLERANCES:
        if given.get(option) is not None and POSITION not in unit.quantities:
            raise BadValueError(
                f"{option}: a {unit.name} has no position that a motion could miss; leave it out"
            )
    wanted = given.get("serial_number")
    if wanted is None:
        return
    if isinstance(wanted, bool) or not isinstance(wanted, int):
        raise BadValueError(f"serial_number takes a whole number, not {wanted!r}")
    if facts.identity is None or not given.get("identify", True):
        why = "is not asked for its own" if facts.identity else "has no message that tells its own"
        raise BadValueError(
            f"serial_number: the controller {why}, and another one would not be noticed; leave it out"
        )


def _by_name(
    option: str, several: Mapping[Any, Any] | None, one: Any, names: tuple[Any, ...]
) -> dict[Any, Any]:
    """Return what holds for each name: the one of it, or else the one for all."""
    chosen = {} if one is None else dict.fromkeys(names, one)
    if not isinstance(several or {}, Mapping):
        raise BadValueError(
            f"{option} takes a dictionary, such as {{{names[0]!r}: …}}, not {several!r}"
        )
    for name, value in (several or {}).items():
        name = name.upper() if isinstance(name, str) else name
        if name not in names:
            there = ", ".join(map(str, names))
            raise BadValueError(f"{option}: there is no {name!r} (there are: {there})")
        chosen[name] = value
    return chosen


def _one_or_several(option: str, value: object, names: tuple[Any, ...]) -> dict[Any, Any]:
    """Return what holds for each name, where one value or a dictionary was given."""
    several = value if isinstance(value, Mapping) else None
    return _by_name(option, several, None if several is not None else value, names)


def _ceiling(option: str, value: object, unit: str, names: tuple[Any, ...]) -> dict[Any, Fraction]:
    numbers = {
        name: _setting(option, number, unit)
        for name, number in _one_or_several(option, value, names).items()
    }
    return {name: number for name, number in numbers.items() if number is not None}


def _stage(facts: Facts, unit: Unit, stage: Stage | str) -> Stage:
    if isinstance(stage, str):
        found = getattr(import_module(f"{facts.package}.stages"), stage.upper(), None)
        if not isinstance(found, Stage):
            known = ", ".join(unit.stages) or "none"
            raise UnknownScaleError(
                f"no stage {stage} is known (known on {unit.name}: {known}); Stage.of_user(...) makes another"
            )
        stage = found
    if not isinstance(stage, Stage):
        raise BadValueError(f"stage takes a stage or the name of one, not {stage!r}")
    if stage.by_user:
        _check_stage(facts, stage)
    elif stage.name not in unit.stages and not any(
        stage.is_known_on(alias.name) for alias in facts.aliases_of(unit)
    ):
        known = ", ".join(unit.stages) or "none"
        raise UnknownScaleError(
            f"{stage.name} is not known on {unit.name} (known there: {known}): a scale belongs to a stage "
            "on a controller; Stage.of_user(...) makes one with scales of yours"
        )
    return stage


def _model(facts: Facts, unit: Unit, model: object) -> str | None:
    """Return the name of a unit or alias that the class opens, given in any case."""
    if model is None:
        return None
    known = {name.upper(): name for name in (unit.name, *(a.name for a in facts.aliases_of(unit)))}
    if not isinstance(model, str) or model.upper() not in known:
        raise BadValueError(
            f"model: {model!r} is not opened as a {unit.name} (choose {', '.join(known.values())})"
        )
    return known[model.upper()]


def _check_stage(facts: Facts, stage: Stage) -> None:
    """Raise for scales of a user that would never be used, or not as they are meant."""
    units = {
        name: rule.unit for name, rule in facts.quantities.items() if isinstance(rule, ByStage)
    }
    for quantity, scale in (
        (quantity, scale) for scales in stage.scales.values() for quantity, scale in scales.items()
    ):
        if quantity not in units:
            raise BadValueError(
                f"stage {stage.name}: there is no quantity {quantity} of a stage "
                f"(there are: {', '.join(units)})"
            )
        if not isinstance(scale, Scale) or scale.unit != units[quantity]:
            raise BadValueError(
                f"stage {stage.name}: {quantity} takes a Scale in {units[quantity]}, not {scale!r}"
            )


def _setting(keyword: str, value: object, unit: str) -> Fraction | None:
    if value is None:
        return None
    number = exact(in_unit(value, unit, keyword))
    if number <= 0:
        raise BadValueError(f"{keyword} takes a number above 0, not {value}")
    return number


def _pause(value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 <= value < inf:
        raise BadValueError(f"reconnect_pause takes seconds, 0 or more, not {value!r}")
    return float(value)


def _tolerance(given: OpenOptions) -> Fraction | None:
    """Return the tolerance in mm; check the one in counts."""
    mm, counts = given.get("target_tolerance_mm"), given.get("target_tolerance_counts")
    if mm is not None and counts is not None:
        raise BadValueError(f"{' and '.join(_TOLERANCES)} are the same limit; give one of them")
    if counts is not None and (
        isinstance(counts, bool) or not isinstance(counts, int) or counts < 0
    ):
        raise BadValueError(
            f"target_tolerance_counts takes a whole number from 0 on, not {counts!r}"
        )
    if mm is None:
        return None
    number = exact(in_unit(mm, "mm", "target_tolerance_mm"))
    if number < 0:
        raise BadValueError(f"target_tolerance_mm takes a number from 0 on, not {mm}")
    return number


def _one_of(option: str, value: object, known: tuple[str, ...]) -> str:
    """Return one of the known words, which may be given in any case."""
    word = value.lower() if isinstance(value, str) else value
    if word not in known:
        raise BadValueError(f"{option} {value!r} is not one of {', '.join(known)}")
    assert isinstance(word, str)
    return word
