"""The target of ``stagewire move``: a position or a distance, in mm, degrees or counts."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from stagewire.devices import Values
from stagewire.errors import BadValueError
from stagewire.quantities import exact
from stagewire_cli.devices import keywords
from stagewire_cli.errors import CalledWronglyError
from stagewire_cli.status import numbers_of

_UNITS = {"mm": {"mm": 1, "um": 1000}, "deg": {"deg": 1}}
"""Unit of a target -> keywords of calls in which it can be given, and how many of these units make one."""
_GIVEN = re.compile(r"(.*?)\s*(mm|um|deg)?", re.DOTALL)
"""A number and its unit."""


@dataclass(frozen=True, slots=True)
class Target:
    """A target position, or a distance.

    :param text: the position or distance as given.
    :param value: the same as a number, in ``unit``.
    :param unit: ``mm``, ``deg`` or ``counts``.
    """

    text: str
    value: Fraction
    relative: bool
    unit: str

    @classmethod
    def parse(cls, text: str, *, relative: bool, counts: bool) -> Target:
        """Parse a number with or without its unit; raise :class:`CalledWronglyError` if it is invalid."""
        option = "--by" if relative else "--to"
        found = _GIVEN.fullmatch(text.strip())
        assert found  # the number may be any text
        number, unit = found.groups()
        try:
            value = exact(number)
        except BadValueError as error:
            raise CalledWronglyError(f"{option} {error}") from None
        if counts and (unit or value.denominator != 1):
            raise CalledWronglyError(
                f"{option} {text}: counts must be whole numbers without a unit"
            )
        if counts:
            return cls(text, value, relative, "counts")
        for base, units in _UNITS.items():
            if (unit or "mm") in units:
                return cls(text, value / units[unit or "mm"], relative, base)
        raise AssertionError(unit)  # the pattern has no other units

    def __str__(self) -> str:
        return f"{'by' if self.relative else 'to'} {float(self.value):.10g} {self.unit}"

    def is_met_by(self, values: Values[Any] | None) -> bool:
        """Return whether a status shows the target of a move, within a ten-thousandth of its unit."""
        if self.relative:
            return self.value == 0
        if self.unit == "counts":
            return getattr(values, "position", None) == self.value
        position = numbers_of(values).get("position") if values is not None else None
        factor = None if position is None else _UNITS[self.unit].get(position.unit)
        if position is None or factor is None:
            return False
        return abs(position.number - float(self.value * factor)) < 1e-4 * factor

    def given(self, start: Callable[..., Any], part: Any, unit: str) -> dict[str, Fraction | int]:
        """Return it as the keyword of a call.

        :param part: the part that the call moves.
        :param unit: name of its unit.

        Raises :class:`CalledWronglyError` if the call does not accept its unit, for a length on a rotary
        stage, and for a number without a unit where positions are not shown in mm.
        """
        if self.unit == "counts":
            return {"counts": int(self.value)}
        known = keywords(start)
        stage = part.scales.stage
        if self.unit == "mm" and stage is not None and stage.rotary:
            option = "--by" if self.relative else "--to"
            raise CalledWronglyError(
                f"{option} {self.text}: {stage.name} is a rotary stage; give degrees, such as "
                f"{option} 30deg, or --counts"
            )
        found = _GIVEN.fullmatch(self.text.strip())
        for keyword, factor in _UNITS[self.unit].items():
            if keyword in known and factor != 1 and found and not found[2]:
                option = "--by" if self.relative else "--to"
                raise CalledWronglyError(
                    f"{option} {self.text}: positions of {unit} are in {keyword}; give the unit, as in "
                    f"{option} {self.text}{keyword} or {option} {self.text}{self.unit}"
                )
            if keyword in known:
                return {keyword: self.value * factor}
        raise CalledWronglyError(f"{unit} does not accept {self.unit} here; use --counts")
