"""The stream that the benchmarks read: that of a controller whose status is polled all day."""

from __future__ import annotations

import random
from collections.abc import Iterator

from stagewire.protocols import Direction, UndocumentedMessage
from stagewire_apt import PROTOCOL
from stagewire_apt import messages as m

__all__ = ["frames"]

SEED = 3
HOST, CONTROLLER = 0x01, 0x50


def frames(size: int) -> Iterator[bytes]:
    """Yield frames of at least ``size`` bytes in all, the same in every run.

    Nine of ten are DC status updates; the rest are the other messages to the host, 6 to 90 bytes
    long.
    """
    rng = random.Random(SEED)
    rest = _others(rng)
    while size > 0:
        frame = _status(rng.randrange(1 << 30)) if rng.random() < 0.9 else rng.choice(rest)
        size -= len(frame)
        yield frame


def _status(position: int) -> bytes:
    return m.MotGetDcStatusUpdate(1, position, 10, 0x80000400).pack(HOST, CONTROLLER)


def _others(rng: random.Random) -> list[bytes]:
    """Return a frame of every other message that a controller sends, with random values."""
    made = []
    for cls in PROTOCOL.messages:
        layout = cls.layout
        if Direction.TO_HOST not in layout.direction or issubclass(cls, UndocumentedMessage):
            continue
        id = layout.id.to_bytes(2, "little")
        if layout.length:
            header = id + bytes((layout.length, 0, HOST | 0x80, CONTROLLER))
            made.append(header + rng.randbytes(layout.length))
        else:
            made.append(id + bytes((0 if layout.only_zero else 1, 0, HOST, CONTROLLER)))
    return made
