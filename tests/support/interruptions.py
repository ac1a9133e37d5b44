"""Runs that are interrupted at some point of the dialogue, and the truth about the motion afterwards.

The truth is that of the simulated axes. It is sampled at every operation of the link.
"""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from random import Random
from typing import Any, NamedTuple, Protocol

from stagewire.errors import StagewireError, TransportLostError
from stagewire.links import Link
from stagewire_conformance.device.check import Check
from stagewire_conformance.device.declaration import Declaration
from stagewire_conformance.device.permissions import Need, Permissions
from stagewire_conformance.device.report import Report
from stagewire_conformance.device.run import RunInterrupted, run
from stagewire_virtual import VirtualController
from stagewire_virtual.asi_ms2000.instrument import Ms2000Instrument
from stagewire_virtual.linking import SteppedLink
from stagewire_virtual.thorlabs_apt.inertial.inertial import Inertial
from stagewire_virtual.thorlabs_apt.paddles import Paddle
from wrapped_links import WrappedLink

LOST = "a lost line"
WAYS = [LOST, *(name for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))]

Firmware = Callable[[Link], Link]
"""Puts defective firmware between the host and a correct controller."""


def correct(link: Link) -> Link:
    return link


class Declared(Protocol):
    """A declared controller with permissions."""

    @property
    def declared(self) -> Declaration: ...

    @property
    def allowed(self) -> Permissions: ...

    @property
    def checks(self) -> Sequence[Check]: ...


class Chosen(NamedTuple):
    """A declared controller with permissions and some checks."""

    declared: Declaration
    allowed: Permissions
    checks: Sequence[Check]


@dataclass(frozen=True)
class Rig:
    """A simulated controller on a stepped line.

    :param commanded: returns the commanded speed of each axis or output that moves at this instant; 0 at
        rest.
    :param advance: lets some seconds pass.
    """

    link: Link
    commanded: Callable[[], Mapping[str, float]]
    advance: Callable[[float], object]


def virtual_rig(controller: VirtualController, firmware: Firmware = correct) -> Rig:
    """Return a rig of a virtual controller."""
    link = firmware(SteppedLink(controller))
    return Rig(link, partial(commanded, controller), controller.advance)


def commanded(controller: VirtualController) -> dict[str, float]:
    """Return the commanded speed of each axis or output that moves at this instant; 0 at rest."""
    instrument: Any = controller.instrument
    if isinstance(instrument, Ms2000Instrument):
        return {name: _of_servo(axis) for name, axis in instrument.axes.items()}
    return {str(channel): _of_channel(channel.behaviour) for channel in instrument.channels}


def _of_servo(axis: Any) -> float:
    if not axis._stage.moving:
        return 0.0
    return float(axis.top_speed if axis._goal is not None else abs(axis._run_speed))


def _of_channel(behaviour: Any) -> float:
    if hasattr(behaviour, "_cycles"):  # a solenoid
        return float(behaviour._cycles is not None or behaviour._held)
    if isinstance(behaviour, Inertial):
        step = behaviour._drive.action
        return float(step.rate) if step else 0.0
    if isinstance(behaviour, Paddle):
        return float(behaviour._action is not None and behaviour._axis.moving)
    if not hasattr(behaviour, "_axis") or not behaviour._axis.moving:
        return 0.0
    action = behaviour._drive.action
    return float(action.pace.velocity) if action else abs(behaviour._axis.velocity)


@dataclass
class Interruption:
    """An interruption at an operation of the link.

    :param at: the number of the operation; 0 for none.
    :param way: one of :data:`WAYS`.
    :param before: the commanded speeds immediately after the operation.
    :param sent: everything written afterwards, each with the commanded speeds at that time.
    :param rises: descriptions of commanded speeds that rose afterwards.
    """

    at: int = 0
    way: str = ""
    before: dict[str, float] | None = None
    sent: list[tuple[bytes, dict[str, float]]] = field(default_factory=list)
    rises: list[str] = field(default_factory=list)


class InterruptedLink(WrappedLink):
    """A stepped line that is interrupted at one of its reads or writes."""

    def __init__(self, rig: Rig, interruption: Interruption) -> None:
        super().__init__(rig.link)
        self.operations = 0
        self.began = 0
        """The operation at which something was first seen to move."""
        self._commanded = rig.commanded
        self._what = interruption
        self._lost = False

    def read(self, timeout: float) -> bytes:
        self._count()
        self._compare()
        return self._link.read(timeout)

    def write(self, data: bytes) -> None:
        if self._what.before is not None and not self._lost:
            self._what.sent.append((data, dict(self._commanded())))
        interrupted = self._count()
        self._link.write(data)
        if interrupted:  # this write still belongs to the check
            self._what.before = dict(self._commanded())
        self._compare()

    def _count(self) -> bool:
        self.operations += 1
        if not self.began and any(self._commanded().values()):
            self.began = self.operations
        if self.operations == self._what.at:
            self._what.before = dict(self._commanded())
            if self._what.way == LOST:
                self._lost = True
            else:
                signal.raise_signal(getattr(signal, self._what.way))
        if self._lost:
            raise TransportLostError("the other end hung up")
        return self.operations == self._what.at

    def _compare(self) -> None:
        before = self._what.before
        if before is None:
            return
        for name, speed in self._commanded().items():
            if speed > before[name]:
                self._what.rises.append(f"{name}: from {before[name]} to {speed}")
            before[name] = min(before[name], speed)


@dataclass(frozen=True)
class Ended:
    """An interrupted run that has ended."""

    report: Report
    link: InterruptedLink
    interruption: Interruption
    rig: Rig


