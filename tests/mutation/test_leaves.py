"""Every fact of the registry has a second witness: a wrong value contradicts ``check`` or an example.

The mutations that may survive are in ``survivors.yaml``, with the reasons why no document could contradict
them.
"""

from __future__ import annotations

import random

import pytest
from leaves import PROSE, REMOVED, excused, leaves, listed, mutations, survives
from mutants import PROTOCOLS, proof_of

A_SAMPLE = {"thorlabs_apt": 54, "asi_ms2000": 6}
PARTS = 12
AT_LEAST = {"thorlabs_apt": 2500, "asi_ms2000": 250}
MOST_SURVIVORS = 8

every_protocol = pytest.mark.parametrize("name", PROTOCOLS)


@every_protocol
def test_a_sample_of_wrong_values_is_found(name: str) -> None:
    proof = proof_of(name)
    found = [m for m in mutations(proof, seed=1) if not excused(name, m)]
    tried = random.Random(1).sample(found, A_SAMPLE[name])
    assert [str(mutation) for mutation in tried if survives(proof, mutation)] == []


@pytest.mark.proof
@pytest.mark.matrix
@pytest.mark.parametrize("part", range(PARTS))
@every_protocol
def test_every_wrong_value_is_found(name: str, part: int) -> None:
    proof = proof_of(name)
    tried = [m for m in mutations(proof, seed=2) if not excused(name, m)][part::PARTS]
    assert [str(mutation) for mutation in tried if survives(proof, mutation)] == []


def test_the_list_of_survivors_is_short() -> None:
    assert sum(len(listed(name)) for name in PROTOCOLS) <= MOST_SURVIVORS
    assert all(len(reason) > 20 for name in PROTOCOLS for reason in listed(name).values())


@every_protocol
def test_the_leaves_are_the_facts_of_the_files(name: str) -> None:
    proof = proof_of(name)
    found = leaves(proof)
    assert len(found) >= AT_LEAST[name]
    assert len({str(leaf) for leaf in found}) == len(found)
    assert not any(step in PROSE for leaf in found for step in leaf.path)


@every_protocol
def test_a_mutated_leaf_is_restored(name: str) -> None:
    proof = proof_of(name)
    for mutation in mutations(proof, seed=1):
        leaf = mutation.leaf
        before, value = leaf.document.data, leaf.value
        with mutation.applied():
            assert leaf.document.data is not before
            assert mutation.value is REMOVED or leaf.value == mutation.value != value
        assert leaf.document.data is before


@every_protocol
def test_every_fact_needs_a_second_witness(name: str) -> None:
    assert proof_of(name).files["protocol"][0].data["witness"] == "complete"
