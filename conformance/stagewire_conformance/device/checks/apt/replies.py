"""What is to be said of a message that came: its class, its length, its addresses, channel and values.

Known of real controllers, and therefore no failure: addresses of 0, unless several bays are told apart by
them, or those of the request as they came, and packets that are longer than the document has them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from stagewire.protocols import DATA_FLAG, HEADER_SIZE
from stagewire_conformance.device.checks.apt.requests import Request
from stagewire_conformance.device.checks.apt.values import faults_of
from stagewire_conformance.device.checks.apt.wording import described, joined, raw_of
from stagewire_conformance.device.lines.dialogue import Incoming

if TYPE_CHECKING:
    from stagewire_conformance.device.targets import Target
    from stagewire_conformance.device.trial import Trial


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
