"""Periodic status messages: the messages that start and stop them, and the status itself."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, Final

from stagewire.protocols import FramedMessage
from stagewire_conformance.device.causes import EFFECT, SHARED, UNSOLICITED, Cause
from stagewire_conformance.device.checks.apt.wording import described, raw_of

if TYPE_CHECKING:
    from stagewire_conformance.device.declaration import Declaration
    from stagewire_conformance.device.lines.dialogue import Incoming
    from stagewire_conformance.device.targets import Target
    from stagewire_conformance.device.trial import Trial


LATE: Final = 0.3
"""Seconds after a stop in which a status message may still be on its way."""


class Stream:
    """The status messages of a target, from start to stop.

    :param place: the target that sends them.
    :param start: the message that starts them.
    :param stop: the message that stops them.
    :param status: the message that is sent periodically.
    """

    def __init__(
        self, place: Target, start: FramedMessage, stop: FramedMessage, status: str
    ) -> None:
        self.place = place
        self.start = start
        self.stop = stop
        self.status = status

    @property
    def messages(self) -> tuple[str, ...]:
        """The names of the start, stop and status messages."""
        return self.start.layout.message, self.stop.layout.message, self.status

    @property
    def skip(self) -> str:
        """Why the stream is not started, which only the PICS can decide; empty if it is started."""
        return next((why for name in self.messages if (why := self.place.why_not(name))), "")

    @property
    def sign(self) -> str:
        """The keep-alive message of the stream on USB; empty if the target claims none."""
        sign = self.place.keep_alive
        return "" if sign is None else sign.layout.message

    def give_sign(self, trial: Trial) -> None:
        """Send the keep-alive message, if there is one."""
        if self.place.keep_alive is not None:
            trial.line.send(self.place.keep_alive(), self.place.address)

    def begin(self, trial: Trial) -> None:
        """Start the stream, and stop it at the end of the check."""
        what = f"status updates of {self.place.name}"
        if all(undo.what != what for undo in trial.undos):
            trial.undo(what, lambda: self.end(trial))
        trial.line.send(self.start, self.place.address)

    @property
    def shared_start(self) -> Cause:
        """The defect that the start of this stream also starts those of other targets."""
        return Cause(self.start.layout.message, SHARED)

    def end(self, trial: Trial) -> None:
        """Stop the stream, and those that its start has also started."""
        streams = streams_of(trial.declared) if trial.causes.check_of(self.shared_start) else [self]
        for stream in streams:
            trial.line.send(stream.stop, stream.place.address)

    def of_it(self, heard: Iterable[Incoming]) -> list[Incoming]:
        """Return the received messages of this stream; a source of 0 may be any target."""
        mine = self.place.address
        return [
            each
            for each in heard
            if each.name == self.status and (mine in (each.source, each.dest) or each.source == 0)
        ]

    def surely(self, heard: Iterable[Incoming]) -> list[Incoming]:
        """Return the received messages that certainly are of this stream."""
        mine = self.place.address
        return [
            each for each in heard if each.name == self.status and mine in (each.source, each.dest)
        ]

    def by_channel(self, heard: Iterable[Incoming]) -> dict[int, list[Incoming]]:
        """Return the received messages of this stream by channel, including channels without messages.

        A status without a channel is that of all channels.
        """
        mine = self.of_it(heard)
        return {
            number: [each for each in mine if each.channel in (number, None)]
            for number in self.place.channels
        }


def judge_ended(trial: Trial, stream: Stream, heard: Iterable[Incoming], when: str = "") -> None:
    """Report messages of a stream that was stopped.

    :param heard: what was received more than :data:`LATE` after the stop.
    :param when: the situation, for sentences: ``" during a move"``.
    """
    late = stream.surely(heard)
    trial.must(
        not late,
        f"more than {LATE:g} s after {stream.stop.layout.message} to {stream.place.name}{when}, it "
        f"sent {described(trial, late)}; nothing more should come",
        rule="updates-stop",
        cause=Cause(stream.stop.layout.message, EFFECT),
        because=unstopped(trial.declared),
        came=raw_of(late[:1]),
    )


def unstopped(declared: Declaration) -> tuple[Cause, ...]:
    """Return the defects with which status messages come although they are stopped."""
    streams = streams_of(declared)
    stops = (Cause(stream.stop.layout.message, EFFECT) for stream in streams)
    signs = (Cause(stream.sign, UNSOLICITED) for stream in streams if stream.sign)
    return tuple(dict.fromkeys((*stops, *signs)))


def streams_of(declared: Declaration) -> list[Stream]:
    """Return the streams of all targets that have one."""
    found = [stream_of(declared, place) for place in declared.places]
    return [stream for stream in found if stream is not None]


def stream_of(declared: Declaration, place: Target) -> Stream | None:
    """Return the stream of a target; None if it has no channels or its list has no stream."""
    messages = declared.registry.messages
    for name, entry in messages.items():
        exchange = entry["exchange"]
        if "periodic_ms" not in exchange or name not in place.listed or not place.channels:
            continue
        started = exchange["starts"]
        stop = next(
            other
            for other, each in declared.registry.messages.items()
            if each["exchange"].get("stops") == started
        )
        exchanges = [messages[other]["exchange"] for other in place.listed]
        asked = {each for exchange in exchanges for each in exchange.get("answered_by", ())}
        # A TIM101 also lists the status of a stepper, but no message that requests it.
        listed = [each for each in started if each in place.listed]
        status = min(listed, key=lambda each: each not in asked, default=None)
        if status is not None:
            defaults: dict[str, Any] = entry.get("call", {}).get("defaults", {})
            return Stream(place, declared.make(name, **defaults), declared.make(stop), status)
    return None
