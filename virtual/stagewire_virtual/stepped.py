"""An event loop with stepped time: it jumps to the next timer whenever no task can run.

::

    async def main() -> None:
        async with TDC001.open("virtual://TDC001?stage=Z8") as tdc:
            await tdc.home()

    stepped.run(main())         # a minute of homing, without waiting

Sessions, ``virtual://`` and ``asyncio.sleep`` use the loop's time. Data from outside the loop (a real port, a
thread) arrives in real time, while hours of the loop's time may pass. No time passes while a function runs in
an executor of the loop, such as by ``asyncio.to_thread``.
"""

from __future__ import annotations

import asyncio
import selectors
from collections.abc import Callable, Coroutine
from typing import Any, TypeVar, TypeVarTuple

__all__ = ["SteppedEventLoop", "run"]

_T = TypeVar("_T")
_Ts = TypeVarTuple("_Ts")


def run(main: Coroutine[Any, Any, _T]) -> _T:
    """Run a coroutine like :func:`asyncio.run`, in stepped time, and return its result."""
    with asyncio.Runner(loop_factory=SteppedEventLoop) as runner:
        return runner.run(main)


class SteppedEventLoop(asyncio.SelectorEventLoop):
    """An event loop that jumps to timers instead of waiting for them; its time begins at 0."""

    def __init__(self) -> None:
        self._seconds = 0.0
        self._functions = 0  # that run in an executor
        super().__init__(_NoWaiting(self))

    def time(self) -> float:
        """Return the loop's time in seconds, which began at 0."""
        return self._seconds

    def run_in_executor(
        self, executor: Any, func: Callable[[*_Ts], _T], *args: *_Ts
    ) -> asyncio.Future[_T]:
        """Run a function in a thread; no time passes until it has returned."""
        future = super().run_in_executor(executor, func, *args)
        self._functions += 1
        future.add_done_callback(self._returned)
        return future

    def _returned(self, future: asyncio.Future[Any]) -> None:
        self._functions -= 1

    @property
    def has_stopped(self) -> bool:
        """Whether no time passes, because a function runs in an executor."""
        return self._functions > 0

    def pass_time(self, seconds: float) -> None:
        """Advance the time; timers that are due by then run next."""
        self._seconds += seconds


class _NoWaiting(selectors.DefaultSelector):
    """A selector that advances the loop's time instead of waiting for a timer."""

    def __init__(self, loop: SteppedEventLoop) -> None:
        super().__init__()
        self._loop = loop

    def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
        # Without timers, and while a function runs, only an event from outside can end the wait.
        if timeout is None or (timeout > 0 and self._loop.has_stopped):
            return super().select(None)
        ready = super().select(0)
        if not ready:
            self._loop.pass_time(max(timeout, 0))
        return ready
