"""Motions: at most one per channel, how it ends, and its state after its caller has given up.

1. A motion ends with a message about its channel, from its address, received after its command was written.
2. A stop ends the motion when it is answered. Until then, no other motion may begin on that channel, because
   the answer would be taken for its end.
3. A motion whose end did not arrive in time, or that its caller gave up, may still be in progress. It is
   *unknown*, and another one is refused, until its end arrives, a stop is answered, or a status shows that
   nothing moves.
4. An answer to a stop that was given up does not end a motion that began later.
5. If an end has no address and several channels wait for one, it matches none of them. Their timeouts report
   that it arrived.
6. A fault report names no channel, so it ends the wait for every motion at its address, unless it names a
   message that began none of them. It is not the end of a motion, which is *unknown* from then on.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import inf

from stagewire._framings.header.frame import Received, Undocumented
from stagewire._framings.header.table import Fault
from stagewire._sessions.framed_exchanges import Halt, Motion
from stagewire._sessions.matching import Matching
from stagewire._sessions.statistics import Statistics
from stagewire.errors import MotionStoppedError, MotionUnderWayError


class _Channel:
    """The exchanges in progress on one channel of one address."""

    __slots__ = ("halts", "motion")

    def __init__(self) -> None:
        self.motion: Motion | None = None  # unknown if its exchange has ended
        self.halts: list[Halt] = []  # may still be answered after their exchange has ended


class Motions:
    """The motions of one line.

    :param matching: matches frames to exchanges.
    :param statistics: counts them.
    :param quiet: seconds in which the answer to a stop may arrive after it was given up.
    """

    def __init__(self, matching: Matching, statistics: Statistics, quiet: float) -> None:
        self._matching = matching
        self._statistics = statistics
        self._quiet = quiet
        self.awaited: dict[int, list[Motion | Halt]] = {}
        """Message -> the motions and stops that were written and that it may end."""
        self._channels: dict[tuple[int, int | None], _Channel] = {}

    def _of(self, exchange: Motion | Halt) -> _Channel:
        return self._channels.setdefault((exchange.dest, exchange.channel), _Channel())

    # Before writing

    def check(self, dest: int, channel: int | None, name: str) -> None:
        """Raise :class:`~stagewire.errors.MotionUnderWayError` unless a motion may begin there."""
        known = self._channels.get((dest, channel))
        if known is None:
            return
        where = f"{dest:#04x}" if channel is None else f"channel {channel} of {dest:#04x}"
        unanswered = [halt for halt in known.halts if not halt.done]
        if known.motion is not None and known.motion.done:
            raise MotionUnderWayError(
                f"{name} was not sent: {known.motion.name} on {where} was given up before its end was "
                "reported, and may still be in progress; stop it, or read the status until nothing moves"
            )
        if known.motion is not None:
            raise MotionUnderWayError(
                f"{name} was not sent: {known.motion.name} is in progress on {where}; wait for its end, or "
                "stop it"
            )
        if unanswered:
            raise MotionUnderWayError(
                f"{name} was not sent: {unanswered[0].name} on {where} was not answered yet; wait for it"
            )

    def plan(self, motion: Motion) -> None:
        """Note a motion that will be written."""
        self._of(motion).motion = motion

    def unplan(self, motion: Motion) -> None:
        """Remove a motion that will not be written, or whose end is not reported."""
        self._of(motion).motion = None

    def planned(self, halt: Halt) -> Motion | None:
        """Return the motion that a stop prevents from being written, if any."""
        motion = self._of(halt).motion
        return None if motion is None or motion.written else motion

    # While writing

    def begun(self, motion: Motion) -> None:
        """Wait for the end of a motion."""
        self._await(motion)

    def halting(self, halt: Halt, now: float) -> None:
        """Wait for the answer to a stop."""
        known = self._of(halt)
        halt.until = now + self._quiet  # in case its caller has already given up
        halt.motion = known.motion
        known.halts.append(halt)
        self._await(halt)

    # Receiving

    def end(self, id: int, event: Received | Undocumented, began: int, now: float) -> None:
        """End the exchanges that a frame ends.

        :param began: number of bytes received before the frame.
        """
        frame = event.frame
        source = self._matching.source_of(event.raw)
        channel = self._matching.channel_of(frame.message)
        meant = {
            (exchange.dest, exchange.channel)
            for exchange in self.awaited[id]
            if source in (None, exchange.dest)
            and channel in (None, exchange.channel)
            and began >= exchange.after
        }
        if len(meant) > 1:
            self._statistics.ambiguous += 1
        if len(meant) != 1:
            for exchange in self.awaited[id]:
                self._matching.pass_over(exchange, event, began)
            return
        known = self._channels[meant.pop()]
        motion = known.motion
        halts = [halt for halt in known.halts if id in halt.ids]
        if motion is not None and halts and halts[0].motion is not motion:
            halts[0].until = now  # not earlier: a copy of the answer may follow
            self._statistics.late += 1
            motion.pass_over((id, "which answers an earlier stop", ""), event.raw)
            return
        self._statistics.matched += 1
        if halts:
            self._answered(known, halts[0])
            for halt in halts:
                halt.until = now + self._quiet
        if motion is not None:
            self._remove(motion)
            known.motion = None
            if halts or id in motion.stopped:
                message = frame.message
                said = ", ".join(f"{name} {value}" for name, value in message.values().items())
                text = (
                    f"{motion.name} was stopped before its end: {message.layout.message} ({said})"
                )
                motion.end(error=MotionStoppedError(text, message))
            else:
                motion.end(frame)
        for halt in halts:
            halt.end(frame)

    def faulted(self, event: Received | Undocumented, fault: Fault, began: int) -> list[Motion]:
        """Return the motions whose wait a fault report ends. They may still be in progress.

        :param began: number of bytes received before the report.
        """
        source = self._matching.source_of(event.raw)
        found = [
            motion
            for known in self._channels.values()
            if (motion := known.motion) is not None
            and motion.written
            and not motion.done
            and source in (None, motion.dest)
            and began >= motion.after
            and fault.request in (0, motion.message.layout.id)
        ]
        if len({motion.dest for motion in found}) > 1:  # the report does not identify one
            self._statistics.ambiguous += 1
            return []
        return found

    def settled(self, dest: int, channel: int | None) -> None:
        """Remove a motion that was given up, because a status shows that nothing moves there."""
        known = self._channels.get((dest, channel))
        if known is not None and known.motion is not None and known.motion.done:
            self._remove(known.motion)
            known.motion = None

    def give_up(self, halt: Halt, now: float) -> None:
        """Note that the caller of a stop no longer waits for its answer."""
        halt.until = now + self._quiet

    def forgive(self, now: float) -> None:
        """Stop expecting answers to stops whose quiet period has passed."""
        for known in self._channels.values():
            for halt in [halt for halt in known.halts if halt.done and halt.until <= now]:
                self._answered(known, halt)

    @property
    def next(self) -> float:
        """When the next quiet period ends."""
        return min(
            (halt.until for known in self._channels.values() for halt in known.halts if halt.done),
            default=inf,
        )

    def waiting(self) -> Iterator[Motion | Halt]:
        """Yield written exchanges that have not ended."""
        for known in self._channels.values():
            if known.motion is not None and known.motion.written and not known.motion.done:
                yield known.motion
            for halt in known.halts:
                if not halt.done:
                    yield halt

    def _answered(self, known: _Channel, halt: Halt) -> None:
        known.halts.remove(halt)
        self._remove(halt)

    def _await(self, exchange: Motion | Halt) -> None:
        for id in exchange.ids:
            self.awaited.setdefault(id, []).append(exchange)

    def _remove(self, exchange: Motion | Halt) -> None:
        for id in exchange.ids:
            awaiting = self.awaited[id]
            awaiting.remove(exchange)
            if not awaiting:
                del self.awaited[id]
