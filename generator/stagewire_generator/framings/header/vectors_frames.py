"""The bytes of frames with a header, and the cases of messages without a layout."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from stagewire_generator.model import Json, Layout, Message, Protocol
from stagewire_generator.targets.vectors.subject import Case, Expected, make_case
from stagewire_generator.targets.vectors.values import fields_from_bytes, greatest_but

SIZE: Final = 6  # length of the header
MOST: Final = 255  # length of the longest packet
ANNOUNCED: Final = 0x80  # data flag of the destination: a packet follows


def header_frame(id: int, param1: int, param2: int, dest: int, source: int) -> bytes:
    """Return a header without a packet."""
    return id.to_bytes(2, "little") + bytes((param1, param2, dest, source))


def data_frame(
    id: int, packet: bytes, dest: int, source: int, declared: int | None = None
) -> bytes:
    """Return a header and its packet; ``declared`` replaces the length of the packet."""
    length = len(packet) if declared is None else declared
    head = id.to_bytes(2, "little") + length.to_bytes(2, "little")
    return head + bytes((dest | ANNOUNCED, source)) + packet


def with_high_length(raw: bytes) -> bytes:
    """Return a data frame whose declared length is 256 bytes greater than its packet."""
    return raw[:3] + bytes((raw[3] + 1,)) + raw[4:]


def longest(message: Message) -> int:
    """Return the length of the longest packet that a header of the message can announce."""
    return max([MOST] * (not has_array(message)) + [x.longest for x in message.layouts if x.array])


def has_array(message: Message) -> bool:
    """Whether the packet of a message ends with an array."""
    return any(layout.array for layout in message.layouts)


def stated_length(message: Message, packet: bytes) -> int | None:
    """Return the length that the fields before an array state; None if they are incomplete."""
    layout = next(layout for layout in message.layouts if layout.array)
    if len(packet) < layout.length or layout.array is None:
        return None
    values = fields_from_bytes(layout.fields[:-1], packet[: layout.length])
    return layout.length + layout.array.item.size * layout.array.count(values)


def without_flag(raw: bytes) -> bytes:
    """Return a data frame without its data flag."""
    return raw[:4] + bytes((raw[4] & ~ANNOUNCED,)) + raw[5:]


def id_of(message: Message) -> int:
    """Return the id of a message, which must have one."""
    assert message.id is not None
    return message.id


def sub_message_of(raw: bytes) -> int | None:
    """Return the sub-message of a frame, if its id has some; None if its packet is too short."""
    if not raw[4] & ANNOUNCED and len(raw) == SIZE:
        return raw[2]
    return raw[SIZE] | raw[SIZE + 1] << 8 if len(raw) >= SIZE + 2 else None


def unknown_sub_messages(
    protocol: Protocol, message: Message, dest: int, source: int
) -> dict[str, tuple[str, bytes]]:
    """Return frames with the id of a message and an unknown sub-message, each with its description."""
    taken = [m.sub_message for m in protocol.messages if m.id == message.id]
    long, short = greatest_but(taken, 2), greatest_but(taken, 1)
    frames = {}
    if long is not None:
        packet = long.to_bytes(2, "little")
        packet += bytes(max([2, *lengths_of(message)]) - len(packet))
        frames["packet"] = (
            "a packet with an unknown sub-message",
            data_frame(id_of(message), packet, dest, source),
        )
    if short is not None:
        frames["header"] = (
            "a header with an unknown sub-message",
            header_frame(id_of(message), short, 0, dest, source),
        )
    return frames


def unknown_id(protocol: Protocol) -> int:
    """Return an id that no message has."""
    unknown = greatest_but((message.id for message in protocol.messages), 2)
    assert unknown is not None  # no document has 65536 messages
    return unknown


def addresses(protocol: Protocol, message: Message) -> tuple[int, int]:
    """Return destination and source of a message between the host and the last device."""
    host, device = protocol.framing["host"], protocol.framing["devices"][-1]
    return (host, device) if message.direction == "to_host" else (device, host)


_PACKET = b"\1\2\3"


def undocumented_frames(protocol: Protocol, message: Message) -> dict[bytes, tuple[str, str, Json]]:
    """Return frames of a message without a layout -> name, description and answer of a decoder."""
    envelope = addresses(protocol, message)
    id = id_of(message)
    says = {
        "message": message.name,
        "form": "undocumented",
        "dest": envelope[0],
        "source": envelope[1],
    }
    return {
        header_frame(id, 0, 0, *envelope): (
            "header", "a header without a packet", {**says, "fields": {}, "data": None}
        ),
        header_frame(id, 1, 2, *envelope): (
            "parameters", "a header with parameters",
            {**says, "fields": {"param1": 1, "param2": 2}, "data": None},
        ),
        data_frame(id, b"", *envelope): (
            "empty", "an empty packet", {**says, "fields": {}, "data": ""}
        ),
        data_frame(id, _PACKET, *envelope): (
            "data", "a packet", {**says, "fields": {}, "data": _PACKET.hex()}
        ),
        data_frame(id, bytes(MOST), *envelope): (
            "longest", "the longest packet", {**says, "fields": {}, "data": "00" * MOST}
        ),
    }  # fmt: skip


def undocumented_cases(protocol: Protocol, message: Message) -> Iterator[Case]:
    """Yield the frames of a message without a layout, encoded and decoded, and errors."""
    frames = undocumented_frames(protocol, message)
    for raw, (name, about, says) in frames.items():
        yield _case(message, "decode", name, about, {"hex": raw.hex()}, says)
        yield _case(message, "encode", name, about, says, raw)
    raw = data_frame(id_of(message), _PACKET, *addresses(protocol, message))
    says = frames[raw][2]
    for name, about, cut, code in (
        ("cut", "without its last byte", raw[:-1], "truncated"),
        ("length.high", "a length whose high byte is 1", with_high_length(raw), "truncated"),
        ("trailing", "a trailing byte", raw + b"\0", "trailing"),
    ):
        yield _case(message, "decode", name, about, {"hex": cut.hex()}, code)
    bare = {key: value for key, value in says.items() if key not in ("data", "fields")}
    for name, about, more, code in (
        ("nothing", "no data and no parameters", {}, "unsupported"),
        ("both", "parameters and a packet", {"data": "01", "fields": {"param1": 1}}, "bad_value"),
        ("extra", "extra bytes without a layout", {"data": "01", "extra": "00"}, "bad_value"),
        ("too_long", "a packet that is too long", {"data": "00" * (MOST + 1)}, "out_of_range"),
        ("param2.above", "param2 is too great", {"fields": {"param2": 256}}, "out_of_range"),
        ("unknown_field", "a named field", {"fields": {"no_such_field": 0}}, "unknown_field"),
    ):
        yield _case(message, "encode", name, about, {**bare, **more}, code)
    without = {key: value for key, value in says.items() if key != "form"}
    yield _case(message, "encode", "form.left_out", "no form", without, raw)


def _case(
    message: Message, operation: str, name: str, about: str, more: Json, expected: Expected
) -> Case:
    id = f"{message.name}/undocumented/{operation}/{name}"
    return make_case(id, about, {"op": operation, **more}, expected)


def default_layout(message: Message) -> Layout | None:
    """Return the layout of a message without a stated form; None if the form must be stated.

    A message whose packets have several lengths has its plain form, ``data``.
    """
    forms = {layout.form: layout for layout in message.layouts}
    if len(forms) == 1:
        return message.layouts[0]
    return None if "header" in forms else forms.get("data")


def lengths_of(message: Message) -> set[int]:
    """Return the lengths of the packets of a message."""
    return {layout.length for layout in message.layouts if layout.form != "header"}
