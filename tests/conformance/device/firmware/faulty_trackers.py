"""Firmware of NanoTraks and position aligners with wrong modes, positions, readings or outputs."""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence

from firmware_defects import Change, Defect, Draw, Says, Takes, named, of
from firmware_frames import Frame
from firmware_line import Firmware

_NANOTRAKS = ("KNA101", "TNA001", "BNT001", "MNA601")
_ALIGNERS = ("KPA101", "TPA101", "TQD001")
_SET_MODE = "PZ_SET_NTMODE"
_GET_MODE = "PZ_GET_NTMODE"
_SET_HOME = "PZ_SET_NTCIRCHOMEPOS"
_MOVE = "PZ_MOVE_NTCIRCTOHOMEPOS"
_STATUS = "PZ_GET_NTSTATUSUPDATE"
_SET_RANGE = "PZ_SET_NTTIARANGEPARAMS"
_SET_CIRCLE = "PZ_SET_NTCIRCPARAMS"
_SET_TABLE = "PZ_SET_NTCIRCDIALUT"

_OPERMODE, _DEMANDS, _OUTPUTS = 0x07, 0x05, 0x0D
"""Numbers of sub-messages (pages 333 to 341)."""
_QUAD_STATUS = 0x0881
_X_DIFF, _Y_DIFF, _X_POS, _Y_POS, _BITS = 6, 8, 12, 14, 16
"""Places of the values in a status frame (page 351)."""


def _defect(
    seed: int, name: str, kind: str, units: Sequence[str], about: str, make: Callable[[], Firmware]
) -> Defect:
    def made(draw: Draw) -> tuple[Firmware, str]:
        return make(), about

    return Defect(seed, name, of(kind), made, units)


def _taken(seed: int, name: str, kind: str, message: str, change: Change) -> Defect:
    """Return a defect in the effect of a message of NanoTraks."""
    return _defect(seed, name, kind, _NANOTRAKS, message, lambda: Takes(named(message), change))


def _said(seed: int, name: str, kind: str, message: str, change: Change) -> Defect:
    """Return a defect in a message from NanoTraks."""
    return _defect(seed, name, kind, _NANOTRAKS, message, lambda: Says(named(message), change))


def _swapped(frame: Frame, one: str, other: str) -> Frame:
    return frame.with_(one, frame[other]).with_(other, frame[one])


def _each(field: str, **values: int) -> Change:
    """Return a change of some values of a field; the names are a letter and the old value."""
    table = {int(name[1:]): value for name, value in values.items()}
    return lambda frame: [frame.with_(field, table.get(frame[field], frame[field]))]


def _without(field: str, *values: int) -> Change:
    return lambda frame: [] if frame[field] in values else [frame]


def _thousandfold(frame: Frame) -> list[Frame]:
    current = struct.unpack("<f", struct.pack("<I", frame["abs_reading"]))[0]
    bits = struct.unpack("<I", struct.pack("<f", current * 1000))[0]
    return [frame.with_("abs_reading", bits)]


def _limited(frame: Frame) -> list[Frame]:
    """Limit a fixed diameter to that of the highest power."""
    return [
        frame.with_("circ_dia_sw", min(frame["circ_dia_sw"], frame["abs_pwr_max_circ_dia"]))
        if frame["circ_dia_mode"] == 1
        else frame
    ]


class _Drifts(Firmware):
    """A circle that moves although it is latched."""

    def says(self, frame: Frame) -> None:
        if frame.name == _STATUS:
            frame = frame.with_("circ_pos_a", frame["circ_pos_a"] + int(self.now() * 4000) % 2000)
        self.say(frame.raw)


