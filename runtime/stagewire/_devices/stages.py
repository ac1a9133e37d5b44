"""The stage at each channel, bay or axis of a controller: chosen by the user, reported, or built in."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TypeAlias

from stagewire._devices.options import Choices
from stagewire._devices.travel import POSITION
from stagewire._devices.unit import Unit
from stagewire.errors import UnknownScaleError
from stagewire.quantities import Limit, Scale, Stage, UnknownScale, stages_of

Place: TypeAlias = tuple[int, int | None]
"""Address (or axis) and channel."""

Name: TypeAlias = int | str | tuple[int, int]
"""How a user names a place: channel or bay by number, axis by name, channel in a bay by two numbers."""


@dataclass(frozen=True, slots=True)
class Report:
    """The stage that a controller reported at a place.

    :param id: number of the stage; 0 for none.
    :param message: message with the number.
    :param stage: stage with this number; None if the registry knows none.
    """

    id: int
    message: str
    stage: Stage | None

    def __str__(self) -> str:
        if self.stage is not None:
            return f"{self.stage.name} (id {self.id} in {self.message})"
        if self.id == 0:
            return f"no stage (id 0 in {self.message})"
        return f"the stage id {self.id} in {self.message}, which the registry does not have"


def _differ(one: object, other: object) -> bool:
    """Return whether two limits have different values; an unknown limit differs from none."""
    return isinstance(one, Limit) and isinstance(other, Limit) and one.value != other.value


class Stages:
    """The stages of one device.

    :param package: generated package of the unit.
    :param places: channels, bays or axes that can have a stage -> how the user names them.
    """

    are_known: bool
    """Whether nothing more is learned about the stages: the controller has reported them, or is not asked."""

    def __init__(
        self, package: str, unit: Unit, choices: Choices, places: Mapping[Place, Name]
    ) -> None:
        self._package = package
        self._unit = unit
        self._choices = choices
        self._places = places
        self.forget()

    def forget(self) -> None:
        """Forget what the controller reported."""
        self._reports: dict[Place, Report] = {}
        chosen = all(map(self._chosen, self._places))
        asked = self._unit.reports_stage is not None and self._choices.identify
        self.are_known = chosen or not asked

    def _chosen(self, place: Place) -> Stage | None:
        return self._choices.stage_of(self._places[place])

    def at(self, place: Place) -> Stage | None:
        """Return the stage at a place: that of the user, or else the reported one; None if it is unknown."""
        report = self._reports.get(place)
        return self._chosen(place) or (report.stage if report else None)

    def report(self, place: Place, id: int, controllers: tuple[str, ...]) -> None:
        """Store the number that the controller reported at a place.

        :param controllers: names that the controller may have.
        """
        reports = self._unit.reports_stage
        assert reports is not None
        found = [
            stage
            for stage in stages_of(self._package)
            if stage.ids.get(reports.field) == id
            and any(map(stage.is_known_on, (self._unit.name, *controllers)))
        ]
        self._reports[place] = Report(id, reports.message, found[0] if len(found) == 1 else None)

    def described(self, place: Place) -> str:
        """Return the stage at a place and where it is from, for people."""
        stage, report = self._chosen(place), self._reports.get(place)
        if stage is None:
            if report is None:
                return "no stage"
            if report.stage is None:
                return f"no stage; the controller reports {report}"
            source = f"id {report.id} in {report.message}"
            return f"stage {report.stage.name}, reported by the controller ({source})"
        built_in = stage.name == self._unit.built_in and not self._choices.chose_stage
        whose = "your own" if stage.by_user else "built in" if built_in else "chosen by the user"
        other = report is not None and report.stage not in (None, stage)
        return f"stage {stage.name}, {whose}" + (
            f"; the controller reports {report}" if other else ""
        )

    def contradictions(self) -> Iterator[str]:
        """Yield a warning for each place whose chosen stage moves otherwise than the reported one."""
        for place, report in self._reports.items():
            chosen = self._chosen(place)
            if chosen is None or report.stage is None or chosen.by_user:
                continue
            if self._position(chosen) != self._position(report.stage) or _differ(
                chosen.limits.get("travel"), report.stage.limits.get("travel")
            ):
                yield (
                    f"the controller reports {report}, but {chosen.name} was given and its scales and limits "
                    "are used; check which stage is connected"
                )

    def _position(self, stage: Stage) -> Scale | UnknownScale | None:
        """Return the scale of positions of a stage on the unit; None if it has none."""
        try:
            return stage.scale(POSITION, self._unit.name)
        except UnknownScaleError:
            return None
