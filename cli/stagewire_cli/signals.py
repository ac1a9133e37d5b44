"""Signals that end a command that serves."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

SIGNALS = ("SIGINT", "SIGTERM", "SIGHUP", "SIGQUIT", "SIGBREAK")  # those that the system has


@contextmanager
def signals(end: Callable[[], object]) -> Iterator[None]:
    """Make signals call ``end`` in the event loop during the block."""
    import asyncio

    loop = asyncio.get_running_loop()
    with handled(lambda *_: loop.call_soon_threadsafe(end)):
        yield


@contextmanager
def handled(handle: Callable[..., object]) -> Iterator[None]:
    """Let a function handle these signals during the block, except those that are ignored, as by nohup."""
    before = {}
    for name in SIGNALS:
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) is not signal.SIG_IGN:
            before[number] = signal.signal(number, handle)
    try:
        yield
    finally:
        for number, handler in before.items():
            with suppress(TypeError):  # a handler that was not set by Python
                signal.signal(number, handler)
