"""Runs that are interrupted at some point of the dialogue, and the truth about the motion afterwards.

The truth is that of the simulated axes. It is sampled at every operation of the link.
"""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from random import Random
from typing import Any

from firmware_bench import Bench

from stagewire.errors import TransportLostError
from stagewire.links import Link
from stagewire_conformance.device.check import Check
from stagewire_conformance.device.permissions import Need
from stagewire_conformance.device.report import Report
from stagewire_conformance.device.run import RunInterrupted, run
from stagewire_virtual import VirtualController
from stagewire_virtual.asi_ms2000.instrument import Ms2000Instrument
from stagewire_virtual.linking import SteppedLink
from wrapped_links import WrappedLink

LOST = "a lost line"
WAYS = [LOST, *(name for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))]

Firmware = Callable[[Link], Link]
"""Puts defective firmware between the host and a correct controller."""


def correct(link: Link) -> Link:
    return link


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

    def __init__(
        self, controller: VirtualController, link: Link, interruption: Interruption
    ) -> None:
        super().__init__(link)
        self.operations = 0
        self.began = 0
        """The operation at which something was first seen to move."""
        self._controller = controller
        self._what = interruption
        self._lost = False

    def read(self, timeout: float) -> bytes:
        self._count()
        self._compare()
        return self._link.read(timeout)

    def write(self, data: bytes) -> None:
        if self._what.before is not None and not self._lost:
            self._what.sent.append((data, commanded(self._controller)))
        interrupted = self._count()
        self._link.write(data)
        if interrupted:  # this write still belongs to the check
            self._what.before = commanded(self._controller)
        self._compare()

    def _count(self) -> bool:
        self.operations += 1
        if not self.began and any(commanded(self._controller).values()):
            self.began = self.operations
        if self.operations == self._what.at:
            self._what.before = commanded(self._controller)
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
        for name, speed in commanded(self._controller).items():
            if speed > before[name]:
                self._what.rises.append(f"{name}: from {before[name]} to {speed}")
            before[name] = min(before[name], speed)


@dataclass(frozen=True)
class Ended:
    """An interrupted run that has ended."""

    report: Report
    link: InterruptedLink
    interruption: Interruption
    controller: VirtualController


def kinds_that_move(bench: Bench) -> list[str]:
    """Return the kinds with a check that moves something and runs on a unit."""
    running = (
        check
        for check in bench.checks
        if Need.MOTION in check.needs and not check.skip and not check.refusal(bench.allowed)
    )
    return [*dict.fromkeys(check.kind.name for check in running if check.kind)]


def run_kind(
    bench: Bench, kind: str, interruption: Interruption, firmware: Firmware = correct
) -> Ended:
    """Run the checks of a kind on a new controller; if it needs positions from home, home first."""
    controller = bench.make(seed=0)
    wanted = {kind, "home"} if kind == "limits" else {kind}
    checks: list[Check] = [c for c in bench.checks if c.kind and c.kind.name in wanted]
    link = InterruptedLink(controller, firmware(SteppedLink(controller)), interruption)
    try:
        report = run(link, checks, bench.declared, bench.allowed, 1)
    except RunInterrupted as error:
        report = error.report
    if report.defect is not None:
        raise report.defect
    return Ended(report, link, interruption, controller)


def draws(name: str, began: int, operations: int, count: int) -> Iterator[Interruption]:
    """Yield seeded interruptions, all ways in turn.

    The last operation is left out: after it, the run has nothing more to do, so it ends as usual.
    """
    random = Random(name)
    for number in range(count):
        at = min(random.randint(max(1, began), operations), operations - 1)
        yield Interruption(at, WAYS[number % len(WAYS)])


def judge(bench: Bench, ended: Ended) -> None:
    """Fail if anything got faster or started after an interruption, or moves on without a warning."""
    what, report = ended.interruption, ended.report
    where = f"{what.way} at operation {what.at}: "
    assert report.unfinished, f"{where}the run went to its end"
    assert not what.rises, where + "; ".join(what.rises)
    registry = bench.declared.registry
    for raw, speeds in what.sent:
        name = _name(bench, raw)
        effect = registry.messages[name]["effect"] if name else "none"
        if effect == "settings":
            assert not any(speeds.values()), f"{where}{name} was sent while {speeds}"
        assert effect != "motion" or _is_harmless(name, raw, speeds), (
            f"{where}{raw.hex(' ')} ({name})"
        )
    if what.way == LOST:
        ended.controller.advance(0.01)
    moving = any(commanded(ended.controller).values())
    assert not moving or report.adrift, f"{where}still moves, but the report says nothing"
    if not moving:
        ended.controller.advance(3.0)
        assert not any(commanded(ended.controller).values()), f"{where}it started again"


def _name(bench: Bench, raw: bytes) -> str:
    if bench.unit.endswith("2000"):
        names = bench.declared.protocol.rule.requests  # type: ignore[attr-defined]
        entry = names.get(raw[1]) if len(raw) > 1 and raw[0] in (0x18, 0x19, 0x1A) else None
        return entry.name if entry else ""
    id = int.from_bytes(raw[:2], "little")
    entries = bench.declared.registry.messages.items()
    return next((name for name, entry in entries if entry["id"] == id), "")


_OFF = {"MOD_SET_CHANENABLESTATE": 2, "MOT_SET_SOL_STATE": 2}
"""Messages that stop something with this value of their third byte."""
_RESTORED = {"MOD_SET_CHANENABLESTATE", "MOT_SET_SOL_OPERATINGMODE", "MOT_SET_SOL_INTERLOCKMODE"}
"""Settings that may switch something, which may be restored at rest."""


def _is_harmless(name: str, raw: bytes, speeds: dict[str, float]) -> bool:
    """Return whether a message that may move something stops it, or restores a setting at rest."""
    return raw[3] == _OFF.get(name) or (name in _RESTORED and not any(speeds.values()))
