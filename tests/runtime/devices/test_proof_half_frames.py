"""After half a frame whose rest never arrives, the next two requests are answered."""

from __future__ import annotations

from typing import Any

import pytest
from proof_controller import HOST, Parrot
from proof_line import SIDES, Side, settled

from stagewire_apt import messages as m

USB = 0x50
STATUS = m.MotGetDcStatusUpdate(chan_ident=1, position=5, velocity=0, status_bits=0).pack(HOST, USB)


@pytest.mark.parametrize("seconds", [0.001, 0.02, 0.049, 0.05, 0.2, 3.0])
@pytest.mark.parametrize("length", [1, 5, 6, 10, 19])
@pytest.mark.parametrize("side", SIDES, ids=repr)
def test_two_requests_after_half_a_frame_are_answered(
    side: Side, length: int, seconds: float
) -> None:
    controller = Parrot(seed=1)

    async def scenario(bench: Any) -> None:
        async with bench.open("TDC001", identify=False) as tdc:
            await settled(tdc.get_vel_params())
            controller.say(STATUS[:length])
            await bench.sleep(seconds)
            for _ in range(2):
                controller.renew()
                values = await settled(tdc.get_vel_params())
                assert values.message == controller.state(m.MotGetVelParams, USB, 1)

    side.run(controller, scenario)


@pytest.mark.parametrize("side", SIDES, ids=repr)
def test_a_move_after_half_a_frame_ends(side: Side) -> None:
    class Mover(Parrot):
        def answer(self, frame: Any) -> Any:
            if isinstance(frame.message, m.MotMoveAbsolute):
                return [(0.001, m.MotMoveCompletedHeader(1).pack(HOST, USB))]
            return super().answer(frame)

    controller = Mover(seed=1)

    async def scenario(bench: Any) -> None:
        async with bench.open("TDC001", identify=False) as tdc:
            controller.say(STATUS[:10])
            await bench.sleep(0.01)
            await settled(tdc.move_absolute(counts=5))

    side.run(controller, scenario)
