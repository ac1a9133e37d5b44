"""Messages of frames, with a layout or with raw bytes; and the header that carries them.

A header has six bytes. Bytes 0 and 1 are the message id, 2 and 3 two parameters or the length of the packet,
4 the destination and 5 the source. A bit of the destination announces a packet.
"""

from __future__ import annotations

from struct import Struct

from stagewire._codec.message import Message, check_bytes, check_integer
from stagewire.errors import BadValueError, OutOfRangeError, UnsupportedError

TYPE_CHECKING = False  # importing typing would double the import time
if TYPE_CHECKING:
    from typing import ClassVar, Final, Self


HEADER_SIZE: Final = 6
DATA_FLAG: Final = 0x80
"""The bit of the destination byte that announces a packet."""
MAXIMUM_PACKET: Final = 255
"""Bytes of the longest packet."""


_HEADER = Struct("<HBBBB")
_DATA_HEADER = Struct("<HHBB")


def with_flag(raw: bytes) -> bytes:
    """Return a whole frame as it is sent: a packet has the data flag."""
    if len(raw) == HEADER_SIZE or raw[4] & DATA_FLAG:
        return raw
    return raw[:4] + bytes((raw[4] | DATA_FLAG,)) + raw[5:]


class FramedMessage(Message, abstract=True):
    """Base of messages that are carried by a header with two addresses."""

    __slots__ = ()

    @classmethod
    def unpack(cls, raw: bytes) -> Self:
        """Return the message in the bytes of a whole frame, without any check."""
        raise NotImplementedError

    def pack(self, dest: int, source: int) -> bytes:
        """Return the bytes of a whole frame that carries this message.

        ``dest`` is the address without the top bit. Raises
        :class:`~stagewire.errors.OutOfRangeError` for an address out of range and
        :class:`~stagewire.errors.BadValueError` for one that is not an integer.
        """
        raise NotImplementedError


class UndecidedMessage(FramedMessage, abstract=True):
    """A payload that fits several layouts of one message, received without a context to select one.

    The fields that all candidates share are read from ``data``; nothing else is guessed. The message is
    encoded from ``data`` alone.
    """

    __slots__ = ("data",)
    data: bytes
    if TYPE_CHECKING:
        shared: ClassVar[tuple[str, ...]]

    def __new__(cls, data: bytes) -> Self:
        """Make the message from its whole payload.

        Raises :class:`~stagewire.errors.OutOfRangeError` for a payload of another length and
        :class:`~stagewire.errors.BadValueError` if it is not bytes.
        """
        return cls.keep({"data": check_bytes(cls.layout, "data", data, cls.layout.length)})

    @classmethod
    def unpack(cls, raw: bytes) -> Self:
        """Return the message in the bytes of a whole frame, without any check."""
        return cls.keep({"data": bytes(raw[HEADER_SIZE : HEADER_SIZE + cls.layout.length])})

    def pack(self, dest: int, source: int) -> bytes:
        """Return the bytes of a whole frame that carries this message.

        Raises :class:`~stagewire.errors.OutOfRangeError` for an address out of range.
        """
        check_addresses(dest, source)
        layout = self.layout
        return _DATA_HEADER.pack(layout.id, layout.length, dest | DATA_FLAG, source) + self.data


class UndocumentedMessage(FramedMessage, abstract=True):
    """A message whose id is documented but whose layout is not.

    The received bytes are kept: the packet of a data frame (``data``) or the parameter bytes of a header
    (``param1``, ``param2``, with ``data`` None). It cannot be made from named fields.
    """

    __slots__ = ("data", "param1", "param2")
    data: bytes | None
    param1: int
    param2: int

    def __new__(
        cls, data: bytes | None = None, *, param1: int | None = None, param2: int | None = None
    ) -> Self:
        """Make the message from raw bytes: a packet, or two parameters.

        Raises :class:`~stagewire.errors.UnsupportedError` if neither is given, because an undocumented layout
        has no default. Raises :class:`~stagewire.errors.OutOfRangeError` for a packet of over 255 bytes or
        parameters outside 0 to 255, and :class:`~stagewire.errors.BadValueError` for values of the wrong type
        or both data and parameters.
        """
        if data is None and param1 is None and param2 is None:
            raise UnsupportedError(
                f"{cls.layout.message} has no documented layout; give the bytes of its data"
            )
        param1 = 0 if param1 is None else param1
        param2 = 0 if param2 is None else param2
        if data is not None:
            if not isinstance(data, (bytes, bytearray, memoryview)):
                raise BadValueError(f"{cls.layout.message}.data must be bytes, not {data!r}")
            if len(data) > MAXIMUM_PACKET:
                raise OutOfRangeError(
                    f"{cls.layout.message}.data must have at most {MAXIMUM_PACKET} bytes, "
                    f"not {len(data)}"
                )
            if param1 or param2:
                raise BadValueError(f"{cls.layout.message} carries data or parameters, not both")
            data = bytes(data)
        check_integer(cls.layout, "param1", param1, 0, 255)
        check_integer(cls.layout, "param2", param2, 0, 255)
        return cls.keep({"data": data, "param1": param1, "param2": param2})

    @classmethod
    def unpack(cls, raw: bytes) -> Self:
        """Return the message in the bytes of a whole frame, without any check."""
        if raw[4] & DATA_FLAG:
            return cls.keep({"data": bytes(raw[HEADER_SIZE:]), "param1": 0, "param2": 0})
        return cls.keep({"data": None, "param1": raw[2], "param2": raw[3]})

    def pack(self, dest: int, source: int) -> bytes:
        """Return the bytes of the frame that was received.

        Raises :class:`~stagewire.errors.OutOfRangeError` for an address out of range.
        """
        check_addresses(dest, source)
        if self.data is None:
            return _HEADER.pack(self.layout.id, self.param1, self.param2, dest, source)
        header = _DATA_HEADER.pack(self.layout.id, len(self.data), dest | DATA_FLAG, source)
        return header + self.data


def check_addresses(dest: object, source: object) -> None:
    """Raise unless ``dest`` is 0 to 0x7F and ``source`` is 0 to 0xFF.

    The top bit of the destination byte announces a data packet; the encoder sets it. Raises
    :class:`~stagewire.errors.OutOfRangeError`, or :class:`~stagewire.errors.BadValueError` for an address
    that is not an integer.
    """
    for name, value, maximum in (("dest", dest, 0x7F), ("source", source, 0xFF)):
        if isinstance(value, bool) or not isinstance(value, int):
            raise BadValueError(
                f"{name} must be an address from 0 to {maximum:#04x}, not {value!r}"
            )
        if not 0 <= value <= maximum:
            raise OutOfRangeError(
                f"{name} must be an address from 0 to {maximum:#04x}, not {value}"
            )
