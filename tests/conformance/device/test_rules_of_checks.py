"""Every must of the documents is seen by a check, or says why none can see it; and the table of it."""

from __future__ import annotations

import subprocess
import sys
from collections import Counter
from dataclasses import replace
from pathlib import Path

import pytest

from checkout import ROOT
from stagewire.protocols import load_protocol
from stagewire_conformance.device.checks import kinds_of
from stagewire_conformance.device.declaration import declare, known_units
from stagewire_conformance.device.permissions import Permissions
from stagewire_conformance.device.plans import plan
from stagewire_conformance.device.rules_page import Coverage, coverage, page, unknown_rules
from stagewire_conformance.registry import about, registry_of

PROTOCOLS = ("thorlabs_apt", "asi_ms2000")
PROMISED = {"timing"}
"""Kinds that hold a controller to what its vendor promises in the PICS, and to no rule."""

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
    assert not wanting, f"musts without a check and without a waiver: {', '.join(wanting)}"


def test_no_rule_has_a_check_and_a_waiver(rows: tuple[Coverage, ...]) -> None:
    both = [f"{row.rule} ({', '.join(row.checks)})" for row in rows if row.checks and row.waiver]
    assert not both, f"waived, though a check sees it: {', '.join(both)}"


def test_every_should_has_a_check_or_a_waiver(rows: tuple[Coverage, ...]) -> None:
    assert not [row.rule for row in rows if not row.checks and not row.waiver]


def test_every_rule_that_a_kind_names_is_one(protocol: str) -> None:
    assert not [f"{kind.name}: {rule}" for kind, rule in unknown_rules(load_protocol(protocol))]


def test_every_rule_that_a_kind_names_is_seen_by_a_check_of_it(
    protocol: str, rows: tuple[Coverage, ...]
) -> None:
    seen = {row.rule: row.checks for row in rows}
    idle = [
        f"{kind.name}: {rule}"
        for kind in kinds_of(load_protocol(protocol))
        for rule in kind.rules
        if kind.name not in seen.get(rule, ())
    ]
    assert not idle, f"named, and no check of the kind is about it: {', '.join(idle)}"


def test_every_kind_names_each_rule_once(protocol: str) -> None:
    for kind in kinds_of(load_protocol(protocol)):
        assert kind.rules or kind.name in PROMISED, f"{kind.name} holds a controller to nothing"
        twice = [rule for rule, number in Counter(kind.rules).items() if number > 1]
        assert not twice, f"{kind.name} names twice: {', '.join(twice)}"


def test_every_check_holds_to_a_rule_of_its_kind() -> None:
    for name in known_units():
        for check in plan(declare(name), Permissions()):
            assert check.kind is not None
            if check.kind.name in PROMISED:
                continue
            assert check.rules, f"{name}: {check.id} holds to no rule"
            beyond = set(check.rules) - set(check.kind.rules)
            assert not beyond, f"{name}: {check.id} holds to {beyond}, which its kind does not name"


def test_a_check_is_about_the_rules_of_its_messages() -> None:
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


def test_a_planned_check_has_the_rules_of_its_kind_that_concern_it() -> None:
    for name, bays in (("TDC001", False), ("BBD102", True)):
        checks = [
            each for each in plan(declare(name), Permissions()) if each.id.startswith("frames/")
        ]
        assert checks
        for check in checks:
            assert ("slot-source" in check.rules) is bays
            assert ("generic-unit-address" in check.rules) is not bays


def test_what_is_wrong_with_a_rule(rows: tuple[Coverage, ...]) -> None:
    checked = replace(rows[0], strength="must", checks=("answers",), waiver="")
    assert checked.problem == ""
    assert replace(checked, waiver="Not seen.").problem == "has a check and a waiver"
    assert replace(checked, checks=()).problem == "has neither a check nor a waiver"
    assert replace(checked, checks=(), waiver="Not seen.").problem == ""
    assert replace(checked, checks=(), strength="should").problem == ""


def test_the_page_is_what_the_rules_and_the_checks_give() -> None:
    """If it fails: ``python -m stagewire_conformance.device.rules_page`` and the path of the page."""
    there = PAGE.read_text(encoding="utf-8").split("\n")
    drifted = [line for line in page().split("\n") if line not in there]
    assert not drifted[:3]
    assert len(there) == len(page().split("\n"))


def test_the_page_is_made_by_a_command(tmp_path: Path) -> None:
    made = tmp_path / "page.md"
    module = "stagewire_conformance.device.rules_page"
    subprocess.run([sys.executable, "-m", module, str(made)], check=True)
    assert made.read_bytes() == PAGE.read_bytes()
