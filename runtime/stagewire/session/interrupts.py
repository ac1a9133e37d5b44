"""Ctrl-C at a moment that does no harm: never in the midst of what a session does at once.

Python raises ``KeyboardInterrupt`` between any two steps of the main thread. Within a session it would leave a
frame taken from the queue and not written, a reply read and given to nobody, or a turn to read that nobody
has. So while a session is open, an interrupt that comes there is raised some milliseconds later: where the
thread waits, or when it has left the session. A program with a handler of its own keeps it.
"""

from __future__ import annotations

import _thread
import signal
import threading
import time
from types import FrameType
from typing import Final

__all__ = ["on_interrupt"]

_AGAIN: Final = 0.005  # seconds
_LONGEST: Final = 2.0  # seconds; a line of somebody else's may wait where nobody here knows of it

_WAITS: Final = {"Waiter.sleep", "Readiness.readable", "Condition.wait"}
"""Where a thread waits within a session, and holds nothing."""

_SESSIONS: Final = "stagewire.session."

_first = _last = -_LONGEST  # when the one that was put off came, and when it was last looked at
_timer: threading.Timer | None = None  # will raise it again


def on_interrupt(number: int, frame: FrameType | None) -> None:
    """Raise ``KeyboardInterrupt``, at once or soon; the handler of ``SIGINT``."""
    global _first, _last, _timer
    now = time.monotonic()
    if now - _last > 10 * _AGAIN:
        _first = now
    _last = now
    if now - _first < _LONGEST and _is_inside(frame):
        if _timer is None:
            _timer = threading.Timer(_AGAIN, _interrupt_again)
            _timer.daemon = True
            _timer.start()
        return
    if _timer is not None:  # two that come at once are one
        _timer.cancel()
        _timer = None
    signal.default_int_handler(number, frame)


def _is_inside(frame: FrameType | None) -> bool:
    while frame is not None:
        if frame.f_code.co_qualname in _WAITS:
            return False
        if frame.f_globals.get("__name__", "").startswith(_SESSIONS):
            return True
        frame = frame.f_back
    return False


def _interrupt_again() -> None:
    global _timer
    _timer = None
    if hasattr(signal, "pthread_kill"):  # which ends a wait of the main thread, too
        signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGINT)
    else:
        _thread.interrupt_main()
