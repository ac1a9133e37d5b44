"""The offsets of the fields of one layout in its frames."""

from __future__ import annotations

import enum
import re
import struct
from dataclasses import dataclass

from stagewire._codec.message import Layout, Message
from stagewire._framings.header.counted import Counted, CountedMessage
from stagewire._framings.header.message import (
    HEADER_SIZE,
    FramedMessage,
    UndecidedMessage,
    UndocumentedMessage,
)
from stagewire._framings.header.table import SUB_MESSAGE_SIZE
from stagewire.errors import BadValueError, UnsupportedError

_CODES = re.compile(r"(\d*)([xsbBhHlLqQ])")


class Kind(enum.Enum):
    """How the bytes of a field are interpreted."""

    UNSIGNED = "unsigned integer"
    SIGNED = "signed integer"
    TEXT = "text"
    BYTES = "bytes"
    INTEGERS = "integers"
    """The integers of an array, as many as other fields state."""


@dataclass(frozen=True, slots=True)
class Field:
    """One field of a frame.

    :param name: name of the field.
    :param offset: its first byte, counted from the beginning of the frame.
    :param size: its size in bytes; integers are low byte first and have 1 to 8. Of an array, the size of one
        integer.
    :param kind: how its bytes are interpreted.
    """

    name: str
    offset: int
    size: int
    kind: Kind

    @property
    def width(self) -> int:
        """Bytes of the machine integer that holds the field: 1, 2, 4 or 8."""
        return 1 << (self.size - 1).bit_length()


@dataclass(frozen=True, slots=True)
class Shape:
    """The common layout of all frames of one message form.

    :param name: message and form, for people.
    :param head: the bytes that every frame begins with: the id and, for a data form, the length.
    :param has_packet: whether the destination byte has the bit that announces a packet.
    :param size: bytes of a frame, including the header.
    :param fields: the fields in wire order.
    :param sub_message: the sub-message as bytes; empty if no other message has this id.
    :param counted: the array at the end of the frames, which are then at least ``size`` bytes long.
    """

    name: str
    head: bytes
    has_packet: bool
    size: int
    fields: tuple[Field, ...]
    sub_message: bytes = b""
    counted: Counted | None = None

    @property
    def sub_message_at(self) -> int:
        """Offset of the sub-message in a frame."""
        return HEADER_SIZE if self.has_packet else len(self.head)

    @property
    def places(self) -> tuple[Field, ...]:
        """The fields, under the name of version 0.1."""
        return self.fields


def shape_of(message: type[Message]) -> Shape:
    """Return the shape of the frames of a message class.

    Raises :class:`~stagewire.errors.BadValueError` if ``message`` is not a message class, and
    :class:`~stagewire.errors.UnsupportedError` for a message without a documented layout, because its frames
    have no common length.
    """
    if not (isinstance(message, type) and issubclass(message, Message)):
        raise BadValueError(f"columns are made from a message class, not from {message!r}")
    if not issubclass(message, FramedMessage):
        raise UnsupportedError(
            f"{message.__name__} has no header of six bytes; only frames with a header have columns"
        )
    if issubclass(message, UndocumentedMessage):
        raise UnsupportedError(
            f"{message.layout.message} has no documented layout and therefore no columns"
        )
    layout = message.layout
    has_packet = layout.form != "header"
    head = layout.id.to_bytes(2, "little")
    if issubclass(message, CountedMessage):
        counted = message.counted
        last = Field(counted.name, HEADER_SIZE + counted.least, counted.size, Kind.INTEGERS)
        return Shape(
            name=f"{layout.message} ({layout.form})",
            head=head,
            has_packet=True,
            size=HEADER_SIZE + layout.length,
            fields=(*_fields(message), last),
            counted=counted,
        )
    return Shape(
        name=f"{layout.message} ({layout.form})",
        head=head + layout.length.to_bytes(2, "little") if has_packet else head,
        has_packet=has_packet,
        size=HEADER_SIZE + layout.length,
        fields=_fields(message),
        sub_message=_sub_message(layout),
    )


def _sub_message(layout: Layout) -> bytes:
    if layout.sub_message is None:
        return b""
    size = 1 if layout.form == "header" else SUB_MESSAGE_SIZE
    return layout.sub_message.to_bytes(size, "little")


def _fields(message: type[Message]) -> tuple[Field, ...]:
    layout = message.layout
    if issubclass(message, UndecidedMessage):
        return (Field("data", HEADER_SIZE, layout.length, Kind.BYTES),)
    # The fields of a generated class are in the format of the Struct that unpacks whole frames.
    unpacker = getattr(getattr(message, "_unpack", None), "__self__", None)
    if not isinstance(unpacker, struct.Struct):
        raise UnsupportedError(f"{message.__name__} does not define the offsets of its fields")
    names = iter(layout.fields)
    fields = []
    offset = 0
    for digits, code in _CODES.findall(unpacker.format):
        count = int(digits or 1)
        if code == "x":
            offset += count
        elif code == "s":
            name = next(names)
            fields.append(Field(name, offset, count, _kind_of_string(message, name)))
            offset += count
        else:
            size = struct.calcsize(f"<{code}")
            kind = Kind.SIGNED if code.islower() else Kind.UNSIGNED
            for _ in range(count):
                fields.append(Field(next(names), offset, size, kind))
                offset += size
    return tuple(fields)


def _kind_of_string(message: type[Message], name: str) -> Kind:
    """Return the kind of a run of bytes, from the type annotation of the field and its sign."""
    kind = message.__annotations__.get(name)
    if kind in (int, "int"):  # Struct has no code for three-byte integers
        return Kind.SIGNED if name in message.layout.signed else Kind.UNSIGNED
    return Kind.TEXT if kind in (str, "str") else Kind.BYTES
