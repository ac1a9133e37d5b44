"""A small invented packet protocol in several shapes, written by hand like generated code.

A test that passes in every shape covers the rules of packet protocols and not just one protocol.
"""

from __future__ import annotations

from struct import Struct
from typing import Any, Self

from stagewire._codec.message import check_bytes, check_integer, check_text
from stagewire.protocols import (
    Crc,
    Direction,
    Layout,
    PacketMessage,
    PacketProtocol,
    Shape,
    Sum,
    Xor,
)

CCITT = Crc(size=2, polynomial=0x1021, initial=0xFFFF, reflected=False, final=0)

# The usual order of parts, shapes without each optional part, and a shape with an unusual order.
SHAPES = {
    "usual": Shape(
        order=("start", "length", "address", "id", "payload", "check", "end"),
        start=b"\xaa\x55", length=1, counts=("address", "id", "payload"), id=1, maximum=32,
        address=1, check=CCITT, covers=("length", "address", "id", "payload"), end=b"\x0d",
    ),
    "small": Shape(
        order=("start", "length", "id", "payload", "check"),
        start=b"\x02", length=1, counts=("payload",), id=1, maximum=32,
        check=Xor(), covers=("start", "length", "id", "payload"),
    ),
    "ended": Shape(
        order=("start", "id", "length", "payload", "check", "end"),
        start=b"\x02", length=2, counts=("start", "id", "length", "payload", "check", "end"), id=2,
        maximum=300, check=Sum(size=2, complement="twos"), covers=("payload",), end=b"\x03\x0a",
    ),
    "odd": Shape(
        order=("start", "id", "length", "payload", "check", "address"),
        start=b"\xaa\xaa\x55", length=1, counts=("id", "payload", "address"), id=1, maximum=32,
        address=2, check=Sum(size=1), covers=("id", "payload", "address"),
    ),
    "bare": Shape(
        order=("start", "length", "id", "payload"),
        start=b"\xaa", length=1, counts=("payload",), id=1, maximum=32,
    ),
}  # fmt: skip


def framing_of(shape: Shape) -> dict[str, Any]:
    """Return a shape in the form of the generator's model."""
    said: dict[str, Any] = {
        "kind": "packet", "maximum_length": shape.maximum,
        "order": list(shape.order), "start": list(shape.start),
        "length": {"size": shape.length, "counts": list(shape.counts)},
        "id": {"size": shape.id},
    }  # fmt: skip
    if shape.address:
        said["address"] = {"size": shape.address}
    if shape.end:
        said["end"] = list(shape.end)
    if shape.check:
        said["check"] = {
            **_check(shape.check), "size": shape.check.size, "covers": list(shape.covers)
        }  # fmt: skip
    return said


def _check(check: Any) -> dict[str, Any]:
    if isinstance(check, Crc):
        keys = ("polynomial", "initial", "reflected", "final")
        return {"method": "crc", **{key: getattr(check, key) for key in keys}}
    return (
        {"method": "sum", "complement": check.complement}
        if isinstance(check, Sum)
        else {"method": "xor"}
    )


def protocol_of(shape: Shape, name: str = "invented_packets") -> PacketProtocol:
    """Return the protocol in a shape, with new classes, since a class belongs to one protocol."""

    class Stop(PacketMessage):
        __slots__ = ()
        layout = Layout("STOP", 0x01, Direction.TO_CONTROLLER, "header", ())

    class SetAngle(PacketMessage):
        """An integer of three bytes, and a reserved byte that is optional."""

        __slots__ = ("angle", "reserved", "speed")
        layout = Layout(
            "SET_ANGLE", 0x02, Direction.TO_CONTROLLER, "data", ("angle", "speed", "reserved"), 6,
            optional=("reserved",), signed=("angle",),
        )  # fmt: skip
        _struct = Struct("<3sHB")
        angle: int
        speed: int
        reserved: int

        def __new__(cls, angle: int, speed: int, *, reserved: int = 0) -> Self:
            return cls.keep(
                {
                    "angle": check_integer(cls.layout, "angle", angle, -180_000, 180_000),
                    "speed": check_integer(cls.layout, "speed", speed, 0, 0xFFFF),
                    "reserved": check_integer(cls.layout, "reserved", reserved, 0, 0xFF),
                }
            )

        @classmethod
        def unpack(cls, raw: bytes) -> Self:
            angle, speed, reserved = cls._struct.unpack_from(raw)
            number = int.from_bytes(angle, "little", signed=True)
            return cls.keep({"angle": number, "speed": speed, "reserved": reserved})

        def pack(self) -> bytes:
            angle = self.angle.to_bytes(3, "little", signed=True)
            return self._struct.pack(angle, self.speed, self.reserved)

    class State(PacketMessage):
        """A request without a payload. The answer has a short or a long one."""

        __slots__ = ()
        layout = Layout("STATE", 0x03, Direction.BOTH, "header", ())

    class StateBrief(PacketMessage):
        __slots__ = ("bits",)
        layout = Layout("STATE", 0x03, Direction.BOTH, "data:brief", ("bits",), 2)
        bits: int

        def __new__(cls, bits: int) -> Self:
            return cls.keep({"bits": check_integer(cls.layout, "bits", bits, 0, 0xFFFF)})

        @classmethod
        def unpack(cls, raw: bytes) -> Self:
            return cls.keep({"bits": int.from_bytes(raw[:2], "little")})

        def pack(self) -> bytes:
            return self.bits.to_bytes(2, "little")

    class StateFull(PacketMessage):
        __slots__ = ("bits", "label")
        layout = Layout("STATE", 0x03, Direction.BOTH, "data:full", ("bits", "label"), 8)
        _struct = Struct("<H6s")
        bits: int
        label: str

        def __new__(cls, bits: int, label: str) -> Self:
            return cls.keep(
                {
                    "bits": check_integer(cls.layout, "bits", bits, 0, 0xFFFF),
                    "label": check_text(cls.layout, "label", label, 6),
                }
            )

        @classmethod
        def unpack(cls, raw: bytes) -> Self:
            bits, label = cls._struct.unpack_from(raw)
            return cls.keep({"bits": bits, "label": label.rstrip(b"\0").decode("latin-1")})

        def pack(self) -> bytes:
            return self._struct.pack(self.bits, self.label.encode("latin-1"))

    class Page(PacketMessage):
        """A payload of the maximum length."""

        __slots__ = ("page",)
        layout = Layout("PAGE", 0x0D, Direction.TO_HOST, "data", ("page",), 32)
        page: bytes

        def __new__(cls, page: bytes) -> Self:
            return cls.keep({"page": check_bytes(cls.layout, "page", page, 32)})

        @classmethod
        def unpack(cls, raw: bytes) -> Self:
            return cls.keep({"page": raw[:32]})

        def pack(self) -> bytes:
            return self.page

    for cls in (Stop, SetAngle, State, StateBrief, StateFull, Page):
        cls.__qualname__ = cls.__name__
    return PacketProtocol(
        name, "Invented packets", "stagewire_invented",
        (Stop, SetAngle, State, StateBrief, StateFull, Page),
        shape=shape,
        nameless={"HOME": "the document gives it no id"},
    )  # fmt: skip


PROTOCOL = protocol_of(SHAPES["usual"])
Stop, SetAngle, State, StateBrief, StateFull, Page = PROTOCOL.messages
