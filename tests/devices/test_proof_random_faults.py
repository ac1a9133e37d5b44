"""Random faults with fixed seeds: never a wrong value, each failure documented, the session usable after it.

``proof_faults.py`` is the experiment; as a program it runs the 100,000 requests.
"""

from __future__ import annotations

import pytest
from proof_faults import FAULTS, Noisy, judge, number_of, run
from proof_line import SIDES, Side

from stagewire_apt import messages as m

REQUESTS = 5000


@pytest.mark.parametrize("side", SIDES, ids=repr)
@pytest.mark.parametrize("seed", [1, 2])
def test_no_wrong_value_ever(side: Side, seed: int) -> None:
    tally = run(side, REQUESTS, seed)
    assert tally.wrong == []
    assert tally.spoilt == 0
    assert tally.failed > 0
    assert all(tally.faults[fault] > 50 for fault in FAULTS), tally.faults


@pytest.mark.parametrize("side", SIDES, ids=repr)
def test_damage_in_a_packet_is_seen_by_nobody_and_never_affects_a_later_answer(side: Side) -> None:
    """There is no checksum: such values are counted apart, and are no more than the damaged packets."""
    tally = run(side, REQUESTS, 3, (*FAULTS, "packet"))
    assert tally.wrong == []
    assert 0 < tally.spoilt <= tally.faults["packet"]


@pytest.mark.parametrize("side", SIDES, ids=repr)
@pytest.mark.parametrize("fault", FAULTS)
def test_each_fault_alone(side: Side, fault: str) -> None:
    tally = run(side, 500, 4, (fault,) * 20)  # each frame is hit with a probability of a fifth
    assert tally.wrong == []
    assert tally.faults[fault] > 100


def test_the_judge_sees_what_is_stale_and_what_is_another_kind() -> None:
    controller = Noisy(1, ())
    five, six = number_of(5), number_of(6)
    controller.kinds = {five: m.MotGetPosCounter, six: m.MotGetEncCounter}
    said = m.MotGetPosCounter(chan_ident=1, position=five)
    other = m.MotGetPosCounter(chan_ident=1, position=six)
    assert judge(controller, 4, m.MotGetPosCounter, said) == "right"
    assert "earlier" in judge(controller, 5, m.MotGetPosCounter, said)
    assert "MotGetEncCounter" in judge(controller, 4, m.MotGetPosCounter, other)
    assert judge(controller, 4, m.MotGetPosCounter, said.replace(position=five ^ 4)) == "spoilt"
