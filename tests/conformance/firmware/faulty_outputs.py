"""Firmware of piezos, solenoids and outputs that puts out what it was not told to, or tells it wrongly."""

from __future__ import annotations

from collections.abc import Callable

from firmware_defects import Change, Defect, Draw, NotHereError, Says, Takes
from firmware_frames import Frame
from firmware_line import Firmware

__all__ = ["OUTPUTS"]

_PIEZO = frozenset({"piezo-volts", "piezo-position", "piezo-mode", "piezo-lut", "piezo-zero"})


def _taken(name: str, found_by: str, message: str, change: Change) -> Defect:
    """Return a defect in what becomes of a message."""

    def make(draw: Draw) -> tuple[Firmware, str]:
        draw.claims(message, message.replace("_SET_", "_REQ_"))
        if message != "PZ_SET_OUTPUTVOLTS":
            _senses(draw)
        return Takes(lambda frame: frame.name == message, change), message

    return Defect(name, frozenset(found_by.split()), make)


def _senses(draw: Draw) -> None:
    """Go on if the actuator has position sensing, without which no loop is closed."""
    draw.claims("PZ_REQ_OUTPUTPOS")
    if draw.unit_is("MPZ601", "RACK", "TSG001"):
        raise NotHereError


def _command(name: str, found_by: str, message: str, change: Change) -> Defect:
    def make(draw: Draw) -> tuple[Firmware, str]:
        draw.claims(message)
        _senses(draw)
        return Takes(lambda frame: frame.name == message, change), message

    return Defect(name, frozenset(found_by.split()), make)


def _said(name: str, found_by: str, message: str, change: Change) -> Defect:
    def make(draw: Draw) -> tuple[Firmware, str]:
        draw.claims(message)
        if "closed loop" in name:
            _senses(draw)
        return Says(lambda frame: frame.name == message, change), message

    return Defect(name, frozenset(found_by.split()), make)


def _in_any_mode(setter: str, other: str, mode: int) -> Callable[[Draw], tuple[Firmware, str]]:
    """Return a piezo that heeds a voltage, or a position, in the mode in which it is to be ignored.

    :param other: what does the same in that mode.
    :param mode: that in which it is taken by right: 1, open loop, or 2, closed loop.
    """

    def make(draw: Draw) -> tuple[Firmware, str]:
        draw.claims(setter, other, "PZ_SET_POSCONTROLMODE")
        _senses(draw)

        class TakesAll(Firmware):
            def __init__(self) -> None:
                self._mode: dict[tuple[int, int | None], int] = {}

            def takes(self, frame: Frame) -> None:
                key = frame.dest, frame.channel
                if frame.name == "PZ_SET_POSCONTROLMODE":
                    self._mode[key] = frame["mode"]
                wrong = frame.name == setter and self._mode.get(key, 1) % 2 != mode % 2
                self.pass_on(frame.renamed(other).raw if wrong else frame.raw)

        return TakesAll(), setter

    return make


def _other_solenoid(draw: Draw) -> tuple[Firmware, str]:
    setter = draw.one_of("MOT_SET_SOL_STATE", "MOT_SET_SOL_OPERATINGMODE")
    return Takes(lambda frame: frame.name == setter, lambda frame: []), setter


def _enabling(state: int) -> Callable[[Draw], tuple[Firmware, str]]:
    def make(draw: Draw) -> tuple[Firmware, str]:
        draw.claims("MOD_SET_CHANENABLESTATE", "MOD_REQ_CHANENABLESTATE")
        return Takes(
            lambda f: f.name == "MOD_SET_CHANENABLESTATE" and f["enable_state"] == state,
            lambda f: [],
        ), "MOD_SET_CHANENABLESTATE"

    return make


def _never_announced(draw: Draw) -> tuple[Firmware, str]:
    """Do not tell the maximum voltage, or travel, by itself when it has been set."""
    draw.claims("PZ_SET_OUTPUTMAXVOLTS", "PZ_REQ_OUTPUTMAXVOLTS")
    silent = draw.random.choice(("PZ_GET_OUTPUTMAXVOLTS", "PZ_GET_MAXTRAVEL"))

    class Silent(Firmware):
        def __init__(self) -> None:
            self._at = -1.0

        def takes(self, frame: Frame) -> None:
            if frame.name == "PZ_SET_OUTPUTMAXVOLTS":
                self._at = self.now()
            elif frame.name in ("PZ_REQ_OUTPUTMAXVOLTS", "PZ_REQ_MAXTRAVEL"):
                self._at = -1.0
            self.pass_on(frame.raw)

        def says(self, frame: Frame) -> None:
            if frame.name != silent or self._at < 0:
                self.say(frame.raw)

    return Silent(), "PZ_SET_OUTPUTMAXVOLTS"


