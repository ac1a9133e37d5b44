"""Frame and decode ten million frames in one stream: memory must not grow.

    python tests/fuzz/memory_growth.py
    python tests/fuzz/memory_growth.py --frames 1000000

One framer sees a stream that never ends: frames of every layout, a few damaged, some unknown, cut into
reads of different sizes, most of them of a few frames; every message is decoded and encoded again.
Memory is what the system holds for the process (resident), after a collection of garbage. It is
compared with that after the first tenth, when every layout was decoded once, and the framer
remembers as many headers as it ever will. The exit is 1 when it grew by a mebibyte or more, or when
a byte went astray.
"""

from __future__ import annotations

import argparse
import gc
import os
import resource
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from random import Random

import streams

from stagewire import End
from stagewire.framing import Event, Received, Undocumented
from stagewire.protocols import HEADER_SIZE, MAXIMUM_PACKET
from stagewire_apt import PROTOCOL

FRAMES = 10_000_000
BOUND = 1 << 20
READS = (1, 7, 20, 20, 64, 64, 64, 256)
BIG_READ = 65536
_STATM = Path("/proc/self/statm")
_PIECES = 64
_PIECE = 1 << 17


def resident() -> int:
    """Return the bytes of memory that the process has; where the system does not say, the most it had."""
    gc.collect()
    if _STATM.exists():
        return int(_STATM.read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")
    most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return most if sys.platform == "darwin" else most * 1024


def reads(rng: Random) -> Iterator[bytes]:
    """Yield an endless stream: pieces of damaged frames in a random order, each with new damage."""
    pieces = []
    for _ in range(_PIECES):
        made = bytearray()
        while len(made) < _PIECE:
            frame = streams.frame(rng)
            made += streams.damaged(rng, frame) if rng.random() < 0.01 else frame
        pieces.append(bytes(made))
    while True:
        piece = bytearray(rng.choice(pieces))
        for _ in range(50):
            piece[rng.randrange(len(piece))] = rng.randrange(256)
        position = 0
        while position < len(piece):
            size = rng.choice(READS) if rng.random() < 0.998 else BIG_READ
            yield bytes(piece[position : position + size])
            position += size


def use(events: list[Event]) -> tuple[int, int]:
    """Decode and encode every message; return how many frames these events are, and their bytes."""
    frames = size = 0
    for event in events:
        raw = event.raw
        size += len(raw)
        if isinstance(event, (Received, Undocumented)):
            frames += 1
            if event.frame.encode() != raw:
                raise AssertionError(f"decoded and encoded, other bytes: {raw.hex(' ')}")
    return frames, size


def main() -> int:
    """Feed the frames; return 1 when memory grew."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--frames", type=int, default=FRAMES)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()

    stream = reads(Random(given.seed))
    framer = PROTOCOL.framer(End.NONE)
    step = max(1, given.frames // 10)
    frames = fed = out = longest = 0
    samples: list[int] = []
    began = time.perf_counter()
    while frames < given.frames:
        data = next(stream)
        fed += len(data)
        new, size = use(framer.feed(data))
        frames += new
        out += size
        longest = max(longest, len(framer.pending))
        if frames >= step * (len(samples) + 1):
            samples.append(resident())
            grown = (samples[-1] - samples[0]) / 1024
            print(
                f"{frames:>12,} frames {samples[-1] / 1024:>10,.0f} KiB {grown:>+8,.0f}", flush=True
            )
    seconds = time.perf_counter() - began

    growth = max(samples) - samples[0]
    print(
        f"{frames:,} frames, {fed:,} bytes in {seconds:,.0f} s; at most {longest} bytes pending; "
        f"grown by {growth / 1024:,.0f} KiB since the first tenth"
    )
    wrong = []
    if growth >= BOUND:
        wrong.append(f"memory grew by {growth:,} bytes, the bound is {BOUND:,}")
    if out + len(framer.pending) != fed:
        wrong.append(f"{fed:,} bytes in, {out:,} out, {len(framer.pending)} pending")
    if longest >= HEADER_SIZE + MAXIMUM_PACKET:
        wrong.append(f"{longest} bytes were pending, more than one frame")
    for problem in wrong:
        print(f"wrong: {problem}")
    return int(bool(wrong))


if __name__ == "__main__":
    sys.exit(main())
