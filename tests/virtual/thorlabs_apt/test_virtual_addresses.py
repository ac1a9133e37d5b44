"""The addresses of units, the sources of answers, and the reaction to unsupported messages."""

from __future__ import annotations

import pytest
from apt_host import BAY, MOTHERBOARD, USB, host_of
from hypothesis import given, settings
from hypothesis import strategies as st

from stagewire_apt import messages as m
from stagewire_virtual.framings.framing import PATIENCE

T_CUBES = ("TST001", "TDC001", "TSC001", "TPZ001", "TSG001")
ALL = (USB, MOTHERBOARD, *range(BAY, BAY + 10))


@pytest.mark.parametrize(
    ("unit", "addresses"),
    [
        *((cube, {USB, MOTHERBOARD, BAY}) for cube in T_CUBES),
        ("BSC001", {USB}),
        ("OST001", {USB}),
        ("BPC301", {USB}),
        ("BBD101", {MOTHERBOARD, BAY}),
        ("BBD102", {MOTHERBOARD, BAY, BAY + 1}),
        ("BSC103", {MOTHERBOARD, BAY, BAY + 1, BAY + 2}),
        ("MST601", {MOTHERBOARD, BAY}),
        ("MPZ601", {MOTHERBOARD, BAY}),
    ],
)
def test_a_unit_answers_from_the_address_of_the_request(unit, addresses, host):
    far = host(unit)
    for address in ALL:
        far.say(m.HwReqInfo(), address)
    assert [(frame.source, frame.dest) for frame in far.heard()] == [
        (address, 1) for address in ALL if address in addresses
    ]


def test_updates_and_completions_come_from_the_address_that_caused_them(host):
    far = host("TDC001")
    far.say(m.HwStartUpdateMsgs(10), BAY)
    far.say(m.MotMoveStop(1, 1), MOTHERBOARD)
    far.clock.advance(0.1)
    sources = {type(frame.message): frame.source for frame in far.heard()}
    assert sources == {m.MotMoveStoppedDc: MOTHERBOARD, m.MotGetDcStatusUpdate: BAY}


NOT_FOR_A_TDC001 = {
    "a message of another unit": ("40 06 01 01 50 01", "it does not accept PZ_SET_POSCONTROLMODE"),
    "a packet of another unit": (
        "43 06 04 00 d0 01 01 00 00 00",
        "it does not accept PZ_SET_OUTPUTVOLTS",
    ),
    "an unknown id": ("ff 0f 00 00 50 01", "0x0fff is an unknown message id"),
    "a packet with an unknown id": (
        "ff 0f 03 00 d0 01 01 02 03",
        "0x0fff is an unknown message id",
    ),
    "a packet too short": (
        "13 04 04 00 d0 01 01 00 00 00",
        "0x0413 has a packet that is too short",
    ),
    "a missing channel": ("14 04 02 00 50 01", "unknown channel 2"),
    "both channels of a unit with one": ("14 04 03 00 50 01", "unknown channel 3"),
    "a value out of its table": (
        "10 02 01 03 50 01",
        "MOD_SET_CHANENABLESTATE: enable_state must be one of 1, 2, not 3",
    ),
}


@pytest.mark.parametrize(("raw", "why"), NOT_FOR_A_TDC001.values(), ids=NOT_FOR_A_TDC001)
def test_unsupported_requests_get_silence_or_a_response(raw, why, host):
    for answers in (False, True):
        far = host("TDC001", answer_unsupported=answers)
        far.instrument.receive(bytes.fromhex(raw))
        assert far.messages() == ([m.HwResponse()] if answers else [])
        assert far.refusals == [f"TDC001 at 0x50: {why}"]
        assert far.ask(m.ModReqChanEnableState(1)) == [m.ModGetChanEnableState(1, 1)]


def test_a_frame_to_an_unused_address_is_reported(host):
    far = host("BBD101")
    far.say(m.HwReqInfo(), USB)
    assert far.heard() == []
    assert far.refusals == ["BBD101 does not use address 0x50 (addresses: 0x11, 0x21)"]


@pytest.mark.parametrize("raw", ["00", "13 04 50 50 50 50", "11 00 00 00 22 01"])
def test_garbage_and_frames_for_other_addresses_get_no_answer(raw, host):
    far = host("TDC001", answer_unsupported=True)
    far.instrument.receive(bytes.fromhex(raw))
    assert far.ask(m.HwReqInfo())[0].layout.message == "HW_GET_INFO"
    assert far.heard() == []


def test_a_longer_packet_of_later_issues_is_accepted(host):
    far = host("TDC001")
    far.instrument.receive(
        bytes.fromhex("13 04 10 00 d0 01 01 00 00 00 00 00 07 00 00 00 09 00 00 00 00 00")
    )
    assert far.ask(m.MotReqVelParams(1)) == [m.MotGetVelParams(1, 0, 7, 9)]


def test_the_rest_of_a_frame_may_arrive_within_a_second(host):
    far = host("TDC001")
    frame = bytes.fromhex("13 04 0e 00 d0 01 01 00 00 00 00 00 07 00 00 00 09 00 00 00")
    patience = PATIENCE / 1e9
    for part in (frame[:9], frame[9:15], frame[15:]):
        far.clock.advance(patience * 0.9)
        far.instrument.receive(part)
    assert far.ask(m.MotReqVelParams(1)) == [m.MotGetVelParams(1, 0, 7, 9)]

    far.instrument.receive(frame[:4] + b"\xff")  # the header is damaged
    far.instrument.receive(frame[:10])
    far.say(m.HwReqInfo())
    assert far.heard() == []
    far.clock.advance(patience)
    assert [type(message) for message in far.messages()] == [m.HwGetInfo]


def test_single_bytes_set_only_one_timer(host):
    far = host("TDC001")
    for _ in range(1000):
        far.instrument.receive(b"\x13")
    assert len(far.clock._due) <= 1


@settings(max_examples=30, deadline=None)
@given(st.lists(st.integers(1, 30), min_size=1, max_size=40))
def test_the_answers_do_not_depend_on_chunks(sizes):
    stream = bytes.fromhex(
        "05 00 00 00 50 01 13 04 0e 00 d0 01 01 00 00 00 00 00 07 00 00 00 09 00 00 00 00 00"
        "14 04 01 00 50 01 66 66 11 02 01 00 21 01 05 00 00 00 11 01"
    )
    whole, cut = host_of("TDC001"), host_of("TDC001")
    whole.instrument.receive(stream)
    rest = stream
    for size in sizes:
        cut.instrument.receive(rest[:size])
        rest = rest[size:]
    cut.instrument.receive(rest)
    expected = whole.heard_raw()
    assert len(expected) == 4
    assert cut.heard_raw() == expected
