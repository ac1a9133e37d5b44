"""The framer takes linear time, whatever comes and in whatever chunks.

Each flood is fed in chunks of 1 and 4096 bytes and whole, short and eight times as long, interleaved;
the median ratio of the times per byte is printed. Linear is 1, quadratic would be 8; over the bound
the exit is 1.

    python benchmarks/framing_time.py
"""

from __future__ import annotations

import statistics
import sys
import time

from stagewire import End
from stagewire_apt import PROTOCOL

BOUND = 2.0
ROUNDS = 9
SHORT, LONG = 20_000, 160_000
FLOODS = {
    "status messages": "91 04 0E 00 81 50 01 00 00 00 00 00 00 00 00 00 00 00 00 00",
    "zeros": "00",
    "half headers": "81 04 0E 00 81 FF",
    "lengths that never end": "77 0F FF 01 81 50",
    "longer packets": "81 04 FF 00 81 50" + " 00" * 249,
    "longest packets one in the other": "81 04 FF 00 81 50",
    "candidates at every byte": "04 04 00 01 50",
}


def nanoseconds(data: bytes, size: int) -> float:
    """Return the time per byte of feeding ``data`` in chunks of ``size``."""
    framer = PROTOCOL.framer(End.NONE)
    start = time.perf_counter()
    for position in range(0, len(data), size):
        framer.feed(data[position : position + size])
    return (time.perf_counter() - start) / len(data) * 1e9


def main() -> int:
    """Measure every flood; return 1 when one is over the bound."""
    over = False
    print(f"{'flood':34}{'chunk':>8}{'ns/byte':>10}{'ratio':>8}")
    for name, text in FLOODS.items():
        unit = bytes.fromhex(text)
        short, long = (unit * (length // len(unit)) for length in (SHORT, LONG))
        for size in (1, 4096, LONG):
            pairs = [(nanoseconds(short, size), nanoseconds(long, size)) for _ in range(ROUNDS)]
            ratio = statistics.median(many / few for few, many in pairs)
            slow = statistics.median(many for _, many in pairs)
            chunk = "whole" if size == LONG else str(size)
            print(f"{name:34}{chunk:>8}{slow:>10.1f}{ratio:>8.2f}{'  over' * (ratio > BOUND)}")
            over |= ratio > BOUND
    return int(over)


if __name__ == "__main__":
    sys.exit(main())
