"""A small invented protocol of commands, handwritten in the style of the generator.

It differs from the MS-2000 in every respect: another prefix, another terminator, longer data, a setup command
whose byte is also that of a command, and one whose byte is the prefix. Tests with it show that the code
follows the rule, not the one documented protocol.
"""

from __future__ import annotations

from enum import IntEnum
from struct import Struct
from typing import Self

from stagewire._codec.message import check_bytes, check_integer, check_text
from stagewire.protocols import Command, CommandProtocol, Direction, Layout, Reply, SetupCommand

PREFIX, TERMINATOR = 0x1B, 0x0D


class Axis(IntEnum):
    LEFT = 0x21
    RIGHT = 0x22


def layout(
    name: str, id: int, form: str, fields: tuple[str, ...], length: int, **more: object
) -> Layout:
    direction = Direction.TO_HOST if form == "reply" else Direction.TO_CONTROLLER
    return Layout(name, id, direction, form, fields, length, **{"kind": "command", **more})


# Replies, and their commands


class ReadCountReply(Reply):
    __slots__ = ("count",)
    layout = layout("READ_COUNT", 0x63, "reply", ("count",), 3, signed=("count",))
    count: int

    def __new__(cls, count: int) -> Self:
        return cls.keep({"count": check_integer(cls.layout, "count", count, -(1 << 23), 0x7FFFFF)})

    @classmethod
    def unpack(cls, raw: bytes) -> Self:
        return cls.keep({"count": int.from_bytes(raw, "little", signed=True)})

    def pack(self) -> bytes:
        return self.count.to_bytes(3, "little", signed=True)


class ReadCount(Command):
    __slots__ = ()
    layout = layout("READ_COUNT", 0x63, "request", (), 0, size=3)
    reply = ReadCountReply


class ReadStateReply(Reply):
    __slots__ = ("state",)
    layout = layout("READ_STATE", 0x3F, "reply", ("state",), 1)
    state: int

    def __new__(cls, state: int) -> Self:
        return cls.keep({"state": check_integer(cls.layout, "state", state, 0, 0xFF)})

    @classmethod
    def unpack(cls, raw: bytes) -> Self:
        return cls.keep({"state": raw[0]})

    def pack(self) -> bytes:
        return bytes((self.state,))


class ReadState(Command):
    __slots__ = ()
    layout = layout("READ_STATE", 0x3F, "request", (), 0, size=None)
    reply = ReadStateReply


class ReadNameReply(Reply):
    __slots__ = ("name",)
    layout = layout("READ_NAME", 0x6E, "reply", ("name",), 6)
    name: str

    def __new__(cls, name: str) -> Self:
        return cls.keep({"name": check_text(cls.layout, "name", name, 6)})

    @classmethod
    def unpack(cls, raw: bytes) -> Self:
        return cls.keep({"name": raw.decode("latin-1")})

    def pack(self) -> bytes:
        return self.name.encode("latin-1").ljust(6, b"\0")


class ReadName(Command):
    __slots__ = ()
    layout = layout("READ_NAME", 0x6E, "request", (), 0, size=6)
    reply = ReadNameReply


# Commands without a reply


class Stop(Command):
    __slots__ = ()
    layout = layout("STOP", 0x53, "request", (), 0, size=0)


class WriteCount(Command):
    """A signed integer of three bytes with a range smaller than the bytes could hold."""

    __slots__ = ("count",)
    layout = layout("WRITE_COUNT", 0x57, "request", ("count",), 3, size=3, signed=("count",))
    count: int

    def __new__(cls, count: int) -> Self:
        return cls.keep({"count": check_integer(cls.layout, "count", count, -8_000_000, 8_000_000)})

    @classmethod
    def unpack(cls, raw: bytes) -> Self:
        return cls.keep({"count": int.from_bytes(raw[3:6], "little", signed=True)})

    def _pack(self, axis: int) -> bytes:
        count = self.count.to_bytes(3, "little", signed=True)
        return bytes((axis, 0x57, 3)) + count + bytes((TERMINATOR,))


