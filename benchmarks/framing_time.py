"""The framers take linear time for any input in any chunks.

Each flood is fed in chunks of 1 and 4096 bytes and whole, short and eight times as long, interleaved. The
program prints the median ratio of the times per byte: 1 is linear, 8 would be quadratic. It exits with 1 if a
ratio exceeds the bound.

    python benchmarks/framing_time.py
"""

from __future__ import annotations

import statistics
import sys
import time
from collections.abc import Callable, Mapping
from typing import Any

import stagewire_apt
import stagewire_ms2000
from stagewire import End

BOUND = 2.0
ROUNDS = 9
SHORT, LONG = 20_000, 160_000
MESSAGES = {
    "status messages": "91 04 0E 00 81 50 01 00 00 00 00 00 00 00 00 00 00 00 00 00",
    "zeros": "00",
    "half headers": "81 04 0E 00 81 FF",
    "lengths that never end": "77 0F FF 01 81 50",
    "longer packets": "81 04 FF 00 81 50" + " 00" * 249,
    "longest packets, nested": "81 04 FF 00 81 50",
    "candidates at every byte": "04 04 00 01 50",
}
COMMANDS = {
    "commands": "18 54 03 A0 86 01 3A",
    "colons": "3A",
    "no colon ever": "18 54 03",
    "prefixes": "FF",
    "garbage without an end": "FF 58",
    "unknown commands": "18 99 3A",
    "as long as a command can be": "18 61 03" + " 00" * 255 + "3A",
    "longer than that": "18 61 03" + " 00" * 256 + "3A",
}


def nanoseconds(make: Callable[[], Any], data: bytes, size: int) -> float:
    """Return the time per byte of feeding ``data`` in chunks of ``size``."""
    framer = make()
    start = time.process_time()
    for position in range(0, len(data), size):
        framer.feed(data[position : position + size])
    return (time.process_time() - start) / len(data) * 1e9


def linear(make: Callable[[], Any], floods: Mapping[str, str]) -> bool:
    """Measure every flood; return whether all are within the bound."""
    kept = True
    print(f"{'flood':34}{'chunk':>8}{'ns/byte':>10}{'ratio':>8}")
    for name, text in floods.items():
        unit = bytes.fromhex(text)
        short, long = (unit * (length // len(unit)) for length in (SHORT, LONG))
        for size in (1, 4096, LONG):
            pairs = [
                (nanoseconds(make, short, size), nanoseconds(make, long, size))
                for _ in range(ROUNDS)
            ]
            ratio = statistics.median(many / few for few, many in pairs)
            slow = statistics.median(many for _, many in pairs)
            chunk = "whole" if size == LONG else str(size)
            print(f"{name:34}{chunk:>8}{slow:>10.1f}{ratio:>8.2f}{'  over' * (ratio > BOUND)}")
            kept &= ratio <= BOUND
    return kept


def main() -> int:
    """Measure both kinds of framing; return 1 if a flood exceeds the bound."""
    kept = [
        linear(lambda: stagewire_apt.PROTOCOL.framer(End.NONE), MESSAGES),
        linear(stagewire_ms2000.PROTOCOL.framer, COMMANDS),
    ]
    return int(not all(kept))


if __name__ == "__main__":
    sys.exit(main())
