"""What every generated message stands on.

A message is its content and nothing else; a :class:`~stagewire.frame.Frame` carries it between two
addresses. Messages are immutable, slotted, hashable, picklable and equal only to their own class.

A generated class lists its fields in ``__slots__``, checks what a user sets in ``__new__`` and is filled
without any check by ``unpack`` from the wire: what was decoded is kept as it came. Attributes of a
frozen object can only be set in a roundabout and slow way, so both fill a *draft*: an object of a
twin class that has the same slots and no lock, whose class is then changed to the real one.
"""

from __future__ import annotations

from collections.abc import Mapping
from struct import Struct

from stagewire.direction import Direction
from stagewire.errors import BadValueError, OutOfRangeError, UnknownFieldError, UnsupportedError
from stagewire.header import DATA_FLAG, HEADER_SIZE, MAXIMUM_PACKET

TYPE_CHECKING = False  # typing would take half of the time of an import
if TYPE_CHECKING:
    from typing import Any, ClassVar, NoReturn, Self

__all__ = [
    "FramedMessage",
    "Layout",
    "Message",
    "UndecidedMessage",
    "UndocumentedMessage",
    "check_addresses",
    "check_bytes",
    "check_integer",
    "check_text",
]

_HEADER = Struct("<HBBBB")
_DATA_HEADER = Struct("<HHBB")


class Layout:
    """What the runtime has to know of one layout of a message, made by the generator.

    :param message: name in the registry, such as ``MOT_MOVE_ABSOLUTE``.
    :param id: the message id, or the byte of a command.
    :param direction: which way the message travels.
    :param form: ``header``, ``data`` or ``data:dc``; of a command ``request`` or ``reply``.
    :param fields: the names of the fields in wire order, reserved ones included.
    :param length: bytes of payload; 0 for a header form.
    :param optional: fields that may be left out when encoding: reserved and constant ones.
    :param unnamed: header parameters without a meaning, shown only when they are not zero.
    :param when: the context that decides for this layout, such as ``{"status": "dc"}``.
    :param constants: reserved fields that are sent as something other than zero.
    :param only_zero: a stream must not take a header with other parameters than zero for it.
    :param signed: integers with a sign of a size that :mod:`struct` has no code for, three bytes.
    :param kind: ``message``; of a protocol of commands ``command`` or ``setup``.
    :param size: of a command, the number that is sent in its size slot; None: the slot is left out.
    :param dummy: the document says that it does nothing and is not to be used.
    """

    __slots__ = (
        "constants", "direction", "dummy", "fields", "form", "id", "kind", "length", "message",
        "only_zero", "optional", "signed", "size", "unnamed", "when",
    )  # fmt: skip

    def __init__(
        self,
        message: str,
        id: int,
        direction: Direction,
        form: str,
        fields: tuple[str, ...],
        length: int = 0,
        optional: tuple[str, ...] = (),
        unnamed: tuple[str, ...] = (),
        when: Mapping[str, str] | None = None,
        constants: Mapping[str, int] | None = None,
        only_zero: bool = False,
        signed: tuple[str, ...] = (),
        kind: str = "message",
        size: int | None = None,
        dummy: bool = False,
    ) -> None:
        self.message = message
        self.id = id
        self.direction = direction
        self.form = form
        self.fields = fields
        self.length = length
        self.optional = optional
        self.unnamed = unnamed
        self.when = dict(when or {})
        self.constants = dict(constants or {})
        self.only_zero = only_zero
        self.signed = signed
        self.kind = kind
        self.size = size
        self.dummy = dummy

    def __repr__(self) -> str:
        return f"<Layout {self.message} {self.form}>"


class _Draft:
    """Finds the twin of a message class; makes it when the first message of the class is made.

    Most programs use few of the messages, and a class is the dearest part of an import.
    """

    __slots__ = ()

    def __get__(self, message: Message | None, cls: type[Message]) -> type[Any]:
        # Python allows the change of class only between classes with the same bases and slots.
        # The lock has two methods that share one C slot: unless both are object's own again,
        # setting stays slow.
        body: dict[str, Any] = {
            "__new__": object.__new__,
            "__setattr__": object.__setattr__,
            "__delattr__": object.__delattr__,
        }
        if "__slots__" in vars(cls):
            body["__slots__"] = cls.__slots__
        make: Any = type(cls)
        draft: type[Any] = make(cls.__name__, cls.__bases__, body, draft=True)
        cls._draft = draft
        return draft


