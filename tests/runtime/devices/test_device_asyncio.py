"""The classes for asyncio: the same calls with the same logic, in one event loop."""

from __future__ import annotations

import asyncio
import inspect
from collections.abc import Awaitable, Callable
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest

from stagewire import support
from stagewire.errors import (
    LimitError,
    MotionStoppedError,
    MotionTimeoutError,
    MotionUnderWayError,
    SessionClosedError,
    TransportError,
    WrongModeError,
    WrongUnitError,
)
from stagewire.framing import Received
from stagewire.links import AsyncLink, open_async_link
from stagewire_apt import messages as m
from stagewire_apt.aio import BBD102, BPC201, BSC002, MST601, TDC001
from stagewire_ms2000.aio import MS2000
from stagewire_virtual import stepped

Z8 = "virtual://TDC001?stage=Z8&travel=411648"


def run(main: Callable[[], Awaitable[None]]) -> None:
    async def body() -> None:
        await main()

    stepped.run(body())


def test_a_device_that_is_not_open_yet_raises_a_helpful_error() -> None:
    with pytest.raises(AttributeError, match="is not open yet and has no attribute 'home': await"):
        TDC001.open(Z8).home()  # type: ignore[attr-defined]
    with pytest.raises(TypeError, match="use `async with` or `await`"), TDC001.open(Z8):  # type: ignore[attr-defined]
        pass


def test_after_reconnecting_a_motion_may_still_be_under_way() -> None:
    async def main() -> None:
        async with TDC001.open(Z8, stage="Z8", on_close="leave") as tdc:
            await tdc.start_move_absolute(mm=5)
            await tdc.reconnect()
            with pytest.raises(
                MotionUnderWayError, match="when its line was lost or closed, and may still"
            ):
                await tdc.start_move_absolute(mm=1)
            await asyncio.sleep(1)
            assert not await tdc.is_moving()  # such a URL opens a new controller
            await tdc.move_absolute(mm=1)

    run(main)


def test_modules_of_a_rack_share_a_line() -> None:
    async def main() -> None:
        url = "virtual://rack?bays=MST601,MST601"
        async with MST601.open(url, bay=1, stage="APT_STEPPER") as first:
            async with MST601.open(first, bay=2, stage="APT_STEPPER") as second:
                ends = await asyncio.gather(
                    *(module.channel(1).move_absolute(mm=0.1) for module in (first, second))
                )
                assert [end.message.position for end in ends] == [2560, 2560]
                motion = await second.channel(1).start_move_absolute(mm=5)
                await asyncio.sleep(0.1)
            with pytest.raises(
                SessionClosedError, match=r"this device on virtual://rack.* was closed"
            ):
                await motion.wait()
            await asyncio.sleep(2)
            async with MST601.open(first, bay=2, stage="APT_STEPPER") as second:
                assert (await second.channel(1).get_pos_counter()).position < 2 * 25600
            assert not await first.channel(1).is_moving()

    run(main)


def test_a_device_can_be_awaited_or_entered() -> None:
    async def main() -> None:
        async with TDC001.open(Z8, stage="Z8", travel_mm=12) as tdc:
            assert (await tdc.home()).message == m.MotMoveHomed(chan_ident=1)
            end = await tdc.move_absolute(mm="1.5")
            assert end.values is not None
            assert end.values.exact("position_mm") == 1.5
            with pytest.raises(LimitError):
                await tdc.move_absolute(mm=13)
            changed = await tdc.change_vel_params(max_velocity_mm_per_s=1)
            assert changed == await tdc.get_vel_params()
        assert tdc.session.closed
        tdc = await TDC001.open(Z8)
        assert tdc.serial_number is not None
        assert str(tdc).startswith("TDC001: ")
        await tdc.reconnect()
        await tdc.close()
        await tdc.close()

    run(main)


def test_motions_can_be_started_awaited_and_stopped() -> None:
    async def main() -> None:
        async with TDC001.open(Z8, stage="Z8") as tdc:
            motion = await tdc.start_move_absolute(mm=5)
            with pytest.raises(MotionUnderWayError):
                await tdc.home()
            with pytest.raises(MotionTimeoutError):
                await motion.wait(0.1)
            assert await tdc.is_moving()
            assert not motion.done
            assert await motion.stop() is not None
            assert motion.done
            with pytest.raises(MotionStoppedError):
                await motion.wait()

    run(main)


def test_cancelling_a_wait_stops_neither_the_motion_nor_the_session() -> None:
    async def main() -> None:
        async with TDC001.open(Z8, stage="Z8") as tdc:
            move = asyncio.create_task(tdc.move_absolute(mm=5))
            await asyncio.sleep(0.5)
            move.cancel()
            with pytest.raises(asyncio.CancelledError):
                await move
            assert await tdc.is_moving()
            await tdc.stop()
            await tdc.move_absolute(mm=0)

    run(main)


