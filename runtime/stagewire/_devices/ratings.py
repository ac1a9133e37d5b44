"""The voltage that an actuator withstands, and the voltages that calls may send.

The user passes the rating of the actuator to ``open`` as ``max_volts``. Nothing above it is sent: no output
voltage, no drive voltage, and no range or limit of the controller above it. The rating is never used as a
scale: output voltages are shares of the maximum output voltage of the controller, and if that is unknown, no
output other than 0 can be compared with the rating, and is refused.

In closed loop the controller chooses the voltage, up to its maximum. A closed loop and its positions are
refused if this maximum is above the rating or unknown.

Without a rating, the limit that the controller itself has set counts as the rating: voltages are shares of
it, so none exceeds it, but it is not raised. A drive voltage without such a limit is not raised above the one
that the controller holds, or above the lowest that the field accepts.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, Final

from stagewire._codec.flags import Enumeration, Flags
from stagewire._codec.message import Message
from stagewire._devices.scales import ByCase, Scales, ToldValue, settings_of
from stagewire._devices.tables import Given
from stagewire._devices.unit import Facts, Told, Unit
from stagewire.errors import LimitError, UnknownScaleError
from stagewire.quantities import Scale

SETTING: Final = "maximum_volts"
"""Setting with the maximum output voltage, of which output voltages are shares."""
_ALONE: Final = ("drive_volts", "maximum_volts", "volts")
"""Quantities of voltages at an actuator that are not shares of the setting."""
_POSITION: Final = "piezo_position"
"""Quantity of positions that a closed loop holds."""
_CLOSED: Final = "CLOSED_LOOP"
"""Beginning of the names of modes in which a closed loop chooses the voltage."""
_VOLT: Final = "V"
_ADVICE: Final = "if the actuator withstands it, pass max_volts= to open"


@dataclass(frozen=True, slots=True)
class Rating:
    """The rating of the actuator on a controller.

    :param volts: as the user gave it; None: not given.
    """

    facts: Facts
    unit: Unit
    volts: Fraction | None

    def check(
        self,
        what: str,
        message: type[Message] | None,
        entries: tuple[Given, ...],
        fields: Mapping[str, Any],
        held: Mapping[str, Any],
        scales: Scales,
    ) -> None:
        """Check the voltages in a message before it is sent.

        :param held: values that the controller holds, which may stay as they are.

        Raise :class:`~stagewire.errors.LimitError`, and :class:`~stagewire.errors.UnknownScaleError` for a
        value that cannot be compared with the rating.
        """
        for entry in entries:
            if entry.field not in fields or fields[entry.field] == held.get(entry.field):
                continue
            name, raw = f"{what}: {entry.field}", fields[entry.field]
            told = self._limit(message, entry)
            if told is not None:
                self._check(name, _told_volts(told, raw), _unrated(told, entry, scales))
            elif is_rated(self.facts, entry.quantity):
                try:
                    scale = _scale(entry, scales)
                except UnknownScaleError:
                    if self.volts is None or raw == 0:
                        continue  # a share of the limit of the controller, which is not raised
                    raise UnknownScaleError(self._incomparable(name, scales)) from None
                if scale is None:
                    self._check_loop(name, raw, scales)
                elif self.volts is None:
                    if entry.quantity in _ALONE:
                        self._check(name, scale.from_counts(raw), _free(entry, held, scale))
                elif abs(raw) > scale.to_counts(self.volts):  # both are rounded the same way
                    self._check(name, scale.from_counts(raw), None)
            elif entry.quantity == _POSITION or _closes(entry, raw):
                self._check_loop(name, raw, scales)

    def _check_loop(self, name: str, raw: int, scales: Scales) -> None:
        """Check a value that lets a closed loop choose the voltage."""
        outputs = any(is_rated(self.facts, quantity) for quantity in self.unit.settable)
        if self.volts is None or raw == 0 or not outputs:
            return
        maximum = scales.settings.get(SETTING)
        if maximum is None:
            raise UnknownScaleError(self._incomparable(name, scales))
        if not isinstance(maximum.value, Fraction) or maximum.value > self.volts:
            raise LimitError(
                f"{name}: a closed loop can reach {_shown(maximum.value)} ({maximum.source}), which exceeds "
                f"the rating of the actuator, {_shown(self.volts)} (set by max_volts); nothing was sent. "
                "Lower the maximum output voltage of the controller first"
            )

    def _limit(self, message: type[Message] | None, entry: Given) -> Told | None:
        """Return how a field of a message sets the maximum output voltage; None if it does not."""
        for setting, told in self.facts.telling(self.unit):
            if setting.name == SETTING and told.set is message and told.field == entry.field:
                return told
        return None

    def _incomparable(self, name: str, scales: Scales) -> str:
        """Return why a share of the maximum output voltage is refused while that voltage is unknown."""
        assert self.volts is not None
        way = scales.ways.get(SETTING, "")
        return (
            f"{name} cannot be compared with the rating of the actuator, {_shown(self.volts)} (set by "
            f"max_volts), because the maximum output voltage of the controller is unknown; nothing was sent. "
            f"{way[:1].upper()}{way[1:]}"
        )

    def _check(self, name: str, volts: Fraction | None, free: ToldValue | None) -> None:
        """Check one voltage.

        :param volts: None if the document does not state it.
        :param free: voltage up to which no rating is needed; None: none.
        """
        if volts is None:
            raise LimitError(f"{name}: the voltage of this value is unknown; nothing was sent")
        if self.volts is not None:
            if abs(volts) > self.volts:
                raise LimitError(
                    f"{name}: {_shown(volts)} exceeds the rating of the actuator, {_shown(self.volts)} "
                    "(set by max_volts); nothing was sent"
                )
        elif free is None or not isinstance(free.value, Fraction) or abs(volts) > free.value:
            above = f" is above {_shown(free.value)} ({free.source})" if free else ""
            raise LimitError(
                f"{name}: {_shown(volts)}{above}, and the rating of the actuator is unknown; nothing was "
                f"sent. {_ADVICE[0].upper()}{_ADVICE[1:]}"
            )


def is_rated(facts: Facts, quantity: str) -> bool:
    """Return whether values of a quantity are voltages at an actuator."""
    if quantity in _ALONE:
        return True
    rule = facts.quantities.get(quantity)
    if rule is None or SETTING not in settings_of(rule):
        return False
    return getattr(rule, "unit", _VOLT) == _VOLT  # a rate is in other units


def has_rated(facts: Facts, unit: Unit) -> bool:
    """Return whether a unit has messages that set a voltage at an actuator, or its range."""
    ranges = (told.set for setting, told in facts.telling(unit) if setting.name == SETTING)
    return any(ranges) or any(is_rated(facts, quantity) for quantity in unit.settable)


def _closes(entry: Given, raw: int) -> bool:
    """Return whether a value selects a mode with a closed loop."""
    table = entry.choices
    if table is None or not issubclass(table, Enumeration):
        return False
    return any(one.value == raw and one.name.startswith(_CLOSED) for one in table)


def _told_volts(told: Told, raw: int) -> Fraction | None:
    """Return the maximum output voltage that a value of a field sets; None if it is unknown."""
    if told.scale is not None:
        return told.scale.from_counts(raw)
    found = (told.values or {}).get(raw)
    return None if found is None or isinstance(found, str) else Fraction(found)


def _scale(entry: Given, scales: Scales) -> Scale | None:
    """Return the scale of a value in volts; None if the value is not a voltage now.

    Raise :class:`~stagewire.errors.UnknownScaleError` if the scale is unknown.
    """
    rule = scales.rules[entry.quantity]
    now = scales.settings.get(rule.setting) if isinstance(rule, ByCase) else None
    for _, unit, case in entry.ways:
        if unit == _VOLT and (now is None or now.value == case):
            return scales.of(entry.quantity, unit, case)
    return None


def _unrated(told: Told, entry: Given, scales: Scales) -> ToldValue | None:
    """Return the range up to which no rating is needed; None: unknown.

    Bits set the range of several channels, each of which would be raised on its own.
    """
    if told.values and entry.choices is not None and issubclass(entry.choices, Flags):
        lowest = min(Fraction(volts) for volts in told.values.values())
        return ToldValue(lowest, _VOLT, "the lowest that the controller accepts")
    return scales.settings.get(SETTING)


def _free(entry: Given, held: Mapping[str, Any], scale: Scale) -> ToldValue | None:
    """Return the voltage up to which a drive voltage needs no rating."""
    if entry.field in held:
        return ToldValue(scale.from_counts(held[entry.field]), _VOLT, "which the controller holds")
    if entry.minimum:
        source = "the lowest that the controller accepts"
        return ToldValue(scale.from_counts(entry.minimum), _VOLT, source)
    return None


def _shown(volts: Fraction | str) -> str:
    return f"{float(volts):.6g} V" if isinstance(volts, Fraction) else str(volts)
