"""The framing rule of packets once more, as simple and slow as it can be said.

At every position the parts are laid out one after the other and looked at one by one; nothing is found by
searching, no check is computed by a table and nothing is remembered. The framer of ``stagewire.packets``
is compared with it.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from stagewire.packets import Check, Crc, Shape, Sum

__all__ = ["Piece", "Reference", "slow_check"]


class Piece(NamedTuple):
    """What some bytes are: ``message``, ``unknown``, ``bad_length``, ``garbage`` or ``pending``."""

    kind: str
    raw: bytes


class Reference:
    """The rule for one protocol.

    :param lengths: id -> the lengths that the layouts of its message have.
    """

    def __init__(self, shape: Shape, lengths: Mapping[int, set[int]]) -> None:
        self.shape = shape
        self.lengths = lengths

    def read(self, stream: bytes) -> list[Piece]:
        """Return what a stream is made of, neighbouring garbage joined."""
        pieces: list[Piece] = []
        position = 0
        while position < len(stream):
            piece = self._stands(stream[position:])
            if pieces and pieces[-1].kind == piece.kind == "garbage":
                pieces[-1] = Piece("garbage", pieces[-1].raw + piece.raw)
            else:
                pieces.append(piece)
            position += len(piece.raw)
        return pieces

    def _stands(self, rest: bytes) -> Piece:
        """Return what the first byte of ``rest`` begins."""
        start = self.shape.start
        if rest[: len(start)] != start[: len(rest)]:
            return Piece("garbage", rest[:1])
        for payload in range(self.shape.maximum + 1):
            parts = self._parts(rest, payload)
            length = parts["length"]
            if len(length) < self.shape.length:
                return Piece("pending", rest)
            sizes = self._sizes(payload)
            counted = sum(sizes[part] for part in self.shape.counts)
            if int.from_bytes(length, "little") != counted:
                continue  # it declares another payload
            packet = rest[: sum(sizes.values())]
            if len(packet) < sum(sizes.values()):
                return Piece("pending", rest)
            return Piece(self._kind(parts), packet) if self._right(parts) else _garbage(rest)
        return _garbage(rest)

    def _sizes(self, payload: int) -> dict[str, int]:
        shape = self.shape
        sizes = {
            "start": len(shape.start), "length": shape.length, "address": shape.address,
            "id": shape.id, "payload": payload, "check": shape.check.size if shape.check else 0,
            "end": len(shape.end),
        }  # fmt: skip
        return {part: sizes[part] for part in shape.order}

    def _parts(self, rest: bytes, payload: int) -> dict[str, bytes]:
        parts, position = {}, 0
        for part, size in self._sizes(payload).items():
            parts[part] = rest[position : position + size]
            position += size
        return parts

    def _right(self, parts: Mapping[str, bytes]) -> bool:
        if parts.get("end", b"") != self.shape.end:
            return False
        if self.shape.check is None:
            return True
        covered = b"".join(content for part, content in parts.items() if part in self.shape.covers)
        return int.from_bytes(parts["check"], "little") == slow_check(self.shape.check, covered)

    def _kind(self, parts: Mapping[str, bytes]) -> str:
        lengths = self.lengths.get(int.from_bytes(parts["id"], "little"))
        payload = len(parts["payload"])
        if lengths is None:
            return "unknown"
        fits = payload in lengths or any(0 < length < payload for length in lengths)
        return "message" if fits else "bad_length"


def _garbage(rest: bytes) -> Piece:
    return Piece("garbage", rest[:1])


def slow_check(check: Check, data: bytes) -> int:
    """Return a check bit by bit, as its definition says."""
    if isinstance(check, Crc):
        return _slow_crc(check, data)
    if not isinstance(check, Sum):
        result = 0
        for byte in data:
            result ^= byte
        return result
    values = 1 << 8 * check.size
    total = 0
    for byte in data:
        total = (total + byte) % values
    return {"none": total, "ones": values - 1 - total, "twos": -total % values}[check.complement]


def _slow_crc(check: Crc, data: bytes) -> int:
    width = 8 * check.size
    bits = [byte >> (bit if check.reflected else 7 - bit) & 1 for byte in data for bit in range(8)]
    register = check.initial
    for bit in bits:
        top = register >> width - 1 ^ bit
        register = register << 1 & (1 << width) - 1
        if top:
            register ^= check.polynomial
    if check.reflected:
        register = sum((register >> bit & 1) << width - 1 - bit for bit in range(width))
    return register ^ check.final
