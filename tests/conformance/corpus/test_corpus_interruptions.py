"""An interrupted run makes no firmware of the corpus faster, and says whether it rests.

Each firmware with a fault of motion is interrupted at fifty points, spread over the kinds that move, and so
is each correct one.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import pytest
from corpus_benches import BENCHES
from corpus_firmware import EVERY
from corpus_lines import Maker, SteppedCorpusLink
from corpus_motion import Path
from corpus_motor import MotorController
from corpus_ms2000 import Ms2000
from corpus_rack import Rack

from interruptions import Rig, interrupt_kinds
from parts import PROOF

POINTS = 50
SAMPLE = 2
MAKERS = {f"{name}-correct": (name, bench.make) for name, bench in BENCHES.items()} | {
    f"{name}-{fault.name}": (name, fault.make) for name, fault in EVERY if fault.dynamic
}


def peak(path: Path, now: float) -> float:
    """Return the highest speed of the motion under way; 0 at rest."""
    if path.piece(now) is None:
        return 0.0
    ends = [
        max(abs(piece.v), 0.0 if math.isinf(piece.lasts) else abs(piece.speed(piece.end)))
        for piece in path.pieces
    ]
    return max(ends)


def rig_of(make: Maker) -> Rig:
    """Return a rig of a controller of the corpus."""
    link = SteppedCorpusLink(make)
    firmware = link.firmware
    assert isinstance(firmware, MotorController | Ms2000 | Rack)

    def commanded() -> dict[str, float]:
        if isinstance(firmware, MotorController):
            return {"1": peak(firmware.axis.path, link.now)}
        if isinstance(firmware, Rack):
            return {str(card.bay): peak(card.axis.path, link.now) for card in firmware.cards}
        return {axis.name: peak(axis.path, link.now) for axis in firmware.axes.values()}

    def advance(seconds: float) -> None:
        end = link.now + seconds
        while link.now < end:
            link.read(end - link.now)

    return Rig(link, commanded, advance)


def cases() -> Iterator[Any]:
    """Yield each firmware for `make proofs`, and some with a few points for `make test`."""
    for number, (title, (name, make)) in enumerate(MAKERS.items()):
        if number % 25 == 0:
            yield pytest.param(name, make, SAMPLE, id=f"{title}-some")
        yield pytest.param(name, make, POINTS, id=title, marks=PROOF)


@pytest.mark.parametrize(("name", "make", "count"), [*cases()])
def test_an_interrupted_firmware_is_safe(name: str, make: Maker, count: int) -> None:
    interrupt_kinds(BENCHES[name], lambda: rig_of(make), count, seed=24)
