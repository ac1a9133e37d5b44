"""With ``witness: complete``, every fact needs a statement, a decision or another chapter."""

from __future__ import annotations

import textwrap
from types import SimpleNamespace
from typing import Any

from stagewire_generator.diagnostics import Diagnostics
from stagewire_generator.lint.witness.statements import Facts, check_witnesses
from stagewire_generator.strict_yaml import parse

REGISTRY = """
units:
  A1: {title: first unit, page: 3, channels: 1, stages: [X]}
  A2: {title: second unit, page: 3, channels: 2, reported_as: {B2: a driver}}
aliases:
  A3: {title: third unit, source: another document}
stages:
  X: {limits: {travel: {unknown: no page gives it}}}
flags:
  bits: {bits: {moving: {bit: 0}}}
formats: {word: {size: 2}}
"""
STATED = [
    "units/A1|A2/channels",
    "units/A1/stages",
    "units/A2/reported_as",
    "aliases",
    "stages/X/limits/travel",
]
BIT = "flags/bits/bits/moving/bit"


def errors(stated: list[str], *tables: str, registry: str = REGISTRY) -> list[str]:
    """Return the errors of patterns, and of facts that neither they nor tables contain."""
    diagnostics = Diagnostics()
    document = parse(textwrap.dedent(registry), "units.yaml", diagnostics)
    assert document is not None
    protocol: Any = SimpleNamespace(messages=())
    facts = Facts(protocol, {"units": [document]})
    for pattern in stated:
        list(facts.at(pattern, document, (), diagnostics))
    check_witnesses(facts, tables, diagnostics)
    return [found.message for found in diagnostics.found]


def test_a_statement_or_a_table_is_a_second_witness() -> None:
    assert errors([*STATED, BIT]) == []
    assert errors(STATED, "flags/*/bits/*/bit") == []
    assert errors([*STATED, "flags/*/bits/*/bit"]) == []


def test_each_fact_needs_one() -> None:
    assert errors(STATED) == [f"{BIT} has no second witness"]
    assert errors([]) == [
        f"{fact} has no second witness"
        for fact in ("units/A1/channels", "units/A1/stages", "units/A2/channels",
                     "units/A2/reported_as/B2", "aliases/A3", "stages/X/limits/travel", BIT)
    ]  # fmt: skip


def test_a_mapping_is_a_witness_of_its_keys_only() -> None:
    assert errors(["units", *STATED, BIT]) == []
    assert f"{BIT} has no second witness" in errors(["flags", *STATED])


def test_an_added_key_or_entry_needs_one() -> None:
    added = REGISTRY.replace("bit: 0}", "bit: 0, motion: true}")
    assert errors([*STATED, BIT], registry=added) == [
        "flags/bits/bits/moving/motion has no second witness"
    ]
    orphan = f"{REGISTRY}enumerations:\n  modes: {{values: {{FAST: {{value: 1}}}}}}\n"
    assert errors([*STATED, BIT], registry=orphan) == [
        "enumerations/modes/values/FAST/value has no second witness"
    ]


def test_an_entry_named_in_full_has_each_part() -> None:
    pattern = "units/A1|A2/reported_as/B2"
    lacks = f"{pattern}: the registry has nothing that units/A1/reported_as names"
    assert errors([*STATED, BIT, pattern]) == [lacks]
    assert errors([*STATED, BIT, "units/*/reported_as/B2"]) == []
