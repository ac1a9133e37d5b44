"""The values that a check writes instead of the current ones, and whether it may write them now.

The values are close to the current ones, and documented. A setting is not changed while a loop would react.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from random import Random
from typing import TYPE_CHECKING, Final

from stagewire_apt import messages as m
from stagewire_apt.enumerations import EnableState, PositionControlMode
from stagewire_conformance.device.checks.apt.settings.care import Care, How, Varied, When
from stagewire_conformance.device.checks.apt.settings.sets import ParameterSet, Values
from stagewire_conformance.registry import Json

if TYPE_CHECKING:
    from stagewire_conformance.device.checks.apt.settings.sets import PlacedSet
    from stagewire_conformance.device.trial import Trial

_OPEN: Final = (PositionControlMode.OPEN_LOOP, PositionControlMode.OPEN_LOOP_SMOOTH)


def why_not_now(trial: Trial, placed: PlacedSet, care: Care) -> str:
    """Return why a setting is only written back unchanged; empty if it may be changed."""
    values = placed.read(trial) if care.only_if else {}
    for name, allowed in care.only_if.items():
        if values[name] not in allowed:
            return f"{name} is {values[name]}, so a change could have an effect"
    channel = 1 if placed.channel is None else placed.channel
    match care.when:
        case When.DISABLED:
            request = "MOD_REQ_CHANENABLESTATE"
            if request not in placed.place.messages:
                return "no message shows whether the channel is disabled"
            enabled = trial.reply(m.ModReqChanEnableState(channel), placed.place.address).message
            if enabled.enable_state != EnableState.DISABLE:
                return "the channel is enabled, so its loop would react to a change"
        case When.OPEN_LOOP:
            request = "PZ_REQ_POSCONTROLMODE"
            if request not in placed.place.messages:
                return "no message shows whether a loop is closed"
            mode = trial.reply(m.PzReqPosControlMode(channel), placed.place.address).message.mode
            if mode not in _OPEN:
                return "the loop is closed and would react to a change"
    return ""


_SHARE: Final = 16
"""A number changes by up to a sixteenth of its value: more than a controller should round."""
_WIDE: Final = (0x1_0000, 0x1_FFFF)
"""The change of a number that tests its width."""
_LEAST: Final = 8
"""The minimum change of a small number that may go up or down."""


def variants(
    one: ParameterSet, care: Care, present: Values, random: Random
) -> Iterator[tuple[str, list[int]]]:
    """Yield each field that may be changed, with the values to write; the current ones are not among them."""
    for name, varied in care.fields.items():
        if name in one.fields:
            values = _values(one.fields[name], varied, present[name], random)
            if varied.like and 0 < present[varied.like] < present[name]:
                values.append(present[varied.like])
            if values:
                yield name, values


def first_variant(
    one: ParameterSet, care: Care, present: Values, random: Random, others: Sequence[Values] = ()
) -> tuple[str, int] | None:
    """Return one field that does not apply to all channels, and a new value for it.

    :param others: the values of other channels or bays, from which the new value also differs.
    """
    for name, values in variants(one, care, present, random):
        for value in values:
            if not care.fields[name].common and all(each[name] != value for each in others):
                return name, value
    return None


def _values(field: Json, varied: Varied, present: int, random: Random) -> list[int]:
    match varied.how:
        case How.LISTED | How.FEWER:
            values = [present & varied.keep | value for value in varied.listed(field)]
            if varied.how is How.FEWER:
                values = [value for value in values if value < present]
        case How.BITS:
            values = [present ^ mask for mask in sorted(field["flags"].values())]
        case _:
            values = [present + step for step in _steps(varied.how, present, random)]
            floor = field["minimum"] if varied.floor is None else varied.floor
            values = [value for value in values if floor <= value <= field["maximum"]]
    return [value for value in values if value != present]


def _steps(how: How, present: int, random: Random) -> list[int]:
    """Return the changes of a number."""
    size = abs(present) // _SHARE
    least = 1 if how is How.LOWER else _LEAST
    lower = -random.randint(max(least, size // 2), max(least, size))
    higher = random.randint(max(_LEAST, size // 2), max(2 * _LEAST, size))
    wide = random.randint(*_WIDE)
    steps = {How.LOWER: [lower], How.HIGHER: [higher], How.WIDE: [higher, lower, wide, -wide]}
    return steps.get(how, [higher, lower])
