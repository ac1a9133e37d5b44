"""Why bytes are no message: which of them are wrong, and what was expected there."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from stagewire.errors import CodecError

__all__ = ["explain"]

_SHOWN = 64
_BEFORE = 6  # bytes that are shown before the wrong ones


def explain(raw: bytes, error: CodecError, hints: Iterable[str]) -> Iterator[str]:
    """Yield lines that show the bytes, mark the wrong ones and say what was expected."""
    wrong = error.at or range(0)
    start = max(0, min(wrong.start - _BEFORE, len(raw) - _SHOWN)) if wrong.start > _SHOWN else 0
    shown = range(start, min(max(len(raw), wrong.start + 1), start + _SHOWN))
    lead = "... " if start else ""
    more = " ..." if shown.stop < len(raw) else ""
    cells = [f"{raw[i]:02X}" if i < len(raw) else "  " for i in shown]
    yield f"{lead}{' '.join(cells)}{more}".rstrip()
    if wrong:
        marks = ["^^" if i in wrong else "  " for i in shown]
        yield f"{' ' * len(lead)}{' '.join(marks)}".rstrip()
    yield f"{error.code}: {error}"
    yield from (f"hint: {hint}" for hint in hints)
