"""Every message and layout: boundaries, round trips, errors. The JSON of the registry names the fields."""

from __future__ import annotations

import re
import struct
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stagewire import Frame
from stagewire.errors import (
    BadLengthError,
    CodecError,
    DecodeError,
    MissingFieldError,
    OutOfRangeError,
    TrailingBytesError,
    TruncatedError,
    UnknownFieldError,
    UnknownMessageError,
    UnsupportedError,
)
from stagewire.protocols import Message, UndecidedMessage, UndocumentedMessage
from stagewire_apt import PROTOCOL
from sub_messages import selecting
from undocumented import NAME
from undocumented import PROTOCOL as WITH_UNPRINTED

CLASSES = {(cls.layout.message, cls.layout.form): cls for cls in PROTOCOL.messages}
LAYOUTS = [
    (message, layout)
    for message in PROTOCOL.registry()["messages"]
    for layout in message["layouts"]
]


def with_layouts(layouts: list[tuple[Any, Any]]) -> pytest.MarkDecorator:
    names = [f"{message['name']}-{layout['form']}" for message, layout in layouts]
    return pytest.mark.parametrize(("message", "layout"), layouts, ids=names)


every_layout = with_layouts(LAYOUTS)
fixed_layout = with_layouts([pair for pair in LAYOUTS if "longest" not in pair[1]])
counted_layout = with_layouts([pair for pair in LAYOUTS if "longest" in pair[1]])


def fields_of(layout: dict[str, Any]) -> list[dict[str, Any]]:
    params = [layout[key] for key in ("param1", "param2") if layout[key]]
    return [*params, *layout["fields"]]


def context_of(layout: dict[str, Any]) -> dict[str, str] | None:
    return layout["when"]


def example_of(field: dict[str, Any], which: str) -> Any:
    if field["kind"] == "text":
        return {"minimum": "", "maximum": "\xff" * field["size"]}[which]
    if field["kind"] == "bytes":
        return bytes([{"minimum": 0, "maximum": 0xFF}[which]]) * field["size"]
    if field["kind"] == "array":
        return {"minimum": ()}[which]
    return field[which]


def strategy_of(field: dict[str, Any]) -> st.SearchStrategy[Any]:
    if field["kind"] == "text":
        latin = st.characters(min_codepoint=0, max_codepoint=0xFF)
        return st.text(latin, max_size=field["size"]).map(lambda text: text.rstrip("\0"))
    if field["kind"] == "bytes":
        return st.binary(min_size=field["size"], max_size=field["size"])
    return st.integers(field["minimum"], field["maximum"])


def by_hand(message: dict[str, Any], layout: dict[str, Any], values: dict[str, Any]) -> bytes:
    """Build the bytes from offsets and sizes, without the generated code."""
    frame = bytearray(6 + layout["length"])
    struct.pack_into("<H", frame, 0, message["id"])
    if layout["form"] == "header":
        frame[4:6] = 0x50, 0x01
    else:
        struct.pack_into("<HBB", frame, 2, layout["length"], 0x50 | 0x80, 0x01)
    for field in fields_of(layout):
        value = values[field["name"]]
        at = field["offset"] + (0 if layout["form"] == "header" else 6)
        if field["kind"] == "integer":
            raw = value.to_bytes(field["size"], "little", signed=field["signed"])
        elif field["kind"] == "text":
            raw = value.encode("latin-1").ljust(field["size"], b"\0")
        else:
            raw = value
        frame[at : at + field["size"]] = raw
    return bytes(frame)


def test_each_message_of_the_registry_has_its_class() -> None:
    documented = {(m["name"], layout["form"]) for m, layout in LAYOUTS}
    special = {
        key
        for key, cls in CLASSES.items()
        if issubclass(cls, (UndecidedMessage, UndocumentedMessage))
    }
    assert documented | special == set(CLASSES)
    assert len(PROTOCOL.registry()["messages"]) > 160


