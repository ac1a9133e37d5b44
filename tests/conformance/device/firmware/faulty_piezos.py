"""Firmware of the newer piezo controllers and strain gauge readers: Issue 37 and programs of the vendor."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from firmware_defects import Change, Defect, Draw, Says, Takes, named, of
from firmware_frames import Frame
from firmware_line import Firmware

from stagewire_conformance.device.results import Result

_STATUS = "PZ_GET_PZSTATUSUPDATE"
_CLOSED_LOOP = 0x400
_ENABLED = 0x8000_0000


def _keeps(
    name: str, units: Sequence[str], setter: str, *fields: str, found_by: str = "readback"
) -> Defect:
    """Return firmware that stores a SET except some fields, which keep their values."""
    getter = setter.replace("_SET_", "_GET_")

    class Keeps(Firmware):
        def __init__(self) -> None:
            self._present: dict[tuple[int, str], int] = {}

        def says(self, frame: Frame) -> None:
            if frame.name == getter:
                self._present.update({(frame.place, field): frame[field] for field in fields})
            self.say(frame.raw)

        def takes(self, frame: Frame) -> None:
            for field in fields if frame.name == setter else ():
                frame = frame.with_(field, self._present.get((frame.place, field), frame[field]))
            self.pass_on(frame.raw)

    return Defect(1, name, of(found_by), lambda draw: (Keeps(), setter), units)


def _takes(name: str, units: Sequence[str], found_by: str, message: str, change: Change) -> Defect:
    """Return firmware that changes or drops a message to the controller."""
    return Defect(
        1, name, of(found_by), lambda draw: (Takes(named(message), change), message), units
    )


def _says(
    name: str,
    units: Sequence[str],
    found_by: str,
    message: str,
    change: Change,
    result: Result = Result.FAIL,
) -> Defect:
    """Return firmware that changes a message to the host."""

    def make(draw: Draw) -> tuple[Firmware, str]:
        return Says(named(message), change), message

    return Defect(1, name, of(found_by), make, units, result)


def _in_both_bays(frame: Frame) -> list[Frame]:
    return [frame, frame.to(0x43 - frame.dest)]  # 0x21 and 0x22


def _in_both_channels(frame: Frame) -> list[Frame]:
    return [frame.with_("chan_ident", channel) for channel in (1, 2)]


def _without_slew_limit(draw: Draw) -> tuple[Firmware, str]:
    """Return firmware that reports the slew rates that were set, but does not use them."""

    class Ignores(Firmware):
        def __init__(self) -> None:
            self._told: dict[int, Frame] = {}

        def takes(self, frame: Frame) -> None:
            if frame.name == "PZ_SET_TPZ_SLEWRATES":
                self._told[frame.place] = frame
                frame = frame.with_("slew_open", 0)
            self.pass_on(frame.raw)

        def says(self, frame: Frame) -> None:
            told = self._told.get(frame.place)
            if frame.name == "PZ_GET_TPZ_SLEWRATES" and told:
                frame = frame.with_("slew_open", told["slew_open"])
            self.say(frame.raw)

    return Ignores(), "PZ_SET_OUTPUTVOLTS"


def _accepts_volts_in_closed_loop(draw: Draw) -> tuple[Firmware, str]:
    """Return firmware that moves to the position with the number of a voltage."""

    class Accepts(Firmware):
        def __init__(self) -> None:
            self._mode = 1

        def takes(self, frame: Frame) -> None:
            if frame.name == "PZ_SET_POSCONTROLMODE":
                self._mode = frame["mode"]
            wrong = frame.name == "PZ_SET_OUTPUTVOLTS" and self._mode in (2, 4)
            self.pass_on(frame.renamed("PZ_SET_OUTPUTPOS").raw if wrong else frame.raw)

    return Accepts(), "PZ_SET_OUTPUTVOLTS"


def _field(name: str, change: Callable[[int], int]) -> Change:
    return lambda frame: [frame.with_(name, change(frame[name]))]


def _dropped(frame: Frame) -> list[Frame]:
    return []


def _second_sample_lost(frame: Frame) -> list[Frame]:
    return [] if frame["index"] == 1 else [frame]


def _swapped(one: str, other: str) -> Change:
    return lambda frame: [frame.with_(one, frame[other]).with_(other, frame[one])]


def _copied(one: str, other: str) -> Change:
    return lambda frame: [frame.with_(other, frame[one])]


_PRECISION = ("PPC001", "PPC102")
_BENCHTOP = ("BPC302", "BPC303")

PIEZOS = (
    _takes("A voltage to a bay also changes the other one", ("BPC302", "PPC102"), "piezo-volts",
           "PZ_SET_OUTPUTVOLTS", _in_both_bays),
    _takes("A voltage to a channel also changes the other one", ("MPZ601",), "piezo-volts",
           "PZ_SET_OUTPUTVOLTS", _in_both_channels),
    _takes("A precision piezo outputs half of the voltage", (*_PRECISION, "CT1P"), "piezo-volts",
           "PZ_SET_OUTPUTVOLTS", _field("voltage", lambda volts: volts // 2)),
    _says("A cube reports its voltage with the wrong sign", ("KPZ101", "KPC101"), "piezo-volts",
          _STATUS, _field("op_voltage", lambda volts: -volts)),
    _keeps("The voltage limit of a KPZ101 is ignored", ("KPZ101",), "PZ_SET_TPZ_IOSETTINGS",
           "voltage_limit", found_by="piezo-limit"),
    _keeps("The voltage limit of a KPC101 is ignored", ("KPC101",), "KPC_SET_IOSETTINGS",
           "voltage_limit", found_by="piezo-limit"),
    _keeps("The voltage range of a KPC101 is ignored", ("KPC101",), "KPC_SET_IOSETTINGS",
           "voltage_range", found_by="piezo-limit"),
    _keeps("The maximum voltage cannot be lowered", (*_BENCHTOP, *_PRECISION),
           "PZ_SET_OUTPUTMAXVOLTS", "voltage", found_by="piezo-limit"),
    _says("A cube never reports a closed loop", ("KPZ101", "KPC101"), "piezo-mode piezo-position",
          _STATUS, _field("status_bits", lambda bits: bits & ~_CLOSED_LOOP)),
    _says("A precision piezo always reports a closed loop", _PRECISION, "piezo-mode piezo-position",
          _STATUS, _field("status_bits", lambda bits: bits | _CLOSED_LOOP)),
    _says("The enabled bit of a precision piezo stays set", _PRECISION, "enable enabled-bit",
          "PZ_GET_PZSTATUSBITS", _field("status_bits", lambda bits: bits | _ENABLED)),
    _takes("A newer piezo ignores PZ_SET_ZERO", ("KPC101", *_BENCHTOP, "MPZ601"), "piezo-zero",
           "PZ_SET_ZERO", _dropped),
    _takes("A KSG101 ignores PZ_SET_ZERO", ("KSG101",), "piezo-zero", "PZ_SET_ZERO", _dropped),
    _takes("The travel that is set is halved", ("KPC101", *_BENCHTOP), "readback",
           "PZ_SET_MAXTRAVEL", _field("travel", lambda travel: travel // 2)),
    _says("A reading has the wrong sign", ("KSG101",), "strain-gauge", "PZ_GET_TSG_READING",
          _field("reading", lambda reading: -reading), Result.NON_STRICT),
    Defect(1, "The slew rate of a newer BPC is ignored", of("piezo-slew"), _without_slew_limit,
           _BENCHTOP),
    _takes("A cube loses the second sample of a waveform", ("KPZ101", "KPC101"), "piezo-lut",
           "PZ_SET_OUTPUTLUT", _second_sample_lost),
    _takes("A cube does not stop its waveform", ("KPZ101", "KPC101"), "piezo-lut",
           "PZ_STOP_LUTOUTPUT", _dropped),
    _takes("A newer piezo moves half of the way", ("KPZ101", "KPC101", *_PRECISION),
           "piezo-position", "PZ_SET_OUTPUTPOS", _field("position_sw", lambda counts: counts // 2)),
    Defect(1, "A newer piezo takes voltages in closed loop", of("piezo-position"),
           _accepts_volts_in_closed_loop, ("KPZ101", "KPC101", "PPC001")),
    _keeps("A preset of the wheel is not kept", ("KPZ101", "CT1P"), "KPZ_SET_KCUBEMMIPARAMS",
           "preset_volt2"),
    _takes("The voltage step of the wheel is also the position step", ("KPC101",), "readback",
           "KPC_SET_KCUBEMMIPARAMS", _copied("js_volt_step", "js_pos_step")),
    _keeps("The polarity of a port is not kept", ("KPZ101",), "KPZ_SET_KCUBETRIGIOCONFIG",
           "trig2_polarity"),
    _keeps("The upper limit of a reader is not kept", ("KSG101", "CT1P"),
           "KSG_SET_KCUBETRIGIOCONFIG", "upper_lim"),
    _keeps("The number of averaged samples is not kept", ("KSG101", "CT1P"),
           "KSG_SET_KCUBETRIGIOCONFIG", "smoothing_samples"),
    _takes("The limits of a KPC101 are exchanged", ("KPC101",), "readback",
           "KPC_SET_KCUBETRIGIOCONFIG", _swapped("lower_lim", "upper_lim")),
    _keeps("The timeout of a display is not kept", ("KSG101",), "KSG_SET_KCUBEMMIPARAMS",
           "disp_timeout"),
    _takes("Two constants of the loop are exchanged", (*_PRECISION, "CT1P"), "readback",
           "PZ_SET_PPC_PIDCONSTS", _swapped("pid_consts_p", "pid_consts_i")),
    _keeps("The derivative filter cannot be switched", (*_PRECISION, "CT1P"),
           "PZ_SET_PPC_PIDCONSTS", "pid_deriv_filter_on"),
    _takes("The second notch filter follows the first one", _PRECISION, "readback",
           "PZ_SET_PPC_NOTCHPARAMS", _copied("filter1_fc", "filter2_fc")),
    _keeps("The brightness of the lights is not kept", (*_PRECISION, "CT1P"),
           "PZ_SET_PPC_IOSETTINGS", "fp_brightness"),
    _keeps("The error window of a CT1P is not kept", ("CT1P",), "PZ_SET_PIDCRITERIA",
           "target_error_window"),
    _takes("A requested status is not sent", ("KPZ101", "KPC101", *_PRECISION, "CT1P"), "answers",
           "PZ_REQ_PZSTATUSUPDATE", _dropped),
)  # fmt: skip
