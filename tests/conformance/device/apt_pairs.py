"""Pairs of a Thorlabs APT unit and a stage that together cover all units, and all stages that differ."""

from __future__ import annotations

from apt_runs import UNITS

from stagewire.errors import UnknownScaleError
from stagewire.quantities import Limit, Scale
from stagewire_apt import stages

Pair = tuple[str, str | None]

BARE: list[Pair] = [(name, None) for name in UNITS]
"""Every unit, without a stage."""


def _fitted() -> list[Pair]:
    """Return every unit with one of its stages, if possible one that no unit before it has."""
    seen: set[str | None] = {None}
    found: list[Pair] = []
    for name, entry in UNITS.items():
        every = entry["stages"] or [None]
        stage = next((each for each in every if each not in seen), every[0])
        seen.add(stage)
        found.append((name, stage))
    return found


def _others() -> list[Pair]:
    """Return the other stages, each on one unit, and only one of those with the same scale and travel."""
    found: dict[object, Pair] = {
        _figures(name, stage): (name, stage) for name, stage in FITTED if stage is not None
    }
    drivers = {stage: name for name in reversed(UNITS) for stage in UNITS[name]["stages"]}
    for stage, name in drivers.items():
        found.setdefault(_figures(name, stage), (name, stage))
    return [pair for pair in found.values() if pair not in FITTED]


def _figures(unit: str, stage: str) -> tuple[object, object]:
    fitted = getattr(stages, stage)
    limit = fitted.limits["travel"]
    travel = limit.value if isinstance(limit, Limit) else None
    try:
        scale = fitted.scale("position", unit)
    except UnknownScaleError:
        return travel, None
    return travel, scale.counts_per_unit if isinstance(scale, Scale) else None


FITTED = _fitted()
"""Every unit with one of its stages, if it drives any."""
PAIRS = list(dict.fromkeys([*FITTED, *BARE, *_others()]))
