"""The options of a session: its times, and the messages that end a motion."""

from __future__ import annotations

from dataclasses import dataclass, fields
from math import isfinite

from stagewire._framings.header.message import FramedMessage
from stagewire.errors import OutOfRangeError


@dataclass(frozen=True)
class SessionOptions:
    """The times of a session, in seconds.

    :param pacing: pause after a frame without a reply, before the next one to that controller. A controller
        without time to carry out a command may lose the next one.
    :param quiet: period after a request was given up during which an answer counts as its late reply. The
        same request waits until it has passed.
    :param silence: silence after which an incomplete frame is given up.
    :param drain: silence after which a line with replies without frames is used again, if a reply was
        overdue.
    :param reply_timeout: default timeout for a reply.
    :param motion_timeout: default timeout for the end of a motion.

    Raises :class:`~stagewire.errors.OutOfRangeError` for an invalid number of seconds.
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
                    f"{field.name} must be a number of seconds, {at_least} 0, not {seconds!r}"
                )


@dataclass(frozen=True)
class Ends:
    """The message classes with which a controller reports the end of a motion; one form of each suffices.

    :param completed: the motion was completed.
    :param stopped: the motion was stopped before.
    """

    completed: tuple[type[FramedMessage], ...] = ()
    stopped: tuple[type[FramedMessage], ...] = ()
