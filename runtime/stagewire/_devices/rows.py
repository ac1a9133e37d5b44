"""Statuses as the rows of a table: one column for each number, in engineering units, and for each bit."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any, TypeAlias

from stagewire._codec.message import Message
from stagewire._devices.scales import Scales
from stagewire._devices.unit import Unit
from stagewire._devices.values import Bits, BitsByUnit, InUnits, Raw, Real, Values
from stagewire.errors import UnknownScaleError

Row: TypeAlias = dict[str, Any]
"""Column -> value. ``None`` means that the status has no such value."""

TIME, CLOCK, PART = "time_s", "wall_clock", "part"
_MOVING, _POSITION, _COUNTS = "moving", "position", "_counts"
_CHANNEL = "chan_ident"  # the field for the channel in a status with the fields of all channels


class Rows:
    """The columns of the statuses of some parts of a controller, and a row for each status.

    :param unit: the controller.
    :param kinds: classes of its status messages -> the classes of their values.
    :param scales: part -> its scales; they decide which columns are in engineering units.
    :param channel: field for the channel, which is not a column; None: no message has one.
    :param numbers: part -> the number of its channel, counted from 1; 0 for a part that is not a channel.
    """

    def __init__(
        self,
        unit: Unit,
        kinds: Mapping[type[Message], type[Values[Any]]],
        scales: Mapping[str, Scales],
        channel: str | None,
        numbers: Mapping[str, int],
    ) -> None:
        self._unit = unit
        self._channel = channel
        self._numbers = dict(numbers)
        self._several = len(scales) > 1
        self.columns: dict[str, type] = {TIME: float, CLOCK: str}
        """The names of the columns, in order, and their types; a number in units ends in its unit."""
        if self._several:
            self.columns[PART] = str
        for message, values in kinds.items():
            for part, one in scales.items():
                for name, kind, _ in self._columns(message, values, one, part):
                    self.columns.setdefault(name, kind)

    def row(self, part: str, status: Values[Any], begin: float) -> Row:
        """Return the row of a status.

        :param part: name of the part that sent it, such as ``bay 2``.
        :param begin: when the recording began, in the time of the session.
        """
        row: Row = dict.fromkeys(self.columns)
        row[TIME] = round(status.received - begin, 6)
        row[CLOCK] = status.received_at.isoformat(timespec="milliseconds")
        if self._several:
            row[PART] = part
        for name, value in self._values(status, part):
            if name in row:
                row[name] = value
        return row

    def _columns(
        self, message: type[Message], values: type[Values[Any]], scales: Scales, part: str
    ) -> Iterator[tuple[str, type, str]]:
        """Yield the columns of a status message, each with its type and the name of its value.

        Of a status with the fields of all channels, such as ``position_1`` to ``position_4``, the row of a
        channel has only its own, without the number.
        """
        number = self._numbers[part]
        blocks = _blocks(message, self._unit.channels) if number else {}
        for name, kind, value in self._all_columns(message, values, scales):
            field = vars(values)[value].field if value else ""
            if field not in blocks:
                yield name, kind, value
            elif blocks[field][1] == number and blocks[field][0] != _CHANNEL:
                yield name.replace(field, blocks[field][0], 1), kind, value

    def _all_columns(
        self, message: type[Message], values: type[Values[Any]], scales: Scales
    ) -> Iterator[tuple[str, type, str]]:
        """Yield the columns of a status message with all of its fields."""
        described = {name: vars(values)[name] for name in values.names}
        in_units = {
            one.field: name
            for name, one in reversed(described.items())
            if isinstance(one, InUnits) and _is_known(one, scales)
        }
        scaled = {one.field for one in described.values() if isinstance(one, InUnits)}
        if self._unit.positions is not None:
            yield _POSITION, int, ""
        for name, one in described.items():
            if one.field not in message.layout.fields or one.field == self._channel:
                continue
            if isinstance(one, Bits | BitsByUnit):
                bits = _names_of(one, scales)
                if _MOVING not in bits and message in self._unit.moving:
                    yield _MOVING, bool, name
                yield from ((bit, bool, name) for bit in bits)
            elif isinstance(one, InUnits):
                if in_units.get(one.field) == name:
                    yield _with_quantity(one, name), float, name
            elif one.field not in scaled:
                kind = float if isinstance(one, Real) else int if isinstance(one, Raw) else str
                yield name, kind, name
            elif one.field not in in_units and isinstance(one, Raw):
                yield name + _COUNTS, int, name

    def _values(self, status: Values[Any], part: str) -> Iterator[tuple[str, Any]]:
        """Yield the values of a status by column."""
        message, unit = status.message, self._unit
        positions = unit.positions
        for column, kind, name in self._columns(type(message), type(status), status.scales, part):
            if not name and positions is not None:
                yield column, positions.number_in(message)
                continue
            value = getattr(status, name)
            if isinstance(vars(type(status))[name], Bits | BitsByUnit):
                if column in value.bits:
                    value = column in value.names
                else:
                    value = bool(value & unit.moving[type(message)][1])
            yield column, getattr(value, "name", str(value)) if kind is str else value


def _blocks(message: type[Message], channels: int) -> dict[str, tuple[str, int]]:
    """Return the fields that a status has once for each channel: field -> its name and its channel."""
    found: dict[str, tuple[str, int]] = {}
    for field in message.layout.fields:
        name, _, number = field.rpartition("_")
        if number.isdecimal() and 1 <= int(number) <= channels:
            found[field] = name, int(number)
    names = [
        {name for name, at in found.values() if at == number} for number in range(1, channels + 1)
    ]
    return found if channels > 1 and all(each == names[0] for each in names) else {}


def _with_quantity(described: InUnits, name: str) -> str:
    """Return the name of a value; one that is only a unit, such as ``um``, gets the name of its field."""
    return name if "_" in name else f"{described.field}_{name}"


def _is_known(described: InUnits, scales: Scales) -> bool:
    if scales.unit_instead(described.quantity, described.unit):
        return False
    try:
        scales.of(described.quantity, described.unit)
    except UnknownScaleError:
        return False
    return True


def _names_of(described: Any, scales: Scales) -> Iterable[str]:
    """Return the names of the bits of a value."""
    table = described.table
    if isinstance(described, BitsByUnit):
        table = described.units.get(scales.unit, table)
    return tuple(table(0).bits)
