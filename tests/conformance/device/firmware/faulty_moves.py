"""Firmware that moves wrongly, or reports the end of a move wrongly."""

from __future__ import annotations

from collections.abc import Callable

from firmware_defects import Change, Defect, Draw, Echoes, NotHereError, Says, Takes, named, of
from firmware_frames import Frame
from firmware_line import Firmware

from stagewire_conformance.device.results import Result

_COMPLETED = "MOT_MOVE_COMPLETED"
_STOPPED = "MOT_MOVE_STOPPED"
_HOMED = "MOT_MOVE_HOMED"
_ABSOLUTE = "MOT_MOVE_ABSOLUTE"
_RELATIVE = "MOT_MOVE_RELATIVE"
_JOG = "MOT_MOVE_JOG"
_VELOCITY = "MOT_MOVE_VELOCITY"
_HOME = "MOT_MOVE_HOME"
_STOP = "MOT_MOVE_STOP"
_TO = "move-absolute move-relative move-stored move-jog move-alone"
_STOPS = "move-stop move-velocity"
_ANY = f"{_TO} {_STOPS} home suspend limits"


def _said(
    seed: int,
    name: str,
    found_by: str,
    change: Change,
    end: str = _COMPLETED,
    result: Result = Result.FAIL,
) -> Defect:
    """Return a defect in an end message."""

    def make(draw: Draw) -> tuple[Firmware, str]:
        draw.moves()
        draw.claims(end)
        return Says(named(end), change), end

    return Defect(seed, name, of(found_by), make, result=result)


def _taken(seed: int, name: str, found_by: str, start: str, change: Change) -> Defect:
    """Return a defect in the effect of a message that moves something."""

    def make(draw: Draw) -> tuple[Firmware, str]:
        draw.moves()
        draw.claims(start)
        return Takes(named(start), change), start

    return Defect(seed, name, of(found_by), make)


def _moving_ones(
    seed: int, name: str, make: Callable[[Draw], tuple[Firmware, str]], found_by: str = _ANY
) -> Defect:
    """Return a defect of units that move stages."""

    def checked(draw: Draw) -> tuple[Firmware, str]:
        draw.moves()
        return make(draw)

    return Defect(seed, name, of(found_by), checked)


def _bare(frame: Frame) -> list[bytes]:
    """Return an end message as only a header, as in the byte table of page 44."""
    return [frame.raw[:2] + bytes((frame.channel or 1, 0, frame.dest, frame.source))]


def _moving(frame: Frame) -> list[Frame]:
    return [frame.with_("status_bits", frame["status_bits"] | 0x10)]


class _Ends(Firmware):
    """Reports the end of a move at its beginning, and not at its end."""

    def __init__(self, *, again: bool) -> None:
        self._again = again
        self._status: dict[int, Frame] = {}

    def takes(self, frame: Frame) -> None:
        self.pass_on(frame.raw)
        known = self._status.get(frame.dest)
        if frame.name in (_ABSOLUTE, _RELATIVE) and known:
            self.say(known.renamed(_COMPLETED).raw, after=0.01)

    def says(self, frame: Frame) -> None:
        if "STATUSUPDATE" in frame.name:
            self._status[frame.source] = frame
        if frame.name != _COMPLETED or self._again:
            self.say(frame.raw)


class _LateEnds(Firmware):
    """Reports the end of a move much too late."""

    def says(self, frame: Frame) -> None:
        self.say(frame.raw, after=12.0 if frame.name == _COMPLETED else 0.0)


def _two_bays(draw: Draw) -> tuple[int, int]:
    """Choose two bays that move stages."""
    bays = [place.address for place in draw.places if place.bay and place.moves_stages]
    if len(bays) < 2:
        raise NotHereError
    one, other = draw.random.sample(bays, 2)
    return one, other


def _other_bay(draw: Draw) -> tuple[Firmware, str]:
    """Report the end of a move in one bay with the address of another."""
    one, other = _two_bays(draw)
    return Says(
        lambda f: f.name == _COMPLETED and f.source == one, lambda f: [f.coming_from(other)]
    ), _COMPLETED


def _all_bays(draw: Draw) -> tuple[Firmware, str]:
    """Report the end of a move for two bays."""
    bays = _two_bays(draw)
    return Says(
        lambda f: f.name == _COMPLETED and f.source in bays,
        lambda f: [f.coming_from(bay) for bay in bays],
    ), _COMPLETED


def _with_two_channels(draw: Draw) -> None:
    if not any(2 in place.channels and place.moves_stages for place in draw.places):
        raise NotHereError


def _other_channel(draw: Draw) -> tuple[Firmware, str]:
    """Report the end of a move of channel 2 as that of channel 1."""
    _with_two_channels(draw)
    return Says(
        lambda f: f.name == _COMPLETED and f.channel == 2, lambda f: [f.with_("chan_ident", 1)]
    ), _COMPLETED


def _both_bays_move(draw: Draw) -> tuple[Firmware, str]:
    """Also move another bay."""
    one, other = _two_bays(draw)
    return Takes(
        lambda f: f.name == _ABSOLUTE and f.dest == one, lambda f: [f, f.to(other)]
    ), _ABSOLUTE


def _both_channels_move(draw: Draw) -> tuple[Firmware, str]:
    _with_two_channels(draw)
    return Takes(
        lambda f: f.name == _ABSOLUTE and f.channel == 1,
        lambda f: [f, f.with_("chan_ident", 2)],
    ), _ABSOLUTE


