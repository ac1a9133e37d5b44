"""The proof could fail: wrong layouts are contradicted, and no erratum can be left out unnoticed."""

from __future__ import annotations

from dataclasses import replace

import pytest
from mutants import PROTOCOLS, Mutant, Proof

from stagewire_generator.diagnostics import Diagnostics
from stagewire_generator.lint import errata
from stagewire_generator.lint.witness import compare_witness
from stagewire_generator.model import Erratum

PROOFS = {name: Proof(name) for name in PROTOCOLS}
COMPARISONS = {name: compare_witness(p.protocol, p.witness) for name, p in PROOFS.items()}

# Fields that no table of formats and no example shows; see `python tests/teeth/mutants.py`.
UNSEEN = ("not_used", "reserved", "future_use")
UNTOLD = {
    # Page 76: the field table of the stage parameters begins with Stage ID.
    "thorlabs_apt": ["MOT_SET_PMDSTAGEAXISPARAMS (data): re-signed chan_ident"],
    # Sections 11 and 22: of the dummies only the sizes are printed.
    "asi_ms2000": [
        "WRITE_START_SPEED (request): re-signed start_speed",
        "READ_START_SPEED (reply): re-signed start_speed",
    ],
}
AT_MOST = {"thorlabs_apt": 25, "asi_ms2000": 2}

every_protocol = pytest.mark.parametrize("name", PROTOCOLS)


@every_protocol
def test_only_what_the_document_does_not_tell_survives(name: str) -> None:
    proof = PROOFS[name]
    survivors = [mutant for mutant in proof.mutants() if not proof.found_by(mutant)]
    unexplained = [
        str(mutant)
        for mutant in survivors
        if not mutant.change.split(" ")[1].startswith(UNSEEN) or mutant.change.startswith("shifted")
    ]
    assert unexplained == UNTOLD[name]
    assert 0 < len(survivors) <= AT_MOST[name]
    assert all(proof.reason(mutant) for mutant in survivors)


@every_protocol
def test_every_layout_with_data_is_tried(name: str) -> None:
    """Every field of each, requests and replies alike."""
    proof = PROOFS[name]
    tried = {message.name for mutant in proof.mutants() for message in mutant.messages}
    layouts = {m.name for m in proof.protocol.messages for x in m.layouts if x.fields}
    assert tried == layouts
    shifted = sum(mutant.change.startswith("shifted") for mutant in proof.mutants())
    assert shifted == len(
        {f.place for m in proof.protocol.messages for x in m.layouts for f in x.fields}
    )


@every_protocol
def test_the_unchanged_registry_is_not_contradicted(name: str) -> None:
    for message in PROOFS[name].protocol.messages:
        assert not PROOFS[name].found_by(Mutant((message,), "data", "nothing"))


@pytest.mark.parametrize(
    ("name", "erratum"),
    [
        pytest.param(name, erratum, id=erratum.id)
        for name, proof in PROOFS.items()
        for erratum in proof.protocol.errata
        if erratum.kind != "cosmetic"
    ],
)
def test_an_erratum_cannot_be_left_out(
    name: str, erratum: Erratum, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its place, or the example that names it, is then an error."""
    proof = PROOFS[name]
    rest = tuple(e for e in proof.protocol.errata if e is not erratum)
    without = replace(proof.protocol, errata=rest)
    monkeypatch.setattr(errata, "compare_witness", lambda *_: COMPARISONS[name])
    diagnostics = Diagnostics()
    errata.check_errata(without, proof.files, diagnostics)
    wanted = [*erratum.places, erratum.id]
    assert any(place in d.message for d in diagnostics for place in wanted)


def test_with_all_errata_nothing_is_missed() -> None:
    for proof in PROOFS.values():
        diagnostics = Diagnostics()
        errata.check_errata(proof.protocol, proof.files, diagnostics)
        assert list(diagnostics) == []
