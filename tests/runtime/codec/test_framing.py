"""The framing rule, rule by rule, and properties that hold for any bytes in any chunks."""

from __future__ import annotations

from itertools import pairwise
from types import ModuleType

import pytest
from hypothesis import given
from hypothesis import strategies as st

from checkout import ROOT
from files import import_program
from stagewire.framing import (
    BadLength,
    End,
    Event,
    Forms,
    Framer,
    FramingTable,
    Garbage,
    Received,
    Undocumented,
    Unknown,
    join_garbage,
)
from stagewire.protocols import Direction

IN, OUT, BOTH = Direction.TO_HOST, Direction.TO_CONTROLLER, Direction.BOTH
MAXIMAL_FRAME = 6 + 255

TABLE = FramingTable(
    forms={
        0x0002: Forms("HW_DISCONNECT", BOTH, True, frozenset(), only_zero_parameters=True),
        0x0006: Forms("HW_GET_INFO", IN, False, frozenset({84})),
        0x0081: Forms("HW_RICHRESPONSE", IN, False, frozenset(), documented=False),
        0x0212: Forms("MOD_GET_CHANENABLESTATE", IN, True, frozenset()),
        0x0443: Forms("MOT_MOVE_HOME", OUT, True, frozenset()),
        0x0444: Forms("MOT_MOVE_HOMED", IN, True, frozenset()),
        0x0453: Forms("MOT_MOVE_ABSOLUTE", OUT, True, frozenset({6})),
        0x0464: Forms("MOT_MOVE_COMPLETED", IN, True, frozenset({14})),
        0x0481: Forms("MOT_GET_STATUSUPDATE", IN, False, frozenset({14})),
        0x04FE: Forms("of two lengths", IN, False, frozenset({4, 12})),
    },
    host=0x01,
    devices=frozenset({0x11, *range(0x21, 0x2B), 0x50}),
)


def b(text: str) -> bytes:
    return bytes.fromhex(text)


STATUS = b("81 04 0E 00 81 50 01 00 40 0D 03 00 00 00 00 00 30 00 00 80")
HOMED = b("44 04 01 00 01 50")
STRAY = b("FF")


def frame(data: bytes, end: End = End.HOST) -> list[Event]:
    """Frame ``data`` and check that no byte was lost."""
    framer = Framer(TABLE, end)
    events = framer.feed(data)
    assert b"".join(event.raw for event in events) + framer.pending == data
    return events


# In step


def test_starts_in_step_and_returns_each_frame() -> None:
    assert frame(STATUS + HOMED + STATUS) == [Received(STATUS), Received(HOMED), Received(STATUS)]


def test_a_frame_knows_its_id_and_addresses() -> None:
    (event,) = frame(STATUS)
    assert isinstance(event, Received)
    assert (event.id, event.dest, event.source) == (0x0481, 0x01, 0x50)
    assert event.raw[event.payload_offset :] == STATUS[6:]


def test_a_capture_of_real_hardware_is_a_message() -> None:
    completed = b("64 04 0E 00 81 50 01 00 68 AA A0 01 00 00 00 00 30 00 00 80")
    assert frame(completed) == frame(completed, End.NONE) == [Received(completed)]


@pytest.mark.parametrize("source", ["11", "21", "2A", "50"])
def test_right_addresses_are_those_of_the_documented_devices(source: str) -> None:
    header = b(f"44 04 01 00 01 {source}")
    assert frame(STRAY + header) == [Garbage(STRAY), Received(header)]


@pytest.mark.parametrize("addresses", ["01 20", "01 2B", "01 01", "00 50", "01 00", "50 50"])
def test_in_step_other_addresses_are_garbage(addresses: str) -> None:
    header = b(f"44 04 01 00 {addresses}")
    assert frame(header + STATUS) == [Garbage(header), Received(STATUS)]


@pytest.mark.parametrize("addresses", ["01 50", "50 01", "00 00"])
def test_in_step_right_unswapped_and_zero_addresses_are_tolerated(addresses: str) -> None:
    header = b(f"44 04 01 00 {addresses}")
    assert frame(header) == [Received(header)]