_OF_NANOTRAKS = [
    ("tracking modes are ignored", _SET_MODE, _without("state", 3, 4, 5)),
    ("latch is ignored", _SET_MODE, _without("state", 2)),
    ("horizontal tracking tracks both axes", _SET_MODE, _each("state", v4=3)),
    ("vertical tracking tracks both axes", _SET_MODE, _each("state", v5=3)),
    ("horizontal and vertical tracking are exchanged", _SET_MODE, _each("state", v4=5, v5=4)),
    ("vertical tracking is horizontal", _SET_MODE, _each("state", v5=4)),
    ("tracking both axes is horizontal", _SET_MODE, _each("state", v3=4)),
    ("the home position is ignored", _SET_HOME, lambda frame: []),
    (
        "the axes of the home position are exchanged",
        _SET_HOME,
        lambda frame: [_swapped(frame, "circ_home_pos_a", "circ_home_pos_b")],
    ),
    (
        "the home position has 8 bits",
        _SET_HOME,
        lambda f: [f.with_("circ_home_pos_a", f["circ_home_pos_a"] & 0xFF)],
    ),
    ("the circle does not go to its home position", _MOVE, lambda frame: []),
]
_REPORTS = [
    ("the axes are exchanged in the mode", _GET_MODE, _each("mode", v2=3, v3=2)),
    ("the mode always has both axes", _GET_MODE, _each("mode", v2=1, v3=1)),
    ("the state has the numbers of the mode", _GET_MODE, _each("state", v4=5, v3=5)),
    ("the state is always latched", _GET_MODE, _each("state", v3=2, v4=2)),
    (
        "the axes of the circle are exchanged in the status",
        _STATUS,
        lambda frame: [_swapped(frame, "circ_pos_a", "circ_pos_b")],
    ),
]
_RANGES = [
    ("a set range is ignored", _SET_RANGE, _each("range_mode", v3=2)),
    ("a manual range changes to the set one", _SET_RANGE, _each("range_mode", v2=3)),
    ("an automatic range stays", _SET_RANGE, _each("range_mode", v1=2)),
    ("a manual range follows the signal", _SET_RANGE, _each("range_mode", v2=1)),
    ("a set range is one too high", _SET_RANGE, lambda f: [f.with_("range_sw", f["range_sw"] + 1)]),
]
_READINGS = [
    ("the range counts from 1", _STATUS, lambda f: [f.with_("range", f["range"] - 2)]),
    (
        "the relative reading has 16 bits",
        _STATUS,
        lambda f: [f.with_("rel_reading", 2 * f["rel_reading"])],
    ),
    (
        "the relative reading is inverted",
        _STATUS,
        lambda f: [f.with_("rel_reading", 32767 - f["rel_reading"])],
    ),
    ("under-reading and over-reading are exchanged", _STATUS, _each("under_over_read", v2=3, v3=2)),
    ("a signal is always over-reading", _STATUS, lambda f: [f.with_("under_over_read", 3)]),
    ("the current is in mA", _STATUS, _thousandfold),
]
_CIRCLES = [
    ("the diameter is always fixed", _SET_CIRCLE, _each("circ_dia_mode", v2=1, v3=1)),
    ("the table of diameters is ignored", _SET_TABLE, lambda frame: []),
    (
        "the table of diameters begins one entry late",
        _SET_TABLE,
        lambda frame: [frame.patched(8, frame.raw[6:36])],
    ),
    ("a power limits a fixed diameter", _SET_CIRCLE, _limited),
]


# Position aligners, whose messages are sub-messages of one id


class _Sets(Firmware):
    """Changes a sub-message to the controller; its length may be that of no other sub-message.

    :param number: of the sub-message.
    """

    def __init__(self, number: int, change: Change) -> None:
        self._begins = b"\x70\x08", number
        self._change = change

    def takes(self, frame: Frame) -> None:
        is_it = (frame.raw[:2], frame.raw[6] if len(frame.raw) > 6 else 0) == self._begins
        for taken in self._change(frame) if is_it else (frame,):
            self.pass_on(taken if isinstance(taken, bytes) else taken.raw)

    def takes_odd(self, raw: bytes) -> None:
        self.takes(Frame(raw))


def _is_status(frame: Frame) -> bool:
    return int.from_bytes(frame.raw[:2], "little") == _QUAD_STATUS


def _value(frame: Frame, at: int) -> int:
    return int.from_bytes(frame.raw[at : at + 2], "little", signed=True)


def _with(frame: Frame, **values: int) -> Frame:
    """Return a copy with other signed values; the names are a letter and the place."""
    for name, value in values.items():
        frame = frame.patched(int(name[1:]), struct.pack("<h", max(-32768, min(32767, value))))
    return frame


def _exchanged(one: int, other: int) -> Change:
    return lambda frame: [
        _with(frame, **{f"v{one}": _value(frame, other), f"v{other}": _value(frame, one)})
    ]


def _times(number: float, *places: int) -> Change:
    return lambda frame: [
        _with(frame, **{f"v{at}": int(number * _value(frame, at)) for at in places})
    ]


def _negative(at: int) -> Change:
    """Make a value negative. Writing it back does not make it right again."""
    return lambda frame: [_with(frame, **{f"v{at}": -abs(_value(frame, at))})]


def _words(at: int, **values: int) -> Change:
    table = {int(name[1:]): value for name, value in values.items()}
    return lambda frame: [
        _with(frame, **{f"v{at}": table.get(_value(frame, at), _value(frame, at))})
    ]


