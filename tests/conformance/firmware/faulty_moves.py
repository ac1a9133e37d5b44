"""Firmware that moves wrongly, or tells wrongly how a move went."""

from __future__ import annotations

from collections.abc import Callable

from firmware_defects import Change, Defect, Draw, NotHereError, Says, Takes
from firmware_frames import HOST, Frame
from firmware_line import Firmware

from stagewire_conformance.device.results import Result

__all__ = ["MOVES"]

_COMPLETED = "MOT_MOVE_COMPLETED"
_STOPPED = "MOT_MOVE_STOPPED"
_HOMED = "MOT_MOVE_HOMED"
_ENDS = (_COMPLETED, _STOPPED, _HOMED)
_STARTS = (
    "MOT_MOVE_ABSOLUTE", "MOT_MOVE_RELATIVE", "MOT_MOVE_JOG", "MOT_MOVE_VELOCITY", "MOT_MOVE_HOME",
)  # fmt: skip
_TO = frozenset({"move-absolute", "move-relative", "move-stored", "move-jog", "move-alone"})
_STOP = frozenset({"move-stop", "move-velocity"})
_ANY = _TO | _STOP | {"home", "suspend", "limits"}
_WITH_SWITCHES = ("TDC001", "TST001", "OST001", "ODC001", "BSC002", "BSC102")


def _said(name: str, found_by: frozenset[str], change: Change, *which: str, **more: Result) -> Defect:
    """Return a defect in an end message."""

    def make(draw: Draw) -> tuple[Firmware, str]:
        end = draw.one_of(*which) if which else _COMPLETED
        draw.moves()
        draw.claims(end)
        return Says(lambda frame: frame.name == end, change), end

    return Defect(name, found_by, make, **more)


def _taken(name: str, found_by: frozenset[str], start: str, change: Change) -> Defect:
    """Return a defect in what becomes of a message that moves something."""

    def make(draw: Draw) -> tuple[Firmware, str]:
        draw.moves()
        draw.claims(start)
        return Takes(lambda frame: frame.name == start, change), start

    return Defect(name, found_by, make)


def _bare(frame: Frame) -> list[bytes]:
    """Return an end message as a header alone, as the byte table of page 44 prints it."""
    return [frame.raw[:2] + bytes((frame.channel or 1, 0, frame.dest, frame.source))]


def _moving(frame: Frame) -> list[Frame]:
    return [frame.with_("status_bits", frame["status_bits"] | 0x10)]


class _Ends(Firmware):
    """Says the end of a move when it begins, and keeps quiet when it ends."""

    def __init__(self, *, again: bool) -> None:
        self._again = again
        self._status: dict[int, Frame] = {}

    def takes(self, frame: Frame) -> None:
        self.pass_on(frame.raw)
        known = self._status.get(frame.dest)
        if frame.name in ("MOT_MOVE_ABSOLUTE", "MOT_MOVE_RELATIVE") and known:
            self.say(known.renamed(_COMPLETED).raw, after=0.01)

    def says(self, frame: Frame) -> None:
        if "STATUSUPDATE" in frame.name:
            self._status[frame.source] = frame
        if frame.name != _COMPLETED or self._again:
            self.say(frame.raw)


def _too_soon(draw: Draw, *, again: bool) -> tuple[Firmware, str]:
    draw.moves()
    return _Ends(again=again), _COMPLETED


class _LateEnds(Firmware):
    """Says the end of a move long after it."""

    def says(self, frame: Frame) -> None:
        self.say(frame.raw, after=12.0 if frame.name == _COMPLETED else 0.0)


def _too_late(draw: Draw) -> tuple[Firmware, str]:
    draw.moves()
    return _LateEnds(), _COMPLETED


def _other_bay(draw: Draw) -> tuple[Firmware, str]:
    """Say the end of a move in one bay with the address of another."""
    bays = [p.address for p in draw.places if p.bay and "MOT_MOVE_ABSOLUTE" in p.messages]
    if len(bays) < 2:
        raise NotHereError
    one, other = draw.random.sample(bays, 2)
    return Says(
        lambda f: f.name == _COMPLETED and f.source == one, lambda f: [f.coming_from(other)]
    ), _COMPLETED


def _all_bays(draw: Draw) -> tuple[Firmware, str]:
    """Say the end of a move for every bay at once."""
    bays = [p.address for p in draw.places if p.bay and "MOT_MOVE_ABSOLUTE" in p.messages]
    if len(bays) < 2:
        raise NotHereError
    return Says(
        lambda f: f.name == _COMPLETED, lambda f: [f.coming_from(bay) for bay in bays]
    ), _COMPLETED


