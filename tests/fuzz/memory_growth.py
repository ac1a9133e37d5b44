"""Frame and decode ten million frames of one stream, and check that memory does not grow.

    python tests/fuzz/memory_growth.py
    python tests/fuzz/memory_growth.py --frames 1000000

One framer receives an endless stream of frames of every layout. A few are damaged, and some are unknown. The
reads differ in size; most hold a few frames. Every message is decoded and encoded again.

The program measures resident memory after a garbage collection, and compares it with the value after the
first tenth. By then every layout was decoded once, and the framer remembers as many headers as it ever will.
The exit status is 1 if memory grew by a mebibyte or more, or if a byte was lost.
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
from stagewire.protocols import HEADER_SIZE

FRAMES = 10_000_000
BOUND = 1 << 20
READS = (1, 7, 20, 20, 64, 64, 64, 256)
BIG_READ = 65536
_STATM = Path("/proc/self/statm")
_PIECES = 64
_PIECE = 1 << 17


def resident() -> int:
    """Return the resident memory of the process in bytes, or its peak if the system does not report it."""
    gc.collect()
    if _STATM.exists():
        return int(_STATM.read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")
    most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return most if sys.platform == "darwin" else most * 1024


def reads(rng: Random) -> Iterator[bytes]:
    """Yield an endless stream: prepared pieces in random order, each with new damage."""
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
    """Decode and encode every message; return the numbers of frames and of bytes in these events."""
    frames = size = 0
    for event in events:
        raw = event.raw
        size += len(raw)
        if isinstance(event, (Received, Undocumented)):
            frames += 1
            if event.frame.encode() != streams.as_sent(raw):
                raise AssertionError(f"decoding and encoding gave other bytes: {raw.hex(' ')}")
    return frames, size


def main() -> int:
    """Feed the frames; return 1 if memory grew or bytes were lost."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--frames", type=int, default=FRAMES)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()

    stream = reads(Random(given.seed))
    framer = streams.PROTOCOL.framer(End.NONE)
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
        wrong.append(f"memory grew by {growth:,} bytes; the limit is {BOUND:,}")
    if out + len(framer.pending) != fed:
        wrong.append(f"{fed:,} bytes in, {out:,} out, {len(framer.pending)} pending")
    if longest >= HEADER_SIZE + streams.LONGEST_PACKET:
        wrong.append(f"{longest} bytes were pending, more than one frame")
    for problem in wrong:
        print(f"problem: {problem}")
    return int(bool(wrong))


if __name__ == "__main__":
    sys.exit(main())
