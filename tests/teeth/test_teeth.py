"""The proof could fail: wrong layouts are contradicted, and no erratum can be left out unnoticed."""

from __future__ import annotations

from dataclasses import replace

import pytest
from mutants import Mutant, Proof

from stagewire_generator.diagnostics import Diagnostics
from stagewire_generator.lint import errata
from stagewire_generator.lint.witness import compare_witness
from stagewire_generator.model import Erratum

PROOF = Proof()

# Fields that no table of formats and no example shows; see `python tests/teeth/mutants.py`.
UNSEEN = ("not_used", "reserved", "future_use")


def test_only_unused_fields_and_one_channel_survive() -> None:
    survivors = [mutant for mutant in PROOF.mutants() if not PROOF.found_by(mutant)]
    unexplained = [
        str(mutant)
        for mutant in survivors
        if not mutant.change.split(" ")[1].startswith(UNSEEN) or mutant.change.startswith("shifted")
    ]
    # Page 76: the field table of the stage parameters begins with Stage ID.
    assert unexplained == ["MOT_SET_PMDSTAGEAXISPARAMS (data): re-signed chan_ident"]
    assert 0 < len(survivors) < 25
    assert all(PROOF.reason(mutant) for mutant in survivors)


def test_every_data_layout_is_tried() -> None:
    tried = {message.name for mutant in PROOF.mutants() for message in mutant.messages}
    layouts = {m.name for m in PROOF.protocol.messages for x in m.layouts if x.fields}
    assert tried == layouts


def test_the_unchanged_registry_is_not_contradicted() -> None:
    for message in PROOF.protocol.messages:
        assert not PROOF.found_by(Mutant((message,), "data", "nothing"))


@pytest.mark.parametrize(
    "erratum", [e for e in PROOF.protocol.errata if e.kind != "cosmetic"], ids=lambda e: e.id
)
def test_an_erratum_cannot_be_left_out(erratum: Erratum, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its place, or the example that names it, is then an error."""
    rest = tuple(e for e in PROOF.protocol.errata if e is not erratum)
    without = replace(PROOF.protocol, errata=rest)
    monkeypatch.setattr(errata, "compare_witness", lambda *_: COMPARISON)
    diagnostics = Diagnostics()
    errata.check_errata(without, PROOF.files, diagnostics)
    wanted = [*erratum.places, erratum.id]
    assert any(name in d.message for d in diagnostics for name in wanted)


COMPARISON = compare_witness(PROOF.protocol, PROOF.witness)
