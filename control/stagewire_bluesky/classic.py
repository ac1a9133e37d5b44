"""A motor record of EPICS as a device of ophyd that checks position and alarm after each move.

Needs the extra ``bluesky-epics``. This module is imported only by programs that use ophyd, not ophyd-async.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Any

try:
    from ophyd import Component, EpicsMotor, EpicsSignalRO
    from ophyd.status import MoveStatus
    from ophyd.utils import StatusTimeoutError, UnknownStatusFailure
except ModuleNotFoundError as error:
    raise ModuleNotFoundError(
        f"stagewire_bluesky.classic requires {error.name}: pip install 'stagewire[bluesky-epics]'",
        name=error.name,
    ) from None

from stagewire.errors import ReplyTimeoutError
from stagewire_bluesky.axis import ANSWER, CHECK, SILENCE
from stagewire_bluesky.checking import Arrival, Check, silent


class CheckedEpicsMotor(EpicsMotor):  # type: ignore[misc]
    """A :class:`ophyd.EpicsMotor` whose moves fail unless they end at their target.

    After each move it reads RBV and its alarm. During a move it asks the IOC for DMOV, so that an IOC that
    was killed or does not answer is noticed. The status of a move fails within 5 seconds if the move is
    refused or stopped, ends elsewhere, or the IOC or its controller is lost. ``read`` asks the IOC, and fails
    if the position is not known. Homing is checked in the same way, except for its target.

    The class attribute ``tolerated_alarm`` is the worst alarm with which a move passes, as in ``EpicsMotor``.

    :param prefix: name of the motor record, such as ``LAB:x``.
    :param tolerance: how far from its target a move may end, in the unit of the record; None: the larger of
        RDBD and 0.01 mm, 10 µm, 0.1 degrees or 500 counts, the tolerance of native devices.
    :param options: the other arguments of ``EpicsMotor``.
    """

    fresh_readback = Component(EpicsSignalRO, ".RBV", kind="omitted", auto_monitor=False)
    """RBV as the IOC answers, not as it was published last."""
    deadband = Component(EpicsSignalRO, ".RDBD", kind="omitted", auto_monitor=True)

    def __init__(
        self, prefix: str = "", *, name: str, tolerance: float | None = None, **options: Any
    ) -> None:
        self._check = Check(tolerance, int(self.tolerated_alarm))
        self._accepts_stop = False
        super().__init__(prefix, name=name, **options)

    def move(
        self,
        position: float,
        wait: bool = True,
        moved_cb: Callable[..., Any] | None = None,
        timeout: float | None = None,
    ) -> MoveStatus:
        """Move, and check where the move ended.

        :param position: the target.
        :param wait: whether to wait for the end.
        :param moved_cb: called at the end.
        :param timeout: seconds after which the move counts as failed; None: that of the device.
        """
        self._accepts_stop = False
        moved = super().move(position, wait=False, timeout=timeout)
        return self._checked(moved, position, wait=wait, moved_cb=moved_cb)

    def home(
        self,
        direction: Any,
        wait: bool = True,
        moved_cb: Callable[..., Any] | None = None,
        timeout: float | None = None,
    ) -> MoveStatus:
        """Home, and check the alarm afterwards. The arguments are those of :meth:`move`."""
        self._accepts_stop = False
        moved = super().home(direction, wait=False, timeout=timeout)
        return self._checked(moved, None, wait=wait, moved_cb=moved_cb)

    def stop(self, *, success: bool = False) -> None:
        """Stop.

        :param success: whether the move under way succeeds where it stops, as in a plan that is paused.
        """
        self._accepts_stop = success
        super().stop(success=success)

    def read(self) -> dict[str, dict[str, Any]]:
        """Ask the IOC for the position, and return it with what else the device reads."""
        arrival = self._arrival()
        self._check.valid(self.name, arrival)
        readings: dict[str, dict[str, Any]] = super().read()
        if self.user_readback.name in readings:
            readings[self.user_readback.name] = {
                "value": arrival.position,
                "timestamp": self.fresh_readback.timestamp,
            }
        return readings

    def _checked(
        self,
        moved: MoveStatus,
        target: float | None,
        *,
        wait: bool,
        moved_cb: Callable[..., Any] | None,
    ) -> MoveStatus:
        checked = MoveStatus(self, moved.target)
        if moved_cb is not None:
            checked.add_callback(lambda status: moved_cb(status, obj=self))
        threading.Thread(
            target=self._follow,
            args=(moved, checked, target),
            name=f"move of {self.name}",
            daemon=True,
        ).start()
        if wait:
            try:
                checked.wait()
            except KeyboardInterrupt:
                self.stop()
                raise
        return checked

    def _follow(self, moved: MoveStatus, checked: MoveStatus, target: float | None) -> None:
        """Wait for the end that ophyd sees, while the IOC is asked whether it is there; then check it."""
        try:
            self._wait(moved, target)
            error = moved.exception()
            if self._accepts_stop and error is None:
                pass
            elif error is None:
                self._check.reached(self.name, target, self._arrival())
            elif isinstance(error, UnknownStatusFailure):
                arrival = None
                with suppress(ReplyTimeoutError):
                    arrival = self._arrival()
                raise self._check.failed(self.name, target, arrival)
            elif isinstance(error, StatusTimeoutError):  # other statuses do not accept it
                raise TimeoutError(str(error))
            else:
                raise error
        except Exception as failure:
            checked.set_exception(failure)
        else:
            checked.set_finished()

    def _wait(self, moved: MoveStatus, target: float | None) -> None:
        answered, done = time.monotonic(), threading.Event()
        moved.add_callback(lambda _: done.set())
        while not done.wait(CHECK):
            try:
                self.motor_done_move.get(
                    use_monitor=False, timeout=ANSWER, connection_timeout=ANSWER
                )
            except Exception:
                if time.monotonic() - answered > SILENCE:
                    if not moved.done:
                        self._done_moving(success=False)
                    raise ReplyTimeoutError(silent(self.name, target)) from None
            else:
                answered = time.monotonic()

    def _arrival(self) -> Arrival:
        """Ask for the position and its alarm."""
        patience = {"timeout": ANSWER, "connection_timeout": ANSWER}
        try:
            position = self.fresh_readback.get(**patience)
            done = self.motor_done_move.get(use_monitor=False, **patience)
        except Exception as error:
            raise ReplyTimeoutError(
                f"{self.name}: the IOC did not answer within {ANSWER:g} s"
            ) from error
        return Arrival(
            float(position),
            int(self.fresh_readback.alarm_severity),
            str(self.motor_egu.get()),
            float(self.deadband.get()),
            not done,
        )
