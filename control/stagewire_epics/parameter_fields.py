"""One parameter of a controller as one record, or as one for each bit.

====================================  ===========================================================
parameter                             record
====================================  ===========================================================
number with a scale                   float in the unit of the stage; in counts without a scale
other number                          integer; float if it can exceed 32 bits
enumeration                           choice
enumeration with other values         text: a name, names joined by ``|``, or a number
bits                                  for each bit a choice of No and Yes
text                                  text
bytes                                 text of hex digits, read-only
====================================  ===========================================================

An enumeration has other values if it is read-only, incomplete or has modifiers. One with more than
:data:`MOST_CHOICES` names, or with names of more than :data:`LONGEST_CHOICE` characters, is also a text.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from functools import partial
from typing import Any, Final, TypeAlias

from stagewire.devices import Parameter, ParameterKind, Values
from stagewire_epics.records import NO_ALARM, Alarm, Kind, PutRefusedError, Record, Severity, Status

MOST_CHOICES: Final = 16
"""The number of texts of a choice that Channel Access transfers."""
LONGEST_CHOICE: Final = 25
"""The number of characters of each."""
NO_YES: Final = ("No", "Yes")
_INTEGERS: Final = range(-(2**31), 2**31)
"""The integers that Channel Access transfers."""

Change: TypeAlias = Callable[[Parameter, Any], Awaitable[None]]
"""Changes a parameter to a plain value."""
ChangeBit: TypeAlias = Callable[[Parameter, str, bool], Awaitable[None]]
"""Sets or clears one bit of a parameter."""


def kind_of(one: Parameter) -> Kind:
    """Return the kind of the record of a parameter."""
    if one.kind is ParameterKind.NUMBER:
        if one.real:
            return Kind.FLOAT
        ends = (one.given.minimum, one.given.maximum) if one.given else ()
        fits = all(end is None or end in _INTEGERS for end in ends)
        return Kind.INTEGER if fits and not one.scaled else Kind.FLOAT
    few = len(one.names) <= MOST_CHOICES and all(len(n) <= LONGEST_CHOICE for n in one.names)
    return Kind.CHOICE if one.kind is ParameterKind.CHOICE and one.closed and few else Kind.TEXT


class ValueRecord:
    """A parameter as one record.

    :param name: name of the record.
    :param parameter: the parameter.
    :param description: its meaning.
    :param change: changes it; None: the record is read-only.
    """

    def __init__(
        self, name: str, parameter: Parameter, description: str, change: Change | None
    ) -> None:
        self.parameter = parameter
        self._kind = kind_of(parameter)
        self._record = Record(
            name,
            self._kind,
            put=partial(self._put, change) if change else None,
            choices=parameter.names if self._kind is Kind.CHOICE else (),
            description=description,
        )
        self.records = (self._record,)

    async def _put(self, change: Change, value: Any) -> None:
        one = self.parameter
        if self._kind is Kind.CHOICE:
            value = one.names[value]
        elif one.kind is ParameterKind.NUMBER and not (one.scaled or one.real):
            if value != int(value):
                raise PutRefusedError(f"{self._record.name}: {value!r} is not a whole number")
            value = int(value)
        await change(one, value)

    async def post(self, values: Values[Any], *, always: bool) -> None:
        """Publish the value, and its unit, which may depend on a setting.

        :param always: whether a client waits for it, so that it is published even without a change.
        """
        one, record = self.parameter, self._record
        before = record.unit, record.precision, record.limits
        if one.scaled:
            record.unit = one.now(values.scales)[1]
            record.precision = one.precision(values.scales)
        record.limits = one.limits(values.scales) or (0.0, 0.0)
        always = always or before != (record.unit, record.precision, record.limits)
        value, alarm = one.plain(values), NO_ALARM
        if self._kind is Kind.CHOICE:
            if value in one.names:
                value = one.names.index(value)
            else:
                text = f"the controller reports {value}, which has no name"
                value, alarm = record.value, Alarm(Severity.INVALID, Status.STATE, text)
        await publish(record, value, alarm, always=always)


class BitRecords:
    """A parameter with bits, each a record.

    :param name: name of the set, with which the names of the records begin.
    :param parameter: the parameter.
    :param description: its meaning.
    :param change: changes a bit; None: the records are read-only.
    """

    def __init__(
        self, name: str, parameter: Parameter, description: str, change: ChangeBit | None
    ) -> None:
        self.parameter = parameter
        self._bits = {
            bit: Record(
                f"{name}:{bit.upper()}",
                Kind.CHOICE,
                put=partial(self._put, change, bit) if change else None,
                choices=NO_YES,
                description=f"{bit.replace('_', ' ')}, bit of {description}",
            )
            for bit in parameter.names
        }
        self.records = tuple(self._bits.values())

    async def _put(self, change: ChangeBit, bit: str, value: int) -> None:
        await change(self.parameter, bit, bool(value))

    async def post(self, values: Values[Any], *, always: bool) -> None:
        """Publish the bits, as :meth:`ValueRecord.post` does."""
        names = self.parameter.plain(values)
        for bit, record in self._bits.items():
            await publish(record, int(bit in names), NO_ALARM, always=always)


async def publish(record: Record, value: Any, alarm: Alarm, *, always: bool = False) -> None:
    """Publish a value and an alarm, if one of them changed or ``always``."""
    if always or record.value != value or record.alarm != alarm:
        await record.post(value, alarm)
