"""Values whose bytes look like a setup command, refused on request.

A controller that looks for the prefix anywhere, and not only where a command is due, takes the prefix
and the byte of a setup command inside a value for that setup command: it could reset in the middle of a
move. One count more or less does not always help, since the two bytes may be the upper ones.
"""

from __future__ import annotations

from collections.abc import Callable

from stagewire.commands.command import Command
from stagewire.commands.marks import Marks
from stagewire.commands.rule import SLOTS
from stagewire.errors import OutOfRangeError

TYPE_CHECKING = False  # typing would take half of the time of an import
if TYPE_CHECKING:
    from typing import Final

__all__ = ["refuse_prefix"]

Encode = Callable[[Command], bytes]

_BLOCKS: Final = tuple(1 << bits for bits in range(64, -1, -8))
"""Numbers of values that share their upper bytes, the largest first."""


def _find_prefix(raw: bytes, marks: Marks) -> int | None:
    """Return where the prefix and the byte of a setup command stand, None when they do not."""
    at = raw.find(marks.prefix)
    while 0 <= at < len(raw) - 1:
        if raw[at + 1] in marks.setup:
            return at
        at = raw.find(marks.prefix, at + 1)
    return None


def refuse_prefix(message: Command, raw: bytes, encode: Encode) -> None:
    """Raise :class:`~stagewire.errors.OutOfRangeError` when ``raw`` looks like a setup command.

    The text names the nearest safe values of the field that is to blame.

    :param message: the command that ``raw`` is.
    :param encode: makes such bytes of another command of the same class.
    """
    marks = message.marks
    at = _find_prefix(raw, marks)
    if at is None:
        return
    layout = message.layout
    name = layout.message
    advice = "no value nearby avoids it"
    fields = message.values() if at < SLOTS + layout.length else {}  # else it is among extra bytes
    for field, value in fields.items():
        if isinstance(value, bool) or not isinstance(value, int):
            continue
        nearest = (_safe(message, field, step, encode) for step in (-1, 1))
        safe = [str(value) for value in nearest if value is not None]
        if safe:
            name = f"{name}.{field} {int(value)}"
            advice = (
                f"the nearest safe value{'s are' if len(safe) > 1 else ' is'} {' and '.join(safe)}"
            )
            break
    byte = raw[at + 1]
    raise OutOfRangeError(
        f"{name} is not sent: bytes {at} and {at + 1} of the command would be {marks.prefix:02x} "
        f"{byte:02x}, which a controller may take for {marks.setup[byte]}; {advice}"
    )


def _safe(message: Command, field: str, step: int, encode: Encode) -> int | None:
    """Return the nearest value of ``field`` in one direction that makes the whole command safe."""
    marks = message.marks

    def encoded(value: int) -> bytes | None:
        try:
            return encode(message.replace(**{field: value}))
        except OutOfRangeError:
            return None

    value: int = getattr(message, field) + step
    while (raw := encoded(value)) is not None:
        at = _find_prefix(raw, marks)
        if at is None:
            return value
        # What stands in upper bytes stays for all values below them: 65536 of them, or worse. Where the
        # lower bytes may be all zeros or all ones and the two bytes are the same, they always are.
        pair = raw[at : at + 2]
        for block in _BLOCKS:
            low, high = value & -block, value | block - 1
            ends = encoded(low), encoded(high)
            if all(end is not None and end[at : at + 2] == pair for end in ends):
                value = (high if step > 0 else low) + step
                break
    return None
