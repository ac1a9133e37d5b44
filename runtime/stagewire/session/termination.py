"""What sessions say last, however the process ends: at its end, and when it is asked to terminate.

Nothing is installed by an import. When the first session is opened, :mod:`atexit` is told of it. If it was
opened in the main thread, and nobody else handles ``SIGTERM``, a handler says the last words of all sessions
before the signal does what it does by default. A program with a handler of its own keeps it; if that one
ends the program in order, ``atexit`` follows. A process that is killed (``SIGKILL``, ``TerminateProcess``)
says nothing.
"""

from __future__ import annotations

import atexit
import contextlib
import os
import signal
import threading
from types import FrameType
from typing import Protocol

__all__ = ["Terminating", "forget", "remember"]


class Terminating(Protocol):
    """A session that is open."""

    def say_last(self) -> None:
        """Say the last words and no more; within a signal handler, so that it may wait for no lock."""

    def end_at_exit(self) -> None:
        """Say the last words at the end of the process, and close what can be closed."""


_open: dict[Terminating, int] = {}
"""The sessions that are open, and the process that opened them: a fork has none of them."""


def remember(session: Terminating) -> None:
    """Let a session that was opened say its last words, from now on."""
    if not _open:
        atexit.register(_at_exit)
    _open[session] = os.getpid()
    if (
        threading.current_thread() is threading.main_thread()
        and signal.getsignal(signal.SIGTERM) is signal.SIG_DFL
    ):
        signal.signal(signal.SIGTERM, _on_sigterm)


def forget(session: Terminating) -> None:
    """Let a session that was closed be; after the last one everything is as it was before."""
    _open.pop(session, None)
    if _open:
        return
    atexit.unregister(_at_exit)
    if (
        threading.current_thread() is threading.main_thread()
        and signal.getsignal(signal.SIGTERM) is _on_sigterm
    ):
        signal.signal(signal.SIGTERM, signal.SIG_DFL)


def _sessions() -> list[Terminating]:
    return [session for session, process in _open.copy().items() if process == os.getpid()]


def _at_exit() -> None:
    for session in _sessions():
        with contextlib.suppress(Exception):  # the others have something to say, too
            session.end_at_exit()


def _on_sigterm(number: int, frame: FrameType | None) -> None:
    for session in _sessions():
        with contextlib.suppress(Exception):
            session.say_last()
    signal.signal(number, signal.SIG_DFL)
    signal.raise_signal(number)
