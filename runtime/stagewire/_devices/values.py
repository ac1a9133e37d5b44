"""Values that a controller reported, in counts and in engineering units."""

from __future__ import annotations

from collections.abc import Iterator
from enum import Enum
from fractions import Fraction
from typing import TYPE_CHECKING, Any, ClassVar, Generic, Never, Self, TypeVar, overload

from stagewire._codec.flags import Enumeration, Flags
from stagewire._codec.message import Message
from stagewire._devices.scales import Scales
from stagewire.errors import UnknownFieldError, UnknownScaleError

__all__ = [
    "Bits",
    "BitsByUnit",
    "InUnits",
    "Named",
    "NamedByUnit",
    "Raw",
    "RawBytes",
    "RawIntegers",
    "RawText",
    "Values",
]

M = TypeVar("M", bound=Message)
E = TypeVar("E", bound=Enumeration)
F = TypeVar("F", bound=Flags)
T = TypeVar("T")


class Values(Generic[M]):
    """A message with the scales in effect when it arrived; a generated subclass defines its values.

    :param message: message, in counts.
    :param scales: scales of its channel.
    """

    __slots__ = ("message", "scales")
    message: M
    scales: Scales
    names: ClassVar[tuple[str, ...]] = ()
    """Names of the values; a value in units follows its counts."""

    def __init__(self, message: M, scales: Scales) -> None:
        object.__setattr__(self, "message", message)
        object.__setattr__(self, "scales", scales)

    def __init_subclass__(cls) -> None:
        cls.names = tuple(name for name, value in vars(cls).items() if isinstance(value, _Value))

    def exact(self, name: str) -> Fraction:
        """Return a value in units as an exact fraction.

        Raise :class:`~stagewire.errors.UnknownFieldError` for a name without a value in units, and
        :class:`~stagewire.errors.UnknownScaleError`.
        """
        value = vars(type(self)).get(name)
        if not isinstance(value, InUnits):
            known = [n for n in self.names if isinstance(vars(type(self))[n], InUnits)]
            raise UnknownFieldError(
                f"{type(self).__name__} has no value {name} in units (choose {', '.join(known) or 'none'})"
            )
        return value.exact(self)

    def told(self, without: str | None = None) -> str:
        """Return the values as text: ``position 34304, position_mm 1, status_bits homed``.

        :param without: name of a value to leave out.
        """
        return ", ".join(
            f"{name} {_told(value)}" for name, value in self.known() if name != without
        )

    def known(self) -> Iterator[tuple[str, Any]]:
        """Yield every value by name, except those that were not sent, and those whose scale is unknown."""
        fields = self.message.layout.fields
        for name in self.names:
            if vars(type(self))[name].field not in fields:
                continue  # the controller sent a shorter packet
            try:
                yield name, getattr(self, name)
            except UnknownScaleError:
                continue

    if not TYPE_CHECKING:  # otherwise type checkers would let every name be read and set

        def __getattr__(self, name: str) -> Never:
            if name in self.names:
                layout = self.message.layout
                raise AttributeError(
                    f"no {name}: the controller sent {layout.message} with {layout.length} bytes, without it"
                )
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")

        def __setattr__(self, name: str, value: object) -> None:
            raise AttributeError(
                f"cannot set {name}: {type(self).__name__} is read-only and setting it would not change the "
                "controller; use change_… or set_… of the device"
            )

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.message, self.scales)

    def __eq__(self, other: object) -> bool:
        if other.__class__ is not self.__class__:
            return NotImplemented
        return isinstance(other, Values) and bool(self.message == other.message)

    def __hash__(self) -> int:
        return hash((type(self), self.message))

    def __repr__(self) -> str:
        shown = ", ".join(f"{name}={_shown(value)}" for name, value in self.known())
        return f"{type(self).__name__}({shown})"


def _shown(value: object) -> str:
    return f"{type(value).__name__}.{value.name}" if isinstance(value, Enum) else repr(value)


def _told(value: object) -> str:
    if isinstance(value, Flags):
        return " ".join(value.names) or "0"
    if isinstance(value, Enum):
        return value.name
    return f"{value:.10g}" if isinstance(value, float) else str(value)


