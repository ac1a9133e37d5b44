"""Every defect of firmware is found, and named, by the check that is there for it.

Each defect is drawn by seed over units and messages. A run has the kinds of checks that have to find it, and
of some defects the whole suite; STAGEWIRE_FIRMWARE=9 draws each nine times, and runs all of it.
"""

from __future__ import annotations

import os
from collections.abc import Iterator

import pytest
from faulty_commands import COMMANDS
from faulty_identity import IDENTITY
from faulty_moves import MOVES
from faulty_outputs import OUTPUTS
from faulty_reception import RECEPTION
from faulty_replies import REPLIES
from faulty_settings import SETTINGS
from faulty_status import STATUS
from faulty_storage import STORAGE
from faulty_updates import UPDATES
from firmware_bench import bench
from firmware_commands import CommandDefect, FaultyCommandLink
from firmware_defects import Defect
from firmware_line import FaultyLink

from stagewire_conformance.device.report import Outcome, Report
from stagewire_conformance.device.results import Result

SEEDS = int(os.environ.get("STAGEWIRE_FIRMWARE", "0"))
WHOLE = 4  # of so many defects one has the whole suite run
DEFECTS = (
    *REPLIES, *SETTINGS, *STORAGE, *STATUS, *UPDATES, *IDENTITY, *RECEPTION, *MOVES, *OUTPUTS
)  # fmt: skip
APT = [(defect, seed) for seed in range(SEEDS or 1) for defect in DEFECTS]
MS2000 = [(defect, seed) for seed in range(SEEDS or 1) for defect in COMMANDS]


def named(case: tuple[Defect | CommandDefect, int]) -> str:
    return f"{case[0].name}, {case[1]}".replace(" ", "-")


def kinds_of(defect: Defect | CommandDefect) -> frozenset[str]:
    """Return the kinds of checks that are run; none for all of them."""
    if SEEDS or [*DEFECTS, *COMMANDS].index(defect) % WHOLE == 0:
        return frozenset()
    return defect.found_by | {"home"}  # by which a motor knows where it is


def findings(report: Report, *results: Result) -> Iterator[Outcome]:
    return (outcome for outcome in report.outcomes if outcome.result in results)


def names(outcome: Outcome, message: str) -> bool:
    """Whether a check says which message is wrong."""
    said = any(message in finding.text for finding in outcome.findings)
    return said or message in outcome.check.messages


def judge(defect: Defect | CommandDefect, about: str, report: Report) -> None:
    assert not report.unfinished, report.unfinished
    found = {
        outcome.check.id: [finding.text for finding in outcome.findings]
        for outcome in findings(report, Result.FAIL, Result.NON_STRICT)
    }
    right = [
        outcome
        for outcome in findings(report, defect.result)
        if outcome.kind.name in defect.found_by and names(outcome, about)
    ]
    assert right, found
    if defect.result is Result.NON_STRICT:
        assert not list(findings(report, Result.FAIL)), found


def test_there_are_enough_defects() -> None:
    every = [defect.name for defect in (*DEFECTS, *COMMANDS)]
    assert len(every) >= 200
    assert len({defect.name for defect in DEFECTS}) == len(DEFECTS)
    assert len({defect.name for defect in COMMANDS}) == len(COMMANDS)


@pytest.mark.parametrize("case", APT, ids=named)
def test_defect_is_found(case: tuple[Defect, int]) -> None:
    defect, seed = case
    drawn = defect.draw(seed)
    unit = bench(drawn.unit)
    link = FaultyLink(unit.line(seed), drawn.firmware, unit.status)
    judge(defect, drawn.about, unit.run(link, kinds_of(defect), seed))


@pytest.mark.parametrize("case", MS2000, ids=named)
def test_defect_of_an_ms2000_is_found(case: tuple[CommandDefect, int]) -> None:
    defect, seed = case
    name, firmware, about = defect.draw(seed)
    unit = bench(name)
    link = FaultyCommandLink(unit.line(seed), firmware)
    judge(defect, about, unit.run(link, kinds_of(defect), seed))
