"""Columns agree with decoding frame by frame, for all layouts and both paths; gathering loses nothing."""

from __future__ import annotations

import mmap
import random
import struct
import sys
import tracemalloc
from array import array
from pathlib import Path
from struct import Struct
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stagewire import End
from stagewire._columns.arrays import read, read_numpy
from stagewire.columns import (
    Field,
    Frames,
    Kind,
    Shape,
    columns,
    gather,
    numpy_columns,
    shape_of,
)
from stagewire.errors import (
    BadLengthError,
    BadValueError,
    CodecError,
    DecodeError,
    TruncatedError,
    UnsupportedError,
)
from stagewire.framing import BadLength, Garbage, Received, Undocumented, Unknown
from stagewire.protocols import (
    Command,
    CountedMessage,
    Direction,
    FramedMessage,
    FramedProtocol,
    Layout,
    Message,
    Reply,
    UndocumentedMessage,
    load_protocol,
)
from stagewire_apt import PROTOCOL
from stagewire_apt import messages as m
from sub_messages import selecting
from undocumented import PROTOCOL as WITH_UNPRINTED
from undocumented import HwUnprinted

WITH_COLUMNS = [
    cls
    for cls in PROTOCOL.messages
    if not issubclass(
        cls, (UndocumentedMessage, CountedMessage)
    )  # for the latter, see test_arrays.py
]
STATUS = bytes.fromhex("91040e00 8150 0100 10270000 feff 0000 10000080")
HOMED = bytes.fromhex("4404 0100 0150")
BOTH = pytest.mark.parametrize("read_columns", [columns, numpy_columns])


def frames_of(cls: type[Message], payloads: list[bytes], addresses: list[tuple[int, int]]) -> bytes:
    layout = cls.layout
    made = b""
    for drawn, (dest, source) in zip(payloads, addresses, strict=True):
        payload = selecting(drawn, layout.sub_message, layout.form)
        if layout.form == "header":
            made += struct.pack("<H2sBB", layout.id, payload, dest, source)
        else:
            made += struct.pack("<HHBB", layout.id, layout.length, dest | 0x80, source) + payload
    return made


def one_by_one(cls: type[Message], raw: bytes) -> dict[str, list[Any]]:
    """Decode each frame; the reference for both paths."""
    size = 6 + cls.layout.length
    context = cls.layout.when or None
    found: dict[str, list[Any]] = {name: [] for name in ("dest", "source", *cls.layout.fields)}
    for start in range(0, len(raw), size):
        frame = PROTOCOL.decode(raw[start : start + size], context)
        assert type(frame.message) is cls
        for name, value in {
            "dest": frame.dest,
            "source": frame.source,
            **frame.message.values(),
        }.items():
            found[name].append(value)
    return found


def as_lists(found: dict[str, Any]) -> dict[str, list[Any]]:
    return {
        name: list(column) if isinstance(column, (array, list)) else column.tolist()
        for name, column in found.items()
    }


