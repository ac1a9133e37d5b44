"""``nanotrak-tracking`` and ``nanotrak-range``: a NanoTrak follows the signal (pages 249 to 277 of Issue 37).

The circle may only move within the allowed range, in counts. A check latches the unit as soon as it leaves
this range, and at the end returns the circle to its previous position.
"""

from __future__ import annotations

import re
from fractions import Fraction
from functools import partial
from typing import TYPE_CHECKING, Any, Final

from stagewire.devices import number_of
from stagewire_apt import messages as m
from stagewire_conformance.device.causes import EFFECT, Cause
from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.apt.outputs.output_check import (
    Output,
    lacks_unit,
    output_check,
)

if TYPE_CHECKING:
    from collections.abc import Mapping

    from stagewire_conformance.device.declaration import Declaration
    from stagewire_conformance.device.permissions import Permissions
    from stagewire_conformance.device.targets import Target
    from stagewire_conformance.device.trial import Trial

_PIEZO, _LATCH, _TRACK = 1, 2, 3
_TRACKING: Final = (3, 4)
"""States of tracking, without and with a signal."""
_AXES: Final = {_TRACK: 1, 4: 2, 5: 3}
"""Mode -> the axes that PZ_GET_NTMODE reports."""
_FULL: Final = 65535
_HELD: Final = _FULL // 200
"""The tolerance of a position in counts."""
_AWAY: Final = _FULL // 10
"""How far the circle is moved from the highest signal."""
_LOOK: Final = 0.05
"""Seconds between two looks while the unit tracks."""
_FINDS: Final = 1.5
"""Seconds within which the signal is found."""
_ARRIVES: Final = 0.3
_PAUSE: Final = 0.3
_FAINT: Final = 2e-9
"""A current in A that may be noise (page 251)."""
_SHARE: Final = 32767
_IN_RANGE, _UNDER, _OVER = 1, 2, 3
_MANUAL, _MANUAL_SET, _AUTO, _AUTO_SET = 2, 3, 1, 4
_TIA: Final = 1
_RULE_OF_RANGES: Final = {"TNA001": "nanotrak-ranges-tna", "KNA101": "kna101-ranges"}
"""Unit -> the rule about the ranges that it has."""

MODE: Final = ("PZ_SET_NTMODE", "PZ_REQ_NTMODE", "PZ_GET_NTMODE")
STATUS: Final = ("PZ_REQ_NTSTATUSUPDATE", "PZ_GET_NTSTATUSUPDATE")
_HOME: Final = (
    "PZ_SET_NTCIRCHOMEPOS",
    "PZ_REQ_NTCIRCHOMEPOS",
    "PZ_GET_NTCIRCHOMEPOS",
    "PZ_MOVE_NTCIRCTOHOMEPOS",
)
_RANGE: Final = ("PZ_SET_NTTIARANGEPARAMS", "PZ_REQ_NTTIARANGEPARAMS", "PZ_GET_NTTIARANGEPARAMS")
_INPUT: Final = ("PZ_REQ_NTFEEDBACKSRC", "PZ_GET_NTFEEDBACKSRC")

TRACKING = Kind(
    name="nanotrak-tracking",
    title="A NanoTrak tracks the highest signal, latches, and goes to its home position",
    rules=("nanotrak-mode-set", "nanotrak-mode-returned"),
)

RANGE = Kind(
    name="nanotrak-range",
    title="The range of a NanoTrak can be set, and its readings agree with it",
    rules=(
        "nanotrak-relative-reading",
        "nanotrak-ranges",
        "nanotrak-under-over",
        "nanotrak-manual-range",
        "nanotrak-autorange-only",
        "nanotrak-ranges-tna",
        "kna101-ranges",
    ),
)


def lacks_counts(declared: Declaration, allowed: Permissions, place: Target) -> str:
    """Return why the allowed range does not suffice if it is not a range of counts; otherwise empty."""
    return lacks_unit(allowed, ("counts",), "counts of a NanoTrak, 0 to 65535")


