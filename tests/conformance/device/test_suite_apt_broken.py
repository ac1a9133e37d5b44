"""Defective Thorlabs APT controllers that set or move something wrongly fail a check of the right kind."""

from __future__ import annotations

from dataclasses import replace

import pytest
from apt_runs import complaints, faulty_link, run_on
from broken_apt_changing import MOTION, OUTPUTS, SETTINGS, Broken, name
from declared_rules import wrongly_named
from faulty_apt_link import LinkFault


@pytest.mark.parametrize("broken", [*SETTINGS, *OUTPUTS, *MOTION], ids=name)
def test_the_right_kind_finds_and_names_the_defect(broken: Broken) -> None:
    on = broken.bench()
    spoil = broken.make()
    report = run_on(on, (broken.kind,), link=faulty_link(on, spoil))
    found = complaints(report)
    text = "\n".join(found.values())
    for words in broken.words:
        assert words in text
    grave = "FAIL: " in text
    assert grave is broken.strict, text
    assert not wrongly_named("thorlabs_apt", report.outcomes)


STILL = [
    each
    for each in MOTION
    if "MOT_MOVE_STOP" not in each.words  # an ignored stop stops nothing
]


@pytest.mark.parametrize("broken", STILL, ids=name)
def test_a_failing_check_leaves_nothing_moving(broken: Broken) -> None:
    on = broken.bench()
    run_on(on, (broken.kind,), link=faulty_link(on, broken.make()))
    on.link.read(0.2)
    for place in on.declared.places:
        for channel in place.channels:
            motor = on.behaviour(channel, place.bay)
            assert not motor.status()["status_bits"] & 0x2F0


def test_without_a_fault_the_kinds_find_nothing() -> None:
    """Run the same kinds without a fault, to show that only the fault is found."""
    seen = set()
    for broken in (*SETTINGS, *OUTPUTS, *MOTION):
        run = broken.kind, broken.unit, broken.stage, broken.homed, broken.before
        if run not in seen:
            seen.add(run)
            on = replace(broken, options={}).bench()
            report = run_on(on, (broken.kind,), link=faulty_link(on, LinkFault()))
            assert not complaints(report), broken.kind
