"""A protocol of packets: how bytes find their message, and how its stream is cut into packets."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from stagewire.errors import BadLengthError, DecodeError, UnknownMessageError
from stagewire.packets.framer import PacketFramer
from stagewire.packets.layouts import layouts_by_id
from stagewire.packets.message import PacketMessage
from stagewire.packets.packet import Packet, make_packet
from stagewire.packets.refusals import named, refusal
from stagewire.packets.shape import Shape
from stagewire.protocol import Protocol, as_bytes

TYPE_CHECKING = False  # typing would take half of the time of an import
if TYPE_CHECKING:
    from typing import Any

__all__ = ["PacketProtocol"]


class PacketProtocol(Protocol):
    """A protocol of packets: start bytes, a length, an id, a payload, and what else its shape says.

    A class belongs to the one protocol that lists it, which tells it the shape.

    :param name: name in the registry.
    :param title: for people.
    :param package: the generated package; it holds ``registry.json`` and ``vectors.json``.
    :param messages: every message class.
    :param shape: how packets look.
    :param nameless: messages that the document names without an id, and why they cannot be used.

    Raises :class:`ValueError` for messages that packets cannot carry or tell apart.
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
        :class:`~stagewire.errors.BadValueError` for what is not bytes, such as hex text.
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
        """Return a new framer for one stream; packets look alike at both ends of a line."""
        return PacketFramer(self.shape, self._layouts, self.decode)

    def message_class(self, message: str, form: str | None = None) -> type[PacketMessage]:
        """Return the class of a message by its name in the registry and, if it has several, its form.

        Raises as :meth:`Protocol.message_class <stagewire.protocol.Protocol.message_class>` does.
        """
        found: Any = super().message_class(message, form)
        cls: type[PacketMessage] = found
        return cls
