"""Expected and received bytes: aligned, marked, and complete."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from stagewire_conformance.reports.text import as_text, rows


@pytest.mark.parametrize(
    ("wanted", "came", "text"),
    [
        ("01 02 03", "01 02 03", ["expected   0  01 02 03", "received      01 02 03"]),
        (
            "01 02 03",
            "01 FF 03",
            ["expected   0  01 02 03", "received      01 FF 03", "                 ^^"],
        ),
        (
            "01 02 03 04",
            "01 03 04",
            ["expected   0  01 02 03 04", "received      01 -- 03 04", "                 ^^"],
        ),
        (
            "01 02",
            "01 09 09 02",
            ["expected   0  01 -- -- 02", "received      01 09 09 02", "                 ^^ ^^"],
        ),
        ("", "01", ["expected   0  --", "received      01", "              ^^"]),
        ("", "", []),
    ],
)
def test_differing_bytes_are_aligned_and_marked(wanted: str, came: str, text: list[str]) -> None:
    assert as_text(bytes.fromhex(wanted), bytes.fromhex(came)) == text


def test_long_equal_parts_are_counted() -> None:
    wanted = bytes(range(90))
    came = wanted[:40] + b"\xff" + wanted[41:]
    lines = as_text(wanted, came)
    assert lines[0] == "both       0  … 40 equal bytes …"
    assert lines[1].startswith("expected  40  28 ")
    assert lines[-1] == "both      48  … 42 equal bytes …"
    assert len(lines) == 5


@given(st.binary(max_size=60), st.binary(max_size=60))
def test_nothing_is_lost(wanted: bytes, came: bytes) -> None:
    cells = [cell for row in rows(wanted, came) for cell in row.cells]
    for place, raw in enumerate((wanted, came)):
        kept = [cell[place] for cell in cells if cell[place] != "--"]
        assert bytes.fromhex("".join(kept)) == raw
    assert len(cells) == max(len(wanted), len(came))


@given(st.binary(max_size=60), st.binary(max_size=60))
def test_marks_are_below_the_differences(wanted: bytes, came: bytes) -> None:
    lines = as_text(wanted, came)
    for above, line, below in zip(lines, lines[1:], [*lines[2:], ""], strict=False):
        if above.startswith("wanted"):
            marks = below.ljust(len(line)) if below.startswith(" ") else " " * len(line)
            for at in range(12, len(line), 3):
                cell = slice(at, at + 2)
                assert (marks[cell] == "^^") == (above[cell] != line[cell])