class _WithoutMoving(Firmware):
    """Reports that a move was completed, but did not move."""

    def __init__(self) -> None:
        self._status: dict[int, Frame] = {}

    def takes(self, frame: Frame) -> None:
        known = self._status.get(frame.dest)
        if frame.name == _ABSOLUTE and known:
            self.say(known.renamed(_COMPLETED).raw, after=0.3)
        else:
            self.pass_on(frame.raw)

    def says(self, frame: Frame) -> None:
        if "STATUSUPDATE" in frame.name:
            self._status[frame.source] = frame
        self.say(frame.raw)


def _one_stop_mode(draw: Draw) -> tuple[Firmware, str]:
    """Accept only one of the two stop modes."""
    mode = draw.random.choice((1, 2))
    return Takes(lambda f: f.name == _STOP and f["stop_mode"] == mode, lambda f: []), _STOP


def _short_form(draw: Draw) -> tuple[Firmware, str]:
    """Do not accept the form without a target."""
    start = draw.random.choice((_ABSOLUTE, _RELATIVE))
    return Takes(lambda f: f.name == start and not f.has_packet, lambda f: []), start


def _stored_is_forgotten(draw: Draw) -> tuple[Firmware, str]:
    """Use the target of the last long form instead of the stored one."""
    start = draw.random.choice((_ABSOLUTE, _RELATIVE))

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


def _halved(field: str) -> Change:
    return _off(field, lambda count: count // 2)


MOVES = (
    _said(7, "The end of a move is never reported", _ANY, lambda f: []),
    _said(2, "The end of a move is reported twice", _ANY, lambda f: [f, f]),
    _said(1, "The end of a move is only a header", _ANY, _bare, result=Result.NON_STRICT),
    _said(13, "The end of a move reports motion", _ANY, _moving, result=Result.NON_STRICT),
    _said(6, "The end of a move is about channel 0", _ANY, lambda f: [f.with_("chan_ident", 0)]),
    _said(1, "The end of a move is reported as a stop", _ANY, lambda f: [f.renamed(_STOPPED)]),
    _said(7, "The end of a move has a packet of another length", _ANY,
          lambda f: [f.with_packet(f.packet[:-2])]),
    _said(3, "The end of homing is never reported", "home", lambda f: [], _HOMED),
    _said(7, "The end of homing is reported as a move", "home", lambda f: [f.renamed(_COMPLETED)], _HOMED),
    _said(14, "The end of homing is reported twice", "home", lambda f: [f, f], _HOMED),
    _said(11, "A stop is never reported", _STOPS, lambda f: [], _STOPPED),
    _said(1, "A stop is reported twice", _STOPS, lambda f: [f, f], _STOPPED),
    _said(10, "A stop is reported as a completed move", _STOPS, lambda f: [f.renamed(_COMPLETED)], _STOPPED),
    _moving_ones(11, "The end of a move is reported before it",
                 lambda draw: (_Ends(again=False), _COMPLETED)),
    _moving_ones(1, "The end of a move is doubled and early", lambda draw: (_Ends(again=True), _COMPLETED)),
    _moving_ones(1, "The end of a move is reported too late", lambda draw: (_LateEnds(), _COMPLETED)),
    _moving_ones(6, "The end of a move comes from another bay", _other_bay),
    _moving_ones(14, "The end of a move is reported for two bays", _all_bays),
    _moving_ones(1, "The end of a move is reported for another channel", _other_channel),
    _moving_ones(6, "Another bay also moves", _both_bays_move),
    _moving_ones(2, "Another channel also moves", _both_channels_move),
    _moving_ones(1, "A move is reported as complete without motion",
                 lambda draw: (_WithoutMoving(), _ABSOLUTE)),
    _moving_ones(14, "A move is answered when it begins", lambda draw: (Echoes(named(_ABSOLUTE, _HOME)), "")),
    _taken(1, "An absolute move is ignored", _TO, _ABSOLUTE, lambda f: []),
    _taken(1, "A relative move is ignored", _TO, _RELATIVE, lambda f: []),
    _taken(1, "A jog is ignored", "move-jog", _JOG, lambda f: []),
    _taken(10, "A move at constant velocity is ignored", "move-velocity", _VELOCITY, lambda f: []),
    _taken(10, "Homing is ignored", "home", _HOME, lambda f: []),
    _taken(6, "A stop is ignored", _STOPS, _STOP, lambda f: []),
    _moving_ones(3, "One way to stop is ignored", _one_stop_mode, _STOPS),
    _taken(14, "A move falls short", _TO, _ABSOLUTE, _off("absolute_distance", lambda n: n - n // 16)),
    _taken(4, "A relative move goes twice as far", _TO, _RELATIVE,
           _off("relative_distance", lambda n: n * 2)),
    _taken(1, "A relative move goes half as far", _TO, _RELATIVE, _halved("relative_distance")),
    _taken(1, "A relative move is done as an absolute one", _TO, _RELATIVE, lambda f: [f.renamed(_ABSOLUTE)]),
    _taken(1, "A jog goes in the other direction", "move-jog", _JOG, _other_direction),
    _taken(1, "A move at constant velocity goes in the other direction", _STOPS, _VELOCITY, _other_direction),
    _moving_ones(13, "A move without a target is not accepted", _short_form, "move-stored"),
    _moving_ones(2, "A move without a target uses the last one", _stored_is_forgotten, "move-stored"),
    _taken(1, "End messages cannot be suspended", "suspend", "MOT_SUSPEND_ENDOFMOVEMSGS", lambda f: []),
    _taken(1, "End messages cannot be resumed", "suspend", "MOT_RESUME_ENDOFMOVEMSGS", lambda f: []),
)  # fmt: skip
