"""The base of all generated messages.

A message holds only its content; a :class:`~stagewire.protocols.Frame` carries it between two addresses.
Messages are immutable, slotted, hashable and picklable, and equal only to messages of their own class.

A generated class lists its fields in ``__slots__``. ``__new__`` checks the values of a caller; ``unpack``
fills a message from received bytes without checks, so that decoded values are kept as received. Setting
attributes of a frozen object is slow, so both fill a *draft*: an object of a twin class that has the same
slots but no lock, whose class is then changed to the real one.
"""

from __future__ import annotations

import enum
from collections.abc import Callable, Mapping

from stagewire.errors import BadValueError, OutOfRangeError, UnknownFieldError


class Direction(enum.Flag):
    """The direction in which a message travels."""

    TO_CONTROLLER = 1
    TO_HOST = 2
    BOTH = 3


TYPE_CHECKING = False  # importing typing would double the import time
if TYPE_CHECKING:
    from typing import Any, ClassVar, Literal, NoReturn, Self, TypeAlias

    Describe: TypeAlias = (
        "Callable[[Layout, str], tuple[str, str]]"  # the unit and place of a field
    )

    CommandFormat: TypeAlias = Literal["low_level", "high_level", "power_on"]


class Layout:
    """One layout of a message, as the generator describes it to the runtime.

    :param message: name in the registry, such as ``MOT_MOVE_ABSOLUTE``.
    :param id: the message id, or the byte of a command.
    :param direction: which way the message travels.
    :param form: ``header``, ``data`` or ``data:dc``; for a command ``request`` or ``reply``.
    :param fields: the names of the fields in wire order, including reserved ones.
    :param length: bytes of payload; 0 for a header form.
    :param optional: fields that may be omitted when encoding: reserved and constant ones.
    :param unnamed: header parameters without a meaning, shown only when they are not zero.
    :param when: the context that selects this layout, such as ``{"status": "dc"}``.
    :param constants: reserved fields whose value when sent is not zero.
    :param only_zero: a framer accepts the header form only if its parameters are zero.
    :param signed: signed integers of a size that :mod:`struct` has no code for, three bytes.
    :param kind: ``message``; in a protocol of commands ``command`` or ``setup``.
    :param size: for a command, the number sent in its size slot; None: the slot is omitted.
    :param dummy: the document calls it a dummy that must not be used.
    :param switches_to: for a setup command, the format of what follows it: ``low_level``, commands in slots;
        ``high_level``, lines of text; ``power_on``, the format after power-on. None: unchanged.
    :param unsolicited: a controller may send it without a request.
    :param sub_message: the number that distinguishes it from other messages with the same id; None: no other
        message has this id. A data form begins with it as a word, in a header form it is ``param1``.
    :param not_sent: the reason why sessions refuse to send the message; empty: they send it.
    :param without_flag: its packet is also accepted without the data flag. It is always sent with it.
    """

    __slots__ = (
        "constants", "describe", "direction", "dummy", "fields", "form", "id", "kind", "length", "message",
        "not_sent", "only_zero", "optional", "signed", "size", "sub_message",
        "switches_to", "unnamed", "unsolicited", "when", "without_flag",
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
        sub_message: int | None = None,
        not_sent: str = "",
        without_flag: bool = False,
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
        self.sub_message = sub_message
        self.not_sent = not_sent
        self.without_flag = without_flag
        self.describe: Describe | None = None  # set by the protocol that has the message

    def __repr__(self) -> str:
        return f"<Layout {self.message} {self.form}>"

    def counts_of(self, field: str) -> str:
        """Return what the numbers of a field are, for error messages: ``raw counts of mm/s``."""
        unit = self.describe(self, field)[0] if self.describe else ""
        return f"raw counts of {unit}" if unit else "raw counts"

    def source_of(self, field: str, *, named: bool = False) -> str:
        """Return where a field is described, for the end of error messages: ``; see page 45``.

        :param named: also name the message and the field.
        """
        place = self.describe(self, field)[1] if self.describe else ""
        if not place:
            return ""
        return f"; see {self.message}.{field}, {place}" if named else f"; see {place}"


class _Draft:
    """Descriptor that returns the twin of a message class and creates it on first use.

    Most programs use few of the messages, and creating classes is the slowest part of an import.
    """

    __slots__ = ()

    def __get__(self, message: Message | None, cls: type[Message]) -> type[Any]:
        # Python allows changing the class only between classes with the same bases and slots.
        # The two methods of the lock share one C slot: unless both are object's own again,
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
        # Positional patterns match what the constructor takes by position. Optional fields are
        # keyword-only in both, so that a reserved field does not shift
        # ``case MotGetDcStatusUpdate(chan, position, velocity, bits)``.
        layout = cls.layout
        cls.__match_args__ = tuple(f for f in layout.fields if f not in layout.optional)  # type: ignore[misc]
        cls._draft = _Draft()  # type: ignore[assignment]

    def __setattr__(self, name: str, value: object) -> NoReturn:
        raise AttributeError(f"{type(self).__name__} is immutable; make a new one to change {name}")

    def __delattr__(self, name: str) -> NoReturn:
        raise AttributeError(f"{type(self).__name__} is immutable; {name} cannot be deleted")

    def values(self) -> dict[str, Any]:
        """Return the fields by name, in wire order, including reserved ones."""
        return {name: getattr(self, name) for name in self.layout.fields}

    def replace(self, **changes: Any) -> Self:
        """Return a copy with some fields changed. All fields are checked again.

        Raises :class:`~stagewire.errors.UnknownFieldError` for an unknown field, and
        :class:`~stagewire.errors.OutOfRangeError` or :class:`~stagewire.errors.BadValueError` for an invalid
        value.
        """
        fields = self.layout.fields
        for name in changes:
            if name not in fields:
                known = ", ".join(fields) or "no fields"
                raise UnknownFieldError(f"{self.layout.message} has no field {name}: {known}")
        return type(self)(**{**self.values(), **changes})

    @classmethod
    def keep(cls, values: Mapping[str, Any]) -> Self:
        """Return a message with these values, without a range check, as decoding does."""
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
    """Return ``value`` as a plain integer if it is between ``minimum`` and ``maximum``.

    Raises :class:`~stagewire.errors.OutOfRangeError` if it is outside this range, and
    :class:`~stagewire.errors.BadValueError` if it is not an integer (a bool is not accepted).

    Generated constructors call this only after their own comparison has failed, so that valid values cost
    nothing extra.
    """
    if isinstance(value, bool) or not isinstance(value, int):
        raise BadValueError(
            f"{layout.message}.{field} must be an integer from {minimum} to {maximum}, not {value!r}"
        )
    if not minimum <= value <= maximum:
        raise OutOfRangeError(
            f"{layout.message}.{field} must be {minimum} to {maximum} ({layout.counts_of(field)}), "
            f"not {value}{layout.source_of(field)}"
        )
    return int(value)


def check_bytes(layout: Layout, field: str, value: object, size: int) -> bytes:
    """Return ``value`` as bytes if it is ``size`` bytes long.

    Raises :class:`~stagewire.errors.OutOfRangeError` for another length, and
    :class:`~stagewire.errors.BadValueError` if it is not bytes.
    """
    if not isinstance(value, (bytes, bytearray, memoryview)):
        raise BadValueError(f"{layout.message}.{field} must be {size} bytes, not {value!r}")
    if len(value) != size:
        raise OutOfRangeError(
            f"{layout.message}.{field} must be exactly {size} bytes, not {len(value)}"
            f"{layout.source_of(field)}"
        )
    return bytes(value)


def check_text(layout: Layout, field: str, value: object, size: int) -> str:
    """Return ``value`` if it is Latin-1 text of at most ``size`` characters.

    Raises :class:`~stagewire.errors.OutOfRangeError` for a longer text, and
    :class:`~stagewire.errors.BadValueError` if it is not Latin-1 text or ends with a NUL: NULs fill the field
    when encoding and are stripped when decoding.
    """
    if not isinstance(value, str):
        raise BadValueError(f"{layout.message}.{field} must be text, not {value!r}")
    try:
        encoded = value.encode("latin-1")
    except UnicodeEncodeError as error:
        raise BadValueError(
            f"{layout.message}.{field} must be Latin-1 text, which has no character {value[error.start]!r}"
        ) from None
    if len(encoded) > size:
        raise OutOfRangeError(
            f"{layout.message}.{field} must have at most {size} characters, not {len(encoded)}"
            f"{layout.source_of(field)}"
        )
    if encoded.endswith(b"\0"):
        raise BadValueError(f"{layout.message}.{field}: omit trailing NULs, encoding adds them")
    return value