_SETS_OF_ALIGNERS = [
    ("the operating mode is ignored", "quad-mode", _OPERMODE, lambda frame: []),
    ("monitor mode is open loop", "quad-mode", _OPERMODE, _words(8, v1=2)),
    ("open loop is monitor mode", "quad-mode quad-outputs", _OPERMODE, _words(8, v2=1)),
    ("closed loop is open loop", "quad-loop", _OPERMODE, _words(8, v3=2)),
    ("open and closed loop are exchanged", "quad-loop quad-mode", _OPERMODE, _words(8, v2=3, v3=2)),
    ("the outputs are ignored", "quad-outputs", _OUTPUTS, lambda frame: []),
    ("the outputs are exchanged", "quad-outputs", _OUTPUTS, _exchanged(8, 10)),
    ("the outputs have half the voltage", "quad-outputs", _OUTPUTS, _times(0.5, 8, 10)),
    ("an output is inverted", "quad-outputs", _OUTPUTS, _times(-1, 10)),
    ("open loop does not hold the outputs", "quad-loop", _DEMANDS, _words(18, v2=1)),
    ("open loop does not zero the outputs", "quad-mode", _DEMANDS, _words(18, v1=2)),
    ("the sense of an axis is always negative", "quad-loop", _DEMANDS, _negative(20)),
    ("the loop of an axis has no gain", "quad-loop", _DEMANDS, _times(0, 22)),
]
_SET_NAMES = {
    _OPERMODE: "QUAD_SET_OPERMODE",
    _DEMANDS: "QUAD_SET_POSDEMANDPARAMS",
    _OUTPUTS: "QUAD_SET_POSITIONOUTPUTS",
}


def _unlimited(frame: Frame) -> list[Frame]:
    """Return the status with an output at its end, if the loop is closed."""
    return [_with(frame, **{f"v{_X_POS}": 32767}) if _value(frame, _BITS) & 0b100 else frame]


_STATUSES_OF_ALIGNERS = [
    ("the differences are exchanged", "quad-mode", _exchanged(_X_DIFF, _Y_DIFF)),
    ("a difference is inverted", "quad-mode", _times(-1, _Y_DIFF)),
    (
        "the outputs in the status are exchanged",
        "quad-mode quad-outputs",
        _exchanged(_X_POS, _Y_POS),
    ),
    ("an output in the status is inverted", "quad-mode quad-outputs", _times(-1, _X_POS)),
    ("the status bits are one place too high", "quad-mode", _times(2, _BITS)),
    ("an output in closed loop is not limited", "quad-loop", _unlimited),
    ("the status always shows open loop", "quad-mode", _words(_BITS, v1=2, v4=2)),
]


def _take(number: int, change: Change) -> Callable[[], Firmware]:
    return lambda: _Sets(number, change)


def _say(change: Change) -> Callable[[], Firmware]:
    return lambda: Says(_is_status, change)


def _second() -> Firmware:
    """Report range 2 in every status."""
    return Says(named(_STATUS), lambda frame: [frame.with_("range", 2)])


TRACKERS = [
    *(
        _taken(7000 + at, name, "nanotrak-tracking", message, change)
        for at, (name, message, change) in enumerate(_OF_NANOTRAKS)
    ),
    *(
        _said(7020 + at, name, "nanotrak-tracking", message, change)
        for at, (name, message, change) in enumerate(_REPORTS)
    ),
    _defect(7030, "a latched circle drifts", "nanotrak-tracking", _NANOTRAKS, _STATUS, _Drifts),
    *(
        _taken(7040 + at, name, "nanotrak-range", message, change)
        for at, (name, message, change) in enumerate(_RANGES)
    ),
    *(
        _said(7050 + at, name, "nanotrak-range", message, change)
        for at, (name, message, change) in enumerate(_READINGS)
    ),
    *(
        _taken(7110 + at, name, "nanotrak-circle", message, change)
        for at, (name, message, change) in enumerate(_CIRCLES)
    ),
    *(
        _defect(7130 + at, f"{unit} has range 2", "nanotrak-range", (unit,), _STATUS, _second)
        for at, unit in enumerate(("KNA101", "TNA001"))
    ),
    *(
        _defect(7060 + at, name, kind, _ALIGNERS, _SET_NAMES[number], _take(number, change))
        for at, (name, kind, number, change) in enumerate(_SETS_OF_ALIGNERS)
    ),
    *(
        _defect(7080 + at, name, kind, _ALIGNERS, "QUAD_GET_STATUSUPDATE", _say(change))
        for at, (name, kind, change) in enumerate(_STATUSES_OF_ALIGNERS)
    ),
]
