"""First contact with a controller that has unframed commands.

Any byte could be a reply, so bytes that look like one are accepted, even if wrong: checks find out what is
wrong with them. Noise, an echo and other protocols are refused.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Final, Protocol

from stagewire.protocols import Command, SetupCommand
from stagewire_conformance.device.errors import NothingAnswersError
from stagewire_ms2000 import messages as m

if TYPE_CHECKING:
    from stagewire_conformance.device.declaration import Declaration
    from stagewire_conformance.device.results import Entry

_MOTOR: Final = b"EMOT"
"""The beginning of the identification of an axis (section 7)."""
_TEXT: Final = 5
"""Length of the text of an identification. The document describes the sixth byte in two ways."""
_MOST: Final = 12
"""Maximum length of a repeated identification. A longer answer is not one."""
_BUSY: Final = (b"B", b"b", b"N", b"n")
"""Letters of the status, in both cases."""
_ROUND: Final = 1.0
"""Seconds for one request to all axes."""


class Contact(Protocol):
    """A line to a controller."""

    declared: Declaration

    @property
    def url(self) -> str:
        """The URL of the line."""
        ...

    @property
    def now(self) -> float:
        """The time in seconds."""
        ...

    @property
    def log(self) -> Sequence[Entry]:
        """All traffic, in order."""
        ...

    def send(self, command: Command | SetupCommand) -> None:
        """Send a command."""
        ...

    def ask(self, command: Command, axis: int, wait: float) -> bytes:
        """Send a request and return everything that arrives."""
        ...


def first_contact(line: Contact) -> tuple[dict[str, int | str], bool]:
    """Request the identification of the axes. Without a right answer switch to the command format and repeat.

    Returns the first identification, empty if an axis reports only its status; and whether the controller was
    found in the other format. Raises :class:`.NothingAnswersError` without a reply.
    """
    first = answer = _identification(line)
    found_in_text = False
    if not answer.startswith(_MOTOR):  # no answer, or an error message of the other format
        line.send(m.SwitchToLowLevel())
        answer = _identification(line)
        found_in_text = bool(answer) and answer != first
    if answer:
        return {
            "identification": answer.decode("ascii", "backslashreplace").rstrip(": ")
        }, found_in_text
    if _tells_status(line):
        return {}, False
    raise NothingAnswersError(_nothing(line))


def _identification(line: Contact) -> bytes:
    """Return the first identification, or nothing.

    A wrong identification must arrive twice, because noise does not.
    """
    request = m.ReadIdentification()
    for axis, answer in _answers(line, request):
        if answer.startswith(_MOTOR) or (_is_text(answer) and answer == _ask(line, request, axis)):
            return answer
    return b""


def _tells_status(line: Contact) -> bool:
    """Return whether an axis reports its status, twice."""
    request = m.ReadStatus()
    return any(
        answer in _BUSY and _ask(line, request, axis) in _BUSY
        for axis, answer in _answers(line, request)
    )


def _answers(line: Contact, request: Command) -> Iterator[tuple[int, bytes]]:
    """Yield the answer of each axis, until the time is over or an answer is too long."""
    end = line.now + _ROUND
    for place in line.declared.places:
        if (left := end - line.now) <= 0:
            return
        answer = _ask(line, request, place.address, left)
        if len(answer) > _MOST:
            return
        yield place.address, answer


def _ask(line: Contact, request: Command, axis: int, left: float = _ROUND) -> bytes:
    return line.ask(request, axis, min(left, _ROUND / len(line.declared.places)))


def _is_text(answer: bytes) -> bool:
    """Return whether bytes could be the text of a wrong identification."""
    text = answer[:_TEXT]
    return len(text) == _TEXT and text.isascii() and text.decode("ascii").isprintable()


def _nothing(line: Contact) -> str:
    name = line.declared.unit.name
    came = sum(len(entry.raw) for entry in line.log if not entry.sent)
    if came:
        return (
            f"no {name} answers at {line.url}: {came} bytes arrived that are not a reply. Check "
            "the baud rate and the kind of controller"
        )
    axes = ", ".join(place.name for place in line.declared.places)
    return (
        f"no answer at {line.url}: none of the axes {axes} identifies itself, even after 255 66, "
        f"which switches to the low-level format. Check that the {name} is switched on, that this is its "
        "port, and that its switches set this baud rate"
    )
