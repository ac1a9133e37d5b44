"""The guarded link to controllers with framed messages.

Received frames go into an inbox, :attr:`AptLine.heard`. A request takes its reply from there, and
:meth:`AptLine.listen` takes everything, oldest first. So messages that arrive next to a reply, such as the
end of a move, are not lost.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from typing import TYPE_CHECKING, Final

from stagewire.errors import WrongUnitError
from stagewire.framing import End
from stagewire.links import Link
from stagewire.protocols import FramedMessage, FramedProtocol
from stagewire.sessions import Matching
from stagewire_conformance.device.causes import NOW_AND_THEN, Cause, silence
from stagewire_conformance.device.declaration import Declaration
from stagewire_conformance.device.lines.apt_contact import first_contact, identity_at
from stagewire_conformance.device.lines.apt_guard import AptGuard
from stagewire_conformance.device.lines.apt_parts import AptParts
from stagewire_conformance.device.lines.dialogue import Incoming, addressed_text
from stagewire_conformance.device.lines.line import GuardedLink
from stagewire_conformance.device.lines.live_outputs import LiveOutputs
from stagewire_conformance.device.lines.motions import Moved
from stagewire_conformance.device.lines.standstill import Adrift, Part, bring_to_rest
from stagewire_conformance.device.lines.strays import cause_of_silence, subject_of
from stagewire_conformance.device.permissions import WITHOUT_RANGE, Need, Permissions
from stagewire_conformance.device.targets import names_of

if TYPE_CHECKING:
    from stagewire_conformance.device.targets import Target

_SIGN_PERIOD: Final = 0.5
"""Seconds between two keep-alive messages. A controller needs one per second (page 80)."""

_GIVEN_UP: Final = 0.1
"""Seconds without a byte after which an incomplete frame is given up."""
_PROBES: Final = 3
"""The most other requests that show whether a target answers at all."""
_PROBED: Final = 0.3
"""Seconds to wait for the reply to one of them."""
_RESYNCHRONISED: Final = 1.0
"""The most seconds to wait for that, for a controller that never stops sending."""


class AptLine(GuardedLink):
    """Sends messages, receives messages, and logs both.

    :param link: an open link. It is not closed.
    :param declared: the controller.
    :param allowed: the permissions. Other messages are refused, see :class:`.AptGuard`.
    """

    stop_rule = "stop-any-move"
    rest_rule = "at-rest-unchanged"

    def __init__(self, link: Link, declared: Declaration, allowed: Permissions) -> None:
        super().__init__(link, declared, allowed)
        protocol = declared.protocol
        assert isinstance(protocol, FramedProtocol)
        self.heard: list[Incoming] = []
        """Received messages that have not been taken yet."""
        self.received: set[str] = set()
        """The names of all messages that have arrived in this run."""
        self.reporting: set[tuple[int, int]] = set()
        """The channels that have received the parameters without which they report no ends of motions."""
        self.measured: dict[tuple[int, int], float] = {}
        """Measured counts/s of one unit of a velocity without a certain scale, by address and channel."""
        self.confirmed: set[tuple[int, int]] = set()
        """The channels that were seen to move at the velocity of a scale that the document does not have."""
        self._protocol = protocol
        self._guard = AptGuard(declared, allowed)
        self._matching = Matching(protocol)
        self._moved = Moved(declared, self._matching)
        self.unasked_ends, self.ends = self._moved.unasked, self._moved.ends
        self._parts = AptParts(self, self._moved, self._write_now)
        self._outputs = LiveOutputs(self, self._write_now)
        self._hot = False  # a message that can burn or heat was sent
        self._framer = protocol.framer(End.HOST)
        self._answers: dict[str, tuple[type[FramedMessage], ...]] = {}
        self._last = 0.0  # time of the last received bytes
        self._previous = ""  # the name of the last message, until the line was silent
        self._silent = 0
        self._next_sign = 0.0
        self._signs = [
            (place.address, place.keep_alive())
            for place in declared.places
            if place.keep_alive is not None and declared.wants_signs
        ]
        known = {place.address: place.unit.contexts_of(None) for place in declared.places}
        contexts = {address: context for address, context in known.items() if context}
        if len({tuple(context.items()) for context in contexts.values()}) == 1:
            # Some controllers answer as 0, or with swapped addresses.
            contexts |= dict.fromkeys((0, protocol.host), next(iter(contexts.values())))
        for address, context in contexts.items():
            self._framer.tell(address, **context)

    # Sending

    def send(self, message: FramedMessage, dest: int, source: int | None = None) -> None:
        """Send a message without waiting for a reply.

        :param source: the source address, if not that of the host.

        Raises :class:`~stagewire_conformance.device.errors.NotAllowedError` for a forbidden message.
        """
        self._guard.check(message, dest)
        self._sign_of_life()
        effect = self._guard.effect(message.layout.message)
        self._moved.sends(message, dest, effect)
        if effect == "motion":
            self._starts()
        self._hot |= effect != "stop" and bool(self.needs(message, dest) & WITHOUT_RANGE)
        self._say(message, dest, source)

    def needs(self, message: FramedMessage, dest: int) -> frozenset[Need]:
        """Return the permissions without which a message is refused."""
        place = self.declared.place_at(dest)
        return (
            frozenset() if place is None else self.declared.needs([message.layout.message], place)
        )

    def suspect(self, place: Target, channel: int) -> None:
        """Also stop this channel if the check is interrupted: a faulty controller may move it now."""
        self._moved.suspects(place.address, channel)

    def send_bytes(self, raw: bytes, about: str = "") -> None:
        """Send bytes that need not be a message.

        :param about: a description for the log.

        Raises :class:`~stagewire_conformance.device.errors.NotAllowedError` if the bytes contain a forbidden
        message. Call :meth:`refusal` to check beforehand.
        """
        self._guard.check_bytes(raw)
        self._sign_of_life()
        self._write(raw, lambda: about)

    def refusal(self, raw: bytes) -> str:
        """Return why :meth:`send_bytes` would refuse bytes, or an empty string."""
        return self._guard.refusal(raw)

    def _say(
        self, message: FramedMessage, dest: int, source: int | None, *, keep_alive: bool = False
    ) -> None:
        source = self._protocol.host if source is None else source
        raw = message.pack(dest, source)
        self._write(raw, partial(addressed_text, message, dest, source), keep_alive=keep_alive)

    def _sign_of_life(self) -> None:
        if self._signs and not self._silent and self.now >= self._next_sign:
            self._next_sign = self.now + _SIGN_PERIOD
            for address, sign in self._signs:
                self._say(sign, address, None, keep_alive=True)

    @contextmanager
    def silent(self) -> Iterator[None]:
        """Send no keep-alive messages inside this block."""
        self._silent += 1
        try:
            yield
        finally:
            self._silent -= 1

    # Receiving

    def resynchronise(self) -> None:
        """Wait until an incomplete frame is given up, so that its bytes cannot spoil the next reply."""
        end = self.now + _RESYNCHRONISED
        while self._framer.pending and self.now < end:
            self._wait_until(end)

    def ask(self, request: FramedMessage, dest: int, wait: float = 1.0) -> Incoming | None:
        """Send a request and return its reply; None if none arrives within ``wait`` seconds.

        A reply is a message that the registry names as the answer. It comes from the requested address or
        from an unknown one, and repeats the values of the request, such as the channel. All other messages
        stay in :attr:`heard`.
        """
        answers = self._answers_to(request, dest)
        self._wait_until(self.now)  # messages that are already here cannot be the answer
        self.resynchronise()
        at = len(self.heard)
        self.send(request, dest)
        end = self.now + wait
        while True:
            for index in range(at, len(self.heard)):
                if answers(self.heard[index]):
                    return self.heard.pop(index)
            at = len(self.heard)
            if self.now >= end:
                return None
            self._wait_until(end)

    def ask_all(
        self, request: FramedMessage, dest: int, wait: float = 1.0, after: float = 0.05
    ) -> list[Incoming]:
        """Send a request and return everything received, up to ``after`` seconds after its reply.

        The wait ends with the reply, as defined by :meth:`ask`, or after ``wait`` seconds.
        """
        answers = self._answers_to(request, dest)
        self._wait_until(self.now)
        self.resynchronise()
        at = seen = len(self.heard)
        self.send(request, dest)
        end = self.now + wait
        answered = False
        while self.now < end:
            self._wait_until(end)
            new = self.heard[seen:]
            seen = len(self.heard)
            if not answered and any(map(answers, new)):
                answered = True
                end = self.now + after
        came = self.heard[at:]
        del self.heard[at:]
        return came

    def cause_of_silence(self, request: FramedMessage, dest: int) -> Cause:
        """Return the likely cause that a request was not answered, from what has arrived since.

        The request is repeated, which shows a reply that is lost only now and then.
        """
        names = [each.layout.message for each in self._classes_of_answers(request.layout.message)]
        place = self.declared.place_at(dest)
        came = [each for each in self.heard if subject_of(self.declared, each) in names]
        if self.ask(request, dest, _PROBED) is not None:
            return NOW_AND_THEN
        if place is not None and not came and not self._answers_anything(place, request):
            return silence(place.name)
        return cause_of_silence(self.declared, came, names, dest)

    def _answers_anything(self, place: Target, but: FramedMessage) -> bool:
        """Return whether a target answers one of some other requests."""
        entries = self.declared.registry.messages
        others = [
            name
            for name in sorted(place.messages - {but.layout.message})
            if entries[name]["effect"] == "none" and entries[name]["exchange"].get("answered_by")
        ]
        channel = place.channels[0] if place.channels else None
        asked = (self.declared.request(name, channel) for name in others[:_PROBES])
        return not others or any(self.ask(each, place.address, _PROBED) for each in asked)

    def listen(
        self, seconds: float, until: Callable[[Incoming], bool] | None = None
    ) -> list[Incoming]:
        """Return everything received up to now and within some seconds.

        :param until: a predicate. The first message for which it holds ends the wait and is the last
            returned.
        """
        end = self.now + seconds
        at = 0
        while True:
            if until is not None:
                for index in range(at, len(self.heard)):
                    if until(self.heard[index]):
                        return self._take(index + 1)
            at = len(self.heard)
            if self.now >= end:
                return self._take(at)
            self._wait_until(end)

    def drain(self, quiet: float = 0.05, limit: float = 1.0) -> list[Incoming]:
        """Wait until nothing arrives for ``quiet`` seconds, and return everything received.

        :param limit: the maximum wait in seconds, for a controller that never stops sending.
        """
        end = self.now + limit
        while self.now < end:
            before = len(self.heard)
            self._wait_until(min(end, self.now + quiet), whole=True)
            if len(self.heard) == before and not self._framer.pending:
                break
        return self._take(len(self.heard))

    def _take(self, count: int) -> list[Incoming]:
        taken = self.heard[:count]
        del self.heard[:count]
        return taken

    def _wait_until(self, end: float, *, whole: bool = False) -> None:
        """Read once, until bytes arrive or something is due.

        :param whole: continue until something arrives or the time is over.
        """
        while True:
            self._sign_of_life()
            due = end
            if self._signs and not self._silent:
                due = min(due, self._next_sign)
            if self._framer.pending:
                due = min(due, self._last + _GIVEN_UP)
            data = self._read(due - self.now)
            now = self.now
            if data:
                if now - self._last > _GIVEN_UP and not self._framer.pending:
                    self._previous = ""
                self._last = now
                events = self._framer.feed(data)
            elif self._framer.pending and now >= self._last + _GIVEN_UP:
                self._last = now  # bytes that remain pending get the same time again
                events = self._framer.abandon()
            else:
                events = []
            for event in events:
                self._take_in(Incoming(now, event, self._previous))
            if data or not whole or now >= end:
                return

    def _take_in(self, heard: Incoming) -> None:
        self.heard.append(heard)
        self._record(heard.raw, lambda: heard.text)
        self._previous = subject_of(self.declared, heard)
        if heard.kind == "message":
            self.received.add(heard.name)
            self._moved.hears(heard.message, heard.raw)

    def _answers_to(self, request: FramedMessage, dest: int) -> Callable[[Incoming], bool]:
        classes = self._classes_of_answers(request.layout.message)
        names = {each.layout.message for each in classes}  # sub-messages share an id
        said = self._matching.selected(request, classes)

        def answers(heard: Incoming) -> bool:
            if heard.name not in names:
                return False
            source = self._matching.source_of(heard.raw)
            if source is not None and source != dest:
                return False
            return all(getattr(heard.message, name, value) == value for name, value in said)

        return answers

    def _classes_of_answers(self, message: str) -> tuple[type[FramedMessage], ...]:
        if message not in self._answers:
            names = self.declared.registry.messages[message]["exchange"].get("answered_by", ())
            classes = tuple(cls for cls in self._protocol.messages if cls.layout.message in names)
            assert classes  # the registry names an answer for every request
            self._answers[message] = classes
        return self._answers[message]

    # Used by a run

    def contact(self) -> dict[str, int | str]:
        """Request the identity; see :meth:`.GuardedLink.contact`."""
        return first_contact(self)

    def identify(self, reported: Mapping[str, int | str]) -> Declaration:
        """Return the controller with the scales of its identity; see :meth:`.GuardedLink.identify`."""
        facts, by_card = self.declared.facts, not self.declared.pics.motherboard
        names = {}
        for place in self.declared.places:
            if not place.is_motherboard:
                said = identity_at(self, place) if place.unit.kind == "bay" else reported
                try:
                    names[place.address] = names_of(place.unit, facts, said, by_card=by_card)
                except WrongUnitError as error:
                    raise WrongUnitError(f"{place.name}: {error}") from None
        self.declared = self.declared.named(names)
        self._guard = AptGuard(self.declared, self.allowed)
        return self.declared

    def settle(self) -> list[str]:
        """Read until the line is quiet; see :meth:`.GuardedLink.settle`."""
        return [heard.text for heard in self.drain()]

    def pause(self, seconds: float) -> None:
        """Wait, and keep all messages in the inbox."""
        kept = self.listen(seconds)
        self.heard[:0] = kept

    def parts(self, *, going: bool = False) -> list[Part]:
        """Return what this check has set in motion; see :meth:`.GuardedLink.parts`."""
        return self._parts.moved(going=going)

    def others(self) -> list[Part]:
        """Return the other channels with a motor; see :meth:`.GuardedLink.others`."""
        return self._parts.others()

    def stop_channel(self, place: Target, channel: int) -> bool:
        """Stop a channel immediately, and return whether it rests; see :meth:`.GuardedLink.come_to_rest`."""
        part = self._parts.part(place, channel)
        part.measures[-2 if len(part.measures) > 2 else 0].take()
        self.adrift += bring_to_rest(self, [part], {part.name})
        return not self.adrift

    def disable_channel(self, place: Target, channel: int) -> None:
        """Disable a channel that ignores its stops, if it can be disabled."""
        if (last := self._parts.part(place, channel).measures[-1]).disables:
            last.take()

    def forget(self) -> None:
        """Forget all motions, before the next check."""
        self._moved.forget()
        self._rests = True

    def live(self) -> list[str]:
        """Return the targets with an output that is on; see :meth:`.GuardedLink.live`."""
        return [place.name for place in self._outputs.on()]

    def switch_off(self) -> list[Adrift]:
        """Switch off all outputs that can burn or heat; see :meth:`.GuardedLink.switch_off`."""
        for place in self._outputs.places:
            self._outputs.switch_off(place)
        return [
            Adrift(f"the output of {name} is still on after it was switched off")
            for name in self.live()
        ]

    def leave(self) -> None:
        """Switch off the outputs that can burn or heat, if the run has used them, and note those still on."""
        if self._hot:
            self.adrift += self.switch_off()
