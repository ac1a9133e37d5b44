"""``stagewire conformance rules``: all rules with their checks, and exit code 1 for a must without one."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import pytest

from stagewire.protocols import load_protocol
from stagewire_conformance.device import rules_page
from stagewire_conformance.device.rules_page import Coverage

if TYPE_CHECKING:
    from conftest import Stagewire

PROTOCOLS = ("thorlabs_apt", "asi_ms2000")
KEYS = {"protocol", "rule", "where", "strength", "subject", "states", "checks", "waiver"}


def row(**changes: object) -> Coverage:
    known = {
        "rule": "a-rule", "where": "page 9", "strength": "must", "subject": "controller",
        "states": "It must.", "checks": ("answers",), "waiver": "",
    }  # fmt: skip
    return Coverage(**{**known, **changes})  # type: ignore[arg-type]


def test_each_rule_is_cited_with_a_page_that_its_document_has() -> None:
    """Rules of Issue 37 have pages after the last one of Issue 3."""
    document = load_protocol("thorlabs_apt").registry()["document"]
    later = [overlay["document"] for overlay in document["overlays"]]
    last = {each["name"]: each["pages"] for each in (document, *later) if "pages" in each}
    where = {each.rule: each.where for each in rules_page.coverage(load_protocol("thorlabs_apt"))}
    for cited in where.values():
        name, _, page = cited.partition(", page ")
        assert 0 < int(page) <= last[name]
    assert where["flipper-parameters"] == "Issue 37, page 182"
    assert where["limit-bits-direction"] == "Issue 37, page 126"
    assert where["header-six-bytes"] == "Issue 3, page 8"


@pytest.fixture
def only(monkeypatch: pytest.MonkeyPatch) -> list[Coverage]:
    """Return an empty list that replaces all rules, to be filled by a test."""
    rows: list[Coverage] = []
    monkeypatch.setattr(rules_page, "coverage", lambda protocol: tuple(rows))
    return rows


@pytest.mark.parametrize("name", PROTOCOLS)
def test_all_rules_are_listed(stagewire: Stagewire, name: str) -> None:
    result = stagewire("conformance", "rules", "--protocol", name)
    entries = load_protocol(name).registry()["rules"]
    for entry in entries:
        assert f"{entry['id']} " in result.out
    assert result.code == 0
    summary = result.out.splitlines()[-1]
    assert summary.startswith(f"{name}: {len(entries)} rules, ")
    assert summary.endswith(" 0 have neither")


@pytest.mark.parametrize("name", PROTOCOLS)
def test_json(stagewire: Stagewire, name: str) -> None:
    result = stagewire("conformance", "rules", "--protocol", name, "--json")
    listed = [json.loads(line) for line in result.out.splitlines()]
    assert {row["rule"] for row in listed} == {
        entry["id"] for entry in load_protocol(name).registry()["rules"]
    }
    assert set(listed[0]) >= KEYS


def test_a_table_shows_checks_or_waivers(stagewire: Stagewire, only: list[Coverage]) -> None:
    only += [
        row(),
        row(rule="waived", checks=(), waiver="Not seen."),
        row(rule="advice", strength="should"),
    ]
    result = stagewire("conformance", "rules", "--protocol", "thorlabs_apt")
    assert result.code == 0
    assert "a-rule" in result.out
    assert "answers" in result.out
    assert "Not seen." in result.out
    assert result.out.endswith(
        "thorlabs_apt: 3 rules, 2 of them musts: 1 have checks, 1 have waivers, 0 have neither\n"
    )


@pytest.mark.parametrize(
    ("broken", "says"),
    [
        (row(checks=()), "a-rule has neither a check nor a waiver"),
        (row(waiver="Not seen."), "a-rule has a check and a waiver"),
    ],
)
def test_a_must_without_its_check_fails(
    stagewire: Stagewire, only: list[Coverage], broken: Coverage, says: str
) -> None:
    only.append(broken)
    for form in ((), ("--json",)):
        result = stagewire("conformance", "rules", "--protocol", "thorlabs_apt", *form)
        assert result.code == 1
    result = stagewire("conformance", "rules", "--protocol", "thorlabs_apt")
    assert f"thorlabs_apt: {says}" in result.out.splitlines()


def test_a_protocol_may_have_no_rules(stagewire: Stagewire, only: list[Coverage]) -> None:
    result = stagewire("conformance", "rules", "--protocol", "thorlabs_apt")
    assert (result.code, result.out) == (0, "thorlabs_apt: the registry has no rules\n")


def test_an_unknown_protocol_is_refused(stagewire: Stagewire) -> None:
    result = stagewire("conformance", "rules", "--protocol", "nothing")
    assert result.code == 2
    assert "nothing" in result.err
