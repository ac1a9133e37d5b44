"""The bytes of a packet, whose parts and their order are data of its protocol."""

from __future__ import annotations

from functools import reduce
from operator import xor

from stagewire_generator.model import Json, Protocol

__all__ = ["Packets"]


class Packets:
    """Packs the packets of one protocol."""

    def __init__(self, protocol: Protocol) -> None:
        self._framing: Json = protocol.framing
        self.most: int = self._framing["maximum_length"]
        self.start = bytes(self._framing["start"])
        self.sizes: dict[str, int] = {
            part: self._framing[part]["size"] if part in self._framing else 0
            for part in ("length", "address", "id", "check")
        }
        self.sizes |= {part: len(self._framing.get(part, ())) for part in ("start", "end")}
        self.order: list[str] = self._framing["order"]
        self._counts: list[str] = self._framing["length"]["counts"]

    @property
    def counted(self) -> int:
        """What the length says of a packet without payload."""
        return sum(self.sizes.get(part, 0) for part in self._counts)

    @property
    def least(self) -> int:
        """Bytes of a packet without payload."""
        return sum(self.sizes.values())

    @property
    def greatest_address(self) -> int:
        """The greatest address; 0 where packets have none."""
        return (1 << 8 * self.sizes["address"]) - 1

    def pack(self, id: int, address: int, payload: bytes, declared: int | None = None) -> bytes:
        """Return a packet; ``declared`` is said in the place of its length."""
        length = self.counted + len(payload) if declared is None else declared
        parts = {
            "start": self.start,
            "length": self._number("length", length),
            "address": self._number("address", address),
            "id": self._number("id", id),
            "payload": payload,
            "end": bytes(self._framing.get("end", ())),
        }
        parts["check"] = self._check(parts)
        return b"".join([parts[part] for part in self.order])

    def place(self, part: str, payload: int) -> slice:
        """Return where a part stands in a packet with ``payload`` bytes of payload."""
        sizes = {**self.sizes, "payload": payload}
        at = sum(sizes[before] for before in self.order[: self.order.index(part)])
        return slice(at, at + sizes[part])

    def number(self, part: str, packet: bytes, payload: int) -> int:
        """Return the number that a part of a packet holds; 0 where packets have no such part."""
        return (
            int.from_bytes(packet[self.place(part, payload)], "little") if part in self.order else 0
        )

    def _number(self, part: str, number: int) -> bytes:
        return number.to_bytes(self.sizes[part], "little")

    def _check(self, parts: dict[str, bytes]) -> bytes:
        check = self._framing.get("check")
        if not check:
            return b""
        covered = b"".join([parts[part] for part in self.order if part in check["covers"]])
        return self._number("check", _METHODS[check["method"]](covered, check))


def _sum(data: bytes, check: Json) -> int:
    most: int = (1 << 8 * check["size"]) - 1
    total = {"none": sum(data), "ones": ~sum(data), "twos": -sum(data)}
    return total[check.get("complement", "none")] & most


def _xor(data: bytes, check: Json) -> int:
    return reduce(xor, data, 0)


def _crc(data: bytes, check: Json) -> int:
    """Return a cyclic redundancy check bit by bit, in the terms of the Rocksoft model."""
    width: int = 8 * check["size"]
    register: int = check.get("initial", 0)
    for byte in data:
        byte = _turned(byte, 8) if check["reflected"] else byte
        for bit in range(7, -1, -1):
            high = register >> (width - 1) ^ byte >> bit & 1
            register = (register << 1) & ((1 << width) - 1) ^ (check["polynomial"] if high else 0)
    if check["reflected"]:
        register = _turned(register, width)
    final: int = check.get("final", 0)
    return register ^ final


def _turned(number: int, width: int) -> int:
    return int(f"{number:0{width}b}"[::-1], 2)


_METHODS = {"sum": _sum, "xor": _xor, "crc": _crc}
