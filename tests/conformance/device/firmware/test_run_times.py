"""A run takes about as long as its plan announces, and every motion ends within its bound."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction

import pytest
from firmware_bench import BENCHES, Bench, bench

from interruptions import commanded
from parts import chosen
from stagewire.links import Link
from stagewire_conformance.device.permissions import Range
from stagewire_conformance.device.pics import ChannelPics
from stagewire_conformance.device.plans import Plan
from stagewire_conformance.device.report import Report
from stagewire_conformance.device.results import Result
from stagewire_conformance.device.run import run
from stagewire_conformance.reports.device_text import announcement
from stagewire_virtual import VirtualController
from stagewire_virtual.linking import SteppedLink
from wrapped_links import WrappedLink

LONGEST = 30.0
"""Seconds that a motion may take."""
LATE = 2.0
"""Seconds within which a motion is stopped at its bound."""


def plan_of(on: Bench) -> Plan:
    return Plan(declared=on.declared, allowed=on.allowed, checks=tuple(on.checks))


@pytest.mark.parametrize(
    "name", chosen(BENCHES, lambda name: name in ("TDC001", "BBD102", "TSC001", "MS2000"))
)
def test_the_announced_time_is_right(name: str) -> None:
    on = bench(name)
    link = on.line()
    assert link.clock is not None
    began = link.clock()
    report = on.run(link)
    took = link.clock() - began
    assert not report.unfinished
    assert took <= 150
    assert plan_of(on).seconds == pytest.approx(took, rel=0.2)


class Timed(WrappedLink):
    """A link that measures how long each motion takes, from the command to rest."""

    def __init__(self, link: Link, controller: VirtualController) -> None:
        super().__init__(link)
        self._controller = controller
        self._since: float | None = None
        self.longest = 0.0

    def read(self, timeout: float) -> bytes:
        data = self._link.read(timeout)
        self._look()
        return data

    def write(self, data: bytes) -> None:
        self._look()
        self._link.write(data)

    def _look(self) -> None:
        assert self.clock is not None
        if not any(commanded(self._controller).values()):
            self._since = None
            return
        self._since = self.clock() if self._since is None else self._since
        self.longest = max(self.longest, self.clock() - self._since)


MOTION = ("move-absolute", "move-relative", "move-stored", "move-jog", "move-velocity", "move-stop",
          "suspend", "move-updates", "in-motion", "profile", "limits")  # fmt: skip


def run_slowly(
    velocity: int, make: Callable[[VirtualController], Link] = SteppedLink, *, scaled: bool = True
) -> tuple[Report, Timed]:
    """Run the checks with motion on a homed TDC001 with a low maximum velocity, in raw units."""
    on = bench("TDC001")
    if not scaled:  # only the scale of the position is declared
        stage = ChannelPics(
            number=1, counts_per_mm=Fraction(34304), travel=Range.parse("0..411648counts")
        )
        on = replace(on, pics=replace(on.pics, channels=(stage,)), motion="0..100000counts")
    controller = on.make(seed=0)
    link = make(controller)
    home = [c for c in on.checks if c.kind and c.kind.name == "home"]
    run(link, home, on.declared, on.allowed, 1)
    link.write(
        bytes.fromhex("13 04 0E 00 D0 01 01 00 00 00 00 00 18 04 00 00")
        + velocity.to_bytes(4, "little")
    )
    timed = Timed(link, controller)
    checks = [c for c in on.checks if c.kind and c.kind.name in MOTION]
    return run(timed, checks, on.declared, on.allowed, 1), timed


@pytest.mark.parametrize(
    ("velocity", "scaled"),
    [(36, True), (358, True), (358, False)],  # 1.6 and 16 counts/s
)
def test_a_slow_motor_moves_only_within_the_bound(velocity: int, scaled: bool) -> None:
    report, timed = run_slowly(velocity, scaled=scaled)
    assert not report.unfinished
    assert timed.longest <= LONGEST + LATE
    wrong = {
        outcome.check.id: [finding.text for finding in outcome.findings]
        for outcome in report.outcomes
        if outcome.result in (Result.FAIL, Result.NON_STRICT)
    }
    assert not wrong
    left_out = {check.kind.name: why for check, why in report.not_run if check.kind}
    if velocity == 358 and scaled:
        assert "the suite starts none that takes more than 20 s" in left_out["limits"]
    if velocity == 36:
        assert "too slow to be observed" in left_out["move-absolute"]


class WrongWay(SteppedLink):
    """A motor that runs in the other direction when it should run into a limit switch."""

    def write(self, data: bytes) -> None:
        if data[:2] == b"\x57\x04":  # MOT_MOVE_VELOCITY
            data = data[:3] + bytes((3 - data[3],)) + data[4:]
        super().write(data)


def test_a_motor_that_runs_away_from_its_limit_is_stopped() -> None:
    report, timed = run_slowly(20_000, WrongWay, scaled=False)
    assert timed.longest <= LONGEST + LATE
    assert any(outcome.result is Result.FAIL for outcome in report.outcomes)


@pytest.mark.parametrize("name", ["TDC001", "MS2000"])
def test_the_bounds_are_announced(name: str) -> None:
    on = bench(name)
    moving = [check for check in plan_of(on).runnable if "motion" in check.needs]
    assert all(check.bound for check in moving if not check.id.startswith("loops"))
    lines = [*announcement("COM3", plan_of(on))]
    assert any(f"ends within {LONGEST:g} s" in line for line in lines)
