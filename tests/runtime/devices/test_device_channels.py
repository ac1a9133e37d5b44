"""Bays, channels and modules, each with its own address, stage, scale and travel."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from recording_link import RecordingLink

import stagewire_virtual as virtual
from stagewire.errors import (
    BadValueError,
    LimitError,
    OutOfRangeError,
    ReplyTimeoutError,
    SessionClosedError,
    UnknownScaleError,
)
from stagewire_apt import BBD102, BSC002, MPZ601, MST601, TDC001, devices, stages
from stagewire_apt import enumerations as e
from stagewire_apt import messages as m


def test_bays_are_numbered_like_the_documented_addresses() -> None:
    line = RecordingLink(virtual.BBD102(stage=stages.MLS203))
    with BBD102.open(line, stage="MLS203", line="rs232") as rack:
        line.forget()
        rack.bay(2).set_vel_params(
            min_velocity=0, acceleration_mm_per_s2=10, max_velocity_mm_per_s=99
        )
        expected = m.MotSetVelParams(
            chan_ident=1, min_velocity=0, acceleration=137, max_velocity=13287555
        )
        assert line.raw == expected.pack(0x22, 0x01)
        assert rack.bays == (rack.bay(1), rack.bay(2))


@pytest.mark.parametrize("unit", ["BSC001", "BSC102", "MST601", "OST001", "TST001"])
def test_a_stepper_can_be_asked_for_its_status_bits_only(unit: str) -> None:
    cls, options = getattr(devices, unit), {"bay": 1} if unit == "MST601" else {}
    url = "virtual://rack?bays=MST601" if unit == "MST601" else f"virtual://{unit}"
    with cls.open(url, **options) as device:
        motor = device.bay(1) if unit == "BSC102" else device
        motor = device.channel(2) if unit == "MST601" else motor
        values = motor.get_status_bits()
        assert values.status_bits.settled
        assert not values.status_bits.homed
        assert values.chan_ident == (2 if unit == "MST601" else 1)


def test_calls_of_a_rack_go_to_the_motherboard() -> None:
    line = RecordingLink(virtual.BBD102(empty_bays=[2]))
    with BBD102.open(line, line="rs232") as rack:
        line.forget()
        assert rack.get_bay_used(bay_ident=e.RackBay.BAY_2).bay_state is e.BayState.EMPTY
        assert line.raw == m.RackReqBayUsed(bay_ident=1).pack(0x11, 0x01)
        with pytest.raises(ReplyTimeoutError):
            rack.bay(2).get_vel_params(timeout=0.1)


def test_bays_move_simultaneously_and_end_independently() -> None:
    with BBD102.open(RecordingLink(virtual.BBD102(stage=stages.MLS203)), stage="MLS203") as rack:
        for bay in rack.bays:
            bay.home()
        far = rack.bay(1).start_move_absolute(mm=50)
        near = rack.bay(2).start_move_absolute(mm=1)
        assert near.wait().values is not None
        assert not far.done
        assert rack.bay(1).is_moving()
        assert not rack.bay(2).is_moving()
        assert far.wait().values is not None
        assert [bay.get_pos_counter().mm for bay in rack.bays] == [50, 1]


def test_closing_a_rack_stops_all_bays() -> None:
    line = RecordingLink(virtual.BBD102(stage=stages.MLS203))
    with BBD102.open(line, stage="MLS203", line="rs232") as rack:
        for bay in rack.bays:
            bay.start_home()
        line.forget()
    stop = m.MotMoveStop(chan_ident=1, stop_mode=e.StopMode.PROFILED)
    assert sorted(line.raw[n : n + 6] for n in (0, 6)) == [
        stop.pack(0x21, 0x01),
        stop.pack(0x22, 0x01),
    ]


@pytest.mark.parametrize(
    ("number", "error"),
    [(0, OutOfRangeError), (3, OutOfRangeError), (True, BadValueError), ("1", BadValueError)],
)
def test_an_unknown_bay_or_channel_is_refused(number: object, error: type[Exception]) -> None:
    with BBD102.open(RecordingLink(virtual.BBD102())) as rack, pytest.raises(error, match="bay"):
        rack.bay(number)  # type: ignore[arg-type]
    with (
        BSC002.open(RecordingLink(virtual.BSC002())) as device,
        pytest.raises(error, match="channel"),
    ):
        device.channel(number)  # type: ignore[arg-type]


def test_channels_have_their_own_stages_and_travels() -> None:
    line = RecordingLink(virtual.BSC002(stage=stages.APT_STEPPER))
    with BSC002.open(line, stages={1: "APT_STEPPER"}, travel_mm={1: 10}, line="rs232") as device:
        first, second = device.channels
        line.forget()
        first.set_move_abs_params(mm=2)
        second.set_move_abs_params(absolute_position=3)
        assert line.raw == b"".join(
            (
                m.MotSetMoveAbsParams(chan_ident=1, absolute_position=51200).pack(0x50, 0x01),
                m.MotSetMoveAbsParams(chan_ident=2, absolute_position=3).pack(0x50, 0x01),
            )
        )
        with pytest.raises(UnknownScaleError):
            second.set_move_abs_params(mm=2)
        with pytest.raises(LimitError):
            first.move_absolute(mm=11)
        second.move_absolute(counts=25600 * 11)


def test_a_channel_is_selected_by_number_member_or_name() -> None:
    line = RecordingLink(virtual.BSC002())
    with BSC002.open(line, identify=False) as bsc:
        line.forget()
        for second in (2, e.Channel.CHAN2, "CHAN2", "chan2", np.uint8(2)):
            assert bsc.channel(second) is bsc.channels[1]
        for wrong in ("CHAN3", "2", True, 2.0, e.RackBay.BAY_2, None):
            with pytest.raises(BadValueError, match="is not one of 1, 2, CHAN1, CHAN2"):
                bsc.channel(wrong)  # type: ignore[arg-type]
        assert line.raw == b""


def test_a_bay_is_selected_by_number_only() -> None:
    """The enumeration of bays is 0-based: its BAY_2 is 1."""
    with BBD102.open(RecordingLink(virtual.BBD102()), identify=False) as rack:
        assert rack.bay(np.int8(2)) is rack.bays[1]
        for wrong in (e.RackBay.BAY_2, e.Channel.CHAN1, "BAY_2", True):
            with pytest.raises(BadValueError, match=r"BBD102 bay .* is not one of 1, 2"):
                rack.bay(wrong)  # type: ignore[arg-type]


def test_channels_move_simultaneously() -> None:
    line = RecordingLink(virtual.BSC002(stage=stages.APT_STEPPER))
    with BSC002.open(line, stage="APT_STEPPER") as device:
        motions = [channel.start_home() for channel in device.channels]
        ends = [motion.wait().message for motion in motions]
        assert ends == [m.MotMoveHomed(chan_ident=1), m.MotMoveHomed(chan_ident=2)]


def test_calls_of_a_module_go_to_its_bay() -> None:
    line = RecordingLink(virtual.rack("MST601", None, "MST601"))
    with MST601.open(line, bay=3, stage="APT_STEPPER", line="rs232") as module:
        line.forget()
        module.channel(2).set_pos_counter(mm=1)
        expected = m.MotSetPosCounter(chan_ident=2, position=25600)
        assert line.raw == expected.pack(0x23, 0x01)
        line.forget()
        assert module.get_bay_used(bay_ident=1).bay_state is e.BayState.EMPTY
        assert line.raw == m.RackReqBayUsed(bay_ident=1).pack(0x11, 0x01)


def test_a_cube_also_answers_at_its_other_addresses() -> None:
    line = RecordingLink(virtual.TDC001())
    with TDC001.open(line, address=0x21) as tdc:
        line.forget()
        assert tdc.get_pos_counter().position == 0
        assert line.raw == m.MotReqPosCounter(chan_ident=1).pack(0x21, 0x01)


# Subscriptions


def test_a_bay_subscription_receives_only_events_of_its_bay() -> None:
    with BBD102.open(RecordingLink(virtual.BBD102(stage=stages.MLS203)), stage="MLS203") as rack:
        everything, second = rack.subscribe(), rack.bay(2).subscribe()
        for bay in rack.bays:
            bay.start_home()
        rack.session.pause(10)
        assert {event.frame.source for event in taken(everything)} == {0x21, 0x22}
        assert [event.frame.source for event in taken(second)] == [0x22]


# Several modules on one line


def test_modules_of_a_rack_share_a_line() -> None:
    line = RecordingLink(virtual.rack("MST601", None, "MPZ601", "MST601"))
    with MST601.open(line, bay=1, stage="APT_STEPPER") as first:
        fourth = MST601.open(first, bay=4, stage="APT_STEPPER", travel_mm=5)
        piezo = MPZ601.open(fourth, bay=3)
        assert fourth.session is piezo.session is first.session
        motions = [
            module.channel(number).start_move_absolute(mm=0.1 * number)
            for module in (first, fourth)
            for number in (1, 2)
        ]
        ends = [motion.wait().values for motion in motions]
        assert [float(values.exact("position_mm")) for values in ends if values] == [0.1, 0.2] * 2
        with pytest.raises(LimitError):
            fourth.channel(1).move_absolute(mm=6)
        line.forget()
        first.session.pause(0.5)
        alive = {0x21: m.MotAckDcStatusUpdate(), 0x23: m.PzAckPzStatusUpdate()}
        alive[0x24] = alive[0x21]
        assert line.raw == b"".join(alive[bay].pack(bay, 0x01) for bay in (0x21, 0x24, 0x23))


def test_closing_a_module_leaves_the_shared_line_open() -> None:
    line = RecordingLink(virtual.rack("MST601", "MST601"))
    with MST601.open(line, stage="APT_STEPPER") as first:
        second = MST601.open(first, bay=2, stage="APT_STEPPER")
        going = first.channel(1).start_move_absolute(mm=5)
        motion = second.channel(2).start_move_absolute(mm=5)
        first.session.pause(0.1)
        line.forget()
        second.close()
        second.close()
        stop = m.MotMoveStop(chan_ident=2, stop_mode=e.StopMode.PROFILED)
        assert line.raw == stop.pack(0x22, 0x01)
        for call in (motion.wait, second.channel(1).is_moving, second.get_info):
            with pytest.raises(SessionClosedError, match=r"this device on virtual://.* was closed"):
                call()
        assert str(second).startswith("MST601")
        line.forget()
        first.session.pause(1)
        assert line.raw == m.MotAckDcStatusUpdate().pack(0x21, 0x01) * 3  # at 0, 0.5 and 1 s
        assert not going.done
        line.forget()
    assert line.raw == m.MotMoveStop(chan_ident=1, stop_mode=e.StopMode.PROFILED).pack(0x21, 0x01)


def test_closing_the_shared_line_stops_and_closes_its_modules() -> None:
    line = RecordingLink(virtual.rack("MST601", "MST601"))
    first = MST601.open(line, stage="APT_STEPPER")
    second = MST601.open(first, bay=2, stage="APT_STEPPER")
    second.channel(1).start_move_absolute(mm=5)
    line.forget()
    first.close()
    assert m.MotMoveStop(chan_ident=1, stop_mode=e.StopMode.PROFILED).pack(0x22, 0x01) in line.raw
    with pytest.raises(SessionClosedError):
        second.channel(1).is_moving()
    second.close()


def test_failing_to_open_a_missing_module_does_not_affect_the_shared_line() -> None:
    line = RecordingLink(virtual.rack("MST601", None))
    with MST601.open(line) as first:
        with pytest.raises(ReplyTimeoutError, match="no MST601 answers"):
            MST601.open(first, bay=2, timeout=0.3)
        line.forget()
        first.session.pause(1)
        assert line.raw == m.MotAckDcStatusUpdate().pack(0x21, 0x01) * 3  # at 0, 0.5 and 1 s
        with pytest.raises(BadValueError, match="pacing: the line was opened by MST601"):
            MST601.open(first, bay=2, pacing=0.1)
        with pytest.raises(BadValueError, match="a TDC001 cannot share the line of a MST601"):
            TDC001.open(first)  # type: ignore[arg-type]


def test_a_channel_subscription_receives_only_events_of_its_channel() -> None:
    line = RecordingLink(virtual.BSC002(stage=stages.APT_STEPPER))
    with BSC002.open(line, stage="APT_STEPPER") as device:
        everything = device.channel(2).subscribe()
        homed = device.channel(2).subscribe(m.MotMoveHomed)
        both = device.subscribe(m.MotMoveHomed)
        device.start_updates()
        for channel in device.channels:
            channel.start_home()
        device.session.pause(10)
        device.stop_updates()
        assert [message.chan_ident for message in taken(homed)] == [2]
        assert {message.chan_ident for message in taken(both)} == {1, 2}
        said = {type(event.frame.message) for event in taken(everything)}
        assert said == {m.MotMoveHomed, m.MotGetStatusUpdate}


def taken(subscription: Any) -> list[Any]:
    found = []
    while (event := subscription.take()) is not None:
        found.append(event)
    return found


def test_a_message_is_converted_to_values() -> None:
    with TDC001.open(RecordingLink(virtual.TDC001()), stage="Z8") as tdc:
        status = m.MotGetDcStatusUpdate(chan_ident=1, position=34304, velocity=0, status_bits=0)
        values = tdc.values(status)
        assert values is not None
        assert values.exact("position_mm") == 1
        assert tdc.values(m.MotMoveHomed(chan_ident=1)) is None
