"""An adapter that lets suspenders of bluesky watch signals of ophyd-async.

A suspender subscribes as to a signal of ophyd: from any thread, with ``event_type=`` and ``run=``, and its
callback takes ``value=``. A signal of ophyd-async refuses that with a :class:`TypeError`.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any

from bluesky.protocols import Reading
from ophyd_async.core import SignalR


class Watched:
    """A signal in the form that suspenders expect: ``SuspendFloor(Watched(gauge.reading, RE), 2)``.

    :param signal: a connected signal, such as ``motor.readback`` or ``gauge.reading``.
    :param run_engine: the RunEngine in whose event loop the signal was connected.

    While the controller does not answer, the value is NaN, and the suspender does not act.
    """

    def __init__(self, signal: SignalR[Any], run_engine: Any) -> None:
        self._signal = signal
        self._loop: asyncio.AbstractEventLoop = run_engine.loop
        self._latest: Any = None
        self._callbacks: dict[int, Callable[[dict[str, Reading[Any]]], None]] = {}

    def __repr__(self) -> str:
        return f"<Watched {self.name}>"

    @property
    def name(self) -> str:
        """The name of the signal."""
        return self._signal.name

    def get(self) -> Any:
        """Return the latest value, which a suspender shows in its message; None before the first one."""
        return self._latest

    def subscribe(
        self, function: Callable[..., Any], event_type: str | None = None, run: bool = True
    ) -> int:
        """Call a function with each value, as ``function(value=…, timestamp=…)``, from the event loop.

        :param event_type: accepted and not used; every new value is an event.
        :param run: accepted and not used; the function is always called with the present value.
        """

        def call(reading: dict[str, Reading[Any]]) -> None:
            one = reading[self._signal.name]
            self._latest = one["value"]
            function(value=one["value"], timestamp=one["timestamp"])

        key = id(function)
        self._callbacks[key] = call
        self._in_loop(lambda: self._signal.subscribe_reading(call))
        return key

    def clear_sub(self, function: Callable[..., Any]) -> None:
        """Stop calling a function."""
        call = self._callbacks.pop(id(function), None)
        if call is not None:
            self._in_loop(lambda: self._signal.clear_sub(call))

    def _in_loop(self, action: Callable[[], None]) -> None:
        """Run an action in the event loop, and wait for it unless this is its thread."""
        try:
            inside = asyncio.get_running_loop() is self._loop
        except RuntimeError:
            inside = False
        if inside:
            action()
            return

        async def run() -> None:
            action()

        asyncio.run_coroutine_threadsafe(run(), self._loop).result(timeout=10)
