"""The base of the guarded links, the signals that interrupt a run, and the jitter of the computer.

Time is that of the link, where it has a clock of its own: a minute of a stepped clock takes no time.
Waiting is reading.

Python raises ``KeyboardInterrupt`` between any two steps of the main thread. In a run that would leave half a
frame on the link, and a controller would take the stop that follows for the rest of it. So during a run a
signal is only noted, and the waiting read is woken; the link then raises. A program with a handler of its
own keeps it; where the link raises an error, the signal is honoured as well. SIGHUP comes when the
terminal or its connection is closed, and not on Windows.

A reply that came 20 ms late means something only on a computer that does not oversleep by as much. So the
suite sleeps some fifty times for no time at all, and measures how late it wakes.
"""

from __future__ import annotations

import signal
import threading
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import FrameType, TracebackType
from typing import Any, Final, Protocol, Self

from stagewire.errors import TransportLostError
from stagewire.links import Link
from stagewire_conformance.device.declaration import Declaration
from stagewire_conformance.device.permissions import Permissions
from stagewire_conformance.device.results import Entry

_DEFAULTS: Final[dict[signal.Signals, Any]] = {
    signal.SIGINT: signal.default_int_handler,
    signal.SIGTERM: signal.SIG_DFL,
}
if hasattr(signal, "SIGHUP"):
    _DEFAULTS[signal.SIGHUP] = signal.SIG_DFL


class Interruption:
    """Notes that somebody wants the run to end; a context manager while the run goes on.

    :param link: whose read is woken.
    """

    def __init__(self, link: Link) -> None:
        self._link = link
        self._count = 0
        self._heeded = 0
        self._before: dict[signal.Signals, Any] = {}
        self.signal: int = signal.SIGINT
        """The one that came last."""

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
        """Raise :class:`KeyboardInterrupt` if somebody wants the run to end."""
        if self._count > self._heeded:
            raise KeyboardInterrupt

    def heed(self) -> None:
        """Take all that was wanted until now as seen to: what is put back can be interrupted once more."""
        self._heeded = self._count


SHARE: Final = 0.2
"""The part of a tolerance that the jitter may take; beyond it nothing can be said of the controller."""

_WAITS: Final = 50
_SECONDS: Final = 0.005


class Waiting(Protocol):
    """What waits: a line to a controller."""

    @property
    def now(self) -> float:
        """The time in seconds."""
        ...

    def listen(self, seconds: float, /) -> object:
        """Take what comes within some seconds."""
        ...


@dataclass(frozen=True)
class Jitter:
    """How late waits ended, in seconds.

    :param typical: half of the waits were no later.
    :param late: 99 in 100 of the waits were no later.
    """

    typical: float
    late: float

    def blurs(self, tolerance: float) -> bool:
        """Say whether nothing can be said of a time that may be ``tolerance`` seconds off."""
        return self.late > SHARE * tolerance

    def __str__(self) -> str:
        return (
            f"this computer wakes up to {self.late * 1e3:.2f} ms late (99 of 100 waits; "
            f"half of them {self.typical * 1e3:.2f} ms)"
        )


def jitter_of(line: Waiting) -> Jitter:
    """Measure it, in a quarter of a second; what comes meanwhile is taken by the line as always.

    A wait that something cuts short, such as a message, counts as in time.
    """
    late = []
    for _ in range(_WAITS):
        began = line.now
        line.listen(_SECONDS)
        late.append(max(0.0, line.now - began - _SECONDS))
    return Jitter(percentile(late, 50), percentile(late, 99))


def percentile(values: list[float], share: int) -> float:
    """Return the smallest value that at least ``share`` in 100 of the values do not exceed.

    Raises :class:`ValueError` where there are no values.
    """
    if not values:
        raise ValueError("nothing was measured")
    return sorted(values)[max(0, -(-len(values) * share // 100) - 1)]


class GuardedLink(ABC):
    """A line to a controller; made for one run.

    :param link: open; it stays so.
    :param declared: what is at its other end.
    :param allowed: what may be sent.
    """

    def __init__(self, link: Link, declared: Declaration, allowed: Permissions) -> None:
        self.declared = declared
        self.allowed = allowed
        self.log: list[Entry] = []
        """Everything that passed, in order."""
        self.interruption = Interruption(link)
        self._link = link
        self._clock = time.monotonic if link.clock is None else link.clock
        self._began = self._clock()

    @property
    def url(self) -> str:
        """What was opened."""
        return self._link.url

    @property
    def now(self) -> float:
        """Seconds since the line was made."""
        return self._clock() - self._began

    # What a run does with it

    @abstractmethod
    def contact(self) -> dict[str, int | str]:
        """Begin to talk, and return what the controller says that it is, field by field; empty: it does not.

        Raises :class:`.NothingAnswersError` where nothing comes that is of the protocol.
        """

    def identify(self, reported: Mapping[str, int | str]) -> Declaration:
        """Return the controller with the scales of what it reports that it is, and guard it so from now on.

        :param reported: what :meth:`contact` returned.

        Raises :class:`.RangeError` for a declared travel that no scale converts to counts there.
        """
        return self.declared

    @abstractmethod
    def listen(self, seconds: float) -> object:
        """Return what comes within some seconds."""

    @abstractmethod
    def settle(self) -> list[str]:
        """Read until nothing comes any more, before a check; return what came unasked, for people."""

    @abstractmethod
    def halt(self) -> None:
        """Stop whatever this check may have set in motion, before anything else is done.

        Raises nothing but what interrupts it a second time: a line that is gone takes no stop.
        """

    @abstractmethod
    def rest(self) -> None:
        """Stop what a check that is over has left in motion, and forget what has ended."""

    @abstractmethod
    def leave(self) -> None:
        """Leave the controller in the state in which :meth:`contact` found it, at the end of a run."""

    # Bytes

    def _write(self, raw: bytes, tell: Callable[[], str], *, keep_alive: bool = False) -> None:
        """Send bytes, whole."""
        self.interruption.check()
        self._put(raw, tell, keep_alive)

    def _write_now(self, raw: bytes, tell: Callable[[], str]) -> None:
        """Send bytes whatever has happened; a line that is gone takes none, and the log says none."""
        try:
            self._put(raw, tell, False)
        except TransportLostError:
            self.log.pop()

    def _put(self, raw: bytes, tell: Callable[[], str], keep_alive: bool) -> None:
        self.log.append(Entry(self.now, True, raw, keep_alive, tell))
        self._link.write(raw)

    def _read(self, timeout: float) -> bytes:
        """Return what came, and wait for it for so many seconds at most."""
        self.interruption.check()
        return self._link.read(max(0.0, timeout))

    def _record(self, raw: bytes, tell: Callable[[], str]) -> None:
        """Note something that came."""
        self.log.append(Entry(self.now, False, raw, False, tell))
