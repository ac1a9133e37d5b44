"""A fact too many, an entry with another name, or one entry less contradicts ``check`` or an example.

The mutations that may survive are in ``survivors.yaml``, with the reasons why no document could contradict
them.
"""

from __future__ import annotations

import random
from collections import Counter
from fnmatch import fnmatchcase

import pytest
from entries import KINDS, mutations
from leaves import Mutation, excused, listed, survives
from mutants import PROTOCOLS, Proof, proof_of

OF_EACH_KIND = {"thorlabs_apt": 3, "asi_ms2000": 1}
PARTS = 12
IN_A_PART = {"thorlabs_apt": 80, "asi_ms2000": 12}
AT_LEAST = {
    "thorlabs_apt": {"additions": 5000, "orphans": 700, "renames": 1000, "removals": 1200},
    "asi_ms2000": {"additions": 450, "orphans": 75, "renames": 120, "removals": 150},
}

every_protocol = pytest.mark.parametrize("name", PROTOCOLS)


def survivors(proof: Proof, name: str, tried: list[Mutation]) -> list[str]:
    return [str(m) for m in tried if not excused(name, m) and survives(proof, m)]


@pytest.mark.parametrize("kind", KINDS)
@every_protocol
def test_a_sample_is_refused(name: str, kind: str) -> None:
    proof = proof_of(name)
    found = [*KINDS[kind](proof, random.Random(1))]
    assert survivors(proof, name, random.Random(2).sample(found, OF_EACH_KIND[name])) == []


@pytest.mark.proof
@pytest.mark.matrix
@pytest.mark.parametrize("part", range(PARTS))
@every_protocol
def test_a_large_sample_is_refused(name: str, part: int) -> None:
    proof = proof_of(name)
    found = [mutation for _, mutation in mutations(proof, seed=part)][part::PARTS]
    assert survivors(proof, name, random.Random(part).sample(found, IN_A_PART[name])) == []


@pytest.mark.proof
@pytest.mark.matrix
@every_protocol
def test_a_listed_mutation_survives(name: str) -> None:
    """A pattern without a survivor is removed from the list."""
    proof = proof_of(name)
    every = [mutation for _, mutation in mutations(proof, seed=1)]
    for pattern in listed(name):
        matching = [mutation for mutation in every if fnmatchcase(str(mutation), pattern)]
        assert any(survives(proof, mutation) for mutation in matching), pattern


@every_protocol
def test_there_are_mutations_of_each_kind(name: str) -> None:
    proof = proof_of(name)
    found = [*mutations(proof, seed=1)]
    totals = Counter(kind for kind, _ in found)
    assert all(totals[kind] >= number for kind, number in AT_LEAST[name].items())
    assert len({(m.leaf.document.name, str(m)) for _, m in found}) == len(found)


@every_protocol
def test_a_mutated_registry_is_restored(name: str) -> None:
    proof = proof_of(name)
    for _, mutation in random.Random(1).sample([*mutations(proof, seed=1)], 200):
        documents = [root.document for root, _ in mutation.changed()]
        before = [document.data for document in documents]
        with mutation.applied():
            assert [document.data for document in documents] != before
        assert all(document.data is data for document, data in zip(documents, before, strict=True))
