"""Signs of life: a controller that gets none for long falls silent."""

from __future__ import annotations

from math import inf

from stagewire.errors import OutOfRangeError

__all__ = ["KeepAlive"]


class KeepAlive:
    """What is sent again and again, whatever else happens."""

    __slots__ = ("_period", "_raw", "next")

    def __init__(self) -> None:
        self._raw = b""
        self._period = inf
        self.next = inf
        """When it is to be sent next."""

    def set(self, raw: bytes, period: float) -> None:
        """Send ``raw`` now, and every ``period`` seconds from then on; nothing any more if it is empty.

        Raises :class:`~stagewire.errors.OutOfRangeError` for what is no period.
        """
        if not 0 < period < inf:
            raise OutOfRangeError(f"a period is a number of seconds above 0, not {period!r}")
        self._raw = raw
        self._period = period
        self.next = 0.0 if raw else inf

    def take(self, now: float) -> bytes:
        """Return what is to be sent now; those that were missed are not made up for."""
        self.next = now + self._period
        return self._raw
