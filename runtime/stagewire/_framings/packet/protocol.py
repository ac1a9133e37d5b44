"""The class of protocols with packets: decoding and the framer.

If bytes are not exactly one packet, the error names the first part that is wrong.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from stagewire._codec.protocol import Protocol, as_bytes
from stagewire._framings.packet.framer import PacketFramer, layouts_by_id
from stagewire._framings.packet.packet import Packet, PacketMessage, make_packet
from stagewire._framings.packet.shape import Shape
from stagewire.errors import (
    BadLengthError,
    DamagedError,
    DecodeError,
    TrailingBytesError,
    TruncatedError,
    UnknownMessageError,
)

TYPE_CHECKING = False  # importing typing would double the import time
if TYPE_CHECKING:
    from typing import Any


def refusal(shape: Shape, raw: bytes) -> DecodeError:
    """Return the error for bytes that are not exactly one packet of this shape."""
    size = len(raw)
    for at, (came, wanted) in enumerate(zip(raw, shape.start, strict=False)):
        if came != wanted:
            text = f"a packet begins with {_hex(shape.start)}, but byte {at} is {came:02X}"
            return DamagedError(text, range(at, at + 1))
    if size < shape.least:
        text = f"a packet has at least {shape.least} bytes, not {size}"
        return TruncatedError(text, range(size, size + 1))
    declared, place = shape.declared(raw), shape.place("length", 0)
    payload = declared - shape.counted
    says = f"{named(place)} contain{'s' if len(place) == 1 else ''} the length {declared}"
    if payload < 0:
        text = f"{says}, but {_and(shape.counts)} have at least {shape.counted} bytes"
        return BadLengthError(text, place)
    if payload > shape.maximum:
        text = f"{says}, a payload of {payload} bytes; the maximum is {shape.maximum}"
        return BadLengthError(text, place)
    end = shape.least + payload
    if size < end:
        text = f"{says}, so the packet has {end} bytes, but it ends before byte {size}"
        return TruncatedError(text, place)
    if size > end:
        more = f"{size - end} more byte{'s' if size > end + 1 else ''}"
        text = f"{says}, so the packet ends before byte {end}; found {more}"
        return TrailingBytesError(text, range(end, size))
    return _damage(shape, raw, payload)


def _damage(shape: Shape, raw: bytes, payload: int) -> DecodeError:
    """Return the error for bytes of the right length with wrong end bytes or a wrong check."""
    if not raw.endswith(shape.end):
        place = shape.place("end", payload)
        came = raw[place.start : place.stop]
        text = f"a packet ends with {_hex(shape.end)}, but {_are(place)} {_hex(came)}"
        return DamagedError(text, place)
    place = shape.place("check", payload)
    wanted = shape.check_of(raw).to_bytes(len(place), "little")
    came = raw[place.start : place.stop]
    text = (
        f"{_are(place)} {_hex(came)}, the check of {_and(shape.covers)}; "
        f"computed from the received bytes it is {_hex(wanted)}"
    )
    return DamagedError(text, place)


def named(place: range) -> str:
    """Return a description of bytes: ``byte 2``, ``bytes 2 and 3``, ``bytes 2 to 5``."""
    if len(place) == 1:
        return f"byte {place.start}"
    return f"bytes {place.start} {'and' if len(place) == 2 else 'to'} {place.stop - 1}"


def _are(place: range) -> str:
    return f"{named(place)} {'is' if len(place) == 1 else 'are'}"


def _and(parts: tuple[str, ...]) -> str:
    return " and ".join([", ".join(parts[:-1]), parts[-1]]) if len(parts) > 1 else parts[0]


def _hex(raw: bytes) -> str:
    return raw.hex(" ").upper()


class PacketProtocol(Protocol):
    """A protocol of packets: start bytes, a length, an id, a payload, and the other parts of its shape.

    A message class belongs to the one protocol that lists it. The protocol sets its shape.

    :param name: name in the registry.
    :param title: name for people.
    :param package: the generated package; it holds ``registry.json`` and ``vectors.json``.
    :param messages: all message classes.
    :param shape: the shape of the packets.
    :param nameless: messages that the document names without an id -> why they cannot be used.

    Raises :class:`ValueError` for messages that packets cannot hold or cannot distinguish.
    """

    def __init__(
        self,
        name: str,
        title: str,
        package: str,
        messages: Iterable[type[PacketMessage]],
        shape: Shape,
        nameless: Mapping[str, str],
    ) -> None:
        super().__init__(name, title, package, messages, nameless)
        self.messages: tuple[type[PacketMessage], ...] = tuple(self.messages)
        self.shape = shape
        self._layouts = layouts_by_id(shape, self.messages)
        for cls in self.messages:
            taken: Shape | None = vars(cls).get("shape")
            if taken is not None and taken != shape:
                raise ValueError(f"{cls.__name__} belongs to a protocol with another shape")
            cls.shape = shape

    def decode(self, raw: bytes) -> Packet:
        """Decode the bytes of exactly one packet.

        Raises :class:`~stagewire.errors.TruncatedError`, :class:`~stagewire.errors.TrailingBytesError`,
        :class:`~stagewire.errors.BadLengthError` or :class:`~stagewire.errors.UnknownMessageError`,
        :class:`~stagewire.errors.DamagedError` for wrong start bytes, end bytes or a wrong check, and
        :class:`~stagewire.errors.BadValueError` if ``raw`` is not bytes, such as hex text.
        """
        if raw.__class__ is not bytes:
            raw = as_bytes(raw)
        shape = self.shape
        length = len(raw) - shape.least
        if not (
            0 <= length <= shape.maximum
            and raw.startswith(shape.start)
            and shape.declared(raw) == length + shape.counted
            and shape.is_whole(raw)
        ):
            raise refusal(shape, raw)
        id = shape.number("id", raw)
        layouts = self._layouts.get(id)
        if layouts is None:
            place = shape.place("id", length)
            digits = 2 + 2 * shape.id
            raise UnknownMessageError(
                f"{named(place)}: no message of {self.title} has the id {id:#0{digits}x}", place
            )
        cls = layouts.of(length)
        if cls is None:
            raise self._bad_length(layouts.name, length, layouts.lengths())
        payload = shape.payload(raw)
        address = shape.number("address", raw) if shape.address else None
        return make_packet(cls.unpack(payload), address, payload[cls.layout.length :])

    def _bad_length(self, name: str, length: int, lengths: str) -> DecodeError:
        place = self.shape.place("length", length)
        leaves = f"leave{'s' if len(place) == 1 else ''} {length} byte{'' if length == 1 else 's'}"
        return BadLengthError(
            f"{name}: {named(place)} {leaves} for its payload, which has {lengths}", place
        )

    def framer(self) -> PacketFramer:
        """Return a new framer for one stream; it works at either end of a line."""
        return PacketFramer(self.shape, self._layouts, self.decode)

    def message_class(self, message: str, form: str | None = None) -> type[PacketMessage]:
        """Return the class of a message by its registry name and, if it has several forms, its form.

        Raises the errors of :meth:`Protocol.message_class <stagewire.protocols.Protocol.message_class>`.
        """
        found: Any = super().message_class(message, form)
        cls: type[PacketMessage] = found
        return cls
