"""An actuator during a check: its position, its limits, and how it moves.

An actuator moves only if its position was read and is within the allowed range, and only to targets within
it. At the end of the check, its position counter is where it was. A drive without an encoder only counts its
steps, and steps of the two directions differ, so the actuator itself may rest at another position.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

from stagewire_apt import messages as m
from stagewire_apt.enumerations import MoveDirection, StopMode
from stagewire_conformance.device.causes import EFFECT, Cause
from stagewire_conformance.device.checks.apt.actuators.families import (
    Family,
    Jog,
    family_of,
    jog_of,
    move_to,
    rate_of,
    sets_of,
    span_of,
    stop_of,
)
from stagewire_conformance.device.checks.apt.actuators.readiness import get_ready, interrupt
from stagewire_conformance.device.lines.motions import STATUS_BITS, reports_motion
from stagewire_conformance.device.trial import EnoughError

if TYPE_CHECKING:
    from stagewire.protocols import FramedMessage
    from stagewire_conformance.device.lines.dialogue import Incoming
    from stagewire_conformance.device.targets import Target
    from stagewire_conformance.device.trial import Trial

POLL: Final = 0.05
"""Seconds between two readings of a position."""
STILL: Final = 0.3
"""Seconds without motion after which an actuator is at rest."""
LONGEST: Final = 20.0
"""Seconds that a motion may take."""
_PATIENCE: Final = 2.0
"""Seconds that a motion may take longer than its distance and its velocity say."""
_SHORTEST: Final = 10
"""The shortest move in counts that is checked."""
_STRAYS: Final = 16
"""Counts by which an actuator may be outside of its way before it is stopped."""


@dataclass
class Motion:
    """A motion that was watched.

    :param told: the command, for sentences.
    :param start: the position before.
    :param seconds: from the command to the message at its end, or to rest without one.
    :param rest: the position at rest.
    :param ends: the messages that report an end, of every channel.
    :param then: the position just after the message at its end.
    :param stopped: whether it was stopped as planned.
    :param strayed: where it was when it was stopped because it left its way or took too long.
    :param moved: whether the status reported motion while the position changed; None if it was not read.
    """

    told: str
    start: int
    seconds: float = 0.0
    rest: int = 0
    ends: list[Incoming] = field(default_factory=list)
    then: int | None = None
    stopped: bool = False
    strayed: int | None = None
    moved: bool | None = None


class Actuator:
    """An actuator on a channel, ready to move."""

    def __init__(self, trial: Trial, place: Target, channel: int) -> None:
        self.trial, self.place, self.channel = trial, place, channel
        self.text = f"{place.name} channel {channel}"
        family = family_of(place)
        assert family is not None  # only such targets are checked
        assert trial.allowed.motion is not None  # required for every motion
        self.family: Family = family
        low, high = trial.declared.reach(place, channel, trial.allowed.motion)
        self.low, self.high = span_of(trial, place, channel, family, low, high)
        self.start = self._at_rest_inside()
        self.rate = rate_of(trial, place, channel, family)

    # Its state

    def position(self, channel: int | None = None) -> int:
        """Return the position of this channel, or of another one."""
        number = channel or self.channel
        heard = self.trial.reply(self._request(number), self.place.address)
        return int(_value(heard, "position", number))

    @property
    def status(self) -> str:
        """The message with the status."""
        dc = self.place.status == "dc"
        return "MOT_GET_DCSTATUSUPDATE" if dc else "PZMOT_GET_STATUSUPDATE"

    def reports_motion(self) -> bool | None:
        """Return whether the status reports motion; None if the target has no such status."""
        name = self.status.replace("_GET_", "_REQ_")
        if name not in self.place.messages or self.place.status is None:
            return None
        request = self.trial.declared.make(name, self.channel)
        heard = self.trial.reply(request, self.place.address)
        bits = STATUS_BITS[self.place.status]
        return reports_motion(bits(_value(heard, "status_bits", self.channel)))

    def others(self) -> dict[int, int]:
        """Return the positions of the other channels."""
        return {each: self.position(each) for each in self.place.channels if each != self.channel}

    def jog_parameters(self) -> Jog:
        """Return the parameters of a jog."""
        return jog_of(self.trial, self.place, self.channel, self.family)

    def _request(self, channel: int) -> FramedMessage:
        name = "PZMOT_REQ_POSCOUNTERS"
        if name not in self.place.messages:
            query = self.place.unit.status_query
            assert query is not None
            assert query.req is not None  # every such unit has a status with the position
            name = query.req.layout.message
        made: FramedMessage = self.trial.declared.make(name, channel)
        return made

    def _at_rest_inside(self) -> int:
        """Return the position of an actuator at rest within the range; end the check for any other."""
        first = self.position()
        self.trial.line.pause(STILL)
        now = self.position()
        problem = ""
        if abs(now - first) > self.family.tolerance:
            problem = f"moves from {first} to {now}, though this run did not start a motion"
        elif not self.low <= now <= self.high:
            problem = f"is at {now}, outside of the allowed range ({self.low}..{self.high} counts)"
        if problem:
            self.trial.inconclusive(f"{self.text} {problem}; the check did not move it")
            raise EnoughError
        return now

    # Moves

    def prepare(self) -> None:
        """Enable the channel, and restore everything at the end of the check."""
        for placed in sets_of(self.trial.declared, self.place, self.channel, *self.family.stored):
            placed.undo(self.trial, placed.read(self.trial))
        get_ready(self.trial, self.place, self.channel)
        self.trial.undo(
            f"position of {self.text}", self._go_back, moves=True, rule=self.family.rules.move
        )

    def target(self, seconds: float, shortest: int = _SHORTEST) -> int:
        """Return a target that a move reaches in about some seconds; the check ends if there is no room."""
        way = max(shortest, round(self.rate * seconds))
        up, down = self.high - self.start, self.start - self.low
        room = max(up, down)
        if room < shortest or min(way, room) / max(self.rate, 1e-9) > LONGEST / 2:
            self.trial.inconclusive(
                f"{self.text}: the range {self.low}..{self.high} counts allows only {room} counts at "
                f"{self.rate:g} counts/s, which cannot be observed; allow a wider range, or set a higher "
                "velocity"
            )
            raise EnoughError
        return self.start + min(way, up) if up >= down else self.start - min(way, down)

    def move(self, target: int, stop: Callable[[int], bool] | None = None) -> Motion:
        """Move to a position and watch the motion to its end.

        :param stop: decides by the position to stop the motion.
        """
        start = self.position()
        told, message = move_to(self.trial, self.place, self.channel, target, target - start)
        return self.watch(told, message, start, target - start, self.rate, stop)

    def jog(self, direction: MoveDirection, step: int, rate: float) -> Motion:
        """Jog by a step and watch the motion to its end."""
        name = "MOT_MOVE_JOG" if "MOT_MOVE_JOG" in self.place.listed else "PZMOT_MOVE_JOG"
        kind: Any = m.MotMoveJog if name == "MOT_MOVE_JOG" else m.PzmotMoveJog
        told = f"{name} {direction.name.lower()} by a step of {step}"
        message = kind(self.channel, direction)
        return self.watch(told, message, self.position(), step, rate, both_ways=True)

    def watch(
        self,
        told: str,
        message: FramedMessage,
        start: int,
        way: int,
        rate: float,
        stop: Callable[[int], bool] | None = None,
        *,
        both_ways: bool = False,
    ) -> Motion:
        """Send a command, and watch the motion to its end.

        A motion that leaves its way, or that takes too long, is stopped.

        :param way: the distance; 0 if nothing should move.
        :param both_ways: whether the direction of the motion is not known.
        """
        line, seen = self.trial.line, Motion(told, start)
        limit = min(LONGEST, 2 * abs(way) / max(rate, 1e-9) + _PATIENCE)
        low, high = (-abs(way), abs(way)) if both_ways else (min(way, 0), max(way, 0))
        for each in self.place.channels:
            line.suspect(self.place, each)
        line.send(message, self.place.address)
        began = line.now
        while True:
            heard = line.listen(POLL, until=lambda each: each.name in line.ends)
            seen.ends += [each for each in heard if each.name in line.ends]
            seen.seconds = line.now - began
            if self._has_ended(seen.ends):
                seen.then = self.position()
                break
            position = self.position()
            if position != start and seen.moved is None and not seen.stopped:
                seen.moved = self.reports_motion()
            if not low - _STRAYS <= position - start <= high + _STRAYS or seen.seconds > limit:
                seen.strayed = position
                self._halt()
                break
            if stop is not None and not seen.stopped and stop(position):
                seen.stopped = True
                self.stop()
        seen.rest = self.rest()
        seen.ends += [each for each in line.listen(0) if each.name in line.ends]
        return seen

    def _has_ended(self, ends: list[Incoming]) -> bool:
        return any(each.channel in (self.channel, None) for each in ends)

    def stop(self) -> None:
        """Stop the actuator."""
        name = stop_of(self.place)
        manner = {} if name.startswith("PZMOT") else {"stop_mode": StopMode.PROFILED}
        self.trial.line.send(
            self.trial.declared.make(name, self.channel, **manner), self.place.address
        )

    def _halt(self) -> None:
        """Stop the actuator; disable it for a moment if it still moves."""
        self.stop()
        self.trial.line.pause(POLL)
        before = self.position()
        self.trial.line.pause(POLL)
        if self.position() != before:
            interrupt(self.trial, self.place, self.channel)

    def rest(self) -> int:
        """Wait until the position does not change, and return it."""
        line = self.trial.line
        at, since, began = self.position(), line.now, line.now
        while line.now - since < STILL and line.now - began < _PATIENCE:
            line.pause(POLL)
            now = self.position()
            if now != at:
                at, since = now, line.now
        return at

    def _go_back(self) -> None:
        """Move back to the position before the check."""
        if self.position() == self.start:
            return
        seen = self.move(self.start)
        self.trial.must(
            abs(seen.rest - self.start) <= self.family.tolerance,
            f"not restored: {self.text} is at {seen.rest} after {seen.told}; move it to {self.start}",
            rule=self.family.rules.move,
            cause=Cause(self.family.command, EFFECT),
        )


def _value(heard: Incoming, name: str, channel: int) -> int:
    """Return a value of a channel, also from the status of four channels."""
    value: int | None = getattr(heard.message, name, None)
    return getattr(heard.message, f"{name}_{channel.bit_length()}") if value is None else value
