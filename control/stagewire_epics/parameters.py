"""Parameter sets and status bits of a part of a controller as records.

The names of the records of the part ``LAB:x`` follow from the registry. They are in upper case:

===================================  ================================================================
``LAB:x:VEL_PARAMS:MAX_VELOCITY``    a parameter of a set: set, parameter
``LAB:x:TRIGGER:TRIGIN_ENABLE``      a bit of a parameter: set, bit
``LAB:x:IO_CONFIG:BNC1:MODE``        a parameter of a set whose request requires a choice
``LAB:x:STATUS:HOMED``               a bit of the status
``LAB:x:STATUS:STATUS_BITS_2:HOMED`` the same, if the status has such a bit for several channels
``LAB:x:STATUS:VELOCITY``            another value of the status
``LAB:x:REFRESH``                    1 reads all sets now
===================================  ================================================================

:mod:`stagewire_epics.parameter_fields` lists the kinds of the records. The field ``chan_ident`` of a reply,
which only repeats the channel of the request, has no record.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable, Iterator, Sequence
from itertools import cycle, product
from typing import Any, Final, Literal, TypeAlias

from stagewire.devices import (
    Parameter,
    ParameterKind,
    SetOfParameters,
    Values,
    parameter_sets,
    status_set,
)
from stagewire.errors import BadValueError, SessionClosedError, StagewireError, TransportLostError
from stagewire_epics.parameter_fields import BitRecords, ValueRecord, publish
from stagewire_epics.records import Alarm, Kind, PutRefusedError, Record, Severity, Status

_log = logging.getLogger("stagewire")

POLL: Final = 1.0
"""Seconds between two requests for sets of a part; with 20 sets, each is read every 20 seconds."""
LONGEST: Final = 60
"""Characters that the name of a record may have."""

_SHORTER: Final = "this controller has the set in a shorter packet, without this parameter"

Sets: TypeAlias = Sequence[str] | Literal["all"]
"""Names of parameter sets, or all of them."""
Ready: TypeAlias = Callable[[str], Awaitable[object]]
"""Returns when something may be changed, or raises :class:`PutRefusedError`."""


class _SetRecords:
    """The records of one set.

    :param one: the set.
    :param name: name of the part and the set.
    :param arguments: arguments of its request.
    :param ready: called before each change.
    """

    def __init__(
        self, one: SetOfParameters, name: str, arguments: dict[str, str], ready: Ready | None = None
    ) -> None:
        self._set = one
        self._name = name
        self._arguments = arguments
        self._ready = ready
        self._lock = asyncio.Lock()
        self._fields = [self._field(field) for field in one.parameters.values()]
        self.records = tuple(record for field in self._fields for record in field.records)
        self.part: Any = None
        """The open part; None: it is lost or not there yet."""

    def _field(self, one: Parameter) -> ValueRecord | BitRecords:
        text = f"{one.name} of {self._set.name}".replace("_", " ")
        name = f"{self._name}:{one.name.upper()}"
        if one.kind is ParameterKind.BITS:
            # A status of several channels has the same bits for each of them.
            place = name if self._has_again(one) else self._name
            return BitRecords(place, one, text, self._change_bit if one.changeable else None)
        return ValueRecord(name, one, text, self._change if one.changeable else None)

    def _has_again(self, one: Parameter) -> bool:
        """Return whether another parameter of the set has a bit of the same name."""
        others = (other for other in self._set.parameters.values() if other.name != one.name)
        return any(
            {*one.names} & {*other.names} for other in others if other.kind is ParameterKind.BITS
        )

    async def read(self) -> None:
        """Request the set and publish it. An error of this request is published instead.

        Raise :class:`~stagewire.errors.TransportLostError` and
        :class:`~stagewire.errors.SessionClosedError`.
        """
        async with self._lock:
            if self.part is None:
                return
            try:
                await self._read(self.part, always=False)
            except (TransportLostError, SessionClosedError):
                raise
            except StagewireError as error:
                await self.invalid(str(error))

    async def _read(self, part: Any, *, always: bool) -> Values[Any]:
        values: Values[Any] = await getattr(part, self._set.read)(**self._arguments)
        if self.part is part:  # otherwise the line was lost meanwhile
            await self.post(values, always=always)
        return values

    async def post(self, values: Values[Any], *, always: bool = False) -> None:
        """Publish what the controller reported."""
        sent = values.message.layout.fields
        for field in self._fields:
            name = field.parameter.name
            if name not in values.names:  # another status, which has only the bits
                continue
            if vars(type(values))[name].field in sent:
                await field.post(values, always=always)
            else:
                await _invalid(field.records, Status.UDF, _SHORTER)

    async def invalid(self, message: str) -> None:
        """Mark all records as invalid, because the controller does not answer."""
        await _invalid(self.records, Status.COMM, message)

    async def _change(self, one: Parameter, value: Any) -> None:
        async with self._lock:
            part = await self._connected()
            await self._written(part, one.keyword(value, part.scales))

    async def _change_bit(self, one: Parameter, bit: str, on: bool) -> None:
        """Read the set first, so that the other bits stay as they are."""
        async with self._lock:
            part = await self._connected()
            bits = getattr(await self._read(part, always=False), one.name)
            mask = one.mask(bit)
            await self._written(part, {one.name: int(bits | mask if on else bits & ~mask)})

    async def _written(self, part: Any, given: dict[str, Any]) -> None:
        """Change one parameter by one ``change_…``, and publish what the controller has then."""
        assert self._set.change is not None  # otherwise the records are read-only
        await getattr(part, self._set.change)(**self._arguments, **given)
        await self._read(part, always=True)

    async def _connected(self) -> Any:
        if self.part is None:
            raise PutRefusedError(
                f"{self._name}: the controller is not connected; nothing was sent"
            )
        if self._ready is not None:
            await self._ready(self._name)
        return self.part


class ParameterRecords:
    """The parameter sets of a part as records.

    The records exist before the controller is connected, and are invalid until it is. A set is read after
    :meth:`bind`, after each put into it, on request (:meth:`refresh`, or a put into ``LAB:x:REFRESH``), and
    slowly: one set of the part in each :data:`POLL` seconds. Nothing else is sent.

    A put is one ``change_…``, and ends when the set was read again. Before a bit is changed, the set is also
    read. A set without ``change_…`` is read-only.

    :param kind: class of the part, such as ``TDC001`` or ``BBD102.bay_class`` of :mod:`stagewire_apt.aio`.
    :param name: name of the part, with which the names of all records begin, such as ``LAB:x``.
    :param sets: names of the sets, such as ``vel_params``; ``all``: every set except the status, whose
        records are :class:`StatusRecords`.
    :param ready: called with the name of a set before each change of it; raises an error to refuse it.

    Raise :class:`~stagewire.errors.BadValueError` for an unknown set, and for a name of a record that is too
    long.
    """

    def __init__(
        self, kind: type[Any], name: str, sets: Sets = "all", ready: Ready | None = None
    ) -> None:
        self._name = name
        self._sets = [one for chosen in _chosen(kind, sets) for one in _each(chosen, name, ready)]
        self._refresh = Record(
            f"{name}:REFRESH",
            Kind.INTEGER,
            0,
            put=self._put_refresh,
            description="1 reads all parameters now",
        )
        read = tuple(record for one in self._sets for record in one.records)
        self.records = (*read, self._refresh) if read else ()
        """All records; none without a set."""
        self._poller: asyncio.Task[None] | None = None
        _check_names(self.records)

    def bind(self, part: Any) -> None:
        """Use an open part of the class ``kind``: read all sets, then read them slowly.

        Call it again after each reconnect.
        """
        self._unbind()
        for one in self._sets:
            one.part = part
        self._poller = asyncio.create_task(self._poll())

    async def refresh(self) -> None:
        """Read all sets now. A set that cannot be read gets an alarm; no error is raised for it.

        Raise :class:`~stagewire.errors.TransportLostError` and
        :class:`~stagewire.errors.SessionClosedError`.
        """
        for one in self._sets:
            await one.read()

    async def lost(self, message: str) -> None:
        """Mark all records as invalid and send nothing more: the controller is lost or not there yet."""
        self._unbind()
        await self._invalid(message)

    def _unbind(self) -> None:
        if self._poller is not None:
            self._poller.cancel()
            self._poller = None
        for one in self._sets:
            one.part = None

    async def _invalid(self, message: str) -> None:
        for one in self._sets:
            await one.invalid(message)

    async def _put_refresh(self, value: int) -> None:
        if self._poller is None:
            raise PutRefusedError(
                f"{self._name}: the controller is not connected; nothing was sent"
            )
        if value:
            await self.refresh()
        await self._refresh.post(0)

    async def _poll(self) -> None:
        try:
            await self.refresh()
            for one in cycle(self._sets):
                await asyncio.sleep(POLL)
                await one.read()
        except StagewireError as error:
            await self._invalid(str(error))
        except Exception as error:
            _log.exception("%s: parameters are no longer updated", self._name)
            await self._invalid(f"not updated because of a defect: {error}")


class StatusRecords:
    """The status of a part as read-only records, one for each bit and each other value.

    They request nothing: the reader of the status passes it to :meth:`post`. For a part without such a
    reader, there is :meth:`request`.

    :param kind: class of the part.
    :param name: name of the part.

    Raise :class:`~stagewire.errors.BadValueError` for a part that reports no status bits.
    """

    def __init__(self, kind: type[Any], name: str) -> None:
        status = status_set(kind)
        if status is None:
            raise BadValueError(
                f"{name}: {kind.__name__} reports no status bits; leave out its status. Its parameter sets "
                f"are {', '.join(parameter_sets(kind))}"
            )
        self._read = status.read
        self._set = _SetRecords(status, f"{name}:STATUS", {})
        self.records = self._set.records
        _check_names(self.records)

    async def post(self, values: Values[Any]) -> None:
        """Publish a status that the controller reported. Records that did not change are not published."""
        await self._set.post(values)

    async def request(self, part: Any) -> None:
        """Request the status from an open part and publish it. Raise the errors of requests."""
        await self.post(await getattr(part, self._read)())

    async def lost(self, message: str) -> None:
        """Mark all records as invalid: the controller is lost, silent or not there yet."""
        await self._set.invalid(message)


def _chosen(kind: type[Any], sets: Sets) -> Iterator[SetOfParameters]:
    """Yield the sets that were asked for, each once."""
    known = parameter_sets(kind)
    if sets == "all":
        status = status_set(kind)
        yield from (one for one in known.values() if status is None or one.name != status.name)
        return
    for name in dict.fromkeys(sets):
        if name not in known:
            raise BadValueError(
                f"{kind.__name__} has no parameter set {name!r} (choose all, or {', '.join(known)})"
            )
        yield known[name]


def _each(one: SetOfParameters, name: str, ready: Ready | None) -> Iterator[_SetRecords]:
    """Yield the records of a set, for each combination of the arguments of its request."""
    for choices in product(*one.arguments.values()):
        words = ":".join((one.name, *choices)).upper()
        arguments = dict(zip(one.arguments, choices, strict=True))
        yield _SetRecords(one, f"{name}:{words}", arguments, ready)


async def _invalid(records: Sequence[Record], status: Status, message: str) -> None:
    for record in records:
        await publish(record, record.value, Alarm(Severity.INVALID, status, message))


def _check_names(records: Sequence[Record]) -> None:
    longest = max((record.name for record in records), key=len, default="")
    if len(longest) > LONGEST:
        raise BadValueError(
            f"{longest} has {len(longest)} characters, and the name of a record may have {LONGEST}: choose a "
            "shorter prefix or name of the part, or only the parameter sets that you need"
        )
