"""Bring everything to rest that a check has set in motion, and verify that it is at rest.

A controller may ignore a stop, report the end of a motion that continues, report a position that does not
change during a motion, or stop answering. So a part rests only if its position does not change and its status
reports no motion. Each part has measures, such as a stop with a profile, an immediate stop, and
disabling it. The next measure is taken as soon as the last one has no effect.
"""

from __future__ import annotations

from collections.abc import Callable, Container, Sequence
from dataclasses import dataclass, field, replace
from typing import Final, NamedTuple, Protocol

from stagewire_conformance.device.causes import Cause

_POLL: Final = 0.05
"""Seconds between two readings of a part."""
_HALF: Final = 0.25
"""The length in seconds of two successive intervals whose speeds show whether a part slows down."""
_SLOWER: Final = 0.9
"""The largest ratio of two successive speeds of a part that slows down."""
_PATIENCE: Final = 3.0
"""Seconds after which the next measure is taken for a part that hardly moves but is not at rest."""
_LONGEST: Final = 10.0
"""Seconds after which the next measure is taken, even if the part slows down."""
_UNANSWERED: Final = 3
"""Readings without an answer after which the next measure is taken."""

_STILL: Final = ((0.3, 1), (0.75, 4), (1.5, 8))
"""Times in seconds, each with the most counts by which the position of a part at rest changes in that time.

A servo that holds its stage may oscillate, and a slow motion must not be mistaken for that.
"""
_TREMBLES: Final = 8
"""Counts in :data:`_HALF` up to which a change may be an oscillation."""


class Sighting(NamedTuple):
    """The state of a part at one instant.

    :param moving: whether the controller reports motion.
    """

    time: float
    position: int
    moving: bool


@dataclass(frozen=True)
class Measure:
    """Something that brings a part to rest.

    :param text: such as ``an immediate MOT_MOVE_STOP``.
    :param take: sends it. It raises nothing on a lost line.
    :param disables: whether it disables the part.
    :param moves: whether it is a motion, such as one at the speed 0. It is not sent to a part that reports
        motion but does not change its position.
    """

    text: str
    take: Callable[[], None]
    disables: bool = False
    moves: bool = False


@dataclass(frozen=True, eq=False)
class Part:
    """A channel or an axis that was set in motion.

    :param name: such as ``0x50 channel 1``.
    :param measures: the mildest first.
    :param look: returns its state, or None without an answer. None for a part whose state cannot be read,
        such as a waveform: it is at rest after its first measure.
    :param silent: the defects with which it does not answer.
    :param stuck: the defects with which it reports motion at rest.
    :param listed: whether the PICS lists the request of its state as supported.
    :param active: what it is when it is not at rest: ``moving``, or ``switched on`` without a position.
    """

    name: str
    measures: tuple[Measure, ...]
    look: Callable[[], Sighting | None] | None
    silent: tuple[Cause, ...] = ()
    stuck: tuple[Cause, ...] = ()
    listed: bool = True
    active: str = "moving"

    def if_seen(self, now: Callable[[], float]) -> Part:
        """Return the part, with a missing answer counted as rest."""
        look = self.look
        if look is None:
            return self
        return replace(self, look=lambda: look() or Sighting(now(), 0, moving=False))


@dataclass(frozen=True)
class Adrift:
    """A part that may still be moving although every measure was taken.

    :param text: a sentence about it.
    :param blames: whether the controller is to blame.
    :param because: the defects that explain it: a part that does not answer, or always reports motion, need
        not have ignored its stops.
    """

    text: str
    blames: bool = True
    because: tuple[Cause, ...] = ()


class Clocked(Protocol):
    """A line with a clock, which can wait."""

    @property
    def now(self) -> float:
        """The time in seconds."""
        ...

    def pause(self, seconds: float) -> None:
        """Wait, and keep everything that arrives."""
        ...


