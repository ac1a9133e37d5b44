"""Quirks: each changes only the messages that it describes."""

from __future__ import annotations

import pytest

from stagewire_apt import messages as m
from stagewire_virtual.thorlabs_apt.quirks import QUIRKS

REQUESTS = [m.HwReqInfo(), m.MotMoveStop(1, 1), m.PzReqMaxTravel(1)]


def told(host, unit, *quirks):
    """Return the answers of a unit to a fixed list of requests, by message."""
    far = host(unit, quirks=frozenset(quirks), answer_unsupported=True)
    status = m.MotReqStatusUpdate(1) if unit == "BSC001" else m.MotReqDcStatusUpdate(1)
    for request in [*REQUESTS, status]:
        far.say(request)
    raw = far.heard_raw()
    assert len(raw) == 4
    return dict(zip(("info", "stopped", "response", "status"), raw, strict=True))


CHANGED = {
    "header_only_completion": {"stopped"},
    "long_status": {"status"},
    "serial_number_of_another_model": {"info"},
    "fault_codes_in_response": {"response"},
    "rich_responses": {"response"},
    "unswapped_addresses": {"info", "stopped", "response", "status"},
    "zero_addresses": {"info", "stopped", "response", "status"},
    "clockwise_is_negative": set(),  # concerns only motion and limits: test_virtual_clockwise.py
    "zero_motion_parameters": set(),  # concerns parameters: test_virtual_stage_report.py
}


def test_every_quirk_is_tested_here():
    assert set(CHANGED) == set(QUIRKS)


@pytest.mark.parametrize("unit", ["TDC001", "BSC001"])
@pytest.mark.parametrize("quirk", CHANGED)
def test_a_quirk_changes_only_the_messages_it_describes(unit, quirk, host):
    plain, odd = told(host, unit), told(host, unit, quirk)
    assert {name for name in plain if plain[name] != odd[name]} == CHANGED[quirk]


@pytest.mark.parametrize(
    ("quirk", "which", "expected"),
    [
        ("header_only_completion", "stopped", "66 04 01 00 01 50"),
        ("fault_codes_in_response", "response", "80 00 01 00 01 50"),
        ("unswapped_addresses", "response", "80 00 00 00 50 01"),
        ("zero_addresses", "response", "80 00 00 00 00 00"),
    ],
)
def test_quirks_change_the_bytes_of_short_messages(quirk, which, expected, host):
    assert told(host, "TDC001", quirk)[which] == bytes.fromhex(expected)


@pytest.mark.parametrize("unit", ["TDC001", "BSC001"])
def test_a_long_status_begins_as_a_short_one(unit, host):
    plain, odd = told(host, unit)["status"], told(host, unit, "long_status")["status"]
    assert len(odd) == 6 + 28
    assert odd[2:4] == b"\x1c\x00"
    assert odd[6:20] == plain[6:]
    assert odd[20:] == b"\x01\x00" + bytes(12)


def test_packets_keep_their_flag_whatever_the_addresses(host):
    assert told(host, "TDC001", "zero_addresses")["status"][4:6] == b"\x80\x00"
    assert told(host, "TDC001", "unswapped_addresses")["status"][4:6] == b"\xd0\x01"


@pytest.mark.parametrize(
    ("unit", "prefixes"),
    [
        ("BSC001", (20, 21)),
        ("BMS001", (25, 26)),
        ("TDC001", (83, 84)),
    ],  # the next prefix of the registry
)
def test_the_serial_number_has_the_prefix_of_the_next_unit(unit, prefixes, host):
    def number(*quirks):
        [info] = host(unit, quirks=frozenset(quirks)).ask(m.HwReqInfo())
        return divmod(info.serial_number, 1_000_000)

    (own, rest), (other, same) = number(), number("serial_number_of_another_model")
    assert (own, other) == prefixes
    assert rest == same


def test_completions_of_moves_are_also_shortened(host):
    far = host("BSC001", quirks=frozenset({"header_only_completion"}))
    far.say(m.MotMoveRelative(1, 10))
    far.clock.advance(30)
    assert far.heard_raw() == [bytes.fromhex("64 04 01 00 01 50")]


@pytest.mark.parametrize(
    ("addresses", "expected"),
    [("zero_addresses", "80 00"), ("unswapped_addresses", "d0 01")],
)
def test_quirks_can_be_combined(addresses, expected, host):
    raw = told(host, "TDC001", "long_status", addresses)["status"]
    assert (len(raw), raw[4:6]) == (34, bytes.fromhex(expected))
