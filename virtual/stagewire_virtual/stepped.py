"""An event loop with stepped time: it jumps to the next timer whenever no task can run.

::

    async def main() -> None:
        async with TDC001.open("virtual://TDC001?stage=Z8") as tdc:
            await tdc.home()

    stepped.run(main())         # a minute of homing, without waiting

Sessions, ``virtual://`` and ``asyncio.sleep`` use the loop's time. Data from outside the loop (a real port, a
thread) arrives in real time, while hours of the loop's time may pass.
"""

from __future__ import annotations

import asyncio
import selectors
from collections.abc import Coroutine
from typing import Any, TypeVar

__all__ = ["SteppedEventLoop", "run"]

_T = TypeVar("_T")


def run(main: Coroutine[Any, Any, _T]) -> _T:
    """Run a coroutine like :func:`asyncio.run`, in stepped time, and return its result."""
    with asyncio.Runner(loop_factory=SteppedEventLoop) as runner:
        return runner.run(main)


class SteppedEventLoop(asyncio.SelectorEventLoop):
    """An event loop that jumps to timers instead of waiting for them; its time begins at 0."""

    def __init__(self) -> None:
        self._seconds = 0.0
        super().__init__(_NoWaiting(self))

    def time(self) -> float:
        """Return the loop's time in seconds, which began at 0."""
        return self._seconds

    def pass_time(self, seconds: float) -> None:
        """Advance the time; timers that are due by then run next."""
        self._seconds += seconds


class _NoWaiting(selectors.DefaultSelector):
    """A selector that advances the loop's time instead of waiting for a timer."""

    def __init__(self, loop: SteppedEventLoop) -> None:
        super().__init__()
        self._loop = loop

    def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
        if timeout is None:  # without timers, only an event from outside can end the wait
            return super().select(None)
        ready = super().select(0)
        if not ready:
            self._loop.pass_time(max(timeout, 0))
        return ready
