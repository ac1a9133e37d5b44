"""A delayed status may be taken for a reply, but does not prove that a motion has ended."""

from __future__ import annotations

from typing import Any

import pytest
from proof_controller import HOST, Parrot, Said
from proof_line import SIDES, Side, settled

from stagewire import Frame
from stagewire.errors import MotionTimeoutError, MotionUnderWayError
from stagewire_apt import messages as m

MOVING = 0x10  # moving forward
USB = 0x50


def status(position: int, bits: int) -> bytes:
    message = m.MotGetDcStatusUpdate(chan_ident=1, position=position, velocity=0, status_bits=bits)
    return message.pack(HOST, USB)


class HeldUp(Parrot):
    """A controller whose moves last until the test ends them, and whose earlier messages are delayed.

    :ivar late: messages to send with the next reply.
    """

    def __init__(self) -> None:
        super().__init__(seed=1)
        self.late = b""
        self.bits = 0
        self.position = 0

    def answer(self, frame: Frame) -> Said:
        if isinstance(frame.message, m.MotMoveAbsolute):
            self.bits = MOVING
            return ()
        if isinstance(frame.message, m.MotReqDcStatusUpdate):
            self.position += 1
            reply: Said = [(0.001, status(self.position, self.bits))]
        else:
            reply = super().answer(frame)
        late, self.late = self.late, b""
        return [(delay, late + said) for delay, said in reply if said is not None]


@pytest.mark.parametrize("copies", [1, 2, 5])
@pytest.mark.parametrize("side", SIDES, ids=repr)
def test_a_late_status_at_rest_does_not_end_a_motion(side: Side, copies: int) -> None:
    controller = HeldUp()

    async def scenario(bench: Any) -> None:
        async with bench.open("TDC001", identify=False, on_close="leave") as tdc:
            with pytest.raises(MotionTimeoutError):
                await settled(tdc.move_absolute(counts=1000, timeout=0.7))
            controller.late = status(0, 0) * copies
            assert await settled(tdc.is_moving())
            with pytest.raises(MotionUnderWayError):
                await settled(tdc.start_move_absolute(counts=2000))
            controller.late = status(0, 0) * copies
            await settled(tdc.get_dc_status_update())
            with pytest.raises(MotionUnderWayError):
                await settled(tdc.start_move_absolute(counts=2000))
            controller.bits = 0
            assert not await settled(tdc.is_moving())
            await settled(tdc.start_move_absolute(counts=2000))

    side.run(controller, scenario)


@pytest.mark.parametrize("side", SIDES, ids=repr)
def test_a_late_status_at_rest_does_not_make_is_moving_return_false(
    side: Side,
) -> None:
    controller = HeldUp()

    async def scenario(bench: Any) -> None:
        async with bench.open("TDC001", identify=False, on_close="leave") as tdc:
            await settled(tdc.start_move_absolute(counts=1000))
            await bench.sleep(0.7)
            controller.late = status(0, 0)
            assert await settled(tdc.is_moving())

    side.run(controller, scenario)


@pytest.mark.parametrize("side", SIDES, ids=repr)
def test_a_status_at_rest_does_not_end_a_motion_if_the_identity_request_is_unanswered(
    side: Side,
) -> None:
    class Anonymous(HeldUp):
        def answer(self, frame: Frame) -> Said:
            return () if isinstance(frame.message, m.HwReqInfo) else super().answer(frame)

    controller = Anonymous()

    async def scenario(bench: Any) -> None:
        async with bench.open("TDC001", identify=False, on_close="leave") as tdc:
            with pytest.raises(MotionTimeoutError):
                await settled(tdc.move_absolute(counts=1000, timeout=0.7))
            controller.late = status(0, 0)
            assert (await settled(tdc.get_dc_status_update())).position == 0
            with pytest.raises(MotionUnderWayError):
                await settled(tdc.start_move_absolute(counts=2000))

    side.run(controller, scenario)


@pytest.mark.parametrize("side", SIDES, ids=repr)
def test_an_unsolicited_status_does_not_delay_later_replies(side: Side) -> None:
    """It is matched to one request, whose own reply becomes unsolicited; later requests get their replies."""
    controller = HeldUp()

    async def scenario(bench: Any) -> None:
        async with bench.open("TDC001", identify=False) as tdc:
            controller.late = status(-1, 0)
            first = await settled(tdc.get_dc_status_update())
            assert first.message.position == -1
            for number in range(2, 20):
                controller.renew()
                values = await settled(tdc.get_vel_params())
                assert values.message == controller.state(m.MotGetVelParams, USB, 1)
                answer = await settled(tdc.get_dc_status_update())
                assert answer.message.position == number

    side.run(controller, scenario)