def test_an_end_receives_only_messages_of_its_direction() -> None:
    home = b("43 04 01 00 50 01")
    assert frame(home, End.DEVICE) == frame(home, End.NONE) == [Received(home)]
    assert not any(isinstance(event, Received) for event in frame(home + bytes(6), End.HOST))
    assert not any(isinstance(event, Received) for event in frame(HOMED + bytes(6), End.DEVICE))


def test_a_message_of_both_directions_is_received_at_both_ends() -> None:
    for end, addresses in ((End.HOST, "01 50"), (End.DEVICE, "50 01"), (End.NONE, "50 01")):
        disconnect = b("02 00 00 00" + addresses)
        assert frame(STRAY + disconnect, end) == [Garbage(STRAY), Received(disconnect)]


def test_a_shorter_packet_is_bad_length_with_its_declared_length() -> None:
    short = b("81 04 04 00 81 50") + HOMED[:4]
    assert frame(short + STATUS) == [BadLength(short), Received(STATUS)]
    empty = b("81 04 00 00 81 50")
    assert frame(empty + STATUS) == [BadLength(empty), Received(STATUS)]


def test_a_packet_between_two_lengths_is_longer_than_the_shorter_one() -> None:
    between = b("FE 04 06 00 81 50 01 02 03 04 05 06")
    assert frame(between) == [Received(between)]
    short = b("FE 04 03 00 81 50 01 02 03")
    assert frame(short) == [BadLength(short)]


def test_up_to_5_bytes_longer_is_a_message_with_extra_and_is_not_searched() -> None:
    longer = b("81 04 13 00 81 50") + bytes(13) + HOMED
    assert frame(longer + STATUS) == [Received(longer), Received(STATUS)]


def test_6_bytes_longer_without_a_header_inside_is_a_message_with_extra() -> None:
    longer = b("81 04 14 00 81 50") + bytes(20)
    assert frame(longer + STATUS) == [Received(longer), Received(STATUS)]
    newer_status = b("81 04 1C 00 81 50") + bytes(range(28))
    assert frame(newer_status + STATUS) == [Received(newer_status), Received(STATUS)]


def test_6_bytes_longer_with_a_header_inside_is_garbage_up_to_it() -> None:
    damaged = b("81 04 2E 00 81 50") + STATUS[6:]  # 14 became 46
    sent = STATUS + HOMED + STATUS
    assert frame(damaged + sent) == [
        Garbage(damaged),
        Received(STATUS),
        Received(HOMED),
        Received(STATUS),
    ]


def test_a_header_that_fills_the_surplus_exactly_counts() -> None:
    damaged = b("81 04 14 00 81 50") + bytes(14)  # 14 became 20
    assert frame(damaged + HOMED + STATUS) == [
        Garbage(damaged),
        Received(HOMED),
        Received(STATUS),
    ]


def test_a_header_inside_may_begin_in_the_header_that_declares_it() -> None:
    forms = {**TABLE.forms, 0x0450: Forms("begins like an address", IN, False, frozenset({6}))}
    framer = Framer(FramingTable(forms, TABLE.host, TABLE.devices), End.HOST)
    damaged, inside = b("81 04 1C 00 81"), b("50 04 06 00 81 50") + bytes(6)
    events = framer.feed(damaged + inside + bytes(17))
    assert events[:2] == [Garbage(damaged), Received(inside)]


def test_a_header_inside_counts_only_as_a_whole_header() -> None:
    longer = b("81 04 14 00 81 50") + bytes(15) + HOMED[:5]
    assert frame(longer + HOMED[5:] + STATUS)[0] == Received(longer)


def test_a_header_inside_counts_only_if_accepted_out_of_step() -> None:
    zero_addresses = b("44 04 01 00 00 00")
    longer = b("81 04 14 00 81 50") + bytes(14) + zero_addresses
    assert frame(longer) == [Received(longer)]


def test_a_longer_packet_waits_for_the_whole_declared_frame() -> None:
    framer = Framer(TABLE, End.HOST)
    damaged = b("81 04 2E 00 81 50") + STATUS[6:]
    assert framer.feed(damaged + STATUS + HOMED) == []
    assert framer.feed(HOMED) == [
        Garbage(damaged),
        Received(STATUS),
        Received(HOMED),
        Received(HOMED),
    ]


