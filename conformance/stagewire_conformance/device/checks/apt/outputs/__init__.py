"""Checks of what is switched and put out: channels and their loops, piezos, the solenoid, digital outputs."""

from __future__ import annotations

from typing import Final

from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.apt.outputs import (
    digital,
    enable,
    loops,
    lut,
    piezo_outputs,
    slew,
    solenoid,
    zero,
)

KINDS: Final[tuple[Kind, ...]] = (
    loops.KIND,
    enable.KIND,
    digital.KIND,
    piezo_outputs.VOLTS,
    piezo_outputs.POSITION,
    piezo_outputs.MODE,
    slew.KIND,
    lut.KIND,
    zero.KIND,
    solenoid.STATE,
    solenoid.MODE,
    solenoid.INTERLOCK,
)
"""In the order in which they are run."""
