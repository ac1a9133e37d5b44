"""What the user of a session may choose: its times, and what is said at the end of a motion."""

from __future__ import annotations

from dataclasses import dataclass, fields
from math import isfinite

from stagewire._framings.header.message import FramedMessage
from stagewire.errors import OutOfRangeError


@dataclass(frozen=True)
class SessionOptions:
    """The times of a session, in seconds.

    :param pacing: after a frame without a reply, the next one to that controller waits so long: a
        controller that is not given time to carry out one command may lose the next.
    :param quiet: for so long after a request was given up, what answers it is taken for its late reply;
        meanwhile the same question waits.
    :param silence: when no more of a frame came for so long, its rest will not come.
    :param drain: a line whose replies have no frame, and one of which is overdue, is used again when
        nothing came for so long.
    :param reply_timeout: the time for a reply where the caller names none.
    :param motion_timeout: the time for the end of a motion where the caller names none.

    Raises :class:`~stagewire.errors.OutOfRangeError` for what is no such number of seconds.
    """

    pacing: float = 0.010
    quiet: float = 0.5
    silence: float = 0.050
    drain: float = 0.2
    reply_timeout: float = 1.0
    motion_timeout: float = 60.0

    def __post_init__(self) -> None:
        for field in fields(self):
            seconds = getattr(self, field.name)
            at_least = "at least" if field.name == "pacing" else "more than"
            number = isinstance(seconds, (int, float)) and isfinite(seconds)
            if not number or seconds < 0 or (seconds == 0 and field.name != "pacing"):
                raise OutOfRangeError(
                    f"{field.name} is a number of seconds, {at_least} 0, not {seconds!r}"
                )


@dataclass(frozen=True)
class Ends:
    """The classes of what a controller says at the end of a motion; one form of each is enough.

    :param completed: it came to its own end.
    :param stopped: it was stopped before.
    """

    completed: tuple[type[FramedMessage], ...] = ()
    stopped: tuple[type[FramedMessage], ...] = ()
