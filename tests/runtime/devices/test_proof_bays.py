"""Three bays of a rack move simultaneously. All have channel 1, and only their addresses differ."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable
from typing import Any

import pytest
from proof_controller import HOST, Controller
from proof_line import SIDES, Side, settled

from stagewire import Frame
from stagewire.errors import MotionTimeoutError
from stagewire_apt import messages as m

BAYS = (1, 2, 3)
ORDERS = list(itertools.permutations(BAYS))


def address(bay: int) -> int:
    return 0x20 + bay


class Rack(Controller):
    """A rack whose bays end their moves on request, each at its target."""

    def __init__(self, swapped: bool = True) -> None:
        super().__init__()
        self._swapped = swapped
        self._targets: dict[int, int] = {}

    def answer(self, frame: Frame) -> Iterable[tuple[float, bytes | None]]:
        if isinstance(frame.message, m.MotMoveAbsolute):
            self._targets[frame.dest] = frame.message.absolute_distance
        return ()

    def end(self, bay: int) -> None:
        """Send the end of a move of a bay; not swapped: with the addresses of the request."""
        place = self._targets[address(bay)]
        ended = m.MotMoveCompletedDc(chan_ident=1, position=place, velocity=0, status_bits=0)
        ways = (HOST, address(bay)) if self._swapped else (address(bay), HOST)
        self.say(ended.pack(*ways))


@pytest.mark.parametrize("side", SIDES, ids=repr)
@pytest.mark.parametrize("swapped", [True, False], ids=["swapped", "unswapped"])
@pytest.mark.parametrize("order", ORDERS, ids=str)
def test_each_end_ends_the_move_of_its_own_bay(
    order: tuple[int, ...], swapped: bool, side: Side
) -> None:
    rack = Rack(swapped)

    async def scenario(bench: Any) -> None:
        async with bench.open("BBD103", identify=False) as device:
            motions = {
                bay: await settled(device.bay(bay).start_move_absolute(counts=1000 * bay))
                for bay in BAYS
            }
            ended = []
            for bay in order:
                rack.end(bay)
                await bench.sleep(0.01)
                ended.append(bay)
                assert [bay for bay in BAYS if motions[bay].done] == sorted(ended)
            for bay, motion in motions.items():
                end = await settled(motion.wait())
                assert isinstance(end.message, m.MotMoveCompletedDc)
                assert end.values.position == end.message.position == 1000 * bay
            assert rack.names() == ["MOT_MOVE_ABSOLUTE"] * 3

    side.run(rack, scenario)


@pytest.mark.parametrize("side", SIDES, ids=repr)
@pytest.mark.parametrize("bay", BAYS)
@pytest.mark.parametrize(
    ("dest", "source"),
    [
        (lambda own: HOST, lambda own: own),
        (lambda own: own, lambda own: HOST),
        (lambda own: 0, lambda own: 0),
    ],
    ids=["swapped", "unswapped", "zero"],
)
def test_a_reply_of_another_bay_is_ignored_but_one_without_an_address_is_accepted(
    bay: int, dest: Callable[[int], int], source: Callable[[int], int], side: Side
) -> None:
    class Answering(Controller):
        def answer(self, frame: Frame) -> Iterable[tuple[float, bytes | None]]:
            own = frame.dest
            wrong = [
                m.MotGetPosCounter(chan_ident=1, position=-1).pack(HOST, address(other))
                for other in BAYS
                if address(other) != own
            ]
            right = m.MotGetPosCounter(chan_ident=1, position=own).pack(dest(own), source(own))
            return [(0.001, b"".join(wrong)), (0.002, right)]

    async def scenario(bench: Any) -> int:
        async with bench.open("BBD103", identify=False) as device:
            values = await settled(device.bay(bay).get_pos_counter())
            return int(values.position)

    assert side.run(Answering(), scenario) == address(bay)


@pytest.mark.parametrize("side", SIDES, ids=repr)
def test_the_timeout_of_each_bay_mentions_ends_without_an_address(side: Side) -> None:
    rack = Rack()
    end = m.MotMoveCompletedHeader(1).pack(0, 0)

    async def scenario(bench: Any) -> None:
        async with bench.open("BBD103", identify=False, motion_timeout=3) as device:
            motions = [
                await settled(device.bay(bay).start_move_absolute(counts=1000 * bay))
                for bay in BAYS[:2]
            ]
            rack.say(end)
            rack.say(end, 0.5)
            for motion in motions:
                with pytest.raises(MotionTimeoutError) as late:
                    await settled(motion.wait())
                text = str(late.value)
                assert (
                    "2 x MOT_MOVE_COMPLETED without an address while several exchanges wait" in text
                )
                assert end.hex(" ") in text
                assert "run one motion at a time on this line, or read the status of each" in text

    side.run(rack, scenario)
