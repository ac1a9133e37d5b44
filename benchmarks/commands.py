"""The codec and the framer of commands compared with bare Python.

Encoding is measured on ``WRITE_TARGET_POSITION``: build it with all checks and pack it, compared with joining
the bytes of the same command. Framing is measured on a stream of all kinds of commands in chunks of 4096
bytes; an event is decoded only on request. As for every protocol, the reference for framing is the time to
unpack the 20 bytes of a DC status update (``codec_speed.py``). ``framing_time.py`` shows that the time is
linear.

    python benchmarks/commands.py
"""

from __future__ import annotations

import random
import sys
from struct import Struct

from measure import Bound, interleave, report, statement
from reading import chunks, reading

from stagewire.framing import CommandReceived
from stagewire.protocols import Command, CommandFrame
from stagewire_ms2000 import PROTOCOL
from stagewire_ms2000 import messages as m

NUMBER = 20_000
COMMANDS = 100_000
CHUNK = 4096
SEED = 3
AXES = (0x18, 0x19, 0x1A)


def encoding() -> bool:
    """Measure the contenders that turn a position into bytes."""
    names = {
        "join": b"".join,
        "axis_byte": b"\x18", "command": b"\x54", "size": b"\x03", "data": b"\xa0\x86\x01", "end": b":",
        "WriteTargetPosition": m.WriteTargetPosition,
        "CommandFrame": CommandFrame,
        "axis": 0x18,
        "position": 100_000,
        "made": m.WriteTargetPosition(100_000),
    }  # fmt: skip
    limit = "join((axis_byte, command, size, data, end))"
    ours = "WriteTargetPosition(position).pack(axis)"
    frame = "CommandFrame(WriteTargetPosition(position), axis).encode()"
    assert eval(limit, names) == eval(ours, names) == eval(frame, names)
    contenders = {
        "bytes joined": statement(limit, names, NUMBER),
        "build, check and pack a command": statement(ours, names, NUMBER),
        "pack a command": statement("made.pack(axis)", names, NUMBER),
        "in a frame": statement(frame, names, NUMBER),
    }
    bounds = [Bound("build, check and pack a command", "bytes joined", at_most=8)]
    return report("Encode a move to a position", interleave(contenders), bounds)


def stream(count: int) -> bytes:
    """Return a stream of commands of all kinds, the same in every run."""
    rng = random.Random(SEED)
    classes = [cls for cls in PROTOCOL.messages if issubclass(cls, Command)]
    made = []
    for _ in range(count):
        cls = rng.choice(classes)
        data = rng.randbytes(3 + cls.layout.length)
        made.append(cls.unpack(data).pack(rng.choice(AXES), allow_dummy=True))
    return b"".join(made)


def framing() -> bool:
    """Measure the framer, with and without decoding its events."""
    data = stream(COMMANDS)
    parts = chunks(data, CHUNK)
    status = bytes.fromhex("91 04 0E 00 81 50 01 00 80 BB 00 00 0A 00 00 00 00 04 00 80")
    names = {"unpack_from": Struct("<HlhHL").unpack_from, "raw": status}
    contenders = {
        "Struct.unpack_from": statement("unpack_from(raw, 6)", names, NUMBER),
        "framing": reading(PROTOCOL.framer, None, parts, COMMANDS),
        "framing and decoding": reading(PROTOCOL.framer, CommandReceived, parts, COMMANDS),
    }
    bounds = [Bound("framing", "Struct.unpack_from", at_most=20)]
    return report(
        f"Frame a stream of {COMMANDS:,} commands, per command", interleave(contenders), bounds
    )


if __name__ == "__main__":
    sys.exit(0 if all([encoding(), framing()]) else 1)
