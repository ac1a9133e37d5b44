"""Comparing two registries classifies every wrong layout as a WIRE change."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
from mutants import PROTOCOLS, proof_of

from stagewire_generator.change import ChangeClass, compare, worst

AT_LEAST = {"thorlabs_apt": 500, "asi_ms2000": 30}


@pytest.mark.parametrize("name", PROTOCOLS)
def test_every_wrong_layout_is_a_wire_change(name: str) -> None:
    proof = proof_of(name)
    # Remove the parts that are equal in all mutants, to compare them faster.
    alone: Any = {key: {} for key in ("units", "examples", "captures")}
    alone |= dict.fromkeys(("errata", "rules", "stages", "quantities", "enumerations", "flags"), ())
    messages_only = replace(proof.protocol, **alone)
    right = {message.name: message for message in proof.protocol.messages}
    tried = 0
    missed = []
    for mutant in proof.mutants():
        originals = tuple(right[message.name] for message in mutant.messages)
        old, new = (replace(messages_only, messages=m) for m in (originals, mutant.messages))
        assert compare([old], [old]) == []
        tried += 1
        if worst(compare([old], [new])) is not ChangeClass.WIRE:
            missed.append(str(mutant))
    assert missed == []
    assert tried > AT_LEAST[name]
