"""Modes of the MS-2000: commands and text are only sent in their own mode, and ``low_level`` blocks."""

from __future__ import annotations

import asyncio
import random
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

import pytest
from proof_calls import arguments, method
from proof_line import SIDES, Side, settled
from proof_ms2000 import HIGH, LOW, NAME, UNITS, Axes, axis_calls, opened, works

from stagewire.errors import ReplyTimeoutError, TransportLostError, WrongModeError


@asynccontextmanager
async def low_level(device: Any) -> AsyncIterator[Any]:
    """Return the block of a device for threads or asyncio."""
    block = device.low_level()
    if hasattr(block, "__aenter__"):
        async with block as same:
            yield same
    else:
        with block as same:
            yield same


async def refuses_commands(device: Any, far: Axes, unit: str) -> None:
    """Check that no call of an axis sends anything, except a stop, which also switches the mode."""
    far.forget()
    draw = random.Random(unit)
    for call in axis_calls(unit):
        if call.kind == "_halt":
            continue
        with pytest.raises(WrongModeError):
            await settled(method(device, call)(**arguments(call, draw, NAME)))
    with pytest.raises(WrongModeError):
        await settled(device.axis("X").is_moving())
    assert far.raw == b""


@pytest.mark.parametrize("side", SIDES, ids=repr)
@pytest.mark.parametrize("unit", UNITS)
def test_commands_and_text_are_refused_in_the_wrong_mode(unit: str, side: Side) -> None:
    """Commands require low-level mode. The mode is unknown at first and after a reset."""
    far = Axes()

    async def scenario(bench: Any) -> None:
        async with opened(bench, unit) as device:
            assert device.mode == "unknown"
            await refuses_commands(device, far, unit)
            with pytest.raises(WrongModeError):
                await settled(device.text("W X"))
            await settled(device.switch_to_high_level())
            assert device.mode == "high_level"
            await refuses_commands(device, far, unit)
            assert await settled(device.text("W X")) == far.line
            async with low_level(device):
                assert device.mode == "low_level"
                far.forget()
                with pytest.raises(WrongModeError):
                    await settled(device.text("W X"))
                assert far.raw == b""
                await works(device, far)
            await refuses_commands(device, far, unit)
            await settled(device.switch_to_low_level())
            await works(device, far)
            await settled(device.reset_controller())
            assert device.mode == "unknown"
            await refuses_commands(device, far, unit)

    side.run(far, scenario)


async def nothing(device: Any, far: Axes) -> None:
    pass


async def question(device: Any, far: Axes) -> None:
    await settled(device.axis("X").read_motor_position())


async def unanswered(device: Any, far: Axes) -> None:
    """Make a request whose reply arrives after the block."""
    far.say_so = lambda reply: [(0.4, reply)]
    with pytest.raises(ReplyTimeoutError):
        await settled(device.axis("X").read_motor_position(timeout=0.2))


async def motion(device: Any, far: Axes) -> None:
    await settled(device.axis("X").start_move_absolute(counts=9))


ENDS = [None, ValueError, KeyboardInterrupt, asyncio.CancelledError, GeneratorExit]


@pytest.mark.parametrize("side", SIDES, ids=repr)
@pytest.mark.parametrize("end", ENDS, ids=lambda end: "well" if end is None else end.__name__)
@pytest.mark.parametrize("within", [nothing, question, unanswered, motion])
def test_a_block_switches_back_however_it_ends(
    within: Any, end: type[BaseException], side: Side
) -> None:
    far = Axes()

    async def block(device: Any) -> None:
        async with low_level(device) as same:
            assert same is device
            assert far.raw == LOW
            await within(device, far)
            far.forget()
            if end is not None:
                raise end("the reason")

    async def scenario(bench: Any) -> None:
        async with opened(bench) as device:
            raised = None
            try:
                await block(device)
            except BaseException as error:
                raised = error
            assert (None if raised is None else type(raised)) is end
            assert raised is None or raised.args == ("the reason",)
            assert far.raw == HIGH
            assert device.mode == "high_level"
            far.renew()
            assert await settled(device.text("W X", timeout=3)) == far.line
            async with low_level(device):
                await works(device, far)

    side.run(far, scenario)


@pytest.mark.parametrize("side", SIDES, ids=repr)
@pytest.mark.parametrize("error", [ValueError, None])
def test_a_block_on_a_lost_line_raises_the_error_from_inside_the_block(
    error: type[Exception] | None, side: Side
) -> None:
    far = Axes()

    async def block(device: Any) -> None:
        async with low_level(device):
            far.unplug()
            if error is not None:
                raise error

    async def scenario(bench: Any) -> None:
        async with opened(bench) as device:
            with pytest.raises(error or TransportLostError):
                await block(device)

    side.run(far, scenario)
    assert far.raw == LOW


@pytest.mark.parametrize("side", SIDES, ids=repr)
def test_commands_are_refused_after_a_nested_block(side: Side) -> None:
    far = Axes()

    async def scenario(bench: Any) -> None:
        async with opened(bench) as device, low_level(device):
            async with low_level(device):
                await settled(device.axis("X").read_status())
            far.forget()
            with pytest.raises(WrongModeError):
                await settled(device.axis("X").move_absolute(counts=3))
            assert far.raw == b""

    side.run(far, scenario)


def test_the_mode_switches_have_the_documented_bytes() -> None:
    assert (LOW, HIGH) == (b"\xff\x42", b"\xff\x41")