class NanoTrak(Output):
    """A NanoTrak during a check."""

    def __init__(self, trial: Trial, place: Target, channel: int) -> None:
        super().__init__(trial, place, channel)
        motion = trial.allowed.motion
        assert motion is not None  # required for every output
        low, high = motion.in_counts(None)
        self.span = max(low, 0), min(high, _FULL)

    def tracks(self) -> bool:
        """Return whether the unit tracks."""
        return self.ask(m.PzReqNtMode()).state in _TRACKING

    def status(self) -> Any:
        """Return the status."""
        return self.ask(m.PzReqNtStatusUpdate(self.channel))

    def inside(self, status: Any) -> bool:
        """Return whether the circle is within the allowed range."""
        low, high = self.span
        return all(low <= at <= high for at in (status.circ_pos_a, status.circ_pos_b))

    def set_mode(self, mode: int) -> None:
        """Set a mode, and judge the reported state."""
        self.send(m.PzSetNtMode(mode))
        now = self.ask(m.PzReqNtMode())
        wanted = (_LATCH,) if mode == _LATCH else _TRACKING
        self.trial.need(
            now.state in wanted,
            f"{self.text}: after PZ_SET_NTMODE with the mode {mode}, PZ_GET_NTMODE has the state "
            f"{now.state}; expected {' or '.join(map(str, wanted))}",
            rule="nanotrak-mode-returned",
            cause=Cause("PZ_SET_NTMODE", EFFECT),
        )
        if mode in _AXES:
            self.trial.must(
                now.mode == _AXES[mode],
                f"{self.text}: after PZ_SET_NTMODE with the mode {mode}, PZ_GET_NTMODE has the axes "
                f"{now.mode}; expected {_AXES[mode]}",
                rule="nanotrak-mode-set",
                cause=Cause("PZ_SET_NTMODE", EFFECT),
            )

    def go(self, a: int, b: int) -> Any:
        """Move the circle by its home position, and return the status afterwards."""
        self.send(m.PzSetNtCircHomePos(a, b))
        told = self.ask(m.PzReqNtCircHomePos())
        self.trial.must(
            (told.circ_home_pos_a, told.circ_home_pos_b) == (a, b),
            f"{self.text}: PZ_SET_NTCIRCHOMEPOS wrote {a} and {b}, but PZ_GET_NTCIRCHOMEPOS then has "
            f"{told.circ_home_pos_a} and {told.circ_home_pos_b}",
            rule="get-answers-request",
            cause=Cause("PZ_SET_NTCIRCHOMEPOS", EFFECT),
        )
        self.send(m.PzMoveNtCircToHomePos())
        self.trial.line.listen(_ARRIVES)
        return self.status()

    def track(self, mode: int) -> Any:
        """Track until the signal should be found, and return the last status; latch outside of the range."""
        self.set_mode(mode)
        end = self.trial.line.now + _FINDS
        while True:
            self.trial.line.listen(_LOOK)
            status = self.status()
            if not self.inside(status):
                self.send(m.PzSetNtMode(_LATCH))
                self.give_up(
                    f"{self.text} left the allowed {self.span[0]}..{self.span[1]} counts while it "
                    "tracked, and was latched; allow a wider range"
                )
            if self.trial.line.now >= end:
                return status

    def put_back(self, mode: Any, home: Any, at: tuple[int, int]) -> None:
        """Return to a position, mode and home position."""
        self.send(m.PzSetNtMode(_LATCH))
        self.send(m.PzSetNtCircHomePos(*at))
        self.send(m.PzMoveNtCircToHomePos())
        self.trial.line.listen(_ARRIVES)
        self.send(m.PzSetNtCircHomePos(home.circ_home_pos_a, home.circ_home_pos_b))
        if mode.state in _TRACKING:
            self.send(m.PzSetNtMode(_TRACK + mode.mode - 1))


@output_check(
    TRACKING,
    "{output} tracks the highest signal, latches, and goes to its home position",
    messages=(*MODE, *STATUS, *_HOME),
    does="moves the circle of each NanoTrak within {range}: tracks on each axis, latches, moves it off the "
    "signal by its home position, and restores all",
    settings=True,
    seconds=5.8,
    lacks=lacks_counts,
)
def _track(trial: Trial, place: Target, channel: int) -> None:
    unit = NanoTrak(trial, place, channel)
    mode, home = unit.ask(m.PzReqNtMode()), unit.ask(m.PzReqNtCircHomePos())
    if mode.state == _PIEZO:
        unit.give_up(f"{unit.text} is in piezo mode, in which it does not track")
    first = unit.status()
    at = first.circ_pos_a, first.circ_pos_b
    if not unit.inside(first):
        unit.give_up(f"{unit.text} is at {at[0]} and {at[1]} counts, outside of the allowed range")
    trial.undo(f"circle of {unit.text}", partial(unit.put_back, mode, home, at), moves=True)
    unit.set_mode(_LATCH)
    if number_of(unit.status().abs_reading, 4) < _FAINT:
        unit.give_up(f"{unit.text} has hardly any signal, so it was not tracked")
    best = unit.track(_TRACK)
    for axis, name in ((0, "horizontal"), (1, "vertical")):
        _one_axis(unit, best, axis, name)
    unit.set_mode(_LATCH)
    held = unit.status()
    trial.line.listen(_PAUSE)
    later = unit.status()
    trial.must(
        _near(held, later),
        f"{unit.text}: PZ_SET_NTMODE with the mode 2 (latch) does not hold the circle; "
        f"PZ_GET_NTSTATUSUPDATE went from {_at(held)} to {_at(later)} counts in {_PAUSE:g} s",
        rule="nanotrak-mode-set",
        cause=Cause("PZ_SET_NTMODE", EFFECT),
    )


