"""Every defect of firmware is found and named by the right check.

Defects are spread over units and messages by seed. `make test` runs the kinds of checks that must find a
defect; `make test-all` also runs the whole suite on some of them. STAGEWIRE_FIRMWARE=9 uses nine seeds for
each defect, and always runs the whole suite.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from typing import Any

import pytest
from firmware_bench import bench
from firmware_commands import CommandDefect, FaultyCommandLink
from firmware_corpus import COMMANDS, DEFECTS
from firmware_defects import Defect
from firmware_line import FaultyLink

from stagewire_conformance.device.report import Outcome, Report
from stagewire_conformance.device.results import Result

SEEDS = int(os.environ.get("STAGEWIRE_FIRMWARE", "0"))
WHOLE = 4  # the whole suite runs on one in this many defects


def runs(defects: Sequence[Defect | CommandDefect]) -> Iterator[Any]:
    """Yield each run: the defect, its seed, and whether the whole suite runs."""
    for seed in range(SEEDS or 1):
        for number, defect in enumerate(defects):
            name = f"{defect.name}, {seed}".replace(" ", "-")
            if not SEEDS:
                yield pytest.param(defect, seed, False, id=name)
            if SEEDS or number % WHOLE == 0:
                whole = f"{name}-whole-suite"
                yield pytest.param(defect, seed, True, id=whole, marks=pytest.mark.matrix)


def kinds_of(defect: Defect | CommandDefect, whole: bool) -> frozenset[str]:
    """Return the kinds of checks to run; empty for all."""
    if whole:
        return frozenset()
    before = {"home"}  # a motor needs its position
    if "move-stored" in defect.found_by:
        before |= {"move-absolute", "move-relative"}  # these may set the target
    return defect.found_by | before


def findings(report: Report, *results: Result) -> Iterator[Outcome]:
    return (outcome for outcome in report.outcomes if outcome.result in results)


def names(outcome: Outcome, message: str) -> bool:
    """Return whether a check names the message with the defect."""
    said = any(message in finding.text for finding in outcome.findings)
    return said or message in outcome.check.messages


def judge(defect: Defect | CommandDefect, about: str, report: Report) -> None:
    """Require a finding by one of the right kinds, or by a check that one of them refers to."""
    assert report.unfinished == defect.ends
    if (
        defect.result is Result.NOT_RUN
    ):  # its checks are left out, and the report begins with the reason
        left_out = [check for check, why in report.not_run if " was on when " in why]
        assert any(check.kind and check.kind.name in defect.found_by for check in left_out)
        return
    found = {
        outcome.check.id: [finding.text for finding in outcome.findings]
        for outcome in findings(report, Result.FAIL, Result.NON_STRICT, Result.FRAGILE)
    }
    met = {
        id
        for outcome in findings(report, Result.NOT_RUN)
        if outcome.kind.name in defect.found_by
        for id in outcome.met
    }
    right = [
        outcome
        for outcome in findings(report, defect.result)
        if (outcome.kind.name in defect.found_by or outcome.check.id in met)
        and names(outcome, about)
    ]
    assert right, found
    if defect.result is not Result.FAIL:
        assert not list(findings(report, Result.FAIL)), found


def test_there_are_enough_defects() -> None:
    every = [defect.name for defect in (*DEFECTS, *COMMANDS)]
    assert len(every) >= 200
    assert len({defect.name for defect in DEFECTS}) == len(DEFECTS)
    assert len({defect.name for defect in COMMANDS}) == len(COMMANDS)


@pytest.mark.parametrize(("defect", "seed", "whole"), list(runs(DEFECTS)))
def test_a_defect_is_found(defect: Defect, seed: int, whole: bool) -> None:
    drawn = defect.draw(seed)
    unit = bench(drawn.unit)
    link = FaultyLink(unit.line(seed), drawn.firmware, unit.status)
    judge(defect, drawn.about, unit.run(link, kinds_of(defect, whole), seed))


@pytest.mark.parametrize(("defect", "seed", "whole"), list(runs(COMMANDS)))
def test_a_defect_of_an_ms2000_is_found(defect: CommandDefect, seed: int, whole: bool) -> None:
    name, firmware, about = defect.draw(seed)
    unit = bench(name)
    link = FaultyCommandLink(unit.line(seed), firmware)
    judge(defect, about, unit.run(link, kinds_of(defect, whole), seed))


@pytest.mark.parametrize(
    "name",
    [
        "The end of a move of a drive is never reported",
        "The end of a move counts channels from 1 to 4",
        "The end of a move of a drive is reported when it begins",
    ],
)
def test_the_time_of_a_motion_is_judged_only_if_its_end_is_right(name: str) -> None:
    [defect] = (each for each in DEFECTS if each.name == name)
    drawn = defect.draw(0)
    unit = bench(drawn.unit)
    link = FaultyLink(unit.line(0), drawn.firmware, unit.status)
    report = unit.run(link, frozenset({"actuator-move", "actuator-jog"}), 0)
    texts = [finding.text for outcome in report.outcomes for finding in outcome.findings]
    assert any("PZMOT_MOVE_COMPLETED" in text for text in texts)
    assert not [text for text in texts if "should take" in text]
