"""A controller with a defect fails the check of the broken rule, and is named there."""

from __future__ import annotations

import pytest
from broken_ms2000_errors import WRONG
from broken_ms2000_motion import MOTION
from broken_ms2000_reading import READING, STATUS
from broken_ms2000_settings import SETTINGS
from declared_rules import wrongly_named
from ms2000_defects import Defect
from ms2000_runs import WIDE, controller_of, declared_with, found, run_suite, state_of

from stagewire_conformance.device.results import Result

ALL = {
    f"{group}-{name}": defect
    for group, defects in (
        ("reading", READING),
        ("status", STATUS),
        ("wrong", WRONG),
        ("settings", SETTINGS),
        ("motion", MOTION),
    )
    for name, defect in defects.items()
}


@pytest.mark.parametrize("defect", ALL.values(), ids=ALL)
def test_a_defect_is_found_by_its_check(defect: Defect) -> None:
    controller = controller_of(strategies=defect.strategies, travel=100_000, position=50_000)
    before = state_of(controller)
    report = run_suite(defect.make(controller), declared_with(**defect.pics), WIDE, [defect.check])
    [(check, result, text)] = found(report, *Result)
    assert (check, result) == (defect.check, defect.result), text
    assert defect.says in text
    assert not wrongly_named("asi_ms2000", report.outcomes)
    controller.advance(5)
    assert state_of(controller) == before or "not restored" in text or defect.hides
