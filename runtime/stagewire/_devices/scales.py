"""Conversion between counts and units on one channel, by its stage, unit and settings.

A generated package defines a *rule* for every quantity. The stage and settings of a channel turn the rule
into a scale. Nothing is guessed: if a stage or a setting is unknown, the error names the option to set.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import NamedTuple, NoReturn, TypeAlias

from stagewire.errors import UnknownScaleError
from stagewire.quantities import Scale, ScaleConflict, Stage, UnknownScale

__all__ = ["ByCase", "BySetting", "ByStage", "ByUnit", "Rule", "Scales", "ToldValue", "settings_of"]


@dataclass(frozen=True, slots=True)
class ByStage:
    """The scale depends on the stage and the controller.

    :param rotary_unit: unit on a rotary stage; empty if there is none.
    """

    unit: str
    rotary_unit: str = ""

    def unit_on(self, stage: Stage | None) -> str:
        """Return the unit on a stage."""
        return self.rotary_unit if stage is not None and stage.rotary else self.unit


@dataclass(frozen=True, slots=True)
class BySetting:
    """A full-scale number of counts equals the value of a setting of the controller.

    :param counts: counts that equal the value of the setting.
    """

    setting: str
    counts: int
    unit: str


@dataclass(frozen=True, slots=True)
class ByUnit:
    """The scale depends on the controller.

    :param units: controller -> scale, for those in the document.
    """

    units: Mapping[str, Scale | UnknownScale]
    unit: str


@dataclass(frozen=True, slots=True)
class ByCase:
    """A setting determines what is measured, and so the unit.

    :param ranges: case -> minimum and maximum in counts, for those cases with a range of their own.
    """

    setting: str
    cases: Mapping[str, Scale | UnknownScale | ByStage | BySetting | ByUnit]
    ranges: Mapping[str, tuple[int, int]] = field(default_factory=dict)


class Range(NamedTuple):
    """A range in counts.

    :param condition: the state of the controller in which it applies, for messages; may be empty.
    :param remedy: how to change that state, for messages; may be empty.
    """

    minimum: int
    maximum: int
    condition: str = ""
    remedy: str = ""


Rule: TypeAlias = Scale | UnknownScale | ByStage | BySetting | ByUnit | ByCase


def settings_of(rule: Rule) -> Iterator[str]:
    """Yield the settings that a scale depends on."""
    if isinstance(rule, BySetting):
        yield rule.setting
    elif isinstance(rule, ByCase):
        yield rule.setting
        for one in rule.cases.values():
            yield from settings_of(one)


@dataclass(frozen=True, slots=True)
class ToldValue:
    """The known value of a setting.

    :param value: number in ``unit``, or the name of a case.
    :param unit: empty for a case.
    :param source: origin of the value, for messages.
    """

    value: Fraction | str
    unit: str
    source: str


@dataclass(frozen=True, slots=True, eq=False)
class Scales:
    """The scales of one channel; immutable.

    :param unit: unit of the document whose messages the controller supports.
    :param rules: quantity -> rule.
    :param stage: stage on the channel, if known.
    :param settings: name -> value of the known settings.
    :param ways: setting -> how to make it known, for messages.
    :param writers: setting -> the message that changes it, for messages.
    :param stages: names of the stages that the document lists for the controller.
    :param names: units and aliases that the controller may be; their scales are used. Empty: only ``unit``.
    :param source_of_scales: source that the user chose for scales whose sources contradict each other.
    """

    unit: str
    rules: Mapping[str, Rule]
    stage: Stage | None = None
    settings: Mapping[str, ToldValue] = field(default_factory=dict)
    ways: Mapping[str, str] = field(default_factory=dict)
    writers: Mapping[str, str] = field(default_factory=dict)
    stages: tuple[str, ...] = ()
    names: tuple[str, ...] = ()
    source_of_scales: str | None = None

    @property
    def controllers(self) -> tuple[str, ...]:
        """The names that the controller may have."""
        return self.names or (self.unit,)

    @property
    def controller(self) -> str:
        """The names that the controller may have, for messages."""
        return " or ".join(self.controllers)

    def told(self, setting: str, value: ToldValue) -> Scales:
        """Return the scales with a new value of a setting."""
        return replace(self, settings={**self.settings, setting: value})

    def of(self, quantity: str, unit: str, case: str | None = None) -> Scale:
        """Return the scale of a quantity in ``unit``, in ``case`` if the unit depends on a setting.

        Raise :class:`~stagewire.errors.UnknownScaleError` if it is unknown or currently in another unit.
        """
        rule = self.rules[quantity]
        if isinstance(rule, ByCase):
            now = self._case(rule, quantity, unit, case)
            chosen = rule.cases.get(now)
            if chosen is None or _unit_of(chosen) != unit or case not in (None, now):
                other = f"in {_unit_of(chosen)}" if chosen is not None else "without a unit"
                raise UnknownScaleError(
                    f"{quantity} is {other}, not in {unit}, while {rule.setting} is {now}"
                )
            rule = chosen
        if self.unit_instead(quantity, unit):
            raise UnknownScaleError(self.other_unit(quantity, unit))
        scale = self._apply(rule, quantity)
        if isinstance(scale, UnknownScale):
            sources = tuple(scale.scales) if isinstance(scale, ScaleConflict) else ()
            self._refuse(quantity, unit, scale.reason, sources)
        if scale.unit != unit:
            raise UnknownScaleError(
                f"the scale of {quantity} is in {scale.unit}, but {unit} is required; "
                f"source of the scale: {self.source(quantity, scale)}"
            )
        return scale

    def range_of(self, quantity: str, minimum: int, maximum: int, case: str | None = None) -> Range:
        """Return the range of a value now, if a setting decides on it; else the given one of its field.

        :param case: case that the caller implies, if the setting is unknown.
        """
        rule = self.rules.get(quantity)
        if isinstance(rule, ByCase) and rule.ranges:
            told = self.settings.get(rule.setting)
            now = str(told.value) if told is not None else case or ""
            if now in rule.ranges:
                writer = self.writers.get(rule.setting)
                remedy = f"; to change {rule.setting}, send {writer} first" if writer else ""
                low, high = rule.ranges[now]
                ends = max(low, minimum), min(high, maximum)
                return Range(*ends, f" while {rule.setting} is {now}", remedy)
        return Range(minimum, maximum)

    def _apply(
        self, rule: Scale | UnknownScale | ByStage | BySetting | ByUnit, quantity: str
    ) -> Scale | UnknownScale:
        if isinstance(rule, ByStage):
            if self.stage is None:
                known = f" (the document lists {', '.join(self.stages)})" if self.stages else ""
                way = f"pass stage={known} or stage=Stage.of_user(...) to open"
                return UnknownScale(rule.unit, f"it depends on the stage; {way}")
            stage, unit = self.stage, rule.unit_on(self.stage)
            return self._agreed(unit, lambda name: self._of_stage(stage, quantity, name, unit))
        if isinstance(rule, ByUnit):
            unknown = UnknownScale(
                rule.unit, f"the document does not state it for {self.controller}"
            )
            return self._agreed(rule.unit, lambda name: rule.units.get(name, unknown))
        if isinstance(rule, BySetting):
            told = self.settings.get(rule.setting)
            if told is None:
                return self._untold(rule.setting, rule.unit)
            if not isinstance(told.value, Fraction) or told.value <= 0:
                return UnknownScale(rule.unit, f"{rule.setting} is {told.value}")
            return Scale(rule.counts / told.value, rule.unit)
        return rule

    def _of_stage(self, stage: Stage, quantity: str, name: str, unit: str) -> Scale | UnknownScale:
        """Return the scale of a stage on a controller, from the source that the user chose."""
        scale = _of_stage(stage, quantity, name, unit)
        if isinstance(scale, ScaleConflict):
            return scale.scales.get(self.source_of_scales or "", scale)
        return scale

    def _agreed(
        self, unit: str, scale_on: Callable[[str], Scale | UnknownScale]
    ) -> Scale | UnknownScale:
        """Return the scale if all units that the controller may be have the same one."""
        found = {name: scale_on(name) for name in self.names or (self.unit,)}
        first, *others = found.values()
        if all(scale == first for scale in others):
            return first
        figures = ", ".join(f"{name}: {_shown(scale)}" for name, scale in found.items())
        return UnknownScale(
            unit,
            f"it differs ({figures}), and serial number and model do not show which of these it is; "
            "pass model= or stage=Stage.of_user(...) to open",
        )

    def _case(self, rule: ByCase, quantity: str, unit: str, case: str | None) -> str:
        """Return the current case; if it is unknown, the case that the caller implies."""
        told = self.settings.get(rule.setting)
        if told is not None:
            return str(told.value)
        if case is None:
            self._refuse(quantity, unit, self._untold(rule.setting, unit).reason)
        return case

    def _untold(self, setting: str, unit: str) -> UnknownScale:
        way = self.ways.get(setting)
        unknown = f"is unknown; {way}" if way else "the controller does not report"
        return UnknownScale(unit, f"it depends on {setting}, which {unknown}")

    def _refuse(
        self, quantity: str, unit: str, reason: str, sources: tuple[str, ...] = ()
    ) -> NoReturn:
        raise UnknownScaleError(
            f"the scale of {quantity} in {unit} on {self.controller} is unknown: {reason}; "
            "raw counts need no scale",
            sources=sources,
        )

    def unit_of(self, quantity: str) -> str:
        """Return the unit of a quantity on the stage; empty if it depends on a setting."""
        rule = self.rules[quantity]
        return rule.unit_on(self.stage) if isinstance(rule, ByStage) else _unit_of(rule)

    def units_of(self, quantity: str) -> tuple[str, ...]:
        """Return the units that a quantity may have: two if it depends on a stage that is unknown."""
        rule = self.rules[quantity]
        if self.stage is None and isinstance(rule, ByStage) and rule.rotary_unit:
            return rule.unit, rule.rotary_unit
        return (self.unit_of(quantity),)

    def unit_instead(self, quantity: str, unit: str) -> str:
        """Return the unit of a quantity on the stage if ``unit`` is for stages of the other kind; else empty.

        Stages are rotary or linear.
        """
        rule = self.rules[quantity]
        if self.stage is None or not isinstance(rule, ByStage):
            return ""
        right = rule.unit_on(self.stage)
        return right if unit != right and unit in (rule.unit, rule.rotary_unit) else ""

    def by_setting(self, quantity: str) -> bool:
        """Return whether the scale of a quantity depends on a setting."""
        return any(settings_of(self.rules[quantity]))

    # For people

    def other_unit(self, quantity: str, unit: str) -> str:
        """Return why a quantity is not in ``unit`` on a stage of the other kind."""
        assert self.stage is not None
        kind = "rotary" if self.stage.rotary else "linear"
        return (
            f"{self.stage.name} is a {kind} stage: {quantity} is in {self.unit_instead(quantity, unit)}, "
            f"not in {unit}"
        )

    def source(self, quantity: str, scale: Scale) -> str:
        """Return where the scale of a quantity comes from."""
        rule, case = self.rules[quantity], ""
        if isinstance(rule, ByCase) and (told := self.settings.get(rule.setting)) is not None:
            case = f"; {rule.setting} is {told.value}"
            rule = rule.cases[str(told.value)]
        if isinstance(rule, ByStage) and self.stage is not None:
            if self.stage.by_user:
                return f"{self.stage.name}, your own stage"
            return f"{self.stage.name}, {scale.source or f'page {self.stage.page} of the document'}"
        if isinstance(rule, BySetting) and rule.setting in self.settings:
            told = self.settings[rule.setting]
            return f"{rule.setting} {_number(told.value)} {told.unit}, {told.source}{case}"
        return f"{scale.source or 'the document'}{case}"

    def described(self, quantities: Iterable[str]) -> Iterator[str]:
        """Yield a line for each quantity: counts per unit, and the source of the scale.

        Quantities without a scale for the same reason share a line. Quantities that need no conversion are
        left out.
        """
        unknown: dict[str, list[str]] = {}
        for quantity in quantities:
            scale = self._now(quantity)
            if isinstance(scale, UnknownScale):
                unknown.setdefault(scale.reason, []).append(quantity)
            elif scale.counts_per_unit != 1 or not isinstance(self.rules[quantity], Scale):
                factor = _number(scale.counts_per_unit)
                yield f"{quantity}: {factor} counts per {scale.unit} ({self.source(quantity, scale)})"
        for reason, names in unknown.items():
            yield f"{', '.join(names)} in raw counts only: {reason}"

    def _now(self, quantity: str) -> Scale | UnknownScale:
        """Return the current scale, or why it is unknown."""
        rule = self.rules[quantity]
        if isinstance(rule, ByCase):
            told = self.settings.get(rule.setting)
            if told is None:
                return self._untold(rule.setting, "")
            rule = rule.cases.get(
                str(told.value), UnknownScale("", f"{rule.setting} is {told.value}")
            )
        return self._apply(rule, quantity)


def _of_stage(stage: Stage, quantity: str, name: str, unit: str) -> Scale | UnknownScale:
    """Return the scale of a stage on a controller, or why it is unknown."""
    try:
        return stage.scale(quantity, name)
    except UnknownScaleError:
        pass
    if stage.by_user:
        return UnknownScale(unit, f"{stage.name} was created without it")
    if stage.is_known_on(name):
        return UnknownScale(unit, f"the registry does not state it for {stage.name} on {name}")
    return UnknownScale(
        unit,
        f"the registry has no scales of {stage.name} on {name}; pass stage=Stage.of_user(...) to open",
    )


def _shown(scale: Scale | UnknownScale) -> str:
    if isinstance(scale, UnknownScale):
        return "unknown"
    return f"{_number(scale.counts_per_unit)} counts per {scale.unit}"


def _unit_of(rule: Rule) -> str:
    return "" if isinstance(rule, ByCase) else rule.unit


def _number(value: Fraction | str) -> str:
    """Format a number as an integer, or as a decimal with at most ten digits."""
    if isinstance(value, str) or value.denominator == 1:
        return str(value)
    return f"{float(value):.10g}"
