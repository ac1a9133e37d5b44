"""First contact with a controller of commands: whether what answers can be one at all.

Its replies have no frame, so that any byte could be one. A reply is let in here where it looks like one, if a
wrong one: to find what is wrong with it is for the checks. Noise, an echo and another protocol are not.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Final

from stagewire.protocols import Command
from stagewire_conformance.device.errors import NothingAnswersError
from stagewire_ms2000 import messages as m

if TYPE_CHECKING:
    from stagewire_conformance.device.lines.command_line import CommandLine

__all__ = ["first_contact"]

_MOTOR: Final = b"EMOT"
"""What an axis says that it is (section 7)."""
_TEXT: Final = 5
"""Bytes of the text of an identification; the sixth is told in two ways."""
_MOST: Final = 12
"""Bytes of an identification that is said twice; who says more does not answer what was asked."""
_BUSY: Final = (b"B", b"b", b"N", b"n")
"""Letters of a status, and small and capital exchanged."""
_ROUND: Final = 1.0
"""Seconds in which all axes are asked one thing."""


def first_contact(line: CommandLine) -> tuple[dict[str, int | str], bool]:
    """Ask the axes what they are, and in the format of commands if none answers rightly at once.

    Returns what the first one says, nothing where one tells its status but not what it is; and whether the
    controller was found in the other format. Raises :class:`.NothingAnswersError` where no reply comes.
    """
    first = told = _identification(line)
    found_in_text = False
    if not told.startswith(_MOTOR):  # nothing, or an error message of the other format
        line.send(m.SwitchToLowLevel())
        told = _identification(line)
        found_in_text = bool(told) and told != first
    if told:
        return {
            "identification": told.decode("ascii", "backslashreplace").rstrip(": ")
        }, found_in_text
    if _tells_status(line):
        return {}, False
    raise NothingAnswersError(_nothing(line))


def _identification(line: CommandLine) -> bytes:
    """Return what the first axis that says what it is says; empty where none does.

    What is no right answer has to come twice, as noise does not.
    """
    request = m.ReadIdentification()
    for axis, told in _answers(line, request):
        if told.startswith(_MOTOR) or (_is_text(told) and told == _ask(line, request, axis)):
            return told
    return b""


def _tells_status(line: CommandLine) -> bool:
    """Return whether an axis tells its status, twice."""
    request = m.ReadStatus()
    return any(
        told in _BUSY and _ask(line, request, axis) in _BUSY
        for axis, told in _answers(line, request)
    )


def _answers(line: CommandLine, request: Command) -> Iterator[tuple[int, bytes]]:
    """Yield what comes from each axis, until the time is over or something talks on and on."""
    end = line.now + _ROUND
    for place in line.declared.places:
        if (left := end - line.now) <= 0:
            return
        told = _ask(line, request, place.address, left)
        if len(told) > _MOST:
            return
        yield place.address, told


def _ask(line: CommandLine, request: Command, axis: int, left: float = _ROUND) -> bytes:
    return line.ask(request, axis, min(left, _ROUND / len(line.declared.places)))


def _is_text(told: bytes) -> bool:
    """Return whether bytes could be the text of an identification, though another one."""
    text = told[:_TEXT]
    return len(text) == _TEXT and text.isascii() and text.decode("ascii").isprintable()


def _nothing(line: CommandLine) -> str:
    name = line.declared.unit.name
    came = sum(len(entry.raw) for entry in line.log if not entry.sent)
    if came:
        return (
            f"no {name} answers at {line.url}: {came} bytes came that are no reply (another baud rate, "
            "or another kind of controller?)"
        )
    axes = ", ".join(place.name for place in line.declared.places)
    return (
        f"nothing answers at {line.url}: none of the axes {axes} says what it is, neither at once nor "
        f"after 255 66, which switches to the low-level format. Is the {name} "
        "switched on, is this its port, and is the baud rate that of its switches?"
    )
