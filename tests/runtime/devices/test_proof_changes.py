"""change_… reads, changes and writes under one lock, so that no concurrent change is lost."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Iterable
from typing import Any

from proof_controller import HOST, Controller
from proof_line import AsyncMemoryLink
from proof_queue import QueueLink

from stagewire import Frame
from stagewire_apt import TDC001
from stagewire_apt import messages as m
from stagewire_apt.aio import TDC001 as AsyncTDC001
from stagewire_virtual import stepped

ROUNDS = 40


class Remembering(Controller):
    """A controller that stores the velocity parameters, and reports them with a delay."""

    def __init__(self) -> None:
        super().__init__()
        self.values = {"min_velocity": 0, "acceleration": 0, "max_velocity": 0}

    def answer(self, frame: Frame) -> Iterable[tuple[float, bytes]]:
        message: Any = frame.message
        if isinstance(message, m.MotSetVelParams):
            self.values = {name: getattr(message, name) for name in self.values}
        if not isinstance(message, m.MotReqVelParams):
            return ()
        reply = m.MotGetVelParams(chan_ident=1, **self.values)
        return [(0.005, reply.pack(HOST, frame.dest))]


def test_concurrent_changes_by_tasks_lose_no_value() -> None:
    controller = Remembering()

    async def main() -> None:
        link = AsyncMemoryLink(controller)
        async with AsyncTDC001.open(link, identify=False, timeout=60) as tdc:

            async def change(name: str) -> None:
                for number in range(1, ROUNDS + 1):
                    await tdc.change_vel_params(**{name: number})

            await asyncio.gather(*(change(name) for name in controller.values))

    stepped.run(main())
    assert set(controller.values.values()) == {ROUNDS}
    assert controller.names() == ["MOT_REQ_VELPARAMS", "MOT_SET_VELPARAMS"] * 3 * ROUNDS


def test_a_set_does_not_run_between_the_read_and_the_write_of_a_change() -> None:
    """A change never overwrites the values of the set with values that it read before."""
    controller = Remembering()

    async def main() -> None:
        link = AsyncMemoryLink(controller)
        async with AsyncTDC001.open(link, identify=False) as tdc:
            change = asyncio.ensure_future(tdc.change_vel_params(max_velocity=1))
            await asyncio.sleep(0.002)  # the request was sent, but not answered yet
            await tdc.set_vel_params(min_velocity=7, acceleration=7, max_velocity=7)
            await change

    stepped.run(main())
    assert controller.values == {"min_velocity": 7, "acceleration": 7, "max_velocity": 7}


def test_concurrent_changes_by_threads_lose_no_value() -> None:
    controller = Remembering()
    with TDC001.open(QueueLink(controller), identify=False, timeout=60, pacing=0.0) as tdc:

        def change(name: str) -> None:
            for number in range(1, ROUNDS + 1):
                tdc.change_vel_params(**{name: number})

        threads = [threading.Thread(target=change, args=(name,)) for name in controller.values]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join(60)
            assert not thread.is_alive()
    assert set(controller.values.values()) == {ROUNDS}
    assert controller.names() == ["MOT_REQ_VELPARAMS", "MOT_SET_VELPARAMS"] * 3 * ROUNDS
