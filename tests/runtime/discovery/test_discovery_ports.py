"""Ports are identified by the data of the operating system, without opening them."""

from __future__ import annotations

from pathlib import Path

import pytest

import stagewire
from serial_ports import linux, macos, port, show, windows
from stagewire._discovery.ports import plug_of, port_of, serial_ports
from stagewire.discovery import by_name, by_serial_number
from stagewire.protocols import load_protocol

APT = load_protocol("thorlabs_apt")


@pytest.fixture(autouse=True)
def nothing_is_opened(monkeypatch: pytest.MonkeyPatch) -> None:
    import serial

    def refuse(*_: object, **__: object) -> None:
        pytest.fail("a port was opened")

    monkeypatch.setattr(serial, "serial_for_url", refuse)
    show(monkeypatch)


@pytest.mark.parametrize(
    "info",
    [
        linux("/dev/ttyUSB0", "83828433"),
        windows("COM3", "83828433"),
        macos("/dev/cu.usbserial-83828433", "83828433"),
    ],
    ids=["linux", "windows", "macos"],
)
def test_a_unit_is_identified_by_its_plug_on_every_system(
    monkeypatch: pytest.MonkeyPatch, info: object
) -> None:
    show(monkeypatch, info)
    [found] = stagewire.discover()
    assert (found.unit, found.serial_number, found.url) == ("TDC001", "83828433", info.device)
    assert found.is_controller
    assert found.what == "TDC001: One-channel T-Cube DC servo driver"


def test_a_unit_newer_than_the_document_is_described_as_newer() -> None:
    text = "K10CR2: not in Issue 3; uses the messages of K10CR1, which may differ"
    assert str(by_name(APT, "K10CR2")) == text


@pytest.mark.parametrize(
    ("serial_number", "unit", "title"),
    [
        ("27250000", "KDC101", "One-channel K-Cube DC servo driver"),
        ("74250000", "KIM001", "One-channel K-Cube inertial motor controller"),
    ],
)
def test_a_unit_of_a_later_document_is_described_like_any_other(
    serial_number: str, unit: str, title: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    show(monkeypatch, linux("/dev/ttyUSB0", serial_number))
    [found] = stagewire.discover()
    assert found.unit == unit
    assert found.what == f"{unit}: {title}"


def test_units_that_share_a_prefix_are_both_named(monkeypatch: pytest.MonkeyPatch) -> None:
    show(monkeypatch, windows("COM7", "73000123"))
    [found] = stagewire.discover()
    assert found.unit is None
    assert "BBD102 or BBD103" in found.what


@pytest.mark.parametrize(
    ("number", "names"),
    [
        ("26000001", ["KST101", "KST201"]),
        ("40000001", ["BSC101", "BSC201"]),
        ("45000001", ["LTS150", "LTS300"]),
        ("50000001", ["MST601", "MST602"]),
        ("55000001", ["K10CR1", "K10CR2"]),
        ("70000001", ["BSC103", "BSC203"]),
        ("71000001", ["BPC103", "BPC203", "BPC303"]),
        ("83000001", ["TDC001"]),
    ],
)
def test_all_units_that_share_a_prefix_are_named(number: str, names: list[str]) -> None:
    assert sorted(known.name for known in by_serial_number(APT, number)) == names


def test_a_prefix_of_three_digits_belongs_to_serial_numbers_of_nine_digits() -> None:
    assert [known.name for known in by_serial_number(APT, "103387864")] == [
        "BBD301", "BBD302", "BBD303",
    ]  # fmt: skip
    assert by_serial_number(APT, "10338786") == []


@pytest.mark.parametrize(
    "number", ["", "8", "A50285BI", "12000001", "83828433A", "8382843", "٨٣828433"]
)
def test_other_serial_numbers_match_no_unit(number: str) -> None:
    assert by_serial_number(APT, number) == []


def test_a_controller_with_an_unknown_prefix_is_still_a_controller(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    show(monkeypatch, linux("/dev/ttyUSB0", "12000001"))
    [found] = stagewire.discover()
    assert found.is_controller
    assert found.unit is None
    assert "controller with an unknown serial number (12000001)" in found.what


def test_unknown_ports_are_listed_after_the_controllers(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    adapter = linux("/dev/ttyUSB0", "83828433", pid=0x6001, maker="FTDI")
    show(monkeypatch, port("/dev/ttyS0"), adapter, linux("/dev/ttyUSB1", "80000001"))
    found = stagewire.discover()
    assert [one.url for one in found] == ["/dev/ttyUSB1", "/dev/ttyS0", "/dev/ttyUSB0"]
    assert [one.is_controller for one in found] == [True, False, False]
    assert "MS-2000" in found[1].what
    assert found[2].known == ()  # a serial number alone proves nothing


def test_a_chip_with_generic_ids_is_recognised_by_the_name_of_the_manufacturer() -> None:
    assert plug_of(0x0403, 0x6001, "Thorlabs") is not None
    assert plug_of(0x0403, 0x6001, "FTDI") is None
    assert plug_of(None, None, "Thorlabs") is None
    assert plug_of(0x1234, 0xFAF0) is None


def test_ports_are_sorted_by_their_numbers(monkeypatch: pytest.MonkeyPatch) -> None:
    show(monkeypatch, *(port(f"COM{number}") for number in (10, 9, 1)), port("/dev/ttyS0"))
    assert [one.device for one in serial_ports()] == ["/dev/ttyS0", "COM1", "COM9", "COM10"]


def test_a_port_is_found_by_its_name_and_through_links(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    device = tmp_path / "ttyUSB0"
    device.touch()
    link = tmp_path / "by-serial"
    link.symlink_to(device)
    show(monkeypatch, linux(str(device), "83828433"), port("COM3"))
    for url in (device, link):
        found = port_of(str(url))
        assert found is not None
        assert found.serial_number == "83828433"
    assert port_of("com3") is not None
    assert port_of("COM4") is None


def test_units_and_newer_units_are_found_by_name_in_any_case() -> None:
    tdc, kdc, mount = by_name(APT, "tdc001"), by_name(APT, "kdc101"), by_name(APT, "k10cr2")
    assert tdc is not None
    assert kdc is not None
    assert mount is not None
    assert (tdc.unit, tdc.documented) == ("TDC001", True)
    assert (kdc.unit, kdc.documented) == ("KDC101", True)
    assert (mount.unit, mount.documented) == ("K10CR1", False)
    assert by_name(APT, "TDC002") is None


def test_every_prefix_of_the_registry_leads_to_its_unit() -> None:
    registry = APT.registry()
    prefixes = {str(unit["usb_prefix"]) for unit in registry["units"] if unit.get("usb_prefix")}
    for prefix in prefixes | set(registry["known_prefixes"]):
        known = by_serial_number(APT, f"{prefix}000001")
        assert known, prefix
        assert all(str(one) for one in known)
