"""Records: named values with an alarm, which servers publish and clients put.

A record knows no network. A server, such as Channel Access, listens to it and puts values into it.
"""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from enum import Enum, IntEnum
from typing import Any, Final

from stagewire.errors import StagewireError

_log = logging.getLogger("stagewire")


class PutRefusedError(StagewireError):
    """A value was put into a record that cannot accept it; nothing was sent to the controller."""


class Severity(IntEnum):
    """How serious an alarm is, with the numbers of EPICS."""

    NO_ALARM = 0
    MINOR = 1
    MAJOR = 2
    INVALID = 3


class Status(IntEnum):
    """The reason for an alarm, with the numbers of Channel Access."""

    NO_ALARM = 0
    WRITE = 2
    STATE = 7
    COMM = 9
    HW_LIMIT = 11
    UDF = 17


@dataclass(frozen=True, slots=True)
class Alarm:
    """The alarm of a record.

    :param severity: how serious it is.
    :param status: its reason.
    :param message: its reason in words.
    """

    severity: Severity = Severity.NO_ALARM
    status: Status = Status.NO_ALARM
    message: str = ""


NO_ALARM: Final = Alarm()
UNDEFINED: Final = Alarm(Severity.INVALID, Status.UDF, "no value yet")


class Kind(Enum):
    """The type of the value of a record."""

    FLOAT = "float"
    INTEGER = "integer"
    TEXT = "text"
    CHOICE = "choice"
    """A number from 0, the index of one of the choices."""


Put = Callable[[Any], Awaitable[None]]
"""Carries out what a client put; returns when that is done, or raises
:class:`~stagewire.errors.StagewireError`."""
Listener = Callable[["Record"], Awaitable[None]]
"""Publishes the present value and alarm of a record."""


class Record:
    """A value with an alarm.

    :param name: name of the record, such as ``LAB:x.RBV``.
    :param kind: type of the value.
    :param value: the first value.
    :param put: accepts values of clients; None: the record is read-only.
    :param unit: unit of the value.
    :param precision: number of decimals that a display shows.
    :param limits: lowest and highest value that a client may put; equal: no limits.
    :param choices: texts of a :attr:`Kind.CHOICE`.
    :param description: the meaning of the value, in a few words.
    :param stops: whether putting it stops a motion, so that every client may do it.
    """

    def __init__(
        self,
        name: str,
        kind: Kind,
        value: Any = None,
        *,
        put: Put | None = None,
        unit: str = "",
        precision: int = 0,
        limits: tuple[float, float] = (0.0, 0.0),
        choices: tuple[str, ...] = (),
        description: str = "",
        stops: bool = False,
    ) -> None:
        self.name = name
        self.kind = kind
        self.value: Any = _FIRST[kind] if value is None else value
        self.unit = unit
        self.precision = precision
        self.limits = limits
        self.choices = choices
        self.description = description
        self.stops = stops
        self.record_type = "stagewire"
        """The type of record that clients see."""
        self.alarm = UNDEFINED if value is None else NO_ALARM
        self.time = time.time()
        self.puts = 0
        """The number of values that clients have put, also of those that failed."""
        self._put = put
        self._listeners: list[Listener] = []

    def __repr__(self) -> str:
        return f"<Record {self.name} {self.value!r}>"

    @property
    def writable(self) -> bool:
        """Whether clients may put values."""
        return self._put is not None

    def accept(self, put: Put) -> None:
        """Let clients put values."""
        self._put = put

    def listen(self, listener: Listener) -> None:
        """Call a function after each change of value, alarm, unit or limits."""
        self._listeners.append(listener)

    async def post(self, value: Any = None, alarm: Alarm | None = None) -> None:
        """Publish a value, an alarm, or both. All listeners have published them when this returns.

        :param value: the new value; None: the present one.
        :param alarm: the new alarm; None: no alarm if there is a new value, or else the present one.
        """
        if value is not None:
            self.value = value
            self.alarm = alarm or NO_ALARM
        elif alarm is not None:
            self.alarm = alarm
        self.time = time.time()
        for listener in self._listeners:
            await listener(self)

    async def put(self, value: Any) -> None:
        """Carry out what a client put, and return when it is done.

        :param value: a value of the kind of the record; for a choice also its text.

        Raise :class:`PutRefusedError` if the record is read-only or the value is unusable, and the errors of
        the motion or request that the value asked for.
        """
        if self._put is None:
            raise PutRefusedError(f"{self.name} is read-only")
        self.puts += 1
        try:
            await self._put(self.checked(value))
        except StagewireError as error:
            _log.warning("a put failed: %s", error)
            raise

    def checked(self, value: Any) -> Any:
        """Return a value that a client put as one of the kind of the record.

        Raise :class:`PutRefusedError`.
        """
        try:
            return _CHECKS[self.kind](self, value)
        except (TypeError, ValueError, OverflowError):
            raise PutRefusedError(
                f"{self.name}: {value!r} is not "
                + (f"one of {', '.join(self.choices)}" if self.choices else _NAMES[self.kind])
            ) from None


def _number(_: Record, value: Any) -> float:
    number = float(value)
    if not math.isfinite(number):
        raise ValueError
    return number


def _integer(_: Record, value: Any) -> int:
    if int(value) != float(value):
        raise ValueError
    return int(value)


def _text(_: Record, value: Any) -> str:
    return value.decode("latin-1") if isinstance(value, bytes) else str(value)


def _choice(record: Record, value: Any) -> int:
    text = _text(record, value)
    if text in record.choices:
        return record.choices.index(text)
    index = int(value)
    if not 0 <= index < len(record.choices):
        raise ValueError
    return index


_CHECKS: Final[dict[Kind, Callable[[Record, Any], Any]]] = {
    Kind.FLOAT: _number,
    Kind.INTEGER: _integer,
    Kind.TEXT: _text,
    Kind.CHOICE: _choice,
}
_NAMES: Final = {
    Kind.FLOAT: "a number",
    Kind.INTEGER: "an integer",
    Kind.TEXT: "a text",
    Kind.CHOICE: "a choice",
}
_FIRST: Final = {Kind.FLOAT: 0.0, Kind.INTEGER: 0, Kind.TEXT: "", Kind.CHOICE: 0}