@fixed_layout
@pytest.mark.parametrize("which", ["minimum", "maximum"])
def test_boundaries_encode_and_decode(
    message: dict[str, Any], layout: dict[str, Any], which: str
) -> None:
    values = {field["name"]: example_of(field, which) for field in fields_of(layout)}
    made = PROTOCOL.build(message["name"], values, layout["form"])
    raw = Frame(made, 0x50, 0x01).encode()
    assert raw == by_hand(message, layout, values)
    frame = PROTOCOL.decode(raw, context_of(layout))
    assert frame == Frame(made, 0x50, 0x01)
    assert type(frame.message) is CLASSES[message["name"], layout["form"]]
    assert {name: frame.message.values()[name] for name in values} == values


@fixed_layout
def test_the_error_of_a_value_out_of_range_names_the_field(
    message: dict[str, Any], layout: dict[str, Any]
) -> None:
    values = {field["name"]: example_of(field, "minimum") for field in fields_of(layout)}
    for field in fields_of(layout):
        if field["kind"] == "integer":
            wrong = [field["minimum"] - 1, field["maximum"] + 1]
        elif field["kind"] == "text":
            wrong = ["x" * (field["size"] + 1)]
        else:
            wrong = [bytes(field["size"] - 1), bytes(field["size"] + 1)]
        for value in wrong:
            with pytest.raises(OutOfRangeError, match=rf"{message['name']}\.{field['name']}\b"):
                PROTOCOL.build(message["name"], {**values, field["name"]: value}, layout["form"])


@every_layout
def test_missing_and_unknown_fields_are_refused(
    message: dict[str, Any], layout: dict[str, Any]
) -> None:
    values = {field["name"]: example_of(field, "minimum") for field in fields_of(layout)}
    with pytest.raises(UnknownFieldError, match="no_such_field"):
        PROTOCOL.build(message["name"], {**values, "no_such_field": 1}, layout["form"])
    for field in fields_of(layout):
        rest = {name: value for name, value in values.items() if name != field["name"]}
        if field["role"] == "value" and not (field["default"] == 0 and layout["form"] == "header"):
            with pytest.raises(MissingFieldError, match=field["name"]):
                PROTOCOL.build(message["name"], rest, layout["form"])
        else:
            PROTOCOL.build(message["name"], rest, layout["form"])


@fixed_layout
def test_other_lengths_are_refused_or_kept_as_extra(
    message: dict[str, Any], layout: dict[str, Any]
) -> None:
    values = {field["name"]: example_of(field, "minimum") for field in fields_of(layout)}
    raw = by_hand(message, layout, values)
    context = context_of(layout)
    for end in range(len(raw)):
        with pytest.raises(TruncatedError):
            PROTOCOL.decode(raw[:end], context)
    with pytest.raises(TrailingBytesError):
        PROTOCOL.decode(raw + b"\0", context)
    if layout["form"] == "header":
        return
    longer = raw[:2] + struct.pack("<H", layout["length"] + 3) + raw[4:] + b"abc"
    frame = PROTOCOL.decode(longer, context)
    assert frame.extra == b"abc"
    assert frame.encode() == longer
    shorter = raw[:2] + struct.pack("<H", layout["length"] - 1) + raw[4:-1]
    lengths = {o["length"] for o in message["layouts"] if o["form"] != "header"}
    if all(length >= layout["length"] for length in lengths):
        with pytest.raises(BadLengthError):
            PROTOCOL.decode(shorter, context)


@fixed_layout
@settings(max_examples=15, deadline=None)
@given(data=st.data())
def test_encoded_messages_decode_to_equal_ones(
    message: dict[str, Any], layout: dict[str, Any], data: st.DataObject
) -> None:
    values = {
        field["name"]: data.draw(strategy_of(field), label=field["name"])
        for field in fields_of(layout)
    }
    dest, source = data.draw(st.tuples(st.integers(0, 0x7F), st.integers(0, 0xFF)))
    made = PROTOCOL.build(message["name"], values, layout["form"])
    frame = Frame(made, dest, source)
    assert PROTOCOL.decode(frame.encode(), context_of(layout)) == frame


