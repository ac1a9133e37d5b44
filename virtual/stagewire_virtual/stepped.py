"""An event loop whose time is stepped: it jumps to the next timer whenever nothing is left to do.

::

    async def main() -> None:
        async with TDC001.open("virtual://TDC001?stage=Z8") as tdc:
            await tdc.home()

    stepped.run(main())         # a minute of homing, in no time

Sessions, ``virtual://`` and ``asyncio.sleep`` go by the loop's time. What comes from outside (a real port, a
thread) comes at its own time, while here hours may have passed.
"""

from __future__ import annotations

import asyncio
import selectors
from collections.abc import Coroutine
from typing import Any, TypeVar

__all__ = ["SteppedEventLoop", "run"]

_T = TypeVar("_T")


def run(main: Coroutine[Any, Any, _T]) -> _T:
    """Run a coroutine as :func:`asyncio.run` does, in stepped time, and return what it returns."""
    with asyncio.Runner(loop_factory=SteppedEventLoop) as runner:
        return runner.run(main)


class SteppedEventLoop(asyncio.SelectorEventLoop):
    """An event loop that waits for no timer; its time begins at 0."""

    def __init__(self) -> None:
        self._seconds = 0.0
        super().__init__(_NoWaiting(self))

    def time(self) -> float:
        """Return the time in seconds since the loop was made."""
        return self._seconds

    def pass_time(self, seconds: float) -> None:
        """Let time jump; what is due then runs next."""
        self._seconds += seconds


class _NoWaiting(selectors.DefaultSelector):
    """Looks what has come; where nothing has, lets time jump to the end of the waiting."""

    def __init__(self, loop: SteppedEventLoop) -> None:
        super().__init__()
        self._loop = loop

    def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
        if timeout is None:  # no timer is set: only from outside can something come
            return super().select(None)
        ready = super().select(0)
        if not ready:
            self._loop.pass_time(max(timeout, 0))
        return ready
