"""A motor channel during a check: where it is, where it may go, and how it is kept there.

Nothing moves before the position has been read and lies within what was allowed, and no target or stopping
place lies outside. At the end of the check the motor goes back to where it was, and is disabled again if it
was.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from stagewire_apt import flags
from stagewire_apt import messages as m
from stagewire_apt.enumerations import EnableState, MoveDirection, StopMode
from stagewire_conformance.device.checks.apt.enable_state import switch
from stagewire_conformance.device.checks.apt.motion.pace import Pace, pace_of
from stagewire_conformance.device.checks.apt.settings.sets import PlacedSet, Values, parameter_sets
from stagewire_conformance.device.trial import EnoughError

if TYPE_CHECKING:
    from stagewire import FramedMessage
    from stagewire_conformance.device.lines.dialogue import Incoming
    from stagewire_conformance.device.targets import Target
    from stagewire_conformance.device.trial import Trial

POLL: Final = 0.05
"""Seconds between two looks at a motor in motion."""

_STILL: Final = 0.3
"""Seconds without motion after which a motor stands."""

_LEAVING: Final = 10.0
"""Seconds in which a stop has to have happened."""

_SETTLING: Final = 0.5
"""Seconds by which bits that say that a motor moves may be late when it stands."""

_SHORTEST: Final = 16
"""Counts of the shortest move that shows anything."""
JITTER: Final = 4
"""Counts by which a servo at rest is seen to move."""
HELD: Final = 64
"""Counts within which a servo holds its stage."""

_MOTION: Final = (
    "moving_forward", "moving_reverse", "jogging_forward", "jogging_reverse", "homing",
)  # fmt: skip
"""Bits that say that a motor is in motion."""

_BITS: Final = {"dc": flags.DcStatusBits, "stepper": flags.StepperStatusBits}


@dataclass(frozen=True)
class Status:
    """What a status message said.

    :param time: when it came.
    :param bits: with a name for each.
    :param velocity: as it is told; None: it is not.
    """

    time: float
    position: int
    bits: Any
    velocity: int | None
    heard: Incoming

    @property
    def direction(self) -> MoveDirection | None:
        """The direction in which it says that the motor moves or jogs; None: in neither, or in both."""
        bits = self.bits
        forward = bits.moving_forward or bits.jogging_forward
        reverse = bits.moving_reverse or bits.jogging_reverse
        if forward == reverse:
            return None
        return MoveDirection.FORWARD if forward else MoveDirection.REVERSE

    @property
    def moving(self) -> bool:
        """Whether it says that the motor is in motion."""
        return any(getattr(self.bits, name) for name in _MOTION)


class Axis:
    """A motor channel.

    :param trial: of the check.
    :param place: where it is.
    :param channel: its number.
    """

    def __init__(self, trial: Trial, place: Target, channel: int) -> None:
        self.trial = trial
        self.place = place
        self.channel = channel
        self.text = f"{place.name} channel {channel}"
        assert trial.allowed.motion is not None  # who moves needs it
        self.low, self.high = trial.declared.reach(place, channel, trial.allowed.motion)
        query = place.unit.status_query
        assert query is not None
        assert query.req is not None  # whoever has a motor has a status that can be asked for
        self._request = trial.declared.make(query.req.layout.message, channel)
        self.start = 0
        """Where it goes back to at the end."""
        self.backlash = 0
        self.settle_time: int | None = None
        """The cycles that it settles after a move (page 67); None: it has no such parameter."""
        self.pace = Pace(1.0, 1.0, known=False)
        self.clockwise = 0
        """1 where positions rise in the direction forward, -1 where they fall; 0 until a motion has shown it.

        Forward is clockwise (page 77), and no page gives that a sign: erratum apt-clockwise-without-sign.
        """

    def inside(self) -> Status:
        """Return the status of a motor at rest within the range; the check ends for any other.

        Where a stage stands, and who else moves it, says nothing of its controller.
        """
        first = self.status()
        status = self.settled(first)
        self.start = max(self.low, min(status.position, self.high))
        if abs(status.position - self.start) > HELD:
            self.trial.inconclusive(
                f"{self.text} is at {status.position} counts, outside of what was allowed ({self.low}.."
                f"{self.high} counts), so nothing was moved; bring it there, or allow a range that "
                "includes its position"
            )
            raise EnoughError
        if status.moving and abs(status.position - first.position) > JITTER:
            self.trial.inconclusive(
                f"{self.text} is being moved, from {first.position} to {status.position} counts, though "
                "this run did not tell it to; so nothing was moved"
            )
            raise EnoughError
        self.trial.need(
            not status.moving,
            f"{self.text} says that it is moving before it was told to: {status.heard.text}",
            came=status.heard.raw,
        )
        return status

    def begin(self) -> None:
        """Make ready for moving; the check ends where that may not be.

        End messages are let through, which is the default (page 83); who suspended them cannot be told.
        """
        status = self.inside()
        self.send_if_claimed(m.MotResumeEndOfMoveMsgs())
        switch(self.trial, self.place, self.channel, EnableState.ENABLE)
        self.pace = pace_of(self.trial, self.place, self.channel)
        if status.bits.homed and "MOT_REQ_PMDSTAGEAXISPARAMS" in self.place.messages:
            # Such a controller knows the travel of its stage (page 76), which a range may exceed.
            told = self.ask(m.MotReqPmdStageAxisParams(self.channel)).message
            self.low = min(max(self.low, told.min_pos), self.start)
            self.high = max(min(self.high, told.max_pos), self.start)
        if "MOT_REQ_PMDTRACKSETTLEPARAMS" in self.place.messages:
            told = self.ask(m.MotReqPmdTrackSettleParams(self.channel)).message
            self.settle_time = told.time
        if "MOT_REQ_GENMOVEPARAMS" in self.place.messages:
            reply = self.ask(m.MotReqGenMoveParams(self.channel))
            self.backlash = reply.message.backlash_distance
            if not self.can_return_to(self.start):
                self._do_without_backlash()

    def can_return_to(self, position: int) -> bool:
        """Return whether a move to a position keeps within the range, from wherever it comes.

        Against the backlash a motor goes beyond its target, and comes back (page 34).
        """
        return self.low <= min(position, position - self.backlash) and (
            max(position, position - self.backlash) <= self.high
        )

    def _do_without_backlash(self) -> None:
        """Switch the correction of the backlash off until the end of the check, or end it."""
        setting = "MOT_SET_GENMOVEPARAMS"
        if not self.trial.allowed.settings or setting not in self.place.messages:
            self.trial.inconclusive(
                f"{self.text} is at {self.start} counts, where it would leave {self.low}..{self.high} for "
                f"its backlash of {self.backlash} counts; allow a wider range, or settings, so that it can "
                "be switched off"
            )
            raise EnoughError
        change(self, setting, backlash_distance=0)
        self.backlash = 0

    # Asking and telling

    def send(self, message: FramedMessage) -> None:
        """Send a message to the place."""
        self.trial.line.send(message, self.place.address)

    def send_if_claimed(self, message: FramedMessage) -> None:
        """Send a message if the place claims to take it."""
        if message.layout.message in self.place.messages:
            self.send(message)

    def ask(self, request: FramedMessage) -> Incoming:
        """Ask the place; the check ends where nothing answers."""
        return self.trial.reply(request, self.place.address)

    def status(self) -> Status:
        """Ask for the status; the check ends where nothing answers."""
        return self.status_of(self.ask(self._request))

    def status_within(self, seconds: float) -> Status | None:
        """Ask for the status; None where nothing answers in time."""
        heard = self.trial.line.ask(self._request, self.place.address, seconds)
        return None if heard is None else self.status_of(heard)

    def settled(self, status: Status) -> Status:
        """Return a later status, if it is needed until one says that nothing moves, and half a second."""
        end = self.trial.line.now + _SETTLING
        while status.moving and self.trial.line.now < end:
            self.pause(POLL)
            status = self.status()
        return status

    def status_of(self, heard: Incoming) -> Status:
        """Return what a message with a status says."""
        message = heard.message
        bits = _BITS[self.place.status or ""](message.status_bits)
        velocity: int | None = getattr(message, "velocity", None)
        return Status(heard.time, message.position, bits, velocity, heard)

    # Its directions

    def direction_of(self, way: int) -> MoveDirection | None:
        """Return the direction in which positions rise (1) or fall (-1); None: that is not known yet."""
        if not self.clockwise:
            return None
        return MoveDirection.FORWARD if way == self.clockwise else MoveDirection.REVERSE

    def way_of(self, direction: MoveDirection) -> int:
        """Return how positions change in a direction: 1 up, -1 down; 0: that is not known yet."""
        return self.clockwise if direction is MoveDirection.FORWARD else -self.clockwise

    def learn(self, way: int, direction: MoveDirection) -> None:
        """Note that positions rise (1) or fall (-1) in a direction."""
        self.clockwise = way if direction is MoveDirection.FORWARD else -way

    # Where it may go

    @property
    def inner(self) -> tuple[int, int]:
        """The range without a margin at both ends, and without what the backlash needs (page 34).

        Against the backlash a motor goes beyond its target and comes back.
        """
        margin = (self.high - self.low) // 50
        return (
            self.low + margin + max(0, self.backlash),
            self.high - margin - max(0, -self.backlash),
        )

    def room(self, position: int, direction: int) -> int:
        """Return how many counts it may go from a position, to higher ones (1) or to lower ones (-1)."""
        low, high = self.inner
        return max(0, high - position if direction > 0 else position - low)

    def wider(self, position: int) -> int:
        """Return the direction in which there is more room."""
        return 1 if self.room(position, 1) >= self.room(position, -1) else -1

    def distance(self, position: int, seconds: float, pace: Pace | None = None) -> int:
        """Return a distance, with its direction, that takes about so many seconds.

        Without room for one the check is INFO, and ends.
        """
        direction = self.wider(position)
        room = self.room(position, direction)
        self._need_room(room, _SHORTEST, f"is at {position} counts, and")
        return direction * self._within(room, seconds, pace)

    def step(self, seconds: float, pace: Pace) -> int:
        """Return a distance that takes about so many seconds, with room for it up and down from some place.

        Without room for one the check is INFO, and ends.
        """
        return self._within(self.half(_SHORTEST), seconds, pace)

    def half(self, least: int) -> int:
        """Return for how many counts there is room up and down from the middle of the range.

        Where that is less than ``least`` the check is INFO, and ends.
        """
        low, high = self.inner
        half = (high - low) // 2
        self._need_room(half, least, "may go forward to higher or to lower positions, and")
        return half

    def place_with_room(self, distance: int) -> int:
        """Return the nearest place from which there is room for a distance up and down."""
        low, high = self.inner
        return max(low + distance, min(self.start, high - distance))

    def _need_room(self, room: int, least: int, why: str) -> None:
        if room < least:
            self.trial.inconclusive(
                f"{self.text} {why} has no more than {room} counts to go to in {self.low}..{self.high} "
                f"(the backlash is {self.backlash} counts); allow a wider range"
            )
            raise EnoughError

    def _within(self, room: int, seconds: float, pace: Pace | None) -> int:
        pace = pace or self.pace
        wanted = pace.distance(seconds)
        if not pace.known:  # a share of the range, so that something is to be seen
            wanted = max(wanted, (self.high - self.low) // 200)
        return max(_SHORTEST, min(wanted, room))

    # Standing

    def standing(self, wait: float = _LEAVING) -> Status:
        """Wait until it stands, and return its status; what comes meanwhile stays to be heard."""
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
        """Wait; what comes meanwhile stays to be heard."""
        line = self.trial.line
        kept = line.listen(seconds)
        line.heard[:0] = kept

    def halt(self) -> Status:
        """Stop it now, whatever it does, and wait until it stands."""
        self.send(m.MotMoveStop(self.channel, StopMode.IMMEDIATE))
        return self.standing()

    def tolerance(self, distance: int) -> int:
        """Return by how many counts it may miss the target of a move over some distance.

        The document gives no figure: half a percent, or what a servo holds; never more than a quarter of the
        way.
        """
        return max(JITTER, min(max(HELD, abs(distance) // 200), abs(distance) // 4))


def present(axis: Axis, setting: str) -> Values:
    """Return the values of a parameter set, by the name of its SET."""
    return _placed_set(axis, setting).read(axis.trial)


def change(axis: Axis, setting: str, *, at_most: str = "", **values: Any) -> None:
    """Change values of a parameter set until the end of the check, and see that they are there.

    The check ends where they are not: what it would do then, nobody can tell.

    :param at_most: the value that may come back smaller, such as a velocity that the controller rounds.
    """
    placed = _placed_set(axis, setting)
    before = placed.read(axis.trial)
    wanted = {**before, **values}
    axis.trial.undo(f"{setting} at {axis.text}", lambda: placed.put_back(axis.trial, before))
    placed.write(axis.trial, wanted)
    came = placed.ask(axis.trial)
    told = placed.values(came)
    lower = at_most and 0 < told[at_most] <= wanted[at_most]
    wrote = ", ".join(f"{name} = {value}" for name, value in values.items())
    says = ", ".join(f"{name} = {told[name]}" for name in values)
    axis.trial.need(
        told == ({**wanted, at_most: told[at_most]} if lower else wanted),
        f"{axis.text}: {setting} wrote {wrote}, and {placed.set.get} then said {says}; so nothing was moved",
        wanted=placed.expected(axis.trial, wanted, came),
        came=came.raw,
    )


def _placed_set(axis: Axis, setting: str) -> PlacedSet:
    sets = parameter_sets(axis.trial.declared, axis.place)
    return PlacedSet(axis.place, axis.channel, next(each for each in sets if each.set == setting))
