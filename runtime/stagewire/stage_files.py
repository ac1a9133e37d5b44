"""Your own stages in a TOML file: one table for each stage, with its scales and limits.

.. code-block:: toml

    [slide]
    counts_per_mm = 20000
    counts_per_mm_per_s = 53687.0912
    counts_per_mm_per_s2 = "450000/7"
    travel_mm = 25
    max_velocity_mm_per_s = 2.5

A rotary stage has ``deg`` in place of ``mm``. Numbers are exact: 53687.0912 is that decimal, and a text may
be a fraction. Only the scale of the position is required; a scale or limit that is left out is unknown.
"""

from __future__ import annotations

import os
import tomllib
from decimal import Decimal
from fractions import Fraction
from typing import Any, Final

from stagewire.errors import BadValueError, StagewireError
from stagewire.quantities import Scale, Stage

__all__ = ["read_stages", "stage_in_file"]

_SCALES: Final = {
    "counts_per_{}": ("position", "{}"),
    "counts_per_{}_per_s": ("velocity", "{}/s"),
    "counts_per_{}_per_s2": ("acceleration", "{}/s^2"),
}
"""Key -> quantity and unit; ``{}`` is mm or deg."""
_LIMITS: Final = ("travel_{}", "max_velocity_{}_per_s", "max_acceleration_{}_per_s2")
"""Keys that are keywords of :meth:`Stage.of_user`."""


def read_stages(path: str | os.PathLike[str]) -> dict[str, Stage]:
    """Return the stages in a TOML file, by name.

    :param path: the file, described in :mod:`stagewire.stage_files`.

    Raise :class:`OSError` for a file that cannot be read, and :class:`~stagewire.errors.BadValueError` for
    anything in it that is not a stage.
    """
    with open(path, "rb") as file:
        try:
            tables = tomllib.load(file, parse_float=Decimal)
        except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
            raise BadValueError(f"{path}: not a TOML file: {error}") from None
    stages = {}
    for name, table in tables.items():
        try:
            stages[name] = _stage(name, table)
        except StagewireError as error:
            raise BadValueError(f"{path}: [{name}]: {error}") from None
    if not stages:
        raise BadValueError(f"{path}: no stage; expected a table such as [slide]")
    return stages


def stage_in_file(text: str) -> Stage | None:
    """Return the stage that ``FILE.toml:NAME`` names; None for any other text.

    Raise :class:`~stagewire.errors.BadValueError` for a file that cannot be read, and for a stage that it
    does not have.
    """
    folder, suffix, name = text.rpartition(".toml:")
    if not suffix:
        return None
    path = f"{folder}.toml"
    try:
        stages = read_stages(path)
    except OSError as error:
        raise BadValueError(f"{path}: {error.strerror or error}") from None
    if name not in stages:
        raise BadValueError(f"{path}: no stage {name} (choose {', '.join(stages)})")
    return stages[name]


def _stage(name: str, table: object) -> Stage:
    if not isinstance(table, dict):
        raise BadValueError("expected a table with the scales of a stage, such as counts_per_mm")
    unit = "deg" if "counts_per_deg" in table else "mm"
    scales = {key.format(unit): scale for key, scale in _SCALES.items()}
    limits = [key.format(unit) for key in _LIMITS]
    for key in table:
        if key not in (*scales, *limits):
            raise BadValueError(f"unknown key {key} (choose {', '.join((*scales, *limits))})")
    if f"counts_per_{unit}" not in table:
        raise BadValueError("counts_per_mm or counts_per_deg is missing")
    numbers = {key: _number(key, value) for key, value in table.items()}
    of_quantities: dict[str, Any] = {
        quantity: Scale.counts_per(place.format(unit), numbers[key])
        for key, (quantity, place) in scales.items()
        if key in numbers
    }
    of_limits: dict[str, Any] = {key: numbers[key] for key in limits if key in numbers}
    return Stage.of_user(name, rotary=unit == "deg", **of_limits, **of_quantities)


def _number(key: str, value: object) -> Fraction:
    """Return a number or a fraction in text; raise an error unless it is positive."""
    try:
        if isinstance(value, bool) or not isinstance(value, int | Decimal | str):
            raise ValueError
        number = Fraction(value)
    except (ValueError, ZeroDivisionError, OverflowError):
        number = Fraction()
    if number <= 0:
        raise BadValueError(
            f'{key}: expected a positive number such as 20000 or "512/5", not {value!r}'
        )
    return number