def test_an_unknown_id_is_skipped_by_its_length_with_right_addresses() -> None:
    unknown = b("77 0F 14 00 81 50") + STATUS
    assert frame(unknown + STATUS) == [Unknown(unknown), Received(STATUS)]
    header = b("77 0F 14 00 01 50")
    assert frame(header + STATUS) == [Unknown(header), Received(STATUS)]


@pytest.mark.parametrize("addresses", ["D0 01", "80 00", "81 01"])
def test_an_unknown_id_with_other_addresses_is_not_skipped(addresses: str) -> None:
    header = b("77 0F 14 00" + addresses)
    assert frame(header + STATUS) == [Garbage(header), Received(STATUS)]


def test_an_id_of_the_other_direction_is_not_skipped() -> None:
    home = b("43 04 06 00 81 50")
    assert frame(home + STATUS) == [Garbage(home), Received(STATUS)]


def test_an_id_without_a_layout_is_framed_like_an_unknown_one_and_undocumented() -> None:
    rich = b("81 00 44 00 81 50") + (STATUS * 4)[:68]
    assert frame(rich + STATUS) == [Undocumented(rich), Received(STATUS)]
    wrong = b("81 00 44 00 80 00")
    assert frame(wrong + STATUS) == [Garbage(wrong), Received(STATUS)]


@pytest.mark.parametrize(
    "event",
    [
        Received(STATUS),
        Received(HOMED),
        Received(b("81 04 13 00 81 50") + bytes(19)),
        Received(b("81 04 14 00 81 50") + bytes(20)),
        BadLength(b("81 04 04 00 81 50") + bytes(4)),
        Unknown(b("77 0F 04 00 81 50") + bytes(4)),
        Undocumented(b("81 00 04 00 81 50") + bytes(4)),
    ],
)
def test_a_header_seen_before_has_the_same_meaning(event: Event) -> None:
    assert frame(event.raw * 3) == [event, event, event]


def test_a_longer_packet_is_searched_even_if_its_header_was_seen_before() -> None:
    head = b("81 04 14 00 81 50")
    longer, damaged = head + bytes(20), head + bytes(14)
    assert frame(longer + damaged + HOMED) == [
        Received(longer),
        Garbage(damaged),
        Received(HOMED),
    ]


def test_a_data_frame_that_lost_its_top_bit_does_not_start_a_stored_move() -> None:
    move = b("53 04 06 00 D0 01 01 00 40 0D 03 00")
    lost = move[:4] + b("50") + move[5:]
    stored = b("53 04 01 00 50 01")
    assert frame(move + stored, End.DEVICE) == [Received(move), Received(stored)]
    assert frame(lost + stored, End.DEVICE) == [Garbage(lost), Received(stored)]
    assert frame(STRAY + lost + stored, End.DEVICE) == [Garbage(STRAY + lost), Received(stored)]


def test_a_data_frame_that_programs_send_without_its_top_bit_is_received_in_and_out_of_step() -> (
    None
):
    heads = frozenset({b("53 04 06 00")})
    table = FramingTable(TABLE.forms, TABLE.host, TABLE.devices, heads)
    bare, stored = b("53 04 06 00 50 01 01 00 40 0D 03 00"), b("53 04 01 00 50 01")
    framer = Framer(table, End.DEVICE)
    expected = [Received(bare), Garbage(STRAY), Received(bare), Received(stored)]
    assert framer.feed(bare + STRAY + bare + stored) == expected
    assert framer.feed(bare[:-1]) == []
    assert framer.feed(bare[-1:]) == [Received(bare)]


def test_disconnect_is_accepted_only_with_zero_parameters() -> None:
    right, wrong = b("02 00 00 00 01 50"), b("02 00 00 01 01 50")
    assert frame(right + HOMED) == [Received(right), Received(HOMED)]
    assert frame(wrong + HOMED) == [Garbage(wrong), Received(HOMED)]
    assert frame(STRAY + wrong + HOMED) == [Garbage(STRAY + wrong), Received(HOMED)]


