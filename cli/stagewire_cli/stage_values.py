"""Values in the units of a stage, for decoded messages."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from stagewire.errors import UnknownScaleError
from stagewire.quantities import Scale, ScaleConflict, Stage
from stagewire_cli.errors import CalledWronglyError

Json = dict[str, Any]


@dataclass(frozen=True)
class StageValues:
    """Converts the fields whose scale depends on the stage.

    :param stage: the stage on all channels.
    :param unit: the controller; None if unknown, which requires that the scales on all controllers agree.
    :param source: the source to use if sources contradict each other.
    """

    stage: Stage
    unit: str | None = None
    source: str | None = None
    _known: dict[str, Scale | None] = field(default_factory=dict)

    def check(self) -> None:
        """Raise :class:`CalledWronglyError` if no position can be converted."""
        on = f" on {self.unit}" if self.unit else ""
        try:
            found = self._scales("position")
        except UnknownScaleError as error:
            raise CalledWronglyError(f"--stage: {error}") from None
        for scale in found.values():
            if isinstance(scale, ScaleConflict) and self.source not in scale.scales:
                sources = " or ".join(f"--scale-source {source}" for source in scale.scales)
                raise CalledWronglyError(
                    f"--stage: sources contradict each other on the scales of {self.stage.name}{on}; "
                    f"use {sources}"
                )
        if self.scale("position") is None:
            known = ", ".join(sorted(filter(None, found))) or "none"
            raise CalledWronglyError(
                f"--stage: the scales of {self.stage.name} depend on the controller; name it with --unit "
                f"(known on: {known})"
                if not self.unit
                else f"--stage: the scale of positions of {self.stage.name}{on} is unknown"
            )

    def scale(self, quantity: str) -> Scale | None:
        """Return the scale of a quantity; None if it is unknown or depends on an unknown controller."""
        if quantity not in self._known:
            try:
                found = [*self._scales(quantity).values()]
            except UnknownScaleError:
                found = []
            first, *others = [self._chosen(scale) for scale in found] or [None]
            agree = isinstance(first, Scale) and all(
                isinstance(scale, Scale) and scale.counts_per_unit == first.counts_per_unit
                for scale in others
            )
            self._known[quantity] = first if agree and isinstance(first, Scale) else None
        return self._known[quantity]

    def _scales(self, quantity: str) -> dict[str, object]:
        """Return the scale of a quantity by controller."""
        if self.unit is not None:
            return {self.unit: self.stage.scale(quantity, self.unit)}
        return {
            family: scales[quantity]
            for family, scales in self.stage.scales.items()
            if quantity in scales
        }

    def _chosen(self, scale: object) -> object:
        return scale.scales.get(self.source or "") if isinstance(scale, ScaleConflict) else scale

    def of_field(self, field: Mapping[str, Any]) -> Scale | None:
        """Return the scale of a field of the registry; None if it has no unit of the stage."""
        by_stage = (field.get("scale") or {}).get("by") == "stage"
        return self.scale(field["quantity"]) if by_stage else None

    def columns(self, fields: Mapping[str, Json]) -> Iterator[tuple[str, str, Scale]]:
        """Yield the field, its name with the unit, and its scale for each field that can be converted."""
        for name, entry in fields.items():
            scale = self.of_field(entry)
            if scale is not None:
                unit = scale.unit.replace("/", "_per_").replace("^", "")
                yield name, f"{name}_{unit}", scale

    def values(self, fields: Mapping[str, Json], raw: Mapping[str, Any]) -> dict[str, float]:
        """Return the values of the fields of a message in units, such as ``position_mm``."""
        return {
            named: in_unit(scale, raw[name])
            for name, named, scale in self.columns(fields)
            if isinstance(raw.get(name), int)
        }


def in_unit(scale: Scale, counts: int) -> float:
    """Return counts in the unit of a scale, as the nearest float."""
    return counts * scale.counts_per_unit.denominator / scale.counts_per_unit.numerator
