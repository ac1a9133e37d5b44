"""Firmware with wrong dynamics: speeds, accelerations, status bits and ends of motions that are not true."""

from __future__ import annotations

from collections.abc import Callable

from firmware_defects import Defect, Draw, Takes, named, of
from firmware_frames import HOST, ID, Frame
from firmware_line import Firmware

from stagewire_conformance.device.results import Result

_ABSOLUTE = "MOT_MOVE_ABSOLUTE"
_RELATIVE = "MOT_MOVE_RELATIVE"
_JOG = "MOT_MOVE_JOG"
_VELOCITY = "MOT_MOVE_VELOCITY"
_HOME = "MOT_MOVE_HOME"
_STOP = "MOT_MOVE_STOP"
_COMPLETED = "MOT_MOVE_COMPLETED"
_STOPPED = "MOT_MOVE_STOPPED"
_HOMED = "MOT_MOVE_HOMED"
_STATUSES = ("MOT_GET_DCSTATUSUPDATE", "MOT_GET_STATUSUPDATE")
_ENDS = (_COMPLETED, _STOPPED, _HOMED)
_FORWARD, _REVERSE = 0x50, 0xA0
_MOVING = 0x2F0
_SETTLED = 0x2000


class Pretends(Firmware):
    """Returns parameters as they were set, but uses others.

    :param setting: the SET; its GET returns what it wrote.
    :param use: returns the SET that is used instead.
    """

    def __init__(self, setting: str, use: Callable[[Frame], Frame]) -> None:
        self._setting = setting
        self._telling = setting.replace("_SET_", "_GET_")
        self._use = use
        self._told: dict[tuple[int, int | None], bytes] = {}

    def takes(self, frame: Frame) -> None:
        if frame.name == self._setting:
            self._told[frame.dest, frame.channel] = frame.packet
            frame = self._use(frame)
        self.pass_on(frame.raw)

    def says(self, frame: Frame) -> None:
        told = self._told.get((frame.source, frame.channel))
        if frame.name == self._telling and told is not None:
            frame = frame.with_packet(told)
        self.say(frame.raw)


class Ignores(Pretends):
    """Stores a field of a parameter set without using it."""

    def __init__(self, setting: str, field: str) -> None:
        super().__init__(setting, self._with_the_first)
        self._field = field
        self._first: dict[tuple[int, int | None], int] = {}

    def says(self, frame: Frame) -> None:
        if frame.name == self._telling:
            self._first.setdefault((frame.source, frame.channel), frame[self._field])
        super().says(frame)

    def _with_the_first(self, frame: Frame) -> Frame:
        first = self._first.get((frame.dest, frame.channel), frame[self._field])
        return frame.with_(self._field, first)


class Knows(Firmware):
    """Knows the last status of each motor, and whether it moves."""

    def __init__(self) -> None:
        self.last: dict[tuple[int, int | None], Frame] = {}

    def says(self, frame: Frame) -> None:
        if frame.name in (*_STATUSES, *_ENDS) and "status_bits" in frame.fields:
            self.last[frame.source, frame.channel] = frame
        self.tells(frame)

    def tells(self, frame: Frame) -> None:
        """Handle a message from the controller."""
        self.say(frame.raw)

    def place_of(self, frame: Frame) -> int | None:
        """Return the last known position of the motor that a message is for."""
        known = self.last.get((frame.dest, frame.channel))
        return None if known is None else known["position"]

    def move_to(self, frame: Frame, position: int) -> bytes:
        """Return an absolute move of the motor that a message is for."""
        data = (frame.channel or 1).to_bytes(2, "little") + position.to_bytes(
            4, "little", signed=True
        )
        head = ID[_ABSOLUTE].to_bytes(2, "little") + bytes((6, 0, frame.dest | 0x80, HOST))
        return head + data


def _bits(frame: Frame) -> int:
    return frame["status_bits"]


def _changes(names: tuple[str, ...], change: Callable[[Frame], Frame]) -> Callable[[], Firmware]:
    """Return firmware that changes the fields of some messages."""

    class Changes(Firmware):
        def says(self, frame: Frame) -> None:
            changed = frame.name in names and "status_bits" in frame.fields
            self.say((change(frame) if changed else frame).raw)

    return Changes


def _velocity(change: Callable[[int], int]) -> Callable[[], Firmware]:
    def with_velocity(frame: Frame) -> Frame:
        if "velocity" not in frame.fields:
            return frame
        velocity = frame["velocity"]
        signed = velocity - 0x10000 if velocity > 0x7FFF else velocity
        return frame.with_("velocity", change(signed))

    return _changes(_STATUSES, with_velocity)


