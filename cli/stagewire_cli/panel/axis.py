"""One axis of the panel: a thread that polls it and starts its motions, one at a time.

The screen reads :attr:`Axis.view` and asks for motions; both return at once. A motion is refused, never
queued, while another is under way. :meth:`Axis.stop` runs on a thread of :mod:`stagewire_cli.panel.stops`.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from fractions import Fraction
from queue import Empty, SimpleQueue
from typing import Any, Final, NamedTuple

from stagewire.devices import Bits, BitsByUnit
from stagewire.errors import (
    MotionStoppedError,
    MotionTimeoutError,
    ReplyTimeoutError,
    SessionClosedError,
    StagewireError,
    TargetNotReachedError,
    TransportError,
    UnsupportedError,
)
from stagewire_cli.panel.amounts import COUNTS, STEPS, given, parse, travel_of
from stagewire_cli.status import Value, flags_of, numbers_of, status_of

POLL: Final = 0.15
"""Seconds between two requests for the status."""
_SELDOM: Final = 7
"""Polls per request for whether the channel is enabled."""
FRESH: Final = 0.25
"""Seconds for which a pressed jog key counts; the screen may receive it late."""
RELEASE: Final = 0.7
"""Seconds after a stop, or after the last jog key then, in which motions are refused."""
MOTION_TIMEOUT: Final = 600.0
"""Seconds after which a motion that has not ended is stopped."""
_STOP_TIMEOUT: Final = 10.0
_ALERTS: Final = ("_limit", "_error", "_fault")
"""Endings of the status bits that are shown by name."""


@dataclass(frozen=True, slots=True)
class View:
    """The state of an axis, as the screen shows it.

    :param position: None before the first status.
    :param moving: None if the unit does not report it.
    :param homed: None if the unit does not report it.
    :param enabled: None if the unit does not report it.
    :param alerts: the active limit switches, limits and errors, such as ``forward_hardware_limit``.
    :param action: the motion that was asked for here and has not ended, such as ``go to 2 mm``.
    :param note: the outcome of the last action, in one sentence.
    :param failed: whether it failed.
    :param silent: why there is no status; empty if there is one.
    :param lost: whether the line is lost.
    """

    position: Value | None = None
    moving: bool | None = None
    homed: bool | None = None
    enabled: bool | None = None
    alerts: tuple[str, ...] = ()
    action: str = ""
    note: str = ""
    failed: bool = False
    silent: str = ""
    lost: bool = False


class _Command(NamedTuple):
    what: str
    call: Callable[[], Any]
    moves: bool
    stops: int
    """How often a stop had been ordered when it was asked for."""


class Axis:
    """An axis of an open controller.

    :param name: name on the screen.
    :param part: device, bay, channel or axis of the library.
    :param clock: monotonic time in seconds.

    Reads the status once; raises its errors.
    """

    def __init__(self, name: str, part: Any, clock: Callable[[], float] = time.monotonic) -> None:
        self.name = name
        self.part = part
        self.view = View()
        self._clock = clock
        self._commands: SimpleQueue[_Command | None] = SimpleQueue()
        self._lock = threading.Lock()
        self._busy = False
        self._idle_since = clock()
        self._stops = 0
        self._refused_until = -RELEASE
        self._polls = 0
        self._thread = threading.Thread(target=self._serve, name=f"axis {name}", daemon=True)
        self._poll()
        position = self.view.position
        self.unit = position.unit if position and position.unit else COUNTS
        self.ends, self.travel = travel_of(str(part), self.unit)
        self._step = len(STEPS[self.unit]) // 2

    def start(self) -> None:
        """Begin to poll."""
        self._thread.start()

    def close(self, patience: float) -> None:
        """End the thread; wait for it at most this many seconds."""
        self._commands.put(None)
        if self._thread.is_alive():
            self._thread.join(patience)

    # From the screen

    @property
    def step(self) -> str:
        """The step of a jog, with its unit."""
        return f"{STEPS[self.unit][self._step]} {self.unit}"

    @property
    def can_home(self) -> bool:
        """Whether its unit has a message for homing."""
        return hasattr(self.part, "start_home")

    def place(self) -> str:
        """Return the position with its unit, for people."""
        position = self.view.position
        if position is None:
            return "an unknown position"
        return str(position) if position.unit else f"{position} {COUNTS}"

    def change_step(self, by: int) -> None:
        """Choose the next larger (1) or smaller (-1) step."""
        self._step = min(max(self._step + by, 0), len(STEPS[self.unit]) - 1)

    def jog(self, direction: int, pressed: float) -> None:
        """Move by one step, unless an action is under way or the key was pressed before it ended.

        :param direction: 1 or -1.
        :param pressed: time at which the key was pressed.
        """
        now = self._clock()
        if now < self._refused_until:  # the key is still held after a stop
            self._refused_until = max(self._refused_until, now + RELEASE)
            return
        if self._busy or pressed < self._idle_since or now - pressed > FRESH:
            return
        way = Fraction(STEPS[self.unit][self._step]) * direction
        self._ask(f"jog {'+' if direction > 0 else '-'}{self.step}", lambda: self._by(way), True)

    def go_to(self, text: str) -> None:
        """Move to a typed position, or show that it is not a number."""
        try:
            target = parse(text, self.unit)
        except StagewireError as error:
            self.refuse(str(error))
            return
        start = self.part.start_move_absolute
        what = f"go to {float(target):.10g} {self.unit}"
        self._ask(what, lambda: start(**given(start, target, self.unit)), True)

    def home(self) -> None:
        """Home with the settings of the controller."""
        self._ask("home", self.part.start_home, True)

    def enable(self, on: bool) -> None:
        """Enable or disable the channel."""
        self._ask(
            "enable" if on else "disable", self.part.enable if on else self.part.disable, False
        )

    def refuse(self, why: str) -> None:
        """Show why an action was not asked for."""
        self._note(why, failed=True)

    def _ask(self, what: str, call: Callable[[], Any], moves: bool) -> None:
        """Hand over a command, or note why it is refused."""
        with self._lock:
            stops = self._stops  # before the check, so that a stop in between cancels the command
            if self._clock() < self._refused_until:
                refused = f"{what}: refused, because a stop was just sent; ask again"
            elif self.view.lost:
                refused = f"{what}: the line is lost; quit, and start the panel again"
            elif self._busy or (moves and self.view.moving):
                refused = f"{what}: refused, because the axis moves; stop it first, or wait"
            else:
                self._busy = True
                self.view = replace(self.view, action=what, note="", failed=False)
                self._commands.put(_Command(what, call, moves, stops))
                return
        self.refuse(refused)

    # From the threads of the stops

    def forbid(self) -> None:
        """Refuse motions that have been asked for but not sent, and further ones for a short time."""
        self._refused_until = self._clock() + RELEASE
        self._stops += (
            1  # last: an action with this number was asked for after the time above was set
        )

    def stop(self) -> None:
        """Send a stop and wait for its answer; the outcome is noted.

        If a motion is under way, the thread of the axis notes where it was stopped.
        """
        under_way = self._busy
        try:
            self.part.stop(timeout=_STOP_TIMEOUT)
        except (TransportError, SessionClosedError) as error:
            self._lost(error)
        except ReplyTimeoutError:
            if self.view.moving is False and not self.view.silent:  # it does not answer at rest
                self._note("stop was sent", failed=False)
            else:
                self._note(
                    "the stop was sent but not answered, so the axis may still move", failed=True
                )
        except StagewireError as error:
            self._note(f"the stop failed: {error}", failed=True)
        else:
            if not under_way:
                self._note("stop was sent", failed=False)

    # The thread of the axis

    def _serve(self) -> None:
        while not self.view.lost:
            try:
                command = self._commands.get(timeout=POLL)
            except Empty:
                self._poll()
                continue
            if command is None:
                return
            try:
                self._do(command)
            finally:
                with self._lock:
                    self.view = replace(self.view, action="")
                    self._idle_since = self._clock()
                    self._busy = False

    def _do(self, command: _Command) -> None:
        """Run a command until its end, and note the outcome."""
        motion = None
        try:
            if self._stops != command.stops:
                return
            motion = command.call()
            if not command.moves:
                self._polls = 0  # asks whether it is enabled
                self._poll()
                self._note(f"{command.what}: done", failed=False)
                return
            if self._stops != command.stops:  # ordered while the library prepared the motion
                self.stop()
            end = self._end_of(motion, command)
        except MotionStoppedError:
            self._poll()
            self._note(f"{command.what}: stopped at {self.place()}", failed=False)
        except MotionTimeoutError as error:
            self.stop()
            self._note(f"{command.what}: {error}; a stop was sent", failed=True)
        except (TransportError, SessionClosedError) as error:
            self._lost(error)
        except TargetNotReachedError as error:
            self._note(f"{command.what}: {error}", failed=True)
        except Exception as error:  # also an error in this program, which must not end the thread
            if command.moves and (motion is not None or not isinstance(error, StagewireError)):
                self.stop()
            text = str(error) if isinstance(error, StagewireError) else repr(error)
            self._note(f"{command.what}: {text}", failed=True)
        else:
            self._poll()
            self._note(
                f"{command.what}: done after {end.seconds:.2f} s, at {self.place()}", failed=False
            )

    def _end_of(self, motion: Any, command: _Command) -> Any:
        """Wait for the end of a motion, and poll meanwhile."""
        deadline = self._clock() + MOTION_TIMEOUT
        while True:
            try:
                return motion.wait(POLL)
            except MotionTimeoutError:
                if motion.done or self._clock() > deadline:
                    raise
            self._poll()
            if self._stops != command.stops and self.view.moving is False:
                raise MotionStoppedError("a status after the stop shows rest")

    def _by(self, way: Fraction) -> Any:
        """Start a move by a distance; a unit without such a message moves to the sum."""
        relative = getattr(self.part, "start_move_relative", None)
        if relative is not None:
            return relative(**given(relative, way, self.unit))
        start = self.part.start_move_absolute
        here = self.part.position_counts if self.unit == COUNTS else self.part.position
        return start(**given(start, Fraction(here) + way, self.unit))

    def _poll(self) -> None:
        """Read the status; before the thread has started, raise its errors."""
        try:
            self._read()
        except (TransportError, SessionClosedError) as error:
            if self._thread.ident is None:
                raise
            self._lost(error)
        except StagewireError as error:
            if self._thread.ident is None:
                raise
            with self._lock:
                self.view = replace(self.view, silent=str(error))

    def _read(self) -> None:
        values = status_of(self.part)
        if values is None:
            raise UnsupportedError("it reports no position")
        moving = enabled = None
        with suppress(UnsupportedError):
            moving = bool(self.part.is_moving())
        if self._polls % _SELDOM == 0:
            with suppress(UnsupportedError):
                enabled = self.part.is_enabled()
        else:
            enabled = self.view.enabled
        homed = _bit(values, "homed")
        self._polls += 1
        with self._lock:
            self.view = replace(
                self.view,
                position=numbers_of(values).get("position"),
                moving=moving,
                homed=homed,
                enabled=enabled,
                alerts=tuple(flag for flag in flags_of(values) if flag.endswith(_ALERTS)),
                silent="",
            )

    def _note(self, text: str, *, failed: bool) -> None:
        with self._lock:
            self.view = replace(self.view, note=text, failed=failed)

    def _lost(self, error: StagewireError) -> None:
        with self._lock:
            self.view = replace(
                self.view, note=str(error), failed=True, lost=True, moving=None, silent="lost"
            )


def _bit(values: Any, name: str) -> bool | None:
    """Return a bit of a status; None if its flags do not have it."""
    for one in values.names:
        if isinstance(getattr(type(values), one), Bits | BitsByUnit):
            bits = getattr(values, one)
            if name in bits.bits:
                return name in bits.names
    return None
