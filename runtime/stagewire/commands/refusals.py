"""Why bytes are not exactly one command: slot by slot, the first one that is wrong."""

from __future__ import annotations

from stagewire.commands.rule import MAXIMUM_COMMAND, SLOTS, Rule
from stagewire.errors import (
    BadLengthError,
    DecodeError,
    TrailingBytesError,
    TruncatedError,
    UnknownMessageError,
)

__all__ = ["refusal"]


def refusal(title: str, rule: Rule, raw: bytes) -> DecodeError | UnknownMessageError:
    """Return what is wrong with bytes that are not exactly one command or setup command.

    :param title: of the protocol, for people.
    """
    marks = rule.marks
    end = marks.terminator
    if not raw:
        return _missing(raw, "a command begins with its axis or the prefix of a setup command")
    if raw[0] == end:
        return BadLengthError(f"byte 0: {end:#04x} ends a command that has no axis", range(1))
    if len(raw) == 1:
        return _missing(raw, "byte 1 is the byte of the command")
    byte = raw[1]
    if raw[0] == marks.prefix:
        if byte in marks.setup:
            return _trailing(raw, marks.setup[byte], 2)
        text = f"byte 1: no setup command of {title} has the byte {byte:#04x}"
        return UnknownMessageError(text, range(1, 2))
    if byte == end:
        return BadLengthError(f"byte 1: {end:#04x} aborts a command that has no byte", range(1, 2))
    if byte not in rule.requests:
        text = f"byte 1: no command of {title} has the byte {byte:#04x}"
        return UnknownMessageError(text, range(1, 2))
    return _behind_the_byte(rule, raw)


def _behind_the_byte(rule: Rule, raw: bytes) -> DecodeError:
    """Return what is wrong with the size of a command, its data or its end."""
    end = rule.marks.terminator
    request = rule.requests[raw[1]]
    name, length = request.name, request.length
    ways = f"{request.size}" if length else f"{request.size}, or {end:#04x} to leave it out"
    if len(raw) < SLOTS:
        return _missing(raw, f"{name}: byte 2 is its size, {ways}")
    if raw[2] == end and not length:
        return _trailing(raw, name, SLOTS)
    if raw[2] != request.size:
        came = f"{end:#04x}, which leaves it out" if raw[2] == end else f"{raw[2]}"
        return BadLengthError(f"{name}: byte 2 is its size, {ways}; not {came}", range(2, 3))
    found = raw.find(end, SLOTS + length, MAXIMUM_COMMAND)
    if found >= 0:
        return _trailing(raw, name, found + 1)
    if len(raw) >= MAXIMUM_COMMAND:
        text = f"{name}: {end:#04x} has to come within {MAXIMUM_COMMAND} bytes"
        return BadLengthError(text, range(MAXIMUM_COMMAND - 1, MAXIMUM_COMMAND))
    due = f"{length} bytes of data and {end:#04x} are due" if length else f"{end:#04x} is due"
    return _missing(raw, f"{name}: {due}")


def _missing(raw: bytes, text: str) -> TruncatedError:
    size = len(raw)
    return TruncatedError(f"{text}; the bytes end before byte {size}", range(size, size + 1))


def _trailing(raw: bytes, name: str, end: int) -> TrailingBytesError:
    more = len(raw) - end
    text = f"{name} ends before byte {end}; {more} byte{'s' if more > 1 else ''} more"
    return TrailingBytesError(text, range(end, len(raw)))
