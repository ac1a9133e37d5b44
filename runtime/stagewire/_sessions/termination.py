r"""Last words of sessions: bytes that are sent at the end of the process, or when a signal ends it.

Importing this module installs nothing. Opening the first session registers a function with :mod:`atexit`. In
the main thread it also installs a handler for each signal that asks a process to end: ``SIGTERM``;
``SIGHUP``, which a closed terminal or a dropped ssh session sends; ``SIGQUIT`` (Ctrl-\); and ``SIGBREAK`` on
Windows. The handler sends the last words of all sessions, and then the signal takes its default action.
Ctrl-C has its own handler (:mod:`stagewire._sessions.interrupts`). A signal that the program handles or
ignores (``nohup``) is left alone; if its handler ends the program normally, ``atexit`` follows. A killed
process (``SIGKILL``, ``TerminateProcess``) sends nothing. Neither does a fork, because the controllers belong
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
        """Send the last words and nothing else. Runs in a signal handler, so it must not wait for a lock."""

    def end_at_exit(self) -> None:
        """Send the last words at the end of the process, and close everything that can be closed."""

    def leave_to_parent(self) -> None:
        """Disable the session in a fork, where the threads that hold its locks and turns do not exist."""


_open: dict[Terminating, None] = {}
"""The open sessions, in the order in which they were opened."""

_changing = threading.RLock()  # guards the open sessions and the installed handlers
_knows_forks = False  # a fork handler cannot be unregistered


def remember(session: Terminating) -> None:
    """Register a session that was opened, so that its last words are sent."""
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
    """Unregister a session that was closed. After the last one, remove all handlers."""
    with _changing:
        _open.pop(session, None)
        if _open:
            return
        atexit.unregister(_at_exit)
        for number, (default, ours) in _HANDLERS.items():
            _replace(number, ours, default)


def _replace(number: signal.Signals, old: _Handler, new: _Handler) -> None:
    """Replace the handler of a signal, if this is possible here and the program has not replaced it."""
    if threading.current_thread() is threading.main_thread() and signal.getsignal(number) is old:
        signal.signal(number, new)


def _at_exit() -> None:
    for session in tuple(_open):
        with contextlib.suppress(Exception):  # the other sessions still send theirs
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
"""The signals that ask a process to end. Not all of them exist on every system."""

_HANDLERS: Final[dict[signal.Signals, tuple[_Handler, _Handler]]] = {
    **{
        number: (signal.SIG_DFL, _on_termination)
        for number in signal.Signals
        if number.name in _ENDING
    },
    signal.SIGINT: (signal.default_int_handler, on_interrupt),
}
"""The signals that are handled while a session is open: the default handler, and ours."""