@pytest.mark.parametrize("cls", WITH_COLUMNS, ids=lambda cls: cls.__name__)
@settings(max_examples=8, deadline=None)
@given(data=st.data())
def test_columns_agree_with_decoding(cls: type[Message], data: st.DataObject) -> None:
    size = cls.layout.length or 2
    extremes = [bytes(size), b"\xff" * size, b"\x7f" * size, b"\x80" * size, b"A\0" * (size // 2)]
    extremes[-1] = extremes[-1].ljust(size, b"B")
    payloads = data.draw(st.lists(st.binary(min_size=size, max_size=size), max_size=5)) + extremes
    pair = st.tuples(st.integers(0, 0x7F), st.integers(0, 0xFF))
    addresses = data.draw(st.lists(pair, min_size=len(payloads), max_size=len(payloads)))
    raw = frames_of(cls, payloads, addresses)
    expected = one_by_one(cls, raw)
    found = columns(cls, raw)
    assert list(found) == ["dest", "source", *cls.layout.fields]
    assert as_lists(found) == expected
    with_numpy = numpy_columns(cls, raw)
    assert list(with_numpy) == list(found)
    assert as_lists(with_numpy) == expected
    assert all(column.flags.c_contiguous for column in with_numpy.values())


@BOTH
def test_many_frames_give_many_rows(read_columns: Any) -> None:
    """More frames than the standard library path reads together."""
    rng = random.Random(3)
    raw = b"".join(STATUS[:8] + rng.randbytes(12) for _ in range(20_001))
    assert as_lists(read_columns(m.MotGetDcStatusUpdate, raw)) == one_by_one(
        m.MotGetDcStatusUpdate, raw
    )


@BOTH
@pytest.mark.parametrize("cls", [m.MotGetDcStatusUpdate, m.MotMoveHomed, m.HwGetInfo])
def test_no_frames_give_empty_columns(read_columns: Any, cls: type[Message]) -> None:
    found = read_columns(cls, b"")
    assert list(found) == ["dest", "source", *cls.layout.fields]
    assert {len(column) for column in found.values()} == {0}


def test_columns_have_the_types_of_the_fields() -> None:
    found = columns(m.MotGetDcStatusUpdate, STATUS)
    widths = {name: column.itemsize for name, column in found.items()}
    assert list(widths.values()) == [1, 1, 2, 4, 2, 2, 4]
    with_numpy = numpy_columns(m.MotGetDcStatusUpdate, STATUS)
    kinds = [column.dtype.kind + str(column.dtype.itemsize) for column in with_numpy.values()]
    assert kinds == ["u1", "u1", "u2", "i4", "i2", "i2", "u4"]
    assert all(column.dtype.isnative for column in with_numpy.values())


@BOTH
def test_any_buffer_is_read_and_released(read_columns: Any, tmp_path: Path) -> None:
    path = tmp_path / "capture"
    path.write_bytes(STATUS * 3)
    expected = as_lists(read_columns(m.MotGetDcStatusUpdate, STATUS * 3))
    growing = bytearray(STATUS * 3)
    assert as_lists(read_columns(m.MotGetDcStatusUpdate, growing)) == expected
    growing += STATUS  # fails if a view was kept
    assert as_lists(read_columns(m.MotGetDcStatusUpdate, memoryview(STATUS * 3))) == expected
    with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as mapped:
        assert as_lists(read_columns(m.MotGetDcStatusUpdate, mapped)) == expected


@BOTH
@pytest.mark.parametrize("number", [0, 1, 8191, 8192, 9000])
@pytest.mark.parametrize(
    ("wrong", "error", "said"),
    [
        (b"\x90" + STATUS[1:], DecodeError, r"with id 0x0491, found id 0x0490"),
        (
            STATUS[:2] + b"\x0c" + STATUS[3:],
            BadLengthError,
            "with a packet of 14 bytes, found the header",
        ),
        (STATUS[:4] + b"\x01" + STATUS[5:], BadLengthError, "91 04 0e 00 01 50"),
    ],
)
def test_the_error_names_the_first_invalid_frame(
    read_columns: Any, number: int, wrong: bytes, error: type[CodecError], said: str
) -> None:
    raw = STATUS * number + wrong + STATUS * 100 + wrong + STATUS[:5]
    with pytest.raises(
        error, match=rf"^byte {number * 20}: expected a frame of MOT_GET_DCSTATUSUPDATE.*{said}"
    ):
        read_columns(m.MotGetDcStatusUpdate, raw)


@BOTH
def test_a_header_with_the_bit_of_a_packet_is_refused(read_columns: Any) -> None:
    with pytest.raises(
        BadLengthError, match=r"byte 6: .* without packet, found the header 44 04 01 00 81"
    ):
        read_columns(m.MotMoveHomed, HOMED + HOMED[:4] + b"\x81" + HOMED[5:])


@BOTH
@pytest.mark.parametrize("length", range(1, 20))
def test_a_partial_frame_at_the_end_is_refused(read_columns: Any, length: int) -> None:
    with pytest.raises(
        TruncatedError, match=f"byte 40: .* with 20 bytes, but only {length} are left"
    ):
        read_columns(m.MotGetDcStatusUpdate, STATUS * 2 + STATUS[:length])


@BOTH
def test_invalid_arguments(read_columns: Any) -> None:
    for raw in ("91", None, [1], 5):
        with pytest.raises(BadValueError, match="columns are made from bytes, not"):
            read_columns(m.MotGetDcStatusUpdate, raw)
    with pytest.raises(BadValueError, match="not from a view with steps"):
        read_columns(m.MotGetDcStatusUpdate, memoryview(STATUS * 2)[::2])
    for cls in (STATUS, int, None):
        with pytest.raises(BadValueError, match="columns are made from a message class"):
            read_columns(cls, STATUS)
    with pytest.raises(UnsupportedError, match="HW_UNPRINTED has no documented layout"):
        read_columns(HwUnprinted, b"")


def test_a_class_without_offsets_of_its_fields() -> None:
    class ByHand(FramedMessage):
        __slots__ = ()
        layout = m.MotMoveHomed.layout

    with pytest.raises(UnsupportedError, match="ByHand does not define the offsets of its fields"):
        columns(ByHand, b"")


class Far(FramedMessage):
    """A message with integers of three bytes, in the style of the generator."""

    __slots__ = ("far", "label", "near")
    layout = Layout(
        "FAR", 0x04FE, Direction.TO_HOST, "data", ("far", "near", "label"), 8, signed=("far",)
    )
    _unpack = Struct("<6x3s3s2s").unpack_from
    far: int
    near: int
    label: str

    @classmethod
    def unpack(cls, raw: bytes) -> Far:
        far, near, label = cls._unpack(raw)
        return cls.keep({
            "far": int.from_bytes(far, "little", signed=True),
            "near": int.from_bytes(near, "little"),
            "label": label.rstrip(b"\0").decode("latin-1"),
        })  # fmt: skip


FAR = FramedProtocol("far", "Far", "far", [Far], 1, frozenset({0x50}), {})


@given(rows=st.lists(st.binary(min_size=8, max_size=8), max_size=6))
def test_three_byte_integers_agree_with_decoding(rows: list[bytes]) -> None:
    raw = [bytes.fromhex("FE0408008150") + row for row in rows]
    frames = [FAR.decode(frame).message.values() for frame in raw]
    for read_columns in (columns, numpy_columns):
        found = as_lists(read_columns(Far, b"".join(raw)))
        for name in Far.layout.fields:
            assert found[name] == [values[name] for values in frames]


def test_a_protocol_without_headers_has_no_columns() -> None:
    commands: Any = load_protocol("asi_ms2000")
    with pytest.raises(UnsupportedError, match="no frames to sort into columns"):
        gather(commands, [b"18"])


@pytest.mark.parametrize("cls", [Command, Reply])
def test_messages_without_a_header_have_no_columns(cls: type[Message]) -> None:
    with pytest.raises(UnsupportedError, match="has no header"):
        columns(cls, b"")


def test_the_error_without_numpy_names_the_package(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "numpy", None)
    monkeypatch.delitem(sys.modules, "stagewire._columns.vectors", raising=False)
    with pytest.raises(UnsupportedError, match=r"pip install 'stagewire\[numpy\]'") as raised:
        numpy_columns(m.MotGetDcStatusUpdate, STATUS)
    assert raised.value.code == "unsupported"
    assert list(columns(m.MotGetDcStatusUpdate, STATUS)["position"]) == [10_000]


@given(st.data())
@settings(max_examples=60, deadline=None)
def test_integers_of_any_size(data: st.DataObject) -> None:
    """Sizes that Struct has no code for, which other protocols use."""
    sizes = data.draw(st.lists(st.integers(1, 8), min_size=1, max_size=6))
    places, offset = [], 6
    for number, size in enumerate(sizes):
        kind = data.draw(st.sampled_from([Kind.SIGNED, Kind.UNSIGNED]))
        places.append(Field(f"field{number}", offset, size, kind))
        offset += size
    head = b"\x34\x12" + (offset - 6).to_bytes(2, "little")
    shape = Shape("ANY (data)", head, True, offset, tuple(places))
    rows = data.draw(st.lists(st.binary(min_size=offset - 6, max_size=offset - 6), max_size=4))
    rows += [b"\xff" * (offset - 6), b"\x7f" * (offset - 6), b"\x80" * (offset - 6)]
    raw = b"".join(head + b"\x81\x50" + row for row in rows)
    for found in (as_lists(read(shape, raw)), as_lists(read_numpy(shape, raw))):
        for place in places:
            cells = (row[place.offset - 6 : place.offset - 6 + place.size] for row in rows)
            signed = place.kind is Kind.SIGNED
            expected = [int.from_bytes(cell, "little", signed=signed) for cell in cells]
            assert found[place.name] == expected


@pytest.mark.parametrize("cls", WITH_COLUMNS, ids=lambda cls: cls.__name__)
def test_the_shape_agrees_with_the_registry(cls: type[Message]) -> None:
    registry = {entry["name"]: entry for entry in PROTOCOL.registry()["messages"]}
    layouts = {layout["form"]: layout for layout in registry[cls.layout.message]["layouts"]}
    shape = shape_of(cls)
    if cls.layout.form == "data:undecided":
        assert shape.fields == (Field("data", 6, cls.layout.length, Kind.BYTES),)
        return
    layout = layouts[cls.layout.form]
    fields = [layout[key] for key in ("param1", "param2") if layout[key]] + layout["fields"]
    packet = 0 if cls.layout.form == "header" else 6
    expected = {}
    for field in fields:
        kind = {"text": Kind.TEXT, "bytes": Kind.BYTES}.get(field["kind"])
        kind = kind or (Kind.SIGNED if field["signed"] else Kind.UNSIGNED)
        expected[field["offset"] + packet] = (field["size"], kind)
    found = {place.offset: (place.size, place.kind) for place in shape.fields}
    unnamed = {place.offset: (1, Kind.UNSIGNED) for place in shape.fields if place.offset < 4}
    assert found == unnamed | expected
    assert [place.name for place in shape.fields] == list(cls.layout.fields)


# Streams


def stream_of_all() -> tuple[bytes, list[tuple[int, bytes]]]:
    """Return a stream with every kind of event, and the offsets of its frames with a known layout."""
    longer = STATUS[:2] + b"\x11" + STATUS[3:] + b"xyz"
    parts = [
        (STATUS, True),
        (HOMED, True),
        (bytes.fromhex("0f0f 0200 8150 abcd"), False),  # unknown
        (longer, True),
        (bytes.fromhex("f100 0200 8150 abcd"), False),  # undocumented
        (bytes.fromhex("9104 0c00 8150") + bytes(12), False),  # too short
        (STATUS, True),
        (b"\xee" * 9, False),  # garbage
        (STATUS, True),
        (HOMED, True),
    ]
    stream, frames = b"", []
    for raw, known in parts:
        if known:
            frames.append((len(stream), raw))
        stream += raw
    return stream + STATUS[:7], frames


@pytest.mark.parametrize("size", [1, 2, 5, 7, 64, 1000])
def test_sorting_a_stream_loses_nothing(size: int) -> None:
    stream, frames = stream_of_all()
    chunks = [stream[start : start + size] for start in range(0, len(stream), size)]
    gathered = gather(WITH_UNPRINTED, chunks, End.HOST)
    assert set(gathered.frames) == {m.MotGetDcStatusUpdate, m.MotMoveHomed}
    status = gathered.frames[m.MotGetDcStatusUpdate]
    assert list(status.offsets) == [at for at, raw in frames if raw[:2] == STATUS[:2]]
    assert bytes(status.raw) == STATUS * 4
    assert status.extra == {1: b"xyz"}
    assert len(status) == 4
    homed = gathered.frames[m.MotMoveHomed]
    assert list(homed.offsets) == [at for at, raw in frames if raw == HOMED]
    assert list(homed.columns()["chan_ident"]) == [1, 1]
    assert homed.numpy_columns()["source"].tolist() == [0x50, 0x50]
    assert gathered.counts == {Received: 6, Unknown: 1, Undocumented: 1, BadLength: 1, Garbage: 1}
    assert gathered.pending == STATUS[:7]
    assert gathered.read == len(stream)


@pytest.mark.parametrize(
    ("context", "cls"),
    [
        (None, m.MotMoveCompletedUndecided),
        ({"status": "dc"}, m.MotMoveCompletedDc),
        ({"status": "stepper"}, m.MotMoveCompletedStepper),
    ],
)
def test_a_context_selects_a_layout(context: dict[str, str] | None, cls: type[Message]) -> None:
    raw = bytes.fromhex("64040e00 8150 0100 68aaa001 feff ffff 30000080")
    gathered = gather(PROTOCOL, [raw], context=context)
    frames = gathered.frames[cls]
    assert as_lists(frames.columns()) == one_by_one(cls, raw)
    assert as_lists(frames.numpy_columns()) == one_by_one(cls, raw)


def test_only_the_requested_messages_are_kept() -> None:
    stream, _ = stream_of_all()
    gathered = gather(PROTOCOL, [stream], only=[m.MotMoveHomed])
    assert set(gathered.frames) == {m.MotMoveHomed}
    assert gathered.counts[Received] == 6


def test_a_frame_without_the_data_flag_is_kept_with_it() -> None:
    bare = bytes.fromhex("C0080800500147000100 07000000")
    frames = gather(PROTOCOL, [bare]).frames[m.PzmotSetCloseMoveParams]
    assert frames.raw == bare[:4] + b"\xd0" + bare[5:]
    assert list(frames.columns()["position"]) == [7]


def test_frames_can_be_taken_and_cleared() -> None:
    frames = Frames(m.MotGetDcStatusUpdate)
    frames.append(7, STATUS + b"!")
    frames.clear()
    assert (len(frames), bytes(frames.raw), frames.extra) == (0, b"", {})


@settings(max_examples=40, deadline=None)
@given(st.lists(st.sampled_from([STATUS, HOMED, b"\xff", STATUS[:9], b""]), max_size=30))
def test_the_kept_frames_are_those_of_the_framer(parts: list[bytes]) -> None:
    stream = b"".join(parts)
    gathered = gather(PROTOCOL, parts)
    events = PROTOCOL.framer().feed(stream)
    expected: dict[type[Message], bytes] = {}
    for event in events:
        if isinstance(event, Received):
            cls = type(event.frame.message)
            expected[cls] = expected.get(cls, b"") + event.raw
    assert {cls: bytes(frames.raw) for cls, frames in gathered.frames.items()} == expected
    for frames in gathered.frames.values():
        for number, offset in enumerate(frames.offsets):
            size = len(frames.raw) // len(frames)
            assert stream[offset:].startswith(frames.raw[number * size : (number + 1) * size])


def test_memory_grows_only_with_kept_frames() -> None:
    stream = (STATUS * 9 + HOMED) * 5_000  # 0.9 MB in one piece

    def peak(only: list[type[Message]]) -> int:
        tracemalloc.start()
        try:
            gather(PROTOCOL, [stream], only=only)
            return tracemalloc.get_traced_memory()[1]
        finally:
            tracemalloc.stop()

    assert peak([]) < 1_200_000
    assert peak([m.MotMoveHomed]) < 1_200_000


def test_feeding_something_other_than_bytes() -> None:
    for wrong in ("53", None, 5):
        with pytest.raises(BadValueError, match="columns are made from bytes"):
            gather(PROTOCOL, [wrong])  # type: ignore[list-item]
