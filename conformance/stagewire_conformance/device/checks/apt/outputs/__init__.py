"""Checks of outputs: channels and loops, piezos, solenoids, digital outputs, NanoTraks, position aligners."""

from __future__ import annotations

from typing import Final

from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.apt.outputs import (
    aligner,
    circle,
    enable,
    flipper,
    laser,
    limits,
    lut,
    piezo_outputs,
    reading,
    solenoid,
    tec,
    tracking,
    zero,
)

KINDS: Final[tuple[Kind, ...]] = (
    enable.LOOPS,
    enable.ENABLE,
    solenoid.DIGITAL,
    piezo_outputs.VOLTS,
    piezo_outputs.POSITION,
    piezo_outputs.MODE,
    piezo_outputs.SLEW,
    limits.KIND,
    lut.KIND,
    reading.KIND,
    zero.KIND,
    solenoid.STATE,
    solenoid.MODE,
    solenoid.INTERLOCK,
    flipper.POSITIONS,
    flipper.TIME,
    laser.STATUS,
    laser.SOURCE,
    laser.MODE,
    laser.OUTPUT,
    laser.LIMIT,
    tec.STATUS,
    tec.SET_POINT,
    tec.LIMIT,
    tracking.TRACKING,
    tracking.RANGE,
    circle.KIND,
    aligner.MODE,
    aligner.OUTPUTS,
    aligner.LOOP,
)
"""The kinds in the order in which they run."""
