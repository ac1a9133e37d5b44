"""What is to be said of a message that came: its class, its length, its addresses, channel and values.

Known of real controllers, and therefore no failure: addresses of 0, unless several bays are told apart by
them, or those of the request as they came, and packets that are longer than the document has them.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any, Final

from stagewire.errors import CodecError, TrailingBytesError
from stagewire.framing import Garbage
from stagewire.header import DATA_FLAG, HEADER_SIZE
from stagewire_conformance.device.checks.apt.requests import Request
from stagewire_conformance.device.checks.apt.values import faults_of
from stagewire_conformance.device.heard import Heard

if TYPE_CHECKING:
    from stagewire_conformance.device.declared import Declared, Place
    from stagewire_conformance.device.trial import Trial

__all__ = [
    "ask_all",
    "described",
    "joined",
    "judge_addresses",
    "judge_answer",
    "judge_message",
    "judge_unasked",
    "raw_of",
    "with_value",
]

_SHOWN: Final = 4
"""Messages that a sentence names, at most."""


def ask_all(trial: Trial, request: Request, wait: float = 1.0, after: float = 0.03) -> list[Heard]:
    """Ask, and return all that came up to ``after`` seconds behind the reply.

    Bytes that are no message are whole, though the rest of a frame may be waited for in vain.

    :param wait: seconds in which the reply has to be there.
    """
    line = trial.line
    heard: list[Heard] = line.ask_all(request.message, request.place.address, wait, after)
    if any(each.kind == "garbage" for each in heard):
        heard += line.drain()
    return heard


def judge_answer(trial: Trial, request: Request, heard: Sequence[Heard]) -> Heard | None:
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


def judge_message(trial: Trial, place: Place, channel: int | None, heard: Heard) -> None:
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
    if channel is not None and heard.channel is not None:
        trial.must(
            heard.channel == channel,
            f"{heard.name} is about channel {heard.channel}; it should be about channel {channel}",
            wanted=with_value(heard, _channel_field(trial.declared), channel),
            came=heard.raw,
        )
    for fault in faults_of(trial.declared, message):
        expect = trial.must if fault.grave else trial.should
        expect(False, f"{heard.name}: {fault.text}", came=heard.raw)


def judge_addresses(trial: Trial, place: Place, heard: Heard) -> None:
    """Say what is wrong with the addresses of a message from a place to the host."""
    host = _host(trial.declared)
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


def judge_unasked(trial: Trial, heard: Heard, when: str) -> None:
    """Say that something came that nobody asked for; status messages are left to the checks of updates.

    :param when: for the sentence: ``beside the answer to …``.
    """
    exchange = trial.declared.registry.messages.get(heard.name, {}).get("exchange", {})
    if exchange.get("counts_for_keep_alive"):
        return
    text = f"{when} there came {described(trial, [heard])}, which nobody asked for"
    if exchange.get("unsolicited") and exchange.get("muted_by"):
        trial.should(False, f"{text}: the controller reports a fault", came=heard.raw)
    else:
        trial.must(False, text, came=heard.raw)


def described(trial: Trial, heard: Iterable[Heard]) -> str:
    """Return what came, in words, for a sentence: ``MOT_GET_VELPARAMS from 0x50 to 0x01, …``."""
    every = joined(heard)
    if not every:
        return "nothing"
    said = ", then ".join(_said(trial.declared, each) for each in every[:_SHOWN])
    more = len(every) - _SHOWN
    return f"{said}, and {more} more" if more > 0 else said


def joined(heard: Iterable[Heard]) -> list[Heard]:
    """Return what came with bytes that belong together in one piece, if they are no message."""
    pieces: list[Heard] = []
    for each in heard:
        if pieces and pieces[-1].kind == each.kind == "garbage":
            pieces[-1] = Heard(each.time, Garbage(pieces[-1].raw + each.raw))
        else:
            pieces.append(each)
    return pieces


def raw_of(heard: Iterable[Heard]) -> bytes | None:
    """Return all bytes that came; None where none did."""
    return b"".join(each.raw for each in heard) or None


def _said(declared: Declared, heard: Heard) -> str:
    addresses = f"from {heard.source:#04x} to {heard.dest:#04x}" if heard.kind != "garbage" else ""
    match heard.kind:
        case "message" | "undocumented":
            channel = "" if heard.channel is None else f" for channel {heard.channel}"
            return f"{heard.name}{channel} {addresses}"
        case "unknown":
            id = int.from_bytes(heard.raw[:2], "little")
            return f"a message {addresses} with the id {id:#06x}, which no message has"
        case "bad_length":
            name, lengths = _of_id(declared, heard.raw)
            length = len(heard.raw) - HEADER_SIZE
            return (
                f"{name} {addresses} with a packet of {length} bytes, which should have {lengths}"
            )
    return f"{heard.raw.hex(' ')}, which is no message ({_why_none(declared, heard.raw)})"


def _of_id(declared: Declared, raw: bytes) -> tuple[str, str]:
    """Return the name of the message that bytes have the id of, and the lengths that its packet has."""
    id = int.from_bytes(raw[:2], "little")
    entry = next(each for each in declared.registry.messages.values() if each["id"] == id)
    lengths = sorted({layout["length"] for layout in entry["layouts"] if layout["length"]})
    return entry["name"], " or ".join(map(str, lengths))


def _why_none(declared: Declared, raw: bytes) -> str:
    """Return why bytes are no message, by the frame that they begin with."""
    protocol: Any = declared.protocol
    has_packet = len(raw) >= HEADER_SIZE and bool(raw[4] & DATA_FLAG)
    packet = int.from_bytes(raw[2:4], "little") if has_packet else 0
    try:
        frame = protocol.decode(raw[: HEADER_SIZE + packet])
    except CodecError as error:
        if len(raw) > HEADER_SIZE and not has_packet:
            return _why_no_packet(protocol, raw) or str(error)
        return str(error)
    name = frame.message.layout.message
    if declared.registry.messages[name]["direction"] == "to_controller":
        return f"read as {name} it is what only a host sends"
    return (
        f"read as {name} it goes from {frame.source:#04x} to {frame.dest:#04x}: not from a controller to "
        f"the host"
    )


def _why_no_packet(protocol: Any, raw: bytes) -> str:
    """Return what is wrong with a frame whose packet is not announced; empty where that is not it."""
    try:
        protocol.decode(raw)
    except TrailingBytesError as error:
        return str(error)
    except CodecError:
        pass
    return ""


def _whose(trial: Trial, place: Place, heard: Heard) -> str:
    other = None if heard.source is None else trial.declared.place_at(heard.source)
    if other is None or other.address == place.address:
        return ""
    return " (the motherboard)" if other.is_motherboard else f" (bay {other.bay})"


def _is_of(heard: Heard, request: Request) -> bool:
    return heard.channel == request.channel and heard.source == request.place.address


def with_value(heard: Heard, field: str, value: int) -> bytes:
    """Return the bytes of a message that came with another value in one field."""
    message: Any = heard.message
    values = {**message.values(), field: value}
    other = type(message).keep(values)  # unchecked: its other values may be wrong, too
    raw = bytes(other.pack(heard.dest, heard.source))
    return raw[:2] + heard.raw[2:4] + raw[4:] + heard.extra if heard.extra else raw


def _readdressed(raw: bytes, dest: int, source: int) -> bytes:
    return raw[:4] + bytes((raw[4] & DATA_FLAG | dest, source)) + raw[6:]


def _host(declared: Declared) -> int:
    protocol: Any = declared.protocol
    return int(protocol.host)


def _channel_field(declared: Declared) -> str:
    protocol: Any = declared.protocol
    return str(protocol.channel)