def _swapped_bits(frame: Frame) -> Frame:
    bits = _bits(frame)
    forward, reverse = bits & _FORWARD, bits & _REVERSE
    return frame.with_("status_bits", bits & ~(_FORWARD | _REVERSE) | forward << 1 | reverse >> 1)


def _motor(draw: Draw) -> None:
    draw.moves()


def _dc(draw: Draw) -> None:
    draw.moves()
    draw.claims("MOT_REQ_DCSTATUSUPDATE")


def _dynamic(
    seed: int,
    name: str,
    found_by: str,
    make: Callable[[], Firmware],
    about: str = "",
    *,
    needs: Callable[[Draw], None] = _motor,
    claims: tuple[str, ...] = (),
    units: tuple[str, ...] = (),
    result: Result = Result.FAIL,
) -> Defect:
    def made(draw: Draw) -> tuple[Firmware, str]:
        needs(draw)
        draw.claims(*claims)
        return make(), about

    return Defect(seed, name, of(found_by), made, units, result)


class OldTarget(Knows):
    """Starts relative moves at the last target instead of the position."""

    def __init__(self) -> None:
        super().__init__()
        self._target: dict[tuple[int, int | None], int] = {}

    def takes(self, frame: Frame) -> None:
        key = frame.dest, frame.channel
        raw = frame.raw
        if frame.name == _ABSOLUTE and frame.has_packet:
            self._target[key] = frame["absolute_distance"]
        if frame.name == _RELATIVE and frame.has_packet:
            begin = self._target.get(key, self.place_of(frame))
            if begin is not None:
                self._target[key] = begin + frame["relative_distance"]
                raw = self.move_to(frame, self._target[key])
        self.pass_on(raw)


class EarlyEnd(Knows):
    """Reports the end of an absolute move some time before it, with the position or the target.

    :param target: whether the message has the target as the position.
    """

    def __init__(self, *, target: bool) -> None:
        super().__init__()
        self._lies = target
        self._goal: dict[tuple[int, int | None], int] = {}
        self._from: dict[tuple[int, int | None], int] = {}

    def takes(self, frame: Frame) -> None:
        key = frame.dest, frame.channel
        place = self.place_of(frame)
        if frame.name == _ABSOLUTE and frame.has_packet and place is not None:
            self._goal[key], self._from[key] = frame["absolute_distance"], place
        self.pass_on(frame.raw)

    def tells(self, frame: Frame) -> None:
        key = frame.source, frame.channel
        if frame.name == _COMPLETED and key not in self._goal:
            return
        self.say(frame.raw)
        if frame.name in _STATUSES and key in self._goal:
            whole = abs(self._goal[key] - self._from[key])
            if abs(frame["position"] - self._from[key]) > 0.6 * whole:
                goal = self._goal.pop(key)
                early = frame.with_("status_bits", _bits(frame) & ~_MOVING)
                if self._lies:
                    early = early.with_("position", goal)
                self.say(early.renamed(_COMPLETED).raw)


