"""The parts of a packet as a table: where each one stands, and what it holds."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from stagewire.protocols import Check, Crc, Shape, Sum
from stagewire_cli.terminal import table
from stagewire_conformance.hexes import spaced

if TYPE_CHECKING:
    from rich.table import Table

__all__ = ["parts_table"]


def parts_table(shape: Shape, id: int) -> Table:
    """Return the parts of the packets that carry the message with this id."""
    shown = table("offset", "part", "bytes", "holds", right=("offset", "bytes"))
    for offset, part, size, holds in _rows(shape, id):
        shown.add_row(offset, part, size, holds)
    return shown


def _rows(shape: Shape, id: int) -> Iterator[tuple[str, str, str, str]]:
    holds = {
        "start": spaced(shape.start),
        "length": f"number of bytes in {', '.join(shape.counts)}",
        "address": "address of the controller",
        "id": f"{id:#0{2 + 2 * shape.id}x}",
        "payload": f"the fields; at most {shape.maximum} bytes",
        "check": _check(shape),
        "end": spaced(shape.end),
    }
    behind = False
    for part in shape.order:
        offset = shape.place(part, 0).start
        size = "n" if part == "payload" else str(shape.sizes[part])
        yield f"{offset}+n" if behind else str(offset), part, size, holds[part]
        behind = behind or part == "payload"


def _check(shape: Shape) -> str:
    return "" if shape.check is None else f"{_method(shape.check)} of {', '.join(shape.covers)}"


def _method(check: Check) -> str:
    if isinstance(check, Crc):
        digits = 2 + 2 * check.size
        return (
            f"CRC (polynomial {check.polynomial:#0{digits}x}, initial {check.initial:#0{digits}x}, "
            f"{'reflected' if check.reflected else 'not reflected'}, final {check.final:#0{digits}x})"
        )
    if isinstance(check, Sum):
        return "sum" if check.complement == "none" else f"{check.complement}' complement of the sum"
    return "exclusive or"