def kinds_that_move(on: Declared) -> list[str]:
    """Return the kinds with a check that moves something and runs on a unit."""
    running = (
        check
        for check in on.checks
        if Need.MOTION in check.needs and not check.skip and not check.refusal(on.allowed)
    )
    return [*dict.fromkeys(check.kind.name for check in running if check.kind)]


def run_kind(on: Declared, rig: Rig, kind: str, interruption: Interruption) -> Ended:
    """Run the checks of a kind on a new controller; if it needs positions from home, home first."""
    wanted = {kind, "home"} if kind in ("limits", "home-again") else {kind}
    checks = [check for check in on.checks if check.kind and check.kind.name in wanted]
    link = InterruptedLink(rig, interruption)
    try:
        with _not_ignored():
            report = run(link, checks, on.declared, on.allowed, 1)
    except RunInterrupted as error:
        report = error.report
    if report.defect is not None:
        raise report.defect
    return Ended(report, link, interruption, rig)


@contextmanager
def _not_ignored() -> Iterator[None]:
    """Receive the signals that a shell or nohup ignores for programs in the background."""
    numbers = [getattr(signal, name) for name in WAYS if name != LOST]
    ignored = [number for number in numbers if signal.getsignal(number) is signal.SIG_IGN]
    for number in ignored:
        default = signal.default_int_handler if number == signal.SIGINT else signal.SIG_DFL
        signal.signal(number, default)
    try:
        yield
    finally:
        for number in ignored:
            signal.signal(number, signal.SIG_IGN)


def interrupt(on: Declared, kind: str, make: Callable[[], Rig], count: int, name: str) -> int:
    """Interrupt the checks of a kind at some points, and judge each run; return the number of runs.

    :param make: makes the controller of one run.
    :param name: seeds the points.
    """
    whole = run_kind(on, make(), kind, Interruption())
    if not whole.link.began:
        return 0  # nothing moves there
    number = 0
    for what in draws(name, whole.link.began, whole.link.operations, count):
        judge(on, run_kind(on, make(), kind, what))
        number += 1
    return number


def interrupt_kinds(on: Declared, make: Callable[[], Rig], count: int, seed: int) -> int:
    """Interrupt a controller at some points, spread over the kinds that move; return the number of runs.

    If nothing moves in some kinds, the others get their points.

    :param seed: selects the kinds and the points.
    """
    kinds = kinds_that_move(on)
    Random(seed).shuffle(kinds)
    number, left = 0, kinds[:count]
    while left:
        share = -(-(count - number) // len(left))
        kind = left.pop()
        number += interrupt(on, kind, make, share, f"{seed}/{kind}")
    return number


def draws(name: str, began: int, operations: int, count: int) -> Iterator[Interruption]:
    """Yield seeded interruptions, all ways in turn.

    The last operation is left out: after it, the run has nothing more to do, so it ends as usual.
    """
    random = Random(name)
    for number in range(count):
        at = min(random.randint(max(1, began), operations), operations - 1)
        yield Interruption(at, WAYS[number % len(WAYS)])


def judge(on: Declared, ended: Ended) -> None:
    """Fail if anything got faster or started after an interruption, or moves on without a warning."""
    what, report = ended.interruption, ended.report
    where = f"{what.way} at operation {what.at}: "
    assert report.unfinished, f"{where}the run went to its end"
    assert not what.rises, where + "; ".join(what.rises)
    registry = on.declared.registry
    for raw, speeds in what.sent:
        name = _name(on.declared, raw)
        effect = registry.messages[name]["effect"] if name else "none"
        if effect == "settings":
            assert not any(speeds.values()), f"{where}{name} was sent while {speeds}"
        assert effect != "motion" or _is_harmless(name, raw, speeds), (
            f"{where}{raw.hex(' ')} ({name})"
        )
    if what.way == LOST:
        ended.rig.advance(0.01)
    moving = any(ended.rig.commanded().values())
    assert not moving or report.adrift, f"{where}still moves, but the report says nothing"
    if not moving:
        ended.rig.advance(3.0)
        assert not any(ended.rig.commanded().values()), f"{where}it started again"


def _name(declared: Declaration, raw: bytes) -> str:
    if declared.unit.kind == "line":
        names = declared.protocol.rule.requests  # type: ignore[attr-defined]
        entry = names.get(raw[1]) if len(raw) > 1 and raw[0] in (0x18, 0x19, 0x1A) else None
        return entry.name if entry else ""
    try:
        return declared.protocol.decode(raw).message.layout.message  # type: ignore[attr-defined]
    except StagewireError:
        return ""


_OFF = {"MOD_SET_CHANENABLESTATE": 2, "MOT_SET_SOL_STATE": 2}
"""Messages that stop something with this value of their third byte."""
_MODE = "PZMOT_SET_KCUBECHANENABLEMODE"
_RESTORED = {
    "MOD_SET_CHANENABLESTATE", "MOT_SET_SOL_OPERATINGMODE", "MOT_SET_SOL_INTERLOCKMODE", _MODE,
}  # fmt: skip
"""Settings that may switch something, which may be restored at rest."""


def _is_harmless(name: str, raw: bytes, speeds: Mapping[str, float]) -> bool:
    """Return whether a message that may move something stops it, or restores a setting at rest."""
    if name == "WRITE_VECTOR_SPEED":  # the last measure for an axis that ignores its stops
        return raw[3:-1] == bytes(2) and any(speeds.values())
    disables_all = name == _MODE and raw[8] == 0
    return (
        disables_all or raw[3] == _OFF.get(name) or (name in _RESTORED and not any(speeds.values()))
    )
