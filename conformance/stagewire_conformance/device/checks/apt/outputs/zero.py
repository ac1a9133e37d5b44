"""``piezo-zero``: zeroing outputs zero volts, and makes the reading there the new zero (page 117).

The previous zero cannot be read, and is lost; the description shown before the run says so.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from stagewire_apt import messages as m
from stagewire_apt.enumerations import DisplayMode
from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.apt.outputs.output_check import lacks_volts, output_check
from stagewire_conformance.device.checks.apt.outputs.piezo import (
    FULL_SCALE,
    OPEN,
    Piezo,
    needs_a_gauge,
)

if TYPE_CHECKING:
    from stagewire_conformance.device.declaration import Declaration
    from stagewire_conformance.device.permissions import Permissions
    from stagewire_conformance.device.targets import Target
    from stagewire_conformance.device.trial import Trial


_VOLTS: Final = (
    "PZ_REQ_POSCONTROLMODE",
    "PZ_GET_POSCONTROLMODE",
    "PZ_SET_OUTPUTVOLTS",
    "PZ_REQ_OUTPUTVOLTS",
    "PZ_GET_OUTPUTVOLTS",
)
_READING: Final = (
    "PZ_REQ_TSG_READING",
    "PZ_GET_TSG_READING",
    "PZ_REQ_TSG_IOSETTINGS",
    "PZ_GET_TSG_IOSETTINGS",
)
_STATUS: Final = ("HW_START_UPDATEMSGS", "HW_STOP_UPDATEMSGS", "PZ_GET_PZSTATUSUPDATE")
_PATIENCE: Final = 30.0
"""Seconds within which a channel must be zeroed."""
_NEAR: Final = FULL_SCALE // 50
"""The tolerance of a zero reading in counts."""


_TITLE: Final = "After PZ_SET_ZERO, the reading of {output} at zero volts is 0"
_DOES: Final = (
    "zeroes each channel: outputs 0 V, and makes the reading there the zero of all later "
    "positions; the previous zero is lost"
)


def _lacks(declared: Declaration, allowed: Permissions, place: Target) -> str:
    puts_out = "PZ_REQ_OUTPUTVOLTS" in place.listed
    return lacks_volts(declared, allowed, place) if puts_out else ""


KIND = Kind(
    name="piezo-zero",
    title="After zeroing, the reading at zero volts is position 0",
    rules=("zero-applies-zero-volts", "zero-sets-reference"),
)


@output_check(
    KIND, _TITLE, messages=("PZ_SET_ZERO", *_VOLTS, *_STATUS), does=_DOES, lacks=_lacks, seconds=1.0
)
def _zero(trial: Trial, place: Target, channel: int) -> None:
    piezo = Piezo(trial, place, channel)
    if piezo.mode not in OPEN:
        piezo.give_up(f"{piezo.text} is in closed loop, where a new zero would move it")
    before = piezo.volts
    low, high = piezo.span("output_volts")
    piezo.step(before, (low, high))
    if not low <= 0 <= high:
        piezo.give_up(f"{piezo.text}: zeroing outputs 0 V; allow a range that includes it")
    piezo.begin()
    first = piezo.status()
    needs_a_gauge(piezo, first.bits)
    trial.undo(
        f"output voltage of {piezo.text}",
        lambda: piezo.send(m.PzSetOutputVolts(channel, before)),
        moves=True,
    )
    piezo.send(m.PzSetZero(channel))
    end = trial.line.now + _PATIENCE
    status = piezo.status()
    while not status.bits.zeroed or status.bits.zeroing:
        if status.time > end:
            trial.must(
                False,
                f"{piezo.text}: {_PATIENCE:g} s after PZ_SET_ZERO, {status.heard.name} still "
                "does not report zeroed",
                came=status.heard.raw,
                rule="zero-sets-reference",
            )
            return
        status = piezo.status()
    for what, value in (("voltage", status.voltage), ("position", status.position)):
        trial.must(
            abs(value) <= _NEAR,
            f"{piezo.text} reports that it has been zeroed, but {status.heard.name} has a "
            f"{what} of {value}; it should be 0",
            came=status.heard.raw,
            rule="zero-applies-zero-volts" if "volt" in what else "zero-sets-reference",
        )


@output_check(
    KIND, _TITLE, messages=("PZ_SET_ZERO", *_READING), does=_DOES, lacks=_lacks, seconds=1.0
)
def _zero_reading(trial: Trial, place: Target, channel: int) -> None:
    mode = trial.reply(m.PzReqTsgIoSettings(channel), place.address).message.display_mode
    if mode == DisplayMode.DISPUNITS_VOLTAGE:
        trial.inconclusive(
            f"{place.name} shows its signal in volts, and the document does not say that "
            "zeroing applies to volts"
        )
        return
    trial.line.send(m.PzSetZero(channel), place.address)
    end = trial.line.now + _PATIENCE / 3
    while True:
        heard = trial.reply(m.PzReqTsgReading(channel), place.address)
        if abs(heard.message.reading) <= _NEAR and trial.line.now > end - _PATIENCE / 3 + 1.5:
            return
        if trial.line.now > end:
            trial.must(
                False,
                f"{place.name} channel {channel}: after PZ_SET_ZERO, {heard.name} still reports "
                f"{heard.message.reading}; it should report 0",
                came=heard.raw,
                rule="zero-sets-reference",
            )
            return
        trial.line.listen(0.1)