def _one_axis(unit: NanoTrak, best: Any, axis: int, name: str) -> None:
    """Move the circle off the signal on one axis, and let it come back on this axis alone."""
    trial, mode = unit.trial, _TRACK + 1 + axis
    unit.set_mode(_LATCH)
    goal = list(_at(best))
    goal[axis] += -_AWAY if goal[axis] > _FULL // 2 else _AWAY
    off = unit.go(*goal)
    trial.need(
        all(abs(is_ - due) <= _HELD for is_, due in zip(_at(off), goal, strict=True)),
        f"{unit.text}: PZ_MOVE_NTCIRCTOHOMEPOS should move the circle to {goal[0]} and {goal[1]}, but "
        f"PZ_GET_NTSTATUSUPDATE then has {_at(off)}",
        rule="get-answers-request",
        cause=Cause("PZ_MOVE_NTCIRCTOHOMEPOS", EFFECT),
    )
    low, high = (number_of(status.abs_reading, 4) for status in (off, best))
    if low >= high:
        trial.info(f"{unit.text}: the signal is not lower off its maximum ({name} axis)")
        return
    back = unit.track(mode)
    reached = number_of(back.abs_reading, 4)
    trial.must(
        reached >= (low + high) / 2,
        f"{unit.text}: PZ_SET_NTMODE with the mode {mode} ({name} tracking) took the signal from "
        f"{low:.3g} to {reached:.3g} in {_FINDS:g} s; {high:.3g} was there before",
        rule="nanotrak-mode-set",
        cause=Cause("PZ_SET_NTMODE", EFFECT),
    )
    other = 1 - axis
    trial.must(
        abs(_at(back)[other] - goal[other]) <= _HELD,
        f"{unit.text}: PZ_SET_NTMODE with the mode {mode} ({name} tracking) also moved the other axis, "
        f"from {goal[other]} to {_at(back)[other]} counts",
        rule="nanotrak-mode-set",
        cause=Cause("PZ_SET_NTMODE", EFFECT),
    )


def _at(status: Any) -> tuple[int, int]:
    return status.circ_pos_a, status.circ_pos_b


def _near(one: Any, other: Any) -> bool:
    return all(abs(a - b) <= _HELD for a, b in zip(_at(one), _at(other), strict=True))


# Ranges


