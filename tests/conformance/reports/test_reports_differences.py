"""Bytes wanted below bytes that came: aligned, marked, and nothing lost."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from stagewire_conformance.reports.text import as_text, rows


@pytest.mark.parametrize(
    ("wanted", "came", "text"),
    [
        ("01 02 03", "01 02 03", ["wanted   0  01 02 03", "came        01 02 03"]),
        (
            "01 02 03",
            "01 FF 03",
            ["wanted   0  01 02 03", "came        01 FF 03", "               ^^"],
        ),
        (
            "01 02 03 04",
            "01 03 04",
            ["wanted   0  01 02 03 04", "came        01 -- 03 04", "               ^^"],
        ),
        (
            "01 02",
            "01 09 09 02",
            ["wanted   0  01 -- -- 02", "came        01 09 09 02", "               ^^ ^^"],
        ),
        ("", "01", ["wanted   0  --", "came        01", "            ^^"]),
        ("", "", []),
    ],
)
def test_how_they_are_aligned(wanted: str, came: str, text: list[str]) -> None:
    assert as_text(bytes.fromhex(wanted), bytes.fromhex(came)) == text


def test_what_is_alike_at_length_is_counted() -> None:
    wanted = bytes(range(90))
    came = wanted[:40] + b"\xff" + wanted[41:]
    lines = as_text(wanted, came)
    assert lines[0] == "both     0  … 40 bytes alike …"
    assert lines[1].startswith("wanted  40  28 ")
    assert lines[-1] == "both    48  … 42 bytes alike …"
    assert len(lines) == 5


@given(st.binary(max_size=60), st.binary(max_size=60))
def test_nothing_is_lost(wanted: bytes, came: bytes) -> None:
    cells = [cell for row in rows(wanted, came) for cell in row.cells]
    for place, raw in enumerate((wanted, came)):
        kept = [cell[place] for cell in cells if cell[place] != "--"]
        assert bytes.fromhex("".join(kept)) == raw
    assert len(cells) == max(len(wanted), len(came))


@given(st.binary(max_size=60), st.binary(max_size=60))
def test_marks_stand_below_what_differs(wanted: bytes, came: bytes) -> None:
    lines = as_text(wanted, came)
    for above, line, below in zip(lines, lines[1:], [*lines[2:], ""], strict=False):
        if above.startswith("wanted"):
            marks = below.ljust(len(line)) if below.startswith(" ") else " " * len(line)
            for at in range(12, len(line), 3):
                cell = slice(at, at + 2)
                assert (marks[cell] == "^^") == (above[cell] != line[cell])