class Overshoots(Knows):
    """Goes beyond its target by a part of the distance, and comes back, before it reports the end."""

    def __init__(self) -> None:
        super().__init__()
        self._goal: dict[tuple[int, int | None], Frame] = {}

    def takes(self, frame: Frame) -> None:
        place = self.place_of(frame)
        raw = frame.raw
        if frame.name == _ABSOLUTE and frame.has_packet and place is not None:
            goal = frame["absolute_distance"]
            if abs(goal - place) > 300:
                self._goal[frame.dest, frame.channel] = frame
                raw = self.move_to(frame, goal + (goal - place) // 5)
        self.pass_on(raw)

    def tells(self, frame: Frame) -> None:
        goal = self._goal.pop((frame.source, frame.channel), None)
        if frame.name == _COMPLETED and goal is not None:
            self.pass_on(goal.raw)
        else:
            if goal is not None:
                self._goal[frame.source, frame.channel] = goal
            self.say(frame.raw)


class FrozenOnTheWay(Knows):
    """Reports the position at which a motion began until it ends."""

    def __init__(self) -> None:
        super().__init__()
        self._held: dict[tuple[int, int | None], int] = {}

    def tells(self, frame: Frame) -> None:
        key = frame.source, frame.channel
        if frame.name in _STATUSES:
            if _bits(frame) & (_MOVING & ~0x200) and not _bits(frame) & 0x200:
                frame = frame.with_("position", self._held.setdefault(key, frame["position"]))
            else:
                self._held[key] = frame["position"]
        self.say(frame.raw)


class StaleVelocity(Knows):
    """Reports the last velocity of a motion at rest."""

    def __init__(self) -> None:
        super().__init__()
        self._moved: dict[tuple[int, int | None], int] = {}

    def tells(self, frame: Frame) -> None:
        key = frame.source, frame.channel
        if frame.name in _STATUSES and "velocity" in frame.fields:
            if frame["velocity"]:
                self._moved[key] = frame["velocity"]
            frame = frame.with_("velocity", self._moved.get(key, 0))
        self.say(frame.raw)


class StaleBitsAlone(Firmware):
    """Updates the bits of MOT_GET_STATUSBITS only at rest, or only in some of them.

    :param mask: bits that stay as they were first.
    """

    def __init__(self, mask: int) -> None:
        self._mask = mask
        self._first: dict[tuple[int, int | None], int] = {}

    def says(self, frame: Frame) -> None:
        if frame.name == "MOT_GET_STATUSBITS":
            first = self._first.setdefault((frame.source, frame.channel), _bits(frame))
            frame = frame.with_("status_bits", _bits(frame) & ~self._mask | first & self._mask)
        self.say(frame.raw)


class StaleCounter(Knows):
    """Updates the position counter only at rest."""

    def __init__(self) -> None:
        super().__init__()
        self._counter: dict[tuple[int, int | None], int] = {}

    def tells(self, frame: Frame) -> None:
        key = frame.source, frame.channel
        if frame.name == "MOT_GET_POSCOUNTER":
            status = self.last.get(key)
            if status is not None and _bits(status) & _MOVING:
                frame = frame.with_("position", self._counter.get(key, 0))
            self._counter[key] = frame["position"]
        if frame.name in _STATUSES and not _bits(frame) & _MOVING:
            self._counter[key] = frame["position"]
        self.say(frame.raw)


class Unmuted(Firmware):
    """Suspends only some of the end messages.

    :param muted: the messages that it suspends.
    """

    def __init__(self, *muted: str) -> None:
        self._muted = muted
        self._is_on = False

    def takes(self, frame: Frame) -> None:
        if frame.name in ("MOT_SUSPEND_ENDOFMOVEMSGS", "MOT_RESUME_ENDOFMOVEMSGS"):
            self._is_on = "SUSPEND" in frame.name
        else:
            self.pass_on(frame.raw)

    def says(self, frame: Frame) -> None:
        if not (self._is_on and frame.name in self._muted):
            self.say(frame.raw)


class RunsTooFast(Firmware):
    """Runs at constant velocity with a multiple of the maximum velocity.

    :param command: the command that runs.
    """

    def __init__(self, times: int) -> None:
        self._times = times
        self._told: dict[tuple[int, int | None], Frame] = {}

    def takes(self, frame: Frame) -> None:
        told = self._told.get((frame.dest, frame.channel))
        if frame.name == "MOT_SET_VELPARAMS":
            self._told[frame.dest, frame.channel] = frame
        if frame.name == _VELOCITY and told is not None:
            fast = told.with_("max_velocity", told["max_velocity"] * self._times)
            self.pass_on(fast.raw)
            self.pass_on(frame.raw)
            self.pass_on(told.raw)
        else:
            self.pass_on(frame.raw)


class HomedTooSoon(Knows):
    """Reports homed as soon as homing has begun."""

    def __init__(self) -> None:
        super().__init__()
        self._begun: set[tuple[int, int | None]] = set()

    def takes(self, frame: Frame) -> None:
        if frame.name == _HOME:
            self._begun.add((frame.dest, frame.channel))
        self.pass_on(frame.raw)

    def tells(self, frame: Frame) -> None:
        if (frame.source, frame.channel) in self._begun and "status_bits" in frame.fields:
            frame = frame.with_("status_bits", _bits(frame) | 0x400)
        self.say(frame.raw)


class EarlyStop(Knows):
    """Reports a stop when it begins."""

    def takes(self, frame: Frame) -> None:
        self.pass_on(frame.raw)
        known = self.last.get((frame.dest, frame.channel))
        if frame.name == _STOP and known is not None:
            still = known.with_("status_bits", _bits(known) & ~_MOVING)
            self.say(still.renamed(_STOPPED).raw)

    def tells(self, frame: Frame) -> None:
        if frame.name != _STOPPED:
            self.say(frame.raw)


def _takes(name: str, change: Callable[[Frame], Frame]) -> Callable[[], Firmware]:
    return lambda: Takes(named(name), lambda frame: [change(frame)])


DYNAMICS = (
    _dynamic(1, "The velocity of moves is ignored", "profile",
             lambda: Ignores("MOT_SET_VELPARAMS", "max_velocity")),
    _dynamic(1, "The acceleration of moves is ignored", "profile",
             lambda: Ignores("MOT_SET_VELPARAMS", "acceleration")),
    _dynamic(6, "The velocity of jogs is ignored", "profile",
             lambda: Ignores("MOT_SET_JOGPARAMS", "jog_max_velocity")),
    _dynamic(1, "The acceleration of jogs is ignored", "profile",
             lambda: Ignores("MOT_SET_JOGPARAMS", "jog_acceleration")),
    _dynamic(3, "The velocity in the status is inverted", "move-absolute", _velocity(lambda v: -v),
             needs=_dc),
    _dynamic(5, "The velocity in the status is never negative", "move-absolute", _velocity(abs),
             needs=_dc, result=Result.NON_STRICT),
    _dynamic(11, "The velocity in the status is always 0", "move-jog move-velocity", _velocity(lambda v: 0),
             needs=_dc, result=Result.NON_STRICT),
    _dynamic(13, "The velocity in the status stays after the motion", "move-absolute", StaleVelocity,
             needs=_dc),
    _dynamic(11, "The velocity in the status does not change", "profile",
             _velocity(lambda v: 50 * ((v > 0) - (v < 0))), needs=_dc),
    _dynamic(1, "Relative moves start at the last target", "move-stop", OldTarget),
    _dynamic(1, "The end of a move is reported on its way", "move-absolute", lambda: EarlyEnd(target=False)),
    _dynamic(1, "The end of a move is reported on its way with the target", "move-absolute",
             lambda: EarlyEnd(target=True)),
    _dynamic(1, "A move goes beyond its target and comes back", "move-absolute home", Overshoots),
    _dynamic(4, "The position stays during a move", "move-absolute", FrozenOnTheWay),
    _dynamic(1, "The directions in the status are swapped", "move-velocity move-jog",
             _changes((*_STATUSES, *_ENDS), _swapped_bits)),
    _dynamic(4, "The status reports settled during motion", "move-absolute",
             _changes(_STATUSES, lambda f: f.with_("status_bits", _bits(f) | _SETTLED)), needs=_dc),
    _dynamic(1, "The bits alone never report homed", "home", lambda: StaleBitsAlone(0x400),
             claims=("MOT_REQ_STATUSBITS",)),
    _dynamic(1, "The bits alone do not report motion", "in-motion", lambda: StaleBitsAlone(_MOVING),
             claims=("MOT_REQ_STATUSBITS",)),
    _dynamic(1, "The position counter stays during a move", "in-motion", StaleCounter,
             claims=("MOT_REQ_POSCOUNTER",)),
    _dynamic(3, "The continuous jog mode is ignored", "move-jog",
             lambda: Pretends("MOT_SET_JOGPARAMS", lambda f: f.with_("jog_mode", 2))),
    _dynamic(4, "A jog by a step never ends", "move-jog",
             lambda: Pretends("MOT_SET_JOGPARAMS", lambda f: f.with_("jog_mode", 1))),
    _dynamic(4, "A run is twelve times too fast", "move-velocity", lambda: RunsTooFast(12)),
    _dynamic(1, "A run is twice too fast", "move-velocity", lambda: RunsTooFast(2)),
    _dynamic(1, "Suspension hides completed moves only", "suspend", lambda: Unmuted(_COMPLETED)),
    _dynamic(1, "Suspension does not hide homing", "home-again", lambda: Unmuted(_COMPLETED, _STOPPED)),
    _dynamic(1, "The backlash distance is ignored", "backlash",
             lambda: Ignores("MOT_SET_GENMOVEPARAMS", "backlash_distance"),
             claims=("MOT_SET_GENMOVEPARAMS",)),
    _dynamic(14, "The sign of the backlash distance is ignored", "backlash",
             lambda: Pretends("MOT_SET_GENMOVEPARAMS",
                              lambda f: f.with_("backlash_distance", abs(f["backlash_distance"]))),
             claims=("MOT_SET_GENMOVEPARAMS",)),
    _dynamic(1, "The homing velocity is ignored", "home-again",
             lambda: Ignores("MOT_SET_HOMEPARAMS", "home_velocity"), claims=("MOT_SET_HOMEPARAMS",)),
    _dynamic(1, "Homing counts as done when it begins", "home", HomedTooSoon),
    _dynamic(1, "The stop modes are swapped", "move-stop",
             _takes(_STOP, lambda f: f.with_("stop_mode", 3 - f["stop_mode"])), units=("TDC001",)),
    _dynamic(1, "Every stop is immediate", "move-stop",
             _takes(_STOP, lambda f: f.with_("stop_mode", 1)), units=("TDC001",)),
    _dynamic(1, "Every stop has a profile", "move-stop",
             _takes(_STOP, lambda f: f.with_("stop_mode", 2)), units=("TDC001",)),
    _dynamic(1, "A stop is reported when it begins", "move-stop", EarlyStop),
)  # fmt: skip
