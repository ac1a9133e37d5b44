"""Every exception that Stagewire raises, in one tree.

A caller who catches :class:`StagewireError` catches all of them. Each error says what was wrong, where,
what was expected and what came. Errors about bytes or values carry a ``code``: the refusal code of the
testee protocol, so that a refusal reads the same in Python, on the command line and in the suite.
"""

from __future__ import annotations

__all__ = [
    "BadLengthError",
    "BadValueError",
    "CaptureError",
    "CodecError",
    "ControllerFaultError",
    "DamagedError",
    "DecodeError",
    "EncodeError",
    "LimitError",
    "LinkOpenError",
    "MissingFieldError",
    "MotionStopped",
    "MotionStoppedError",
    "MotionTimeout",
    "MotionTimeoutError",
    "MotionUnderWayError",
    "OutOfRangeError",
    "OutstandingReplyError",
    "ReplyTimeout",
    "ReplyTimeoutError",
    "SessionClosedError",
    "StagewireError",
    "SupportVersionError",
    "TargetNotReachedError",
    "TrailingBytesError",
    "TransportError",
    "TransportLost",
    "TransportLostError",
    "TruncatedError",
    "TurnedAwayError",
    "UnknownFieldError",
    "UnknownMessageError",
    "UnknownProtocolError",
    "UnknownScaleError",
    "UnsupportedError",
    "UnusableProtocolError",
    "WrongModeError",
    "WrongUnitError",
]


class StagewireError(Exception):
    """The root of all errors of this library."""


class CodecError(StagewireError):
    """Bytes or values that the registry does not allow.

    :param at: positions of the bytes that it is about; beyond the last one where bytes are missing,
        None where it is not about bytes.
    """

    code = "bad_value"

    def __init__(self, text: str, at: range | None = None) -> None:
        super().__init__(text)
        self.at = at


class DecodeError(CodecError):
    """Bytes that are not one whole frame of a known message."""


class TruncatedError(DecodeError):
    """The frame ends before the length that its own header declares."""

    code = "truncated"


class TrailingBytesError(DecodeError):
    """Bytes follow after the length that the frame's own header declares."""

    code = "trailing"


class BadLengthError(DecodeError):
    """The declared payload is shorter than the layout, or the message has no such form."""

    code = "bad_length"


class DamagedError(DecodeError):
    """The bytes that begin or end a frame, or its check, are not what they have to be."""

    code = "bad_value"


class UnknownMessageError(CodecError):
    """No message of the registry has this id or name."""

    code = "unknown_message"


class EncodeError(CodecError):
    """Values from which no frame is made; nothing was sent."""


class UnknownFieldError(EncodeError):
    """The message has no field of this name."""

    code = "unknown_field"


class MissingFieldError(EncodeError):
    """A field that has to be given was left out."""

    code = "missing_field"


class OutOfRangeError(EncodeError, ValueError):
    """A value outside the range of its field or of its format."""

    code = "out_of_range"


class BadValueError(EncodeError, TypeError):
    """A value of the wrong kind, such as text for a number."""

    code = "bad_value"


class UnsupportedError(CodecError):
    """What cannot be done without guessing, such as encoding an id without a layout, or without NumPy."""

    code = "unsupported"


class CaptureError(StagewireError):
    """A text that is no recorded session, or a line in one that says nothing.

    :param line: number of the line.
    :param text: what is wrong with it.
    :param file: name of the file, if it is one.
    """

    def __init__(self, line: int, text: str, file: object = None) -> None:
        named = "" if file is None else f"{file}, "
        super().__init__(f"{named}line {line}: {text}")
        self.line = line
        self.text = text

    def of(self, file: object) -> CaptureError:
        """Return the same, of a file."""
        return CaptureError(self.line, self.text, file)


class OutstandingReplyError(StagewireError):
    """A request has to wait: what comes next on the line may be the reply to another one."""


class UnknownProtocolError(StagewireError):
    """No protocol of this name is installed."""


class UnusableProtocolError(UnknownProtocolError):
    """A protocol of this name is installed, but by two packages, or by one that cannot be used."""


class SupportVersionError(StagewireError, ImportError):
    """A generated package needs another version of :mod:`stagewire.support` than the installed one."""


