"""The base of the guarded links, the signals that interrupt a run, and the jitter of the computer.

Time is that of the link if it has a clock: a minute of a stepped clock takes no real time. The suite waits by
reading.

Python raises ``KeyboardInterrupt`` between any two bytecodes of the main thread. During a run that could
leave half a frame on the link, and the controller would read the following stop as the rest of that frame. So
during a run a signal handler only sets a flag and wakes the waiting read; then the link raises the exception.
If the program has its own handler, it is kept. SIGHUP is sent when the terminal or its connection is closed;
Windows does not have it.

A reply that is 20 ms late means something only if this computer does not oversleep by as much. So the suite
sleeps about fifty times for a short time, and measures how late it wakes.
"""

from __future__ import annotations

import signal
import threading
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import FrameType, MappingProxyType, TracebackType
from typing import Any, ClassVar, Final, Protocol, Self

from stagewire.errors import TransportLostError
from stagewire.links import Link
from stagewire_conformance.device.declaration import Declaration
from stagewire_conformance.device.lines.reopening import Reopenable
from stagewire_conformance.device.lines.standstill import Adrift, Part, bring_to_rest
from stagewire_conformance.device.permissions import Permissions
from stagewire_conformance.device.results import Entry

_DEFAULTS: Final[dict[signal.Signals, Any]] = {
    signal.SIGINT: signal.default_int_handler,
    signal.SIGTERM: signal.SIG_DFL,
}
if hasattr(signal, "SIGHUP"):
    _DEFAULTS[signal.SIGHUP] = signal.SIG_DFL


class Interruption:
    """Records requests to end the run; a context manager around the run.

    :param link: the link whose read is woken.
    """

    def __init__(self, link: Link) -> None:
        self._link = link
        self._count = 0
        self._heeded = 0
        self._before: dict[signal.Signals, Any] = {}
        self.signal: int = signal.SIGINT
        """The last signal."""

    def __enter__(self) -> Self:
        if threading.current_thread() is threading.main_thread():
            for number, default in _DEFAULTS.items():
                if signal.getsignal(number) is default:
                    self._before[number] = signal.signal(number, self._on_signal)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        at: TracebackType | None,
    ) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        self.signal = number
        self._count += 1
        self._link.wake()

    def check(self) -> None:
        """Raise :class:`KeyboardInterrupt` if the run should end."""
        if self._count > self._heeded:
            raise KeyboardInterrupt

    def heed(self) -> None:
        """Mark the interruptions up to now as handled. Restoring can then be interrupted again."""
        self._heeded = self._count


SHARE: Final = 0.2
"""The fraction of a tolerance that the jitter may use. With more jitter the suite draws no conclusion."""

_WAITS: Final = 50
_SECONDS: Final = 0.005


class Waiting(Protocol):
    """A line to a controller on which one can wait."""

    @property
    def now(self) -> float:
        """The time in seconds."""
        ...

    def listen(self, seconds: float, /) -> object:
        """Receive for some seconds."""
        ...


@dataclass(frozen=True)
class Jitter:
    """How late waits ended, in seconds.

    :param typical: the median.
    :param late: the 99th percentile.
    """

    typical: float
    late: float

    def blurs(self, tolerance: float) -> bool:
        """Return whether the jitter is too large to judge a time with this tolerance in seconds."""
        return self.late > SHARE * tolerance

    def __str__(self) -> str:
        return (
            f"99 % of the waits of this computer end at most {self.late * 1e3:.2f} ms late, "
            f"half of them at most {self.typical * 1e3:.2f} ms"
        )


def jitter_of(line: Waiting) -> Jitter:
    """Measure the jitter for a quarter of a second. The line receives as usual meanwhile.

    A wait that ends early, for example because of a message, counts as on time.
    """
    late = []
    for _ in range(_WAITS):
        began = line.now
        line.listen(_SECONDS)
        late.append(max(0.0, line.now - began - _SECONDS))
    return Jitter(percentile(late, 50), percentile(late, 99))


