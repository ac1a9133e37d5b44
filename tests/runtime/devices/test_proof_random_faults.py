"""Random faults with fixed seeds: no wrong values, only documented errors, and a usable session afterwards.

The experiment is in ``proof_faults.py``, which makes 100,000 requests with any seed when run as a program.
"""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress
from typing import Any

import pytest
from proof_controller import HOST, Controller
from proof_faults import FAULTS, Noisy, judge, number_of, run
from proof_line import SIDES, Side, settled

from stagewire import Frame
from stagewire.errors import ReplyTimeoutError
from stagewire_apt import messages as m

REQUESTS = 10_000  # for each of five seeds and two sides
SEEDS = [0, *(pytest.param(seed, marks=pytest.mark.matrix) for seed in range(1, 5))]


@pytest.mark.parametrize("side", SIDES, ids=repr)
@pytest.mark.parametrize("seed", SEEDS)
def test_a_wrong_value_is_never_returned(side: Side, seed: int) -> None:
    tally = run(side, REQUESTS, seed)
    assert tally.wrong == []
    assert tally.spoilt == 0
    assert tally.failed > 0
    assert all(tally.faults[fault] > 100 for fault in FAULTS), tally.faults


@pytest.mark.parametrize("side", SIDES, ids=repr)
def test_damage_in_a_packet_does_not_affect_later_answers(side: Side) -> None:
    """Packets have no checksum. Damaged values are counted separately, and at most one per damaged packet."""
    tally = run(side, REQUESTS, 3, (*FAULTS, "packet"))
    assert tally.wrong == []
    assert 0 < tally.spoilt <= tally.faults["packet"]


@pytest.mark.parametrize("side", SIDES, ids=repr)
@pytest.mark.parametrize("fault", FAULTS)
def test_no_single_kind_of_fault_causes_a_wrong_value(side: Side, fault: str) -> None:
    tally = run(side, 500, 4, (fault,) * 20)  # about every fifth frame is hit
    assert tally.wrong == []
    assert tally.faults[fault] > 100


class Twice(Controller):
    """A controller that sends its first reply twice, the second time with a damaged header."""

    def __init__(self, bit: int) -> None:
        super().__init__()
        self._bit = bit
        self.count = 0

    def answer(self, frame: Frame) -> Iterable[tuple[float, bytes]]:
        self.count += 1
        reply = m.MotGetPosCounter(chan_ident=1, position=self.count).pack(HOST, 0x50)
        damaged = bytearray(reply)
        damaged[self._bit // 8] ^= 1 << self._bit % 8
        return [(0.001, reply + bytes(damaged) if self.count == 1 else reply)]


@pytest.mark.parametrize("side", SIDES, ids=repr)
@pytest.mark.parametrize("bit", range(48))
def test_a_frame_that_began_before_a_request_is_not_matched_to_it(bit: int, side: Side) -> None:
    """A copy whose header declares too many bytes is completed by bytes of the next reply."""
    controller = Twice(bit)

    async def scenario(bench: Any) -> None:
        async with bench.open("TDC001", identify=False, on_close="leave") as device:
            for _ in range(4):
                before = controller.count
                with suppress(ReplyTimeoutError):
                    values = await settled(device.get_pos_counter(timeout=0.5))
                    assert values.position > before
            assert (await settled(device.get_pos_counter())).position == controller.count

    side.run(controller, scenario)


def test_the_judge_detects_stale_replies_and_replies_of_another_kind() -> None:
    controller = Noisy(1, ())
    five, six = number_of(5), number_of(6)
    controller.kinds = {five: m.MotGetPosCounter, six: m.MotGetEncCounter}
    said = m.MotGetPosCounter(chan_ident=1, position=five)
    other = m.MotGetPosCounter(chan_ident=1, position=six)
    assert judge(controller, 4, m.MotGetPosCounter, said) == "right"
    assert "earlier" in judge(controller, 5, m.MotGetPosCounter, said)
    assert "MotGetEncCounter" in judge(controller, 4, m.MotGetPosCounter, other)
    assert judge(controller, 4, m.MotGetPosCounter, said.replace(position=five ^ 4)) == "spoilt"