def test_a_form_that_the_message_does_not_have_is_garbage() -> None:
    header_of_data = b("81 04 01 00 01 50")
    assert frame(header_of_data + STATUS) == [Garbage(header_of_data), Received(STATUS)]
    data_of_header = b("44 04 01 00 81 50")
    assert frame(data_of_header + STATUS) == [Garbage(data_of_header), Received(STATUS)]


def test_a_declared_length_over_255_is_garbage() -> None:
    known, unknown = b("81 04 0E 01 81 50"), b("77 0F 00 01 81 50")
    assert frame(known + STATUS) == [Garbage(known), Received(STATUS)]
    assert frame(unknown + STATUS) == [Garbage(unknown), Received(STATUS)]
    longest = b("77 0F FF 00 81 50") + bytes(255)
    assert frame(longest + STATUS) == [Unknown(longest), Received(STATUS)]


# Out of step


def test_anything_else_drops_one_byte_and_is_out_of_step() -> None:
    assert frame(STRAY + STATUS) == [Garbage(STRAY), Received(STATUS)]


@pytest.mark.parametrize("addresses", ["81 50", "D0 01", "80 00"])
def test_out_of_step_a_data_form_needs_tolerated_addresses(addresses: str) -> None:
    status = STATUS[:4] + b(addresses) + STATUS[6:]
    assert frame(STRAY + status) == [Garbage(STRAY), Received(status)]


def test_out_of_step_a_header_form_needs_right_addresses() -> None:
    assert frame(STRAY + HOMED) == [Garbage(STRAY), Received(HOMED)]
    for addresses in ("50 01", "00 00"):
        homed = HOMED[:4] + b(addresses)
        assert frame(STRAY + homed + STATUS) == [Garbage(STRAY + homed), Received(STATUS)]


@pytest.mark.parametrize("addresses", ["01 50", "50 01"])
def test_a_listener_is_in_step_with_both_ends(addresses: str) -> None:
    unknown, disconnect = b(f"77 0F 00 00 {addresses}"), b(f"02 00 00 00 {addresses}")
    assert frame(unknown, End.NONE) == [Unknown(unknown)]
    assert frame(STRAY + disconnect, End.NONE) == [Garbage(STRAY), Received(disconnect)]


def test_a_listener_also_requires_addresses_in_the_direction_of_the_id() -> None:
    unswapped = b("44 04 01 00 50 01")
    events = frame(STRAY + unswapped + HOMED, End.NONE)
    assert events == [Garbage(STRAY + unswapped), Received(HOMED)]


@pytest.mark.parametrize("length", [13, 15, 28])
def test_out_of_step_only_exact_lengths_count(length: int) -> None:
    status = b("81 04") + bytes([length, 0]) + b("81 50") + bytes(length)
    assert frame(STRAY + status + STATUS) == [Garbage(STRAY + status), Received(STATUS)]


def test_out_of_step_neither_unknown_nor_undocumented_frames_count() -> None:
    unknown, rich = b("77 0F 00 00 81 50"), b("81 00 00 00 81 50")
    events = frame(STRAY + unknown + rich + STATUS + unknown + rich)
    assert events == [
        Garbage(STRAY + unknown + rich),
        Received(STATUS),
        Unknown(unknown),
        Undocumented(rich),
    ]


@pytest.mark.parametrize("parameters", ["0A 00", "00 0A", "0A 0A", "FF FF"])
def test_out_of_step_parameters_may_be_any_bytes(parameters: str) -> None:
    header = b(f"44 04 {parameters} 01 50")
    assert frame(STRAY + header) == [Garbage(STRAY), Received(header)]


def test_adjacent_garbage_is_one_event_at_the_end_of_a_feed() -> None:
    framer = Framer(TABLE, End.HOST)
    assert framer.feed(b"\xff" * 20) == [Garbage(b"\xff" * 15)]
    assert framer.feed(b"\xff" * 20) == [Garbage(b"\xff" * 20)]
    assert framer.pending == b"\xff" * 5


def test_join_garbage_joins_only_adjacent_garbage() -> None:
    events = [Garbage(b"a"), Garbage(b"b"), Received(HOMED), Garbage(b"c"), Garbage(b"d")]
    assert join_garbage(events) == [Garbage(b"ab"), Received(HOMED), Garbage(b"cd")]
    assert join_garbage([]) == []


