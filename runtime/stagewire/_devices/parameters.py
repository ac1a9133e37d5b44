"""The parameter sets of a part by name, for programs that offer all of them, such as control systems."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from enum import Enum
from importlib import import_module
from math import ceil, log10
from typing import Any, Final, get_type_hints

from stagewire._codec.flags import Enumeration, Flags
from stagewire._devices.reals import number_of
from stagewire._devices.scales import Scales
from stagewire._devices.structure import DeviceBase, PartBase
from stagewire._devices.tables import Given, ParameterSet, Query
from stagewire._devices.unit import Facts, Unit
from stagewire._devices.values import (
    Bits,
    BitsByUnit,
    InUnits,
    Named,
    NamedByUnit,
    Raw,
    RawBytes,
    RawText,
    Real,
    Values,
)
from stagewire.errors import BadValueError, UnknownScaleError

COUNTS: Final = "counts"
"""The unit of a number whose scale is unknown."""
_REAL_DECIMALS: Final = 6
_READS: Final = ("get_", "read_")
_CHANGES: Final = "change_"
_CHANNEL: Final = "chan_ident"
"""The field that repeats which channel was asked."""
_INSIDE: Final = ("bay_class", "channel_class", "axis_class")


class ParameterKind(Enum):
    """The kind of a parameter, which determines the type of its plain value."""

    NUMBER = "number"
    """A float if it is a real number or has a scale, or else an int."""
    CHOICE = "choice"
    """The name of a value of an enumeration, joined with those of its modifiers by ``|``; the number as text
    if it has no name."""
    BITS = "bits"
    """The names of the bits that are set, a tuple."""
    TEXT = "text"
    """A text."""
    BYTES = "bytes"
    """Bytes as hex digits."""


@dataclass(frozen=True, slots=True, eq=False)
class Parameter:
    """One parameter of a set.

    :param name: its name in the values that the controller reports, such as ``max_velocity``.
    :param kind: its kind.
    :param scaled: name of each value in a unit, and the value; empty for a number without a scale.
    :param table: names of its values or bits; None if they have no names.
    :param given: argument that changes it; None if it cannot be changed.
    :param real: size of a real number in bytes; 0 for any other value.
    """

    name: str
    kind: ParameterKind
    scaled: Mapping[str, InUnits]
    table: type[Enumeration] | type[Flags] | None
    given: Given | None
    real: int = 0

    @property
    def changeable(self) -> bool:
        """Whether ``change_…`` accepts it."""
        return self.given is not None

    @property
    def names(self) -> tuple[str, ...]:
        """The names of its values or bits; empty if they have none."""
        return () if self.table is None else _names(self.table)

    def mask(self, bit: str) -> int:
        """Return the mask of a bit by its name."""
        assert self.table is not None  # the kind is BITS
        assert issubclass(self.table, Flags)
        return self.table.bits[bit]

    @property
    def closed(self) -> bool:
        """Whether a value of an enumeration is always one of :attr:`names`.

        It is not if the list may be incomplete, or if values can be combined with modifiers.
        """
        return self.given is not None and not self.given.open and not self.given.modifiers

    def now(self, scales: Scales) -> tuple[str, str]:
        """Return the name of the value with its present unit, and the unit.

        Without a known scale these are the name of the parameter and :data:`COUNTS`.
        """
        for name, value in self.scaled.items():
            try:
                scales.of(value.quantity, value.unit)
            except UnknownScaleError:
                continue
            return name, value.unit
        return self.name, COUNTS

    def precision(self, scales: Scales) -> int:
        """Return the number of decimals that shows single counts; of a real number, six."""
        name, unit = self.now(scales)
        if self.real:
            return _REAL_DECIMALS
        if unit == COUNTS:
            return 0
        counts = float(scales.of(self.scaled[name].quantity, unit).counts_per_unit)
        return max(0, ceil(log10(counts)))

    def limits(self, scales: Scales) -> tuple[float, float] | None:
        """Return the lowest and highest number that ``change_…`` accepts, in the present unit.

        None if it cannot be changed or is not a number. The limits of the stage may be narrower.
        """
        if self.given is None or self.kind is not ParameterKind.NUMBER:
            return None
        given = self.given.on(scales.controllers)
        if given.minimum is None or given.maximum is None:
            return None
        now = scales.range_of(given.quantity, given.minimum, given.maximum)
        ends = now.minimum, now.maximum
        if self.real:
            signed = given.maximum >> (8 * self.real - 1)
            return (
                None if signed else (number_of(ends[0], self.real), number_of(ends[1], self.real))
            )
        name, unit = self.now(scales)
        if unit == COUNTS:
            return ends
        scale = scales.of(self.scaled[name].quantity, unit)
        low, high = (float(scale.from_counts(end)) for end in ends)
        return low, high

    def plain(self, values: Values[Any]) -> Any:
        """Return the parameter as a plain value, as :class:`ParameterKind` describes it."""
        value = getattr(values, self.now(values.scales)[0])
        if self.kind is ParameterKind.CHOICE:
            return getattr(value, "name", None) or self._joined(value)
        if self.kind is ParameterKind.BITS:
            return value.names
        if self.kind is ParameterKind.BYTES:
            return bytes(value).hex()
        if self.kind is ParameterKind.TEXT:
            return str(value)
        return float(value) if self.scaled or self.real else int(value)

    def _joined(self, number: int) -> str:
        """Return a value with modifiers as names joined by ``|``, or the number as text."""
        assert self.table is not None  # the kind is CHOICE
        assert issubclass(self.table, Enumeration)
        names = {int(member): name for name, member in self.table.__members__.items()}
        modifiers = self.given.modifiers if self.given else 0
        used = [bit for bit in names if bit & modifiers & number]
        alone = number & ~modifiers
        if alone not in names or not used or sum(used) != number & modifiers:
            return str(number)
        return "|".join(names[part] for part in (alone, *used))

    def keyword(self, value: Any, scales: Scales) -> dict[str, Any]:
        """Return a plain value as the keyword of the call that changes it.

        A number is in the present unit. The text of a choice is a name, several joined by ``|``, or a number.
        """
        name, unit = self.now(scales)
        if self.kind is ParameterKind.BITS:
            value = "|".join(value) or 0
        elif self.kind is ParameterKind.CHOICE:
            value = int(value) if value.strip().isdecimal() else value
        elif self.scaled and unit == COUNTS:
            value = round(value)
        return {name: value}


@dataclass(frozen=True, slots=True, eq=False)
class SetOfParameters:
    """A set of parameters that one request reads.

    :param name: its name, such as ``vel_params``.
    :param read: name of the method that reads it, such as ``get_vel_params``.
    :param change: name of the method that changes parameters of it; None: it is read-only.
    :param values: class of the values that are read.
    :param arguments: keyword of each argument that both methods require, such as the connector of
        ``get_io_config``, and the names of its values.
    :param parameters: its parameters by name, without the arguments.
    """

    name: str
    read: str
    change: str | None
    values: type[Values[Any]]
    arguments: Mapping[str, tuple[str, ...]]
    parameters: Mapping[str, Parameter]

    def __repr__(self) -> str:
        return f"<SetOfParameters {self.name}: {', '.join(self.parameters)}>"


def parameter_sets(kind: type[Any]) -> dict[str, SetOfParameters]:
    """Return the sets of parameters of a class of a device, bay, channel or axis, by name.

    They are those with a method ``get_…`` or ``read_…``. Nothing is sent, and no device is required:
    ``parameter_sets(TDC001)["vel_params"]``.

    Raise :class:`~stagewire.errors.BadValueError` for any other class.
    """
    facts, unit = _facts_of(kind)
    found = {}
    for method in dir(kind):
        prefix = next((one for one in _READS if method.startswith(one)), None)
        if prefix is not None:
            one = _set_of(kind, facts, unit, method, method.removeprefix(prefix))
            found[one.name] = one
    return found


def status_set(kind: type[Any]) -> SetOfParameters | None:
    """Return the set with the status bits of a part; None if it reports none.

    It is the one in which a motor also reports its position.
    """
    _, unit = _facts_of(kind)
    reporting = {
        name: one
        for name, one in parameter_sets(kind).items()
        if one.change is None
        and any(parameter.kind is ParameterKind.BITS for parameter in one.parameters.values())
    }
    for one in reporting.values():
        if unit.status_query is not None and unit.status_query.values is one.values:
            return one
    return next(iter(reporting.values()), None)


def _facts_of(kind: type[Any]) -> tuple[Facts, Unit]:
    """Return the facts and the unit of a class of a part."""
    if not isinstance(kind, type) or not issubclass(kind, PartBase):
        raise BadValueError(
            f"{kind!r} is not a class of a device, bay, channel or axis, such as TDC001 or BBD102.bay_class"
        )
    for base in kind.__mro__:
        for device in (base, *vars(sys.modules[base.__module__]).values()):
            if _is_unit(device) and base in _inside(device):
                return device.facts, device.unit
    raise BadValueError(f"{kind.__name__} belongs to no controller; use a class such as TDC001")


def _is_unit(device: object) -> bool:
    return isinstance(device, type) and issubclass(device, DeviceBase) and hasattr(device, "unit")


def _inside(kind: type[Any]) -> Iterator[type[Any]]:
    """Yield a class and the classes of the parts inside it."""
    yield kind
    for attribute in _INSIDE:
        if (inside := getattr(kind, attribute, None)) is not None:
            yield from _inside(inside)


def _set_of(kind: type[Any], facts: Facts, unit: Unit, method: str, name: str) -> SetOfParameters:
    values: type[Values[Any]] = get_type_hints(getattr(kind, method))["return"]
    table = _table_of(facts, values, name, method)
    can_change = hasattr(kind, _CHANGES + name)
    every = getattr(table, "given", ()) if can_change else ()
    given = {one.field: one.on((unit.name,)) if one.names else one for one in every}
    left_out = {one.field for one in table.asked}
    if isinstance(table, Query):  # of several forms, the first one is the usual one
        left_out |= {vars(values)[each].field for each in values.names} - set(
            table.gets[0].layout.fields
        )
    return SetOfParameters(
        name,
        method,
        _CHANGES + name if can_change else None,
        values,
        {one.keyword: _choices(one, facts, unit, table) for one in table.asked},
        {
            one.name: one
            for one in _parameters(values, unit, given)
            if vars(values)[one.name].field not in left_out
        },
    )


def _table_of(
    facts: Facts, values: type[Values[Any]], name: str, method: str
) -> ParameterSet[Any] | Query[Any]:
    """Return the table of a method. Units of different kinds may have sets of the same name."""
    [table] = [
        table
        for table in vars(import_module(f"{facts.package}.devices.tables")).values()
        if isinstance(table, ParameterSet | Query)
        and table.values is values
        and table.name in (name, method)
    ]
    return table


def _choices(
    argument: Given, facts: Facts, unit: Unit, table: ParameterSet[Any] | Query[Any]
) -> tuple[str, ...]:
    """Return the names of the values of an argument; of the bays, only those that the unit has."""
    assert argument.choices is not None  # arguments of requests have named values
    names = _names(argument.choices)
    return names[: max(1, len(unit.bays))] if table is facts.bay_used else names


def _names(table: type[Enumeration] | type[Flags]) -> tuple[str, ...]:
    return tuple(table.bits if issubclass(table, Flags) else table.__members__)


def _parameters(
    values: type[Values[Any]], unit: Unit, given: Mapping[str, Given]
) -> Iterator[Parameter]:
    every = {name: vars(values)[name] for name in values.names}
    for name, value in every.items():
        if isinstance(value, InUnits) or name == _CHANNEL:
            continue
        scaled = {
            other: one
            for other, one in every.items()
            if isinstance(one, InUnits) and one.field == value.field
        }
        table = getattr(value, "table", None)
        if isinstance(value, BitsByUnit | NamedByUnit):
            table = value.units.get(unit.name, table)
        kind = _KINDS.get(type(value))
        if kind is not None:
            real = value.size if isinstance(value, Real) else 0
            yield Parameter(name, kind, scaled, table, given.get(value.field), real)


_KINDS: Final[dict[type[Any], ParameterKind]] = {
    Raw: ParameterKind.NUMBER,
    Real: ParameterKind.NUMBER,
    Named: ParameterKind.CHOICE,
    NamedByUnit: ParameterKind.CHOICE,
    Bits: ParameterKind.BITS,
    BitsByUnit: ParameterKind.BITS,
    RawText: ParameterKind.TEXT,
    RawBytes: ParameterKind.BYTES,
}
