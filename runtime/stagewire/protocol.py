"""One protocol: its messages, how bytes find them, and how its stream is cut into frames.

A generated package makes one :class:`Protocol` and names it under the entry point group
``stagewire.protocols``; whatever works for all protocols finds it there.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from functools import cache

from stagewire.errors import (
    BadLengthError,
    BadValueError,
    MissingFieldError,
    TrailingBytesError,
    TruncatedError,
    UnknownFieldError,
    UnknownMessageError,
    UnknownProtocolError,
    UnsupportedError,
)
from stagewire.frame import Frame, make_frame
from stagewire.framing import End, Forms, Framer, FramingTable
from stagewire.header import DATA_FLAG, HEADER_SIZE, MAXIMUM_PACKET
from stagewire.message import Layout, Message, UndecidedMessage, UndocumentedMessage

TYPE_CHECKING = False  # typing would take half of the time of an import
if TYPE_CHECKING:
    from importlib.metadata import EntryPoints
    from typing import Any, Final

__all__ = ["Protocol", "available_protocols", "load_protocol"]

_ENTRY_POINTS = "stagewire.protocols"
_REMEMBERED_HEADERS: Final = 1024


class _Shapes:
    """The layouts of one message id, ready for dispatch."""

    __slots__ = (
        "by_length", "decided", "direction", "header", "name", "only_zero", "undocumented"
    )  # fmt: skip

    def __init__(self, layout: Layout) -> None:
        self.name = layout.message
        self.direction = layout.direction
        self.only_zero = False
        self.header: type[Message] | None = None
        self.by_length: dict[int, type[Message]] = {}
        self.decided: list[type[Message]] = []
        self.undocumented: type[Message] | None = None

    def add(self, cls: type[Message]) -> None:
        layout = cls.layout
        if issubclass(cls, UndocumentedMessage):
            self.undocumented = cls
        elif layout.form == "header":
            self.header = cls
            self.only_zero = layout.only_zero
        elif layout.when:
            self.decided.append(cls)
        else:
            self.by_length[layout.length] = cls

    def lengths(self) -> frozenset[int]:
        decided = {cls.layout.length for cls in self.decided}
        return frozenset(self.by_length) | decided

    def data(self, length: int, context: Mapping[str, str] | None) -> type[Message] | None:
        """Return the class for a packet of ``length`` bytes: the longest layout that it fills."""
        if context:
            for cls in self.decided:
                wanted = cls.layout.when
                if cls.layout.length <= length and wanted.items() <= context.items():
                    return cls
        fitting = [size for size in self.by_length if size <= length]
        return self.by_length[max(fitting)] if fitting else None


class Protocol:
    """A protocol of framed messages with a six-byte header.

    :param name: name in the registry, such as ``thorlabs_apt``.
    :param title: for people.
    :param package: the generated package; it holds ``registry.json`` and ``vectors.json``.
    :param messages: every message class.
    :param host: address of the host.
    :param devices: addresses that controllers have.
    :param nameless: messages that the document names without an id, and why they cannot be used.
    """

    def __init__(
        self,
        name: str,
        title: str,
        package: str,
        messages: Iterable[type[Message]],
        host: int,
        devices: frozenset[int],
        nameless: Mapping[str, str],
    ) -> None:
        self.name = name
        self.title = title
        self.package = package
        self.messages = tuple(messages)
        self.host = host
        self.devices = devices
        self.nameless = dict(nameless)
        self._shapes: dict[int, _Shapes] = {}
        self._by_name: dict[str, dict[str, type[Message]]] = {}
        # What a header alone decides -> unpack, size, destination, source. A controller says the same
        # few things again and again. No more than _REMEMBERED_HEADERS, whatever comes.
        self._headers: dict[bytes, tuple[Callable[[bytes], Message], int, int, int]] = {}
        for cls in self.messages:
            layout = cls.layout
            shapes = self._shapes.setdefault(layout.id, _Shapes(layout))
            shapes.add(cls)
            self._by_name.setdefault(layout.message, {})[layout.form] = cls
        self.framing = FramingTable(
            forms={
                id: Forms(
                    name=shapes.name,
                    direction=shapes.direction,
                    header=shapes.header is not None,
                    lengths=shapes.lengths(),
                    documented=shapes.undocumented is None,
                    only_zero_parameters=shapes.only_zero,
                )
                for id, shapes in self._shapes.items()
            },
            host=host,
            devices=devices,
        )

    def __repr__(self) -> str:
        return f"<Protocol {self.name}: {len(self._by_name)} messages>"

    # Decoding

    def decode(self, raw: bytes, context: Mapping[str, str] | None = None) -> Frame:
        """Decode the bytes of exactly one frame.

        ``context`` decides between layouts that bytes cannot tell apart, such as
        ``{"status": "dc"}``; without it such a frame gives the message's ``…Undecided`` class.

        Raises :class:`~stagewire.errors.TruncatedError`, :class:`~stagewire.errors.TrailingBytesError`,
        :class:`~stagewire.errors.BadLengthError` or :class:`~stagewire.errors.UnknownMessageError`,
        and :class:`~stagewire.errors.BadValueError` for what is not bytes, such as hex text.
        """
        if raw.__class__ is not bytes:
            raw = _as_bytes(raw)
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
            raise TruncatedError(f"a frame has at least {HEADER_SIZE} bytes, here are {size}")
        id = raw[0] | raw[1] << 8
        shapes = self._shapes.get(id)
        if shapes is None:
            raise UnknownMessageError(
                f"bytes 0 and 1: no message of {self.title} has the id {id:#06x}"
            )
        dest, source = raw[4] & ~DATA_FLAG, raw[5]
        extra = b""
        if raw[4] & DATA_FLAG:
            length = raw[2] | raw[3] << 8
            if size != HEADER_SIZE + length:
                raise self._wrong_size(shapes, length, size)
            if length > MAXIMUM_PACKET:
                raise BadLengthError(
                    f"{shapes.name}: bytes 2 and 3 declare a packet of {length} bytes; "
                    f"no packet has more than {MAXIMUM_PACKET}"
                )
            cls = shapes.undocumented or shapes.data(length, context)
            if cls is None:
                raise self._bad_length(shapes, length)
            if not shapes.undocumented:
                extra = raw[HEADER_SIZE + cls.layout.length :]
        else:
            if size != HEADER_SIZE:
                raise TrailingBytesError(
                    f"{shapes.name}: byte 4 ({dest:#04x}) announces no data packet, so the frame ends "
                    f"after {HEADER_SIZE} bytes; {size - HEADER_SIZE} more follow from byte "
                    f"{HEADER_SIZE} on"
                )
            cls = shapes.header or shapes.undocumented
            if cls is None:
                raise BadLengthError(
                    f"{shapes.name}: byte 4 ({dest:#04x}) announces no data packet, but the message "
                    f"has no header-only form (packet of {_list(shapes.lengths())} bytes)"
                )
        if not extra and not shapes.decided and len(self._headers) < _REMEMBERED_HEADERS:
            self._headers[raw[:HEADER_SIZE]] = cls.unpack, size, dest, source
        return make_frame(cls.unpack(raw), dest, source, extra)

    @staticmethod
    def _wrong_size(shapes: _Shapes, length: int, size: int) -> TruncatedError | TrailingBytesError:
        text = (
            f"{shapes.name}: bytes 2 and 3 declare a packet of {length} bytes, "
            f"{size - HEADER_SIZE} follow the header"
        )
        if size < HEADER_SIZE + length:
            return TruncatedError(f"{text}; the frame ends before byte {size}")
        return TrailingBytesError(f"{text}; it ends before byte {HEADER_SIZE + length}")

    @staticmethod
    def _bad_length(shapes: _Shapes, length: int) -> BadLengthError:
        forms = _list(shapes.lengths())
        wanted = f"a packet has {forms} bytes" if forms else "it is a header without a packet"
        return BadLengthError(
            f"{shapes.name}: bytes 2 and 3 declare a packet of {length} bytes, but {wanted}"
        )

    def framer(self, end: End = End.NONE) -> Framer:
        """Return a new framer for one stream; ``end`` says which end of the line this is.

        Raises :class:`~stagewire.errors.BadValueError` for an end that is none.
        """
        return Framer(self.framing, end, self.decode)

    # Encoding by name

    def message_class(self, message: str, form: str | None = None) -> type[Message]:
        """Return the class of a message by its name in the registry and, if it has several, its form.

        Raises :class:`~stagewire.errors.UnknownMessageError`,
        :class:`~stagewire.errors.UnsupportedError` for a message without an id, and
        :class:`~stagewire.errors.BadLengthError` for a form that the message does not have.
        """
        forms = self._by_name.get(message)
        if forms is None:
            if message in self.nameless:
                raise UnsupportedError(f"{message} cannot be used: {self.nameless[message]}")
            raise UnknownMessageError(f"{self.title} has no message {message}{self._like(message)}")
        if form is None:
            certain = [f for f in forms if f != "data:undecided"]
            if len(certain) == 1:
                return forms[certain[0]]
            raise BadLengthError(f"{message} has several forms; give one of {', '.join(certain)}")
        if form not in forms:
            raise BadLengthError(f"{message} has no form {form} (it has {', '.join(forms)})")
        return forms[form]

    def _like(self, message: str) -> str:
        import difflib

        close = difflib.get_close_matches(message.upper()[:80], self._by_name, n=3)
        return f"; did you mean {' or '.join(close)}?" if close else ""

    def build(
        self,
        message: str,
        fields: Mapping[str, Any],
        form: str | None = None,
        data: bytes | None = None,
    ) -> Message:
        """Make a message from its name and a mapping of fields; all are checked.

        ``data`` is the whole packet of a message whose layout is undecided or undocumented. Fields
        given beside the data of an undecided one have to say the same.

        Raises what :meth:`message_class` raises, and an :class:`~stagewire.errors.EncodeError`:
        :class:`~stagewire.errors.UnknownFieldError`, :class:`~stagewire.errors.MissingFieldError`,
        :class:`~stagewire.errors.OutOfRangeError` or :class:`~stagewire.errors.BadValueError`; and
        :class:`~stagewire.errors.UnsupportedError` where there is no layout and no data.
        """
        cls = self.message_class(message, form)
        layout = cls.layout
        whole = issubclass(cls, (UndecidedMessage, UndocumentedMessage))
        allowed = set(layout.fields)
        if issubclass(cls, UndecidedMessage):
            allowed |= set(cls.shared)
        if whole and "data" in fields:
            raise UnknownFieldError(
                f"{message} ({layout.form}): data is the packet and no field; give it as data=…"
            )
        for name in fields:
            if name not in allowed:
                known = ", ".join(layout.fields) or "no fields"
                raise UnknownFieldError(f"{message} ({layout.form}) has no field {name}: {known}")
        if issubclass(cls, UndecidedMessage):
            if data is None:
                raise MissingFieldError(f"{message} ({layout.form}) is made from its data alone")
            undecided = cls(data)
            for name, value in fields.items():
                if getattr(undecided, name) != value:
                    raise BadValueError(
                        f"{message}.{name} is {getattr(undecided, name)} in data, not {value!r}"
                    )
            return undecided
        if issubclass(cls, UndocumentedMessage):
            return cls(data, **fields)
        if data is not None:
            raise BadValueError(f"{message} ({layout.form}) is made from its fields, not from data")
        missing = [f for f in layout.fields if f not in fields and f not in layout.optional]
        if missing:
            raise MissingFieldError(f"{message} ({layout.form}) lacks {', '.join(missing)}")
        made: Message = cls(**fields)
        return made

    # What the registry says

    def registry(self) -> dict[str, Any]:
        """Return the resolved registry: messages, units, stages, errata (see the JSON Schema).

        It is read once and shared: not to be modified.
        """
        return _load_json(self.package, "registry.json")

    def vectors(self) -> dict[str, Any]:
        """Return the worked examples and captures of the registry, with their verdicts.

        They are read once and shared: not to be modified.
        """
        return _load_json(self.package, "vectors.json")


def _as_bytes(raw: object) -> bytes:
    if isinstance(raw, (bytes, bytearray, memoryview)):
        return bytes(raw)
    hint = "; bytes.fromhex makes bytes of hex text" if isinstance(raw, str) else ""
    raise BadValueError(f"decode takes bytes, not {type(raw).__name__}{hint}")


def _list(lengths: frozenset[int]) -> str:
    return " or ".join(str(length) for length in sorted(lengths))


@cache
def _load_json(package: str, name: str) -> dict[str, Any]:
    import json  # both are slow to import, and most users never ask
    from importlib import resources

    text = resources.files(package).joinpath(name).read_text(encoding="utf-8")
    loaded: dict[str, Any] = json.loads(text)
    return loaded


def available_protocols() -> list[str]:
    """Return the names of all protocols that are installed, ours and others'."""
    return sorted(entry.name for entry in _entry_points())


def load_protocol(name: str) -> Protocol:
    """Return an installed protocol.

    Raises :class:`~stagewire.errors.UnknownProtocolError` when there is none of that name.
    """
    for entry in _entry_points():
        if entry.name == name:
            protocol: Protocol = entry.load()
            return protocol
    raise UnknownProtocolError(
        f"no protocol {name} is installed (there are: {', '.join(available_protocols())})"
    )


def _entry_points() -> EntryPoints:
    from importlib import metadata  # slow to import, and most users never ask

    return metadata.entry_points(group=_ENTRY_POINTS)
