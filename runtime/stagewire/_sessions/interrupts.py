"""Defer Ctrl-C to a moment that does no harm: never in the middle of a step of a session.

Python raises ``KeyboardInterrupt`` between any two steps of the main thread. Within a session it would leave
a frame taken from the queue and not written, a reply that is read and delivered to nobody, or a turn to read
that nobody has. So while a session is open, an interrupt that comes there is raised some milliseconds later:
where the thread waits, or when it has left the session. A program with a handler of its own keeps it.

The handler recognises frames by their code objects. :func:`defers_interrupts` registers those of a class,
:func:`reads_link` the function that reads a link, and ``_WAITS`` refers to the functions that wait.
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
_LONGEST: Final = 2.0  # seconds; a third-party link may wait where this module knows nothing of it

_WAITS: Final = frozenset({Waiter.sleep.__code__, Readiness.readable.__code__})
_CONDITION_WAIT: Final = threading.Condition.wait.__code__
_deferring: Final[set[CodeType]] = set()
_reading: Final[set[CodeType]] = set()

_put_off_since: float | None = None
_comes_again = False

_T = TypeVar("_T", bound=type)
_F = TypeVar("_F", bound=Callable[..., Any])


def defers_interrupts(cls: _T) -> _T:
    """Register the methods and properties of a class, in which no interrupt is raised."""
    for member in vars(cls).values():
        functions = (member.fget, member.fset) if isinstance(member, property) else (member,)
        for function in functions:
            function = getattr(function, "__wrapped__", function)
            if isinstance(function, FunctionType):
                _deferring.add(function.__code__)
    return cls


def reads_link(function: _F) -> _F:
    """Register the function that reads a link; an interrupt is raised where that link waits."""
    _reading.add(function.__code__)
    return function


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
        if frame.f_code in _deferring:
            return True
        frame = frame.f_back
    return False


def _waits(frame: FrameType) -> bool:
    """Whether a frame waits: in a function of ours, or in a condition of the link that is read."""
    if frame.f_code is not _CONDITION_WAIT:
        return frame.f_code in _WAITS
    caller = frame.f_back
    if caller is not None and caller.f_globals is vars(threading):  # a thread is being started
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
    if hasattr(signal, "pthread_kill"):  # which ends a wait of the main thread, too
        signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGINT)
    else:
        _thread.interrupt_main()
