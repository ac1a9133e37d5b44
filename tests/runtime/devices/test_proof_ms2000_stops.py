"""A stop is written immediately, even while a call waits for a reply, for silence, or for a move."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from typing import Any

import pytest
from proof_line import AsyncMemoryLink
from proof_ms2000 import Axes, Said
from proof_queue import QueueLink

import stagewire_virtual as virtual
from stagewire.errors import MotionStoppedError, TransportLostError
from stagewire_ms2000 import MS2000
from stagewire_ms2000 import messages as c
from stagewire_ms2000.aio import MS2000 as AsyncMS2000
from stagewire_virtual import linking, stepped
from stagewire_virtual.linking import SteppedLink

READ, STATUS, STOP = (cls().pack(0x18) for cls in (c.ReadMotorPosition, c.ReadStatus, c.StopMotor))
MOVE = c.WriteTargetPosition(7).pack(0x18)


class Holding(Axes):
    """A controller that holds its replies back until it receives a stop; its moves never end.

    :param answers: whether it answers a status request immediately.
    """

    def __init__(self, answers: bool = False) -> None:
        super().__init__()
        self.lasts = float("inf")
        self.came = threading.Condition()
        self._answers = answers
        self._held: list[tuple[float, bytes | None]] = []

    def take(self, data: bytes) -> Said:
        with self.came:
            said = list(super().take(data))
            self.came.notify_all()
        if STOP not in self.raw and not (self._answers and data == STATUS):
            self._held += said
            return []
        held, self._held = self._held, []
        return held + said

    def wait_for(self, raw: bytes) -> None:
        """Wait until these bytes have been received."""
        with self.came:
            assert self.came.wait_for(lambda: raw in self.raw, 30)


# Threads, in real time: a stop that waited for a reply would deadlock.


@contextmanager
def threads(far: Holding, background: bool) -> Iterator[tuple[Any, ThreadPoolExecutor]]:
    far.now = time.monotonic
    with (
        MS2000.open(QueueLink(far), background=background, timeout=30, on_close="leave") as device,
        ThreadPoolExecutor(4) as pool,
    ):
        device.switch_to_low_level()
        far.forget()
        yield device.axis("X"), pool


@pytest.mark.parametrize("background", [True, False])
def test_a_stop_is_written_during_a_read(background: bool) -> None:
    far = Holding()
    with threads(far, background) as (axis, pool):
        reads = [pool.submit(axis.read_motor_position) for _ in range(3)]
        far.wait_for(READ)
        assert axis.stop() is None
        assert far.raw.startswith(READ + STOP)
        for read in reads:
            assert read.result(30).message == far.truth(c.ReadMotorPosition)
    assert far.raw == READ + STOP + READ + READ


@pytest.mark.parametrize("answers", [True, False], ids=["between polls", "during a poll"])
@pytest.mark.parametrize("background", [True, False])
def test_a_stop_is_written_during_a_move(background: bool, answers: bool) -> None:
    far = Holding(answers)
    with threads(far, background) as (axis, pool):
        move = pool.submit(axis.move_absolute, counts=7)
        far.wait_for(MOVE + STATUS)
        assert axis.stop() is None
        assert STOP in far.raw  # only the stop can end the move
        with pytest.raises(MotionStoppedError):
            move.result(30)
        assert not axis.is_moving()
    assert far.names().count("STOP_MOTOR") == far.moves() == 1


@pytest.mark.parametrize("background", [True, False])
def test_a_stop_ends_a_motion_for_which_another_thread_waits(background: bool) -> None:
    far = Holding()
    with threads(far, background) as (axis, pool):
        motion = axis.start_move_absolute(counts=7)
        waiting = pool.submit(motion.wait)
        far.wait_for(MOVE + STATUS)
        motion.stop()
        with pytest.raises(MotionStoppedError):
            waiting.result(30)
    assert far.raw.startswith(MOVE + STATUS + STOP)
    assert far.moves() == 1


# asyncio, in simulated time: the stop is written without any delay.


def stepping(far: Holding, scenario: Any) -> None:
    async def main() -> None:
        link = AsyncMemoryLink(far)
        async with AsyncMS2000.open(link, timeout=30, on_close="leave") as device:
            await device.switch_to_low_level()
            await device.session.pause(1)
            far.forget()
            await scenario(device.axis("X"))

    stepped.run(main())


def test_a_stop_is_written_during_a_read_in_asyncio() -> None:
    far = Holding()

    async def scenario(axis: Any) -> None:
        reads = [asyncio.ensure_future(axis.read_motor_position()) for _ in range(3)]
        await asyncio.sleep(5)
        assert far.raw == READ
        begin = far.now()
        assert await axis.stop() is None
        assert far.now() == begin
        assert far.raw == READ + STOP
        for read in reads:
            assert (await read).message == far.truth(c.ReadMotorPosition)

    stepping(far, scenario)
    assert far.raw == READ + STOP + READ + READ


@pytest.mark.parametrize("after", [0.0, 0.001, 0.05, 0.1, 0.1001, 0.25, 5.0])
@pytest.mark.parametrize("answers", [True, False])
def test_a_stop_is_written_during_a_move_in_asyncio(after: float, answers: bool) -> None:
    """The stop is sent before the first poll, during a poll, and between two polls."""
    far = Holding(answers)

    async def scenario(axis: Any) -> None:
        move = asyncio.ensure_future(axis.move_absolute(counts=7))
        await asyncio.sleep(after)
        begin, before = far.now(), far.raw
        assert await axis.stop() is None
        assert far.now() == begin
        assert far.raw == before + STOP
        with pytest.raises(MotionStoppedError):
            await move
        assert not await axis.is_moving()

    stepping(far, scenario)
    assert far.moves() == 1
    assert far.raw.startswith(MOVE)


def test_a_stop_is_written_while_a_read_waits_for_silence() -> None:
    far = Holding()

    async def scenario(axis: Any) -> None:
        far.say(b"\0")
        await asyncio.sleep(0.01)
        read = asyncio.ensure_future(axis.read_motor_position())
        await asyncio.sleep(0.01)
        assert far.raw == b""
        await axis.stop()
        assert far.raw == STOP
        assert (await read).message == far.truth(c.ReadMotorPosition)

    stepping(far, scenario)
    assert far.raw == STOP + READ


CUT_OFF = bytes.fromhex("18 54 03 a0 86 01 3a")


@pytest.mark.parametrize("cut", range(1, len(CUT_OFF)))
@pytest.mark.parametrize("closes", [False, True], ids=["stop", "close"])
def test_a_stop_works_after_a_command_that_was_cut_off(
    cut: int, closes: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The controller holds half a command, and reads the first stop as the rest of it."""
    controller = virtual.MS2000(strategies={"power_on_mode": "low"})

    def open_link(url: str, settings: object) -> SteppedLink:
        controller.plug_in()
        return SteppedLink(controller)

    monkeypatch.setattr(linking, "open_link", open_link)
    ms2000 = MS2000.open("virtual://kept", background=False, reconnect_pause=0)
    x = ms2000.axis("X")
    ms2000.switch_to_low_level()
    x.start_move_absolute(um=90_000)
    controller.advance(0.2)
    controller.write(CUT_OFF[:cut])
    controller.unplug()
    with pytest.raises(TransportLostError):
        x.is_moving()
    ms2000.reconnect()
    if closes:
        ms2000.close()
    else:
        x.stop()
    controller.advance(3)
    positions = []
    for _ in range(2):
        with MS2000.open(SteppedLink(controller)) as again:
            again.switch_to_low_level()
            positions.append(again.axis("X").read_motor_position().position)
        controller.advance(1)
    assert positions[0] == positions[1]
    ms2000.close()
