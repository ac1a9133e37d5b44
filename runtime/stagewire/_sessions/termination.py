r"""What sessions say last, however the process ends: at its end, and when a signal ends it.

An import installs nothing. Opening the first session registers a function with :mod:`atexit`. If that happens
in the main thread, it also installs a handler for each signal that asks a process to end: ``SIGTERM``;
``SIGHUP``, which a closed terminal or a dropped ssh session sends; ``SIGQUIT`` (Ctrl-\); and ``SIGBREAK`` on
Windows. The handler says the last words of all sessions, and then lets the signal do what it does by default.
Ctrl-C has a handler of its own (:mod:`stagewire._sessions.interrupts`). A signal that the program handles
or ignores (``nohup``) is left alone; if its handler ends the program in order, ``atexit`` follows. A process
that is killed (``SIGKILL``, ``TerminateProcess``) says nothing. Neither does a fork: the controllers belong
to the process that opened the sessions.
"""

from __future__ import annotations

import atexit
import contextlib
import os
import signal
import threading
from collections.abc import Callable
from types import FrameType
from typing import Final, Protocol, TypeAlias

from stagewire._sessions.interrupts import on_interrupt

_Handler: TypeAlias = Callable[[int, FrameType | None], object] | signal.Handlers


class Terminating(Protocol):
    """A session that is open."""

    def say_last(self) -> None:
        """Say the last words and no more; within a signal handler, so that it may wait for no lock."""

    def end_at_exit(self) -> None:
        """Say the last words at the end of the process, and close what can be closed."""

    def leave_to_parent(self) -> None:
        """Do nothing any more, in a fork: locks and turns are those of threads that are not here."""


_open: dict[Terminating, None] = {}
"""The sessions that are open, in the order in which they were opened."""

_changing = threading.RLock()  # the sessions that are open, and what hangs on there being any
_knows_forks = False  # what is called in a fork cannot be taken back


def remember(session: Terminating) -> None:
    """Let a session that was opened say its last words, from now on."""
    global _knows_forks
    with _changing:
        if not _open:
            atexit.register(_at_exit)
        if not _knows_forks and hasattr(os, "register_at_fork"):
            os.register_at_fork(after_in_child=_after_fork)
            _knows_forks = True
        _open[session] = None
        for number, (default, ours) in _HANDLERS.items():
            _replace(number, default, ours)


def forget(session: Terminating) -> None:
    """Let a session that was closed be; after the last one everything is as it was before."""
    with _changing:
        _open.pop(session, None)
        if _open:
            return
        atexit.unregister(_at_exit)
        for number, (default, ours) in _HANDLERS.items():
            _replace(number, ours, default)


def _replace(number: signal.Signals, old: _Handler, new: _Handler) -> None:
    """Handle a signal otherwise, where that is possible, and nobody else handles it."""
    if threading.current_thread() is threading.main_thread() and signal.getsignal(number) is old:
        signal.signal(number, new)


def _at_exit() -> None:
    for session in tuple(_open):
        with contextlib.suppress(Exception):  # the others have something to say, too
            session.end_at_exit()


def _after_fork() -> None:
    global _changing
    _changing = threading.RLock()
    for session in tuple(_open):
        with contextlib.suppress(Exception):
            session.leave_to_parent()
    _open.clear()


def _on_termination(number: int, frame: FrameType | None) -> None:
    for session in tuple(_open):
        with contextlib.suppress(Exception):
            session.say_last()
    signal.signal(number, signal.SIG_DFL)
    signal.raise_signal(number)


_ENDING: Final = ("SIGTERM", "SIGHUP", "SIGQUIT", "SIGBREAK")
"""The signals that ask a process to end; which of them exist depends on the system."""

_HANDLERS: Final[dict[signal.Signals, tuple[_Handler, _Handler]]] = {
    **{
        number: (signal.SIG_DFL, _on_termination)
        for number in signal.Signals
        if number.name in _ENDING
    },
    signal.SIGINT: (signal.default_int_handler, on_interrupt),
}
"""The signals that are handled while a session is open: the handler by default, and the one then."""
