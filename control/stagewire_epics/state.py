"""The published state of a motor: its records, and how a reading becomes their values and alarms."""

from __future__ import annotations

from typing import Any

from stagewire_epics.axis import OpenAxis, Reading
from stagewire_epics.coordinates import Coordinates
from stagewire_epics.fields import FIELDS, Field
from stagewire_epics.records import NO_ALARM, UNDEFINED, Alarm, Record, Severity, Status


class MotorState:
    """The records of a motor.

    :param name: name of the motor record.
    """

    def __init__(self, name: str) -> None:
        self.name = name
        self.coordinates = Coordinates()
        self.reading: Reading | None = None
        """The last reading; None before the first."""
        self.failure = NO_ALARM
        """The alarm of the last motion, until the next one begins."""
        self.arrived: int | None = None
        """The position in counts at the end of the last motion, if it succeeded."""
        self.records = {field.name: self._record(field) for field in FIELDS}
        """The record of each field."""

    def _record(self, field: Field) -> Record:
        record = Record(
            f"{self.name}.{field.name}",
            field.kind,
            field.value,
            choices=field.choices,
            description=field.description,
            stops=field.name == "STOP",
        )
        record.alarm, record.record_type = UNDEFINED, "motor"
        return record

    def __getitem__(self, name: str) -> Any:
        """Return the value of a field."""
        return self.records[name].value

    @property
    def target(self) -> float:
        """The target in dial coordinates."""
        return float(self["DVAL"])

    async def post(self, **values: Any) -> None:
        """Publish values by field, in this order."""
        for name, value in values.items():
            await self.records[name].post(value)

    async def post_changes(self, **values: Any) -> None:
        """Publish the values that differ from the present ones."""
        await self.post(**{name: value for name, value in values.items() if self[name] != value})

    async def post_target(self, dial: float) -> None:
        """Publish a target in all coordinates."""
        place = self.coordinates
        await self.post(VAL=place.user(dial), DVAL=dial, RVAL=place.counts(dial))

    async def post_coordinates(self) -> None:
        """Publish everything that depends on the offset, the direction and the limits."""
        place = self.coordinates
        low, high = place.user_limits
        self.records["VAL"].limits = (low, high) if place.limited else (0.0, 0.0)
        self.records["DVAL"].limits = (place.low, place.high)
        await self.post(
            OFF=place.offset, DIR=int(place.negative), LLM=low, HLM=high, DLLM=place.low, DHLM=place.high,
        )  # fmt: skip
        await self.post_target(self.target)
        if self.reading is not None:
            await self.show(self.reading)

    async def post_axis(self, axis: OpenAxis) -> None:
        """Publish the unit and the resolution of an axis whose controller was opened."""
        for field in FIELDS:
            if field.in_units is not None:
                record = self.records[field.name]
                record.unit, record.precision = axis.unit + field.in_units, axis.precision
        count = abs(axis.resolution)
        per_unit = round(1 / count)
        await self.post(
            EGU=axis.unit, PREC=axis.precision, MRES=axis.resolution, ERES=axis.resolution,
            SREV=per_unit, UREV=per_unit * count, RDBD=count,
        )  # fmt: skip

    async def show(self, reading: Reading) -> None:
        """Publish a reading."""
        former, self.reading = self.reading, reading
        place, alarm = self.coordinates, self._alarm(reading)
        if former is not None and reading.counts != former.counts:
            await self.post_changes(TDIR=int(reading.position > former.position))
        for name, value in (
            ("RBV", place.user(reading.position)),
            ("DRBV", reading.position),
            ("RRBV", reading.counts),
        ):
            await self.records[name].post(value, alarm)
        low, high = self._limits(reading)
        if place.negative:
            low, high = high, low
        await self.post_changes(
            DIFF=self.target - reading.position, HLS=int(high), LLS=int(low), MOVN=int(reading.moving),
            CNEN=int(reading.enabled), MSTA=self._status(reading),
        )  # fmt: skip

    async def show_silence(self, message: str) -> None:
        """Publish that the position is not known."""
        alarm = Alarm(Severity.INVALID, Status.COMM, message)
        for name in ("RBV", "DRBV", "RRBV"):
            await self.records[name].post(alarm=alarm)

    async def show_loss(self, message: str) -> None:
        """Publish that nothing is known."""
        alarm = Alarm(Severity.INVALID, Status.COMM, message)
        for record in self.records.values():
            await record.post(alarm=alarm)

    async def show_presence(self) -> None:
        """Publish that all fields are valid again."""
        for record in self.records.values():
            if record.alarm.severity is Severity.INVALID:
                await record.post(alarm=NO_ALARM)

    def _limits(self, reading: Reading) -> tuple[bool, bool]:
        """Return whether the axis is stopped by the limit switch at the lower and at the upper end.

        A target that was reached may be on a switch, as the home position of many stages.
        """
        blocked = not reading.moving and reading.counts != self.arrived
        return blocked and reading.low, blocked and reading.high

    def _alarm(self, reading: Reading) -> Alarm:
        """Return the most serious alarm of a reading and the last motion."""
        found = [self.failure]
        if reading.faults:
            found.append(Alarm(Severity.MAJOR, Status.STATE, ", ".join(reading.faults)))
        if any(self._limits(reading)):
            found.append(Alarm(Severity(self["HLSV"]), Status.HW_LIMIT, "a limit switch is active"))
        worst = max(found, key=lambda alarm: alarm.severity)
        return worst if worst.severity else NO_ALARM

    def _status(self, reading: Reading) -> int:
        """Return the bits of MSTA."""
        bits = (
            (0, self["TDIR"]), (1, not reading.moving), (2, reading.high), (9, reading.faults),
            (10, reading.moving), (13, reading.low), (14, reading.homed),
        )  # fmt: skip
        return sum(1 << number for number, on in bits if on)
