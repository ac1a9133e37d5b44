"""``stagewire conformance examples``: a table, a summary, and exit code 1 if an example fails."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import TYPE_CHECKING

import pytest

from stagewire.protocols import Protocol, available_protocols, load_protocol
from stagewire_cli.conformance import documents
from stagewire_conformance import Verdict

if TYPE_CHECKING:
    from conftest import Stagewire


def verdict(outcome: str) -> Verdict:
    return Verdict("a-slug", 30, 1135, "tx", "MOT_X", "A title", "reproduced", outcome, "why\x1b")


@pytest.mark.parametrize("name", available_protocols())
def test_all_examples_of_a_protocol_pass(stagewire: Stagewire, name: str) -> None:
    vectors = load_protocol(name).vectors()
    result = stagewire("conformance", "examples", "--protocol", name)
    failed = [line for line in result.out.splitlines() if " failed  " in line]
    assert failed == []
    assert result.code == 0
    summary = result.out.splitlines()[-1]
    assert summary.startswith(f"{name}: {len(vectors['examples'])} examples and ")
    assert " 0 failed, " in summary
    for example in vectors["examples"]:
        assert f"{example['id']} " in result.out


def test_all_protocols_run_by_default(stagewire: Stagewire) -> None:
    result = stagewire("conformance", "examples")
    assert result.code == 0
    for name in available_protocols():
        own = stagewire("conformance", "examples", "--protocol", name)
        assert own.out.splitlines()[-1] in result.out.splitlines()


def test_json(stagewire: Stagewire) -> None:
    result = stagewire("conformance", "examples", "--json")
    rows = [json.loads(line) for line in result.out.splitlines()]
    assert {"protocol", "id", "page", "line", "kind", "expected", "outcome", "detail"} <= set(
        rows[0]
    )


@pytest.mark.parametrize("name", available_protocols())
def test_coverage_counts_the_examples_of_each_message(stagewire: Stagewire, name: str) -> None:
    protocol = load_protocol(name)
    asked = ("conformance", "examples", "--coverage", "--protocol", name)
    rows = [json.loads(line) for line in stagewire(*asked, "--json").out.splitlines()]
    names = {entry["name"] for entry in protocol.registry()["messages"]}
    assert {row["message"] for row in rows} == names
    examples = [e for e in protocol.vectors()["examples"] if e.get("message") in names]
    assert sum(row["examples"] for row in rows) == len(examples)
    text = stagewire(*asked)
    assert text.code == 0
    assert f" of {len(rows)} messages have worked examples" in text.out


@pytest.mark.parametrize(("found", "code"), [(["passed"], 0), (["passed", "failed"], 1), ([], 1)])
def test_a_failed_example_sets_the_exit_code(
    stagewire: Stagewire, monkeypatch: pytest.MonkeyPatch, found: list[str], code: int
) -> None:
    def run(_: Protocol) -> list[Verdict]:
        return [verdict(outcome) for outcome in found]

    monkeypatch.setattr(documents, "run", run)
    result = stagewire("conformance", "examples")
    assert result.code == code
    assert "\x1b" not in result.out


def test_summary_prints_one_line_per_protocol(stagewire: Stagewire) -> None:
    result = stagewire("conformance", "examples", "--summary")
    assert result.code == 0
    lines = result.out.splitlines()
    assert [line.split(":")[0] for line in lines] == list(available_protocols())
    table = stagewire("conformance", "examples").out.splitlines()
    assert [line for line in table if " noted (prose" in line] == lines


@pytest.mark.parametrize("options", [(), ("--summary",)], ids=["table", "summary"])
def test_a_failure_is_shown_in_full(
    stagewire: Stagewire, monkeypatch: pytest.MonkeyPatch, options: tuple[str, ...]
) -> None:
    def run(_: Protocol) -> list[Verdict]:
        return [verdict("passed"), replace(verdict("failed"), detail="first; second " * 50)]

    monkeypatch.setattr(documents, "run", run)
    result = stagewire("conformance", "examples", "--protocol", "asi_ms2000", *options)
    assert result.code == 1
    assert result.out.splitlines()[-3:-1] == [
        "failed: a-slug (page 30, tx, MOT_X): A title",
        f"  expected: reproduced; found: {'first; second ' * 50}",
    ]
    assert "1 passed, 1 failed" in result.out.splitlines()[-1]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--summary", "--json"], "--summary cannot be combined with --json or --coverage"),
        (["--summary", "--coverage"], "--summary cannot be combined with --json or --coverage"),
        (["--protocol", "nothing"], "no protocol nothing is installed"),
        (["extra"], "unexpected extra argument"),
        (["--cover"], "No such option"),
    ],
)
def test_wrong_arguments_are_refused(stagewire: Stagewire, arguments: list[str], said: str) -> None:
    result = stagewire("conformance", "examples", *arguments)
    assert result.code == 2
    assert said in result.err