def test_concurrent_changes_by_tasks_are_all_kept() -> None:
    async def main() -> None:
        async with TDC001.open("virtual://TDC001") as tdc:
            await tdc.set_vel_params(min_velocity=0, acceleration=0, max_velocity=0)
            await asyncio.gather(
                tdc.change_vel_params(min_velocity=1),
                tdc.change_vel_params(acceleration=2),
                tdc.change_vel_params(max_velocity=3),
            )
            values = await tdc.get_vel_params()
            assert (values.min_velocity, values.acceleration, values.max_velocity) == (1, 2, 3)

    run(main)


def test_bays_channels_modules_and_settings() -> None:
    async def main() -> None:
        async with BBD102.open("virtual://BBD102?stage=MLS203", stage="MLS203") as rack:
            homed = rack.bay(2).subscribe()
            await asyncio.gather(*(bay.home() for bay in rack.bays))
            event = await homed.get(1)
            assert isinstance(event, Received)
            assert (event.frame.source, type(event.frame.message)) == (0x22, m.MotMoveHomed)
        async with BSC002.open("virtual://BSC002", stages={2: "APT_STEPPER"}) as device:
            await device.channel(2).set_pos_counter(mm=1)
            assert (await device.channel(2).get_pos_counter()).position == 25600
        async with MST601.open("virtual://rack?bays=,MST601", bay=2) as module:
            assert (await module.channel(1).get_pos_counter()).position == 0
        async with BPC201.open("virtual://BPC201") as bpc:
            await bpc.set_output_volts(volts=30)
            assert (await bpc.get_output_volts()).voltage == 13107

    run(main)


def test_axes_are_polled_for_the_end_of_a_motion() -> None:
    async def main() -> None:
        async with MS2000.open("virtual://MS2000") as ms:
            x = ms.axis("X")
            with pytest.raises(WrongModeError):
                await x.move_absolute(um=1)
            async with ms.low_level():
                await x.move_absolute(um=1500)
                assert (await x.read_motor_position()).um == pytest.approx(1500, abs=1)
                motion = await x.start_move_absolute(um=9000)
                await x.stop()
                with pytest.raises(MotionStoppedError):
                    await motion.wait()
            assert (await ms.text("W X")).startswith(":A")

    run(main)


class Watched(AsyncLink):
    """A line that records whether it was closed."""

    def __init__(self, line: AsyncLink) -> None:
        self.url = line.url
        self.closed = False
        self.start = line.start  # type: ignore[method-assign]
        self.write = line.write  # type: ignore[method-assign]
        self.write_now = line.write_now  # type: ignore[method-assign]
        self._line = line

    def start(self, received: Any, lost: Any) -> None:
        raise NotImplementedError  # pragma: no cover

    write = write_now = start  # type: ignore[assignment]

    async def close(self) -> None:
        self.closed = True
        await self._line.close()


def test_the_line_is_closed_if_opening_fails(tmp_path: Path) -> None:
    async def main() -> None:
        for unit, options in (
            ("TST001", {}),
            ("TDC001", {"log": tmp_path / "missing" / "log.txt"}),
        ):
            line = Watched(await open_async_link(f"virtual://{unit}"))
            with pytest.raises((WrongUnitError, TransportError)):
                await TDC001.open(line, **options)  # type: ignore[arg-type]
            assert line.closed
        with pytest.raises(WrongUnitError):
            async with TDC001.open("virtual://TST001"):
                pass  # pragma: no cover

    run(main)


# Threads and asyncio compared


def _public(cls: type) -> dict[str, Any]:
    names = (name for name in dir(cls) if not name.startswith("__"))
    return {name: inspect.getattr_static(cls, name) for name in names}


@pytest.mark.parametrize(
    "name", [name for name in support.__all__ if f"Async{name}" in support.__all__]
)
def test_both_base_classes_have_the_same_calls(name: str) -> None:
    one, other = _public(getattr(support, name)), _public(getattr(support, f"Async{name}"))
    assert one.keys() == other.keys()
    for called in one:
        if inspect.isfunction(one[called]):
            parameters = inspect.signature(one[called]).parameters.keys()
            assert parameters == inspect.signature(other[called]).parameters.keys(), called


@pytest.mark.parametrize("package", ["stagewire_apt", "stagewire_ms2000"])
def test_every_unit_has_the_same_calls_in_both(package: str) -> None:
    units = import_module(f"{package}.devices.units")
    others = import_module(f"{package}.aio")
    for name in units.__all__:
        assert _public(getattr(units, name)).keys() == _public(getattr(others, name)).keys()
