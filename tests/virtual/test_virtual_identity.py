"""HW_GET_INFO, the bay of a T-Cube, and the flashing of a front panel."""

from __future__ import annotations

import pytest
from virtual_apt_host import BAY, MOTHERBOARD, USB, host_of

from stagewire_apt import PROTOCOL
from stagewire_apt import messages as m
from stagewire_virtual.errors import BadOptionError
from stagewire_virtual.thorlabs_apt.controller import IDENTIFYING
from stagewire_virtual.units import units_of

CARD, BOARD = 44, 45


@pytest.mark.parametrize(
    ("unit", "address", "prefix", "model", "type_", "channels"),
    [
        ("BSC001", USB, 20, "BSC001", 11, 1),
        ("BSC002", USB, 30, "BSC002", 13, 2),
        ("TDC001", USB, 83, "TDC001", 31, 1),
        ("TPZ001", USB, 81, "TPZ001", 0, 1),  # a prefix that page 7 does not have
        ("BBD102", MOTHERBOARD, 73, "BBD102", BOARD, 2),
        ("BBD102", BAY + 1, 94, "ION001 ", CARD, 1),  # the example of page 22
        ("BBD202", MOTHERBOARD, 73, "BBD202", BOARD, 2),  # taken as the BBD102
        ("BBD202", BAY, 94, "ION001 ", CARD, 1),
        ("BBD101", MOTHERBOARD, 73, "BBD101", BOARD, 1),  # page 7: a card slot system, too
        ("BBD101", BAY, 94, "ION001 ", CARD, 1),
        ("BSC102", MOTHERBOARD, 70, "BSC102", BOARD, 2),
        ("BSC103", BAY, 70, "BSC103", 21, 1),
        ("MST601", BAY, 50, "MST601", 26, 2),
        ("MST601", MOTHERBOARD, 99, "RACK", BOARD, 1),
        ("BPC202", MOTHERBOARD, 99, "BPC202", BOARD, 2),  # none is known
    ],
)
def test_a_unit_tells_what_it_is(unit, address, prefix, model, type_, channels):
    [info] = host_of(unit).ask(m.HwReqInfo(), address)
    assert divmod(info.serial_number, 1_000_000)[0] == prefix
    assert (info.model_number, info.type, info.nchs) == (model, type_, channels)


@pytest.mark.parametrize("unit", units_of(PROTOCOL))
def test_every_serial_number_has_eight_digits_and_no_two_of_a_rack_are_alike(unit):
    far = host_of(unit)
    numbers = []
    for address in sorted(PROTOCOL.devices):
        numbers += [info.serial_number for info in far.ask(m.HwReqInfo(), address)]
    assert all(len(str(number)) == 8 for number in numbers)
    one = units_of(PROTOCOL)[unit].facts["address"] == "generic_usb"
    assert len(set(numbers)) == (1 if one else len(numbers))


def test_the_seed_decides_the_serial_number():
    def number(**options):
        return host_of("TDC001", **options).ask(m.HwReqInfo())[0].serial_number

    assert number(seed=1) == number(seed=1)
    assert number(seed=1) != number(seed=2)
    assert number(seed=1, serial_number=83_000_042) == 83_000_042


@pytest.mark.parametrize("number", [0, -1, 2**31])
def test_a_serial_number_that_does_not_fit_is_refused(number):
    with pytest.raises(BadOptionError, match=f"serial number {number} .*such as 83000001"):
        host_of("TDC001", serial_number=number)


def test_a_t_cube_is_off_its_hub():
    assert host_of("TST001").ask(m.HubReqBayUsed()) == [m.HubGetBayUsed(0xFF)]


def test_who_is_to_identify_itself_shows_it_for_a_while():
    far = host_of("BBD102")
    far.say(m.ModIdentify(), BAY + 1)

    def shows():
        return [row.part for row in far.instrument.rows() if "identifying" in row.state]

    far.clock.advance(IDENTIFYING / 1e9 - 0.001)
    assert shows() == ["bay 1, channel 1"]
    far.say(m.ModIdentify(), MOTHERBOARD)
    assert shows() == ["motherboard", "bay 1, channel 1"]
    far.clock.advance(0.001)
    assert shows() == ["motherboard"]
    far.instrument.power_cycle()
    assert shows() == []
