"""The codec compared with bare ``struct``, and with another library.

Decoding is measured on the 20 bytes of ``MOT_GET_DCSTATUSUPDATE``, the most frequent message. Encoding is
measured on ``MOT_MOVE_ABSOLUTE``: build it with all checks, and pack it.

    python benchmarks/codec_speed.py
"""

from __future__ import annotations

import sys
from struct import Struct

import thorlabs_apt_protocol
from measure import Bound, interleave, report, statement
from thorlabs_apt_protocol.parsing import id_to_func

from stagewire_apt import messages as m

STATUS = bytes.fromhex("91 04 0E 00 81 50 01 00 80 BB 00 00 0A 00 00 00 00 04 00 80")
NUMBER = 20_000


def decoding() -> bool:
    """Measure the contenders that turn bytes into a message."""
    names = {
        "raw": STATUS,
        "unpack_from": Struct("<HlhHL").unpack_from,
        "direct": m.MotGetDcStatusUpdate.unpack,
        "decode": m.decode,
        "parse": id_to_func[0x0491],
    }
    assert m.decode(STATUS).message == m.MotGetDcStatusUpdate.unpack(STATUS)
    contenders = {
        "Struct.unpack_from": statement("unpack_from(raw, 6)", names, NUMBER),
        "direct decode": statement("direct(raw)", names, NUMBER),
        "decode to a Frame": statement("decode(raw)", names, NUMBER),
        "thorlabs-apt-protocol": statement("parse(raw)", names, NUMBER // 10),
    }
    bounds = [
        Bound("direct decode", "Struct.unpack_from", at_most=4),
        Bound("decode to a Frame", "Struct.unpack_from", at_most=8),
        Bound("thorlabs-apt-protocol", "decode to a Frame", at_least=5),
    ]
    return report("Decode a DC status update of 20 bytes", interleave(contenders), bounds)


def encoding() -> bool:
    """Measure the contenders that turn values into bytes."""
    names = {
        "pack": Struct("<HHBBHl").pack,
        "MoveAbsolute": m.MotMoveAbsolute,
        "peer": thorlabs_apt_protocol.mot_move_absolute,
        # all contenders take the values from variables, as a program would
        "id": 0x0453,
        "length": 6,
        "dest": 0x50,
        "flagged": 0xD0,
        "source": 0x01,
        "channel": 1,
        "position": 200_000,
        "made": m.MotMoveAbsolute(1, 200_000),
    }
    limit = "pack(id, length, flagged, source, channel, position)"
    ours = "MoveAbsolute(channel, position).pack(dest, source)"
    theirs = "peer(source=source, dest=dest, chan_ident=channel, position=position)"
    assert eval(limit, names) == eval(ours, names) == eval(theirs, names)
    contenders = {
        "Struct.pack": statement(limit, names, NUMBER),
        "build, check and pack a message": statement(ours, names, NUMBER),
        "pack a message": statement("made.pack(dest, source)", names, NUMBER),
        "thorlabs-apt-protocol": statement(theirs, names, NUMBER),
    }
    bounds = [Bound("build, check and pack a message", "Struct.pack", at_most=6)]
    return report("Encode a move to a position", interleave(contenders), bounds)


if __name__ == "__main__":
    kept = [decoding(), encoding()]
    sys.exit(0 if all(kept) else 1)
