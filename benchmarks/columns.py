"""Frames to columns: at most 1.3 times a bare copy with NumPy, 10 times with the standard library.

The input is a million status frames of 20 bytes. The bare copy checks only the id. Our columns also check the
length and the form of every frame, and remove the flag from the destination. The program exits with 1 if a
bound is exceeded.

    python benchmarks/columns.py
"""

from __future__ import annotations

import random
import struct
import sys
import time
from array import array
from collections.abc import Callable
from typing import Any

import numpy
from measure import Bound, Runner, interleave, report

from stagewire.columns import columns, numpy_columns
from stagewire_apt.messages import MotGetDcStatusUpdate

FRAMES = 1_000_000
ROUNDS = 9

BARE = "bare NumPy copy with id check"
NUMPY = "numpy_columns"
STANDARD = "columns (standard library)"
LOOP = "loop over iter_unpack"
BOUNDS = (Bound(NUMPY, BARE, at_most=1.3), Bound(STANDARD, BARE, at_most=10))

_FRAME = struct.Struct("<HHBBHlhHL")
_NAMES = ("id", "length", "dest", "source", *MotGetDcStatusUpdate.layout.fields)
_DTYPE = numpy.dtype(
    list(zip(_NAMES, ("<u2", "<u2", "u1", "u1", "<u2", "<i4", "<i2", "<u2", "<u4"), strict=True))
)
_CODES = "BBHihHI"


def capture(frames: int) -> bytes:
    """Return status frames with varying positions, velocities and status bits."""
    rng = random.Random(20)
    header = (0x0491, 14, 0x81, 0x50)
    return b"".join(
        _FRAME.pack(*header, 1, rng.randrange(-(2**31), 2**31), rng.randrange(-99, 99), 0, 1 << 10)
        for _ in range(frames)
    )


def bare(raw: bytes) -> dict[str, Any]:
    """Return the columns as hand-written code for this one message makes them: the reference."""
    frames = numpy.frombuffer(raw, _DTYPE)
    if (frames["id"] != 0x0491).any():
        raise ValueError("another message")
    return {name: frames[name].copy() for name in _NAMES[2:]}


def loop(raw: bytes) -> dict[str, Any]:
    """Return the columns of a loop over frames."""
    made = [array(code) for code in _CODES]
    appends = [column.append for column in made]
    for id, _, *values in _FRAME.iter_unpack(raw):
        if id != 0x0491:
            raise ValueError("another message")
        for append, value in zip(appends, values, strict=True):
            append(value)
    return dict(zip(_NAMES[2:], made, strict=True))


def timed(read: Callable[[], object]) -> Runner:
    """Return a runner that times one call."""

    def run() -> float:
        start = time.perf_counter()
        read()
        return time.perf_counter() - start

    return run


def main() -> int:
    """Measure; return 1 if a bound is exceeded."""
    raw = capture(FRAMES)
    contenders = {
        BARE: timed(lambda: bare(raw)),
        NUMPY: timed(lambda: numpy_columns(MotGetDcStatusUpdate, raw)),
        STANDARD: timed(lambda: columns(MotGetDcStatusUpdate, raw)),
        LOOP: timed(lambda: loop(raw)),
    }
    costs = interleave(contenders, ROUNDS)
    title = f"{FRAMES:,} frames of {_FRAME.size} bytes to columns"
    kept = report(title, costs, BOUNDS, lambda seconds: f"{seconds * 1e3:,.1f} ms")
    return int(not kept)


if __name__ == "__main__":
    sys.exit(main())
