"""Code of asyncio users without mistakes; the classes have the same names in another module."""

from __future__ import annotations

import asyncio
from typing import assert_type

from stagewire.devices import AsyncMotion, MotionEnd
from stagewire.framing import Event
from stagewire.sessions import AsyncSubscription
from stagewire_apt import messages as m
from stagewire_apt.aio import BBD102, TDC001, TPZ001
from stagewire_apt.devices import values
from stagewire_ms2000.aio import MS2000


async def one_stage(url: str) -> float:
    """Home a stage and move it."""
    async with TDC001.open(url, stage="Z8", travel_mm=(0, 25)) as tdc:
        assert_type(tdc, TDC001)
        assert_type(await tdc.home(), MotionEnd[None])
        assert_type((await tdc.move_absolute(mm=1.5)).values.position_mm, float)
        motion = await tdc.start_move_relative(mm=-0.5)
        started: AsyncMotion = motion
        assert_type(started.done, bool)
        assert_type((await motion.wait()).values.position, int)
        await motion.stop()
        changed = await tdc.change_vel_params(max_velocity_mm_per_s=2.5)
        assert_type(changed.max_velocity_mm_per_s, float)
        return (await tdc.get_dc_status_update()).position_mm


async def two_bays(url: str) -> None:
    """Both bays move at the same time."""
    async with BBD102.open(url, stages={1: "MLS203", 2: "MLS203"}) as bbd102:
        ends = await asyncio.gather(*(bay.move_absolute(mm=10) for bay in bbd102.bays))
        plain: list[MotionEnd] = [*ends]
        print([end.values.position_mm for end in ends], plain)


async def listen(url: str) -> int:
    """Receive unsolicited messages."""
    async with (
        TDC001.open(url, stage="Z8") as tdc,
        tdc.subscribe(m.MotGetDcStatusUpdate) as updates,
        tdc.subscribe(values.DcStatusUpdate, m.MotMoveHomed) as news,
        tdc.subscribe() as everything,
    ):
        await tdc.start_updates(10)
        async for message in updates:
            assert_type(message, m.MotGetDcStatusUpdate)
            assert_type(message.position, int)
        async for new in news:
            assert_type(new, values.DcStatusUpdate | m.MotMoveHomed)
            if isinstance(new, values.DcStatusUpdate):
                assert_type(new.position_mm, float)
        assert_type(everything, AsyncSubscription[Event])
        return updates.dropped


async def others(url: str) -> float:
    """A piezo and the axes of an MS-2000."""
    async with MS2000.open(url) as ms2000, ms2000.low_level():
        x = ms2000.axis("X")
        await x.move_absolute(um=100)
        assert_type((await x.read_motor_position()).position, int)
    async with TPZ001.open(url, max_volts=75) as tpz001:
        await tpz001.set_output_volts(volts=12.5)
        return (await tpz001.get_output_volts()).volts