def _digital(draw: Draw, change: Callable[[int], int]) -> tuple[Firmware, str]:
    draw.claims("RACK_SET_DIGOUTPUTS", "RACK_REQ_DIGOUTPUTS")
    return Takes(
        lambda f: f.name == "RACK_SET_DIGOUTPUTS", lambda f: [f.with_("dig_op", change(f["dig_op"]))]
    ), "RACK_SET_DIGOUTPUTS"


OUTPUTS = (
    _taken("A voltage is ignored", "piezo-volts", "PZ_SET_OUTPUTVOLTS", lambda f: []),
    _taken("A voltage is halved", "piezo-volts", "PZ_SET_OUTPUTVOLTS", lambda f: [f.with_("voltage", f["voltage"] // 2)]),
    _taken("A voltage changes its sign", "piezo-volts", "PZ_SET_OUTPUTVOLTS", lambda f: [f.with_("voltage", -f["voltage"])]),
    _taken("A position is ignored", "piezo-position", "PZ_SET_OUTPUTPOS", lambda f: []),
    _taken("A position is halved", "piezo-position", "PZ_SET_OUTPUTPOS", lambda f: [f.with_("position_sw", f["position_sw"] // 2)]),
    _taken("The loop is never closed", "piezo-mode piezo-position", "PZ_SET_POSCONTROLMODE", lambda f: [] if f["mode"] in (2, 4) else [f]),
    _taken("The smooth modes are not known", "piezo-mode piezo-position", "PZ_SET_POSCONTROLMODE", lambda f: [] if f["mode"] > 2 else [f]),
    Defect("A voltage is taken in closed loop", _PIEZO, _in_any_mode("PZ_SET_OUTPUTVOLTS", "PZ_SET_OUTPUTPOS", 1)),
    Defect("A position is taken in open loop", _PIEZO, _in_any_mode("PZ_SET_OUTPUTPOS", "PZ_SET_OUTPUTVOLTS", 2)),
    _said("The status tells half of the voltage", "piezo-volts status", "PZ_GET_PZSTATUSUPDATE", lambda f: [f.with_("op_voltage", f["op_voltage"] // 2)]),
    _said("The status never tells a closed loop", "piezo-mode piezo-position status", "PZ_GET_PZSTATUSUPDATE", lambda f: [f.with_("status_bits", f["status_bits"] & ~0x400)]),
    _command("A waveform cannot be started", "piezo-lut", "PZ_START_LUTOUTPUT", lambda f: []),
    _command("A waveform cannot be stopped", "piezo-lut", "PZ_STOP_LUTOUTPUT", lambda f: []),
    _command("Samples of a waveform are shifted by one", "piezo-lut", "PZ_SET_OUTPUTLUT", lambda f: [f.with_("index", f["index"] + 1)]),
    _command("A waveform loses its second sample", "piezo-lut", "PZ_SET_OUTPUTLUT", lambda f: [] if f["index"] == 1 else [f]),
    _command("Zeroing is ignored", "piezo-zero", "PZ_SET_ZERO", lambda f: []),
    Defect("A new maximum voltage is not announced", frozenset({"readback"}), _never_announced),
    Defect("A solenoid does not obey", frozenset({"solenoid-state", "solenoid-mode"}), _other_solenoid, ("TSC001",)),
    Defect("A channel cannot be disabled", frozenset({"enable"}), _enabling(2)),
    Defect("A channel cannot be enabled", frozenset({"enable"}), _enabling(1)),
    Defect("Digital outputs cannot be set", frozenset({"digital-outputs"}), lambda draw: _digital(draw, lambda n: 0)),
    Defect("A digital output is stuck", frozenset({"digital-outputs"}), lambda draw: _digital(draw, lambda n: n | 0x04)),
    Defect("Digital outputs are exchanged", frozenset({"digital-outputs"}), lambda draw: _digital(draw, lambda n: n >> 1 | n << 3 & 0x08)),
)
