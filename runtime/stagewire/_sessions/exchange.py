"""One thing that is asked or begun, and how it ended."""

from __future__ import annotations

from collections.abc import Callable

from stagewire.errors import OutOfRangeError

TYPE_CHECKING = False  # typing would take half of the time of an import
if TYPE_CHECKING:
    from typing import Any

    from stagewire.errors import StagewireError


class Exchange:
    """One thing that is asked or begun; made by a core, and ended by it.

    :param message: what is sent; a line of text where the controller takes text.
    :param raw: its bytes.
    :param timeout: seconds that it may take, the time that it waits to be sent included.
    :param deadline: when they are over, in seconds of the core's time.
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
        """Whether its bytes were handed out, to be written."""
        self.done = False
        """Whether it has ended, well or not."""
        self.result: Any = None
        """What came: a frame, the reply to a command, a line of text; None where nothing comes."""
        self.error: StagewireError | None = None
        """Why nothing came."""
        self.on_done: Callable[[Any], object] | None = None
        """Called once with the exchange, within the call of the core that ended it."""
        self.on_written: Callable[[Any], object] | None = None
        """Called once with the exchange, within the call of the core that handed out its bytes."""

    @property
    def is_question(self) -> bool:
        """Whether it only asks: nothing is carried out, and it may be asked again."""
        return False

    def __repr__(self) -> str:
        state = "done" if self.done else "written" if self.written else "waiting"
        return f"<{type(self).__name__} {self.message!r}: {state}>"

    @property
    def name(self) -> str:
        """What is sent, for people."""
        layout = getattr(self.message, "layout", None)
        return repr(self.message) if layout is None else str(layout.message)

    def value(self) -> Any:
        """Return what came, or raise why nothing did."""
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
        """End it, unless it has ended."""
        if self.done:
            return
        self.done = True
        self.result = result
        self.error = error
        if self.on_done is not None:
            self.on_done(self)


def deadline_of(timeout: float, now: float) -> float:
    """Return when a timeout is over that begins now.

    Raises :class:`~stagewire.errors.OutOfRangeError` for what is no number of seconds above 0, or none
    that ever passes.
    """
    deadline = now + timeout
    if not now < deadline < float("inf"):
        raise OutOfRangeError(f"a timeout is a number of seconds above 0, not {timeout!r}")
    return deadline
