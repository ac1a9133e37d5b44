"""Long dialogues in reports: repetitions are omitted and counted."""

from __future__ import annotations

import pytest
from sample_sheets import SIGN

from stagewire_conformance.reports import Transmission
from stagewire_conformance.reports.text import dialogue, shortened

MOVE = Transmission(time=1.0, sent=True, raw=bytes.fromhex("53040600d0010100e8030000"), text="move")
END = Transmission(
    time=9.0, sent=False, raw=bytes.fromhex("64040e0081500100") + bytes(12), text="end"
)


def asked(number: int) -> Transmission:
    return Transmission(time=2.0 + number, sent=True, raw=bytes.fromhex("900401005001"), text="ask")


def told(number: int) -> Transmission:
    raw = bytes.fromhex("91040e0081500100") + bytes([number]) + bytes(11)
    return Transmission(time=2.0 + number, sent=False, raw=raw, text=f"at {number}")


def polled(many: int) -> list[Transmission]:
    """Return a motion that is polled repeatedly, and ends in between."""
    looks = [line for number in range(many) for line in (asked(number), told(number))]
    half = len(looks) // 2
    return [MOVE, *looks[:half], END, *looks[half:]]


def left_out(found: list[Transmission | int]) -> int:
    return sum(each for each in found if isinstance(each, int))


def test_a_short_dialogue_is_complete() -> None:
    lines = polled(3)
    assert shortened(lines, len(lines)) == lines


def test_keep_alive_messages_are_omitted_first() -> None:
    lines = [MOVE, SIGN, SIGN, END]
    assert shortened(lines, 3) == [MOVE, END]


@pytest.mark.parametrize("many", [20, 100])
def test_events_are_kept(many: int) -> None:
    lines = polled(many)
    found = shortened(lines, 16)
    kept = [each for each in found if isinstance(each, Transmission)]
    assert [kept[0], kept[-1]] == [lines[0], lines[-1]]
    assert END in kept
    assert kept == [line for line in lines if line in kept]
    assert left_out(found) + len(kept) == len(lines)
    assert len(found) <= 16


@pytest.mark.parametrize("most", [3, 10, 50])
def test_a_dialogue_without_repetitions_loses_its_middle(most: int) -> None:
    lines = [
        Transmission(time=n, sent=n % 2 == 0, raw=bytes([n, n, n, n, n, n, n])) for n in range(200)
    ]
    found = shortened(lines, most)
    kept = [each for each in found if isinstance(each, Transmission)]
    assert len(kept) == most
    assert found.count(200 - most) == 1
    assert [kept[0], kept[-1]] == [lines[0], lines[-1]]


def test_the_text_of_a_dialogue() -> None:
    text = list(dialogue([MOVE, END], 10))
    assert text[0] == "    1.000 > 53 04 06 00 D0 01 01 00 E8 03 00 00  # move"
    assert text[1].startswith("    9.000 < 64 04 0E 00 81 50 ")
    assert any("… " in line for line in dialogue(polled(50), 12))