def _other_channel(draw: Draw) -> tuple[Firmware, str]:
    """Say the end of a move of channel 2 as that of channel 1."""
    if all(2 not in p.channels or "MOT_MOVE_ABSOLUTE" not in p.messages for p in draw.places):
        raise NotHereError
    return Says(
        lambda f: f.name == _COMPLETED and f.channel == 2, lambda f: [f.with_("chan_ident", 1)]
    ), _COMPLETED


def _both_bays_move(draw: Draw) -> tuple[Firmware, str]:
    """Move another bay as well."""
    bays = [p.address for p in draw.places if p.bay and "MOT_MOVE_ABSOLUTE" in p.messages]
    if len(bays) < 2:
        raise NotHereError
    one, other = draw.random.sample(bays, 2)
    return Takes(
        lambda f: f.name == "MOT_MOVE_ABSOLUTE" and f.dest == one, lambda f: [f, f.to(other)]
    ), "MOT_MOVE_ABSOLUTE"


def _both_channels_move(draw: Draw) -> tuple[Firmware, str]:
    if all(2 not in p.channels or not p.moves_stages for p in draw.places):
        raise NotHereError
    return Takes(
        lambda f: f.name == "MOT_MOVE_ABSOLUTE" and f.channel == 1,
        lambda f: [f, f.with_("chan_ident", 2)],
    ), "MOT_MOVE_ABSOLUTE"


def _other_layout(draw: Draw) -> tuple[Firmware, str]:
    """Leave a field out of the status at the end of a move: the rest is packed two bytes earlier."""
    draw.moves()
    return Says(
        lambda f: f.name == _COMPLETED, lambda f: [f.with_packet(f.packet[:-2])]
    ), _COMPLETED


class _WithoutMoving(Firmware):
    """Says that a move was completed, and has not moved."""

    def __init__(self) -> None:
        self._status: dict[int, Frame] = {}

    def takes(self, frame: Frame) -> None:
        known = self._status.get(frame.dest)
        if frame.name == "MOT_MOVE_ABSOLUTE" and known:
            self.say(known.renamed(_COMPLETED).raw, after=0.3)
        else:
            self.pass_on(frame.raw)

    def says(self, frame: Frame) -> None:
        if "STATUSUPDATE" in frame.name:
            self._status[frame.source] = frame
        self.say(frame.raw)


def _without_moving(draw: Draw) -> tuple[Firmware, str]:
    draw.moves()
    return _WithoutMoving(), "MOT_MOVE_ABSOLUTE"


class _Confirms(Firmware):
    """Answers what moves something, at once, with an empty message of the same id."""

    def takes(self, frame: Frame) -> None:
        self.pass_on(frame.raw)
        if frame.name in _STARTS:
            self.say(frame.raw[:2] + bytes((frame.channel or 0, 0, HOST, frame.dest)))


def _confirmed(draw: Draw) -> tuple[Firmware, str]:
    draw.moves()
    return _Confirms(), ""


def _stop_as_completed(draw: Draw) -> tuple[Firmware, str]:
    draw.claims("MOT_MOVE_STOP")
    return Says(lambda f: f.name == _STOPPED, lambda f: [f.renamed(_COMPLETED)]), _STOPPED


def _one_stop_mode(draw: Draw) -> tuple[Firmware, str]:
    """Take one of the two ways to stop only."""
    draw.claims("MOT_MOVE_STOP")
    mode = draw.random.choice((1, 2))
    return Takes(
        lambda f: f.name == "MOT_MOVE_STOP" and f["stop_mode"] == mode, lambda f: []
    ), "MOT_MOVE_STOP"


def _short_form(draw: Draw) -> tuple[Firmware, str]:
    """Take the form without a target for no message at all."""
    start = draw.one_of("MOT_MOVE_ABSOLUTE", "MOT_MOVE_RELATIVE")
    return Takes(lambda f: f.name == start and not f.has_packet, lambda f: []), start


def _stored_is_forgotten(draw: Draw) -> tuple[Firmware, str]:
    """Go by what the last long form said, not by what was stored."""
    start = draw.one_of("MOT_MOVE_ABSOLUTE", "MOT_MOVE_RELATIVE")

    class Forgets(Firmware):
        def __init__(self) -> None:
            self._long: dict[tuple[int, int | None], bytes] = {}

        def takes(self, frame: Frame) -> None:
            key = frame.dest, frame.channel
            if frame.name == start and frame.has_packet:
                self._long[key] = frame.raw
            short = frame.name == start and not frame.has_packet
            self.pass_on(self._long.get(key, frame.raw) if short else frame.raw)

    return Forgets(), start


