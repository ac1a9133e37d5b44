"""Every exception that Stagewire raises, in one tree.

Catch :class:`StagewireError` to catch all of them. Each message states what was wrong, where, what was
expected and what was found. Errors about bytes or values carry a ``code``: the refusal code of the testee
protocol. An error therefore has the same name in Python, on the command line and in the conformance suite.
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
    "NotReadyError",
    "OutOfRangeError",
    "OutstandingReplyError",
    "RecordingError",
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
    "UnknownSubMessageError",
    "UnsupportedError",
    "UnusableProtocolError",
    "WrongModeError",
    "WrongUnitError",
]


class StagewireError(Exception):
    """The root of all errors of this library."""


class CodecError(StagewireError):
    """Bytes or values that the registry does not allow.

    :param at: positions of the faulty bytes, past the last byte if bytes are missing; None if the error is
        not about bytes.
    """

    code = "bad_value"

    def __init__(self, text: str, at: range | None = None) -> None:
        super().__init__(text)
        self.at = at


class DecodeError(CodecError):
    """Bytes that are not one complete frame of a known message."""


class TruncatedError(DecodeError):
    """The frame is shorter than its header declares."""

    code = "truncated"


class TrailingBytesError(DecodeError):
    """Bytes follow after the length that the header of the frame declares."""

    code = "trailing"


class BadLengthError(DecodeError):
    """The declared payload is shorter than the layout, or the message does not have this form."""

    code = "bad_length"


class DamagedError(DecodeError):
    """The start bytes, the end bytes or the checksum of a frame are wrong."""

    code = "bad_value"


class UnknownMessageError(CodecError):
    """No message of the registry has this id or name."""

    code = "unknown_message"


class UnknownSubMessageError(UnknownMessageError):
    """No message of the id has this sub-message."""


class EncodeError(CodecError):
    """The values cannot be encoded as a frame; nothing was sent."""


class UnknownFieldError(EncodeError):
    """The message has no field of this name."""

    code = "unknown_field"


class MissingFieldError(EncodeError):
    """A required field is missing."""

    code = "missing_field"


class OutOfRangeError(EncodeError, ValueError):
    """A value is outside the range of its field or of its format."""

    code = "out_of_range"


class BadValueError(EncodeError, TypeError):
    """A value is invalid, such as text instead of a number."""

    code = "bad_value"


class UnsupportedError(CodecError):
    """The operation is not supported, for example because a layout is undocumented or NumPy is missing."""

    code = "unsupported"


class CaptureError(StagewireError):
    """A text is not a recorded session, or one of its lines is invalid.

    :param line: number of the line.
    :param text: what is wrong with the line.
    :param file: name of the file, if the text comes from a file.
    """

    def __init__(self, line: int, text: str, file: object = None) -> None:
        named = "" if file is None else f"{file}, "
        super().__init__(f"{named}line {line}: {text}")
        self.line = line
        self.text = text

    def of(self, file: object) -> CaptureError:
        """Return the same error with the name of a file."""
        return CaptureError(self.line, self.text, file)


class OutstandingReplyError(StagewireError):
    """The request has to wait, because the next bytes on the line may be the reply to another request."""


class UnknownProtocolError(StagewireError):
    """No protocol of this name is installed."""


class UnusableProtocolError(UnknownProtocolError):
    """A protocol of this name is installed, but by two packages or by a package that cannot be used."""


class SupportVersionError(StagewireError, ImportError):
    """A generated package requires a different version of :mod:`stagewire.support`."""


class UnknownScaleError(StagewireError):
    """The scale of a quantity is unknown for this stage, controller or setting.

    :param sources: sources with different figures; choose one with ``scale_source=``.
    :param instead: keyword to use instead of one for stages of the other kind, rotary or linear: ``deg`` or
        ``travel_mm``.
    """

    def __init__(self, message: str, *, sources: tuple[str, ...] = (), instead: str = "") -> None:
        super().__init__(message)
        self.sources = sources
        self.instead = instead


class LimitError(OutOfRangeError):
    """A value exceeds a limit of the stage, such as a target outside its travel; nothing was sent."""


class TransportError(StagewireError):
    """The line to a controller cannot be used."""


class LinkOpenError(TransportError):
    """The line cannot be opened: the port is missing, permission is denied, or the host does not answer."""


class TransportLostError(TransportError):
    """The connection was lost: a serial port or network connection that was open is gone.

    A request that was under way may or may not have reached the controller. Nothing is sent again. The state
    of the controller is unknown until it is read again after reconnecting.

    :param line: what happened to the line.
    :param exchange: what is known about the message that was waiting, if any.
    """

    def __init__(self, line: str, exchange: str = "") -> None:
        super().__init__(f"{line}; {exchange}" if exchange else line)
        self.line = line
        self.turned_away: TurnedAwayError | None = None
        """The error to raise instead if only text was received, and no message."""


class TurnedAwayError(LinkOpenError, TransportLostError):
    """The other end closed the connection before sending a message, often because it serves another host."""


class SessionClosedError(StagewireError):
    """The session was closed on this side; nothing was sent."""


class ReplyTimeoutError(StagewireError, TimeoutError):
    """No reply arrived in time. A late reply is never matched to another request."""


class MotionTimeoutError(ReplyTimeoutError):
    """The end of a motion was not reported in time; it may still be under way.

    :param causes: states that the controller reported after the timeout and that can prevent a motion, such
        as ``the channel is disabled``; empty if it reported none or was not asked.
    """

    def __init__(self, text: str, causes: tuple[str, ...] = ()) -> None:
        super().__init__(text)
        self.causes = causes


class ControllerFaultError(StagewireError):
    """The controller reported a fault during a motion; the motion may still be under way.

    :param code: fault code of the controller; 0 if it reported none.
    :param fault: text of the controller; empty if it reported none.
    :param message: the message that reported the fault.
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
    """A motion ended further from its target than the tolerance allows; it is not under way any more.

    :param target: target in counts.
    :param position: final position in counts.
    :param tolerance: tolerance in counts.
    :param unit: unit of the next two, such as ``mm``; empty if the scale of the position is unknown.
    :param target_in_units: target in ``unit``; None if the scale is unknown.
    :param position_in_units: final position in ``unit``; None if the scale is unknown.
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

    :param message: the message in which the controller reported it.
    """

    def __init__(self, text: str, message: object = None) -> None:
        super().__init__(text)
        self.message = message


class MotionUnderWayError(StagewireError):
    """A motion is or may be under way on this channel; nothing was sent."""


class NotReadyError(StagewireError):
    """The controller is in a state in which the motion cannot succeed; the motion was not sent.

    For example, its velocity parameters are 0, its home parameters cannot home, or its channel is disabled.
    A call that reads back what it has written, such as ``open_shutter()``, raises it if the controller
    reports another state.

    :param causes: short descriptions of the state, such as ``home_velocity is 0``.
    """

    def __init__(self, text: str, causes: tuple[str, ...] = ()) -> None:
        super().__init__(text)
        self.causes = causes


class RecordingError(StagewireError):
    """A recording could not begin, or is incomplete; motions are not affected."""


class WrongUnitError(StagewireError):
    """The connected controller is not the one that was named."""


class WrongModeError(StagewireError):
    """The controller is in another mode, such as one that expects lines of text; nothing was sent."""


# Names of 0.1 for the same classes; see docs/reference/versioning.md.
MotionStopped = MotionStoppedError
MotionTimeout = MotionTimeoutError
ReplyTimeout = ReplyTimeoutError
TransportLost = TransportLostError
