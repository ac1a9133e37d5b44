"""Every wrong layout is a WIRE change: no comparison of two registries takes one for something smaller."""

from __future__ import annotations

from dataclasses import replace

from mutants import Proof

from stagewire_generator.change import ChangeClass, compare, worst

PROOF = Proof()
# What the mutants leave alone would only be compared again and again.
MESSAGES_ONLY = replace(
    PROOF.protocol, units={}, errata=(), examples={}, captures={}, stages=(), quantities=()
)


def test_every_wrong_layout_is_a_wire_change() -> None:
    right = {message.name: message for message in PROOF.protocol.messages}
    tried = 0
    missed = []
    for mutant in PROOF.mutants():
        originals = tuple(right[message.name] for message in mutant.messages)
        old, new = (replace(MESSAGES_ONLY, messages=m) for m in (originals, mutant.messages))
        assert compare([old], [old]) == []
        tried += 1
        if worst(compare([old], [new])) is not ChangeClass.WIRE:
            missed.append(str(mutant))
    assert missed == []
    assert tried > 500