@fixed_layout
@settings(max_examples=15, deadline=None)
@given(data=st.data())
def test_decoded_bytes_encode_to_the_same_bytes(
    message: dict[str, Any], layout: dict[str, Any], data: st.DataObject
) -> None:
    size = layout["length"] or 2
    drawn = data.draw(st.binary(min_size=size, max_size=size))
    body = selecting(drawn, message.get("sub_message"), layout["form"])
    id = message["id"].to_bytes(2, "little")
    if layout["form"] == "header":
        raw = id + body + data.draw(st.integers(0, 0x7F)).to_bytes(1, "little") + b"\x01"
    else:
        raw = id + struct.pack("<HBB", layout["length"], 0xD0, 0x01) + body
    for context in (None, {"status": "dc"}, {"status": "stepper"}):
        assert PROTOCOL.decode(raw, context).encode() == raw


@counted_layout
@pytest.mark.parametrize("edge", ["minimum", "maximum"])
def test_the_shortest_and_the_longest_array_round_trip(
    message: dict[str, Any], layout: dict[str, Any], edge: str
) -> None:
    *fields, field = layout["fields"]
    values = {each["name"]: each[edge] for each in fields}
    columns = [
        values[each["each"]].bit_count() if each["each"] else 1
        for each in field["array"]["columns"]
    ]
    values[field["name"]] = (field[edge],) * (values[field["array"]["rows"]] * sum(columns))
    raw = Frame(PROTOCOL.build(message["name"], values, layout["form"]), 0x50, 0x01).encode()
    assert len(raw) == 6 + {"minimum": layout["length"], "maximum": layout["longest"]}[edge]
    assert PROTOCOL.decode(raw).message.values() == values


@settings(max_examples=500, deadline=None)
@given(st.binary(max_size=40), st.sampled_from([None, {"status": "dc"}, {"status": "x"}]))
def test_any_bytes_give_a_frame_or_a_documented_error(
    raw: bytes, context: dict[str, str] | None
) -> None:
    try:
        frame = PROTOCOL.decode(raw, context)
    except (DecodeError, UnknownMessageError):
        return
    assert frame.encode() == raw


def test_a_message_without_an_id_is_never_encoded() -> None:
    assert PROTOCOL.nameless
    for name in PROTOCOL.nameless:
        with pytest.raises(UnsupportedError, match=name):
            PROTOCOL.build(name, {})


def test_a_message_without_a_layout_is_kept_but_not_built_from_fields() -> None:
    with pytest.raises(UnsupportedError, match=NAME):
        WITH_UNPRINTED.build(NAME, {})
    raw = bytes.fromhex("f100 4400 81 50") + bytes(range(0x44))
    frame = WITH_UNPRINTED.decode(raw)
    assert isinstance(frame.message, UndocumentedMessage)
    assert frame.message.data == bytes(range(0x44))
    assert frame.encode() == raw
    header = bytes.fromhex("f100 0102 01 50")
    assert WITH_UNPRINTED.decode(header).encode() == header


def test_an_undecided_layout_has_the_fields_that_all_candidates_share() -> None:
    raw = bytes.fromhex("64040E00815001006 8AAA001000000003000 0080".replace(" ", ""))
    message = PROTOCOL.decode(raw).message
    assert isinstance(message, UndecidedMessage)
    assert {name: getattr(message, name) for name in message.shared} == {
        "chan_ident": 1,
        "position": 27306600,
        "status_bits": 0x80000030,
    }
    assert type(PROTOCOL.decode(raw, {"status": "dc"}).message).__name__ == "MotMoveCompletedDc"


def test_a_similar_message_name_is_suggested() -> None:
    with pytest.raises(UnknownMessageError, match="MOT_SET_VELPARAMS"):
        PROTOCOL.build("MOT_SET_VELPARAM", {})


def test_every_error_has_a_code() -> None:
    codes = {cls.code for cls in _tree(CodecError)}
    assert codes >= {
        "truncated", "trailing", "bad_length", "unknown_message", "unknown_field",
        "missing_field", "out_of_range", "bad_value", "unsupported",
    }  # fmt: skip


def _tree(cls: type[CodecError]) -> list[type[CodecError]]:
    return [cls, *(leaf for child in cls.__subclasses__() for leaf in _tree(child))]


def test_all_public_names_are_documented() -> None:
    for cls in PROTOCOL.messages:
        assert issubclass(cls, Message)
        assert f"``{cls.layout.message}``" in (cls.__doc__ or "")
        assert re.search("page|section", cls.__doc__ or "")
