"""Judgement of a message that came: its class, its length, its addresses, channel and values.

Known of real controllers, and therefore no failure: addresses of 0, unless several bays are told apart by
them, or those of the request as they came, and packets that are longer than the document has them.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from stagewire.protocols import DATA_FLAG, HEADER_SIZE, FramedMessage
from stagewire_conformance.device.checks.apt.wording import described, joined, raw_of
from stagewire_conformance.device.lines.dialogue import Incoming

if TYPE_CHECKING:
    from stagewire_conformance.device.declaration import Declaration
    from stagewire_conformance.device.targets import Target
    from stagewire_conformance.device.trial import Trial
    from stagewire_conformance.registry import Json


@dataclass(frozen=True)
class Request:
    """One question.

    :param name: of the message.
    :param place: who is asked.
    :param channel: about which; None: the message names none.
    :param answers: the messages that answer it.
    :param message: the question.
    """

    name: str
    place: Target
    channel: int | None
    answers: tuple[str, ...]
    message: FramedMessage

    @property
    def about(self) -> str:
        """What is asked whom, for a sentence: ``MOT_REQ_VELPARAMS for channel 1 to 0x50``."""
        channel = "" if self.channel is None else f" for channel {self.channel}"
        return f"{self.name}{channel} to {self.place.name}"

    @property
    def id(self) -> str:
        """What distinguishes it in the id of a check: ``0x50/MOT_REQ_VELPARAMS/1``."""
        channel = "" if self.channel is None else f"/{self.channel}"
        return f"{self.place.name}/{self.name}{channel}"

    @property
    def messages(self) -> tuple[str, ...]:
        """It and what answers it."""
        return self.name, *self.answers

    @property
    def skip(self) -> str:
        """Why it is not asked, which only the PICS can say; empty: it is."""
        return next((why for name in self.messages if (why := self.place.why_not(name))), "")


def requests_of(declared: Declaration, place: Target) -> Iterator[Request]:
    """Give every request in the list of a place, channel by channel, in the order of the registry.

    Those that the PICS takes back are among them, see :attr:`Request.skip`.
    """
    for name, entry in declared.registry.messages.items():
        if (
            name in place.listed
            and entry["effect"] == "none"
            and "answered_by" in entry["exchange"]
        ):
            for channel in place.channels if _names_channel(declared, name) else (None,):
                yield ask_for(declared, place, name, channel)


def a_request(declared: Declaration, place: Target, names: Iterable[str] = ()) -> Request | None:
    """Return a request that a place claims: the first of ``names``, or else any; None where there is none."""
    claimed = [each for each in requests_of(declared, place) if not each.skip]
    chosen = [each for name in names for each in claimed if each.name == name]
    return next(iter([*chosen, *claimed]), None)


def ask_for(declared: Declaration, place: Target, name: str, channel: int | None = None) -> Request:
    """Make one request."""
    answers = tuple(declared.registry.messages[name]["exchange"]["answered_by"])
    return Request(name, place, channel, answers, declared.request(name, channel))


def _names_channel(declared: Declaration, name: str) -> bool:
    field = getattr(declared.protocol, "channel", None)
    return field in declared.protocol.message_class(name).layout.fields


_ALWAYS_ZERO: Final = frozenset({"min_velocity", "jog_min_velocity"})
"""Start velocities, which are always zero (pages 30 and 32): stated of the controller, not of the field."""

_UNNAMED: Final = {"param1": 2, "param2": 3}
"""Where parameters of a header stand that have no meaning."""


@dataclass(frozen=True)
class Fault:
    """Something in a message that the document does not have.

    :param text: a sentence.
    :param grave: whether the document excludes it; else it is only not meant so, such as a 0 in a field
        that begins with 1, which nobody has set yet.
    """

    text: str
    grave: bool = True


def faults_of(declared: Declaration, message: FramedMessage) -> Iterator[Fault]:
    """Give what is wrong by the document with the values of a message that came.

    The channel is left out: whether it is the right one depends on what was asked. So are the texts by which
    a unit says what it is, which have a check of their own.
    """
    layout = message.layout
    values = message.values()
    identifies = declared.registry.messages[layout.message].get("tells") == "identity"
    for name, field in declared.registry.fields(layout.message, layout.form).items():
        if field["role"] != "value" or name == getattr(declared.protocol, "channel", None):
            continue
        if field["kind"] == "integer":
            yield from _faults(name, field, values[name])
        elif field["kind"] == "text" and not identifies and not is_readable(values[name]):
            yield Fault(f"{name} is {values[name]!r}; it should be text", grave=False)
    yield from map(Fault, unused_parameters(message))


def unused_parameters(message: FramedMessage) -> Iterator[str]:
    """Give what is wrong with the parameters of a header to which its message gives no meaning."""
    layout = message.layout
    for name in layout.unnamed:
        came, due = getattr(message, name), layout.constants.get(name, 0)
        if came != due:
            at = _UNNAMED[name]
            yield f"byte {at} is {came:#04x}; it has no meaning here, and should be {due:#04x}"


def is_readable(text: str) -> bool:
    """Return whether a text can be read as far as it goes; what is behind a NUL is no part of it."""
    read = text.partition("\0")[0]
    return read.isascii() and (read.isprintable() or not read)


def _faults(name: str, field: Json, value: Any) -> Iterator[Fault]:
    table, flags = field.get("enum"), field.get("flags")
    is_open = field.get("open", False)
    if name in _ALWAYS_ZERO:
        if value:
            yield Fault(f"{name} is {value}; it is always zero at present")
    elif flags and not is_open:
        if more := value & ~sum(flags.values()):
            yield Fault(
                f"{name} is {value:#x}; the bits {more:#x} of it stand for nothing in the document"
            )
    elif table and not is_open and "modifiers" not in field:
        if value not in table.values():
            known = ", ".join(
                f"{each} ({key})" for key, each in sorted(table.items(), key=lambda item: item[1])
            )
            yield Fault(f"{name} is {value}; the document has {known}")
    elif not field["minimum"] <= value <= field["maximum"]:
        yield Fault(
            f"{name} is {value}; the document has {field['minimum']} to {field['maximum']}",
            grave=bool(value),
        )


def ask_all(
    trial: Trial, request: Request, wait: float = 1.0, after: float = 0.03
) -> list[Incoming]:
    """Ask, and return all that came up to ``after`` seconds behind the reply.

    Bytes that are no message are whole, though the rest of a frame may be waited for in vain.

    :param wait: seconds in which the reply has to be there.
    """
    line = trial.line
    heard: list[Incoming] = line.ask_all(request.message, request.place.address, wait, after)
    if any(each.kind == "garbage" for each in heard):
        heard += line.drain()
    return heard


def judge_answer(trial: Trial, request: Request, heard: Sequence[Incoming]) -> Incoming | None:
    """Say what is wrong with all that came after a request, and return the reply; None: there is none.

    Exactly one reply of the right class has to come, and nothing beside it that nobody asked for.
    """
    wanted = " or ".join(request.answers)
    replies = [each for each in heard if each.kind == "message" and each.name in request.answers]
    others = joined(each for each in heard if each not in replies)
    expected = f"one {wanted} from {request.place.name} should have come"
    if not trial.must(
        bool(replies),
        f"{request.about} was not answered: {expected}; there came {described(trial, heard)}",
        came=raw_of(heard),
    ):
        return None
    trial.must(
        len(replies) == 1,
        f"{request.about} was answered {len(replies)} times, with {described(trial, replies)}; {expected}",
        came=raw_of(replies),
    )
    reply = next((each for each in replies if _is_of(each, request)), replies[0])
    judge_message(trial, request.place, request.channel, reply)
    for each in others:
        judge_unasked(trial, each, f"beside the answer to {request.about}")
    return reply


def judge_message(trial: Trial, place: Target, channel: int | None, heard: Incoming) -> None:
    """Say what is wrong with a message that a place sent about one of its channels."""
    judge_addresses(trial, place, heard)
    message: Any = heard.message
    length, due = len(heard.raw) - HEADER_SIZE, message.layout.length
    trial.should(
        length == due,
        f"{heard.name} has a packet of {length} bytes, with {heard.extra.hex(' ')} behind those that "
        f"are documented; it should have {due}",
        came=heard.raw,
    )
    field = trial.declared.framed.channel
    if field is not None and channel is not None and heard.channel is not None:
        trial.must(
            heard.channel == channel,
            f"{heard.name} is about channel {heard.channel}; it should be about channel {channel}",
            wanted=with_value(heard, field, channel),
            came=heard.raw,
        )
    for fault in faults_of(trial.declared, message):
        expect = trial.must if fault.grave else trial.should
        expect(False, f"{heard.name}: {fault.text}", came=heard.raw)


def judge_addresses(trial: Trial, place: Target, heard: Incoming) -> None:
    """Say what is wrong with the addresses of a message from a place to the host."""
    host = trial.declared.framed.host
    came = heard.dest, heard.source
    if came == (host, place.address):
        return
    text = (
        f"{heard.name} came from {heard.source:#04x} to {heard.dest:#04x}{_whose(trial, place, heard)}; it "
        f"should come from {place.address:#04x} to {host:#04x}"
    )
    wanted = _readdressed(heard.raw, host, place.address)
    alone = sum(each.bay is not None for each in trial.declared.places) < 2
    is_known = came == (place.address, host) or (came == (0, 0) and alone)
    (trial.should if is_known else trial.must)(False, text, wanted=wanted, came=heard.raw)


def judge_unasked(trial: Trial, heard: Incoming, when: str) -> None:
    """Say that something came that nobody asked for; status messages are left to the checks of updates.

    :param when: for the sentence: ``beside the answer to …``.
    """
    exchange = trial.declared.registry.messages.get(heard.name, {}).get("exchange", {})
    counts, muted = exchange.get("counts_for_keep_alive"), exchange.get("muted_by")
    if counts and not muted:  # ends of moves can be muted, and come only where something moved
        return
    text = f"{when} there came {described(trial, [heard])}, which nobody asked for"
    if exchange.get("unsolicited") and muted and not counts:
        trial.should(False, f"{text}: the controller reports a fault", came=heard.raw)
    else:
        trial.must(False, text, came=heard.raw)


def _whose(trial: Trial, place: Target, heard: Incoming) -> str:
    other = None if heard.source is None else trial.declared.place_at(heard.source)
    if other is None or other.address == place.address:
        return ""
    return " (the motherboard)" if other.is_motherboard else f" (bay {other.bay})"


def _is_of(heard: Incoming, request: Request) -> bool:
    return heard.channel == request.channel and heard.source == request.place.address


def with_value(heard: Incoming, field: str, value: int) -> bytes:
    """Return the bytes of a message that came with another value in one field."""
    message: Any = heard.message
    values = {**message.values(), field: value}
    other = type(message).keep(values)  # unchecked: its other values may be wrong, too
    raw = bytes(other.pack(heard.dest, heard.source))
    return raw[:2] + heard.raw[2:4] + raw[4:] + heard.extra if heard.extra else raw


def _readdressed(raw: bytes, dest: int, source: int) -> bytes:
    return raw[:4] + bytes((raw[4] & DATA_FLAG | dest, source)) + raw[6:]
