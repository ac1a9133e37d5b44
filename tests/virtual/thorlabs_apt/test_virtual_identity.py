"""HW_GET_INFO, the bay of a T-Cube, and the flashing front panel."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import pytest
from apt_host import BAY, MOTHERBOARD, USB, host_of

import stagewire_virtual as virtual
from stagewire import FramedMessage
from stagewire.links import open_link
from stagewire_apt import PROTOCOL
from stagewire_apt import messages as m
from stagewire_cli.virtual_units import of_names
from stagewire_virtual.bench import load_bench, make_bench
from stagewire_virtual.clock import SteppedClock
from stagewire_virtual.errors import BadOptionError, BenchError
from stagewire_virtual.factory import why_not
from stagewire_virtual.instrument import units_of
from stagewire_virtual.serving.link import Observer
from stagewire_virtual.thorlabs_apt.controller import IDENTIFYING

CARD, BOARD = 44, 45
UNITS = {name: unit for name, unit in units_of(PROTOCOL).items() if not why_not(unit)}


@pytest.mark.parametrize(
    ("unit", "address", "prefix", "model", "type_", "channels"),
    [
        ("BSC001", USB, 20, "BSC001", 11, 1),
        ("BSC002", USB, 30, "BSC002", 13, 2),
        ("TDC001", USB, 83, "TDC001", 31, 1),
        ("TPZ001", USB, 81, "TPZ001", 0, 1),  # page 7 does not have this prefix
        ("BBD102", MOTHERBOARD, 73, "BBD102", BOARD, 2),
        ("BBD102", BAY + 1, 94, "ION001 ", CARD, 1),  # the example of page 22
        ("BBD202", MOTHERBOARD, 73, "BBD202", BOARD, 2),  # the prefix of the BBD102
        ("BBD202", BAY, 94, "ION001 ", CARD, 1),
        ("BBD101", MOTHERBOARD, 73, "BBD101", BOARD, 1),  # page 7: also a card slot system
        ("BBD101", BAY, 94, "ION001 ", CARD, 1),
        ("BSC102", MOTHERBOARD, 70, "BSC102", BOARD, 2),
        ("BSC103", BAY, 90, "BSC103", 21, 1),  # cards of a BSC103, see decisions.yaml
        ("MST601", BAY, 50, "MST601", 26, 2),
        ("MST601", MOTHERBOARD, 93, "RACK", BOARD, 1),
        ("BPC202", MOTHERBOARD, 71, "BPC202", BOARD, 2),  # of the BPC203, a unit of the same family
    ],
)
def test_a_unit_reports_its_hardware_information(unit, address, prefix, model, type_, channels):
    [info] = host_of(unit).ask(m.HwReqInfo(), address)
    assert divmod(info.serial_number, 1_000_000)[0] == prefix
    assert (info.model_number, info.type, info.nchs) == (model, type_, channels)


@pytest.mark.parametrize("unit", UNITS)
def test_serial_numbers_have_eight_digits_and_differ_within_a_rack(unit):
    far = host_of(unit)
    numbers = []
    for address in sorted(PROTOCOL.devices):
        numbers += [info.serial_number for info in far.ask(m.HwReqInfo(), address)]
    digits = units_of(PROTOCOL)[unit].facts.get(
        "serial_digits", 8
    )  # 9 after a prefix of three digits
    assert all(len(str(number)) in (8, digits) for number in numbers)
    assert len(str(max(numbers))) == digits
    one = units_of(PROTOCOL)[unit].facts["address"] == "generic_usb"
    assert len(set(numbers)) == (1 if one else len(numbers))


def test_the_seed_determines_the_serial_number():
    def number(**options):
        return host_of("TDC001", **options).ask(m.HwReqInfo())[0].serial_number

    assert number(seed=1) == number(seed=1)
    assert number(seed=1) != number(seed=2)
    assert number(seed=1, serial_number=83_000_042) == 83_000_042


@pytest.mark.parametrize("number", [0, -1, 2**31])
def test_an_invalid_serial_number_is_refused(number):
    with pytest.raises(BadOptionError, match=f"serial number must be .*83000001, not {number}"):
        host_of("TDC001", serial_number=number)


# The identity that a client requires

KDC101 = {"model": "KDC101", "serial_number": 27_000_001, "hardware_type": 16, "stage_id": 7}
"""The identity of a KDC101 with an MTS25-Z8, for a TDC001."""

ASK = m.HwReqInfo()


def payload_of(frame: bytes) -> bytes:
    assert (frame[:4], len(frame)) == (bytes.fromhex("06 00 54 00"), 90)
    return frame[6:]


def said_by(instrument: Any, address: int) -> bytes:
    """Return the hardware information of an instrument as bytes."""
    said: list[bytes] = []
    instrument.on_send = said.append
    instrument.receive(ASK.pack(address, 0x01))
    return payload_of(b"".join(said))


def told_in_python(unit: str, address: int, tmp_path: Path) -> bytes:
    with getattr(virtual, unit)(**KDC101) as controller:
        return said_by(controller.instrument, address)


def told_in_a_url(unit: str, address: int, tmp_path: Path) -> bytes:
    options = "&".join(f"{name}={value}" for name, value in KDC101.items())
    link = open_link(f"virtual://{unit}?{options}")
    try:
        link.write(ASK.pack(address, 0x01))
        frame = b""
        while len(frame) < 90:
            frame += link.read(5)
        return payload_of(frame)
    finally:
        link.close()


def told_in_a_bench(unit: str, address: int, tmp_path: Path) -> bytes:
    path = tmp_path / "bench.toml"
    lines = [f"{name} = {value!r}" for name, value in KDC101.items()]
    path.write_text("\n".join(["[[unit]]", f"name = '{unit}'", *lines]))
    (made,) = load_bench(path).units
    return said_by(made.blueprint.make(SteppedClock()), address)


def told_on_the_command_line(unit: str, address: int, tmp_path: Path) -> bytes:
    (make,) = of_names([unit], None, False, None, {**KDC101, "seed": None})
    return said_by(make(SteppedClock(), Observer()).instrument, address)


@pytest.mark.parametrize(
    "told", [told_in_python, told_in_a_url, told_in_a_bench, told_on_the_command_line]
)
@pytest.mark.parametrize(
    ("unit", "address", "channels"),
    [
        ("TDC001", USB, 1),
        ("TPZ001", USB, 1),
        ("BBD102", MOTHERBOARD, 2),
        ("MST601", MOTHERBOARD, 1),
    ],
)
def test_a_controller_reports_the_given_identity(
    told: Any, unit: str, address: int, channels: int, tmp_path: Path
) -> None:
    payload = told(unit, address, tmp_path)
    assert payload[:18] == struct.pack("<l8sHBBBB", 27_000_001, b"KDC101", 16, 0, 0, 1, 0)
    assert payload[66:] == bytes(10) + bytes((7, 0)) + bytes(4) + bytes((channels, 0))


@pytest.mark.parametrize("unit", UNITS)
def test_every_unit_accepts_an_identity_but_its_bays_keep_their_own(unit: str) -> None:
    def all_said(**options: Any) -> dict[int, FramedMessage]:
        far = host_of(unit, **options)
        return {
            address: info for address in sorted(PROTOCOL.devices) for info in far.ask(ASK, address)
        }

    plain, told = all_said(), all_said(**KDC101)
    stand_alone = units_of(PROTOCOL)[unit].facts["address"] == "generic_usb"
    own = set(plain) if stand_alone else {MOTHERBOARD}
    assert {address for address in plain if plain[address] != told[address]} == own
    for address in own:
        assert told[address] == plain[address].replace(
            model_number="KDC101",
            serial_number=27_000_001,
            type=16,
            stage_id=7,
        )


MODULES = {"MST601", "MPZ601"}


def test_the_identity_of_a_rack_is_that_of_its_motherboard() -> None:
    with virtual.rack("MST601", None, "MPZ601", **KDC101) as rack:
        assert said_by(rack.instrument, MOTHERBOARD)[4:14] == b"KDC101\0\0\x10\0"
        assert said_by(rack.instrument, BAY)[4:12] == b"MST601\0\0"
        assert said_by(rack.instrument, BAY + 2)[4:12] == b"MPZ601\0\0"


def test_the_largest_identity_fits() -> None:
    with virtual.TDC001(
        model="A2345678", serial_number=2**31 - 1, hardware_type=0xFFFF, stage_id=0xFFFF
    ) as tdc:
        payload = said_by(tdc.instrument, USB)
    assert payload[:14] == bytes.fromhex("ff ff ff 7f") + b"A2345678" + b"\xff\xff"
    assert payload[66:] == bytes(10) + b"\xff\xff" + bytes(4) + b"\1\0"


WRONG = [
    ("model", "", "model must have 1 to 8 printable ASCII characters, such as .*, not ''"),
    ("model", "KDC101-LONG", "model must have 1 to 8 .*, not 'KDC101-LONG'"),
    ("model", "KDC101é", "printable ASCII"),
    ("model", "KDC\n101", "printable ASCII"),
    ("serial_number", 2**31, "serial number must be from 1 to 2147483647, .*, not 2147483648"),
    ("serial_number", 0, "serial number must be from 1 to .*, not 0"),
    ("hardware_type", -1, "hardware type must be from 0 to 65535, not -1"),
    ("hardware_type", 65536, "hardware type must be from 0 to 65535, not 65536"),
    ("stage_id", -1, "stage id must be from 0 to 65535, not -1"),
    ("stage_id", 65536, "stage id must be from 0 to 65535, not 65536"),
]


@pytest.mark.parametrize(("name", "value", "says"), WRONG)
@pytest.mark.parametrize("unit", ["TDC001", "BBD102"])
def test_an_invalid_identity_is_refused(name: str, value: Any, says: str, unit: str) -> None:
    with pytest.raises(BadOptionError, match=says):
        getattr(virtual, unit)(**{name: value})
    with pytest.raises(BenchError, match=rf"unit 1 \({unit}\), key {name}: .*{says}"):
        make_bench([{"name": unit, name: value}])


@pytest.mark.parametrize(
    ("name", "value"), [("model", 101), ("hardware_type", "16"), ("stage_id", True)]
)
def test_an_identity_of_another_type_is_refused(name: str, value: Any) -> None:
    with pytest.raises(BadOptionError, match=f"{name}: expected "):
        virtual.TDC001(**{name: value})
    with pytest.raises(BenchError, match=f"key {name}: expected "):
        make_bench([{"name": "TDC001", name: value}])


def test_units_on_one_command_line_get_consecutive_serial_numbers() -> None:
    makers = of_names(["TDC001"] * 3, None, False, None, {"serial_number": 27_000_001})
    numbers = [
        int.from_bytes(said_by(make(SteppedClock(), Observer()).instrument, USB)[:4], "little")
        for make in makers
    ]
    assert numbers == [27_000_001, 27_000_002, 27_000_003]


def test_a_t_cube_is_not_in_a_hub():
    assert host_of("TST001").ask(m.HubReqBayUsed()) == [m.HubGetBayUsed(0xFF)]


def test_identify_is_shown_for_a_while():
    far = host_of("BBD102")
    far.say(m.ModIdentify(), BAY + 1)

    def shows():
        return [row.part for row in far.instrument.rows() if "identifying" in row.state]

    far.clock.advance(IDENTIFYING / 1e9 - 0.001)
    assert shows() == ["bay 2, channel 1"]
    far.say(m.ModIdentify(), MOTHERBOARD)
    assert shows() == ["motherboard", "bay 2, channel 1"]
    far.clock.advance(0.001)
    assert shows() == ["motherboard"]
    far.instrument.power_cycle()
    assert shows() == []
