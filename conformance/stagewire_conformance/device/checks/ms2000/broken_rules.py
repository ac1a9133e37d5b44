"""The rule that a finding names: one for the reply of each request and for the silence of each command."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from stagewire.protocols import Command

COMMON: Final = (
    "status-answered",
    "position-reply",
    "increment-reply",
    "identification-reply",
    "position-and-status-reply",
    "current-speed-reply",
    "ramp-time-reply",
    "maximum-speed-reply",
    "target-reply",
    "status-byte-reply",
    "no-blanks-in-replies",
    "errors-ignored",
    "target-moves",
    "target-no-reply",
    "increment-write-no-reply",
    "ramp-time-no-reply",
    "top-speed-no-reply",
    "increment-written",
    "ramp-time-written",
    "top-speed-written",
    "status-busy",
    "status-not-busy",
    "status-moving-bit",
    "status-ramping-bits",
    "stop-disables",
    "start-enables",
    "top-speed-limits-travel",
    "stop-no-response",
    "start-no-response",
    "position-write-no-reply",
    "increment-up-no-response",
    "increment-down-no-response",
    "vector-speed-no-reply",
)
"""Rules that any check may find broken: every check reads, and every check of motion moves and stops."""

_REPLIES: Final[Mapping[str, str]] = {
    "READ_STATUS": "status-answered",
    "READ_MOTOR_POSITION": "position-reply",
    "READ_INCREMENT_VALUE": "increment-reply",
    "READ_IDENTIFICATION": "identification-reply",
    "READ_MOTOR_POSITION_AND_STATUS": "position-and-status-reply",
    "READ_CURRENT_SPEED": "current-speed-reply",
    "READ_RAMP_TIME": "ramp-time-reply",
    "READ_MAXIMUM_SPEED": "maximum-speed-reply",
    "READ_TARGET_POSITION": "target-reply",
    "READ_STATUS_BYTE": "status-byte-reply",
}
"""Request -> the rule about its reply."""

_SILENT: Final[Mapping[str, str]] = {
    "WRITE_MOTOR_POSITION": "position-write-no-reply",
    "WRITE_TARGET_POSITION": "target-no-reply",
    "INCREMENT_MOVE_UP": "increment-up-no-response",
    "INCREMENT_MOVE_DOWN": "increment-down-no-response",
    "WRITE_INCREMENT_VALUE": "increment-write-no-reply",
    "WRITE_RAMPING_TIME": "ramp-time-no-reply",
    "WRITE_TOP_SPEED": "top-speed-no-reply",
    "WRITE_VECTOR_SPEED": "vector-speed-no-reply",
    "START_MOTOR": "start-no-response",
    "STOP_MOTOR": "stop-no-response",
    "JOYSTICK_ENABLE": "joystick-enabled",
    "JOYSTICK_DISABLE": "joystick-disabled",
    "SWITCH_TO_LOW_LEVEL": "low-level-switch",
    "SWITCH_TO_HIGH_LEVEL": "high-level-switch",
}
"""Command -> the rule that it has no reply; of joystick and setup commands, the rule about the effect."""

_WRITES: Final[Mapping[str, str]] = {
    "WRITE_INCREMENT_VALUE": "increment-written",
    "WRITE_RAMPING_TIME": "ramp-time-written",
    "WRITE_TOP_SPEED": "top-speed-written",
}
"""Command -> the rule that it writes a setting."""

_MOVES: Final[Mapping[str, str]] = {
    "INCREMENT_MOVE_UP": "increment-up",
    "INCREMENT_MOVE_DOWN": "increment-down",
}
"""Increment command -> the rule about its target."""

_RANGES: Final[Mapping[str, str]] = {"READ_RAMP_TIME": "ramp-time-reply-range"}
"""Request -> the rule about the range of its value."""

_BLANKS: Final = b" \r\n"


def rule_of_reply(request: Command, came: bytes = b"", due: int = 0) -> str:
    """Return the rule about the reply to a request.

    :param came: what arrived, if its length is wrong.
    :param due: the number of bytes that the reply has.
    """
    surplus = came[due:]
    if surplus and not surplus.strip(_BLANKS):
        return "no-blanks-in-replies"
    return _REPLIES[request.layout.message]


def rule_of_value(message: str) -> str:
    """Return the rule about the value in the reply to a request."""
    return _RANGES.get(message) or _REPLIES[message]


def rule_of_silence(message: str) -> str:
    """Return the rule that a command has no reply."""
    return _SILENT.get(message, "no-blanks-in-replies")


def rule_of_write(message: str) -> str:
    """Return the rule that a command writes a setting."""
    return _WRITES[message]


def rule_of_motion(message: str) -> str:
    """Return the rule about the motion that a command causes."""
    if message == "WRITE_VECTOR_SPEED":
        return "vector-speed-runs"
    return _MOVES.get(message, "target-moves")


def rule_of_increment(message: str) -> str:
    """Return the rule about the target that an increment command sets."""
    return _MOVES[message]
