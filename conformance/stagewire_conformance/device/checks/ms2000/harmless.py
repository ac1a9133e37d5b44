"""Random bytes and values that do no harm, even if some are lost or reading starts anywhere.

Commands of this protocol, and of the one that it imitates, are printable characters. So none of these bytes
is printable, or has a meaning for a text line or a serial port.
"""

from __future__ import annotations

from random import Random
from typing import Final

from stagewire_ms2000 import PROTOCOL

END: Final = bytes((PROTOCOL.marks.terminator,))
"""The terminator of a command."""
_LINE: Final = b"\n\r\x11\x13"
"""Line ends, XON and XOFF."""

HARMLESS: Final = bytes(
    byte
    for byte in (*range(0x20), *range(0x80, 0x100))
    if byte not in _LINE and byte not in (*PROTOCOL.axes.values(), *PROTOCOL.marks.pair)
)
"""Bytes that occur in no command, axis, line end or setup command."""

_TRIES: Final = 1000


def harmless_bytes(random: Random, count: int) -> bytes:
    """Return random bytes of :data:`HARMLESS`."""
    return bytes(random.choices(HARMLESS, k=count))


def harmless_value(random: Random, low: int, high: int, size: int) -> int:
    """Return a number from ``low`` to ``high`` without a byte that could start a command.

    So its last bytes are harmless even if the first ones are lost. If the range has no such number, return
    any number in it.

    :param size: the number of bytes on the wire.
    """
    commands = {*PROTOCOL.rule.requests, *PROTOCOL.marks.pair}
    value = random.randint(low, high)
    for _ in range(_TRIES):
        if commands.isdisjoint((value % 256**size).to_bytes(size, "little")):
            return value
        value = random.randint(low, high)
    return value
