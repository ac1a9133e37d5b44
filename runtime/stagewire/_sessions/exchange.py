"""Exchanges: one request, command or motion each, and its end."""

from __future__ import annotations

from collections.abc import Callable

from stagewire.errors import OutOfRangeError

TYPE_CHECKING = False  # importing typing would double the import time
if TYPE_CHECKING:
    from typing import Any

    from stagewire.errors import StagewireError


class Exchange:
    """One request, command or motion. The core creates and ends it.

    :param message: the message; a line of text if the controller accepts text.
    :param raw: its bytes.
    :param timeout: seconds that it may take, including the time before it is sent.
    :param deadline: end of the timeout, in seconds of the core's time.
    """

    __slots__ = (
        "deadline", "done", "error", "message", "on_done", "on_written", "raw", "result", "timeout",
        "written",
    )  # fmt: skip

    def __init__(self, message: object, raw: bytes, timeout: float, deadline: float) -> None:
        self.message: Any = message
        self.raw = raw
        self.timeout = timeout
        self.deadline = deadline
        self.written = False
        """Whether its bytes were handed out to be written."""
        self.done = False
        """Whether it has ended, successfully or not."""
        self.result: Any = None
        """The result: a frame, the reply to a command, a line of text; None if there is no reply."""
        self.error: StagewireError | None = None
        """The error, if it failed."""
        self.on_done: Callable[[Any], object] | None = None
        """Called once with the exchange, during the call of the core that ended it."""
        self.on_written: Callable[[Any], object] | None = None
        """Called once with the exchange, during the call of the core that handed out its bytes."""

    @property
    def is_question(self) -> bool:
        """Whether it only reads: nothing is carried out, so it can safely be repeated."""
        return False

    def __repr__(self) -> str:
        state = "done" if self.done else "written" if self.written else "waiting"
        return f"<{type(self).__name__} {self.message!r}: {state}>"

    @property
    def name(self) -> str:
        """The name of the message, for people."""
        layout = getattr(self.message, "layout", None)
        return repr(self.message) if layout is None else str(layout.message)

    def value(self) -> Any:
        """Return the result, or raise the error."""
        if self.error is not None:
            raise self.error
        return self.result

    # For the core

    def hand_out(self) -> bytes:
        """Note that the bytes are written now, and return them."""
        self.written = True
        if self.on_written is not None:
            self.on_written(self)
        return self.raw

    def end(self, result: object = None, error: StagewireError | None = None) -> None:
        """End the exchange, unless it has ended."""
        if self.done:
            return
        self.done = True
        self.result = result
        self.error = error
        if self.on_done is not None:
            self.on_done(self)


def deadline_of(timeout: float, now: float) -> float:
    """Return the deadline of a timeout that begins now.

    Raises :class:`~stagewire.errors.OutOfRangeError` unless the timeout is a finite number above 0.
    """
    deadline = now + timeout
    if not now < deadline < float("inf"):
        raise OutOfRangeError(
            f"a timeout must be a finite number of seconds above 0, not {timeout!r}"
        )
    return deadline
