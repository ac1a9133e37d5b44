"""How counts become units on one channel of one controller: by its stage, its unit and its settings.

A generated package gives a *rule* for every quantity; a channel gives what the rules ask for. Nothing is
guessed: where a stage or a setting is not known, the error says what to give.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import NoReturn, TypeAlias

from stagewire.errors import UnknownScaleError
from stagewire.quantities import Scale, Stage, UnknownScale

__all__ = ["ByCase", "BySetting", "ByStage", "ByUnit", "Rule", "Scales", "ToldValue", "settings_of"]


@dataclass(frozen=True, slots=True)
class ByStage:
    """The stage on the controller decides."""

    unit: str


@dataclass(frozen=True, slots=True)
class BySetting:
    """A count is a share of a setting of the controller.

    :param counts: those that stand for the whole setting.
    """

    setting: str
    counts: int
    unit: str


@dataclass(frozen=True, slots=True)
class ByUnit:
    """The controller decides.

    :param units: the controllers for which the document gives a scale.
    """

    units: Mapping[str, Scale | UnknownScale]
    unit: str


@dataclass(frozen=True, slots=True)
class ByCase:
    """A setting decides what is measured, and so the unit."""

    setting: str
    cases: Mapping[str, Scale | UnknownScale | ByStage | BySetting | ByUnit]


Rule: TypeAlias = Scale | UnknownScale | ByStage | BySetting | ByUnit | ByCase


def settings_of(rule: Rule) -> Iterator[str]:
    """Give the settings that a scale depends on."""
    if isinstance(rule, BySetting):
        yield rule.setting
    elif isinstance(rule, ByCase):
        yield rule.setting
        for one in rule.cases.values():
            yield from settings_of(one)


@dataclass(frozen=True, slots=True)
class ToldValue:
    """A setting as it is known.

    :param value: in its unit; or the name of a case.
    :param unit: empty for a case.
    :param source: who told it, for people.
    """

    value: Fraction | str
    unit: str
    source: str


@dataclass(frozen=True, slots=True, eq=False)
class Scales:
    """The scales of one channel; never changed: what is told later makes others.

    :param unit: the unit of the document whose messages the controller takes.
    :param rules: quantity -> rule.
    :param stage: what stands on the channel, if that is known.
    :param settings: name -> value, of those that are known.
    :param ways: setting -> how it is made known, for errors.
    :param stages: the names of the stages that the document knows on the controller.
    :param names: what the controller is, or may be where that is not certain: units and aliases, whose
        scales count. Empty: the unit.
    """

    unit: str
    rules: Mapping[str, Rule]
    stage: Stage | None = None
    settings: Mapping[str, ToldValue] = field(default_factory=dict)
    ways: Mapping[str, str] = field(default_factory=dict)
    stages: tuple[str, ...] = ()
    names: tuple[str, ...] = ()

    @property
    def controller(self) -> str:
        """What the controller is, or may be, for people."""
        return " or ".join(self.names or (self.unit,))

    def told(self, setting: str, value: ToldValue) -> Scales:
        """Return the scales that hold now that a setting is known."""
        return replace(self, settings={**self.settings, setting: value})

    def of(self, quantity: str, unit: str, case: str | None = None) -> Scale:
        """Return the scale of a quantity in ``unit``; in a certain case, where a setting decides.

        Raises :class:`~stagewire.errors.UnknownScaleError` where it is not known, or not in this unit now.
        """
        rule = self.rules[quantity]
        if isinstance(rule, ByCase):
            now = self._case(rule, quantity, unit, case)
            chosen = rule.cases.get(now)
            if chosen is None or _unit_of(chosen) != unit or case not in (None, now):
                other = f"in {_unit_of(chosen)}" if chosen is not None else "without a unit"
                raise UnknownScaleError(
                    f"{quantity} is {other} and not in {unit} while {rule.setting} is {now}"
                )
            rule = chosen
        scale = self._apply(rule, quantity)
        if isinstance(scale, UnknownScale):
            self._refuse(quantity, unit, scale.reason)
        if scale.unit != unit:
            raise UnknownScaleError(
                f"the scale of {quantity} is in {scale.unit}, and {unit} is needed; see its source: "
                f"{self.source(quantity, scale)}"
            )
        return scale

    def _apply(
        self, rule: Scale | UnknownScale | ByStage | BySetting | ByUnit, quantity: str
    ) -> Scale | UnknownScale:
        if isinstance(rule, ByStage):
            if self.stage is None:
                known = f"(the document has {', '.join(self.stages)}) " if self.stages else ""
                way = f"give stage= {known}or Stage.of_user(...) when you open it"
                return UnknownScale(rule.unit, f"it depends on the stage; {way}")
            stage = self.stage
            return self._agreed(rule.unit, lambda name: _of_stage(stage, quantity, name, rule.unit))
        if isinstance(rule, ByUnit):
            unknown = UnknownScale(rule.unit, f"the document gives none for {self.controller}")
            return self._agreed(rule.unit, lambda name: rule.units.get(name, unknown))
        if isinstance(rule, BySetting):
            told = self.settings.get(rule.setting)
            if told is None:
                return self._untold(rule.setting, rule.unit)
            if not isinstance(told.value, Fraction) or told.value <= 0:
                return UnknownScale(rule.unit, f"{rule.setting} is {told.value}")
            return Scale(rule.counts / told.value, rule.unit)
        return rule

    def _agreed(
        self, unit: str, scale_on: Callable[[str], Scale | UnknownScale]
    ) -> Scale | UnknownScale:
        """Return the scale on the controller, if it is the same on everything that the controller may be."""
        found = {name: scale_on(name) for name in self.names or (self.unit,)}
        first, *others = found.values()
        if all(scale == first for scale in others):
            return first
        figures = ", ".join(f"{name}: {_shown(scale)}" for name, scale in found.items())
        return UnknownScale(
            unit,
            f"it differs ({figures}), and neither serial number nor model tell which of them this is; "
            "give model= when you open it, or Stage.of_user(...) as stage=",
        )

    def _case(self, rule: ByCase, quantity: str, unit: str, case: str | None) -> str:
        """Return the case that holds; where it is not known, what a user says by writing it."""
        told = self.settings.get(rule.setting)
        if told is not None:
            return str(told.value)
        if case is None:
            self._refuse(quantity, unit, self._untold(rule.setting, unit).reason)
        return case

    def _untold(self, setting: str, unit: str) -> UnknownScale:
        way = self.ways.get(setting)
        unknown = f"is not known; {way}" if way else "nothing tells"
        return UnknownScale(unit, f"it depends on {setting}, which {unknown}")

    def _refuse(self, quantity: str, unit: str, reason: str) -> NoReturn:
        raise UnknownScaleError(
            f"no scale of {quantity} in {unit} is known on {self.controller}: {reason}; raw counts need none"
        )

    def unit_of(self, quantity: str) -> str:
        """Return the unit of a quantity; empty where a setting decides on it."""
        return _unit_of(self.rules[quantity])

    # For people

    def source(self, quantity: str, scale: Scale) -> str:
        """Say where the scale of a quantity comes from."""
        rule, case = self.rules[quantity], ""
        if isinstance(rule, ByCase) and (told := self.settings.get(rule.setting)) is not None:
            case = f"; {rule.setting} is {told.value}"
            rule = rule.cases[str(told.value)]
        if isinstance(rule, ByStage) and self.stage is not None:
            if self.stage.by_user:
                return f"{self.stage.name}, a stage of yours"
            return f"{self.stage.name}, {scale.source or f'page {self.stage.page} of the document'}"
        if isinstance(rule, BySetting) and rule.setting in self.settings:
            told = self.settings[rule.setting]
            return f"{rule.setting} {_number(told.value)} {told.unit}, {told.source}{case}"
        return f"{scale.source or 'the document'}{case}"

    def described(self, quantities: Iterable[str]) -> Iterator[str]:
        """Say how many counts make one unit of each quantity, and where that comes from.

        Those that have no scale for the same reason are said together. Left out is what a document gives in
        its unit, so that there is nothing to convert.
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
            yield f"{', '.join(names)} in counts only: {reason}"

    def _now(self, quantity: str) -> Scale | UnknownScale:
        """Return the scale that holds now, or why there is none."""
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
    """Return the scale of a stage on a controller, or why there is none."""
    try:
        return stage.scale(quantity, name)
    except UnknownScaleError:
        pass
    if stage.by_user:
        return UnknownScale(unit, f"{stage.name} was given none")
    if stage.is_known_on(name):
        return UnknownScale(unit, f"{stage.name} has no such scale on {name}")
    return UnknownScale(
        unit,
        f"{stage.name} has no scales on {name}; give Stage.of_user(...) with scales of yours as stage=",
    )


def _shown(scale: Scale | UnknownScale) -> str:
    if isinstance(scale, UnknownScale):
        return "unknown"
    return f"{_number(scale.counts_per_unit)} counts per {scale.unit}"


def _unit_of(rule: Rule) -> str:
    return "" if isinstance(rule, ByCase) else rule.unit


def _number(value: Fraction | str) -> str:
    """Write a number as people do: whole, or as a decimal of ten places at most."""
    if isinstance(value, str) or value.denominator == 1:
        return str(value)
    return f"{float(value):.10g}"
