"""Firmware of piezos, solenoids and digital outputs with wrong outputs or wrong reports."""

from __future__ import annotations

from collections.abc import Callable

from firmware_defects import Change, Defect, Draw, NotHereError, Says, Takes, named, of
from firmware_frames import Frame
from firmware_line import Firmware

_PIEZO = "piezo-volts piezo-position piezo-mode piezo-lut piezo-zero"
_VOLTS = "PZ_SET_OUTPUTVOLTS"
_POSITION = "PZ_SET_OUTPUTPOS"
_MODE = "PZ_SET_POSCONTROLMODE"
_SAMPLE = "PZ_SET_OUTPUTLUT"
_LOOP = "piezo-mode piezo-position"
_STATUS = "PZ_GET_PZSTATUSUPDATE"
_SOLENOID = ("MOT_SET_SOL_STATE", "MOT_SET_SOL_OPERATINGMODE")


def _taken(seed: int, name: str, found_by: str, message: str, change: Change) -> Defect:
    """Return a defect in the effect of a message."""

    def make(draw: Draw) -> tuple[Firmware, str]:
        draw.claims(message, message.replace("_SET_", "_REQ_"))
        if message != _VOLTS:
            _senses(draw)
        return Takes(named(message), change), message

    return Defect(seed, name, of(found_by), make)


def _senses(draw: Draw) -> None:
    """Continue only if the actuator has position sensing, which closed loop needs."""
    draw.claims("PZ_REQ_OUTPUTPOS")
    if draw.unit_is("MPZ601", "RACK", "TSG001"):
        raise NotHereError


def _command(seed: int, name: str, found_by: str, message: str, change: Change) -> Defect:
    def make(draw: Draw) -> tuple[Firmware, str]:
        draw.claims(message)
        _senses(draw)
        return Takes(named(message), change), message

    return Defect(seed, name, of(found_by), make)


def _said(
    seed: int, name: str, found_by: str, message: str, change: Change, *, senses: bool = False
) -> Defect:
    def make(draw: Draw) -> tuple[Firmware, str]:
        draw.claims(message)
        if senses:
            _senses(draw)
        return Says(named(message), change), message

    return Defect(seed, name, of(found_by), make)


def _in_any_mode(setter: str, other: str, mode: int) -> Callable[[Draw], tuple[Firmware, str]]:
    """Return a piezo that accepts a voltage or a position in the mode in which it must be ignored.

    :param other: the message with the same effect in that mode.
    :param mode: the mode in which the message is valid: 1 for open loop, 2 for closed loop.
    """

    def make(draw: Draw) -> tuple[Firmware, str]:
        draw.claims(setter, other, _MODE)
        _senses(draw)

        class TakesAll(Firmware):
            def __init__(self) -> None:
                self._mode: dict[tuple[int, int | None], int] = {}

            def takes(self, frame: Frame) -> None:
                key = frame.dest, frame.channel
                if frame.name == _MODE:
                    self._mode[key] = frame["mode"]
                wrong = frame.name == setter and self._mode.get(key, 1) % 2 != mode % 2
                self.pass_on(frame.renamed(other).raw if wrong else frame.raw)

        return TakesAll(), setter

    return make


def _disobedient_solenoid(draw: Draw) -> tuple[Firmware, str]:
    setter = draw.one_of(*_SOLENOID)
    return Takes(named(setter), lambda frame: []), setter


def _enabling(state: int) -> Callable[[Draw], tuple[Firmware, str]]:
    def make(draw: Draw) -> tuple[Firmware, str]:
        draw.claims("MOD_SET_CHANENABLESTATE", "MOD_REQ_CHANENABLESTATE")
        return Takes(
            lambda f: f.name == "MOD_SET_CHANENABLESTATE" and f["enable_state"] == state,
            lambda f: [],
        ), "MOD_SET_CHANENABLESTATE"

    return make


def _never_announced(draw: Draw) -> tuple[Firmware, str]:
    """Do not report the maximum voltage or travel on its own after it was set."""
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


def _digital(seed: int, name: str, change: Callable[[int], int]) -> Defect:
    def make(draw: Draw) -> tuple[Firmware, str]:
        setter = draw.one_of("RACK_SET_DIGOUTPUTS")
        return Takes(named(setter), lambda f: [f.with_("dig_op", change(f["dig_op"]))]), setter

    return Defect(seed, name, of("digital-outputs"), make)


def _without(bits: int) -> Change:
    return lambda frame: [frame.with_("status_bits", frame["status_bits"] & ~bits)]


def _times(field: str, share: float) -> Change:
    return lambda frame: [frame.with_(field, int(frame[field] * share))]


def _shifted(frame: Frame) -> list[Frame]:
    return [frame.with_("index", frame["index"] + 1)]


def _without_second(frame: Frame) -> list[Frame]:
    return [] if frame["index"] == 1 else [frame]


OUTPUTS = (
    _taken(7, "A voltage is ignored", "piezo-volts", _VOLTS, lambda f: []),
    _taken(1, "A voltage is halved", "piezo-volts", _VOLTS, _times("voltage", 0.5)),
    _taken(15, "A voltage changes its sign", "piezo-volts", _VOLTS, _times("voltage", -1)),
    _taken(1, "A position is ignored", "piezo-position", _POSITION, lambda f: []),
    _taken(1, "A position is halved", "piezo-position", _POSITION, _times("position_sw", 0.5)),
    _taken(3, "The loop is never closed", _LOOP, _MODE, lambda f: [] if f["mode"] in (2, 4) else [f]),
    _taken(2, "The smooth modes are not supported", _LOOP, _MODE, lambda f: [] if f["mode"] > 2 else [f]),
    Defect(4, "A voltage is accepted in closed loop", of(_PIEZO), _in_any_mode(_VOLTS, _POSITION, 1)),
    Defect(9, "A position is accepted in open loop", of(_PIEZO), _in_any_mode(_POSITION, _VOLTS, 2)),
    _said(7, "The status reports half of the voltage", "piezo-volts status", _STATUS,
          _times("op_voltage", 0.5)),
    _said(3, "The status never reports a closed loop", f"{_LOOP} status", _STATUS, _without(0x400),
          senses=True),
    _command(1, "A waveform cannot be started", "piezo-lut", "PZ_START_LUTOUTPUT", lambda f: []),
    _command(6, "A waveform cannot be stopped", "piezo-lut", "PZ_STOP_LUTOUTPUT", lambda f: []),
    _command(12, "Samples of a waveform are shifted by one", "piezo-lut", _SAMPLE, _shifted),
    _command(12, "A waveform loses its second sample", "piezo-lut", _SAMPLE, _without_second),
    _command(4, "Zeroing is ignored", "piezo-zero", "PZ_SET_ZERO", lambda f: []),
    Defect(15, "A new maximum voltage is not announced", of("readback"), _never_announced),
    Defect(6, "A solenoid does not obey", of("solenoid-state solenoid-mode"), _disobedient_solenoid),
    Defect(6, "A channel cannot be disabled", of("enable"), _enabling(2)),
    Defect(1, "A channel cannot be enabled", of("enable"), _enabling(1)),
    _digital(1, "Digital outputs cannot be set", lambda bits: 0),
    _digital(1, "A digital output is stuck", lambda bits: bits | 0x04),
    _digital(1, "Digital outputs are exchanged", lambda bits: bits >> 1 | bits << 3 & 0x08),
)  # fmt: skip
