"""Sets that the registry allows, and that a piezo channel does not take at this instant."""

from __future__ import annotations

from stagewire import FramedMessage
from stagewire_apt import messages as m
from stagewire_apt.flags import LutOutputMode
from stagewire_virtual.thorlabs_apt.piezo.drive import CLOSED_LOOP_MODES, Drive
from stagewire_virtual.thorlabs_apt.piezo.generator import WaveformGenerator

__all__ = ["refusal"]


def refusal(message: FramedMessage, drive: Drive) -> str | None:
    """Return why a message is not taken, or None if it is."""
    match message:
        case m.PzSetPosControlMode(mode=mode) if mode in CLOSED_LOOP_MODES:
            if not drive.has_strain_gauge:
                return "a closed loop needs a strain gauge, and the actuator has none (page 94)"
        case m.PzSetOutputVolts() | m.PzSetOutputPos() if drive.zeroing:
            return "the channel is being zeroed"
        case m.PzSetOutputVolts() if drive.closed_loop:
            return "an output voltage is ignored in closed loop (page 96)"
        case m.PzSetOutputPos() if not drive.closed_loop:
            return "an output position is ignored in open loop (page 97)"
        case m.PzSetOutputLut(index=index) if index > drive.generator.last_index:
            return f"the table ends at index {drive.generator.last_index} (page 106)"
        case m.PzSetOutputLutParams():
            return _lut_refusal(message, drive.generator)
    return None


def _lut_refusal(message: m.PzSetOutputLutParams, generator: WaveformGenerator) -> str | None:
    most = generator.last_index
    if message.cycle_length > most or message.trig_repeat_cycle > most:
        return f"a cycle and the distance of triggers have at most {most} samples (page 109)"
    triggers = generator.has_triggers and LutOutputMode(message.mode).outputlut_outputtrig
    if triggers and not 1 <= message.op_trig_start < message.cycle_length:
        return (
            "the trigger output starts at a sample from 1 on and below the cycle length (page 110)"
        )
    return None
