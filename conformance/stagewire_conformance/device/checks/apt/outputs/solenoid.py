"""``solenoid-state``, ``solenoid-mode`` and ``interlock-mode``: settings take effect (pages 85 to 92).

A solenoid is switched on in manual mode only. The interlock is never switched off, except to restore its
previous mode.

``digital-outputs``: each of the four digital outputs of a rack is switched and read back (page 26).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

from stagewire_apt.enumerations import (
    SolenoidInterlockMode,
    SolenoidOperatingMode,
    SolenoidState,
)
from stagewire_apt.flags import RackDigitalOutputs
from stagewire_conformance.device.causes import EFFECT, Cause
from stagewire_conformance.device.check import Case, Kind
from stagewire_conformance.device.checks.apt.broken_rules import rule_of_set
from stagewire_conformance.device.checks.apt.outputs.output_check import output_check
from stagewire_conformance.device.checks.apt.settings.sets import PlacedSet, parameter_sets
from stagewire_conformance.device.permissions import Need

if TYPE_CHECKING:
    from stagewire_conformance.device.declaration import Declaration
    from stagewire_conformance.device.permissions import Permissions
    from stagewire_conformance.device.targets import Target
    from stagewire_conformance.device.trial import Trial

_SET = "RACK_DIGOUTPUTS"


DIGITAL = Kind(
    name="digital-outputs",
    title="Digital outputs are switched one by one, and reported correctly",
    rules=("digital-outputs", "digital-outputs-bits", "command-without-acknowledgement"),
)


def _outputs(declared: Declaration, allowed: Permissions) -> Iterator[Case]:
    for place in declared.places:
        for one in parameter_sets(declared, place):
            if one.name == _SET:
                yield replace(PlacedSet(place, None, one).case(), name=place.name)


@DIGITAL.check(
    "{placed.set.set} switches the digital outputs of {placed.place.name}",
    needs={Need.MOTION},
    does="switches each of the four digital outputs for a moment, regardless of what is connected",
    each=_outputs,
)
def _run(trial: Trial, placed: PlacedSet) -> None:
    (field,) = placed.set.fields
    before: int = placed.read(trial)[field]
    trial.undo(
        f"digital outputs of {placed.place.name}", lambda: placed.put_back(trial, {field: before})
    )
    for name, mask in RackDigitalOutputs.bits.items():
        value = before ^ mask
        came = placed.write_and_ask(trial, {field: value})
        told = placed.values(came)[field]
        trial.must(
            told == value,
            f"{placed.text}: {placed.set.set} switched {name.replace('_', ' ')} with "
            f"{value:#04x}, but {placed.set.get} then returned {told:#04x}",
            wanted=placed.expected(trial, {field: value}, came),
            came=came.raw,
            rule=rule_of_set(placed.set.set),
            cause=Cause(placed.set.set, EFFECT),
        )


class _Switch:
    """A parameter set with a single value, which is written and read back."""

    def __init__(self, trial: Trial, place: Target, channel: int, name: str) -> None:
        sets = parameter_sets(trial.declared, place)
        self._trial = trial
        self._placed_set = PlacedSet(
            place, channel, next(each for each in sets if each.name == name)
        )
        (self._field,) = self._placed_set.set.fields
        self.before: int = self._placed_set.read(trial)[self._field]

    def keep(self, *, moves: bool = False) -> None:
        """Restore the value at the end of the check."""
        placed, values = self._placed_set, {self._field: self.before}
        self._trial.undo(
            f"{placed.set.set} at {placed.text}",
            lambda: placed.put_back(self._trial, values),
            moves=moves,
        )

    def write(self, value: int, hint: str = "") -> bool:
        """Write a value, and return whether it is read back."""
        placed = self._placed_set
        came = placed.write_and_ask(self._trial, {self._field: value})
        told = placed.values(came)[self._field]
        return self._trial.must(
            told == value,
            f"{placed.text}: {placed.set.set} wrote {self._field} = {value}, but "
            f"{placed.set.get} then returned {told}{hint}",
            wanted=placed.expected(self._trial, {self._field: value}, came),
            came=came.raw,
            rule=rule_of_set(placed.set.set),
            cause=Cause(placed.set.set, EFFECT),
        )


_NAMES = ("MOT_{}_SOL_OPERATINGMODE", "MOT_{}_SOL_STATE")
_BOTH = tuple(name.format(role) for name in _NAMES for role in ("SET", "REQ", "GET"))


STATE = Kind(
    name="solenoid-state",
    title="The solenoid can be switched on and off",
    rules=("solenoid-state", "solenoid-state-values"),
)

MODE = Kind(
    name="solenoid-mode",
    title="The operating mode can be set",
    rules=("solenoid-mode", "solenoid-mode-values"),
)

INTERLOCK = Kind(
    name="interlock-mode",
    title="The interlock can be required",
    rules=("interlock-mode", "interlock-mode-values"),
)


@output_check(
    STATE,
    "MOT_SET_SOL_STATE switches {output} on and off",
    messages=_BOTH,
    does="switches the solenoid off, on for a moment in manual mode, and off again; while it is on, "
    "whatever it controls is actuated",
)
def _state(trial: Trial, place: Target, channel: int) -> None:
    mode = _Switch(trial, place, channel, "MOT_SOL_OPERATINGMODE")
    state = _Switch(trial, place, channel, "MOT_SOL_STATE")
    mode.keep()
    state.keep(moves=state.before == SolenoidState.SOLENOID_ON)
    if not state.write(SolenoidState.SOLENOID_OFF) or not mode.write(
        SolenoidOperatingMode.SOLENOID_MANUAL
    ):
        return
    hint = "; is its interlock fitted, and the channel enabled?"
    state.write(SolenoidState.SOLENOID_ON, hint)
    state.write(SolenoidState.SOLENOID_OFF)


@output_check(
    MODE,
    "MOT_SET_SOL_OPERATINGMODE sets the mode of {output}",
    messages=_BOTH,
    does="switches the solenoid off, sets each operating mode, and restores the previous mode "
    "and state",
)
def _mode(trial: Trial, place: Target, channel: int) -> None:
    mode = _Switch(trial, place, channel, "MOT_SOL_OPERATINGMODE")
    state = _Switch(trial, place, channel, "MOT_SOL_STATE")
    state.keep(moves=state.before == SolenoidState.SOLENOID_ON)
    mode.keep()
    if state.write(SolenoidState.SOLENOID_OFF):
        for value in SolenoidOperatingMode:
            mode.write(value)


@output_check(
    INTERLOCK,
    "MOT_SET_SOL_INTERLOCKMODE requires the interlock of {output}",
    messages=tuple(f"MOT_{role}_SOL_INTERLOCKMODE" for role in ("SET", "REQ", "GET")),
    does="sets the interlock of the solenoid to required, and restores the previous mode",
)
def _interlock(trial: Trial, place: Target, channel: int) -> None:
    interlock = _Switch(trial, place, channel, "MOT_SOL_INTERLOCKMODE")
    interlock.keep()
    interlock.write(SolenoidInterlockMode.SOLENOID_ENABLED)
