"""Firmware of lasers, temperature controllers and K-Cube shutters with wrong outputs or wrong reports."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from firmware_defects import Change, Defect, Draw, Echoes, Says, Takes, named, of
from firmware_frames import HOST, ID, Frame
from firmware_line import Firmware

from stagewire_conformance.device.results import Result

_SOURCES = ("KLS101", "KLS635", "KLS1550", "TLS001")
_DRIVERS = ("KLD101", "TLD001")
_LASERS = (*_SOURCES, *_DRIVERS)
_TEC = ("TTC001",)
_LIGHT = "laser-output"
_POINT = "LA_SET_POWERSETPOINT"
_SOURCE = "LA_SET_POWERCONTROLSOURCE"
_STATUS = ("LA_GET_STATUSUPDATE", "LD_GET_STATUSUPDATE")
_READINGS = ("LA_GET_CURRENTANDPOWER", "LD_GET_CURRENTANDPOWER")
_ON, _OFF = "LA_ENABLEOUTPUT", "LA_DISABLEOUTPUT"
_LIMIT = "LD_SET_MAXCURRENTDIGPOT"


def _plain(name: str) -> bytes:
    """Return a message without values from the host."""
    return ID[name].to_bytes(2, "little") + bytes((0, 0, 0x50, HOST))


def _taken(
    name: str,
    found_by: str,
    message: str,
    change: Change,
    units: Sequence[str] = _LASERS,
    ends: str = "",
) -> Defect:
    """Return a defect in the effect of a message."""

    def make(draw: Draw) -> tuple[Firmware, str]:
        return Takes(named(message), change), message

    return Defect(1, name, of(found_by), make, units, ends=ends)


def _said(
    name: str,
    found_by: str,
    messages: Sequence[str],
    change: Change,
    units: Sequence[str] = _LASERS,
    *,
    seed: int = 1,
) -> Defect:
    """Return a defect in what a message reports."""

    def make(draw: Draw) -> tuple[Firmware, str]:
        return Says(named(*messages), change), draw.one_of(*messages)

    return Defect(seed, name, of(found_by), make, units)


def _to(field: str, change: Callable[[int], int]) -> Change:
    return lambda frame: [frame.with_(field, change(frame[field]))]


def _without(bits: int) -> Change:
    return _to("status_bits", lambda value: value & ~bits)


def _with(bits: int) -> Change:
    return _to("status_bits", lambda value: value | bits)


def _dropped(frame: Frame) -> list[Frame]:
    return []


def _then_on(frame: Frame) -> list[Frame | bytes]:
    return [frame, _plain(_ON)]


def _both(change: Callable[[Frame], Frame]) -> Change:
    """Return a change of the current and of the power."""

    def both(frame: Frame) -> list[Frame]:
        return [change(frame)]

    return both


def _dark(frame: Frame) -> Frame:
    return frame.patched(6, bytes(4))  # both words


class _OnAtPowerOn(Firmware):
    """Switches the output on with the first message."""

    def __init__(self) -> None:
        self._begun = False

    def takes(self, frame: Frame) -> None:
        if not self._begun:
            self._begun = True
            self.pass_on(_plain(_ON))
        self.pass_on(frame.raw)


class _Brighter(Firmware):
    """Uses ten times the set point that it reports."""

    def takes(self, frame: Frame) -> None:
        self.pass_on(
            frame.with_("set_point", frame["set_point"] * 10).raw
            if frame.name == _POINT
            else frame.raw
        )

    def says(self, frame: Frame) -> None:
        self.say(
            frame.with_("set_point", frame["set_point"] // 10).raw
            if frame.name == "LA_GET_POWERSETPOINT"
            else frame.raw
        )


class _LimitIgnored(Firmware):
    """Returns the limit that was set, and does not use it."""

    def __init__(self) -> None:
        self._limit: int | None = None

    def takes(self, frame: Frame) -> None:
        if frame.name == _LIMIT:
            self._limit = frame["max_current"]
        elif frame.name != "LD_MAXCURRENTADJUST":
            self.pass_on(frame.raw)

    def says(self, frame: Frame) -> None:
        if frame.name == "LD_GET_MAXCURRENTDIGPOT" and self._limit is not None:
            frame = frame.with_("max_current", self._limit)
        self.say(frame.raw)


def _own(
    name: str,
    found_by: str,
    firmware: Callable[[], Firmware],
    about: str,
    units: Sequence[str] = _LASERS,
    result: Result = Result.FAIL,
    *,
    ends: str = "",
) -> Defect:
    return Defect(1, name, of(found_by), lambda draw: (firmware(), about), units, result, ends)


LASERS = (
    _own("A laser is on at power-on", _LIGHT, _OnAtPowerOn, _ON, result=Result.NOT_RUN,
         ends="the output of 0x50 was on when the run began, so the suite left it on and wrote no setting or "
         "output; switch it off and run the suite again"),
    _taken("A laser cannot be switched off", _LIGHT, _OFF, _dropped,
           ends="the output of 0x50 is still on after it was switched off"),
    _taken("A laser cannot be switched on", _LIGHT, _ON, _dropped),
    _taken("A set point switches a laser on", _LIGHT, _POINT, _then_on),
    _taken("A set point of a laser is not kept", _LIGHT, _POINT, _dropped),
    _taken("A set point of a laser is halved", _LIGHT, _POINT, _to("set_point", lambda v: v // 2)),
    _taken("A set point of a laser has eight bits", _LIGHT, _POINT, _to("set_point", lambda v: v & 255)),
    _own("A laser is ten times brighter than its set point", _LIGHT, _Brighter, _POINT),
    _said("A laser never reports that it is on", f"{_LIGHT} status", _STATUS, _without(1)),
    _said("The status bits alone never report that a laser is on", f"{_LIGHT} status", ("LA_GET_STATUSBITS",),
          _without(1)),
    _said("A laser that is off reports that it is on", "status", _STATUS, _with(1)),
    _said("A laser reports no key switch", f"{_LIGHT} status", (*_STATUS, "LA_GET_STATUSBITS"), _without(2)),
    _said("A laser reports an open interlock", f"{_LIGHT} status", (*_STATUS, "LA_GET_STATUSBITS"),
          _without(8)),
    _said("A laser source reports a current while it is off", "laser-status", _STATUS,
          _to("laser_current", lambda v: v + 3000), _SOURCES),
    _said("A diode driver reports a current while it is off", "laser-status", _STATUS,
          _to("laser_current", lambda v: v + 3000), _DRIVERS),
    _said("A laser reports no light", _LIGHT, (*_STATUS, *_READINGS), _both(_dark)),
    _said("The readings of a laser disagree with its status", f"{_LIGHT} laser-status", _READINGS,
          _to("laser_power", lambda v: v + 2000)),
    _said("A diode driver reports two ranges of its photodiode", "laser-status", _STATUS, _with(0x30),
          _DRIVERS),
    _said("A TLS001 reports no display", "laser-status", _STATUS, _without(0x70), ("TLS001",)),
    _taken("A source of the set point is not kept", "laser-source", _SOURCE, _dropped),
    _taken("A wheel cannot be selected", "laser-source", _SOURCE,
           lambda f: [] if f["laser_source"] == 4 else [f]),
    _taken("A source switches a laser on", "laser-source", _SOURCE, _then_on),
    _taken("Constant power cannot be selected", "laser-mode", "LD_CLOSEDLOOP", _dropped, _DRIVERS),
    _taken("Constant current cannot be selected", "laser-mode", "LD_OPENLOOP", _dropped, _DRIVERS),
    _taken("A limit of the current is not kept", "laser-limit", _LIMIT, _dropped, _DRIVERS),
    _own("A limit of the current is ignored", "laser-limit", _LimitIgnored, _LIMIT, _DRIVERS),
    _said("The maximum current ignores the limit", "laser-limit", ("LD_GET_MAXCURRENT",),
          _to("max_current", lambda v: 32767), _DRIVERS),
    _said("A diode driver never reports its limit", "laser-limit", _STATUS, _without(0x400), _DRIVERS),
    _said("A set point is returned as another sub-message", "answers", ("LA_GET_POWERSETPOINT",),
          _to("sub_message", lambda v: 5)),
)  # fmt: skip


def _answered(name: str, signs: Sequence[str], units: Sequence[str]) -> Defect:
    """Return a defect that answers a keep-alive message."""

    def make(draw: Draw) -> tuple[Firmware, str]:
        return Echoes(named(*signs)), draw.one_of(*signs)

    return Defect(1, name, of("keep-alive-reply"), make, units)


_TEC_STATUS = ("TEC_GET_STATUSUPDATE",)

TEC = (
    _taken("A temperature is not kept", "tec-set-point", "TEC_SET_TEMPSETPOINT", _dropped, _TEC),
    _said("The readings have another set point", "tec-set-point tec-status", ("TEC_GET_READINGS",),
          _to("t_set", lambda v: v + 5), _TEC),
    _taken("A limit of a TEC is not kept", "tec-limit", "TEC_SET_IOSETTINGS", _dropped, _TEC),
    _said("A TEC reports a current while it is off", "tec-status", _TEC_STATUS,
          _to("i_tec", lambda v: 50), _TEC),
    _said("A TEC reports a current above its limit", "tec-status", ("TEC_GET_READINGS",),
          _to("i_tec", lambda v: 1999), _TEC),
    _said("A temperature is out of range", "tec-status", ("TEC_GET_READINGS", *_TEC_STATUS),
          _to("t_act", lambda v: -4600), _TEC),
    _said("A temperature is in the unit of another sensor", "tec-status", ("TEC_GET_READINGS", *_TEC_STATUS),
          _to("t_act", lambda v: 15000), _TEC),
    _said("A TEC does not report its display", "tec-status status", _TEC_STATUS, _without(0xF0), _TEC),
    _said("Readings of a TEC are another sub-message", "answers", ("TEC_GET_READINGS",),
          _to("sub_message", lambda v: 1), _TEC),
)  # fmt: skip

KEEP_ALIVE = (
    _answered(
        "A laser answers its keep-alive", ("LA_ACK_STATUSUPDATE", "LD_ACK_STATUSUPDATE"), _LASERS
    ),
    _answered("A TEC answers its keep-alive", ("TEC_ACK_STATUSUPDATE",), _TEC),
    _answered(
        "A NanoTrak answers its keep-alive", ("PZ_ACK_NTSTATUSUPDATE",), ("TNA001", "KNA101")
    ),
    _answered(
        "A position aligner answers its keep-alive",
        ("QUAD_ACK_STATUSUPDATE",),
        ("KPA101", "TPA101"),
    ),
    _answered(
        "An inertial drive answers its keep-alive", ("PZMOT_ACK_STATUSUPDATE",), ("KIM101", "PDXC2")
    ),
)

SHUTTERS = (
    _taken("A shutter does not open", "solenoid-state", "MOT_SET_SOL_STATE",
           lambda f: [] if f["state"] == 1 else [f], ("KSC101",)),
    _taken("A shutter does not close", "solenoid-state", "MOT_SET_SOL_STATE",
           lambda f: [] if f["state"] == 2 else [f], ("KSC101",)),
    _taken("An interlock cannot be required", "interlock-mode", "MOT_SET_SOL_INTERLOCKMODE",
           lambda f: [f.with_("interlock_mode", 2)], ("KSC101",)),
)  # fmt: skip

LIGHT = (*LASERS, *TEC, *KEEP_ALIVE, *SHUTTERS)
