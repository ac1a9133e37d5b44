"""The motor record: fields that clients read and put, over the motions of an axis. No network code."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Mapping
from functools import partialmethod
from typing import Any, Final

from stagewire.errors import (
    LimitError,
    MotionStoppedError,
    ReplyTimeoutError,
    SessionClosedError,
    StagewireError,
    TransportError,
)
from stagewire_epics.axis import OpenAxis, Reading
from stagewire_epics.calibration import Calibration
from stagewire_epics.motions import ANSWER, DAY, Motion, Motions
from stagewire_epics.parameters import StatusRecords
from stagewire_epics.records import NO_ALARM, Alarm, Put, PutRefusedError, Severity, Status
from stagewire_epics.state import MotorState
from stagewire_epics.velocity import MotorSettings, Velocity

STOP, PAUSE, MOVE, GO = range(4)
"""The choices of SPMG."""
BUTTONS: Final = ("HOMF", "HOMR", "JOGF", "JOGR", "TWF", "TWR")
"""Fields that are 1 during the motion that they start."""
FIRST: Final = 0.01
"""Seconds between the failure of a put and DMOV=1, so that clients receive them in this order."""
_AT_ONCE: Final = frozenset({"STOP", "SPMG", "JOGF", "JOGR"})
"""The fields that stop."""
_MOTIONS: Final = frozenset({"VAL", "DVAL", "RVAL", "RLV", "HOMF", "HOMR", "TWF", "TWR"})
"""The fields whose put completes at the end of a motion, so that nothing waits for it."""
IDLE: Final = 0.5
"""Seconds between two readings of an axis at rest."""
SELDOM: Final = 10.0
"""Seconds between two readings of its velocity, which other programs may change."""


class Motor:
    """A motor record.

    :param name: name of the record, such as ``LAB:x``.
    :param out: text of OUT: the URL of the controller and the part.
    :param settings: settings that the controller does not know.
    :param lost: called when the line is lost.
    """

    def __init__(
        self,
        name: str,
        out: str,
        settings: MotorSettings,
        lost: Callable[[StagewireError], None],
    ) -> None:
        self.name = name
        self._settings = settings
        self._lost = lost
        self.status: StatusRecords | None = None
        """The bits of the status as records, if the bench asks for them."""
        self._settings_order = asyncio.Lock()
        self._motions = Motions(self)
        self._state = MotorState(name)
        self._calibration = Calibration(self._state, self._motions)
        self._velocity = Velocity(self._state, self._motions, settings)
        self.records = self._state.records
        """The record of each field."""
        self.records["OUT"].value, self.records["DESC"].value = out, settings.description
        for holder in (self, self._calibration, self._velocity):
            for field, record in self.records.items():
                if (put := getattr(holder, f"put_{field.lower()}", None)) is not None:
                    record.accept(self._in_order(field, put))

    def _in_order(self, field: str, put: Put) -> Put:
        """Return a put that begins after the settings that were put before it, as in EPICS.

        Clients put SET = Use and then VAL without waiting in between. A stop waits for nothing.
        """
        if field in _AT_ONCE:
            return put

        async def in_order(value: Any) -> None:
            async with self._settings_order:
                if field not in _MOTIONS:
                    await put(value)
                    return
            await put(value)

        return in_order

    # The controller

    async def attach(self, axis: OpenAxis) -> None:
        """Read the state of an axis whose controller was opened. Nothing moves.

        Raise the errors of requests, and :class:`PutRefusedError` for settings that are missing or invalid.
        """
        place = self._state.coordinates
        place.resolution, place.unit, place.travel = axis.resolution, axis.unit, axis.travel
        known = (place.low, place.high) if place.limited else self._settings.limits
        place.set_limits(self.name, *(known or axis.travel or (0.0, 0.0)))
        await self._state.post_axis(axis)
        await self._velocity.read(axis)
        self._motions.axis = axis
        self._state.failure = NO_ALARM
        reading = await self._motions.poll()
        await self._state.post_coordinates()
        await self._state.post_target(reading.position)
        await self._state.show_presence()

    def restore(self, values: Mapping[str, Any]) -> None:
        """Take over saved values of fields, before the controller is open.

        Raise :class:`PutRefusedError` for an unusable value.
        """
        self._calibration.restore(values)

    async def detach(self, error: StagewireError) -> None:
        """Fail the motion under way, and mark all fields as invalid, because the controller is lost."""
        await self._motions.end(error)
        await self._state.show_loss(str(error))

    async def watch(self) -> None:
        """Read the state of the axis while no motion does, until the line is lost."""
        read = time.monotonic()
        while (axis := self._motions.axis) is not None:
            if not self._motions.running:
                try:
                    await self._motions.poll()
                    if time.monotonic() - read > SELDOM:
                        read = time.monotonic()
                        await self._velocity.read(axis)
                except (TransportError, SessionClosedError) as error:
                    self._lost(error)
                    return
                except StagewireError:
                    pass  # it is published, and the next reading may succeed
            moving = self._state.reading is not None and self._state.reading.moving
            await asyncio.sleep(IDLE / 5 if moving else IDLE)

    async def close(self) -> None:
        """Refuse motions, stop the axis, if it was moved by a client, and fail its pending put."""
        self._motions.closed = True
        if self._motions.wanted is not None or self._motions.running:
            error = MotionStoppedError(f"{self.name}: the IOC ends; its axis was stopped")
            try:
                await self._motions.stop("the IOC ends")
            finally:
                await self._motions.end(error)

    async def at_rest(self, what: str) -> None:
        """Raise :class:`PutRefusedError` for what was put if the axis moves or its controller is lost."""
        await self._motions.at_rest(what)

    # Events of motions

    async def begun(self, motion: Motion) -> None:
        """Publish that a motion begins."""
        self._state.failure, self._state.arrived = NO_ALARM, None
        await self._state.post_changes(MISS=0, LVIO=0)

    async def read(self, reading: Reading) -> None:
        """Publish the state of the axis. A motion that no client asked for ends at a new target."""
        former = self._state.reading
        await self._state.show(reading)
        if self.status is not None:
            await self.status.post(reading.values)
        own = self._motions.wanted is not None or self._motions.running
        if former is not None and former.moving and not reading.moving and not own:
            await self._state.post_target(reading.position)

    async def silent(self, error: StagewireError) -> None:
        """Publish that the state is not known."""
        await self._state.show_silence(str(error))
        if self.status is not None:
            await self.status.lost(str(error))

    async def ended(self, motion: Motion, error: StagewireError | None) -> None:
        """Publish the end of a motion: the position, an alarm if it failed, and then DMOV=1."""
        reading = self._state.reading
        unknown = isinstance(error, (TransportError, SessionClosedError, ReplyTimeoutError))
        if error is not None:
            stopped = isinstance(error, MotionStoppedError)
            self._state.failure = Alarm(
                Severity.MINOR if stopped else Severity.MAJOR, Status.STATE, str(error)
            )
            await self._state.post(MISS=1)
        elif reading is not None:
            self._state.arrived = reading.counts
        if reading is not None:
            if error is not None or motion.target is None:
                await self._state.post_target(reading.position)
            if not unknown:
                await self.read(reading)
        if error is not None and unknown:
            await self.silent(error)
            if not isinstance(error, ReplyTimeoutError):
                self._lost(error)
        await self._state.post_changes(**dict.fromkeys(BUTTONS, 0))
        if self._state["SPMG"] == MOVE:
            self._motions.paused = True
            await self._state.post(SPMG=PAUSE)
        if error is not None:
            motion.answer(error)
            await asyncio.sleep(FIRST)
        if self._motions.wanted is None:
            await self._state.post(MOVN=0, DMOV=1)
        motion.answer(error)

    # Motions that clients ask for

    async def put_val(self, user: float) -> None:
        """Move to a user position."""
        if self._calibration.setting:
            await self._calibration.set_user(user)
        else:
            await self._go("VAL", self._state.coordinates.dial(user))

    async def put_dval(self, dial: float) -> None:
        """Move to a dial position."""
        if self._calibration.setting:
            await self._calibration.set_dial(dial)
        else:
            await self._go("DVAL", dial)

    async def put_rval(self, counts: int) -> None:
        """Move to a position in counts."""
        await self.put_dval(counts * self._state.coordinates.resolution)

    async def put_rlv(self, distance: float) -> None:
        """Move by a distance in user coordinates."""
        user = self._state.coordinates.user(self._state.target) + distance
        await self._state.post(RLV=distance)
        try:
            await self.put_val(user)
        finally:
            await self._state.post(RLV=0.0)

    async def _tweak(self, name: str, on: int) -> None:
        """Move by TWV, forward or in reverse."""
        if not self._is_on(name, on):
            return
        self._refuse_setting(name)
        way = self._state["TWV"] * (1 if name == "TWF" else -1)
        dial = self._state.coordinates.dial(self._state.coordinates.user(self._state.target) + way)
        await self._go(name, dial)

    put_twf = partialmethod(_tweak, "TWF")
    put_twr = partialmethod(_tweak, "TWR")

    async def _jog(self, name: str, on: int, *, upper: bool) -> None:
        """Move towards a limit until 0."""
        if not self._is_on(name, on):
            wanted = self._motions.wanted
            if wanted is not None and wanted.what == self._what(name):
                await self._motions.stop(f"{name} is 0", hold=False)
            return
        self._refuse_setting(name)
        place = self._state.coordinates
        if not place.limited:
            raise await self._refused(
                PutRefusedError(
                    f"{self.name}.{name} needs limits: set LLM and HLM, or state travel_mm"
                )
            )
        dial = place.high if upper is not place.negative else place.low
        await self._go(name, dial, endless=True)

    put_jogf = partialmethod(_jog, "JOGF", upper=True)
    put_jogr = partialmethod(_jog, "JOGR", upper=False)

    async def _home(self, name: str, on: int) -> None:
        """Home with the settings of the controller."""
        if not self._is_on(name, on):
            return
        self._refuse_setting(name)
        axis = self._motions.axis
        if axis is not None and not axis.can_home:
            raise await self._refused(PutRefusedError(f"{self.name}: the controller cannot home"))

        async def call(axis: OpenAxis) -> None:
            motion.check()
            await axis.home(DAY)

        motion = Motion(self._what(name), call)
        await self._move(name, motion)

    put_homf = partialmethod(_home, "HOMF")
    put_homr = partialmethod(_home, "HOMR")

    async def put_stop(self, on: int) -> None:
        """Stop."""
        if self._is_on("STOP", on):
            self._reachable("STOP")
            await self._state.post(STOP=1)
            try:
                await self._motions.stop("STOP was put")
            finally:
                await self._state.post(STOP=0)

    async def put_cnen(self, on: int) -> None:
        """Enable or disable the motor at rest; nothing moves."""
        await self._motions.at_rest(self._what("CNEN"))
        if (axis := self._motions.axis) is not None:
            await axis.enable(on=bool(on))
            self._motions.held = not on
            await self._motions.poll()

    async def put_spmg(self, choice: int) -> None:
        """Stop, pause, or allow motions."""
        await self._state.post(SPMG=choice)
        self._motions.paused = choice in (STOP, PAUSE)
        if self._motions.paused:
            self._reachable("SPMG")
        if choice == STOP:
            await self._motions.stop("SPMG is Stop")
        elif choice == PAUSE:
            await self._motions.pause()
        else:
            self._motions.resume()

    async def _go(self, name: str, dial: float, *, endless: bool = False) -> None:
        """Move to a dial position, and return at the end of the motion."""
        place = self._state.coordinates
        try:
            place.check(f"{self.name}.{name}", dial)
        except LimitError as error:
            raise await self._refused(error, outside=True) from None
        if place.limited:
            dial = min(max(dial, place.low), place.high)

        async def call(axis: OpenAxis) -> None:
            reading = await axis.read(ANSWER)
            motion.check()
            place.check(motion.what, dial)  # the limits may have changed during a pause
            if endless and place.beyond(reading.position, dial):
                raise LimitError(
                    f"{motion.what}: the position is beyond this limit; nothing was sent"
                )
            if reading.moving or reading.counts != place.counts(dial):
                await axis.move(dial, DAY)

        motion = Motion(self._what(name), call, None if endless else dial, endless=endless)
        await self._move(name, motion)

    async def _move(self, name: str, motion: Motion) -> None:
        if (axis := self._motions.axis) is None:
            why = "the controller is not connected"
        elif not axis.enabled and self._motions.held:
            why = "the motor is disabled; put CNEN = 1 first"
        elif self._state["SPMG"] == STOP:
            why = "SPMG is Stop; put Go first"
        else:
            why = ""
        if why:
            raise await self._refused(PutRefusedError(f"{motion.what} was refused: {why}"))
        if motion.target is not None:
            await self._state.post_target(motion.target)
        await self._state.post_changes(
            **dict.fromkeys(BUTTONS, 0) | ({name: 1} if name in BUTTONS else {})
        )
        await self._state.post(DMOV=0)
        self._motions.start(motion)
        await asyncio.shield(motion.ended)

    async def _refused(self, error: StagewireError, *, outside: bool = False) -> StagewireError:
        """Return the error of a refused motion, after clients that wait for DMOV could see it."""
        await self._state.post(LVIO=int(outside))
        if self._motions.wanted is None and not self._motions.running:
            status = Status.HW_LIMIT if outside else Status.STATE
            alarm = Alarm(Severity.MINOR, status, str(error))
            if self._motions.axis is None:
                alarm = Alarm(Severity.INVALID, Status.COMM, str(error))
            self._state.failure = alarm
            await self.records["RBV"].post(alarm=alarm)
            await self._state.post(DMOV=0)
            await self._state.post(DMOV=1)
        return error

    def _what(self, name: str) -> str:
        return f"{self.name}.{name}"

    def _is_on(self, name: str, value: int) -> bool:
        if value not in (0, 1):
            raise PutRefusedError(f"{self.name}.{name}: {value} is not 0 or 1")
        return value == 1

    def _reachable(self, name: str) -> None:
        if self._motions.axis is None:
            raise PutRefusedError(
                f"{self._what(name)}: the controller is not connected; no stop was sent"
            )

    def _refuse_setting(self, name: str) -> None:
        if self._calibration.setting:
            raise PutRefusedError(f"{self.name}.{name} was refused: SET is Set; put Use first")
