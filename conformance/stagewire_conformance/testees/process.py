"""A testee as a child process. Every wait has a timeout."""

from __future__ import annotations

import contextlib
import os
import queue
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections import deque
from collections.abc import Sequence
from typing import IO

from stagewire_conformance.testees.case import EndedError, NotStartedError, SilentError

LONGEST = 64 * 1024 * 1024
"""The maximum length of a line in bytes. A longer line arrives in pieces and is not a valid answer."""

_WAITING = 1_000
_SAID = 8 * 1024
_PATIENCE = 2.0


class Process:
    """One run of a testee.

    One thread writes and one reads, so that a blocked pipe cannot block the other direction. A third thread
    keeps the end of standard error. The lines are not interpreted here.

    Raises :class:`NotStartedError` if the program does not exist or cannot be run.
    """

    def __init__(self, command: Sequence[str]) -> None:
        try:
            self._child = subprocess.Popen(
                [shutil.which(command[0]) or command[0], *command[1:]],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                # Ctrl-C goes to this process, which then ends the child and its processes
                start_new_session=True,
                creationflags=getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0),
            )
        except (OSError, ValueError) as error:
            reason = error.strerror if isinstance(error, OSError) else str(error)
            raise NotStartedError(f"{command[0]} cannot be run: {reason}") from None
        self._to_write: queue.SimpleQueue[bytes | None] = queue.SimpleQueue()
        self._came: queue.Queue[bytes] = queue.Queue(_WAITING)
        self._said: deque[bytes] = deque()
        self._said_bytes = 0
        self._ended = False
        self._leaving = False
        self._end = ""
        self._threads = [
            threading.Thread(target=work, args=(pipe,), daemon=True)
            for work, pipe in (
                (self._write, self._child.stdin),
                (self._read, self._child.stdout),
                (self._listen, self._child.stderr),
            )
        ]
        for thread in self._threads:
            thread.start()

    def send(self, data: bytes) -> None:
        """Queue bytes for writing. Bytes that the testee does not read are lost when it ends."""
        self._to_write.put(data)

    def receive(self, timeout: float) -> bytes:
        """Return the next line, with its end.

        Raises :class:`EndedError` if no more lines can arrive, and :class:`SilentError` after ``timeout``
        seconds without one.
        """
        if self._ended:
            raise EndedError
        try:
            line = self._came.get(timeout=timeout)
        except queue.Empty:
            raise SilentError from None
        if not line:
            self._ended = True
            raise EndedError
        return line

    def early(self) -> bytes:
        """Return a line that has already arrived, or nothing."""
        try:
            line = b"" if self._ended else self._came.get_nowait()
        except queue.Empty:
            return b""
        self._ended = self._ended or not line
        return line

    def said(self) -> str:
        """Return the end of its standard error."""
        return b"".join(self._said)[-_SAID:].decode("utf-8", errors="replace").strip()

    def end(self, patience: float = 0.0) -> str:
        """End the process and all processes that it started; return a phrase such as ``has ended with …``.

        :param patience: seconds to wait until it ends by itself after its input has ended.
        """
        if not self._leaving:
            self._leaving = True
            self._to_write.put(None)
            try:
                self._end = _how(self._child.wait(patience))
            except subprocess.TimeoutExpired:
                self._end = "is still running"
                _kill(self._child)
            self._settle()
        return self._end

    def _settle(self) -> None:
        """Wait until all output is read, and close the pipes. Another process may still hold them open."""
        deadline = time.monotonic() + _PATIENCE
        for thread in self._threads:
            while thread.is_alive() and time.monotonic() < deadline:
                self._drop_lines()
                thread.join(0.01)
        self._drop_lines()
        self._ended = True
        for thread, pipe in zip(
            self._threads,
            (self._child.stdin, self._child.stdout, self._child.stderr),
            strict=True,
        ):
            if not thread.is_alive() and pipe is not None:
                with contextlib.suppress(OSError):
                    pipe.close()

    def _drop_lines(self) -> None:
        with contextlib.suppress(queue.Empty):
            while True:
                self._came.get_nowait()

    def _write(self, pipe: IO[bytes]) -> None:
        with contextlib.suppress(OSError, ValueError):  # it has ended, which the reader notices
            while (data := self._to_write.get()) is not None:
                pipe.write(data)
                pipe.flush()
        with contextlib.suppress(OSError, ValueError):
            pipe.close()

    def _read(self, pipe: IO[bytes]) -> None:
        with contextlib.suppress(OSError, ValueError):
            while line := pipe.readline(LONGEST):
                if not self._leaving:
                    self._came.put(line)
        self._came.put(b"")

    def _listen(self, pipe: IO[bytes]) -> None:
        with contextlib.suppress(OSError, ValueError):
            while data := os.read(pipe.fileno(), 64 * 1024):
                self._said.append(data)
                self._said_bytes += len(data)
                while self._said_bytes - len(self._said[0]) > _SAID:
                    self._said_bytes -= len(self._said.popleft())


def _kill(child: subprocess.Popen[bytes]) -> None:
    """End a process and all processes that it started, and wait for it."""
    if sys.platform == "win32":
        words = ["taskkill", "/F", "/T", "/PID", str(child.pid)]
        subprocess.run(words, capture_output=True, check=False)
        child.kill()
    else:
        with contextlib.suppress(OSError):  # all have ended
            os.killpg(child.pid, signal.SIGKILL)
    child.wait()


def _how(code: int) -> str:
    """Return how a process ended, from its return code."""
    if code >= 0:
        return f"has ended with exit status {code}"
    names = {sign.value: sign.name for sign in signal.Signals}
    return f"was ended by {names.get(-code, f'signal {-code}')}"
