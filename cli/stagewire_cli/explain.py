"""Why bytes are no frame: which of them are wrong, and what was expected there."""

from __future__ import annotations

from collections.abc import Iterator

from stagewire.errors import (
    BadLengthError,
    CodecError,
    DecodeError,
    TruncatedError,
    UnknownMessageError,
)
from stagewire.header import DATA_FLAG, HEADER_SIZE
from stagewire.protocol import Protocol
from stagewire_cli.formats.task import FramedTask, Task

__all__ = ["explain"]

_SHOWN = 64


def explain(task: Task, raw: bytes, error: DecodeError | UnknownMessageError) -> Iterator[str]:
    """Yield lines that show the bytes, mark the wrong ones and say what was expected."""
    framed = isinstance(task, FramedTask)
    wrong = _wrong_in_frame(raw, error) if framed else _wrong_in_slots(task, raw, error)
    start = max(0, min(wrong.start - HEADER_SIZE, len(raw) - _SHOWN)) if wrong.start > _SHOWN else 0
    shown = range(start, min(max(len(raw), wrong.start + 1), start + _SHOWN))
    lead = "... " if start else ""
    more = " ..." if shown.stop < len(raw) else ""
    cells = [f"{raw[i]:02X}" if i < len(raw) else "  " for i in shown]
    marks = ["^^" if i in wrong else "  " for i in shown]
    yield f"{lead}{' '.join(cells)}{more}".rstrip()
    yield f"{' ' * len(lead)}{' '.join(marks)}".rstrip()
    yield f"{error.code}: {error}"
    if framed:
        yield from (f"hint: {hint}" for hint in _hints(task.protocol, raw, error))


def _wrong_in_frame(raw: bytes, error: DecodeError | UnknownMessageError) -> range:
    """Return the positions of the bytes that the refusal of a frame is about."""
    if isinstance(error, UnknownMessageError):
        return range(2)
    if isinstance(error, TruncatedError):
        return range(len(raw), len(raw) + 1) if len(raw) < HEADER_SIZE else range(2, 4)
    has_packet = bool(raw[4] & DATA_FLAG)
    if _lacks_flag(raw):
        return range(4, 5)
    if isinstance(error, BadLengthError):
        return range(2, 4) if has_packet else range(4, 5)
    return range(HEADER_SIZE + (_declared(raw) if has_packet else 0), len(raw))


def _wrong_in_slots(task: Task, raw: bytes, error: DecodeError | UnknownMessageError) -> range:
    """Return the positions of the bytes that the refusal of a command or a reply is about."""
    if isinstance(error, UnknownMessageError):
        return range(1, 2)
    if isinstance(error, BadLengthError):
        return range(2, 3)
    if isinstance(error, TruncatedError):
        return range(len(raw), len(raw) + 1)
    whole = next((end for end in range(1, len(raw)) if _decodes(task, raw[:end])), 0)
    return range(whole, len(raw))


def _decodes(task: Task, raw: bytes) -> bool:
    try:
        task.decode(raw)
    except CodecError:
        return False
    return True


def _hints(
    protocol: Protocol, raw: bytes, error: DecodeError | UnknownMessageError
) -> Iterator[str]:
    ids = {cls.layout.id: cls.layout.message for cls in protocol.messages}
    if isinstance(error, UnknownMessageError):
        turned = raw[0] << 8 | raw[1]
        if turned in ids:
            yield (
                f"{turned:#06x} is {ids[turned]}; the id comes low byte first: "
                f"{raw[1]:02X} {raw[0]:02X}"
            )
        return
    if _lacks_flag(raw):
        yield (
            f"bytes 2 and 3 would declare exactly the {len(raw) - HEADER_SIZE} bytes that follow: "
            f"byte 4 seems to lack the bit of a data packet ({raw[4] | DATA_FLAG:#04x})"
        )
    elif error.code == "trailing":
        yield "several frames in one text are read from a file, from standard input, or with --end"


def _lacks_flag(raw: bytes) -> bool:
    """Whether this is a data frame but for the bit that announces its packet."""
    following = len(raw) - HEADER_SIZE
    return following > 0 and not raw[4] & DATA_FLAG and _declared(raw) == following


def _declared(raw: bytes) -> int:
    return raw[2] | raw[3] << 8
