"""A motor channel during a check: its position, its limits, and how it is kept within them.

A check moves a motor only if its position was read and is within the allowed range, and only to targets and
stopping points within it. At the end of the check, the motor returns to its previous position, and is
disabled again if it was disabled.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from stagewire_apt import messages as m
from stagewire_apt.enumerations import EnableState, MoveDirection
from stagewire_conformance.device.causes import EFFECT, MOTION_AT_REST, Cause, Miss
from stagewire_conformance.device.checks.apt.broken_rules import rule_of_status
from stagewire_conformance.device.checks.apt.enable_state import ENABLING, switch
from stagewire_conformance.device.checks.apt.motion.pace import Pace, pace_of
from stagewire_conformance.device.lines.motions import STATUS_BITS, reports_motion
from stagewire_conformance.device.trial import EnoughError

if TYPE_CHECKING:
    from stagewire import FramedMessage
    from stagewire_conformance.device.lines.dialogue import Incoming
    from stagewire_conformance.device.targets import Target
    from stagewire_conformance.device.trial import Trial

POLL: Final = 0.05
"""Seconds between two status requests to a moving motor."""

COMPLETED: Final = "MOT_MOVE_COMPLETED"
STOPPED: Final = "MOT_MOVE_STOPPED"
HOMED: Final = "MOT_MOVE_HOMED"
ENDS: Final = frozenset({COMPLETED, STOPPED, HOMED})
"""The messages that report the end of a motion."""

_STILL: Final = 0.3
"""Seconds without motion after which a motor is at rest."""

_LEAVING: Final = 10.0
"""Seconds within which a motor must come to rest after a stop."""

_SETTLING: Final = 0.5
"""Seconds by which the motion bits may be late after a motor has come to rest."""

_SHORTEST: Final = 16
"""The shortest move in counts that can be observed."""
_OF_MOVES: Final = ("MOT_MOVE_ABSOLUTE", "MOT_SET_VELPARAMS")
"""The messages on which the way back of a motor depends."""
JITTER: Final = 4
"""Counts by which a servo at rest may be seen to move."""
HELD: Final = 64
"""Counts within which a servo holds its stage."""
_STEPS: Final = 16
"""Counts by which the position of a stepper motor may differ from its target."""


@dataclass(frozen=True)
class Status:
    """The content of a status message.

    :param time: when it arrived.
    :param bits: the status bits, with a name for each.
    :param velocity: the velocity; None if the message has none.
    """

    time: float
    position: int
    bits: Any
    velocity: int | None
    heard: Incoming

    @property
    def direction(self) -> MoveDirection | None:
        """The direction of the reported move or jog; None if the motor reports neither or both."""
        bits = self.bits
        forward = bits.moving_forward or bits.jogging_forward
        reverse = bits.moving_reverse or bits.jogging_reverse
        if forward == reverse:
            return None
        return MoveDirection.FORWARD if forward else MoveDirection.REVERSE

    @property
    def moving(self) -> bool:
        """Whether the motor reports motion."""
        return reports_motion(self.bits)


class Axis:
    """A motor channel.

    :param trial: the trial of the check.
    :param place: the target that has the channel.
    :param channel: the number of the channel.
    """

    def __init__(self, trial: Trial, place: Target, channel: int) -> None:
        self.trial = trial
        self.place = place
        self.channel = channel
        self.text = f"{place.name} channel {channel}"
        assert trial.allowed.motion is not None  # required for every motion
        self.low, self.high = trial.declared.reach(place, channel, trial.allowed.motion)
        query = place.unit.status_query
        assert query is not None
        assert query.req is not None  # every unit with motors has a status that can be requested
        self._request = trial.declared.make(query.req.layout.message, channel)
        self.watched = 0.0
        """The time at which the last motion had been watched."""
        self.start = 0
        """The position to which it returns at the end."""
        self.backlash = 0
        self.settle_time: int | None = None
        """The settle time in cycles after a move (page 67); None if it has no such parameter."""
        self.pace = Pace(1.0, 1.0, known=False)
        self.speeds: list[float] = []
        """The highest speed of each move of the check, in counts/s."""
        self.clockwise = 0
        """1 if positions rise in the direction forward, -1 if they fall; 0 until a motion has shown it.

        Forward is clockwise (page 77), but no page gives clockwise a sign: erratum
        apt-clockwise-without-sign.
        """

    def inside(self) -> Status:
        """Return the status of a motor at rest within the range; end the check for any other.

        The position of a stage, or its motion by another cause, is not a fault of the controller.
        """
        first = self.status()
        status = self.settled(first)
        self.start = max(self.low, min(status.position, self.high))
        if abs(status.position - self.start) > HELD:
            self.trial.inconclusive(
                f"{self.text} is at {status.position} counts, outside of the allowed range "
                f"({self.low}..{self.high} counts), so it was not moved; move it into the "
                "range, or allow a range that includes its position"
            )
            raise EnoughError
        if status.moving and abs(status.position - first.position) > JITTER:
            self.trial.inconclusive(
                f"{self.text} is moving from {first.position} to {status.position} counts, "
                "though this run did not start a motion; the check did not move it"
            )
            raise EnoughError
        self.trial.need(
            not status.moving,
            f"{self.text} reports motion before this run has started one: {status.heard.text}",
            rule=rule_of_status(self.place, "bits-motion"),
            cause=Cause(status.heard.name, MOTION_AT_REST),
            because=(Cause("MOT_GET_STATUSBITS", "status_bits"),),
            came=status.heard.raw,
        )
        return status

    def begin(self) -> None:
        """Prepare a motor for motion; end the check if this is not allowed.

        End messages are resumed, which is their default state (page 83); whether they were suspended cannot
        be read.
        """
        status = self.inside()
        self.send_if_claimed(m.MotResumeEndOfMoveMsgs())
        switch(self.trial, self.place, self.channel, EnableState.ENABLE)
        self.pace = pace_of(self.trial, self.place, self.channel)
        if status.bits.homed and "MOT_REQ_PMDSTAGEAXISPARAMS" in self.place.messages:
            # Such a controller has the travel of its stage (page 76), which the allowed range may exceed.
            told = self.ask(m.MotReqPmdStageAxisParams(self.channel)).message
            self.low = min(max(self.low, told.min_pos), self.start)
            self.high = max(min(self.high, told.max_pos), self.start)
        if "MOT_REQ_PMDTRACKSETTLEPARAMS" in self.place.messages:
            told = self.ask(m.MotReqPmdTrackSettleParams(self.channel)).message
            self.settle_time = told.time
        if "MOT_REQ_GENMOVEPARAMS" in self.place.messages:
            reply = self.ask(m.MotReqGenMoveParams(self.channel))
            self.backlash = reply.message.backlash_distance

    def can_return_to(self, position: int) -> bool:
        """Return whether a move to a position from anywhere in the range stays within it.

        To correct the backlash, a motor goes beyond its target and comes back (page 34).
        """
        return self.low <= min(position, position - self.backlash) and (
            max(position, position - self.backlash) <= self.high
        )

    # Messages

    def send(self, message: FramedMessage) -> None:
        """Send a message to the target."""
        self.trial.line.send(message, self.place.address)

    def send_if_claimed(self, message: FramedMessage) -> None:
        """Send a message if the target claims it."""
        if message.layout.message in self.place.messages:
            self.send(message)

    def ask(self, request: FramedMessage) -> Incoming:
        """Send a request, and return the reply; the check ends without one."""
        return self.trial.reply(request, self.place.address)

    def status(self) -> Status:
        """Request the status; the check ends without a reply."""
        return self.status_of(self.ask(self._request))

    @property
    def status_name(self) -> str:
        """The name of the message with the status."""
        message = self._request.layout.message
        [name] = self.trial.declared.registry.messages[message]["exchange"]["answered_by"]
        return str(name)

    @property
    def doubts(self) -> tuple[Cause, ...]:
        """The reported defects that explain why a motor is not where a move should have brought it."""
        own = (
            *self.spoilt,
            *ENABLING,
            Cause("MOT_MOVE_COMPLETED", "early"),
            Cause("MOT_MOVE_HOME", "position"),
        )
        return (*own, *(cause for cause in self.trial.causes if cause.subject in _OF_MOVES))

    @property
    def spoilt(self) -> tuple[Cause, ...]:
        """The defects with which the status does not show where a motor is, and whether it moves."""
        return Cause(self.status_name, "position"), Cause(self.status_name, MOTION_AT_REST)

    def status_within(self, seconds: float) -> Status | None:
        """Request the status; return None without a reply in time."""
        heard = self.trial.line.ask(self._request, self.place.address, seconds)
        return None if heard is None else self.status_of(heard)

    def position(self) -> int:
        """Request the position: from the counter if it is claimed and right, because a status may lag."""
        wrong = self.trial.causes.check_of(Cause("MOT_GET_POSCOUNTER", "position"))
        if wrong or "MOT_REQ_POSCOUNTER" not in self.place.messages:
            return self.status().position
        position: int = self.ask(m.MotReqPosCounter(self.channel)).message.position
        return position

    def settled(self, status: Status) -> Status:
        """Return a status without motion, or the latest one after half a second."""
        end = self.trial.line.now + _SETTLING
        while status.moving and self.trial.line.now < end:
            self.pause(POLL)
            status = self.status()
        return status

    def status_of(self, heard: Incoming) -> Status:
        """Return the content of a message with a status."""
        message = heard.message
        bits = STATUS_BITS[self.place.status or ""](message.status_bits)
        velocity: int | None = getattr(message, "velocity", None)
        return Status(heard.time, message.position, bits, velocity, heard)

    # Directions

    def direction_of(self, way: int) -> MoveDirection | None:
        """Return the direction in which positions rise (1) or fall (-1); None if it is not known yet."""
        if not self.clockwise:
            return None
        return MoveDirection.FORWARD if way == self.clockwise else MoveDirection.REVERSE

    def way_of(self, direction: MoveDirection) -> int:
        """Return how positions change in a direction: 1 up, -1 down; 0 if it is not known yet."""
        return self.clockwise if direction is MoveDirection.FORWARD else -self.clockwise

    def learn(self, way: int, direction: MoveDirection) -> None:
        """Record that positions rise (1) or fall (-1) in a direction."""
        self.clockwise = way if direction is MoveDirection.FORWARD else -way

    # Limits

    @property
    def inner(self) -> tuple[int, int]:
        """The range without a margin at both ends and without the room for the backlash (page 34).

        To correct the backlash, a motor goes beyond its target and comes back.
        """
        margin = (self.high - self.low) // 50
        return (
            self.low + margin + max(0, self.backlash),
            self.high - margin - max(0, -self.backlash),
        )

    def room(self, position: int, direction: int) -> int:
        """Return the counts of room from a position to higher positions (1) or to lower ones (-1)."""
        low, high = self.inner
        return max(0, high - position if direction > 0 else position - low)

    def wider(self, position: int) -> int:
        """Return the direction with more room: 1 or -1."""
        return 1 if self.room(position, 1) >= self.room(position, -1) else -1

    def distance(self, position: int, seconds: float, pace: Pace | None = None) -> int:
        """Return a signed distance that takes about so many seconds.

        The check ends with INFO if there is no room for one.
        """
        direction = self.wider(position)
        room = self.room(position, direction)
        self._need_room(room, _SHORTEST, f"at {position} counts")
        return direction * self._within(room, seconds, pace)

    def step(self, seconds: float, pace: Pace) -> int:
        """Return a distance that takes about so many seconds and fits both up and down from some position.

        The check ends with INFO if there is no room for one.
        """
        return self._within(self.half(_SHORTEST), seconds, pace)

    def half(self, least: int) -> int:
        """Return the counts of room both up and down from the middle of the range.

        The check ends with INFO if there is less than ``least``.
        """
        low, high = self.inner
        half = (high - low) // 2
        self._need_room(half, least, "moving in either direction")
        return half

    def place_with_room(self, distance: int) -> int:
        """Return the nearest position with room for a distance both up and down."""
        low, high = self.inner
        return max(low + distance, min(self.start, high - distance))

    def _need_room(self, room: int, least: int, why: str) -> None:
        if room < least:
            self.trial.inconclusive(
                f"{self.text}, {why}, has only {room} counts of room in {self.low}..{self.high} "
                f"(the backlash is {self.backlash} counts); allow a wider range"
            )
            raise EnoughError

    def _within(self, room: int, seconds: float, pace: Pace | None) -> int:
        pace = pace or self.pace
        wanted = pace.distance(seconds)
        if not pace.known:  # a share of the range, so that the motion can be observed
            share = (self.high - self.low) // 200
            wanted = max(wanted, min(share, int(2 * pace.measured)) if pace.measured else share)
        return max(_SHORTEST, min(wanted, room))

    # Rest

    def standing(self, wait: float = _LEAVING) -> Status:
        """Wait until the motor is at rest, and return its status. Keep all other messages in the inbox."""
        end = self.trial.line.now + wait
        last = self.status()
        since = last.time
        while self.trial.line.now < end:
            self.pause(POLL)
            now = self.status()
            if abs(now.position - last.position) > JITTER or now.moving:
                since = now.time
            last = now
            if now.time - since >= _STILL:
                break
        return last

    def pause(self, seconds: float) -> None:
        """Wait, and keep all messages in the inbox."""
        self.trial.line.pause(seconds)

    def pause_after_motion(self, seconds: float) -> None:
        """Wait until some seconds have passed since the last motion. Motors that moved together wait once."""
        self.pause(max(self.watched + seconds - self.trial.line.now, 0.0))

    def halt(self) -> Status:
        """Stop the motor immediately and return its status at rest; disable it if it ignores the stop.

        If it still does not come to rest, the check ends.
        """
        if not self.trial.line.stop_channel(self.place, self.channel):
            raise EnoughError
        return self.status()

    def disable(self) -> None:
        """Disable a motor that ignores its stops. It stays disabled, and nothing is moved any more."""
        self.trial.line.disable_channel(self.place, self.channel)

    def cause_of_miss(self, command: str, missed: int, way: int) -> Cause:
        """Return the cause of a missed target: that of another command that missed its target alike.

        :param missed: the counts from the target to the final position.
        :param way: the commanded distance.
        """
        miss = Miss(missed, way)
        alike = (each for each in self.trial.causes if each.miss and miss.is_like(each.miss))
        return next(alike, Cause(command, EFFECT, miss))

    def tolerance(self, distance: int) -> int:
        """Return the counts by which a motor may miss its target after a move over some distance.

        The document gives no figure. For a servo, this is half a per cent or its accuracy, but never more
        than a quarter of the distance. A stepper motor counts its own steps, so it hardly ever misses.
        """
        if self.place.status == "stepper":
            return max(JITTER, min(_STEPS, abs(distance) // 4))
        return max(JITTER, min(max(HELD, abs(distance) // 200), abs(distance) // 4))

    @staticmethod
    def overshoot(distance: int) -> int:
        """Return the counts by which a servo may go beyond its target after a move over some distance.

        The document gives no figure.
        """
        return max(2 * HELD, abs(distance) // 50)
