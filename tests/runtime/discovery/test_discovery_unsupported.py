"""Units that are known but not supported, and units of one prefix that report the same model."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

import stagewire
import stagewire_virtual as virtual
from serial_ports import linux, show
from stagewire._links import opening
from stagewire.discovery import Verdict, by_name, by_serial_number, diagnose_line, unit_at
from stagewire.errors import UnsupportedError, WrongUnitError
from stagewire.links import Link
from stagewire.protocols import load_protocol
from stagewire.support import Unsupported
from stagewire_apt import BBD102, BBD103, TDC001
from stagewire_virtual.linking import SteppedLink

APT = load_protocol("thorlabs_apt")
REASON = "No document describes its messages."
SHOWN = "KLC101 (a liquid crystal controller): not supported: No document describes its messages."


@pytest.fixture(autouse=True)
def registered(monkeypatch: pytest.MonkeyPatch) -> None:
    """Add an unsupported unit to the registry and to the facts of the device classes."""
    entry = {
        "title": "a liquid crystal controller",
        "reason": REASON,
        "prefixes": [39],
        "source": "a catalogue",
    }
    monkeypatch.setitem(APT.registry(), "unsupported", {"KLC101": entry})
    one = Unsupported("KLC101", entry["title"], REASON, (39,))  # type: ignore[arg-type]
    monkeypatch.setitem(TDC001.facts.unsupported, "KLC101", one)  # type: ignore[arg-type]
    show(monkeypatch)


def reporting(
    controller: virtual.VirtualController, number: int, model: bytes
) -> Callable[..., Link]:
    """Return a function that opens a line to a controller with this serial number and this model."""

    def open_line(url: str, **_: Any) -> Link:
        line = SteppedLink(controller)
        read = line.read

        def twisted(timeout: float) -> bytes:
            data = read(timeout)
            if data[:2] != b"\x06\x00":
                return data
            return data[:6] + number.to_bytes(4, "little") + model.ljust(8, b"\0") + data[18:]

        line.read = twisted  # type: ignore[method-assign]
        return line

    return open_line


def test_an_unsupported_unit_is_known_by_its_name_and_its_serial_number() -> None:
    assert str(by_name(APT, "klc101")) == SHOWN
    [known] = by_serial_number(APT, "39000001")
    assert (known.name, known.unit, known.reason) == ("KLC101", None, REASON)
    assert str(known) == SHOWN


def test_discovery_gives_the_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    show(monkeypatch, linux("/dev/ttyUSB0", "39000001"))
    [found] = stagewire.discover()
    assert (found.unit, found.what) == ("KLC101", SHOWN)


def test_open_refuses_an_unsupported_unit_with_the_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    show(monkeypatch, linux("/dev/ttyUSB0", "39000001"))
    for unit in ("KLC101", None):
        with pytest.raises(UnsupportedError, match=f"not supported: {REASON}"):
            stagewire.open("/dev/ttyUSB0", unit)


def test_another_class_refuses_an_unsupported_unit_with_the_reason() -> None:
    with virtual.TDC001() as tdc:
        line = reporting(tdc, 39000001, b"KLC101")("made")
        with pytest.raises(WrongUnitError) as caught:
            TDC001.open(line)
    assert "as KLC101 (a liquid crystal controller) does; no class supports it; KLC101: " in str(
        caught.value
    )
    assert REASON.rstrip(".") in str(caught.value)


def test_the_doctor_reports_that_a_unit_is_not_supported(monkeypatch: pytest.MonkeyPatch) -> None:
    with virtual.TDC001() as tdc:
        monkeypatch.setattr(opening, "open_link", reporting(tdc, 39000001, b"KLC101"))
        [told] = diagnose_line("socket://127.0.0.1:9")
    assert told.verdict is Verdict.WRONG
    assert SHOWN in told.text
    assert "has no class for it" in told.advice


def test_a_model_that_several_units_report_does_not_decide(monkeypatch: pytest.MonkeyPatch) -> None:
    with virtual.BBD102() as rack:
        monkeypatch.setattr(opening, "open_link", reporting(rack, 73000001, b"BBD102"))
        assert unit_at("socket://127.0.0.1:9", serial_number=73000001) == "BBD102"
        known = {"unit": "BBD102", "shared_with": ["BBD103"], "distinguished_by": "nothing"}
        monkeypatch.setitem(APT.registry()["known_prefixes"], "73", known)
        with pytest.raises(WrongUnitError, match="the reported model does not show which it is"):
            unit_at("socket://127.0.0.1:9", serial_number=73000001)


def test_classes_accept_each_unit_that_reports_the_same_model() -> None:
    unit = BBD103.unit
    with virtual.BBD103() as rack:
        open_line = reporting(rack, 73000001, b"BBD102")
        with pytest.raises(WrongUnitError, match="as BBD102 does"):
            BBD103.open(open_line("made"))
        for one in (BBD102.unit, unit):
            object.__setattr__(one, "alike", (73,))
        try:
            BBD103.open(open_line("made")).close()
        finally:
            for one in (BBD102.unit, unit):
                object.__setattr__(one, "alike", ())
