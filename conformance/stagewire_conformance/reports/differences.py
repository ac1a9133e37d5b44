"""What was wanted beside what came, byte below byte, with marks below what differs.

Bytes of equal number are compared place by place. Of different numbers, what is alike at both ends is put
below each other, and what is missing or too many stands as ``--`` between.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import groupby

__all__ = ["Row", "as_text", "pieces", "rows"]

_BYTES_IN_A_ROW = 8
_NOTHING = "--"
_ALIKE_SHOWN = 2
"""Rows without a difference that are shown in full."""


@dataclass(frozen=True, slots=True)
class Row:
    """Some bytes of both.

    :param offset: of the first, from the beginning of what was wanted or came, gaps counted.
    :param cells: wanted and came, each as two hex digits or ``--``.
    """

    offset: int
    cells: tuple[tuple[str, str], ...]

    @property
    def differs(self) -> bool:
        """Whether any byte does."""
        return any(wanted != came for wanted, came in self.cells)


def rows(wanted: bytes, came: bytes) -> list[Row]:
    """Return both in rows of eight bytes."""
    pairs = list(zip(*_padded(wanted, came), strict=True))
    return [
        Row(offset, tuple(pairs[offset : offset + _BYTES_IN_A_ROW]))
        for offset in range(0, len(pairs), _BYTES_IN_A_ROW)
    ]


def pieces(wanted: bytes, came: bytes) -> list[list[tuple[str, bool]]]:
    """Return both as lines, each in pieces of text that differ or not; ``^^`` stands below what differs.

    Of several rows that are alike only their number of bytes is told.
    """
    lines = []
    for differs, grouped in groupby(rows(wanted, came), key=lambda row: row.differs):
        group = list(grouped)
        if not differs and len(group) > _ALIKE_SHOWN:
            number = sum(len(row.cells) for row in group)
            lines.append([(f"{f'both   {group[0].offset:3}':<12}… {number} bytes alike …", False)])
            continue
        for row in group:
            lines += _lines(row)
    return lines


def _lines(row: Row) -> list[list[tuple[str, bool]]]:
    lines = []
    differing = [one != other for one, other in row.cells]
    for place, label in enumerate((f"wanted {row.offset:3}", "came")):
        cells = [(cell[place], differs) for cell, differs in zip(row.cells, differing, strict=True)]
        spaced = [part for cell in cells for part in ((" ", False), cell)][1:]
        lines.append([(f"{label:<12}", False), *spaced])
    if row.differs:
        marks = " ".join("^^" if differs else "  " for differs in differing)
        lines.append([(f"{'':<12}{marks}".rstrip(), False)])
    return lines


def as_text(wanted: bytes, came: bytes) -> list[str]:
    """Return the same as lines of text."""
    return ["".join(text for text, _ in line) for line in pieces(wanted, came)]


def _padded(wanted: bytes, came: bytes) -> tuple[list[str], list[str]]:
    """Return both as cells, of equal number."""
    shorter, longer = sorted((wanted, came), key=len)
    ahead = 0
    while ahead < len(shorter) and shorter[ahead] == longer[ahead]:
        ahead += 1
    behind = 0
    while behind < len(shorter) - ahead and shorter[-1 - behind] == longer[-1 - behind]:
        behind += 1
    gap = [_NOTHING] * (len(longer) - len(shorter))
    cells = [f"{byte:02X}" for byte in shorter]
    place = len(shorter) - behind
    filled = [*cells[:place], *gap, *cells[place:]]
    full = [f"{byte:02X}" for byte in longer]
    return (filled, full) if shorter is wanted else (full, filled)
