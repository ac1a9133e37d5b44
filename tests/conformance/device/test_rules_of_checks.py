"""Every requirement of the documents has a check or a waiver, and is listed on the page of rules."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections import Counter
from dataclasses import replace
from pathlib import Path

import pytest
from declared_rules import unknown_common_rules

from checkout import ROOT
from stagewire.protocols import load_protocol
from stagewire_conformance.device.checks import kinds_of
from stagewire_conformance.device.declaration import declare, known_units
from stagewire_conformance.device.permissions import Permissions
from stagewire_conformance.device.plans import plan
from stagewire_conformance.device.rules_page import Coverage, coverage, page, unknown_rules
from stagewire_conformance.registry import about, registry_of
from stagewire_virtual.factory import simulated_units

PROTOCOLS = ("thorlabs_apt", "asi_ms2000")
PROMISED = {"timing"}
"""Kinds that test promises of the vendor in the PICS, and no rule."""

PAGE = ROOT / "docs" / "reference" / "conformance-rules.md"


@pytest.fixture(scope="module", params=PROTOCOLS)
def protocol(request: pytest.FixtureRequest) -> str:
    return request.param


@pytest.fixture(scope="module")
def rows(protocol: str) -> tuple[Coverage, ...]:
    return coverage(load_protocol(protocol))


def test_every_must_has_a_check_or_a_waiver(rows: tuple[Coverage, ...]) -> None:
    wanting = [
        row.rule for row in rows if row.strength == "must" and not row.checks and not row.waiver
    ]
    assert not wanting, f"musts with neither a check nor a waiver: {', '.join(wanting)}"


def test_no_rule_has_a_check_and_a_waiver(rows: tuple[Coverage, ...]) -> None:
    both = [f"{row.rule} ({', '.join(row.checks)})" for row in rows if row.checks and row.waiver]
    assert not both, f"waived, although a check covers it: {', '.join(both)}"


def test_every_should_has_a_check_or_a_waiver(rows: tuple[Coverage, ...]) -> None:
    assert not [row.rule for row in rows if not row.checks and not row.waiver]


def test_kinds_name_only_known_rules(protocol: str) -> None:
    assert not [f"{kind.name}: {rule}" for kind, rule in unknown_rules(load_protocol(protocol))]


def test_every_rule_of_a_kind_is_covered_by_one_of_its_checks(
    protocol: str, rows: tuple[Coverage, ...]
) -> None:
    seen = {row.rule: row.checks for row in rows}
    idle = [
        f"{kind.name}: {rule}"
        for kind in kinds_of(load_protocol(protocol))
        for rule in kind.rules
        if kind.name not in seen.get(rule, ())
    ]
    assert not idle, f"named, but covered by no check of the kind: {', '.join(idle)}"


def test_every_kind_names_each_rule_once(protocol: str) -> None:
    for kind in kinds_of(load_protocol(protocol)):
        without = kind.name in PROMISED or kind.robustness
        assert bool(kind.rules) is not without, f"{kind.name}: {len(kind.rules)} rules"
        twice = [rule for rule, number in Counter(kind.rules).items() if number > 1]
        assert not twice, f"{kind.name} names twice: {', '.join(twice)}"


def test_every_check_tests_a_rule_of_its_kind() -> None:
    for name in {*known_units()} & {*simulated_units()}:  # rules about the others have waivers
        for check in plan(declare(name), Permissions()):
            assert check.kind is not None
            if check.kind.name in PROMISED or check.kind.robustness:
                continue
            assert check.rules, f"{name}: {check.id} tests no rule"
            beyond = set(check.rules) - set(check.kind.rules)
            assert not beyond, f"{name}: {check.id} tests {beyond}, which its kind does not name"


def test_every_finding_names_a_rule() -> None:
    """A call without a rule is about a promise of the PICS, or about a change that could not be undone."""
    folder = ROOT / "conformance" / "stagewire_conformance" / "device" / "checks"
    calls = [
        f"{path.stem}: {ast.unparse(node)}"
        for path in sorted(folder.rglob("*.py"))
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Call)
        and isinstance(node.func, ast.Attribute)
        and node.func.attr in ("must", "should", "need")
        and all(word.arg != "rule" for word in node.keywords)
    ]
    assert not [call for call in calls if "not restored" not in call and "promises" not in call]


def test_common_rules_are_rules_of_the_protocol(protocol: str) -> None:
    assert not unknown_common_rules(protocol, registry_of(load_protocol(protocol)))


def test_a_check_tests_the_rules_of_its_messages() -> None:
    registry = registry_of(load_protocol("thorlabs_apt"))
    rules = ("little-endian", "jog-parameters", "velocity-parameters")
    assert about(registry, rules, ("MOT_SET_JOGPARAMS",)) == ("little-endian", "jog-parameters")
    assert about(registry, rules, ()) == rules
    assert about(registry, ("no-such-rule",), ("MOT_SET_JOGPARAMS",)) == ("no-such-rule",)


def test_rules_of_bays_concern_units_with_bays() -> None:
    registry = registry_of(load_protocol("thorlabs_apt"))
    rules = ("little-endian", "slot-source", "generic-unit-address")
    assert about(registry, rules, ()) == rules
    assert about(registry, rules, (), bays=True) == ("little-endian", "slot-source")
    assert about(registry, rules, (), bays=False) == ("little-endian", "generic-unit-address")


def test_a_planned_check_has_the_relevant_rules_of_its_kind() -> None:
    for name, bays in (("TDC001", False), ("BBD102", True)):
        checks = [
            each for each in plan(declare(name), Permissions()) if each.id.startswith("frames/")
        ]
        assert checks
        for check in checks:
            assert ("slot-source" in check.rules) is bays
            assert ("generic-unit-address" in check.rules) is not bays


def test_the_problem_of_a_rule(rows: tuple[Coverage, ...]) -> None:
    checked = replace(rows[0], strength="must", checks=("answers",), waiver="")
    assert checked.problem == ""
    assert replace(checked, waiver="Not seen.").problem == "has a check and a waiver"
    assert replace(checked, checks=()).problem == "has neither a check nor a waiver"
    assert replace(checked, checks=(), waiver="Not seen.").problem == ""
    assert replace(checked, checks=(), strength="should").problem == ""


def test_the_page_is_up_to_date() -> None:
    """To update it run ``python -m stagewire_conformance.device.rules_page`` with the path of the page."""
    there = PAGE.read_text(encoding="utf-8").split("\n")
    drifted = [line for line in page().split("\n") if line not in there]
    assert not drifted[:3]
    assert len(there) == len(page().split("\n"))


def test_a_command_writes_the_page(tmp_path: Path) -> None:
    made = tmp_path / "page.md"
    module = "stagewire_conformance.device.rules_page"
    subprocess.run([sys.executable, "-m", module, str(made)], check=True)
    assert made.read_bytes() == PAGE.read_bytes()