@output_check(
    RANGE,
    "The range of {output} can be set, and its readings agree with it",
    messages=(*_RANGE, *STATUS, *_INPUT, *MODE),
    does="changes the range of each latched NanoTrak, and restores it",
    settings=True,
    seconds=0.6,
    lacks=lacks_counts,
)
def _range(trial: Trial, place: Target, channel: int) -> None:
    unit = NanoTrak(trial, place, channel)
    if unit.tracks():
        unit.give_up(f"{unit.text} tracks, so its range was not changed")
    if unit.ask(m.PzReqNtFeedbackSrc()).feedback_src != _TIA:
        unit.give_up(f"{unit.text} has an external signal, which has no ranges")
    before = unit.ask(m.PzReqNtTiaRangeParams()).values()
    first = unit.status().range
    trial.undo(f"range of {unit.text}", partial(_restore, unit, before, first))
    scales = _full_scales(trial, place)
    trial.must(
        first in scales,
        f"{unit.text}: PZ_GET_NTSTATUSUPDATE has range {first}; a {place.unit.name} has the ranges "
        f"{min(scales)} to {max(scales)}",
        rule=_RULE_OF_RANGES.get(place.unit.name, "nanotrak-ranges"),
        cause=Cause("PZ_GET_NTSTATUSUPDATE", "range"),
    )
    for code in sorted(scales):
        unit.send(
            m.PzSetNtTiaRangeParams(**{**before, "range_mode": _MANUAL_SET, "range_sw": code})
        )
        now = unit.status()
        trial.need(
            now.range == code,
            f"{unit.text}: PZ_SET_NTTIARANGEPARAMS set range {code}, but PZ_GET_NTSTATUSUPDATE has range "
            f"{now.range}",
            rule="nanotrak-ranges",
            cause=Cause("PZ_SET_NTTIARANGEPARAMS", EFFECT),
        )
        _judge_reading(unit, now, scales[code])
    low, high = min(scales), max(scales)
    unit.send(m.PzSetNtTiaRangeParams(**{**before, "range_mode": _MANUAL, "range_sw": low}))
    trial.line.listen(_PAUSE)
    now = unit.status().range
    trial.must(
        now == high,
        f"{unit.text}: PZ_SET_NTTIARANGEPARAMS with the mode {_MANUAL} should keep range {high}, but "
        f"PZ_GET_NTSTATUSUPDATE has range {now}",
        rule="nanotrak-manual-range" if now == low else "nanotrak-autorange-only",
        cause=Cause("PZ_SET_NTTIARANGEPARAMS", EFFECT),
    )
    unit.send(m.PzSetNtTiaRangeParams(**{**before, "range_mode": _AUTO, "range_sw": low}))
    trial.line.listen(_PAUSE)
    now = unit.status()
    fits = now.under_over_read == _IN_RANGE or (now.range, now.under_over_read) in (
        (low, _UNDER),
        (high, _OVER),
    )
    trial.must(
        fits or before["range_change_type"] != 1,
        f"{unit.text}: with automatic ranges, PZ_GET_NTSTATUSUPDATE has range {now.range}, which does not "
        "suit the signal",
        rule="nanotrak-under-over",
        cause=Cause("PZ_SET_NTTIARANGEPARAMS", EFFECT),
    )


def _restore(unit: NanoTrak, before: Mapping[str, int], first: int) -> None:
    """Restore the range and then the parameters, which may keep the present range."""
    unit.send(m.PzSetNtTiaRangeParams(**{**before, "range_mode": _MANUAL_SET, "range_sw": first}))
    unit.send(m.PzSetNtTiaRangeParams(**before))


def _judge_reading(unit: NanoTrak, now: Any, full_scale: float) -> None:
    """Compare the relative reading and the flag with the current and the range."""
    current, share = number_of(now.abs_reading, 4), now.rel_reading / _SHARE
    due = min(current / full_scale, 1.0)
    unit.trial.must(
        abs(share - due) <= 0.05,
        f"{unit.text}: PZ_GET_NTSTATUSUPDATE has {current:.3g} A and a relative reading of {share:.0%} in "
        f"range {now.range}; expected {due:.0%}",
        rule="nanotrak-relative-reading",
        cause=Cause("PZ_GET_NTSTATUSUPDATE", "reading"),
    )
    wrong = {
        _IN_RANGE: False,
        _UNDER: share > 0.5,
        _OVER: share < 0.9,
    }.get(now.under_over_read, True)
    unit.trial.must(
        not wrong and not (now.under_over_read == _IN_RANGE and current > 1.05 * full_scale),
        f"{unit.text}: PZ_GET_NTSTATUSUPDATE has under_over_read {now.under_over_read} with a relative "
        f"reading of {share:.0%}",
        rule="nanotrak-under-over",
        cause=Cause("PZ_GET_NTSTATUSUPDATE", "under_over_read"),
    )


def _full_scales(trial: Trial, place: Target) -> dict[int, float]:
    """Return the current in A at full scale of each range, from the names of the ranges."""
    field = trial.declared.registry.fields("PZ_GET_NTSTATUSUPDATE", "data")["range"]
    name = field["enums_by_unit"].get(place.unit.name, field["enumeration"])
    values = trial.declared.protocol.registry()["enumerations"][name]["values"]
    first = 5 if place.unit.name == "TNA001" else 3  # page 255
    found = {}
    for text, entry in values.items():
        match = re.fullmatch(r"RANGE_([0-9]+)P?([0-9]*)([NUM])A", text)
        assert match, text
        number = Fraction(f"{match[1]}.{match[2] or 0}")
        found[entry["value"]] = float(number) * {"N": 1e-9, "U": 1e-6, "M": 1e-3}[match[3]]
    return {code: scale for code, scale in found.items() if code >= first}
