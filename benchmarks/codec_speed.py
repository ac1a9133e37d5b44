"""The codec against bare ``struct``, and against a peer.

Decoding is measured on the 20 bytes of ``MOT_GET_DCSTATUSUPDATE``, the message that controllers send
most; encoding on ``MOT_MOVE_ABSOLUTE``, made with all checks and packed.

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
    """Measure the ways from bytes to a message."""
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
    """Measure the ways from values to bytes."""
    names = {
        "pack": Struct("<HHBBHl").pack,
        "MoveAbsolute": m.MotMoveAbsolute,
        "peer": thorlabs_apt_protocol.mot_move_absolute,
    }
    ours = m.MotMoveAbsolute(1, 200_000).pack(0x50, 1)
    assert ours == names["pack"](0x0453, 6, 0xD0, 1, 1, 200_000)
    assert ours == names["peer"](source=1, dest=0x50, chan_ident=1, position=200_000)
    contenders = {
        "Struct.pack": statement("pack(0x0453, 6, 0xD0, 1, 1, 200_000)", names, NUMBER),
        "checked message, packed": statement(
            "MoveAbsolute(1, 200_000).pack(0x50, 1)", names, NUMBER
        ),
        "thorlabs-apt-protocol": statement(
            "peer(source=1, dest=0x50, chan_ident=1, position=200_000)", names, NUMBER
        ),
    }
    bounds = [Bound("checked message, packed", "Struct.pack", at_most=6)]
    return report("Encode a move to a position", interleave(contenders), bounds)


if __name__ == "__main__":
    kept = [decoding(), encoding()]
    sys.exit(0 if all(kept) else 1)