class Message:
    """Base of all messages of all protocols."""

    __slots__ = ()

    if TYPE_CHECKING:
        __match_args__: ClassVar[tuple[str, ...]]
        layout: ClassVar[Layout]
        _draft: ClassVar[type[Any]]

    def __init_subclass__(cls, *, abstract: bool = False, draft: bool = False) -> None:
        if abstract or draft:
            return
        # By position a pattern takes what the constructor takes: fields that may be left out are
        # keywords in both, so that ``case MotGetDcStatusUpdate(chan, position, velocity, bits)`` is
        # not shifted by a reserved word.
        layout = cls.layout
        cls.__match_args__ = tuple(f for f in layout.fields if f not in layout.optional)  # type: ignore[misc]
        cls._draft = _Draft()  # type: ignore[assignment]

    def __setattr__(self, name: str, value: object) -> NoReturn:
        raise AttributeError(f"{type(self).__name__} is immutable; make a new one to change {name}")

    def __delattr__(self, name: str) -> NoReturn:
        raise AttributeError(f"{type(self).__name__} is immutable; {name} cannot be deleted")

    def values(self) -> dict[str, Any]:
        """Return the fields by name, in wire order, reserved ones included."""
        return {name: getattr(self, name) for name in self.layout.fields}

    def replace(self, **changes: Any) -> Self:
        """Return a copy with some fields changed; all fields are checked again.

        Raises :class:`~stagewire.errors.UnknownFieldError` for a name that is no field, and what
        making the message raises: :class:`~stagewire.errors.OutOfRangeError` and
        :class:`~stagewire.errors.BadValueError`.
        """
        fields = self.layout.fields
        for name in changes:
            if name not in fields:
                known = ", ".join(fields) or "no fields"
                raise UnknownFieldError(f"{self.layout.message} has no field {name}: {known}")
        return type(self)(**{**self.values(), **changes})

    @classmethod
    def keep(cls, values: Mapping[str, Any]) -> Self:
        """Make the message from ``values`` without a range check, as if it had been decoded."""
        draft = cls._draft()
        for name in cls.layout.fields:
            setattr(draft, name, values[name])
        draft.__class__ = cls
        kept: Self = draft
        return kept

    def __eq__(self, other: object) -> bool:
        if other.__class__ is not self.__class__:
            return NotImplemented
        return all(getattr(self, name) == getattr(other, name) for name in self.layout.fields)

    def __hash__(self) -> int:
        return hash((type(self), *(getattr(self, name) for name in self.layout.fields)))

    def __repr__(self) -> str:
        shown = self.values()
        for name in self.layout.unnamed:
            if shown[name] == self.layout.constants.get(name, 0):
                del shown[name]
        fields = ", ".join(f"{name}={value!r}" for name, value in shown.items())
        return f"{type(self).__name__}({fields})"

    def __reduce__(self) -> tuple[Any, ...]:
        return _restore, (type(self), tuple(self.values().values()))


class FramedMessage(Message, abstract=True):
    """Base of messages that a header with two addresses carries."""

    __slots__ = ()

    @classmethod
    def unpack(cls, raw: bytes) -> Self:
        """Make the message from the bytes of a whole frame, without any check."""
        raise NotImplementedError

    def pack(self, dest: int, source: int) -> bytes:
        """Return the bytes of a whole frame that carries this message.

        ``dest`` is the address without the top bit. Raises
        :class:`~stagewire.errors.OutOfRangeError` for an address that is none and
        :class:`~stagewire.errors.BadValueError` for one that is no integer.
        """
        raise NotImplementedError


class UndecidedMessage(FramedMessage, abstract=True):
    """A payload that several layouts of one message fit, and no context said which.

    The fields that all candidates share are read from ``data``; nothing else is guessed. It encodes
    back from ``data`` alone.
    """

    __slots__ = ("data",)
    data: bytes
    if TYPE_CHECKING:
        shared: ClassVar[tuple[str, ...]]

    def __new__(cls, data: bytes) -> Self:
        """Make the message from its whole payload.

        Raises :class:`~stagewire.errors.OutOfRangeError` for a payload of another length and
        :class:`~stagewire.errors.BadValueError` for what is not bytes.
        """
        return cls.keep({"data": check_bytes(cls.layout, "data", data, cls.layout.length)})

    @classmethod
    def unpack(cls, raw: bytes) -> Self:
        """Make the message from the bytes of a whole frame, without any check."""
        return cls.keep({"data": bytes(raw[HEADER_SIZE : HEADER_SIZE + cls.layout.length])})

    def pack(self, dest: int, source: int) -> bytes:
        """Return the bytes of a whole frame that carries this message.

        Raises :class:`~stagewire.errors.OutOfRangeError` for an address that is none.
        """
        check_addresses(dest, source)
        layout = self.layout
        return _DATA_HEADER.pack(layout.id, layout.length, dest | DATA_FLAG, source) + self.data


