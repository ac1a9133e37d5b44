"""Mutation tests of the registry: the document contradicts wrong layouts, and each erratum is needed."""

from __future__ import annotations

from dataclasses import replace

import pytest
from mutants import PROTOCOLS, Mutant, proof_of

from stagewire_generator.diagnostics import Diagnostics
from stagewire_generator.lint import errata
from stagewire_generator.lint.witness.witness import compare_witness

# Fields without a format in any table or example; see `python tests/mutation/mutants.py`.
UNSEEN = ("not_used", "reserved", "future_use")
UNDETECTED = {
    # Page 76: the field table of the stage parameters begins with Stage ID.
    "thorlabs_apt": ["MOT_SET_PMDSTAGEAXISPARAMS (data): re-signed chan_ident"],
    # Sections 11 and 22: the document prints only the sizes of the dummies.
    "asi_ms2000": [
        "WRITE_START_SPEED (request): re-signed start_speed",
        "READ_START_SPEED (reply): re-signed start_speed",
    ],
}
AT_MOST = {"thorlabs_apt": 25, "asi_ms2000": 2}

every_protocol = pytest.mark.parametrize("name", PROTOCOLS)


@every_protocol
def test_only_mutants_that_the_document_cannot_contradict_survive(name: str) -> None:
    proof = proof_of(name)
    survivors = [mutant for mutant in proof.mutants() if not proof.found_by(mutant)]
    unexplained = [
        str(mutant)
        for mutant in survivors
        if not mutant.change.split(" ")[1].startswith(UNSEEN) or mutant.change.startswith("shifted")
    ]
    assert unexplained == UNDETECTED[name]
    assert 0 < len(survivors) <= AT_MOST[name]
    assert all(proof.reason(mutant) for mutant in survivors)


@every_protocol
def test_every_field_of_every_layout_is_mutated(name: str) -> None:
    """Mutants change every field of requests and replies."""
    proof = proof_of(name)
    tried = {message.name for mutant in proof.mutants() for message in mutant.messages}
    layouts = {m.name for m in proof.protocol.messages for x in m.layouts if x.fields}
    assert tried == layouts
    shifted = sum(mutant.change.startswith("shifted") for mutant in proof.mutants())
    assert shifted == len(
        {f.place for m in proof.protocol.messages for x in m.layouts for f in x.fields}
    )


@every_protocol
def test_the_unchanged_registry_is_not_contradicted(name: str) -> None:
    proof = proof_of(name)
    for message in proof.protocol.messages:
        assert not proof.found_by(Mutant((message,), "data", "nothing"))


@every_protocol
def test_every_erratum_is_needed(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without the erratum, its place, or the example that names it, is an error."""
    proof = proof_of(name)
    comparison = compare_witness(proof.protocol, proof.witness)
    monkeypatch.setattr(errata, "compare_witness", lambda *_: comparison)
    unnoticed = []
    tried = [erratum for erratum in proof.protocol.errata if erratum.kind != "cosmetic"]
    for erratum in tried:
        rest = tuple(e for e in proof.protocol.errata if e is not erratum)
        diagnostics = Diagnostics()
        errata.check_errata(replace(proof.protocol, errata=rest), proof.files, diagnostics)
        wanted = [*erratum.places, *erratum.not_compared, erratum.id]
        if not any(place in d.message for d in diagnostics for place in wanted):
            unnoticed.append(erratum.id)
    assert tried
    assert unnoticed == []


def test_all_errata_together_leave_no_diagnostic() -> None:
    for proof in map(proof_of, PROTOCOLS):
        diagnostics = Diagnostics()
        errata.check_errata(proof.protocol, proof.files, diagnostics)
        assert list(diagnostics) == []
