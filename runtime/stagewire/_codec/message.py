"""The base of every generated message.

A message is its content and nothing else; a :class:`~stagewire.protocols.Frame` carries it between
two addresses. Messages are immutable, slotted, hashable, picklable and equal only to their own class.

A generated class lists its fields in ``__slots__``, checks what a user sets in ``__new__`` and is filled
without any check by ``unpack`` from the wire: what was decoded is kept as it came. Attributes of a
frozen object can only be set in a roundabout and slow way, so both fill a *draft*: an object of a
twin class that has the same slots and no lock, whose class is then changed to the real one.
"""

from __future__ import annotations

import enum
from collections.abc import Mapping

from stagewire.errors import BadValueError, OutOfRangeError, UnknownFieldError


class Direction(enum.Flag):
    """Which way a message travels."""

    TO_CONTROLLER = 1
    TO_HOST = 2
    BOTH = 3


TYPE_CHECKING = False  # typing would take half of the time of an import
if TYPE_CHECKING:
    from typing import Any, ClassVar, Literal, NoReturn, Self, TypeAlias

    CommandFormat: TypeAlias = Literal["low_level", "high_level", "power_on"]


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
    :param switches_to: of a setup command, the format of what comes after it: ``low_level``, commands in
        slots; ``high_level``, lines of text; ``power_on``, the one in which a controller wakes. None: the
        same as before.
    :param unsolicited: it may come without being asked for.
    """

    __slots__ = (
        "constants", "direction", "dummy", "fields", "form", "id", "kind", "length", "message",
        "only_zero", "optional", "signed", "size", "switches_to", "unnamed", "unsolicited", "when",
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
        switches_to: CommandFormat | None = None,
        unsolicited: bool = False,
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
        self.switches_to = switches_to
        self.unsolicited = unsolicited

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
