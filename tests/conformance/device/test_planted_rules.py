"""Planted faults break the rules that checks declare, and a finding names each rule.

A declared rule that no finding ever names would make a report look more complete than the run was.
"""

from __future__ import annotations

from collections import Counter

import pytest
from apt_runs import bench, faulty_link, run_on
from broken_apt import broken
from broken_apt_changing import MOTION, OUTPUTS, SETTINGS, name
from faulty_apt_link import Change, FaultyAptLink, LinkFault, dropped, of
from faulty_ms2000_link import answers
from ms2000_defects import ACK
from ms2000_runs import WIDE, controller_of, declared_with, run_suite
from test_ms2000_defects import ALL

from parts import every_nth
from planted_faults import FAULTS, WITHOUT, cases_of, rules_named
from stagewire.protocols import load_protocol
from stagewire_apt import PROTOCOL
from stagewire_conformance.device.permissions import Permissions
from stagewire_conformance.device.plans import plan
from stagewire_conformance.device.rules_page import coverage
from stagewire_ms2000 import messages

CHANGING = {name(each): each for each in (*SETTINGS, *OUTPUTS, *MOTION)}


def with_value(field: str, value: int) -> Change:
    """Replace the value of a field, even by one that the document does not define."""

    def change(raw: bytes) -> bytes:
        frame = PROTOCOL.decode(raw)
        values = frame.message.values()
        if field not in values:
            return raw
        made = type(frame.message).keep({**values, field: value})
        return bytes(made.pack(frame.dest, frame.source))

    return change


def test_every_declared_rule_is_broken_by_a_planted_fault_or_listed_with_a_reason() -> None:
    declared = {
        row.rule
        for protocol in ("thorlabs_apt", "asi_ms2000")
        for row in coverage(load_protocol(protocol))
        if row.checks
    }
    groups = [FAULTS[group] for group in FAULTS if group != WITHOUT]
    listed = Counter(rule for group in groups for rule in group)
    for group in FAULTS[WITHOUT]:
        assert group["reason"].endswith(".")
        listed.update(group["rules"])
    assert not declared - listed.keys(), "neither broken nor listed"
    assert not listed.keys() - declared, "no check declares these rules"
    assert not [rule for rule, count in listed.items() if count > 1], "listed twice"


@pytest.mark.parametrize(("rule", "fault"), every_nth(cases_of("replies"), 8))
def test_an_undocumented_value_breaks_the_rule(rule: str, fault: tuple[str, str, str, int]) -> None:
    unit, message, field, value = fault
    on = bench(unit)
    link = faulty_link(on, LinkFault(to_host=of(message, with_value(field, value))))
    kinds = ("answers", "bays")
    assert rule in rules_named(run_on(on, kinds, link=link, allowed=Permissions()))


@pytest.mark.parametrize(("rule", "fault"), every_nth(cases_of("ignored"), 8))
def test_an_ignored_message_breaks_the_rule(rule: str, fault: tuple[str, str]) -> None:
    unit, message = fault
    on = bench(unit)
    checks = [check.id for check in plan(on.declared, on.allowed()) if message in check.messages]
    link = faulty_link(on, LinkFault(to_controller=of(message, dropped)))
    assert rule in rules_named(run_on(on, checks, link=link))


@pytest.mark.parametrize(("rule", "title"), every_nth(cases_of("requests"), 4))
def test_a_defect_that_requests_find_breaks_the_rule(rule: str, title: str) -> None:
    defect = broken()[title]
    on = bench(defect.unit)
    link = FaultyAptLink(on.link, defect.spoil)
    allowed = Permissions(settings=True)
    assert rule in rules_named(run_on(on, (defect.where,), link=link, allowed=allowed))


@pytest.mark.parametrize(("rule", "title"), every_nth(cases_of("changing"), 4))
def test_a_defect_in_what_is_set_or_moved_breaks_the_rule(rule: str, title: str) -> None:
    defect = CHANGING[title]
    on = defect.bench()
    report = run_on(on, (defect.kind,), link=faulty_link(on, defect.make()))
    assert rule in rules_named(report)


@pytest.mark.parametrize(("rule", "title"), every_nth(cases_of("ms2000"), 4))
def test_a_defect_of_an_ms2000_breaks_the_rule(rule: str, title: str) -> None:
    defect = ALL[title]
    controller = controller_of(strategies=defect.strategies, travel=100_000, position=50_000)
    link = defect.make(controller)
    report = run_suite(link, declared_with(**defect.pics), WIDE, [defect.check])
    assert rule in rules_named(report)


@pytest.mark.parametrize(("rule", "fault"), every_nth(cases_of("answered"), 3))
def test_an_answered_command_breaks_the_rule(rule: str, fault: tuple[str, str]) -> None:
    command, check = fault
    answered = answers(lambda raw, _: ACK, getattr(messages, command))
    link = answered(controller_of(travel=100_000, position=50_000))
    assert rule in rules_named(run_suite(link, declared_with(), WIDE, [check]))