# Abandoning and resetting


def test_an_abandoned_frame_is_garbage_and_the_framer_out_of_step() -> None:
    framer = Framer(TABLE, End.HOST)
    assert framer.feed(HOMED + STATUS[:19]) == [Received(HOMED)]
    assert framer.abandon() == [Garbage(STATUS[:19])]
    assert framer.pending == b""
    longer = b("81 04 0F 00 81 50") + bytes(15)  # accepted in step only
    assert framer.feed(longer + STATUS) == [Garbage(longer), Received(STATUS)]


def test_abandoning_returns_frames_after_a_damaged_length() -> None:
    framer = Framer(TABLE, End.HOST)
    damaged = b("81 04 8E 00 81 50") + STATUS[6:]
    assert framer.feed(damaged + HOMED + STATUS + HOMED[:3]) == []
    assert framer.abandon() == [
        Garbage(damaged),
        Received(HOMED),
        Received(STATUS),
        Garbage(HOMED[:3]),
    ]
    assert framer.pending == b""


def test_abandoning_returns_frames_after_a_header_out_of_step() -> None:
    framer = Framer(TABLE, End.HOST)
    assert framer.feed(STRAY + STATUS[:6] + HOMED) == [Garbage(STRAY)]
    assert framer.abandon() == [Garbage(STATUS[:6]), Received(HOMED)]
    assert framer.pending == b""


def test_an_unknown_frame_is_abandoned_as_a_whole() -> None:
    for id in ("77 0F", "81 00"):
        framer = Framer(TABLE, End.HOST)
        unknown = b(id + "50 00 81 50") + STATUS
        assert framer.feed(unknown) == []
        assert framer.abandon() == [Garbage(unknown)]


def test_abandoning_without_pending_bytes_has_no_effect() -> None:
    framer = Framer(TABLE, End.HOST)
    assert framer.abandon() == []
    zero = b("44 04 01 00 00 00")
    assert framer.feed(zero) == [Received(zero)]


def test_reset_discards_pending_bytes_and_is_in_step() -> None:
    framer = Framer(TABLE, End.HOST)
    framer.feed(STRAY + STATUS[:10])
    framer.reset()
    zero = b("44 04 01 00 00 00")
    assert framer.pending == b""
    assert framer.feed(zero) == [Received(zero)]


def test_feeding_text_raises() -> None:
    with pytest.raises(TypeError, match="a framer takes bytes, not str"):
        Framer(TABLE).feed("81 04")  # type: ignore[arg-type]


def test_all_types_of_bytes_are_accepted_and_copied() -> None:
    for data in (bytearray(STATUS), memoryview(STATUS), memoryview(bytearray(STATUS))):
        framer = Framer(TABLE)
        assert framer.feed(data[:7]) == []
        events = framer.feed(data[7:])
        assert events == [Received(STATUS)]
        assert type(events[0].raw) is bytes


def test_events_are_equal_only_to_their_own_kind() -> None:
    assert Received(HOMED) == Received(HOMED)
    assert Received(HOMED) != Unknown(HOMED)
    assert Received(HOMED) != HOMED
    assert len({Received(HOMED), Received(HOMED), Garbage(HOMED)}) == 2
    assert repr(Garbage(b"\x01\xff")) == "Garbage('01 ff')"


def test_a_pattern_matches_the_bytes_of_an_event() -> None:
    match frame(STRAY + HOMED):
        case [Garbage(stray), Received(raw)]:
            assert (stray, raw) == (STRAY, HOMED)
        case _:
            pytest.fail("no match")


def test_a_table_with_invalid_numbers_is_refused() -> None:
    devices = frozenset({0x50})
    for length in (0, 256):
        forms = {0x0481: Forms("STATUS", IN, False, frozenset({length}))}
        with pytest.raises(ValueError, match="a packet has 1 to 255 bytes"):
            FramingTable(forms, 0x01, devices)
    for id in (-1, 0x10000):
        with pytest.raises(ValueError, match="16 bits"):
            FramingTable({id: Forms("STATUS", IN, True, frozenset())}, 0x01, devices)
    for number in (-1, 0x80, 0x81, 0x100, 0x150):
        with pytest.raises(ValueError, match="not an address"):
            FramingTable({}, 0x01, frozenset({number}))
        with pytest.raises(ValueError, match="not an address"):
            FramingTable({}, number, devices)


