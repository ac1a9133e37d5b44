"""Subscriptions to classes of messages or values."""

from __future__ import annotations

from typing import Any

import pytest
from proof_controller import HOST, Controller
from proof_line import SIDES, Side, settled

from stagewire import Scale, Stage
from stagewire.errors import BadValueError, OutOfRangeError
from stagewire.framing import Event
from stagewire_apt import messages as m
from stagewire_apt.devices import values as v
from stagewire_ms2000 import messages as ms
from stagewire_ms2000.devices import values as ms_values

USB = 0x50
each_side = pytest.mark.parametrize("side", SIDES, ids=repr)


def status(position: int, channel: int = 1) -> m.MotGetDcStatusUpdate:
    return m.MotGetDcStatusUpdate(chan_ident=channel, position=position, velocity=0, status_bits=0)


def at(position: int, channel: int = 1) -> m.MotGetStatusUpdate:
    return m.MotGetStatusUpdate(chan_ident=channel, position=position, enc_count=0, status_bits=0)


def taken(subscription: Any) -> list[Any]:
    found = []
    while (one := subscription.take()) is not None:
        found.append(one)
    return found


@each_side
def test_subscriptions_return_messages_and_values(side: Side) -> None:
    far = Controller()

    async def scenario(bench: Any) -> None:
        async with bench.open("TDC001", identify=False, stage="Z8") as device:
            messages = device.subscribe(m.MotGetDcStatusUpdate)
            values = device.subscribe(v.DcStatusUpdate)
            several = device.subscribe(v.DcStatusUpdate, m.MotMoveHomed, m.HwDisconnect)
            everything = device.subscribe()
            said = [status(34304), m.MotMoveHomed(chan_ident=1)]
            far.say(b"".join(message.pack(HOST, USB) for message in said))
            assert await settled(messages.get(1)) == said[0]
            await bench.sleep(0.1)
            got = await settled(values.get(1))
            assert type(got) is v.DcStatusUpdate
            assert (got.position, got.position_mm) == (34304, 1.0)
            assert [type(one) for one in taken(several)] == [v.DcStatusUpdate, m.MotMoveHomed]
            events = taken(everything)
            assert all(isinstance(event, Event) for event in events)
            assert [event.frame.message for event in events] == said
            assert not taken(messages)
            assert not taken(values)

    side.run(far, scenario)


@each_side
def test_a_subscription_excludes_other_forms_of_a_message(side: Side) -> None:
    far = Controller()
    header = m.MotMoveCompletedHeader(chan_ident=1)
    data = m.MotMoveCompletedDc(chan_ident=1, position=1, velocity=0, status_bits=0)

    async def scenario(bench: Any) -> None:
        async with bench.open("TDC001", identify=False) as device:
            short = device.subscribe(m.MotMoveCompletedHeader, limit=1)
            long = device.subscribe(v.MoveCompletedDc, limit=1)
            other = device.subscribe(m.MotMoveCompletedStepper)
            far.say(header.pack(HOST, USB) + data.pack(HOST, USB))
            await bench.sleep(0.1)
            assert taken(short) == [header]
            assert [one.message for one in taken(long)] == [data]
            assert not taken(other)
            assert (short.dropped, long.dropped) == (0, 0)

    side.run(far, scenario)


@each_side
def test_a_rack_subscription_uses_the_scale_of_each_bay(side: Side) -> None:
    far = Controller()
    mine = Stage.of_user("mine", position=Scale.counts_per("mm", 1000))

    async def scenario(bench: Any) -> None:
        async with bench.open("BBD102", identify=False, stages={1: "MLS203", 2: mine}) as rack:
            every = rack.subscribe(v.DcStatusUpdate)
            second = rack.bay(2).subscribe(v.DcStatusUpdate)
            swapped, unswapped = (HOST, 0x21), (0x22, HOST)
            far.say(status(20000).pack(*swapped) + status(20000).pack(*unswapped))
            await bench.sleep(0.1)
            assert [one.position_mm for one in taken(every)] == [1, 20]
            assert [one.position_mm for one in taken(second)] == [20]

    side.run(far, scenario)


@each_side
def test_a_device_subscription_uses_the_scale_of_each_channel(side: Side) -> None:
    far = Controller()

    async def scenario(bench: Any) -> None:
        async with bench.open("BSC002", identify=False, stages={2: "APT_STEPPER"}) as device:
            every = device.subscribe(v.StatusUpdate)
            second = device.channel(2).subscribe(v.StatusUpdate, m.MotMoveHomed)
            far.say(at(25600).pack(HOST, USB) + at(25600, 2).pack(HOST, USB))
            await bench.sleep(0.1)
            first, other = taken(every)
            assert dict(first.known()).get("position_mm") is None
            assert other.position_mm == 1
            assert [one.position_mm for one in taken(second)] == [1]

    side.run(far, scenario)


@each_side
def test_a_module_subscription_excludes_other_modules_on_its_line(side: Side) -> None:
    far = Controller()

    async def scenario(bench: Any) -> None:
        async with bench.open("MST601", identify=False, bay=2, stage="APT_STEPPER") as module:
            updates = module.subscribe(v.StatusUpdate)
            far.say(at(1).pack(HOST, 0x21) + at(25600).pack(HOST, 0x22))
            await bench.sleep(0.1)
            assert [one.position_mm for one in taken(updates)] == [1]

    side.run(far, scenario)


@each_side
def test_values_use_the_scale_in_effect_when_they_are_taken(side: Side) -> None:
    far = Controller()
    update = m.PzGetPzStatusUpdate(chan_ident=1, op_voltage=32767, position=0, status_bits=0)

    async def scenario(bench: Any) -> None:
        async with bench.open("BPC201", identify=False) as device:
            updates = device.subscribe(v.PzStatusUpdate)
            for volts in (75, 150):
                maximum = m.PzGetOutputMaxVolts(chan_ident=1, voltage=10 * volts, flags=0)
                far.say(maximum.pack(HOST, USB) + update.pack(HOST, USB))
                assert (await settled(updates.get(1))).op_voltage_volts == volts

    side.run(far, scenario)


WRONG = [
    ("MOT_GET_DCSTATUSUPDATE",),
    (v,),
    (Event,),
    (v.VelParams, ms_values.MotorPosition),
    (ms.ReadMotorPositionReply,),
    ((m.MotMoveHomed, m.MotMoveStoppedDc),),
]


@pytest.mark.parametrize("wrong", WRONG, ids=str)
@each_side
def test_an_invalid_class_is_refused(wrong: tuple[Any, ...], side: Side) -> None:
    async def scenario(bench: Any) -> None:
        async with bench.open("TDC001", identify=False) as device:
            with pytest.raises(
                BadValueError, match=r"cannot subscribe to .* or of stagewire_apt\.devices\.values"
            ):
                device.subscribe(*wrong)
            with pytest.raises(
                BadValueError, match="MotGetDcStatusUpdate both as message and as values"
            ):
                device.subscribe(m.MotGetDcStatusUpdate, v.DcStatusUpdate)
            with pytest.raises(OutOfRangeError, match="at least 1, not 0"):
                device.subscribe(v.DcStatusUpdate, limit=0)

    side.run(Controller(), scenario)
