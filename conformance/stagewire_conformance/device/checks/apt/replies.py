"""Judgement of a received message: its class, length, addresses, channel and values.

Real controllers are known to send addresses of 0, or the addresses of the request unswapped, and packets
longer than documented. These deviations are not failures, unless the addresses have to distinguish several
bays.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from stagewire.protocols import DATA_FLAG, HEADER_SIZE, FramedMessage
from stagewire_conformance.device.causes import (
    ADDRESSES,
    CHANNEL,
    DELIVERY,
    ENDED,
    EXTRA,
    NOW_AND_THEN,
    SHARED,
    UNSOLICITED,
    Cause,
    Causes,
    silence,
)
from stagewire_conformance.device.checks.apt.broken_rules import (
    ANSWERED,
    SIZES,
    UNUSED,
    rule_of_addresses,
    rule_of_channel,
    rule_of_field,
    rule_of_stray,
)
from stagewire_conformance.device.checks.apt.later_rules import ONCE, SUB_MESSAGES
from stagewire_conformance.device.checks.apt.streams import unstopped
from stagewire_conformance.device.checks.apt.undocumented import UNNAMED, Fault, faults_of
from stagewire_conformance.device.checks.apt.wording import described, joined, raw_of
from stagewire_conformance.device.lines.dialogue import Incoming
from stagewire_conformance.device.lines.strays import (
    addresses,
    cause_of_silence,
    cause_of_stray,
    known_bytes,
    subject_of,
    wrong_length,
)
from stagewire_conformance.registry import PLAIN

if TYPE_CHECKING:
    from stagewire_conformance.device.declaration import Declaration
    from stagewire_conformance.device.targets import Target
    from stagewire_conformance.device.trial import Trial


SHARED_REQUESTS: Final = Cause("requests", SHARED)
"""The cause that other bays also answer a request."""


@dataclass(frozen=True)
class Request:
    """One request.

    :param name: the name of the message.
    :param place: the target of the request.
    :param channel: the channel of the request; None: the message has no channel.
    :param answers: the messages that answer the request.
    :param message: the message to send.
    """

    name: str
    place: Target
    channel: int | None
    answers: tuple[str, ...]
    message: FramedMessage

    @property
    def about(self) -> str:
        """The request and its target, for a sentence: ``MOT_REQ_VELPARAMS for channel 1 to 0x50``."""
        channel = "" if self.channel is None else f" for channel {self.channel}"
        return f"{self.name}{channel} to {self.place.name}"

    @property
    def id(self) -> str:
        """The part of the id of a check that identifies the request: ``0x50/MOT_REQ_VELPARAMS/1``."""
        channel = "" if self.channel is None else f"/{self.channel}"
        return f"{self.place.name}/{self.name}{channel}"

    @property
    def messages(self) -> tuple[str, ...]:
        """The names of the request and of its replies."""
        return self.name, *self.answers

    @property
    def skip(self) -> str:
        """Why the request is not sent, which only the PICS can decide; empty if it is sent."""
        return next((why for name in self.messages if (why := self.place.why_not(name))), "")


def requests_of(declared: Declaration, place: Target) -> Iterator[Request]:
    """Yield every request in the list of a target, channel by channel, in the order of the registry.

    This includes requests that the PICS withdraws; see :attr:`Request.skip`.
    """
    for name, entry in declared.registry.messages.items():
        if (
            name in place.listed
            and entry["effect"] == "none"
            and "answered_by" in entry["exchange"]
        ):
            for channel in place.channels if _names_channel(declared, name) else (None,):
                yield ask_for(declared, place, name, channel)


def a_request(
    declared: Declaration,
    place: Target,
    names: Iterable[str] = (),
    causes: Causes | None = None,
) -> Request | None:
    """Return a claimed request of a target: the first of ``names``, otherwise any; None without one.

    :param causes: the reported defects. A request whose reply has one is returned only if all have.
    """
    claimed = [each for each in requests_of(declared, place) if not each.skip]
    chosen = [each for name in names for each in claimed if each.name == name]
    every = [*chosen, *claimed]
    sound = [each for each in every if causes is None or not is_spoilt(each, causes)]
    return next(iter([*sound, *every]), None)


def is_spoilt(request: Request, causes: Causes) -> bool:
    """Return whether a reported defect keeps the reply to a request from arriving as it should."""
    return any(map(causes.check_of, spoils(request)))


def spoils(request: Request) -> tuple[Cause, ...]:
    """Return the defects that keep the reply to a request from arriving as it should."""
    aspects = (DELIVERY, CHANNEL, ENDED, UNSOLICITED)
    of_replies = (Cause(name, aspect) for name in request.answers for aspect in aspects)
    return silence(request.place.name), SHARED_REQUESTS, *of_replies


def ask_for(declared: Declaration, place: Target, name: str, channel: int | None = None) -> Request:
    """Return one request."""
    answers = tuple(declared.registry.messages[name]["exchange"]["answered_by"])
    return Request(name, place, channel, answers, declared.request(name, channel))


def _names_channel(declared: Declaration, name: str) -> bool:
    field = getattr(declared.protocol, "channel", None)
    return field in declared.protocol.message_class(name).layout.fields


def ask_all(
    trial: Trial, request: Request, wait: float = 1.0, after: float = 0.03
) -> list[Incoming]:
    """Send a request, and return everything received until ``after`` seconds after the reply.

    Bytes that are not a message are returned whole, after the wait for the rest of a frame.

    :param wait: seconds in which the reply must arrive.
    """
    line = trial.line
    heard: list[Incoming] = line.ask_all(request.message, request.place.address, wait, after)
    if any(each.kind == "garbage" for each in heard):
        heard += line.drain()
    return heard


def judge_answer(trial: Trial, request: Request, heard: Sequence[Incoming]) -> Incoming | None:
    """Report what is wrong with the data received after a request; return the reply, or None without one.

    Exactly one reply of the right class must arrive, and nothing unsolicited.
    """
    wanted = " or ".join(request.answers)
    replies = [each for each in heard if each.kind == "message" and each.name in request.answers]
    others = joined(each for each in heard if each not in replies)
    expected = f"expected one {wanted} from {request.place.name}"
    cause: Cause | None = None
    if heard and not replies:
        names, address = request.answers, request.place.address
        cause = cause_of_silence(trial.declared, joined(heard), names, address)
        cause = trial.likely(cause, Cause(names[0], DELIVERY))
        if trial.line.ask(request.message, address) is not None:
            cause = trial.likely(NOW_AND_THEN, cause)
    elif not replies:
        cause = trial.cause_of_silence(request.message, request.place.address)
    if not trial.must(
        bool(replies),
        f"{request.about} was not answered: {expected}, received {described(trial, heard)}",
        rule=_rule_of_silence(trial, request, others),
        cause=cause,
        came=raw_of(heard),
    ):
        if cause is not None and cause.subject == ADDRESSES:
            report_lost(trial, request.answers[0], cause)
        for each in others:  # it may come again while others wait for their replies
            trial.causes.report(cause_of_stray(trial.declared, each), trial.check)
        return None
    if not judge_strangers(trial, request, replies):
        replies = [each for each in replies if each.source == request.place.address]
    trial.must(
        len(replies) == 1,
        f"{request.about} was answered {len(replies)} times: {expected}, received "
        f"{described(trial, replies)}",
        rule=ONCE.get(replies[0].name, "get-answers-request"),
        cause=Cause(replies[0].name, UNSOLICITED),
        because=unstopped(trial.declared),
        came=raw_of(replies),
    )
    reply = next((each for each in replies if _is_of(each, request)), replies[0])
    judge_message(trial, request.place, request.channel, reply)
    for each in others:
        judge_unasked(trial, each, f"in addition to the reply to {request.about}")
    return reply


def _rule_of_silence(trial: Trial, request: Request, others: Iterable[Incoming]) -> str:
    """Return the rule that is broken if a request has no reply and these bytes arrived instead."""
    wanted = trial.declared.registry.messages[request.answers[0]]
    if "sub_message" in wanted and wanted["chapter"] in SUB_MESSAGES:
        begins = wanted["id"].to_bytes(2, "little")
        number = wanted["sub_message"].to_bytes(2, "little")
        whole = (each.raw for each in others if len(each.raw) > HEADER_SIZE + 1)
        if any(raw[:2] == begins and raw[HEADER_SIZE : HEADER_SIZE + 2] != number for raw in whole):
            return SUB_MESSAGES[wanted["chapter"]]
    strays = (rule_of_stray(trial, each) for each in others if each.kind != "message")
    return next(strays, ANSWERED)


def judge_strangers(trial: Trial, request: Request, heard: Sequence[Incoming]) -> bool:
    """Report replies of other bays to a request that its target has answered; return whether none came."""
    replies = [each for each in heard if each.name in request.answers]
    mine = [each for each in replies if each.source == request.place.address]
    bays = [place for place in trial.declared.places if place.bay is not None]
    strange = [each for each in replies if each not in mine]
    theirs = [place.name for place in bays if place.address in {each.source for each in strange}]
    return trial.must(
        not (mine and theirs),
        f"{request.about} was also answered by {' and '.join(theirs)}; only its destination should answer",
        rule="slot-addressed-by-destination",
        cause=SHARED_REQUESTS,
        came=raw_of(strange),
    )


def judge_message(trial: Trial, place: Target, channel: int | None, heard: Incoming) -> None:
    """Report what is wrong with a message that a target sent about one of its channels."""
    judge_addresses(trial, place, heard)
    message: Any = heard.message
    length, due = len(heard.raw) - HEADER_SIZE, message.layout.length
    trial.should(
        length == due,
        f"{heard.name} has a packet of {length} bytes, with the undocumented bytes "
        f"{heard.extra.hex(' ')} at the end; it should have {due} bytes",
        rule="info-length" if heard.name == "HW_GET_INFO" else SIZES,
        cause=Cause(heard.name, EXTRA),
        came=heard.raw,
    )
    judge_form(trial, place, heard)
    field = trial.declared.framed.channel
    if field is not None and channel is not None and heard.channel is not None:
        everywhere = Cause(place.name, f"channel {heard.channel} instead of {channel}")
        if not trial.must(
            heard.channel == channel,
            f"{heard.name} is for channel {heard.channel}; it should be for channel {channel}",
            rule=rule_of_channel(trial, heard.name),
            cause=everywhere,
            because=(Cause(heard.name, CHANNEL),),
            wanted=with_value(heard, field, channel),
            came=heard.raw,
        ):
            first = trial.causes.check_of(everywhere)
            trial.causes.report(Cause(heard.name, CHANNEL), first or trial.check)
    for fault in faults_of(trial.declared, message):
        judge_fault(trial, heard, fault)


def judge_form(trial: Trial, place: Target, heard: Incoming) -> None:
    """Report a message of one channel from a unit that sends all channels in one message, or the reverse."""
    registry, name = trial.declared.registry, place.unit.name
    layouts = {layout["form"]: layout for layout in registry.messages[heard.name]["layouts"]}
    field = trial.declared.framed.channel
    named = {any(each["name"] == field for each in one["fields"]) for one in layouts.values()}
    if len(named) < 2 or PLAIN not in layouts:
        return
    sends = registry.table("units")[name].get("sends", {}).get(heard.name, {})
    due = layouts[sends.get("form", PLAIN).replace("_", ":", 1)]["length"]
    came = heard.message.layout.length
    trial.must(
        came == due,
        f"{heard.name} has a packet of {came} bytes; that of a {name} has {due} bytes",
        rule=SIZES,
        cause=Cause(heard.name, DELIVERY),
        came=heard.raw,
    )


def judge_fault(trial: Trial, heard: Incoming, fault: Fault) -> None:
    """Report an undocumented value in a message."""
    is_unused = fault.field in UNNAMED
    (trial.must if fault.grave else trial.should)(
        False,
        f"{heard.name}: {fault.text}",
        rule=UNUSED
        if is_unused
        else rule_of_field(heard.name, fault.field, trial.declared.unit.name),
        cause=Cause(heard.name, fault.field),
        came=heard.raw,
    )


def need_positions(trial: Trial, place: Target) -> None:
    """End the check if a reported defect hides the positions of a target, which show whether it rests."""
    query = place.unit.status_query
    if place.reports_position and query is not None and query.req is not None:
        exchange = trial.declared.registry.messages[query.req.layout.message]["exchange"]
        hidden = (Cause(name, DELIVERY) for name in exchange["answered_by"])
        trial.depends_on(silence(place.name), *hidden)


def wrong_addresses(trial: Trial) -> list[Cause]:
    """Return the reported defects with which it is unknown who sent a message, if there are several bays."""
    if sum(place.bay is not None for place in trial.declared.places) < 2:
        return []
    return [cause for cause in trial.causes if cause.subject == ADDRESSES]


def report_lost(trial: Trial, message: str, cause: Cause) -> None:
    """Record that a message with wrong addresses does not answer a request."""
    trial.causes.report(Cause(message, DELIVERY), trial.causes.check_of(cause) or trial.check)


def judge_addresses(trial: Trial, place: Target, heard: Incoming) -> None:
    """Report what is wrong with the addresses of a message from a target to the host."""
    host = trial.declared.framed.host
    came = heard.dest, heard.source
    if came == (host, place.address):
        return
    text = (
        f"{heard.name} went from {heard.source:#04x}{_whose(trial, place, heard)} to "
        f"{heard.dest:#04x}; it should go from {place.address:#04x} to {host:#04x}"
    )
    wanted = _readdressed(heard.raw, host, place.address)
    alone = sum(each.bay is not None for each in trial.declared.places) < 2
    is_known = came == (place.address, host) or (came == (0, 0) and alone)
    cause = addresses(trial.declared, place.address, heard.dest, heard.source)
    if not is_known:
        report_lost(trial, heard.name, cause)
    (trial.should if is_known else trial.must)(
        False,
        text,
        rule=rule_of_addresses(trial),
        cause=cause,
        wanted=wanted,
        came=heard.raw,
    )


def judge_unasked(
    trial: Trial, heard: Incoming, when: str, *, rule: str = "", cause: Cause | None = None
) -> None:
    """Report an unsolicited message. Leave status messages to the checks of updates.

    :param when: the beginning of the sentence: ``in addition to the reply to …``.
    :param rule: the rule that it breaks; by default that of a message without a request.
    :param cause: the defect, unless that of the message itself has been reported.
    """
    exchange = trial.declared.registry.messages.get(heard.name, {}).get("exchange", {})
    counts, muted = exchange.get("counts_for_keep_alive"), exchange.get("muted_by")
    if counts and not muted:  # end messages can be muted, and come only after a motion
        return
    text = f"{when}, the controller sent {described(trial, [heard])}, which was not requested"
    stray = cause_of_stray(trial.declared, heard)
    length = wrong_length(trial.declared, heard)
    if length is not None and (first := trial.causes.check_of(length)):
        trial.causes.report(stray, first)
    cause = trial.likely(
        cause or stray,
        stray,
        Cause(subject_of(trial.declared, heard), DELIVERY),
        Cause(heard.name, CHANNEL),
        SHARED_REQUESTS,
        *known_bytes(trial.causes, heard.raw),
        *(() if heard.name else (NOW_AND_THEN,)),
    )
    if exchange.get("unsolicited") and muted and not counts:
        trial.should(
            False,
            f"{text}; it reports a fault",
            rule="no-error-in-normal-operation",
            cause=cause,
            came=heard.raw,
        )
    else:
        is_message = heard.kind in ("message", "undocumented", "unknown")
        broken = rule if rule and is_message else rule_of_stray(trial, heard)
        trial.must(False, text, rule=broken, cause=cause, came=heard.raw)
        if length is not None:
            trial.causes.report(length, trial.check)


def _whose(trial: Trial, place: Target, heard: Incoming) -> str:
    other = None if heard.source is None else trial.declared.place_at(heard.source)
    if other is None or other.address == place.address:
        return ""
    return " (the motherboard)" if other.is_motherboard else f" (bay {other.bay})"


def _is_of(heard: Incoming, request: Request) -> bool:
    return heard.channel == request.channel and heard.source == request.place.address


def with_value(heard: Incoming, field: str, value: int) -> bytes:
    """Return the bytes of a received message, with another value in one field."""
    message: Any = heard.message
    values = {**message.values(), field: value}
    other = type(message).keep(values)  # unchecked: its other values may also be wrong
    raw = bytes(other.pack(heard.dest, heard.source))
    return raw[:2] + heard.raw[2:4] + raw[4:] + heard.extra if heard.extra else raw


def _readdressed(raw: bytes, dest: int, source: int) -> bytes:
    return raw[:4] + bytes((raw[4] & DATA_FLAG | dest, source)) + raw[6:]
