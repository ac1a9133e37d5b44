"""``piezo-volts``, ``piezo-position`` and ``piezo-mode``: the output follows its set-point (pages 94 to 97).

A voltage sets the output in open loop and is ignored in closed loop; for a position it is the reverse. A
check closes a loop only if the status reports feedback and the allowed range is one of positions: without
feedback, the behaviour of a piezo in closed loop is unknown.

``piezo-slew``: the output voltage changes no faster than the slew rate (page 123).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Final

from stagewire_apt import messages as m
from stagewire_apt.enumerations import PositionControlMode
from stagewire_conformance.device.causes import EFFECT, Cause
from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.apt.broken_rules import rule_of_set
from stagewire_conformance.device.checks.apt.outputs.output_check import (
    lacks_unit,
    lacks_volts,
    output_check,
)
from stagewire_conformance.device.checks.apt.outputs.piezo import (
    CLOSED,
    FULL_SCALE,
    HELD,
    OPEN,
    Others,
    Piezo,
    bits_are_known,
    needs_a_gauge,
)
from stagewire_conformance.device.checks.apt.settings.sets import PlacedSet, parameter_sets

if TYPE_CHECKING:
    from stagewire_conformance.device.declaration import Declaration
    from stagewire_conformance.device.permissions import Permissions
    from stagewire_conformance.device.targets import Target
    from stagewire_conformance.device.trial import Trial

_STATUS: Final = ("HW_START_UPDATEMSGS", "HW_STOP_UPDATEMSGS", "PZ_GET_PZSTATUSUPDATE")
_VOLTS: Final = ("PZ_SET_OUTPUTVOLTS", "PZ_REQ_OUTPUTVOLTS", "PZ_GET_OUTPUTVOLTS")
_POSITION: Final = ("PZ_SET_OUTPUTPOS", "PZ_REQ_OUTPUTPOS", "PZ_GET_OUTPUTPOS")
_MODE: Final = ("PZ_SET_POSCONTROLMODE", "PZ_REQ_POSCONTROLMODE", "PZ_GET_POSCONTROLMODE")


# Open loop


def _lacks_positions(declared: Declaration, allowed: Permissions, place: Target) -> str:
    return lacks_unit(allowed, ("um", "mm", "nm", "m"), "positions")


VOLTS = Kind(
    name="piezo-volts",
    title="In open loop, a voltage is output and a position is ignored",
    rules=(
        "output-volts",
        "output-volts-range",
        "output-position-closed-loop-only",
        "piezo-update-voltage",
        "piezo-update-content",
        "module-channels",
        "slot-addressed-by-destination",
    ),
)

POSITION = Kind(
    name="piezo-position",
    title="In closed loop, a position is held and a voltage is ignored",
    rules=(
        "output-position",
        "output-position-range",
        "output-volts-open-loop-only",
        "piezo-update-position",
        "control-mode",
        "control-mode-values",
        "piezo-status-bits-meaning",
    ),
)

MODE = Kind(
    name="piezo-mode",
    title="The control mode can be set",
    rules=("control-mode", "control-mode-values", "piezo-status-bits-meaning"),
)


@output_check(
    VOLTS,
    "In open loop, PZ_SET_OUTPUTVOLTS sets the output of {output} and PZ_SET_OUTPUTPOS does not",
    messages=(*_VOLTS, *_POSITION, *_MODE, *_STATUS),
    does="changes the output voltage of each piezo by less than 5 % within {range}, and "
    "restores it",
    lacks=lacks_volts,
)
def _volts(trial: Trial, place: Target, channel: int) -> None:
    piezo = Piezo(trial, place, channel)
    if piezo.mode not in OPEN:
        piezo.give_up(f"{piezo.text} is in closed loop, where an output voltage is ignored")
    before = piezo.volts
    low, high = piezo.span("output_volts")
    step = piezo.step(before, (low, high))
    piezo.begin()
    others = Others.of(piezo)
    trial.undo(
        f"output voltage of {piezo.text}",
        lambda: piezo.send(m.PzSetOutputVolts(channel, before)),
        moves=True,
    )
    target = before
    for way in (-step, step):  # in both directions if possible, to detect a lost sign
        if not max(low, -FULL_SCALE) <= before + way <= min(high, FULL_SCALE):
            continue
        target = before + way
        told = f"PZ_SET_OUTPUTVOLTS {target}"
        piezo.send(m.PzSetOutputVolts(channel, target))
        _judge_told(piezo, told, target, piezo.volts, before)
        others.judge(told)
        if not piezo.judge_seen("voltage", target, told):
            return
    position = max(0, min(FULL_SCALE, abs(before)))
    _judge_ignored(
        piezo,
        f"PZ_SET_OUTPUTPOS {position} in open loop",
        lambda: piezo.send(m.PzSetOutputPos(channel, position)),
        lambda: piezo.set_position,
        position,
        target,
    )


def _judge_told(piezo: Piezo, told: str, wanted: int, says: int, before: int) -> None:
    piezo.trial.must(
        says == wanted,
        f"{piezo.text}: after {told}, the controller reports a set value of {says} (before: "
        f"{before})",
        rule=rule_of_set(told.partition(" ")[0]),
        cause=Cause(told.partition(" ")[0], EFFECT),
    )


def _judge_ignored(
    piezo: Piezo,
    told: str,
    send: Callable[[], None],
    read: Callable[[], int],
    wanted: int,
    output: int,
) -> None:
    """Check that the set-point of the other loop is ignored, and does not change the output."""
    before = read()
    field = "voltage" if "open" in told else "position"
    send()
    after = read()
    piezo.trial.must(
        abs(after - wanted) > abs(after - before) or wanted == before,
        f"{piezo.text}: after {told}, the controller reports a set value of {after}; it should "
        f"ignore the message and keep {before}",
        rule="output-position-closed-loop-only"
        if told.startswith("PZ_SET_OUTPUTPOS")
        else "output-volts-open-loop-only",
    )
    piezo.judge_seen(field, output, f"{told}, which should be ignored")


# Closed loop


def _enter_closed_loop(piezo: Piezo) -> tuple[int, int]:
    """Close the loop if this is safe, and return the range of positions."""
    span = piezo.span("piezo_position")
    piezo.begin()
    status = piezo.status()
    needs_a_gauge(piezo, status.bits)
    set_position = piezo.set_position
    for what, value in (("is at", status.position), ("would go to", set_position)):
        piezo.trial.need(
            span[0] <= value <= span[1],
            f"{piezo.text} {what} {value} counts in closed loop, outside of the allowed "
            f"{span[0]}..{span[1]} counts, so its loop was not closed",
            rule="output-position",
        )
    before = piezo.mode
    if before not in CLOSED:
        piezo.trial.undo(
            f"control mode of {piezo.text}",
            lambda: piezo.send(m.PzSetPosControlMode(piezo.channel, before)),
            moves=True,
        )
        piezo.send(m.PzSetPosControlMode(piezo.channel, PositionControlMode.CLOSED_LOOP))
        now = piezo.mode
        piezo.trial.need(
            now == PositionControlMode.CLOSED_LOOP,
            f"{piezo.text}: PZ_SET_POSCONTROLMODE wrote {int(PositionControlMode.CLOSED_LOOP)}, "
            f"but PZ_GET_POSCONTROLMODE then returned {now}",
            rule="control-mode",
            cause=Cause("PZ_SET_POSCONTROLMODE", EFFECT),
        )
    return span


@output_check(
    POSITION,
    "In closed loop, PZ_SET_OUTPUTPOS sets the position of {output} and PZ_SET_OUTPUTVOLTS "
    "does not",
    messages=(*_VOLTS, *_POSITION, *_MODE, *_STATUS),
    does="closes the loop of each piezo, changes its position by less than 5 % within {range}, and "
    "restores both",
    lacks=_lacks_positions,
    seconds=0.5,
)
def _position(trial: Trial, place: Target, channel: int) -> None:
    piezo = Piezo(trial, place, channel)
    span = _enter_closed_loop(piezo)
    for mode in reversed(CLOSED):
        _judge_mode(piezo, mode)
    before = piezo.set_position
    target = before + piezo.step(before, (max(0, span[0]), span[1]))
    trial.undo(
        f"output position of {piezo.text}",
        lambda: piezo.send(m.PzSetOutputPos(channel, before)),
        moves=True,
    )
    told = f"PZ_SET_OUTPUTPOS {target}"
    piezo.send(m.PzSetOutputPos(channel, target))
    _judge_told(piezo, told, target, piezo.set_position, before)
    if piezo.judge_seen("position", target, told):
        other = (before + target) // 2
        _judge_ignored(
            piezo,
            f"PZ_SET_OUTPUTVOLTS {other} in closed loop",
            lambda: piezo.send(m.PzSetOutputVolts(channel, other)),
            lambda: piezo.volts,
            other,
            target,
        )


# Modes


@output_check(
    MODE,
    "PZ_SET_POSCONTROLMODE sets the control mode of {output}, and the status shows it",
    messages=(*_MODE, *_VOLTS, *_POSITION, *_STATUS),
    does="sets the other mode of the current loop of each piezo (smooth or not), and restores it",
)
def _modes(trial: Trial, place: Target, channel: int) -> None:
    piezo = Piezo(trial, place, channel)
    before = piezo.mode
    low, high = piezo.span("output_volts") if before in OPEN else piezo.span("piezo_position")
    output = piezo.volts if before in OPEN else piezo.set_position
    piezo.step(output, (low, high))
    piezo.begin()
    trial.undo(
        f"control mode of {piezo.text}",
        lambda: piezo.send(m.PzSetPosControlMode(channel, before)),
        moves=True,
    )
    for mode in reversed(CLOSED if before in CLOSED else OPEN):
        _judge_mode(piezo, mode)


def _judge_mode(piezo: Piezo, mode: PositionControlMode) -> None:
    """Set a control mode, and check that it is reported."""
    piezo.send(m.PzSetPosControlMode(piezo.channel, mode))
    now = piezo.mode
    piezo.trial.must(
        now == mode,
        f"{piezo.text}: PZ_SET_POSCONTROLMODE wrote {int(mode)} ({mode.name}), but "
        f"PZ_GET_POSCONTROLMODE then returned {now}",
        rule="control-mode",
        cause=Cause("PZ_SET_POSCONTROLMODE", EFFECT),
    )
    status = piezo.status()
    if bits_are_known(piezo.place):
        piezo.trial.must(
            status.bits.closed_loop == (mode in CLOSED),
            f"{piezo.text} is in mode {mode.name}, but {status.heard.name} reports closed_loop "
            f"= {int(status.bits.closed_loop)}",
            came=status.heard.raw,
            rule="piezo-status-bits-meaning",
            cause=Cause(status.heard.name, "closed_loop"),
        )


_SETTING: Final = "PZ_SET_TPZ_SLEWRATES"
_SLOWEST: Final = 1
"""The slowest rate; 0 would mean no limit."""
_SHARE: Final = 19_000
"""The rate that changes the output by the maximum voltage in a millisecond."""


SLEW = Kind(
    name="piezo-slew",
    title="The output changes no faster than the set slew rate",
    rules=("slew-rates", "slew-rate-limits", "output-volts"),
)


@output_check(
    SLEW,
    "The output of {output} changes no faster than PZ_SET_TPZ_SLEWRATES allows",
    messages=(
        _SETTING,
        "PZ_REQ_TPZ_SLEWRATES",
        "PZ_GET_TPZ_SLEWRATES",
        "PZ_SET_OUTPUTVOLTS",
        "PZ_REQ_OUTPUTVOLTS",
        "PZ_GET_OUTPUTVOLTS",
        "PZ_REQ_POSCONTROLMODE",
        "PZ_GET_POSCONTROLMODE",
        "HW_START_UPDATEMSGS",
        "HW_STOP_UPDATEMSGS",
        "PZ_GET_PZSTATUSUPDATE",
    ),
    does="sets the slowest slew rate, changes the output voltage of each piezo by less than 5 % "
    "within {range}, and restores both",
    lacks=lacks_volts,
    seconds=1.0,
)
def _run(trial: Trial, place: Target, channel: int) -> None:
    piezo = Piezo(trial, place, channel)
    if piezo.mode not in OPEN:
        piezo.give_up(f"{piezo.text} is in closed loop, which has a slew rate of its own")
    before = piezo.volts
    target = before + piezo.step(before, piezo.span("output_volts"))
    placed = PlacedSet(
        place, channel, next(s for s in parameter_sets(trial.declared, place) if s.set == _SETTING)
    )
    rates = placed.read(trial)
    piezo.begin()
    trial.undo(
        f"output voltage of {piezo.text}",
        lambda: piezo.send(m.PzSetOutputVolts(channel, before)),
        moves=True,
    )
    trial.undo(f"{_SETTING} at {piezo.text}", partial(placed.put_back, trial, rates))
    placed.write(trial, {**rates, "slew_open": _SLOWEST})
    piezo.status()
    told = trial.line.now
    piezo.send(m.PzSetOutputVolts(channel, target))
    per_second = _SLOWEST * 1000 * FULL_SCALE / _SHARE
    while True:
        status = piezo.status()
        gone = abs(status.voltage - before)
        if gone >= abs(target - before) - HELD:
            break
        if status.time - told > 2 * abs(target - before) / per_second + 1:
            break
    seconds = status.time - told
    trial.must(
        gone <= per_second * seconds + HELD,
        f"{piezo.text}: with slew_open = {_SLOWEST}, the output changed by {gone} counts in "
        f"{seconds:.2f} s; the whole change should take {abs(target - before) / per_second:.2f} "
        "s",
        came=status.heard.raw,
        rule="slew-rate-limits",
    )
    piezo.judge_seen("voltage", target, f"PZ_SET_OUTPUTVOLTS {target}")
