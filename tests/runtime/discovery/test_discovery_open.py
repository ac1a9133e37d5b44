"""``stagewire.open``: opening a controller without naming its class."""

from __future__ import annotations

import sys

import pytest

import stagewire
import stagewire_virtual as virtual
from serial_ports import linux, show
from stagewire.discovery import device_class
from stagewire.errors import (
    BadValueError,
    LinkOpenError,
    UnsupportedError,
    WrongUnitError,
)
from stagewire.protocols import available_protocols, load_protocol
from stagewire_apt import BBD102, K10CR1, TDC001
from stagewire_virtual import linking
from stagewire_virtual.linking import SteppedLink


@pytest.fixture(autouse=True)
def no_ports(monkeypatch: pytest.MonkeyPatch) -> None:
    show(monkeypatch)


def lead_to(monkeypatch: pytest.MonkeyPatch, controller: virtual.VirtualController) -> None:
    monkeypatch.setattr(linking, "open_link", lambda url, settings: SteppedLink(controller))


def test_open_uses_the_name_in_a_virtual_url() -> None:
    with stagewire.open("virtual://TDC001?stage=Z8", stage="Z8", travel_mm=12) as device:
        assert type(device) is TDC001
        assert device.get_dc_status_update().position_mm == 0


def test_open_requests_the_identity(monkeypatch: pytest.MonkeyPatch) -> None:
    with virtual.TDC001() as tdc:
        lead_to(monkeypatch, tdc)
        with stagewire.open("virtual://made") as device:
            assert type(device) is TDC001
    with virtual.BBD102(serial_number=73000001) as rack:
        lead_to(monkeypatch, rack)
        with stagewire.open("virtual://made", serial_number=73000001) as device:
            assert type(device) is BBD102


def test_open_uses_the_usb_plug(monkeypatch: pytest.MonkeyPatch) -> None:
    show(monkeypatch, linux("/dev/there-is-none", "83000001"))
    with pytest.raises(LinkOpenError, match="/dev/there-is-none"):
        stagewire.open("/dev/there-is-none")


def test_open_accepts_a_name_in_any_case_but_refuses_another_unit(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    with virtual.TDC001(serial_number=83000001) as tdc:
        lead_to(monkeypatch, tdc)
        stagewire.open("virtual://made", "tdc001").close()
        with pytest.raises(WrongUnitError, match="not a TST001: it reports serial number 83000001"):
            stagewire.open("virtual://made", "TST001")


def test_a_controller_newer_than_the_document_is_opened_as_a_similar_unit(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    with virtual.K10CR1(serial_number=55000001, model="K10CR2") as mount:
        lead_to(monkeypatch, mount)
        with stagewire.open("virtual://made", "K10CR2") as device:
            assert type(device) is K10CR1
            assert "K10CR2" in str(device)


def test_the_scales_are_those_of_the_named_unit() -> None:
    for unit, counts in (("TST001", 25_600), ("KST101", 409_600), ("TST101", 409_600)):
        for options in ({}, {"identify": False}):
            url = f"virtual://{unit}"
            with stagewire.open(url, unit, stage="APT_STEPPER", **options) as device:
                device.set_pos_counter(mm=1)
                assert device.get_pos_counter().position == counts
    with pytest.raises(WrongUnitError, match="not a KDC101: it reports serial number 83"):
        stagewire.open("virtual://TDC001", "KDC101")


def test_an_unknown_unit_is_refused() -> None:
    with pytest.raises(BadValueError, match="unknown unit TDC01; did you mean TDC001"):
        device_class("TDC01")
    with pytest.raises(BadValueError, match="choose BBD101, BBD102"):
        device_class("\x00")


def test_every_unit_of_every_protocol_has_a_class() -> None:
    for protocol in map(load_protocol, available_protocols()):
        for unit in protocol.registry()["units"]:
            assert device_class(unit["name"]).unit.name == unit["name"]


def test_a_package_without_device_classes_raises_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "stagewire_apt.devices", None)
    with pytest.raises(UnsupportedError, match="stagewire_apt has no device classes"):
        device_class("TDC001")


def test_discover_and_open_are_imported_on_first_use() -> None:
    assert stagewire.discover.__module__ == "stagewire._discovery.search"
    assert stagewire.open.__module__ == "stagewire._discovery.opening"
    with pytest.raises(AttributeError, match="has no attribute 'close'"):
        _ = stagewire.discovery.close
