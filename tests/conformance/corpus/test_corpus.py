"""The second corpus: firmware written from the documents alone, without and with planted faults.

A correct controller passes on the stepped clock and in real time. The TDC001 takes the units of page 30
literally. It also passes with a stage whose scale of velocities is from a later issue, and stays within the
range.
"""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from corpus_benches import BENCHES, CorpusBench
from corpus_faults_tdc001_motion import FAULTS
from corpus_lines import Maker, RealTimeCorpusLink, SteppedCorpusLink
from corpus_motion import Path, Piece
from corpus_motor import MotorController
from corpus_tdc001 import Tdc001

from parts import PROOF, first_of
from stagewire_conformance.device.permissions import Need
from stagewire_conformance.device.pics import ChannelPics
from stagewire_conformance.device.report import Report
from stagewire_conformance.device.results import Result
from stagewire_conformance.device.run import run

REAL_TIME = pytest.param(RealTimeCorpusLink, id="real-time", marks=PROOF)
WRONG = (Result.FAIL, Result.NON_STRICT)


def findings(report: Report) -> dict[str, list[str]]:
    """Return what a report finds wrong, by check."""
    assert report.defect is None, report.defect
    assert not report.unfinished, report.unfinished
    return {
        outcome.check.id: [finding.text for finding in outcome.findings]
        for outcome in report.outcomes
        if outcome.result in WRONG
    }


@pytest.mark.parametrize("line", [pytest.param(SteppedCorpusLink, id="stepped"), REAL_TIME])
@pytest.mark.parametrize("name", BENCHES)
def test_a_correct_controller_passes(name: str, line: type) -> None:
    report = BENCHES[name].run(line=line)
    assert not findings(report)
    results = [outcome.result for outcome in report.outcomes]
    assert results.count(Result.PASS) >= 0.95 * len(results)


class SettlesFirst(Tdc001):
    """Reports the end of a motion 150 ms after the motor has come to rest."""

    def go(self, motion: str, path: Path) -> None:
        if path.pieces and not math.isinf(path.end):
            path = Path((*path.pieces, Piece(path.end, 0.15, path.rest, 0, 0)), path.rest)
        super().go(motion, path)


def test_a_controller_that_reports_the_end_of_a_motion_later_passes() -> None:
    assert not findings(BENCHES["tdc001"].run(SettlesFirst))


class WatchedLine(SteppedCorpusLink):
    """A line that records the position of the motor."""

    def __init__(self, make: Maker) -> None:
        super().__init__(make)
        self.positions: list[int] = []

    def read(self, timeout: float) -> bytes:
        data = super().read(timeout)
        assert isinstance(self.firmware, MotorController)
        self.positions.append(self.firmware.position())
        return data


def on_stage(stage: str, motion: str = "-10291..171520counts") -> CorpusBench:
    """Return the TDC001 with a stage whose scale of velocities the document does not have."""
    on = BENCHES["tdc001"]
    travel = on.pics.channels[0].travel
    channel = ChannelPics(number=1, stage=stage, travel=travel)
    return replace(on, pics=replace(on.pics, channels=(channel,)), motion=motion)


STAGES = ("Z812", "Z825")


@pytest.mark.parametrize("stage", first_of(STAGES))
def test_a_controller_with_the_printed_unit_of_velocities_passes(stage: str) -> None:
    assert not findings(on_stage(stage).run())


@pytest.mark.parametrize("high", first_of((3000, 171_520)))
def test_a_controller_with_the_printed_unit_of_velocities_stays_in_the_range(high: int) -> None:
    on = on_stage("Z812", f"-3000..{high}counts")
    line = WatchedLine(on.make)
    moving = [check for check in on.checks if Need.MOTION in check.needs]
    checks = [check for check in moving if not check.id.startswith("home")]
    report = run(line, checks, on.declared, on.allowed, 1)
    assert not findings(report)
    assert -3000 <= min(line.positions) < max(line.positions) <= high


@pytest.mark.parametrize(
    "fault", ["CapIgnoredByAbsoluteMoves", "CapOfTheFactory", "JogAtMoveVelocity"]
)
def test_wrong_speeds_are_found_without_a_scale_from_the_document(fault: str) -> None:
    [make] = [each.make for each in FAULTS if each.name == fault]
    assert findings(on_stage("Z812").run(make))
