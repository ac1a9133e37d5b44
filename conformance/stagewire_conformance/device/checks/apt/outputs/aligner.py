"""``quad-mode``, ``quad-outputs`` and ``quad-loop``: outputs of a position aligner (pages 327 to 345).

The outputs stay within the allowed range. In closed loop they are limited to it by the demand limits of the
unit, which the check narrows and restores, as it does the mode and the outputs.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any, Final

from stagewire_apt import messages as m
from stagewire_apt.quantities import QUAD_VOLTS
from stagewire_conformance.device.causes import EFFECT, Cause
from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.apt.outputs.output_check import (
    Output,
    lacks_volts,
    output_check,
)
from stagewire_conformance.device.permissions import COUNTS

if TYPE_CHECKING:
    from collections.abc import Mapping

    from stagewire_conformance.device.targets import Target
    from stagewire_conformance.device.trial import Trial

_MONITOR, _OPEN, _CLOSED = 1, 2, 3
_NAMES: Final = {_MONITOR: "MONITOR", _OPEN: "OPEN_LOOP", _CLOSED: "CLOSED_LOOP"}
_ZERO, _HELD = 1, 2
_FULL: Final = 32767
_NEAR: Final = _FULL // 100
"""The tolerance of an output or a signal in counts."""
_STEP: Final = _FULL // 20
"""The largest change of an output in open loop."""
_CENTRES: Final = 2.0
"""Seconds within which a loop centres the beam."""
_SETTLES: Final = 0.1
_DARK: Final = 65535 // 50
"""A sum signal with hardly any light, in counts."""

_MODE: Final = ("QUAD_SET_OPERMODE", "QUAD_REQ_OPERMODE", "QUAD_GET_OPERMODE")
_STATUS: Final = ("QUAD_REQ_STATUSUPDATE", "QUAD_GET_STATUSUPDATE")
_OUTPUTS: Final = (
    "QUAD_SET_POSITIONOUTPUTS",
    "QUAD_REQ_POSITIONOUTPUTS",
    "QUAD_GET_POSITIONOUTPUTS",
)
_DEMANDS: Final = (
    "QUAD_SET_POSDEMANDPARAMS",
    "QUAD_REQ_POSDEMANDPARAMS",
    "QUAD_GET_POSDEMANDPARAMS",
)

MODE = Kind(
    name="quad-mode",
    title="The operating mode of a position aligner can be set, and its status shows it",
    rules=("quad-open-loop-outputs", "quad-status-on-request"),
)
OUTPUTS = Kind(
    name="quad-outputs",
    title="In open loop, the outputs of a position aligner can be set",
    rules=("quad-reading-ranges", "quad-open-loop-outputs"),
)
LOOP = Kind(
    name="quad-loop",
    title="In closed loop, a position aligner centres the beam within its demand limits",
    rules=("quad-closed-loop-outputs", "quad-demand-limits"),
)


class _Aligner(Output):
    """A position aligner during a check, which restores its outputs at the end."""

    def __init__(self, trial: Trial, place: Target, channel: int) -> None:
        super().__init__(trial, place, channel)
        motion = trial.allowed.motion
        assert motion is not None  # required for every output
        low, high = motion.in_counts(None if motion.unit == COUNTS else QUAD_VOLTS)
        self.span = max(low, -_FULL), min(high, _FULL)
        mode = self.ask(m.QuadReqOperMode()).mode
        self.demands = self.ask(m.QuadReqPosDemandParams()).values()
        before = self.status()
        self.outputs = before.x_pos, before.y_pos
        if not self.inside(before) or not self.span[0] <= 0 <= self.span[1]:
            self.give_up(
                f"{self.text}: the allowed range must include the present outputs {self.outputs} and 0"
            )
        trial.undo(f"outputs of {self.text}", partial(self._put_back, mode), moves=True)
        self._narrow()

    def status(self) -> Any:
        return self.ask(m.QuadReqStatusUpdate())

    def inside(self, status: Any, margin: int = 0) -> bool:
        low, high = self.span
        return all(low - margin <= at <= high + margin for at in (status.x_pos, status.y_pos))

    def demand(self, **changes: int) -> None:
        """Change position demand parameters within the allowed range."""
        self.send(m.QuadSetPosDemandParams(**{**self._narrowed(), **changes}))

    def set_mode(self, mode: int) -> Any:
        """Set a mode, judge what the unit reports, and return the status."""
        self.send(m.QuadSetOperMode(mode=mode))
        now = self.ask(m.QuadReqOperMode()).mode
        self.trial.need(
            now == mode,
            f"{self.text}: QUAD_SET_OPERMODE set {_NAMES[mode]}, but QUAD_GET_OPERMODE has the mode {now}",
            rule="get-answers-request",
            cause=Cause("QUAD_SET_OPERMODE", EFFECT),
        )
        status = self.status()
        bits = status.status_bits & 0b111
        self.trial.must(
            bits == 1 << mode - 1,
            f"{self.text}: in the mode {_NAMES[mode]}, QUAD_GET_STATUSUPDATE has the status bits {bits:#05b}",
            rule="quad-status-on-request",
            cause=Cause("QUAD_GET_STATUSUPDATE", "status_bits"),
        )
        return status

    def open_at_zero(self) -> None:
        """Open the loop with outputs of 0 V."""
        self.demand(open_loop_pos_demands=_ZERO)
        if self.ask(m.QuadReqOperMode()).mode == _OPEN:
            self.send(m.QuadSetPositionOutputs(x_pos=0, y_pos=0))
        self.set_mode(_OPEN)

    def _narrowed(self) -> Mapping[str, int]:
        low, high = self.span
        limits = {
            f"{axis}_pos_demand_{end}": min(
                max(self.demands[f"{axis}_pos_demand_{end}"], low), high
            )
            for axis in "xy"
            for end in ("min", "max")
        }
        return {**self.demands, **limits}

    def _narrow(self) -> None:
        self.send(m.QuadSetPosDemandParams(**self._narrowed()))

    def _put_back(self, mode: int) -> None:
        """Restore the parameters, the mode and, in open loop, the outputs."""
        self.demand(open_loop_pos_demands=_HELD)
        self.send(m.QuadSetOperMode(mode=_OPEN))
        x, y = self.outputs
        self.send(m.QuadSetPositionOutputs(x_pos=x, y_pos=y))
        self.send(m.QuadSetPosDemandParams(**self.demands))
        if mode != _OPEN:
            self.send(m.QuadSetOperMode(mode=mode))


@output_check(
    MODE,
    "The operating mode of {output} can be set, and its status shows it",
    messages=(*_MODE, *_STATUS, *_DEMANDS, *_OUTPUTS),
    does="sets each position aligner to monitor mode and to open loop, within {range}, and restores it",
    settings=True,
    lacks=lacks_volts,
)
def _mode(trial: Trial, place: Target, channel: int) -> None:
    unit = _Aligner(trial, place, channel)
    now = unit.status()
    if not all(unit.span[0] <= at <= unit.span[1] for at in (now.x_diff, now.y_diff)):
        unit.give_up(f"{unit.text}: the difference signals are outside of the allowed range")
    unit.open_at_zero()
    monitor = unit.set_mode(_MONITOR)
    for axis in "xy":
        signal, output = getattr(monitor, f"{axis}_diff"), getattr(monitor, f"{axis}_pos")
        trial.must(
            abs(signal - output) <= _NEAR,
            f"{unit.text}: in the mode MONITOR, QUAD_GET_STATUSUPDATE has {axis}_pos {output} and "
            f"{axis}_diff {signal}; they should be equal",
            rule="quad-open-loop-outputs",
            cause=Cause("QUAD_SET_OPERMODE", EFFECT),
        )
    opened = unit.set_mode(_OPEN)
    trial.must(
        max(abs(opened.x_pos), abs(opened.y_pos)) <= _NEAR,
        f"{unit.text}: after QUAD_SET_OPERMODE to OPEN_LOOP with outputs of zero, QUAD_GET_STATUSUPDATE has "
        f"{opened.x_pos} and {opened.y_pos}",
        rule="quad-open-loop-outputs",
        cause=Cause("QUAD_SET_OPERMODE", EFFECT),
    )


@output_check(
    OUTPUTS,
    "In open loop, the outputs of {output} can be set",
    messages=(*_OUTPUTS, *_MODE, *_STATUS, *_DEMANDS),
    does="sets the outputs of each position aligner to at most 5 % within {range}, and restores them",
    settings=True,
    lacks=lacks_volts,
)
def _outputs(trial: Trial, place: Target, channel: int) -> None:
    unit = _Aligner(trial, place, channel)
    unit.open_at_zero()
    low, high = unit.span
    least, most = max(-_STEP, low), min(_STEP, high)
    for x, y in ((most, least), (least, most), (0, 0)):
        unit.send(m.QuadSetPositionOutputs(x_pos=x, y_pos=y))
        told = unit.ask(m.QuadReqPositionOutputs())
        trial.line.listen(_SETTLES)
        now = unit.status()
        for name, is_ in ((told.layout.message, told), (now.layout.message, now)):
            trial.must(
                abs(is_.x_pos - x) <= _NEAR and abs(is_.y_pos - y) <= _NEAR,
                f"{unit.text}: QUAD_SET_POSITIONOUTPUTS set {x} and {y}, but {name} has {is_.x_pos} and "
                f"{is_.y_pos}",
                rule="quad-reading-ranges",
                cause=Cause("QUAD_SET_POSITIONOUTPUTS", EFFECT),
            )


@output_check(
    LOOP,
    "In closed loop, {output} centres the beam within its demand limits",
    messages=(*_MODE, *_STATUS, *_DEMANDS, *_OUTPUTS),
    does="closes the loop of each position aligner for 2 s, with outputs within {range}, and restores it",
    settings=True,
    seconds=2.1,
    lacks=lacks_volts,
)
def _loop(trial: Trial, place: Target, channel: int) -> None:
    unit = _Aligner(trial, place, channel)
    unit.open_at_zero()
    first = unit.status()
    if first.sum < _DARK:
        unit.give_up(f"{unit.text} has hardly any light, so its loop was not closed")
    unit.demand(open_loop_pos_demands=_HELD)
    unit.set_mode(_CLOSED)
    trial.line.listen(_CENTRES)
    closed = unit.status()
    trial.must(
        unit.inside(closed, _NEAR),
        f"{unit.text}: in closed loop, QUAD_GET_STATUSUPDATE has outputs of {closed.x_pos} and "
        f"{closed.y_pos}, beyond the limits {unit.span[0]} and {unit.span[1]} of QUAD_SET_POSDEMANDPARAMS",
        rule="quad-demand-limits",
        cause=Cause("QUAD_SET_POSDEMANDPARAMS", EFFECT),
    )
    for axis in "xy":
        before, after = getattr(first, f"{axis}_diff"), getattr(closed, f"{axis}_diff")
        output = getattr(closed, f"{axis}_pos")
        at_limit = min(abs(output - end) for end in unit.span) <= _NEAR
        if at_limit and _NEAR < abs(after) <= abs(before) + _NEAR:
            trial.info(
                f"{unit.text}: the {axis} output is at its limit, so the beam is not centred"
            )
            continue
        trial.must(
            abs(after) <= max(_NEAR, abs(before) // 10),
            f"{unit.text}: QUAD_SET_OPERMODE to CLOSED_LOOP took {axis}_diff from {before} to {after} in "
            f"{_CENTRES:g} s; it should be near zero",
            rule="quad-closed-loop-outputs",
            cause=Cause("QUAD_SET_OPERMODE", EFFECT),
        )
    held = unit.set_mode(_OPEN)
    trial.must(
        abs(held.x_pos - closed.x_pos) <= _NEAR and abs(held.y_pos - closed.y_pos) <= _NEAR,
        f"{unit.text}: QUAD_SET_OPERMODE to OPEN_LOOP should hold the outputs {closed.x_pos} and "
        f"{closed.y_pos}, but QUAD_GET_STATUSUPDATE has {held.x_pos} and {held.y_pos}",
        rule="quad-closed-loop-outputs",
        cause=Cause("QUAD_SET_OPERMODE", EFFECT),
    )
