"""Faults of the second corpus break rules of checks, and a finding names each."""

from __future__ import annotations

import pytest
from corpus_benches import BENCHES
from corpus_firmware import EVERY

from parts import every_nth
from planted_faults import cases_of, rules_named

FAULTS = {
    (rule, fault.name): (BENCHES[name], fault) for name, fault in EVERY for rule in fault.rules
}


@pytest.mark.parametrize(("rule", "name"), every_nth(cases_of("corpus"), 30))
def test_a_planted_fault_breaks_the_rule(rule: str, name: str) -> None:
    bench, fault = FAULTS[rule, name]
    assert rule in rules_named(bench.run(fault.make))
