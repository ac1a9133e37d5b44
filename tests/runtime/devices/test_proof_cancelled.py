"""Cancellation at every await: all locks are released, and the next reply is matched to its own request."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any

import pytest
from proof_controller import HOST, Parrot
from proof_interruptions import cancelled_at
from proof_line import AsyncMemoryLink

from stagewire import Frame
from stagewire.errors import MotionUnderWayError
from stagewire_apt import messages as m
from stagewire_apt.aio import TDC001
from stagewire_virtual import stepped


class Mover(Parrot):
    """A controller whose moves take half a second."""

    def answer(self, frame: Frame) -> Any:
        if isinstance(frame.message, (m.MotMoveAbsolute, m.MotMoveHome)):
            end: Any = m.MotMoveCompletedHeader(chan_ident=1)
            if isinstance(frame.message, m.MotMoveHome):
                end = m.MotMoveHomed(chan_ident=1)
            return [(0.5, end.pack(dest=HOST, source=0x50))]
        if isinstance(frame.message, m.MotMoveStop):
            return [(0.05, m.MotMoveStoppedHeader(chan_ident=1).pack(dest=HOST, source=0x50))]
        return super().answer(frame)


CALLS: dict[str, Callable[[TDC001], Any]] = {
    "get": lambda tdc: tdc.get_vel_params(),
    "set": lambda tdc: tdc.set_vel_params(min_velocity=0, acceleration=1, max_velocity=2),
    "change": lambda tdc: tdc.change_vel_params(max_velocity=3),
    "status": lambda tdc: tdc.get_dc_status_update(),
    "move": lambda tdc: tdc.move_absolute(counts=1000),
    "home": lambda tdc: tdc.home(),
    "stop": lambda tdc: tdc.stop(),
}


async def works(tdc: TDC001, controller: Mover) -> None:
    """Check that a device works and returns current values."""
    for ask, cls in [
        (tdc.get_vel_params, m.MotGetVelParams),
        (tdc.get_dc_status_update, m.MotGetDcStatusUpdate),
    ]:
        controller.renew()
        values = await ask()
        assert values.message == controller.state(cls, 0x50, 1)
    controller.heard.clear()
    await tdc.change_vel_params(acceleration=7)
    assert controller.names() == ["MOT_REQ_VELPARAMS", "MOT_SET_VELPARAMS"]
    await tdc.stop()
    assert (await tdc.move_absolute(counts=500)).message.chan_ident == 1


@pytest.mark.parametrize("name", CALLS)
def test_the_device_works_after_cancellation_at_every_await(name: str) -> None:
    async def cancelled(number: int) -> bool:
        """Cancel at the n-th await; return whether the call reached it."""
        controller = Mover(seed=number)
        async with TDC001.open(
            AsyncMemoryLink(controller), identify=False, on_close="leave"
        ) as tdc:
            reached = await cancelled_at(CALLS[name](tdc), number)
            await works(tdc, controller)
        return reached

    number = 1
    while stepped.run(cancelled(number)):
        number += 1
    assert number > 1 or name == "set"


@pytest.mark.parametrize("name", CALLS)
@pytest.mark.parametrize("after", [0.0, 0.0005, 0.001, 0.0010001, 0.049, 0.05, 0.3, 0.5, 0.5000001])
def test_the_device_works_after_cancellation_at_any_time(name: str, after: float) -> None:
    """This includes the instant at which the reply arrives."""

    async def main() -> None:
        controller = Mover(seed=1)
        async with TDC001.open(
            AsyncMemoryLink(controller), identify=False, on_close="leave"
        ) as tdc:
            task = asyncio.ensure_future(CALLS[name](tdc))
            asyncio.get_running_loop().call_later(after, task.cancel)
            await asyncio.gather(task, return_exceptions=True)
            await works(tdc, controller)

    stepped.run(main())


def test_a_cancelled_move_is_not_resent_and_blocks_other_moves_until_it_ends() -> None:
    async def main() -> None:
        controller = Mover(seed=1)
        async with TDC001.open(
            AsyncMemoryLink(controller), identify=False, on_close="leave"
        ) as tdc:
            with pytest.raises(TimeoutError):
                await asyncio.wait_for(tdc.move_absolute(counts=1000), 0.1)
            with pytest.raises(MotionUnderWayError):
                await tdc.move_absolute(counts=2000)
            await asyncio.sleep(1)
            assert controller.names() == ["MOT_MOVE_ABSOLUTE"]
            await tdc.move_absolute(counts=2000)

    stepped.run(main())


class Slow(Parrot):
    """A controller that answers after 0.2 s."""

    def answer(self, frame: Frame) -> Any:
        return [(0.2, reply) for _, reply in super().answer(frame)]


def test_a_call_cancelled_before_it_is_written_is_never_written() -> None:
    async def main() -> None:
        controller = Slow(seed=1)
        async with TDC001.open(
            AsyncMemoryLink(controller), identify=False, on_close="leave"
        ) as tdc:
            await tdc.identify()  # the next message waits a moment after it
            waiting = [
                asyncio.ensure_future(call)
                for call in (
                    tdc.get_vel_params(),
                    tdc.get_pos_counter(),
                    tdc.set_vel_params(min_velocity=0, acceleration=1, max_velocity=2),
                    tdc.change_vel_params(max_velocity=3),
                    tdc.move_absolute(counts=1000),
                    tdc.home(),
                )
            ]
            await asyncio.sleep(0)
            for task in waiting:
                task.cancel()
            await asyncio.gather(*waiting, return_exceptions=True)
            await asyncio.sleep(5)
            assert controller.names() == ["MOD_IDENTIFY"]

    stepped.run(main())


def test_after_a_cancelled_request_the_same_request_waits_for_the_late_reply() -> None:
    """It then gets its own reply. Other requests do not wait."""

    async def main() -> None:
        controller = Slow(seed=1)
        async with TDC001.open(
            AsyncMemoryLink(controller), identify=False, on_close="leave"
        ) as tdc:
            with pytest.raises(TimeoutError):
                await asyncio.wait_for(tdc.get_vel_params(), 0.1)
            controller.renew()
            again = asyncio.ensure_future(tdc.get_vel_params())
            other = asyncio.ensure_future(tdc.get_pos_counter())
            await asyncio.sleep(0.05)
            assert controller.names() == ["MOT_REQ_VELPARAMS", "MOT_REQ_POSCOUNTER"]
            assert (await again).message == controller.state(m.MotGetVelParams, 0x50, 1)
            assert (await other).message == controller.state(m.MotGetPosCounter, 0x50, 1)
            assert controller.names() == ["MOT_REQ_VELPARAMS"]

    stepped.run(main())
