"""After a call of an axis is cancelled at any await or interrupted at any read, the next reply is right."""

from __future__ import annotations

import asyncio
import random
from collections.abc import Callable
from importlib import import_module
from typing import Any

import pytest
from proof_calls import Call, arguments, method
from proof_interruptions import InterruptedLink, cancelled_at
from proof_line import AsyncMemoryLink, at_once, settled
from proof_ms2000 import NAME, PACKAGE, UNITS, Axes, axis_calls, works

from stagewire_ms2000 import MS2000, aio
from stagewire_ms2000 import messages as c
from stagewire_virtual import stepped

Do = Callable[[Any], Any]


def doing(call: Call) -> Do:
    """Return a function that makes a call with random arguments."""
    given = arguments(call, random.Random(call.name), NAME)
    return lambda device: method(device, call)(**given)


async def started_and_waited_for(device: Any) -> None:
    motion = await settled(device.axis("X").start_move_absolute(counts=9))
    await settled(motion.wait())


async def text(device: Any) -> None:
    await settled(device.switch_to_high_level())
    await settled(device.text("W X"))


async def everything_in_a_block(device: Any) -> None:
    block = device.low_level()
    if hasattr(block, "__aenter__"):
        async with block:
            await started_and_waited_for(device)
        return
    with block:
        await started_and_waited_for(device)


def everything(unit: str) -> dict[str, Do]:
    return {
        **{call.name: doing(call) for call in axis_calls(unit)},
        "is_moving": lambda device: device.axis("X").is_moving(),
        "wait": started_and_waited_for,
        "text": text,
        "low_level": everything_in_a_block,
        "switch_to_low_level": lambda device: device.switch_to_low_level(),
    }


CALLS = [(unit, name) for unit in UNITS for name in everything(unit)]
AFTER = [0.0, 3.0]
"""Seconds until the next request: immediately, and after everything under way has arrived."""
ASKING = ("read_", "is_moving", "move_", "increment_", "wait", "text", "low_level")
"""Calls that wait even on an idle line; other calls cannot be cancelled."""


async def goes_on(device: Any, far: Axes, after: float) -> int:
    """Check that a device works after an interrupted call; return the number of moves before."""
    if after:
        await settled(device.session.pause(after))
    await settled(device.switch_to_low_level())
    moves = far.moves()
    await works(device, far)
    return moves


@pytest.mark.parametrize("after", AFTER)
@pytest.mark.parametrize(("unit", "name"), CALLS)
def test_an_axis_works_after_cancellation_at_every_await(
    unit: str, name: str, after: float
) -> None:
    do = everything(unit)[name]
    cls = getattr(import_module(f"{PACKAGE}.aio"), unit)

    async def once(number: int) -> tuple[bool, int]:
        """Cancel the call at the n-th await; return whether it reached it, and the number of moves."""
        far = Axes(seed=number)
        async with cls.open(AsyncMemoryLink(far), on_close="leave") as device:
            await device.switch_to_low_level()
            await device.session.pause(1)
            reached = await cancelled_at(do(device), number)
            return reached, await goes_on(device, far, after)

    moved = []
    reached, number = True, 0
    while reached:
        number += 1
        reached, moves = stepped.run(once(number))
        moved.append(moves)
    assert max(moved) == moved[-1] <= 1
    assert number > 1 or not name.startswith(ASKING)


@pytest.mark.parametrize("after", AFTER)
@pytest.mark.parametrize(("unit", "name"), CALLS)
def test_an_axis_works_after_an_interrupt_at_every_read(unit: str, name: str, after: float) -> None:
    do = everything(unit)[name]
    cls = getattr(import_module(f"{PACKAGE}.devices"), unit)

    async def once(number: int) -> tuple[bool, int]:
        far = Axes(seed=number)
        link = InterruptedLink(far)
        with cls.open(link, on_close="leave") as device:
            device.switch_to_low_level()
            device.session.pause(1)
            link.left = number
            reached = False
            try:
                await settled(do(device))
            except KeyboardInterrupt:
                reached = True
            link.left = 0
            return reached, await goes_on(device, far, after)

    moved = []
    reached, number = True, 0
    while reached:
        number += 1
        reached, moves = at_once(once(number))
        moved.append(moves)
    assert max(moved) == moved[-1] <= 1
    assert number > 1


WAITING: list[Do] = [
    lambda device: device.axis("X").read_status(),
    lambda device: device.axis("X").write_top_speed(um_per_s=9),
    lambda device: device.axis("X").start_move_absolute(counts=9),
    lambda device: device.axis("X").increment_move_up(),
    lambda device: device.axis("X").write_vector_speed(um_per_s=9),
]


def test_a_call_cancelled_before_it_is_written_is_never_written() -> None:
    """The calls wait for the reply to another read."""
    far = Axes()

    async def main() -> None:
        async with aio.MS2000.open(AsyncMemoryLink(far), on_close="leave") as device:
            await device.switch_to_low_level()
            await device.session.pause(1)
            far.say_so = lambda reply: [(0.2, reply)]
            first = asyncio.ensure_future(device.axis("X").read_motor_position())
            tasks = [asyncio.ensure_future(do(device)) for do in WAITING]
            await asyncio.sleep(0.1)
            far.forget()
            for task in tasks:
                task.cancel()
            await asyncio.wait(tasks)
            assert (await first).message == far.truth(c.ReadMotorPosition)
            await asyncio.sleep(5)
            assert far.raw == b""
            await works(device, far)

    stepped.run(main())


@pytest.mark.parametrize("number", range(len(WAITING)))
def test_a_call_interrupted_before_it_is_written_is_never_written(number: int) -> None:
    """The call waits because of the pacing."""
    far = Axes()
    link = InterruptedLink(far)
    with MS2000.open(link, on_close="leave") as device:
        device.switch_to_low_level()
        link.left = 2  # the first read belongs to the previous command
        far.forget()
        with pytest.raises(KeyboardInterrupt):
            WAITING[number](device)
        device.session.pause(5)
        assert far.raw == b""
        at_once(works(device, far))
