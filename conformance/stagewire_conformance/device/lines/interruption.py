"""Ctrl-C, SIGTERM and SIGHUP during a run: heeded where the line is waited for, and never within a frame.

Python raises ``KeyboardInterrupt`` between any two steps of the main thread. In a run that would leave half a
frame on the line, and the stop that has to follow it would be taken for its rest. So while a run goes on, a
signal is only noted, and the read that waits is woken; the line then raises. A program with a handler of its
own keeps it; where an error comes out of the line itself, it is heeded all the same. SIGHUP comes when the
terminal or its connection is closed, and not on Windows.
"""

from __future__ import annotations

import signal
import threading
from types import FrameType, TracebackType
from typing import Any, Final, Self

from stagewire.links import Link

__all__ = ["Interruption"]

_DEFAULTS: Final[dict[signal.Signals, Any]] = {
    signal.SIGINT: signal.default_int_handler,
    signal.SIGTERM: signal.SIG_DFL,
}
if hasattr(signal, "SIGHUP"):
    _DEFAULTS[signal.SIGHUP] = signal.SIG_DFL


class Interruption:
    """Notes that somebody wants the run to end; a context manager while the run goes on.

    :param link: whose read is woken.
    """

    def __init__(self, link: Link) -> None:
        self._link = link
        self._count = 0
        self._heeded = 0
        self._before: dict[signal.Signals, Any] = {}
        self.signal: int = signal.SIGINT
        """The one that came last."""

    def __enter__(self) -> Self:
        if threading.current_thread() is threading.main_thread():
            for number, default in _DEFAULTS.items():
                if signal.getsignal(number) is default:
                    self._before[number] = signal.signal(number, self._on_signal)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        at: TracebackType | None,
    ) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        self.signal = number
        self._count += 1
        self._link.wake()

    def check(self) -> None:
        """Raise :class:`KeyboardInterrupt` if somebody wants the run to end."""
        if self._count > self._heeded:
            raise KeyboardInterrupt

    def heed(self) -> None:
        """Take all that was wanted until now as seen to: what is put back can be interrupted once more."""
        self._heeded = self._count
