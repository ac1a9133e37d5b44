"""Ctrl-C at a moment that does no harm: never in the midst of what a session does at once.

Python raises ``KeyboardInterrupt`` between any two steps of the main thread. Within a session it would leave
a frame taken from the queue and not written, a reply read and given to nobody, or a turn to read that nobody
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

_SESSIONS: Final = "stagewire._sessions."

_put_off_since: float | None = None
_comes_again = False


def on_interrupt(number: int, frame: FrameType | None) -> None:
    """Raise ``KeyboardInterrupt``, at once or soon; the handler of ``SIGINT``."""
    global _put_off_since, _comes_again
    now = time.monotonic()
    since = _put_off_since
    if since is None or now > since + 2 * _LONGEST:  # one that was raised by another handler
        since = now
    if now < since + _LONGEST and _is_inside(frame):
        _put_off_since = since
        if not _comes_again:
            _comes_again = True
            # No Thread of threading, whose locks the main thread may have now.
            _thread.start_new_thread(_interrupt_again, ())
        return
    _put_off_since, _comes_again = None, False  # two that come at once are one
    signal.default_int_handler(number, frame)


def _is_inside(frame: FrameType | None) -> bool:
    """Whether the main thread is in a session, and does not wait there with nothing in its hands."""
    while frame is not None:
        if _waits(frame):
            return False
        if frame.f_globals.get("__name__", "").startswith(_SESSIONS):
            return True
        frame = frame.f_back
    return False


def _waits(frame: FrameType) -> bool:
    name = frame.f_code.co_qualname
    if name == "Condition.wait":  # of a line, and not of a thread that is started
        return frame.f_back is not None and frame.f_back.f_code.co_name == "read"
    return name in ("Waiter.sleep", "Readiness.readable")


def _interrupt_again() -> None:
    global _comes_again
    time.sleep(_AGAIN)
    if not _comes_again:
        return
    _comes_again = False
    if hasattr(signal, "pthread_kill"):  # which ends a wait of the main thread, too
        signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGINT)
    else:
        _thread.interrupt_main()