class _Value(Generic[T]):
    """Descriptor of one value of :class:`Values`, which reads its field of the message."""

    __slots__ = ("field",)

    def __init__(self, field: str) -> None:
        self.field = field

    @overload
    def __get__(self, values: None, owner: type) -> Self: ...

    @overload
    def __get__(self, values: Values[Any], owner: type) -> T: ...

    def __get__(self, values: Values[Any] | None, owner: type) -> Self | T:
        return self if values is None else self.read(values)

    if TYPE_CHECKING:

        def __set__(self, values: Values[Any], value: Never) -> None: ...

    def read(self, values: Values[Any]) -> T:
        """Return the value."""
        read: T = getattr(values.message, self.field)
        return read


class Raw(_Value[int]):
    """A raw number."""

    __slots__ = ()


class RawText(_Value[str]):
    """A text."""

    __slots__ = ()


class RawBytes(_Value[bytes]):
    """Bytes."""

    __slots__ = ()


class RawIntegers(_Value["tuple[int, ...]"]):
    """The integers of an array."""

    __slots__ = ()


class Named(_Value[E | int], Generic[E]):
    """A number with names: a member of an enumeration, or the number if it has no name.

    :param table: enumeration.
    """

    __slots__ = ("table",)

    def __init__(self, field: str, table: type[E]) -> None:
        super().__init__(field)
        self.table = table

    def read(self, values: Values[Any]) -> E | int:
        """Return the member, or the number."""
        return self.table.of(getattr(values.message, self.field))


class NamedByUnit(_Value[Enumeration | int]):
    """A number whose values have different names on some units.

    :param table: enumeration on all other units.
    :param units: unit -> its enumeration.
    """

    __slots__ = ("table", "units")

    def __init__(
        self, field: str, table: type[Enumeration], units: dict[str, type[Enumeration]]
    ) -> None:
        super().__init__(field)
        self.table = table
        self.units = units

    def read(self, values: Values[Any]) -> Enumeration | int:
        """Return the member of the enumeration of the unit that reported it, or the number."""
        table = self.units.get(values.scales.unit, self.table)
        return table.of(getattr(values.message, self.field))


class Bits(_Value[F], Generic[F]):
    """A number whose bits have names.

    :param table: class with the names.
    """

    __slots__ = ("table",)

    def __init__(self, field: str, table: type[F]) -> None:
        super().__init__(field)
        self.table = table

    def read(self, values: Values[Any]) -> F:
        """Return the bits."""
        return self.table(getattr(values.message, self.field))


class BitsByUnit(_Value[Flags]):
    """A number whose bits have different names on some units.

    :param table: class with the names on all other units.
    :param units: unit -> class with its names.
    """

    __slots__ = ("table", "units")

    def __init__(self, field: str, table: type[Flags], units: dict[str, type[Flags]]) -> None:
        super().__init__(field)
        self.table = table
        self.units = units

    def read(self, values: Values[Any]) -> Flags:
        """Return the bits with the names of the unit that reported them."""
        table = self.units.get(values.scales.unit, self.table)
        return table(getattr(values.message, self.field))


class InUnits(_Value[float]):
    """A number in engineering units.

    Reading it raises :class:`~stagewire.errors.UnknownScaleError` if the scale is unknown.

    :param quantity: quantity that it measures.
    :param unit: unit, such as ``mm/s``.
    """

    __slots__ = ("quantity", "unit")

    def __init__(self, field: str, quantity: str, unit: str) -> None:
        super().__init__(field)
        self.quantity = quantity
        self.unit = unit

    def read(self, values: Values[Any]) -> float:
        """Return the nearest float."""
        return float(self.exact(values))

    def exact(self, values: Values[Any]) -> Fraction:
        """Return the exact value."""
        scales = values.scales
        if instead := scales.unit_instead(self.quantity, self.unit):
            for name, value in vars(type(values)).items():
                if isinstance(value, InUnits) and (value.field, value.unit) == (
                    self.field,
                    instead,
                ):
                    why = scales.other_unit(self.quantity, self.unit)
                    raise UnknownScaleError(f"{why}; read {name}")
        scale = scales.of(self.quantity, self.unit)
        return scale.from_counts(getattr(values.message, self.field))
