"""Defer Ctrl-C to a safe moment: never in the middle of a step of a session.

Python raises ``KeyboardInterrupt`` between any two steps of the main thread. Inside a session this would lose
a frame that was taken from the queue but not written, a reply that was read but not delivered, or the turn to
read. So while a session is open, such an interrupt is raised some milliseconds later, when the thread waits
or has left the session. A handler installed by the program is kept.

The handler recognises frames by their code objects. :func:`defers_interrupts` registers those of a class,
:func:`reads_link` the function that reads a link, and ``_WAITS`` lists the functions that wait.
"""

from __future__ import annotations

import _thread
import signal
import threading
import time
from collections.abc import Callable
from types import CodeType, FrameType, FunctionType
from typing import Any, Final, TypeVar

from stagewire._links.descriptor import Readiness
from stagewire._sessions.waiters import Waiter

_AGAIN: Final = 0.005  # seconds
_LONGEST: Final = 2.0  # seconds; a third-party link may wait in unknown functions

_WAITS: Final = frozenset({Waiter.sleep.__code__, Readiness.readable.__code__})
_CONDITION_WAIT: Final = threading.Condition.wait.__code__
_deferring: Final[set[CodeType]] = set()
_reading: Final[set[CodeType]] = set()

_put_off_since: float | None = None
_comes_again = False

_T = TypeVar("_T", bound=type)
_F = TypeVar("_F", bound=Callable[..., Any])


def defers_interrupts(cls: _T) -> _T:
    """Register the methods and properties of a class. No interrupt is raised inside them."""
    for member in vars(cls).values():
        functions = (member.fget, member.fset) if isinstance(member, property) else (member,)
        for function in functions:
            function = getattr(function, "__wrapped__", function)
            if isinstance(function, FunctionType):
                _deferring.add(function.__code__)
    return cls


def reads_link(function: _F) -> _F:
    """Register the function that reads a link. Interrupts are raised while the link waits."""
    _reading.add(function.__code__)
    return function


def on_interrupt(number: int, frame: FrameType | None) -> None:
    """Raise ``KeyboardInterrupt``, now or soon; the handler of ``SIGINT``."""
    global _put_off_since, _comes_again
    now = time.monotonic()
    since = _put_off_since
    if since is None or now > since + 2 * _LONGEST:  # left over from one raised by another handler
        since = now
    if now < since + _LONGEST and _is_inside(frame):
        _put_off_since = since
        if not _comes_again:
            _comes_again = True
            # Not threading.Thread: the main thread may hold its locks now.
            _thread.start_new_thread(_interrupt_again, ())
        return
    _put_off_since, _comes_again = None, False  # two at the same time count as one
    signal.default_int_handler(number, frame)


def _is_inside(frame: FrameType | None) -> bool:
    """Whether the main thread is inside a session and not waiting there."""
    while frame is not None:
        if _waits(frame):
            return False
        if frame.f_code in _deferring:
            return True
        frame = frame.f_back
    return False


def _waits(frame: FrameType) -> bool:
    """Whether a frame waits: in one of our functions, or in a condition of the link being read."""
    if frame.f_code is not _CONDITION_WAIT:
        return frame.f_code in _WAITS
    caller = frame.f_back
    if caller is not None and caller.f_globals is vars(threading):  # starting a thread
        return False
    while caller is not None and caller.f_code not in _deferring:
        caller = caller.f_back
    return caller is not None and caller.f_code in _reading


def _interrupt_again() -> None:
    global _comes_again
    time.sleep(_AGAIN)
    if not _comes_again:
        return
    _comes_again = False
    if hasattr(signal, "pthread_kill"):  # also ends a wait of the main thread
        signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGINT)
    else:
        _thread.interrupt_main()
