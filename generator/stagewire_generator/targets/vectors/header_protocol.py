"""What holds for every frame with a header: addresses, lengths, ids and contexts that are none."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from stagewire_generator.model import Json
from stagewire_generator.targets.vectors.case import Case
from stagewire_generator.targets.vectors.framing import Framing
from stagewire_generator.targets.vectors.header_context import contexts
from stagewire_generator.targets.vectors.header_frame import (
    ANNOUNCED,
    MOST,
    SIZE,
    data_frame,
    header_frame,
    id_of,
    unknown_id,
)
from stagewire_generator.targets.vectors.subject import LEFT_OUT, Subject, make_case

__all__ = ["protocol_cases"]


def protocol_cases(framing: Framing, subjects: Sequence[Subject]) -> Iterator[Case]:
    """Yield the cases of all frames; each kind of form is looked at in one layout."""
    yield from _unknown(framing)
    packets = [of for of in subjects if of.layout.form != "header" and not of.layout.when]
    headers = [of for of in subjects if of.layout.form == "header"]
    for of in (*headers[:1], *packets[:1]):
        yield from _addresses(framing, of)
        yield from _contexts(framing, of)
    for of in packets[:1]:
        yield from _lengths(framing, of)
    for of in headers[:1]:
        yield from _announced(of)


def _unknown(framing: Framing) -> Iterator[Case]:
    host, device = framing.protocol.framing["host"], framing.protocol.framing["devices"][-1]
    unknown = unknown_id(framing.protocol)
    bare, packet = (
        header_frame(unknown, 0, 0, device, host),
        data_frame(unknown, b"\0", device, host),
    )
    for name, about, raw, code in (
        ("id.header", "an id that no message has", bare, "unknown_message"),
        ("id.packet", "such an id, with a packet", packet, "unknown_message"),
        ("id.trailing", "such an id, and a byte too many", bare + b"\0", "unknown_message"),
        ("empty", "no bytes", b"", "truncated"),
        ("byte", "one byte", bare[:1], "truncated"),
        ("header.cut", "a header without its last byte", bare[:-1], "truncated"),
    ):
        request = {"op": "decode", "hex": raw.hex()}
        yield make_case(f"frame/decode/{name}", about, request, code)
    request = {"op": "encode", "message": "NO_SUCH_MESSAGE", "dest": device, "source": host}
    yield make_case(
        "frame/encode/message", "a name that no message has", request, "unknown_message"
    )


def _addresses(framing: Framing, of: Subject) -> Iterator[Case]:
    raw = framing.frame(of, of.plain.held)
    announced = raw[4] & ANNOUNCED
    for key, at, most in (("dest", 4, 0x7F), ("source", 5, 0xFF)):
        for name, address in (("least", 0), ("greatest", most)):
            there = bytes((address | announced if key == "dest" else address,))
            framed = raw[:at] + there + raw[at + 1 :]
            about = f"{key} at its {name}"
            said: Json = of.answer(of.plain, **{key: address})
            yield of.encode(f"{key}.{name}", about, framed, **{key: address})
            yield of.decode(f"{key}.{name}", about, framed, said)
        for name, about, value, code in (
            ("below", "is less than nothing", -1, "out_of_range"),
            ("beyond", "is no byte", 0x100, "out_of_range"),
            ("missing", "is missing", LEFT_OUT, "missing_field"),
            ("text", "is a text and no number", "1", "bad_value"),
            ("true", "is true and no number", True, "bad_value"),
        ):
            yield of.encode(f"{key}.{name}", f"{key} {about}", code, **{key: value})


def _contexts(framing: Framing, of: Subject) -> Iterator[Case]:
    raw = framing.frame(of, of.plain.held)
    known = contexts(framing.protocol)
    wrong = [("unknown", "a context that decides nothing", {"no_such_context": "a"})]
    for key, values in known.items():
        wrong.append((f"{key}.unknown", f"no value of {key}", {key: "no_such_value"}))
        about = f"a context that decides on others: {key} {values[0]}"
        yield of.decode(f"context.{key}", about, raw, of.answer(of.plain), context={key: values[0]})
        yield of.encode(f"context.{key}", about, raw, context={key: values[0]})
    for name, about, context in wrong:
        yield of.decode(f"context.{name}", about, raw, "bad_value", context=context)
        yield of.encode(f"context.{name}", about, "bad_value", context=context)
    about = "a context that is no text"
    yield of.decode("context.number", about, raw, "bad_request", context={"a": 1})


def _lengths(framing: Framing, of: Subject) -> Iterator[Case]:
    """Yield packets that are as long as packets can be, and longer."""
    id, dest, source = id_of(of.message), of.asked["dest"], of.asked["source"]
    lengths = {layout.length for layout in of.message.layouts}
    room = MOST - of.layout.length
    packet = framing.frame(of, of.plain.held)[SIZE:]
    if room and of.layout.length == max(lengths):
        longest = framing.frame(of, of.plain.held, bytes(room))
        extra = "00" * room
        yield of.encode("extra.most", "as long as a packet can be", longest, extra=extra)
        answer = of.answer(of.plain, extra=extra)
        yield of.decode("extra.most", "as long as a packet can be", longest, answer)
    about = "longer than a packet can be"
    yield of.encode("extra.above", about, "out_of_range", extra="00" * (room + 1))
    beyond = data_frame(id, packet + bytes(room + 1), dest, source)
    yield of.decode("length.above", about, beyond, "bad_length")
    far = data_frame(id, packet, dest, source, declared=0xFFFF)
    yield of.decode("length.most", "the greatest length that is declared", far, "truncated")


def _announced(of: Subject) -> Iterator[Case]:
    """Yield packets that the destination does not announce."""
    id, dest, source = id_of(of.message), of.asked["dest"], of.asked["source"]
    raw = header_frame(id, 1, 0, dest, source) + b"\0"
    about = "a packet that the destination does not announce"
    yield of.decode("unannounced", about, raw, "trailing")