class WriteLimits(Command):
    """Several fields, one of them text."""

    __slots__ = ("high", "label", "low")
    layout = layout("WRITE_LIMITS", 0x4C, "request", ("label", "low", "high"), 5, size=5)
    label: str
    low: int
    high: int
    _struct = Struct("<2sBh")

    def __new__(cls, label: str, low: int, high: int) -> Self:
        return cls.keep(
            {
                "label": check_text(cls.layout, "label", label, 2),
                "low": check_integer(cls.layout, "low", low, 0, 0xFF),
                "high": check_integer(cls.layout, "high", high, -0x8000, 0x7FFF),
            }
        )

    @classmethod
    def unpack(cls, raw: bytes) -> Self:
        label, low, high = cls._struct.unpack_from(raw, 3)
        return cls.keep({"label": label.rstrip(b"\0").decode("latin-1"), "low": low, "high": high})

    def _pack(self, axis: int) -> bytes:
        data = self._struct.pack(self.label.encode("latin-1"), self.low, self.high)
        return bytes((axis, 0x4C, 5)) + data + bytes((TERMINATOR,))


class WriteWide(Command):
    """A value with too many possibilities to try them one by one."""

    __slots__ = ("value",)
    layout = layout("WRITE_WIDE", 0x49, "request", ("value",), 8, size=8)
    value: int

    def __new__(cls, value: int) -> Self:
        return cls.keep({"value": check_integer(cls.layout, "value", value, 0, (1 << 64) - 1)})

    @classmethod
    def unpack(cls, raw: bytes) -> Self:
        return cls.keep({"value": int.from_bytes(raw[3:11], "little")})

    def _pack(self, axis: int) -> bytes:
        data = self.value.to_bytes(8, "little")
        return bytes((axis, 0x49, 8)) + data + bytes((TERMINATOR,))


class WritePage(Command):
    """As many bytes as a size slot can count."""

    __slots__ = ("page",)
    layout = layout("WRITE_PAGE", 0x50, "request", ("page",), 255, size=255)
    page: bytes

    def __new__(cls, page: bytes) -> Self:
        return cls.keep({"page": check_bytes(cls.layout, "page", page, 255)})

    @classmethod
    def unpack(cls, raw: bytes) -> Self:
        return cls.keep({"page": raw[3:258]})

    def _pack(self, axis: int) -> bytes:
        return bytes((axis, 0x50, 255)) + self.page + bytes((TERMINATOR,))


class WriteSpare(Command):
    __slots__ = ("spare",)
    layout = layout("WRITE_SPARE", 0x73, "request", ("spare",), 1, size=1, dummy=True)
    spare: int

    def __new__(cls, spare: int) -> Self:
        return cls.keep({"spare": check_integer(cls.layout, "spare", spare, 0, 0xFF)})

    @classmethod
    def unpack(cls, raw: bytes) -> Self:
        return cls.keep({"spare": raw[3]})

    def _pack(self, axis: int) -> bytes:
        return bytes((axis, 0x73, 1, self.spare, TERMINATOR))


class ReadSpareReply(ReadStateReply):
    __slots__ = ()
    layout = layout("READ_SPARE", 0x74, "reply", ("state",), 1)


class ReadSpare(Command):
    __slots__ = ()
    layout = layout("READ_SPARE", 0x74, "request", (), 0, size=1, dummy=True)
    reply = ReadSpareReply


# Setup commands


class Restart(SetupCommand):
    __slots__ = ()
    layout = layout("RESTART", 0x51, "request", (), 0, kind="setup")


class Standby(SetupCommand):
    """Its byte is also that of WRITE_COUNT."""

    __slots__ = ()
    layout = layout("STANDBY", 0x57, "request", (), 0, kind="setup")


class Escape(SetupCommand):
    """Its byte is the prefix."""

    __slots__ = ()
    layout = layout("ESCAPE", 0x1B, "request", (), 0, kind="setup")


MESSAGES = (
    ReadCount, ReadCountReply, ReadState, ReadStateReply, ReadName, ReadNameReply,
    ReadSpare, ReadSpareReply, Stop, WriteCount, WriteLimits, WriteWide, WritePage, WriteSpare,
    Restart, Standby, Escape,
)  # fmt: skip

PROTOCOL = CommandProtocol(
    "invented",
    title="Invented commands",
    package="invented",
    messages=MESSAGES,
    prefix=PREFIX,
    terminator=TERMINATOR,
    axes={"LEFT": 0x21, "RIGHT": 0x22},
)