def test_a_table_with_the_extreme_numbers_is_accepted() -> None:
    forms = {
        0x0000: Forms("first", IN, True, frozenset({1})),
        0xFFFF: Forms("last", IN, True, frozenset({255})),
    }
    table = FramingTable(forms, 0x00, frozenset({0x7F}))
    framer = Framer(table, End.HOST)
    longest = b("FF FF FF 00 80 7F") + bytes(255)
    assert framer.feed(longest) == [Received(longest)]


def test_an_empty_table_accepts_nothing_known() -> None:
    framer = Framer(FramingTable({}, 0x01, frozenset({0x50})), End.HOST)
    assert framer.feed(STATUS + STRAY * 6 + STATUS) == [
        Unknown(STATUS),
        Garbage((STRAY * 6 + STATUS)[:-5]),
    ]


OVERLAPPING = FramingTable(
    forms={
        0x0453: Forms("either form", OUT, True, frozenset({6})),
        0x0454: Forms("header only", OUT, True, frozenset()),
        0x0455: Forms("data only", OUT, False, frozenset({6})),
        0x0604: Forms("one byte behind them", IN, True, frozenset()),
    },
    host=0x01,
    devices=frozenset({0x50}),
)


@pytest.mark.parametrize(
    ("header", "end"),
    [
        ("53 04 06 01 D0 01", End.NONE),  # declares more than 255 bytes
        ("99 04 06 00 33 01", End.NONE),  # unknown, with addresses that are not right
        ("53 04 06 00 B3 01", End.NONE),  # ours, with addresses that are not tolerated
        ("53 04 06 00 50 01", End.NONE),  # its parameters equal a length
        ("55 04 06 00 50 01", End.NONE),  # has no header form
        ("54 04 06 00 D0 01", End.NONE),  # has no data form
        ("53 04 06 00 D0 01", End.HOST),  # is not received at this end
    ],
)
def test_garbage_in_step_is_one_byte(header: str, end: End) -> None:
    """A frame that begins with the second byte is found."""
    framer = Framer(OVERLAPPING, end)
    raw = b(f"{header} 50")
    assert framer.feed(raw) == [Garbage(raw[:1]), Received(raw[1:])]
    assert framer.pending == b""


# For any bytes

IDS = st.sampled_from(sorted([*TABLE.forms, 0x0F77, 0x0480])).map(lambda i: i.to_bytes(2, "little"))
WORDS = st.sampled_from([0, 1, 4, 6, 12, 14, 15, 20, 28, 40, 84, 255, 256]).map(
    lambda w: w.to_bytes(2, "little")
)
ADDRESSES = st.sampled_from(["0150", "8150", "5001", "d001", "0000", "8000", "8101"]).map(b)
HEADERS = st.tuples(IDS, WORDS, ADDRESSES).map(b"".join)
STREAMS = st.lists(
    st.one_of(
        HEADERS,
        st.sampled_from([STATUS, HOMED, b("53 04 06 00 D0 01 01 00 40 0D 03 00")]),
        st.binary(max_size=20),
        st.integers(0, 90).map(bytes),
    ),
    max_size=25,
).map(b"".join)
ENDS = st.sampled_from(End)


def cut(data: bytes, cuts: list[int]) -> list[bytes]:
    places = sorted({0, len(data), *(c % (len(data) + 1) for c in cuts)})
    return [data[i:j] for i, j in pairwise(places)]


@given(STREAMS, ENDS, st.lists(st.integers(0, 3000), max_size=30))
def test_chunking_does_not_matter(data: bytes, end: End, cuts: list[int]) -> None:
    whole, single, random_ = Framer(TABLE, end), Framer(TABLE, end), Framer(TABLE, end)
    expected = join_garbage(whole.feed(data))
    bytewise = [e for i in range(len(data)) for e in single.feed(data[i : i + 1])]
    in_pieces = [e for piece in cut(data, cuts) for e in random_.feed(piece)]
    assert join_garbage(bytewise) == expected
    assert join_garbage(in_pieces) == expected
    assert single.pending == random_.pending == whole.pending
    assert join_garbage(single.abandon()) == join_garbage(whole.abandon())


