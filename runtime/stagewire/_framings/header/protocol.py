"""The class of protocols with framed messages: decoding, encoding by name, and the framer."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping

from stagewire._codec.message import Layout
from stagewire._codec.protocol import Protocol, as_bytes, check_fields
from stagewire._framings.header.counted import CountedMessage
from stagewire._framings.header.frame import Frame, make_frame
from stagewire._framings.header.framer import Framer
from stagewire._framings.header.message import (
    DATA_FLAG,
    HEADER_SIZE,
    MAXIMUM_PACKET,
    FramedMessage,
    UndecidedMessage,
    UndocumentedMessage,
)
from stagewire._framings.header.table import (
    End,
    FaultPlaces,
    Forms,
    FramingTable,
    shared_forms,
    sub_message_of,
)
from stagewire.errors import (
    BadLengthError,
    BadValueError,
    MissingFieldError,
    TrailingBytesError,
    TruncatedError,
    UnknownFieldError,
    UnknownMessageError,
    UnknownSubMessageError,
)

TYPE_CHECKING = False  # importing typing would double the import time
if TYPE_CHECKING:
    from typing import Any, Final


_REMEMBERED_HEADERS: Final = 1024
_NO_FAULTS: Final[Mapping[int, FaultPlaces]] = {}
_NO_ALIASES: Final[Mapping[str, str]] = {}
_ID: Final = range(2)
_LENGTH: Final = range(2, 4)
_DEST: Final = range(4, 5)
_SUB_MESSAGE: Final = range(6, 8)


class _Shapes:
    """The layouts of one message id, ready for lookup by form and length.

    If several messages share the id, each of its sub-messages has layouts of its own.
    """

    __slots__ = (
        "by_length", "counted", "decided", "direction", "header", "name", "only_zero",
        "sub_messages", "undocumented",
    )  # fmt: skip

    def __init__(self, layout: Layout) -> None:
        self.name = layout.message
        self.direction = layout.direction
        self.only_zero = False
        self.header: type[FramedMessage] | None = None
        self.by_length: dict[int, type[FramedMessage]] = {}
        self.decided: list[type[FramedMessage]] = []
        self.undocumented: type[FramedMessage] | None = None
        self.counted: type[CountedMessage] | None = None
        self.sub_messages: dict[int, _Shapes] = {}

    def add(self, cls: type[FramedMessage]) -> None:
        layout = cls.layout
        if issubclass(cls, UndocumentedMessage):
            self.undocumented = cls
        elif layout.form == "header":
            self.header = cls
            self.only_zero = layout.only_zero
        elif issubclass(cls, CountedMessage):
            self.counted = cls
        elif layout.when:
            self.decided.append(cls)
        else:
            self.by_length[layout.length] = cls

    def lengths(self) -> frozenset[int]:
        decided = {cls.layout.length for cls in self.decided}
        return frozenset(self.by_length) | decided

    def forms(self) -> Forms:
        """Return what the framer needs."""
        if self.sub_messages:
            return shared_forms({v: shapes.forms() for v, shapes in self.sub_messages.items()})
        return Forms(
            name=self.name,
            direction=self.direction,
            header=self.header is not None,
            lengths=self.lengths(),
            documented=self.undocumented is None,
            only_zero_parameters=self.only_zero,
            counted=self.counted.counted if self.counted else None,
        )

    @property
    def longest(self) -> int:
        """Bytes of the longest packet that a header may announce."""
        return self.counted.counted.most if self.counted else MAXIMUM_PACKET

    def known_lengths(self) -> str:
        """Return the lengths of packets, for people; empty if there is none."""
        if self.counted:
            return f"{self.counted.counted.least} to {self.counted.counted.most}"
        return _list(self.forms().lengths)

    def data(self, length: int, context: Mapping[str, str] | None) -> type[FramedMessage] | None:
        """Return the class for a packet of ``length`` bytes: the longest layout that it fills."""
        if context:
            for cls in self.decided:
                wanted = cls.layout.when
                if cls.layout.length <= length and wanted.items() <= context.items():
                    return cls
        fitting = [size for size in self.by_length if size <= length]
        return self.by_length[max(fitting)] if fitting else None


class FramedProtocol(Protocol):
    """A protocol of framed messages with a six-byte header.

    :param name: name in the registry, such as ``thorlabs_apt``.
    :param title: name for people.
    :param package: the generated package; it holds ``registry.json`` and ``vectors.json``.
    :param messages: all message classes.
    :param host: address of the host.
    :param devices: addresses of controllers.
    :param nameless: messages that the document names without an id -> why they cannot be used.
    :param channel: the field with the channel that a message concerns; None: controllers have no channels.
    :param faults: message id -> the offsets of the fault report in that message.
    :param aliases: other names of messages -> their names.
    """

    def __init__(
        self,
        name: str,
        title: str,
        package: str,
        messages: Iterable[type[FramedMessage]],
        host: int,
        devices: frozenset[int],
        nameless: Mapping[str, str],
        channel: str | None = None,
        faults: Mapping[int, FaultPlaces] = _NO_FAULTS,
        aliases: Mapping[str, str] = _NO_ALIASES,
    ) -> None:
        super().__init__(name, title, package, messages, nameless, aliases)
        self.messages: tuple[type[FramedMessage], ...] = tuple(self.messages)
        self.host = host
        self.devices = devices
        self.channel = channel
        self.faults = faults
        self._shapes: dict[int, _Shapes] = {}
        # Header -> unpack, size, destination, source, if the header alone decides. Controllers repeat the
        # same few headers. The number of entries is limited to _REMEMBERED_HEADERS.
        self._headers: dict[bytes, tuple[Callable[[bytes], FramedMessage], int, int, int]] = {}
        for cls in self.messages:
            layout = cls.layout
            shapes = self._shapes.setdefault(layout.id, _Shapes(layout))
            if layout.sub_message is not None:
                shapes = shapes.sub_messages.setdefault(layout.sub_message, _Shapes(layout))
            shapes.add(cls)
        forms = {id: shapes.forms() for id, shapes in self._shapes.items()}
        without_flag = frozenset(
            (cls.layout.id | cls.layout.length << 16).to_bytes(4, "little")
            for cls in self.messages
            if cls.layout.without_flag and cls.layout.form != "header"
        )
        self.framing = FramingTable(forms, host, devices, without_flag)
        for id in self.framing.shared:
            self._shapes[id].name = forms[id].name

    # Decoding

    def decode(self, raw: bytes, context: Mapping[str, str] | None = None) -> Frame:
        """Decode the bytes of exactly one frame.

        ``context`` selects between layouts that bytes alone cannot distinguish, such as
        ``{"status": "dc"}``; without it such a frame decodes to the message's ``…Undecided`` class.

        Raises :class:`~stagewire.errors.TruncatedError`, :class:`~stagewire.errors.TrailingBytesError`,
        :class:`~stagewire.errors.BadLengthError`, :class:`~stagewire.errors.UnknownMessageError` or
        :class:`~stagewire.errors.UnknownSubMessageError`, and :class:`~stagewire.errors.BadValueError` if
        ``raw`` is not bytes, such as hex text.
        """
        if raw.__class__ is not bytes:
            raw = as_bytes(raw)
        try:
            unpack, size, dest, source = self._headers[raw[:HEADER_SIZE]]
        except KeyError:
            pass  # not seen before
        else:
            if len(raw) == size:
                return make_frame(unpack(raw), dest, source)
        return self._decode(raw, context)

    def _decode(self, raw: bytes, context: Mapping[str, str] | None) -> Frame:
        size = len(raw)
        if size < HEADER_SIZE:
            raise TruncatedError(
                f"a frame has at least {HEADER_SIZE} bytes, not {size}", range(size, size + 1)
            )
        id = raw[0] | raw[1] << 8
        shapes = self._shapes.get(id)
        if shapes is None:
            raise UnknownMessageError(
                f"bytes 0 and 1: no message of {self.title} has the id {id:#06x}", _ID
            )
        dest, source = raw[4] & ~DATA_FLAG, raw[5]
        extra = b""
        if self.framing.has_packet(raw):
            length = raw[2] | raw[3] << 8
            if size != HEADER_SIZE + length:
                raise self._wrong_size(shapes, length, size)
            if length > shapes.longest:
                raise BadLengthError(
                    f"{shapes.name}: bytes 2 and 3 declare a packet of {length} bytes; "
                    f"no packet has more than {shapes.longest}",
                    _LENGTH,
                )
            if shapes.counted:
                self._check_count(shapes.counted, length, raw)
                return make_frame(shapes.counted.unpack(raw), dest, source)
            if shapes.sub_messages:
                shapes = self._by_sub_message(shapes, id, raw)
            cls = shapes.undocumented or shapes.data(length, context)
            if cls is None:
                raise self._bad_length(shapes, length)
            if not shapes.undocumented:
                extra = raw[HEADER_SIZE + cls.layout.length :]
        else:
            if size != HEADER_SIZE:
                # A packet length that matches the size means that the data flag was lost.
                declared = raw[2] | raw[3] << 8
                at = _DEST if HEADER_SIZE + declared == size else range(HEADER_SIZE, size)
                raise TrailingBytesError(
                    f"{shapes.name}: byte 4 ({dest:#04x}) announces no data packet, so the frame ends "
                    f"after {HEADER_SIZE} bytes, but {size - HEADER_SIZE} more follow from byte "
                    f"{HEADER_SIZE}",
                    at,
                )
            if shapes.sub_messages:
                shapes = self._by_sub_message(shapes, id, raw)
            cls = shapes.header or shapes.undocumented
            if cls is None:
                raise BadLengthError(
                    f"{shapes.name}: byte 4 ({dest:#04x}) announces no data packet, but the message "
                    f"has no header-only form (packet of {shapes.known_lengths()} bytes)",
                    _DEST,
                )
        by_header = not (shapes.decided or (id in self.framing.shared and size > HEADER_SIZE))
        if not extra and by_header and len(self._headers) < _REMEMBERED_HEADERS:
            self._headers[raw[:HEADER_SIZE]] = cls.unpack, size, dest, source
        return make_frame(cls.unpack(raw), dest, source, extra)

    def _by_sub_message(self, shapes: _Shapes, id: int, raw: bytes) -> _Shapes:
        """Return the layouts of the sub-message in a whole frame of a shared id."""
        value = sub_message_of(raw)
        if value is None:
            raise self._bad_length(shapes, len(raw) - HEADER_SIZE)
        found = shapes.sub_messages.get(value)
        if found is None:
            known = ", ".join(f"{v} ({s.name})" for v, s in sorted(shapes.sub_messages.items()))
            packet = len(raw) > HEADER_SIZE
            raise UnknownSubMessageError(
                f"{'bytes 6 and 7' if packet else 'byte 2'}: no message of {self.title} with the id "
                f"{id:#06x} has the sub-message {value}; known: {known}",
                _SUB_MESSAGE if packet else range(2, 3),
            )
        return found

    @staticmethod
    def _check_count(cls: type[CountedMessage], length: int, raw: bytes) -> None:
        """Raise unless a packet has the length that its fields state."""
        counted = cls.counted
        if length < counted.least:
            wanted = f"a packet has at least {counted.least}"
        elif length != (stated := counted.length_in(raw)):
            wanted = f"its {' and '.join(counted.places)} state {stated}"
        else:
            return
        raise BadLengthError(
            f"{cls.layout.message}: bytes 2 and 3 declare a packet of {length} bytes, but {wanted}",
            _LENGTH,
        )

    @staticmethod
    def _wrong_size(shapes: _Shapes, length: int, size: int) -> TruncatedError | TrailingBytesError:
        text = (
            f"{shapes.name}: bytes 2 and 3 declare a packet of {length} bytes, "
            f"but {size - HEADER_SIZE} follow the header"
        )
        end = HEADER_SIZE + length
        if size < end:
            return TruncatedError(f"{text}; the frame ends before byte {size}", _LENGTH)
        return TrailingBytesError(f"{text}; it ends before byte {end}", range(end, size))

    @staticmethod
    def _bad_length(shapes: _Shapes, length: int) -> BadLengthError:
        forms = shapes.known_lengths()
        wanted = f"a packet has {forms} bytes" if forms else "the message has no packet"
        return BadLengthError(
            f"{shapes.name}: bytes 2 and 3 declare a packet of {length} bytes, but {wanted}",
            _LENGTH,
        )

    def framer(self, end: End = End.NONE) -> Framer:
        """Return a new framer for one stream; ``end`` is the end of the line that receives it.

        Raises :class:`~stagewire.errors.BadValueError` if ``end`` is not an :class:`.End`.
        """
        return Framer(self.framing, end, self.decode)

    # Encoding by name

    def message_class(self, message: str, form: str | None = None) -> type[FramedMessage]:
        """Return the class of a message by its registry name and, if it has several forms, its form.

        Without a form, a message whose packets have several lengths has its plain form, ``data``.

        Raises the errors of :meth:`Protocol.message_class <stagewire.protocols.Protocol.message_class>`.
        """
        found: Any = super().message_class(message, form)
        cls: type[FramedMessage] = found
        return cls

    def _certain(self, forms: Iterable[str]) -> list[str]:
        certain = [form for form in forms if form != "data:undecided"]
        return ["data"] if "data" in certain and "header" not in certain else certain

    def build(
        self,
        message: str,
        fields: Mapping[str, Any],
        form: str | None = None,
        data: bytes | None = None,
    ) -> FramedMessage:
        """Return a message by its name, with these fields. All fields are checked.

        ``data`` is the whole packet of a message with an undecided or undocumented layout. If fields are
        given in addition to the data of an undecided layout, both must agree.

        Raises the errors of :meth:`message_class`; an :class:`~stagewire.errors.EncodeError`:
        :class:`~stagewire.errors.UnknownFieldError`, :class:`~stagewire.errors.MissingFieldError`,
        :class:`~stagewire.errors.OutOfRangeError` or :class:`~stagewire.errors.BadValueError`; and
        :class:`~stagewire.errors.UnsupportedError` for an undocumented layout without data.
        """
        cls = self.message_class(message, form)
        layout = cls.layout
        if "data" in fields and issubclass(cls, (UndecidedMessage, UndocumentedMessage)):
            raise UnknownFieldError(
                f"{message} ({layout.form}): data is the packet, not a field; pass it as data=…"
            )
        if issubclass(cls, UndecidedMessage):
            check_fields(layout, fields, {*layout.fields, *cls.shared})
            if data is None:
                raise MissingFieldError(
                    f"{message} ({layout.form}) requires data=…, its whole packet"
                )
            undecided = cls(data)
            for name, value in fields.items():
                if isinstance(value, (bool, float)) or getattr(undecided, name) != value:
                    raise BadValueError(
                        f"{message}.{name} is {getattr(undecided, name)} in data, not {value!r}"
                    )
            return undecided
        if issubclass(cls, UndocumentedMessage):
            check_fields(layout, fields, layout.fields)
            return cls(data, **fields)
        check_fields(layout, fields, layout.fields)
        if data is not None:
            raise BadValueError(f"{message} ({layout.form}) takes fields, not data")
        made: Any = super().build(message, fields, form)
        framed: FramedMessage = made
        return framed


def _list(lengths: frozenset[int]) -> str:
    return " or ".join(str(length) for length in sorted(lengths))
