"""What holds for every packet: addresses, damage, lengths and ids that are none."""

from __future__ import annotations

from collections.abc import Iterator

from stagewire_generator.model import Protocol
from stagewire_generator.targets.vectors.case import Case
from stagewire_generator.targets.vectors.packet_frame import Packets
from stagewire_generator.targets.vectors.subject import LEFT_OUT, Subject, make_case
from stagewire_generator.targets.vectors.wire import greatest_but

__all__ = ["protocol_cases", "unknown_id"]


def protocol_cases(protocol: Protocol, of: Subject, raw: bytes) -> Iterator[Case]:
    """Yield the cases of all packets, looked at in the plain one of a layout."""
    packets = Packets(protocol)
    request = {"op": "encode", "message": "NO_SUCH_MESSAGE"} | _address(of)
    about = "a name that no message has"
    yield make_case("frame/encode/message", about, request, "unknown_message")
    unknown = unknown_id(protocol)
    if unknown is not None:
        there = packets.pack(unknown, of.asked.get("address", 0), b"")
        yield of.decode("id.unknown", "an id that no message has", there, "unknown_message")
    about = "an address of another protocol"
    yield of.encode("dest", about, "bad_request", dest=1)
    yield of.decode("context", "a context", raw, "bad_request", context={"status": "dc"})
    yield from _addresses(packets, of, raw)
    yield from _damaged(packets, of, raw)
    yield from _lengths(packets, of, raw)


def unknown_id(protocol: Protocol) -> int | None:
    """Return an id that no message has, if there is one."""
    ids = {message.id for message in protocol.messages}
    return greatest_but(ids, protocol.framing["id"]["size"])


def _address(of: Subject) -> dict[str, int]:
    return {key: of.asked[key] for key in ("address",) if key in of.asked}


def _addresses(packets: Packets, of: Subject, raw: bytes) -> Iterator[Case]:
    if not packets.sizes["address"]:
        about = "an address, which no packet has"
        yield of.encode("address", about, "bad_request", address=1)
        return
    most = packets.greatest_address
    payload = raw[packets.place("payload", of.layout.length)]
    assert of.message.id is not None
    for name, address in (("least", 0), ("greatest", most)):
        there = packets.pack(of.message.id, address, payload)
        about = f"its address at its {name}"
        yield of.encode(f"address.{name}", about, there, address=address)
        yield of.decode(f"address.{name}", about, there, of.answer(of.plain, address=address))
    for name, about, value, code in (
        ("below", "is less than nothing", -1, "out_of_range"),
        ("above", "is too great", most + 1, "out_of_range"),
        ("missing", "is missing", LEFT_OUT, "missing_field"),
        ("text", "is a text and no number", "1", "bad_value"),
        ("true", "is true and no number", True, "bad_value"),
    ):
        yield of.encode(f"address.{name}", f"its address {about}", code, address=value)


def _damaged(packets: Packets, of: Subject, raw: bytes) -> Iterator[Case]:
    """Yield packets of which one bit was turned, in what is the same in all of them or checks the rest."""
    for part in ("start", "check", "end"):
        if part in packets.order:
            place = packets.place(part, of.layout.length)
            for at in range(place.start, place.stop):
                there = _turned(raw, at)
                name = f"{part}.{at - place.start}"
                yield of.decode(name, f"a bit of its {part} is another", there, "bad_value")
    if "check" in packets.order and of.layout.length:
        at = packets.place("payload", of.layout.length).start
        if _covered(packets, of, raw, at):
            about = "a bit of its payload is another"
            yield of.decode("payload", about, _turned(raw, at), "bad_value")


def _covered(packets: Packets, of: Subject, raw: bytes, at: int) -> bool:
    """Whether the check of a packet is another when a bit of its payload is."""
    assert of.message.id is not None
    payload = _turned(raw, at)[packets.place("payload", of.layout.length)]
    there = packets.pack(of.message.id, of.asked.get("address", 0), payload)
    check = packets.place("check", of.layout.length)
    return there[check] != raw[check]


def _turned(raw: bytes, at: int) -> bytes:
    return raw[:at] + bytes((raw[at] ^ 1,)) + raw[at + 1 :]


def _lengths(packets: Packets, of: Subject, raw: bytes) -> Iterator[Case]:
    """Yield lengths that no packet has, and the longest payload."""
    assert of.message.id is not None
    address = of.asked.get("address", 0)
    payload = raw[packets.place("payload", of.layout.length)]
    if packets.counted:
        there = packets.pack(of.message.id, address, payload, declared=packets.counted - 1)
        about = "a length that is less than that of a packet without payload"
        yield of.decode("length.below", about, there, "bad_length")
    above = packets.counted + packets.most + 1
    if above < 1 << 8 * packets.sizes["length"]:
        there = packets.pack(of.message.id, address, payload, declared=above)
        yield of.decode("length.above", "a length that no packet has", there, "bad_length")
    room = packets.most - of.layout.length
    if of.layout.length:
        about = "a payload that is longer than any"
        yield of.encode("extra.above", about, "out_of_range", extra="a5" * (room + 1))
        if room and of.layout.length == max(layout.length for layout in of.message.layouts):
            longest = packets.pack(of.message.id, address, payload + b"\xa5" * room)
            about = "the longest payload"
            yield of.encode("extra.most", about, longest, extra="a5" * room)
            yield of.decode("extra.most", about, longest, of.answer(of.plain, extra="a5" * room))
