"""A part of a controller as an IOC publishes it: a motor, parameter sets and status bits."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterator
from typing import Any, Final

from stagewire.errors import BadValueError, SessionClosedError, StagewireError, TransportError
from stagewire_epics.axis import OpenAxis
from stagewire_epics.bench import BenchError, ControllerTable, MotorTable, PartTable
from stagewire_epics.motor import Motor
from stagewire_epics.parameters import ParameterRecords, StatusRecords
from stagewire_epics.records import Record
from stagewire_epics.velocity import MotorSettings

_STATUS: Final = 1.0
"""Seconds between two requests for the status of a part without a motor."""


class Part:
    """The records of a part.

    :param name: name of the part, such as ``LAB:x``.
    :param kind: class of the part.
    :param controller: table of its controller.
    :param table: its own table.
    :param lost: called when the line is lost.

    Raise :class:`BenchError` for a part that has the table of a motor and is not one, for parameter sets or a
    status that it lacks, and for a part without records.
    """

    def __init__(
        self,
        name: str,
        kind: type[Any],
        controller: ControllerTable,
        table: PartTable,
        lost: Callable[[StagewireError], None],
    ) -> None:
        self.name = name
        self.steps = table.steps
        self._lost = lost
        self._part: Any = None
        self.motor = None
        """The motor; None for another part."""
        if isinstance(table, MotorTable):
            self.motor = _motor(name, kind, controller, table, lost)
        try:
            self._parameters = (
                ParameterRecords(
                    kind, name, table.parameters, None if self.motor is None else self.motor.at_rest
                )
                if table.parameters
                else None
            )
            self._status = StatusRecords(kind, name) if table.status else None
        except BadValueError as error:
            raise BenchError(str(error)) from None
        if self.motor is not None:
            self.motor.status = self._status
        elif self._parameters is None and self._status is None:
            raise BenchError(
                f"{name}: nothing of it is published; state parameters or status = true"
            )

    def records(self) -> Iterator[tuple[str, Record]]:
        """Yield each record with its name; the name of a motor is also that of its VAL."""
        if self.motor is not None:
            yield self.name, self.motor.records["VAL"]
            yield from ((record.name, record) for record in self.motor.records.values())
        for records in (self._parameters, self._status):
            if records is not None:
                yield from ((record.name, record) for record in records.records)

    async def attach(self, part: Any) -> None:
        """Read the state of a part whose controller was opened. Nothing moves.

        Raise the errors of requests.
        """
        self._part = part
        if self.motor is not None:
            await self.motor.attach(OpenAxis(part))
        if self._parameters is not None:
            self._parameters.bind(part)

    async def detach(self, error: StagewireError) -> None:
        """Fail the motion under way, and mark all records as invalid, because the controller is lost."""
        self._part = None
        if self.motor is not None:
            await self.motor.detach(error)
        for records in (self._parameters, self._status):
            if records is not None:
                await records.lost(str(error))

    async def watch(self) -> None:
        """Read the state until the line is lost."""
        if self.motor is not None:
            await self.motor.watch()
            return
        while self._status is not None and self._part is not None:
            try:
                await self._status.request(self._part)
            except (TransportError, SessionClosedError) as error:
                self._lost(error)
                return
            except StagewireError as error:
                await self._status.lost(str(error))
            await asyncio.sleep(_STATUS)

    async def close(self) -> None:
        """Stop the motion that a client asked for, and fail its put; send nothing more."""
        if self.motor is not None:
            await self.motor.close()
        if self._parameters is not None:
            await self._parameters.lost("the IOC has ended")


def _motor(
    name: str,
    kind: type[Any],
    controller: ControllerTable,
    table: MotorTable,
    lost: Callable[[StagewireError], None],
) -> Motor:
    if not hasattr(kind, "get_vel_params") and not hasattr(kind, "read_ramp_time"):
        inside = next(
            (step for step in ("bay", "channel", "axis") if hasattr(kind, f"{step}_class")), None
        )
        hint = f"choose one of its parts by {inside} =" if inside else "use a table [parts] for it"
        raise BenchError(f"{name}: a {kind.__name__} is not a motor; {hint}")
    settings = MotorSettings(
        table.description,
        table.velocity,
        table.acceleration_time,
        None if table.limits is None else (table.limits[0], table.limits[1]),
        table.highest_velocity,
    )
    out = " ".join((controller.url, *(f"{key} {value}" for key, value in table.steps)))
    return Motor(name, out, settings, lost)