def percentile(values: list[float], share: int) -> float:
    """Return the smallest value that at least ``share`` percent of the values do not exceed.

    Raises :class:`ValueError` without values.
    """
    if not values:
        raise ValueError("nothing was measured")
    return sorted(values)[max(0, -(-len(values) * share // 100) - 1)]


_LOST: Final = "the line was lost before it came to rest ({})"


class GuardedLink(ABC):
    """A line to a controller, for one run.

    :param link: an open link. It is not closed.
    :param declared: the controller.
    :param allowed: the permissions.
    """

    stop_rule: ClassVar[str]
    """The rule that a stop ends a motion."""
    rest_rule: ClassVar[str] = ""
    """The rule that nothing moves at rest; empty if no message would show that something does."""
    unasked_ends: Mapping[str, bytes] = MappingProxyType({})
    """Reported ends of motions that this check did not ask for: message -> the first one received."""
    ends: frozenset[str] = frozenset()
    """The messages that report the end of a motion."""

    def __init__(self, link: Link, declared: Declaration, allowed: Permissions) -> None:
        self.declared = declared
        self.allowed = allowed
        self.log: list[Entry] = []
        """All traffic, in order."""
        self.stops: list[str] = []
        """The stops that were sent, in order, including stronger measures."""
        self.disabled: set[str] = set()
        """The names of the parts that had to be disabled because they ignored their stops."""
        self.adrift: list[Adrift] = []
        """The parts that may still be moving although every measure was taken."""
        self._rests = True  # whether everything is at rest, as its positions have shown
        self._lost = ""  # why a stop could not be sent
        self._stopped: set[str] = set()  # the parts that were stopped since then
        self.interruption = Interruption(link)
        self._link = link
        self._clock = time.monotonic if link.clock is None else link.clock
        self._began = self._clock()

    @property
    def url(self) -> str:
        """The URL of the link."""
        return self._link.url

    @property
    def now(self) -> float:
        """Seconds since the line was created."""
        return self._clock() - self._began

    # Used by a run

    @abstractmethod
    def contact(self) -> dict[str, int | str]:
        """Contact the controller and return the fields of its identity; empty if it reports none.

        Raises :class:`.NothingAnswersError` if nothing of the protocol arrives.
        """

    def identify(self, reported: Mapping[str, int | str]) -> Declaration:
        """Return the controller with the scales of the reported identity. The guard uses them from now on.

        :param reported: the identity from :meth:`contact`.

        Raises :class:`.RangeError` for a declared travel that cannot be converted to counts, and
        :class:`~stagewire.errors.WrongUnitError` if another unit answered.
        """
        return self.declared

    @abstractmethod
    def listen(self, seconds: float) -> object:
        """Receive for some seconds and return the result."""

    @abstractmethod
    def settle(self) -> list[str]:
        """Read until the line is quiet, before a check; return descriptions of unsolicited messages."""

    @abstractmethod
    def pause(self, seconds: float) -> None:
        """Wait, and keep everything that arrives."""

    @abstractmethod
    def parts(self, *, going: bool = False) -> Sequence[Part]:
        """Return what this check has set in motion.

        :param going: whether to return only those parts whose end was not reported.
        """

    @abstractmethod
    def others(self) -> Sequence[Part]:
        """Return everything else that can move: a faulty controller may move it instead."""

    def live(self) -> list[str]:
        """Return the names of the targets with an output that can burn or heat, and is on."""
        return []

    def switch_off(self) -> list[Adrift]:
        """Switch off all outputs that can burn or heat; return those that are still on."""
        return []

    @abstractmethod
    def forget(self) -> None:
        """Forget all motions, before the next check."""

    def halt(self) -> None:
        """Stop everything that this check may have set in motion, before anything else is done.

        Raises nothing except a second interruption: on a lost line nothing can be stopped.
        """
        self._stop(self.parts())

    def rest(self) -> bool:
        """Stop each motion whose end was not reported; return whether everything is at rest."""
        self._stop(self.parts(going=True))
        return self.come_to_rest()

    def _stop(self, parts: Sequence[Part]) -> None:
        for part in parts:
            self._rests = False
            self._stopped.add(part.name)
            part.measures[0].take()

    def come_to_rest(self) -> bool:
        """Wait until everything that this check has set in motion is at rest; return whether it is.

        A part that does not come to rest is stopped, then stopped immediately, then disabled. If nothing
        helps, or if the line is lost, :attr:`adrift` says so.
        """
        if not self._rests and not self.adrift:
            if self._lost:
                self.give_up(_LOST.format(self._lost))
                return False
            try:
                self.adrift += bring_to_rest(self, self._everything(), self._stopped)
            except TransportLostError as error:
                self.give_up(_LOST.format(error))
            self._rests = not self.adrift
        return not self.adrift

    def _everything(self) -> list[Part]:
        """Return the parts that were set in motion, and others whose motion can be observed."""
        moved = self.parts()
        if not moved:
            return []
        return [*moved, *(part.if_seen(lambda: self.now) for part in self.others())]

    def give_up(self, why: str) -> None:
        """Take all measures for all parts at once, without waiting for rest.

        :param why: why it is not known whether everything is at rest.
        """
        if self._rests or self.adrift:
            return
        for part in self.parts():
            for measure in part.measures[1:]:
                measure.take()
            self.adrift.append(
                Adrift(f"{part.name} may still be {part.active}: {why}", blames=False)
            )
        self._rests = not self.adrift

    def _starts(self) -> None:
        """Note that something is set in motion."""
        self._rests = False
        self._stopped.clear()

    @abstractmethod
    def leave(self) -> None:
        """Restore the state in which :meth:`contact` found the controller, at the end of a run."""

    def reopen(self) -> bool:
        """Open the link again, which can bring a controller back into step; return whether it was opened.

        It never is while something may be moving, because nothing could be stopped meanwhile.

        Raises :class:`~stagewire.errors.TransportLostError` if it could not be opened again.
        """
        self.interruption.check()
        return self._rests and isinstance(self._link, Reopenable) and self._link.reopen()

    # Bytes

    def _write(self, raw: bytes, tell: Callable[[], str], *, keep_alive: bool = False) -> None:
        """Send all bytes."""
        self.interruption.check()
        self._put(raw, tell, keep_alive)

    def _write_now(self, raw: bytes, tell: Callable[[], str]) -> None:
        """Send bytes of a stop regardless of interruptions. On a lost line nothing is sent or logged."""
        try:
            self._put(raw, tell, False)
        except TransportLostError as error:
            self.log.pop()
            self._lost = str(error)
        else:
            self.stops.append(tell())

    def _put(self, raw: bytes, tell: Callable[[], str], keep_alive: bool) -> None:
        self.log.append(Entry(self.now, True, raw, keep_alive, tell))
        self._link.write(raw)

    def _read(self, timeout: float) -> bytes:
        """Return received bytes; wait for them for at most ``timeout`` seconds."""
        self.interruption.check()
        return self._link.read(max(0.0, timeout))

    def _record(self, raw: bytes, tell: Callable[[], str]) -> None:
        """Log received bytes."""
        self.log.append(Entry(self.now, False, raw, False, tell))