class UndocumentedMessage(FramedMessage, abstract=True):
    """A message that the document names with an id and without a layout.

    What came is kept: the packet of a data frame (``data``) or the parameter bytes of a header
    (``param1``, ``param2``, with ``data`` None). It is never made from named fields.
    """

    __slots__ = ("data", "param1", "param2")
    data: bytes | None
    param1: int
    param2: int

    def __new__(
        cls, data: bytes | None = None, *, param1: int | None = None, param2: int | None = None
    ) -> Self:
        """Make the message from the bytes that it is to carry: a packet, or two parameters.

        Raises :class:`~stagewire.errors.UnsupportedError` when neither is given: what the document
        does not describe is not made up. Raises :class:`~stagewire.errors.OutOfRangeError` for a
        packet of over 255 bytes and parameters that are no bytes,
        :class:`~stagewire.errors.BadValueError` for values of the wrong kind and for both at once.
        """
        if data is None and param1 is None and param2 is None:
            raise UnsupportedError(
                f"{cls.layout.message} has no documented layout; give the bytes of its data"
            )
        param1 = 0 if param1 is None else param1
        param2 = 0 if param2 is None else param2
        if data is not None:
            if not isinstance(data, (bytes, bytearray, memoryview)):
                raise BadValueError(f"{cls.layout.message}.data takes bytes, not {data!r}")
            if len(data) > MAXIMUM_PACKET:
                raise OutOfRangeError(
                    f"{cls.layout.message}.data takes at most {MAXIMUM_PACKET} bytes, "
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
        """Make the message from the bytes of a whole frame, without any check."""
        if raw[4] & DATA_FLAG:
            return cls.keep({"data": bytes(raw[HEADER_SIZE:]), "param1": 0, "param2": 0})
        return cls.keep({"data": None, "param1": raw[2], "param2": raw[3]})

    def pack(self, dest: int, source: int) -> bytes:
        """Return the bytes of the frame that was received.

        Raises :class:`~stagewire.errors.OutOfRangeError` for an address that is none.
        """
        check_addresses(dest, source)
        if self.data is None:
            return _HEADER.pack(self.layout.id, self.param1, self.param2, dest, source)
        header = _DATA_HEADER.pack(self.layout.id, len(self.data), dest | DATA_FLAG, source)
        return header + self.data


def _restore(cls: type[Message], values: tuple[Any, ...]) -> Message:
    return cls.keep(dict(zip(cls.layout.fields, values, strict=True)))


def check_integer(layout: Layout, field: str, value: object, minimum: int, maximum: int) -> int:
    """Return ``value`` as a plain integer; raise unless it lies from ``minimum`` to ``maximum``.

    Raises :class:`~stagewire.errors.OutOfRangeError`, or :class:`~stagewire.errors.BadValueError` for
    what is no integer (a bool is none).

    Generated constructors call this only after their own comparison has failed, so that it costs
    nothing when the value is right.
    """
    if isinstance(value, bool) or not isinstance(value, int):
        raise BadValueError(
            f"{layout.message}.{field} takes an integer from {minimum} to {maximum}, not {value!r}"
        )
    if not minimum <= value <= maximum:
        raise OutOfRangeError(
            f"{layout.message}.{field} takes {minimum} to {maximum} (raw counts), not {value}"
        )
    return int(value)


def check_addresses(dest: object, source: object) -> None:
    """Raise unless ``dest`` is 0 to 0x7F and ``source`` is 0 to 0xFF.

    The top bit of the destination byte says that a data packet follows; the encoder sets it.
    Raises :class:`~stagewire.errors.OutOfRangeError`, or :class:`~stagewire.errors.BadValueError` for
    what is no integer.
    """
    for name, value, maximum in (("dest", dest, 0x7F), ("source", source, 0xFF)):
        if isinstance(value, bool) or not isinstance(value, int):
            raise BadValueError(f"{name} takes an address from 0 to {maximum:#04x}, not {value!r}")
        if not 0 <= value <= maximum:
            raise OutOfRangeError(f"{name} takes an address from 0 to {maximum:#04x}, not {value}")


def check_bytes(layout: Layout, field: str, value: object, size: int) -> bytes:
    """Return ``value`` as bytes; raise unless it is ``size`` bytes long.

    Raises :class:`~stagewire.errors.OutOfRangeError`, or :class:`~stagewire.errors.BadValueError` for
    what is not bytes.
    """
    if not isinstance(value, (bytes, bytearray, memoryview)):
        raise BadValueError(f"{layout.message}.{field} takes {size} bytes, not {value!r}")
    if len(value) != size:
        raise OutOfRangeError(
            f"{layout.message}.{field} takes exactly {size} bytes, not {len(value)}"
        )
    return bytes(value)


def check_text(layout: Layout, field: str, value: object, size: int) -> str:
    """Return ``value``; raise unless it is latin-1 text of at most ``size`` characters.

    Raises :class:`~stagewire.errors.OutOfRangeError` for a longer text, and
    :class:`~stagewire.errors.BadValueError` for what is no such text or ends with a NUL: trailing NULs
    fill the field and would not come back.
    """
    if not isinstance(value, str):
        raise BadValueError(f"{layout.message}.{field} takes text, not {value!r}")
    try:
        encoded = value.encode("latin-1")
    except UnicodeEncodeError as error:
        raise BadValueError(
            f"{layout.message}.{field} takes latin-1 text; {value[error.start]!r} is not in it"
        ) from None
    if len(encoded) > size:
        raise OutOfRangeError(
            f"{layout.message}.{field} takes at most {size} characters, not {len(encoded)}"
        )
    if encoded.endswith(b"\0"):
        raise BadValueError(f"{layout.message}.{field}: leave trailing NULs out, they are added")
    return value
