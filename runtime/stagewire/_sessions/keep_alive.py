"""Signs of life: a controller that gets none for long falls silent."""

from __future__ import annotations

from collections.abc import Mapping
from math import inf

from stagewire.errors import OutOfRangeError

__all__ = ["KeepAlive"]


class KeepAlive:
    """What is sent again and again, whatever else happens."""

    __slots__ = ("_period", "_signs", "next")

    def __init__(self) -> None:
        self._signs: dict[int, bytes] = {}
        self._period = inf
        self.next = inf
        """When it is to be sent next."""

    def set(self, signs: Mapping[int, bytes], period: float) -> None:
        """Send all signs now, and every ``period`` seconds from then on.

        :param signs: address -> its sign, in place of the one that it had; empty: none any more. Where no
            address is given, nobody gets one any more.

        Raises :class:`~stagewire.errors.OutOfRangeError` for what is no period.
        """
        if not 0 < period < inf:
            raise OutOfRangeError(f"a period is a number of seconds above 0, not {period!r}")
        together = {**self._signs, **signs} if signs else {}
        self._signs = {address: sign for address, sign in together.items() if sign}
        self._period = period
        self.next = 0.0 if self._signs else inf

    def take(self, now: float) -> bytes:
        """Return what is to be sent now; those that were missed are not made up for."""
        self.next = now + self._period
        return b"".join(self._signs.values())