@given(STREAMS, ENDS, st.lists(st.integers(0, 3000), max_size=10), st.sets(st.integers(0, 10)))
def test_no_byte_is_lost_and_little_is_pending(
    data: bytes, end: End, cuts: list[int], silences: set[int]
) -> None:
    framer = Framer(TABLE, end)
    given_out, fed = b"", b""
    for i, piece in enumerate(cut(data, cuts)):
        events = framer.feed(piece)
        fed += piece
        assert len(framer.pending) < MAXIMAL_FRAME
        if i in silences:
            events += framer.abandon()
            assert framer.pending == b""
        given_out += b"".join(event.raw for event in events)
        assert given_out + framer.pending == fed


@given(STREAMS, ENDS)
def test_a_feed_has_no_adjacent_garbage_and_no_empty_event(data: bytes, end: End) -> None:
    framer = Framer(TABLE, end)
    for events in (framer.feed(data), framer.abandon()):
        assert join_garbage(events) == events
        assert all(event.raw for event in events)


@given(STREAMS, ENDS)
def test_events_match_their_bytes(data: bytes, end: End) -> None:
    for event in Framer(TABLE, end).feed(data):
        if isinstance(event, Garbage):
            continue
        assert isinstance(event, (Received, Undocumented, Unknown, BadLength))
        length = event.raw[2] | event.raw[3] << 8 if event.raw[4] & 0x80 else 0
        assert len(event.raw) == 6 + length
        assert isinstance(event, Unknown) == (event.id not in TABLE.forms)
        assert isinstance(event, Undocumented) == (event.id == 0x0081)


FLOODS = {
    "status": STATUS,
    "zeros": bytes(20),
    "half headers": b("81 04 0E 00 81 FF"),
    "endless lengths": b("77 0F FF 01 81 50"),
    "longer packets": b("81 04 FF 00 81 50") + bytes(249),
    "nested longest packets": b("81 04 FF 00 81 50"),
    "candidates at every byte": b("04 04 00 01 50"),
}


@pytest.mark.parametrize("flood", FLOODS)
@pytest.mark.parametrize("size", [1, 4096, 1 << 30])
def test_a_flood_leaves_less_than_one_frame_pending(flood: str, size: int) -> None:
    data = FLOODS[flood] * (20_000 // len(FLOODS[flood]))
    framer = Framer(TABLE, End.NONE)
    for i in range(0, len(data), size):
        framer.feed(data[i : i + size])
        assert len(framer.pending) < MAXIMAL_FRAME


def test_remembered_headers_are_bounded() -> None:
    framer = Framer(TABLE, End.HOST)
    for word in range(5000):
        framer.feed(b("12 02") + word.to_bytes(2, "little") + b("01 50"))
    assert len(framer._sizes) <= 1024


# A small part of the experiment


@pytest.fixture(scope="module")
def experiment() -> ModuleType:
    return import_program(ROOT / "benchmarks" / "framing_experiment.py")


@pytest.mark.parametrize("title", ["ours, at the host", "ours, at the device"])
def test_one_damaged_byte_costs_at_most_two_frames_and_invents_none(
    experiment: ModuleType, title: str
) -> None:
    table = experiment.SMALL_TABLE
    (line,) = (line for line in experiment.lines(table) if line.title == title)
    for counts in experiment.experiment(line, table, runs=2, seed=7).values():
        assert counts.worst_missing <= 2
        assert counts.invented == 0


def test_one_damaged_byte_before_a_silence_costs_at_most_three_frames(
    experiment: ModuleType,
) -> None:
    table = experiment.SMALL_TABLE
    line = experiment.lines(table, silences=True)[1]
    for counts in experiment.experiment(line, table, runs=2, seed=7, silences=True).values():
        assert counts.worst_missing <= 3
        assert counts.invented == 0
