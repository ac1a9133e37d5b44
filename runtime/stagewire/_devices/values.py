"""Values that a controller reported, in counts and in engineering units."""

from __future__ import annotations

import time
from collections.abc import Iterator
from enum import Enum
from fractions import Fraction
from typing import (
    TYPE_CHECKING,
    Any,
    ClassVar,
    Final,
    Generic,
    Never,
    Self,
    TypeAlias,
    TypeVar,
    overload,
)

from stagewire._codec.flags import Enumeration, Flags
from stagewire._codec.message import Message
from stagewire._devices.reals import number_of
from stagewire._devices.scales import Scales
from stagewire.errors import UnknownFieldError, UnknownScaleError

if TYPE_CHECKING:
    from datetime import datetime

__all__ = [
    "Arrival",
    "Bits",
    "BitsByUnit",
    "InUnits",
    "Named",
    "NamedByUnit",
    "Raw",
    "RawBytes",
    "RawIntegers",
    "RawText",
    "Real",
    "Values",
]

M = TypeVar("M", bound=Message)
E = TypeVar("E", bound=Enumeration)
F = TypeVar("F", bound=Flags)
T = TypeVar("T")

Arrival: TypeAlias = tuple[float, float]
"""When a message arrived: seconds in the time of the session, and seconds since 1970."""


class Values(Generic[M]):
    """A message with the scales in effect when it arrived; a generated subclass defines its values.

    :param message: message, in counts.
    :param scales: scales of its channel.
    :param arrival: when it arrived: the time of the session, and the time since 1970, in seconds; None: now.
    """

    __slots__ = ("_arrival", "message", "scales")
    message: M
    scales: Scales
    _arrival: Arrival
    names: ClassVar[tuple[str, ...]] = ()
    """Names of the values; a value in units follows its counts."""

    def __init__(self, message: M, scales: Scales, arrival: Arrival | None = None) -> None:
        _set_message(self, message)
        _set_scales(self, scales)
        _set_arrival(self, arrival or (time.monotonic(), time.time()))

    def __init_subclass__(cls) -> None:
        cls.names = tuple(name for name, value in vars(cls).items() if isinstance(value, _Value))

    @property
    def received(self) -> float:
        """When the values arrived, in seconds of the clock of the session (``device.session.now()``).

        It never goes backwards; of a virtual controller it is simulated. Values that ``change_…`` returns
        carry the time when they were written, and those of ``values(message)`` the time of that call.
        """
        return self._arrival[0]

    @property
    def received_at(self) -> datetime:
        """When the values arrived, in UTC, as the clock of the computer showed it then."""
        from datetime import UTC, datetime

        return datetime.fromtimestamp(self._arrival[1], UTC)

    def asdict(self) -> dict[str, Any]:
        """Return the time of arrival and the values as plain data, which :func:`json.dumps` accepts.

        The keys are ``received`` (seconds), ``received_at`` (text in ISO 8601, UTC) and the names of the
        values. A number with a known scale has the key of its value in units, such as ``position_mm``, and
        no counts. Named bits are a list of the names that are set, with ``0x…`` for bits without a name; an
        enumeration is its name, an array a list, and bytes are hex digits.
        """
        plain: dict[str, Any] = {
            "received": self.received,
            "received_at": self.received_at.isoformat(),
        }
        plain.update((name, _plain(value)) for name, value in self.in_units())
        return plain

    def in_units(self) -> Iterator[tuple[str, Any]]:
        """Yield every value by name like :meth:`known`, without counts of values that have known units."""
        known = list(self.known())
        values = vars(type(self))
        scaled = {values[name].field for name, _ in known if isinstance(values[name], InUnits)}
        for name, value in known:
            if not isinstance(values[name], Raw) or values[name].field not in scaled:
                yield name, value

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
        return type(self), (self.message, self.scales, self._arrival)

    def __eq__(self, other: object) -> bool:
        if other.__class__ is not self.__class__:
            return NotImplemented
        return isinstance(other, Values) and bool(self.message == other.message)

    def __hash__(self) -> int:
        return hash((type(self), self.message))

    def quantities(self) -> dict[str, Any]:
        """Return the values with known units as quantities of pint: ``status.quantities()["position"]``.

        The keys are the names of the values in counts. The quantities belong to the application registry of
        pint. Raise :class:`~stagewire.errors.UnsupportedError` if pint is not installed.
        """
        from stagewire._devices.renderings import quantities

        return quantities(self)

    def __repr__(self) -> str:
        from stagewire._devices.renderings import short

        return short(self)

    def _repr_html_(self) -> str:
        from stagewire._devices.renderings import html_of_values

        return html_of_values(self)


_slots: Any = Values  # whose slots can be filled while setting is locked
_set_message: Final = _slots.message.__set__
_set_scales: Final = _slots.scales.__set__
_set_arrival: Final = _slots._arrival.__set__


def _plain(value: object) -> object:
    if isinstance(value, Flags):
        return [*value.names, *([hex(value.unnamed)] if value.unnamed else [])]
    if isinstance(value, Enum):
        return value.name
    if isinstance(value, tuple):
        return list(value)
    return value.hex() if isinstance(value, bytes) else value


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


class Real(_Value[float]):
    """A real number, which the message carries as a bit pattern.

    :param size: its size in bytes.
    """

    __slots__ = ("size",)

    def __init__(self, field: str, size: int) -> None:
        super().__init__(field)
        self.size = size

    def read(self, values: Values[Any]) -> float:
        """Return the number; it can be infinite or NaN."""
        return number_of(getattr(values.message, self.field), self.size)


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


class BitsByUnit(_Value[F], Generic[F]):
    """A number whose bits have different names on some units.

    Type checkers know the names on all other units; most of them are the same.

    :param table: class with the names on all other units.
    :param units: unit -> class with its names.
    """

    __slots__ = ("table", "units")

    def __init__(self, field: str, table: type[F], units: dict[str, type[Flags]]) -> None:
        super().__init__(field)
        self.table = table
        self.units = units

    def read(self, values: Values[Any]) -> F:
        """Return the bits with the names of the unit that reported them."""
        table: Any = self.units.get(values.scales.unit, self.table)
        bits: F = table(getattr(values.message, self.field))
        return bits


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
