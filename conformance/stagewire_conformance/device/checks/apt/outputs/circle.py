"""``nanotrak-circle``: the diameter of the circle of a NanoTrak (pages 256 to 261 of Issue 37).

The circle only becomes smaller. At the end, the check restores its parameters and the table of diameters.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from stagewire_apt import messages as m
from stagewire_conformance.device.causes import EFFECT, Cause
from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.apt.outputs.output_check import output_check
from stagewire_conformance.device.checks.apt.outputs.tracking import (
    MODE,
    STATUS,
    NanoTrak,
    lacks_counts,
)

if TYPE_CHECKING:
    from stagewire_conformance.device.targets import Target
    from stagewire_conformance.device.trial import Trial

_SOFTWARE, _BY_SIGNAL, _BY_RANGE = 1, 2, 3
_NEAR: Final = 65535 // 200
"""The tolerance of a diameter in counts."""
_SMALLEST: Final = 8 * _NEAR
"""The smallest circle in counts whose changes are visible."""

_PARAMETERS: Final = ("PZ_SET_NTCIRCPARAMS", "PZ_REQ_NTCIRCPARAMS", "PZ_GET_NTCIRCPARAMS")
_TABLE: Final = ("PZ_SET_NTCIRCDIALUT", "PZ_REQ_NTCIRCDIALUT", "PZ_GET_NTCIRCDIALUT")

KIND = Kind(
    name="nanotrak-circle",
    title="The diameter of the circle of a NanoTrak follows its mode",
    rules=("nanotrak-diameter-modes", "nanotrak-power-diameters", "nanotrak-lut-first"),
)


@output_check(
    KIND,
    "The diameter of the circle of {output} follows its mode",
    messages=(*_PARAMETERS, *_TABLE, *STATUS, *MODE),
    does="makes the circle of each latched NanoTrak smaller, and restores it",
    settings=True,
    seconds=0.3,
    lacks=lacks_counts,
)
def _circle(trial: Trial, place: Target, channel: int) -> None:
    unit = NanoTrak(trial, place, channel)
    if unit.tracks():
        unit.give_up(f"{unit.text} tracks, so its circle was not changed")
    before = unit.ask(m.PzReqNtCircParams()).values()
    table = unit.ask(m.PzReqNtCircDiaLut()).values()
    first = unit.status()
    if first.circ_dia < _SMALLEST:
        unit.give_up(f"{unit.text} has a circle of {first.circ_dia} counts, too small to judge")
    large, small = first.circ_dia // 2, first.circ_dia // 4

    def put_back() -> None:
        unit.send(m.PzSetNtCircDiaLut(**table))
        unit.send(m.PzSetNtCircParams(**before))

    trial.undo(f"circle of {unit.text}", put_back)
    by_power = {"abs_pwr_min_circ_dia": small, "abs_pwr_max_circ_dia": small}
    _set(unit, {**before, "circ_dia_mode": _SOFTWARE, "circ_dia_sw": large})
    _judge(unit, _SOFTWARE, large, "nanotrak-diameter-modes")
    _set(unit, {**before, "circ_dia_mode": _SOFTWARE, "circ_dia_sw": large, **by_power})
    _judge(unit, _SOFTWARE, large, "nanotrak-power-diameters")
    _set(unit, {**before, "circ_dia_mode": _BY_SIGNAL, "circ_dia_sw": large, **by_power})
    _judge(unit, _BY_SIGNAL, small, "nanotrak-diameter-modes")
    entry = f"lut_val_{first.range}"
    unit.send(m.PzSetNtCircDiaLut(**{**dict.fromkeys(table, small), entry: large}))
    _set(unit, {**before, "circ_dia_mode": _BY_RANGE, "circ_dia_sw": small})
    if unit.status().range == first.range:
        _judge(unit, _BY_RANGE, large, "nanotrak-lut-first")


def _set(unit: NanoTrak, values: dict[str, int]) -> None:
    unit.send(m.PzSetNtCircParams(**values))


def _judge(unit: NanoTrak, mode: int, diameter: int, rule: str) -> None:
    """Report a wrong diameter."""
    now = unit.status().circ_dia
    unit.trial.must(
        abs(now - diameter) <= _NEAR,
        f"{unit.text}: after PZ_SET_NTCIRCPARAMS with the diameter mode {mode}, PZ_GET_NTSTATUSUPDATE has a "
        f"diameter of {now}; expected {diameter}",
        rule=rule,
        cause=Cause("PZ_SET_NTCIRCPARAMS", EFFECT),
    )