@dataclass
class _Watched:
    """A part that is being brought to rest.

    :param taken: the number of measures taken.
    :param since: when the last measure was taken.
    """

    part: Part
    taken: int
    since: float
    seen: list[Sighting] = field(default_factory=list)
    unanswered: int = 0

    def look(self) -> None:
        """Look at the part once."""
        assert self.part.look is not None
        sighting = self.part.look()
        if sighting is None:
            self.unanswered += 1
        else:
            self.unanswered = 0
            self.seen.append(sighting)

    @property
    def rests(self) -> bool:
        """Whether the part is at rest, according to its positions and its status."""
        return self._is_still and not self.seen[-1].moving

    @property
    def _is_still(self) -> bool:
        """Whether the part is at rest, according to its positions."""
        return any(self._stays(seconds, most) for seconds, most in _STILL)

    def _stays(self, seconds: float, most: int) -> bool:
        """Return whether the position has changed by at most ``most`` in the last ``seconds``."""
        if not self.seen or self.seen[-1].time - self.seen[0].time < seconds:
            return False
        last = self.seen[-1].time - seconds
        positions = [each.position for each in self.seen if each.time >= last]
        return len(positions) > 1 and max(positions) - min(positions) <= most

    def needs_more(self, now: float) -> bool:
        """Return whether the last measure has no effect."""
        if self.unanswered >= _UNANSWERED or now - self.since > _LONGEST:
            return True
        earlier, later = self._speed(2 * _HALF, _HALF), self._speed(_HALF, 0.0)
        if earlier is None or later is None:
            return False
        if later * _HALF > _TREMBLES:
            return later > _SLOWER * earlier
        return (
            now - self.since > _PATIENCE
        )  # it creeps, oscillates, or reports motion that has ended

    def _speed(self, first: float, last: float) -> float | None:
        """Return the speed between two instants before the last sighting; None if it was not seen."""
        if not self.seen or self.seen[-1].time - first < max(self.since, self.seen[0].time):
            return None
        now = self.seen[-1].time
        seen = [each for each in self.seen if now - first <= each.time <= now - last]
        if len(seen) < 2:
            return None
        return abs(seen[-1].position - seen[0].position) / max(seen[-1].time - seen[0].time, 1e-3)

    def take_more(self, now: float) -> bool:
        """Take the next measure; return whether there was one."""
        if self.taken == len(self.part.measures):
            return False
        measure = self.part.measures[self.taken]
        if measure.moves and self._is_still:
            return False
        measure.take()
        self.taken, self.since, self.unanswered = self.taken + 1, now, 0
        return True

    @property
    def adrift(self) -> Adrift:
        """The description of a part that is not at rest."""
        taken = ", ".join(each.text for each in self.part.measures[: self.taken])
        if self.unanswered or not self.seen:
            text = f"{self.part.name} may still be {self.part.active}: it does not answer after {taken}"
            return Adrift(text, because=self.part.silent)
        last = self.seen[-1]
        if self.part.active != "moving":
            return Adrift(
                f"{self.part.name} is still {self.part.active} after {taken}",
                because=self.part.stuck,
            )
        first = next(each for each in self.seen if last.time - each.time <= 2 * _HALF)
        speed = abs(last.position - first.position) / max(last.time - first.time, _POLL)
        because: tuple[Cause, ...] = ()
        if speed:
            what = f"still moves at about {speed:.0f} counts/s"
        elif last.moving:
            what, because = "still reports motion", self.part.stuck
        else:
            what = "does not come to rest"
        text = f"{self.part.name} {what} after {taken}; it is at {last.position}"
        return Adrift(text, because=because)


def moves(line: Clocked, part: Part) -> bool:
    """Return whether a part reports motion and its position changes."""
    seen = part.look() if part.look else None
    if seen is None or not seen.moving:
        return False
    assert part.look
    line.pause(_HALF)
    then = part.look()
    return then is not None and abs(then.position - seen.position) > _TREMBLES


def bring_to_rest(line: Clocked, parts: Sequence[Part], stopped: Container[str]) -> list[Adrift]:
    """Wait until all parts are at rest, and take measures for those that are not.

    Returns the parts that do not come to rest.

    :param stopped: the names of the parts whose first measure was already taken.
    """
    watched = [_Watched(part, int(part.name in stopped), line.now) for part in parts if part.look]
    lost: list[Adrift] = []
    while watched:
        for each in [*watched]:
            each.look()
            if each.rests:
                watched.remove(each)
            elif each.needs_more(line.now) and not each.take_more(line.now):
                watched.remove(each)
                lost.append(each.adrift)
        if watched:
            line.pause(_POLL)
    return lost