class UnknownScaleError(StagewireError):
    """The scale of a quantity is not known for this stage, controller or setting."""


class LimitError(OutOfRangeError):
    """A target outside the travel; nothing was sent."""


class TransportError(StagewireError):
    """The line to a controller cannot be used."""


class LinkOpenError(TransportError):
    """The line cannot be opened: no such port, no permission, nobody there."""


class TransportLostError(TransportError):
    """The line was open and is gone, whatever kind of line it is.

    What was being done may have been done or not; nothing is sent again. The state is unknown until it
    is read again, on a line that was opened again.

    :param line: what happened to the line.
    :param exchange: what is known of the message that waited, if one did.
    """

    def __init__(self, line: str, exchange: str = "") -> None:
        super().__init__(f"{line}; {exchange}" if exchange else line)
        self.line = line
        self.turned_away: TurnedAwayError | None = None
        """The error to raise instead where nothing that came was a message: all of it was text."""


class TurnedAwayError(LinkOpenError, TransportLostError):
    """The other end closed the connection before it sent a message, as it does when it has another host."""


class SessionClosedError(StagewireError):
    """The session was closed by this side; nothing was sent."""


class ReplyTimeoutError(StagewireError, TimeoutError):
    """No reply came in time. A late one is not taken for the reply to something else."""


class MotionTimeoutError(ReplyTimeoutError):
    """The end of a motion was not reported in time; it may still be under way.

    :param causes: the states that the controller showed when it was asked afterwards and that may hinder a
        motion, such as ``the channel is disabled``; empty where it showed none, or was not asked.
    """

    def __init__(self, text: str, causes: tuple[str, ...] = ()) -> None:
        super().__init__(text)
        self.causes = causes


class ControllerFaultError(StagewireError):
    """The controller reported a fault during a motion; the motion may still be under way.

    :param code: the controller's own fault code; 0: it reported none.
    :param fault: the controller's own words; empty: it reported none.
    :param message: the report.
    :param causes: as in :class:`MotionTimeoutError`.
    """

    def __init__(
        self,
        text: str,
        code: int = 0,
        fault: str = "",
        message: object = None,
        causes: tuple[str, ...] = (),
    ) -> None:
        super().__init__(text)
        self.code = code
        self.fault = fault
        self.message = message
        self.causes = causes


class TargetNotReachedError(StagewireError):
    """A motion ended further from its target than the tolerance; nothing moves any more.

    :param target: where it should have ended, in counts.
    :param position: where it ended, in counts.
    :param tolerance: in counts.
    :param unit: such as ``mm``; empty where the scale of the position is unknown.
    :param target_in_units: the target in that unit; None where the scale is unknown.
    :param position_in_units: the position, likewise.
    :param limits: names of the limit bits that were set, such as ``forward_hardware_limit``.
    :param end: the :class:`~stagewire.support.MotionEnd`.
    """

    def __init__(
        self,
        text: str,
        *,
        target: int,
        position: int,
        tolerance: int,
        unit: str = "",
        target_in_units: float | None = None,
        position_in_units: float | None = None,
        limits: tuple[str, ...] = (),
        end: object = None,
    ) -> None:
        super().__init__(text)
        self.target = target
        self.position = position
        self.tolerance = tolerance
        self.unit = unit
        self.target_in_units = target_in_units
        self.position_in_units = position_in_units
        self.limits = limits
        self.end = end


class MotionStoppedError(StagewireError):
    """A motion was stopped before its end.

    :param message: what the controller said.
    """

    def __init__(self, text: str, message: object = None) -> None:
        super().__init__(text)
        self.message = message


class MotionUnderWayError(StagewireError):
    """A motion is under way on this channel, or one may be; nothing was sent."""


class WrongUnitError(StagewireError):
    """The controller at the other end is another one than was named."""


class WrongModeError(StagewireError):
    """The controller expects another format now, such as lines of text; nothing was sent."""


# Names of 0.1 for the same classes; see docs/reference/versioning.md.
MotionStopped = MotionStoppedError
MotionTimeout = MotionTimeoutError
ReplyTimeout = ReplyTimeoutError
TransportLost = TransportLostError
