"""Bytes and values by seed that do no harm, whatever of them is lost and wherever reading begins.

Commands of this protocol and of the one that it imitates are printable characters. So no hostile byte is
printable, nor does one mean anything to a line of text or to a serial port.
"""

from __future__ import annotations

from random import Random
from typing import Final

from stagewire_ms2000 import PROTOCOL

END: Final = bytes((PROTOCOL.marks.terminator,))
"""What ends a command."""
_LINE: Final = b"\n\r\x11\x13"
"""Ends of lines, XON and XOFF."""

HARMLESS: Final = bytes(
    byte
    for byte in (*range(0x20), *range(0x80, 0x100))
    if byte not in _LINE and byte not in (*PROTOCOL.axes.values(), *PROTOCOL.marks.pair)
)
"""What no command, no axis, no end of a line and no setup command consists of."""

_TRIES: Final = 1000


def harmless_bytes(random: Random, count: int) -> bytes:
    """Return some bytes of :data:`HARMLESS`."""
    return bytes(random.choices(HARMLESS, k=count))


def harmless_value(random: Random, low: int, high: int, size: int) -> int:
    """Return a number from ``low`` to ``high`` of whose bytes none could be that of a command.

    Its last bytes, should the first ones be lost, are no beginning of anything then. A range may hold none
    such; the number is any of it then.

    :param size: how many bytes it has on the wire.
    """
    commands = {*PROTOCOL.rule.requests, *PROTOCOL.marks.pair}
    value = random.randint(low, high)
    for _ in range(_TRIES):
        if commands.isdisjoint((value % 256**size).to_bytes(size, "little")):
            return value
        value = random.randint(low, high)
    return value
