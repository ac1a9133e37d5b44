"""An erratum excuses one difference at a place, and no other."""

from __future__ import annotations

import random
from dataclasses import replace

import pytest
from facts_at_errata import Facts, passes
from mutants import PROTOCOLS, proof_of

from parts import PROOF
from stagewire_generator.diagnostics import Diagnostics
from stagewire_generator.lint import errata
from stagewire_generator.lint.witness.witness import compare_witness

AT_LEAST = {"thorlabs_apt": 390, "asi_ms2000": 30}
A_PART = 40

every_protocol = pytest.mark.parametrize("name", PROTOCOLS)
how_many = pytest.mark.parametrize(
    "number", [A_PART, pytest.param(0, marks=PROOF)], ids=["a part", "all"]
)


@how_many
@every_protocol
def test_a_wrong_value_at_a_place_of_an_erratum_is_an_error(name: str, number: int) -> None:
    proof = proof_of(name)
    facts = list(Facts(proof).all().values())
    assert len(facts) >= AT_LEAST[name]
    tried = random.Random(0).sample(facts, min(number, len(facts))) if number else facts
    assert [str(fact) for fact in tried if passes(proof, fact)] == []


@every_protocol
def test_a_changed_fact_is_restored(name: str) -> None:
    proof = proof_of(name)
    for fact in Facts(proof).all().values():
        before = fact.siblings
        with fact.wrong():
            during = fact.siblings
        after = fact.siblings
        assert before == after
        assert during != before


@every_protocol
@pytest.mark.parametrize("side", [0, 1], ids=["printed", "encoded"])
def test_an_erratum_that_states_another_text_is_an_error(
    name: str, side: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    proof = proof_of(name)
    comparison = compare_witness(proof.protocol, proof.witness)
    monkeypatch.setattr(errata, "compare_witness", lambda *_: comparison)
    others = []
    for erratum in proof.protocol.errata:
        stated = {at: list(sides) for at, sides in erratum.places.items()}
        for sides in stated.values():
            sides[side] += "x"
        places = {at: (printed, encoded) for at, (printed, encoded) in stated.items()}
        others.append(replace(erratum, places=places))
    diagnostics = Diagnostics()
    errata.check_errata(replace(proof.protocol, errata=tuple(others)), proof.files, diagnostics)
    refused = {d.message.partition(": ")[0] for d in diagnostics if d.code == "SW047"}
    assert refused == {place for erratum in proof.protocol.errata for place in erratum.places}
