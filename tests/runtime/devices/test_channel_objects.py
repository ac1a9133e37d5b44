"""Channels and paddles as objects: names of their calls, how they are enabled, and a stop of all of them."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest
from inertial_controller import InertialController, channel_of, controller, moves
from recording_link import RecordingLink

import stagewire_virtual as virtual
from stagewire._devices.readiness import switch_of
from stagewire.errors import (
    BadValueError,
    MotionUnderWayError,
    NotReadyError,
    OutOfRangeError,
    UnsupportedError,
)
from stagewire_apt import PROTOCOL, aio, devices
from stagewire_apt.devices.facts import UNITS
from stagewire_virtual.clock import Clock
from stagewire_virtual.linking import AsyncVirtualLink, SteppedLink

WITH_CHANNELS = ("KIM101", "TIM101", "MPC220", "MPC320")


def opened(unit: str) -> tuple[Any, InertialController]:
    line, instrument = controller(unit)
    return getattr(devices, unit).open(SteppedLink(line), line="usb"), instrument


def ids(instrument: InertialController) -> list[int]:
    return [int.from_bytes(frame[:2], "little") for frame in instrument.frames]


@pytest.mark.parametrize("number", [1, 2, 3, 4])
def test_a_kim101_moves_no_channel_that_is_not_enabled(number: int) -> None:
    device, instrument = opened("KIM101")
    with device:
        channel = device.channel(number)
        calls = (
            lambda: channel.move_steps(200), lambda: channel.start_move_steps(200),
            lambda: channel.move_to_steps(5), lambda: channel.jog("FORWARD"),
            lambda: channel.move_absolute(counts=5), lambda: channel.start_move_velocity("FORWARD"),
        )  # fmt: skip
        for call in calls:
            with pytest.raises(NotReadyError, match=r"not enabled .*call enable\(\)") as caught:
                call()
            assert caught.value.causes == ("the channel is not enabled",)
        assert instrument.moved == []


@pytest.mark.parametrize("unit", ["KIM101", "TIM101"])
def test_a_channel_without_a_status_of_its_own_is_stopped_before_it_moves_again(unit: str) -> None:
    with (
        getattr(virtual, unit)().tcp() as server,
        getattr(devices, unit).open(server.url, on_close="leave") as device,
    ):
        channel = device.channel(1)
        channel.enable()
        channel.start_move_to_steps(20000)
        with pytest.raises(MotionUnderWayError, match=r"under way; stop it, or wait for its end$"):
            channel.move_to_steps(5)
        device.close()
        device.reconnect()
        with pytest.raises(MotionUnderWayError, match=r"may still be; stop it$"):
            channel.move_to_steps(5)
        channel.stop()
        channel.move_to_steps(5)


@pytest.mark.parametrize("call", ["home", "jog", "move_start", "start_move_start"])
def test_a_pdxc2_moves_only_while_it_is_enabled(call: str) -> None:
    with virtual.PDXC2() as controller:
        link = RecordingLink(controller)
        with devices.PDXC2.open(link) as device:
            given = ("FORWARD",) if call == "jog" else ()
            link.forget()
            with pytest.raises(NotReadyError, match=r"the channel is disabled .*call enable\(\)"):
                getattr(device, call)(*given)
            assert link.names(PROTOCOL) == ["MOD_REQ_CHANENABLESTATE"]
            device.enable()
            getattr(device, call)(*given)


def test_enabling_a_channel_of_a_kim101_disables_the_others() -> None:
    device, instrument = opened("KIM101")
    with device:
        third, fourth = device.channel(3), device.channel(4)
        third.enable()
        assert (third.is_enabled(), fourth.is_enabled()) == (True, False)
        third.move_steps(200)
        assert instrument.frames[-1][6:12] == bytes((4, 0, 200, 0, 0, 0))
        fourth.enable()
        with pytest.raises(NotReadyError, match="it is channel 4 that can move"):
            third.move_steps(1)
        third.disable()
        assert fourth.is_enabled()
        fourth.disable()
        assert device.get_kcube_chan_enable_mode().mode.name == "NONE"


def test_disabling_one_channel_of_a_pair_leaves_the_other() -> None:
    device, _ = opened("KIM101")
    with device:
        device.set_kcube_chan_enable_mode(mode="CHANNELS_1_AND_2")
        assert [channel.is_enabled() for channel in device.channels] == [True, True, False, False]
        device.channel(1).disable()
        assert device.get_kcube_chan_enable_mode().mode.name == "CHANNEL_2"


def test_no_channel_is_enabled_while_another_moves() -> None:
    device, instrument = opened("KIM101")
    with device:
        device.channel(1).enable()
        instrument.ends = False
        device.channel(1).start_move_steps(10)
        with pytest.raises(MotionUnderWayError, match="enabling this channel disables"):
            device.channel(2).enable()
        assert device.channel(1).is_enabled()


def test_a_tim101_enables_a_channel_before_each_move() -> None:
    device, instrument = opened("TIM101")
    with device:
        for number in (3, 3, 1):
            instrument.frames.clear()
            device.channel(number).move_to_steps(20)
            bit = 1 << number - 1
            assert instrument.frames[0] == bytes((0x10, 0x02, bit, 0x01, 0x50, 0x01))
            assert channel_of(instrument.frames[-1]) == bit
        instrument.ends = False
        device.channel(1).start_move_to_steps(5)
        instrument.frames.clear()
        with pytest.raises(MotionUnderWayError):
            device.channel(2).jog("FORWARD")
        assert instrument.frames == []


@pytest.mark.parametrize(("unit", "last"), [("MPC220", 2), ("MPC320", 3)])
def test_paddles(unit: str, last: int) -> None:
    device, instrument = opened(unit)
    with device:
        assert [device.paddle(n) for n in range(1, last + 1)] == list(device.channels)
        for wrong in (0, last + 1):
            with pytest.raises(OutOfRangeError):
                device.paddle(wrong)
        paddle = device.paddle(2)
        paddle.enable()
        assert (device.paddle(1).is_enabled(), paddle.is_enabled()) == (False, True)
        instrument.frames.clear()
        paddle.move_to(deg=45)
        [move] = [frame for frame in instrument.frames if moves(frame)]
        assert move[:8] == bytes((0x53, 0x04, 6, 0, 0xD0, 0x01, 2, 0))
        with pytest.raises(NotReadyError, match=r"call enable\(\)"):
            device.paddle(1).home()


def test_a_paddle_is_neither_enabled_nor_moved_while_another_moves() -> None:
    device, instrument = opened("MPC320")
    with device:
        device.paddle(1).enable()
        instrument.ends = False
        device.paddle(1).start_move_to(deg=45)
        instrument.frames.clear()
        for call in (device.paddle(2).enable, lambda: device.paddle(2).move_to(deg=1)):
            with pytest.raises(MotionUnderWayError, match="MPC320 channel 1: move_absolute"):
                call()
        assert not {0x0210, 0x0453} & {*ids(instrument)}
        device.stop()
        device.paddle(2).enable()
        assert device.paddle(2).is_enabled()


@pytest.mark.parametrize("unit", WITH_CHANNELS)
def test_a_stop_of_the_device_stops_every_channel(unit: str) -> None:
    device, instrument = opened(unit)
    with device:
        instrument.frames.clear()
        device.stop()
        stop = 0x08D7 if unit == "KIM101" else 0x0465
        assert ids(instrument) == [stop] * len(device.channels)
        assert [channel_of(f) for f in instrument.frames] == [
            1 << n for n in range(len(device.channels))
        ]


def test_a_stop_with_an_invalid_timeout_is_sent() -> None:
    device, instrument = opened("KIM101")
    with device:
        instrument.frames.clear()
        with pytest.raises(BadValueError, match="the stop was sent"):
            device.stop(timeout="soon")
        assert len(instrument.frames) == 4


def test_the_same_calls_for_asyncio() -> None:
    async def run() -> list[bytes]:
        made: list[InertialController] = []

        def instrument(clock: Clock) -> InertialController:
            made.append(InertialController("KIM101", clock))
            return made[-1]

        link = await AsyncVirtualLink.open("virtual://KIM101", instrument)
        async with aio.KIM101.open(link, line="usb") as device:
            with pytest.raises(NotReadyError):
                await device.channel(3).move_steps(200)
            await device.channel(3).enable()
            await device.channel(3).move_steps(200)
            await device.stop()
        return made[0].frames

    assert sum(frame[:2] == b"\xd7\x08" for frame in asyncio.run(run())) == 4


@pytest.mark.parametrize("unit", ["KSC101", "TSC001"])
def test_a_shutter_has_no_move(unit: str) -> None:
    for package in (devices, aio):
        names = dir(getattr(package, unit))
        assert not [name for name in names if name.startswith(("move", "start_move", "jog"))]


@pytest.mark.parametrize(("unit", "steps"), [("PDXC2", 100), ("KIM001", 250)])
def test_the_position_of_a_unit_with_one_channel_is_that_of_its_status(
    unit: str, steps: int
) -> None:
    with (
        getattr(virtual, unit)().tcp() as server,
        getattr(devices, unit).open(server.url) as device,
    ):
        device.enable()
        device.jog("FORWARD")
        assert device.position_counts == steps
        device.jog("REVERSE")
        assert device.position_counts == 0


def _without_a_motor() -> list[str]:
    """Return the units whose channels `enable()` does not enable."""
    return [
        name
        for name, unit in UNITS.items()
        if switch_of(unit) is None and not (unit.enabling and unit.enabling.channels)
    ]


@pytest.mark.parametrize("unit", _without_a_motor())
def test_enabling_a_unit_without_a_motor_names_what_enables_its_channel(unit: str) -> None:
    with (
        getattr(virtual, unit)().tcp() as server,
        getattr(devices, unit).open(server.url) as device,
    ):
        inside = [*getattr(device, "bays", ()), *getattr(device, "channels", ()), device]
        part = next(one for one in inside if hasattr(one, "is_enabled"))
        names = ("set_chan_enable_state", "enable_output")
        calls = [name for name in names if hasattr(part, name)]
        for call in (part.is_enabled, part.enable, part.disable):
            with pytest.raises(UnsupportedError, match="no motor channel that can be") as error:
                call()
            assert all(f"{name}()" in str(error.value) for name in calls)
            assert ("; use " in str(error.value)) is bool(calls)
