"""Every fact of the registry has a second witness: a wrong value contradicts ``check`` or an example.

The facts that may survive are in ``survivors.yaml``, with the reasons why no document could contradict them.
"""

from __future__ import annotations

import random

import pytest
from leaves import PROSE, leaves, listed, mutations, survives
from mutants import PROTOCOLS, proof_of

A_SAMPLE = {"thorlabs_apt": 54, "asi_ms2000": 6}
PARTS = 12
AT_LEAST = {"thorlabs_apt": 2500, "asi_ms2000": 250}
MOST_SURVIVORS = 80

every_protocol = pytest.mark.parametrize("name", PROTOCOLS)


@every_protocol
def test_a_sample_of_wrong_values_is_found(name: str) -> None:
    proof = proof_of(name)
    excused = listed(name)
    found = [m for m in mutations(proof, seed=1) if str(m.leaf) not in excused]
    tried = random.Random(1).sample(found, A_SAMPLE[name])
    assert [str(mutation) for mutation in tried if survives(proof, mutation)] == []


@pytest.mark.matrix
@pytest.mark.parametrize("part", range(PARTS))
@every_protocol
def test_every_wrong_value_is_found(name: str, part: int) -> None:
    proof = proof_of(name)
    excused = listed(name)
    tried = [m for m in mutations(proof, seed=2) if str(m.leaf) not in excused][part::PARTS]
    assert [str(mutation) for mutation in tried if survives(proof, mutation)] == []


@pytest.mark.matrix
@every_protocol
def test_a_listed_leaf_survives(name: str) -> None:
    """A leaf that no longer survives is removed from the list."""
    proof = proof_of(name)
    excused = listed(name)
    survivors = {
        str(m.leaf)
        for m in mutations(proof, seed=1)
        if str(m.leaf) in excused and survives(proof, m)
    }
    assert sorted(excused.keys() - survivors) == []


def test_the_list_of_survivors_is_short() -> None:
    excused = [leaf for name in PROTOCOLS for leaf in listed(name)]
    assert len(excused) == len(set(excused)) <= MOST_SURVIVORS
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
        before = leaf.siblings
        with leaf.mutated(mutation.value):
            during = leaf.siblings
        after = leaf.siblings
        assert before == after
        assert during != before
