"""A short, seeded fuzz of the virtual controllers, and tests that it finds defects.

The program for long runs is ``virtual_controllers.py``.
"""

from __future__ import annotations

import pytest
import virtual_controllers as fuzz

from stagewire_virtual.asi_ms2000.instrument import Ms2000Instrument
from stagewire_virtual.instrument import Instrument
from stagewire_virtual.thorlabs_apt.instrument import AptInstrument

SEED = 1
ROUNDS = 2
STEPS = 200
INSTRUMENTS = pytest.mark.parametrize(
    ("kind", "unit"), [(AptInstrument, "TDC001"), (Ms2000Instrument, "MS2000")]
)


@pytest.mark.parametrize("number", range(ROUNDS * len(fuzz.UNITS)))
def test_a_controller_answers_requests_after_any_input(number: int) -> None:
    fuzz.one_case(SEED, number)


def test_a_repeated_case_gives_the_same_bytes() -> None:
    for number in range(len(fuzz.UNITS)):
        first: list[bytes] = []
        again: list[bytes] = []
        fuzz.one_case(SEED, number, hear=first.append)
        fuzz.one_case(SEED, number, hear=again.append)
        assert first == again


@pytest.mark.parametrize("unit", ["BPC203", "MS2000", "TDC001"])
def test_the_memory_of_a_controller_is_bounded(unit: str) -> None:
    assert fuzz.held_by(SEED, fuzz.UNITS.index(unit), STEPS) < fuzz.BOUND


# The fuzzer finds defects


def broken(unit: str) -> str:
    """Run cases of a unit until one fails; return its message, or an empty string."""
    for number in range(fuzz.UNITS.index(unit), 20 * len(fuzz.UNITS), len(fuzz.UNITS)):
        try:
            fuzz.held_by(SEED, number, STEPS)
        except fuzz.Broken as error:
            return str(error)
    return ""


@INSTRUMENTS
def test_the_fuzzer_detects_an_exception(
    kind: type[Instrument], unit: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    receive = kind.receive

    def raises(self: Instrument, data: bytes) -> None:
        receive(self, data)
        if data.count(0xFF) > 3:
            raise IndexError("list index out of range")

    monkeypatch.setattr(kind, "receive", raises)
    found = broken(unit)
    assert found.startswith(f"{unit}, seed {SEED}, case ")
    assert "IndexError: list index out of range\n  repeat: virtual_controllers.py" in found


@INSTRUMENTS
def test_the_fuzzer_detects_a_controller_that_stops_answering(
    kind: type[Instrument], unit: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    receive = kind.receive

    def deaf(self: Instrument, data: bytes) -> None:
        self.deaf = getattr(self, "deaf", False) or len(data) > 1000  # type: ignore[attr-defined]
        if not self.deaf:  # type: ignore[attr-defined]
            receive(self, data)

    monkeypatch.setattr(kind, "receive", deaf)
    assert ": '', expected" in broken(unit)


@INSTRUMENTS
def test_the_fuzzer_detects_a_memory_leak(
    kind: type[Instrument], unit: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    receive = kind.receive

    def keeps(self: Instrument, data: bytes) -> None:
        receive(self, data)
        self.kept = (getattr(self, "kept", ()), bytes(100_000))  # type: ignore[attr-defined]

    monkeypatch.setattr(kind, "receive", keeps)
    assert "bytes; the limit is 4,194,304" in broken(unit)
