"""The framer compared with bare slicing, and with another library.

The stream is 20 MB of mixed messages (``stream.py``). The reference slices and unpacks a stream of status
updates at a fixed stride, without reading a header.

Large chunks have two bounds. The framer alone is timed without Python's cyclic garbage collector. With the
collector, a chunk of 2 MiB costs more: its hundred thousand events are alive together, and the collector
visits each of them several times. Chunks of 4 KiB have too few events to start a collection.

    python benchmarks/framing_speed.py
"""

from __future__ import annotations

import gc
import sys
import time
from functools import partial
from struct import Struct

from measure import Bound, Runner, interleave, report
from reading import chunks, reading
from stream import frames as make_frames
from thorlabs_apt_protocol import Unpacker
from thorlabs_apt_protocol.parsing import id_to_func

from stagewire import End
from stagewire.framing import Received
from stagewire_apt import PROTOCOL
from stagewire_apt import messages as m

SIZE = 20_000_000
SMALL, LARGE = 4096, 2 << 20
FOR_THE_PEER = 4_000  # messages; the other library takes a thousand times as long
ROUNDS = 9

STATUS = m.MotGetDcStatusUpdate(1, 200_000, 10, 0x80000400).pack(0x01, 0x50)


def peer_reads(frame: bytes) -> bool:
    """Return whether the other library accepts a message."""
    try:
        id_to_func[frame[0] | frame[1] << 8](frame)
    except Exception:
        return False
    return True


def fixed_stride(count: int) -> Runner:
    """Return a runner that slices and unpacks frames of 20 bytes."""
    stream = STATUS * count
    unpack_from = Struct("<HlhHL").unpack_from

    def run() -> float:
        start = time.process_time()
        for position in range(0, len(stream), 20):
            unpack_from(stream[position : position + 20], 6)
        return (time.process_time() - start) / count

    return run


def peer(frames: list[bytes]) -> Runner:
    """Return a runner of the other library's reader, on the first messages that it accepts."""
    stream = b"".join([frame for frame in frames[:FOR_THE_PEER] if peer_reads(frame)])
    parts = chunks(stream, SMALL)

    def run() -> float:
        unpacker = Unpacker()
        messages = 0
        start = time.process_time()
        for part in parts:
            unpacker.feed(part)
            messages += sum(1 for _ in unpacker)
        return (time.process_time() - start) / messages

    return run


def without_collector(run: Runner) -> Runner:
    """Return a runner that runs without the cyclic garbage collector."""

    def run_without() -> float:
        gc.disable()
        try:
            return run()
        finally:
            gc.enable()

    return run_without


def main() -> int:
    """Measure; return 1 if a bound is exceeded."""
    frames = list(make_frames(SIZE))
    stream, count = b"".join(frames), len(frames)
    unpacker = peer(frames)
    frames.clear()  # a list of a million frames would slow down every garbage collection
    framer = partial(PROTOCOL.framer, End.HOST)
    small, large = chunks(stream, SMALL), chunks(stream, LARGE)
    contenders = {
        "slice and unpack at a fixed stride": fixed_stride(count),
        "framing, chunks of 4 KiB": reading(framer, None, small, count),
        "framing, chunks of 2 MiB": reading(framer, None, large, count),
        "2 MiB, without the collector": without_collector(reading(framer, None, large, count)),
        "framing and decoding": reading(framer, Received, small, count),
        "thorlabs-apt-protocol's Unpacker": unpacker,
    }
    limit = "slice and unpack at a fixed stride"
    bounds = [
        Bound("framing, chunks of 4 KiB", limit, at_most=5),
        Bound("framing and decoding", limit, at_most=9),
        Bound("thorlabs-apt-protocol's Unpacker", "framing, chunks of 4 KiB", at_least=100),
        Bound("2 MiB, without the collector", "framing, chunks of 4 KiB", at_most=1.3),
        Bound("framing, chunks of 2 MiB", "framing, chunks of 4 KiB", at_most=2.3),
    ]
    costs = interleave(contenders, ROUNDS)
    title = f"Frame a stream of {count:,} messages, per message"
    return 0 if report(title, costs, bounds) else 1


if __name__ == "__main__":
    sys.exit(main())
