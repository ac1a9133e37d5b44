"""How late the computer itself is when it waits: what stands beside every time that is measured.

A reply that came 20 ms late says something of a controller only on a computer that does not oversleep by as
much. So the suite waits for nothing, some fifty times, and sees how late it wakes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Protocol

__all__ = ["SHARE", "Jitter", "jitter_of", "percentile"]

SHARE: Final = 0.2
"""The part of a tolerance that the jitter may take; beyond it nothing can be said of the controller."""

_WAITS: Final = 50
_SECONDS: Final = 0.005


class Waiting(Protocol):
    """What waits: a line to a controller."""

    @property
    def now(self) -> float:
        """The time in seconds."""
        ...

    def listen(self, seconds: float, /) -> object:
        """Take what comes within some seconds."""
        ...


@dataclass(frozen=True)
class Jitter:
    """How late waits ended, in seconds.

    :param typical: half of the waits were no later.
    :param late: 99 in 100 of the waits were no later.
    """

    typical: float
    late: float

    def blurs(self, tolerance: float) -> bool:
        """Say whether nothing can be said of a time that may be ``tolerance`` seconds off."""
        return self.late > SHARE * tolerance

    def __str__(self) -> str:
        return (
            f"this computer wakes up to {self.late * 1e3:.2f} ms late (99 of 100 waits; "
            f"half of them {self.typical * 1e3:.2f} ms)"
        )


def jitter_of(line: Waiting) -> Jitter:
    """Measure it, in a quarter of a second; what comes meanwhile is taken by the line as always.

    A wait that something cuts short, such as a message, counts as in time.
    """
    late = []
    for _ in range(_WAITS):
        began = line.now
        line.listen(_SECONDS)
        late.append(max(0.0, line.now - began - _SECONDS))
    return Jitter(percentile(late, 50), percentile(late, 99))


def percentile(values: list[float], share: int) -> float:
    """Return the smallest value that at least ``share`` in 100 of the values do not exceed.

    Raises :class:`ValueError` where there are no values.
    """
    if not values:
        raise ValueError("nothing was measured")
    return sorted(values)[max(0, -(-len(values) * share // 100) - 1)]