def _off(field: str, by: Callable[[int], int]) -> Change:
    return lambda f: [f.with_(field, by(f[field])) if f.has_packet else f]


def _other_direction(frame: Frame) -> list[Frame]:
    return [frame.with_("direction", 3 - frame["direction"])]


MOVES = (
    _said("The end of a move is never told", _ANY, lambda frame: []),
    _said("The end of a move is told twice", _ANY, lambda frame: [frame, frame]),
    _said("The end of a move is a header alone", _ANY, _bare, result=Result.NON_STRICT),
    _said("The end of a move says that it moves", _ANY, _moving),
    _said("The end of a move is about channel 0", _ANY, lambda f: [f.with_("chan_ident", 0)]),
    _said("The end of a move is told as a stop", _ANY, lambda f: [f.renamed(_STOPPED)]),
    _said("The end of homing is never told", frozenset({"home"}), lambda frame: [], _HOMED),
    _said("The end of homing is told as that of a move", frozenset({"home"}), lambda f: [f.renamed(_COMPLETED)], _HOMED),
    _said("The end of homing is told twice", frozenset({"home"}), lambda f: [f, f], _HOMED),
    _said("A stop is never told", _STOP, lambda frame: [], _STOPPED),
    _said("A stop is told twice", _STOP, lambda frame: [frame, frame], _STOPPED),
    Defect("A stop is told as a completed move", _STOP, _stop_as_completed),
    Defect("The end of a move is told before it", _ANY, lambda draw: _too_soon(draw, again=False)),
    Defect("The end of a move is told before it and after it", _ANY, lambda draw: _too_soon(draw, again=True)),
    Defect("The end of a move is told too late", _ANY, _too_late),
    Defect("The end of a move comes from another bay", _ANY, _other_bay),
    Defect("The end of a move is told for every bay", _ANY, _all_bays),
    Defect("The end of a move is told for another channel", _ANY, _other_channel),
    Defect("The end of a move has a packet of another length", _ANY, _other_layout),
    Defect("Another bay moves, too", _ANY, _both_bays_move),
    Defect("Another channel moves, too", _ANY, _both_channels_move),
    Defect("A move is told to be complete and was none", _ANY, _without_moving),
    Defect("A move is confirmed when it begins", _ANY, _confirmed),
    _taken("An absolute move is ignored", _TO, "MOT_MOVE_ABSOLUTE", lambda f: []),
    _taken("A relative move is ignored", _TO, "MOT_MOVE_RELATIVE", lambda f: []),
    _taken("A jog is ignored", _TO, "MOT_MOVE_JOG", lambda f: []),
    _taken("A move at constant velocity is ignored", _STOP, "MOT_MOVE_VELOCITY", lambda f: []),
    _taken("Homing is ignored", frozenset({"home"}), "MOT_MOVE_HOME", lambda f: []),
    _taken("A stop is ignored", _STOP, "MOT_MOVE_STOP", lambda f: []),
    Defect("One way to stop is ignored", _STOP, _one_stop_mode),
    _taken("A move falls short", _TO, "MOT_MOVE_ABSOLUTE", _off("absolute_distance", lambda n: n - n // 16)),
    _taken("A relative move goes twice as far", _TO, "MOT_MOVE_RELATIVE", _off("relative_distance", lambda n: n * 2)),
    _taken("A relative move goes half as far", _TO, "MOT_MOVE_RELATIVE", _off("relative_distance", lambda n: n // 2)),
    _taken("A relative move is taken for an absolute one", _TO, "MOT_MOVE_RELATIVE", lambda f: [f.renamed("MOT_MOVE_ABSOLUTE")]),
    _taken("A jog goes in the other direction", _TO, "MOT_MOVE_JOG", _other_direction),
    _taken("A move at constant velocity goes in the other direction", _STOP, "MOT_MOVE_VELOCITY", _other_direction),
    Defect("A move without a target is not understood", frozenset({"move-stored"}), _short_form),
    Defect("A move without a target goes by the last one", frozenset({"move-stored"}), _stored_is_forgotten),
    _taken("End messages cannot be suspended", frozenset({"suspend"}), "MOT_SUSPEND_ENDOFMOVEMSGS", lambda f: []),
    _taken("End messages cannot be resumed", frozenset({"suspend"}), "MOT_RESUME_ENDOFMOVEMSGS", lambda f: []),
)
