"""What can be wrong with what is asked of virtual controllers; all are :class:`~stagewire.errors.StagewireError`."""

from __future__ import annotations

import difflib
from collections.abc import Sequence

from stagewire.errors import StagewireError

__all__ = ["UnknownUnitError", "VirtualError"]


class VirtualError(StagewireError):
    """The base of the errors of this package."""


class UnknownUnitError(VirtualError):
    """There is no unit of that name in any installed protocol."""

    def __init__(self, name: str, known: Sequence[str]) -> None:
        close = difflib.get_close_matches(name.upper()[:40], known, n=3)
        hint = f"; did you mean {' or '.join(close)}?" if close else ""
        super().__init__(f"there is no unit {name}{hint} (there are: {', '.join(known)})")
