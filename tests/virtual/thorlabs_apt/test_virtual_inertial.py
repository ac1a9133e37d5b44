"""Inertial channels of KIM101, KIM001 and TIM101: steps, jogs, enable modes, stops and limit switches."""

from __future__ import annotations

import math

import pytest
from apt_host import Host, host_of

from stagewire_apt import messages as m
from stagewire_apt.enumerations import (
    ChannelEnableMode,
    EnableState,
    FeedbackSignalMode,
    InertialHardLimit,
    JogMode,
    MoveDirection,
)
from stagewire_apt.flags import InertialStatusBits
from stagewire_virtual.options import Settings
from stagewire_virtual.thorlabs_apt.inertial.actuator import Actuator

FORWARD, REVERSE = MoveDirection.FORWARD, MoveDirection.REVERSE
KIM = ("KIM101", "KIM001")


def kim(mode: int = ChannelEnableMode.CHANNEL_1, unit: str = "KIM101", **options) -> Host:
    """Return the host of a KIM101 with an enable mode."""
    host = host_of(unit, **options)
    host.say(m.PzmotSetKcubeChanEnableMode(mode=mode))
    return host


def actuator(host: Host, number: int = 1) -> Actuator:
    found: Actuator = host.instrument.channel(number).behaviour.actuator
    return found


def position(host: Host, ident: int = 1) -> int:
    [counter] = host.ask(m.PzmotReqPosCounters(chan_ident=ident))
    return counter.position


def bits(host: Host, number: int = 1) -> set[str]:
    [status] = host.ask(m.PzmotReqStatusUpdate())
    name = "status_bits" if host.instrument.unit.facts["channels"] == 1 else f"status_bits_{number}"
    word = getattr(status, name)
    return {bit for bit, mask in InertialStatusBits.bits.items() if word & mask}


def test_a_move_counts_steps_at_the_step_rate() -> None:
    """500 steps/s with 100,000 steps/s²: 1000 steps take 2 s and one ramp of 5 ms."""
    host = kim()
    host.say(m.PzmotMoveAbsolute(1, 1000))
    host.clock.advance(2.004)
    assert host.messages() == []
    assert bits(host) >= {"moving_forward", "active"}
    host.clock.advance(0.0011)
    [completed] = host.messages()
    assert (completed.chan_ident, completed.abs_position) == (1, 1000)
    assert position(host) == 1000
    assert bits(host) == {"motor_connected", "power_ok", "channel_enabled"}


def test_the_acceleration_is_that_of_the_parameters() -> None:
    """100 steps with 100 steps/s and 100 steps/s² take 2 s."""
    host = kim()
    host.say(m.PzmotSetDriveOpParams(1, 100, 100, 100))
    host.say(m.PzmotMoveAbsolute(1, 100))
    host.clock.advance(1.99)
    assert host.messages() == []
    host.clock.advance(0.02)
    assert len(host.messages()) == 1


def test_steps_back_do_not_return_to_the_same_place() -> None:
    host = kim()
    start = actuator(host).position
    for target in (1000, 0):
        host.say(m.PzmotMoveAbsolute(1, target))
        host.clock.advance(3)
    forward, reverse = actuator(host).step_sizes[1], actuator(host).step_sizes[-1]
    assert position(host) == 0
    assert actuator(host).position - start == pytest.approx(1000 * (forward - reverse))
    assert 0.7 <= reverse / forward <= 0.9
    assert 16 <= forward <= 24


def test_channels_have_their_own_step_sizes_which_the_seed_determines() -> None:
    sizes = [
        [actuator(host_of("KIM101", seed=seed), n).step_sizes for n in (1, 2)] for seed in (1, 1, 2)
    ]
    assert sizes[0] == sizes[1] != sizes[2]
    assert sizes[0][0] != sizes[0][1]


def test_steps_are_proportional_to_the_drive_voltage() -> None:
    moved = []
    for volts in (110, 88):
        host = kim()
        start = actuator(host).position
        host.say(m.PzmotSetDriveOpParams(1, volts, 500, 100_000))
        host.say(m.PzmotMoveAbsolute(1, 100))
        host.clock.advance(1)
        moved.append(actuator(host).position - start)
    assert moved[1] / moved[0] == pytest.approx(0.8)


@pytest.mark.parametrize("unit", KIM)
def test_relative_and_stored_moves(unit: str) -> None:
    host = kim(unit=unit)
    host.say(m.PzmotSetKcubeMoveRelativeParams(1, -30))
    host.say(m.PzmotSetKcubeMoveAbsoluteParams(1, 200))
    for message, end in [
        (m.PzmotMoveRelative(1, 50), 50),
        (m.PzmotMoveRelativeHeader(1), 20),
        (m.PzmotMoveAbsoluteHeader(1), 200),
        (m.PzmotMoveRelative(1, 0), 200),
    ]:
        host.say(message)
        host.clock.advance(1)
        [completed] = host.messages()
        assert completed.abs_position == end


@pytest.mark.parametrize("direction", [FORWARD, REVERSE])
def test_a_jog_of_a_kim_has_a_step_for_each_direction(direction: int) -> None:
    host = kim()
    host.say(m.PzmotSetKcubeJogParams(1, JogMode.SINGLE_STEP, 30, 40, 100, 100_000))
    host.say(m.PzmotMoveJog(1, direction))
    host.clock.advance(0.1)
    way = "forward" if direction == FORWARD else "reverse"
    assert bits(host) >= {f"moving_{way}", f"jogging_{way}"}
    host.clock.advance(0.5)
    [completed] = host.messages()
    assert completed.abs_position == (30 if direction == FORWARD else -40)


def test_a_jog_of_a_tim_has_one_step() -> None:
    host = host_of("TIM101")
    host.say(m.ModSetChanEnableState(2, EnableState.ENABLE))
    host.say(m.PzmotSetTimJogParams(2, JogMode.SINGLE_STEP, 35, 1000, 100_000))
    for end in (35, 0):
        host.say(m.PzmotMoveJog(2, FORWARD if end else REVERSE))
        host.clock.advance(1)
        [completed] = host.messages()
        assert (completed.chan_ident, completed.abs_position) == (2, end)


@pytest.mark.parametrize("start", [m.PzmotMoveJog(1, REVERSE), m.PzmotMoveVelocity(1, REVERSE)])
def test_a_motion_without_end_ends_with_a_stop(start) -> None:
    host = kim()
    host.say(m.PzmotSetKcubeJogParams(1, JogMode.CONTINUOUS, 1, 1, 500, 100_000))
    host.say(start)
    host.clock.advance(10)
    assert host.messages() == []
    host.say(m.PzmotMoveStop(1))
    [stopped] = host.messages()
    assert isinstance(stopped, m.PzmotMoveStopped)
    assert stopped.position == position(host) == pytest.approx(-5000, abs=3)
    host.clock.advance(1)
    assert position(host) == stopped.position
    host.say(m.PzmotMoveStop(1))
    assert [type(each) for each in host.messages()] == [m.PzmotMoveStopped]


def test_a_kim_ignores_the_stop_of_a_motor_and_a_tim_obeys_it() -> None:
    host = kim()
    host.say(m.MotMoveStop(1, 1))
    assert (host.messages(), len(host.refusals)) == ([], 1)
    host = host_of("TIM101")
    host.say(m.ModSetChanEnableState(1, EnableState.ENABLE))
    host.say(m.PzmotMoveAbsolute(1, 1000))
    host.clock.advance(1)
    host.say(m.MotMoveStop(1, 1))
    [stopped] = host.messages()
    assert isinstance(stopped, m.MotMoveStoppedStepper)
    assert stopped.position == position(host) == pytest.approx(499, abs=3)


@pytest.mark.parametrize("mode", ChannelEnableMode)
def test_only_channels_of_the_enable_mode_move(mode: ChannelEnableMode) -> None:
    host = kim(mode)
    for ident in (1, 2, 4, 8):
        host.say(m.PzmotMoveAbsolute(ident, 10))
    host.clock.advance(1)
    enabled = {5: {1, 2}, 6: {3, 4}}.get(mode, {mode.value} - {0})
    assert {1 + int(math.log2(each.chan_ident)) for each in host.messages()} == enabled
    assert {n for n in (1, 2, 3, 4) if "channel_enabled" in bits(host, n)} == enabled
    assert {n for n in (1, 2, 3, 4) if position(host, 1 << n - 1) == 10} == enabled
    assert len(host.refusals) == 4 - len(enabled)


@pytest.mark.parametrize("unit", KIM)
def test_no_channel_of_a_new_kim_is_enabled(unit: str) -> None:
    host = host_of(unit)
    host.say(m.PzmotMoveAbsolute(1, 10))
    host.clock.advance(1)
    assert (host.messages(), position(host)) == ([], 0)


def test_a_kim001_has_no_enable_mode_of_other_channels() -> None:
    host = kim(unit="KIM001")
    for mode in (2, 4, 5, 6):
        host.say(m.PzmotSetKcubeChanEnableMode(mode=mode))
        assert host.ask(m.PzmotReqKcubeChanEnableMode())[0].mode == 1
    assert len(host.refusals) == 4


def test_a_moving_channel_that_is_disabled_stops() -> None:
    host = kim()
    host.say(m.PzmotMoveAbsolute(1, 1000))
    host.clock.advance(1)
    host.say(m.PzmotSetKcubeChanEnableMode(mode=ChannelEnableMode.CHANNEL_2))
    [stopped] = host.messages()
    assert isinstance(stopped, m.PzmotMoveStopped)
    host.clock.advance(1)
    assert position(host) == stopped.position < 1000


def test_both_enable_states_of_a_kim101_must_permit_a_move() -> None:
    host = kim()
    host.say(m.ModSetChanEnableState(1, EnableState.DISABLE))
    host.say(m.PzmotMoveAbsolute(1, 10))
    host.clock.advance(1)
    assert (host.messages(), position(host)) == ([], 0)


def test_a_counter_is_set_without_a_move() -> None:
    host = kim()
    place = actuator(host).position
    host.say(m.PzmotSetPosCounters(chan_ident=1, position=-400))
    assert (position(host), actuator(host).position) == (-400, place)
    host.say(m.PzmotMoveAbsolute(1, 0))
    host.clock.advance(2)
    assert position(host) == 0
    assert actuator(host).position - place == pytest.approx(400 * actuator(host).step_sizes[1])


def test_the_counter_runs_on_at_the_end_of_the_travel() -> None:
    host = kim(channels=(Settings(travel=100_000, position=99_000),))
    host.say(m.PzmotMoveAbsolute(1, 1000))
    host.clock.advance(3)
    assert (position(host), actuator(host).position) == (1000, 100_000)


@pytest.mark.parametrize("switch", list(InertialHardLimit))
def test_a_limit_switch_ends_a_move_if_the_inputs_are_used(switch: InertialHardLimit) -> None:
    host = kim(channels=(Settings(travel=100_000, position=99_000),))
    host.say(m.PzmotSetLimSwitchParams(1, switch, InertialHardLimit.IGNORE))
    host.say(m.PzmotSetKcubeFeedbackSigParams(1, FeedbackSignalMode.LIMSWITCH, 0))
    host.say(m.PzmotMoveAbsolute(1, 1000))
    host.clock.advance(3)
    [completed] = host.messages()
    heeded = switch in (InertialHardLimit.MAKES, InertialHardLimit.BREAKS)
    assert (completed.abs_position < 100) is heeded
    assert ("forward_hardware_limit" in bits(host)) is heeded
    assert actuator(host).position == 100_000
    host.say(m.PzmotMoveJog(1, REVERSE))
    host.clock.advance(1)
    assert "forward_hardware_limit" not in bits(host)
    assert actuator(host).position < 100_000


def test_a_blocked_actuator_counts_its_steps() -> None:
    host = kim()
    place = actuator(host).position
    host.say(m.PzmotMoveAbsolute(1, 1000))
    host.clock.advance(1)
    between = actuator(host).position
    host.instrument.stick("channel 1", True)
    host.clock.advance(2)
    assert (position(host), actuator(host).position) == (1000, between)
    host.instrument.stick("channel 1", False)
    host.say(m.PzmotMoveAbsolute(1, 500))
    host.clock.advance(2)
    assert position(host) == 500
    assert actuator(host).position < between
    assert between > place


def test_a_replaced_move_is_not_completed() -> None:
    host = kim()
    host.say(m.PzmotMoveAbsolute(1, 1000))
    host.clock.advance(1)
    host.say(m.PzmotMoveAbsolute(1, 0))
    host.clock.advance(3)
    [completed] = host.messages()
    assert completed.abs_position == position(host) == 0


def test_an_invalid_direction_is_refused() -> None:
    host = kim()
    host.say(m.PzmotMoveJog(1, 3))
    host.say(m.PzmotMoveVelocity(1, 0))
    assert [text.rpartition(": ")[2] for text in host.refusals] == [
        "the direction must be 1 or 2"
    ] * 2


def test_after_ten_unacknowledged_messages_a_unit_is_silent() -> None:
    host = kim()
    host.say(m.HwStartUpdateMsgs(10))
    host.clock.advance(3)
    assert len(host.messages()) == 10
    host.say(m.PzmotAckStatusUpdate())
    host.clock.advance(3)
    assert len(host.messages()) == 10


def test_parameters_of_all_sub_messages_are_saved_by_their_common_id() -> None:
    host = kim()
    host.say(m.PzmotSetDriveOpParams(1, 100, 300, 1000))
    host.say(m.MotSetEepromParams(1, m.PzmotSetDriveOpParams.layout.id))
    host.say(m.PzmotSetDriveOpParams(1, 90, 200, 1000))
    host.instrument.power_cycle()
    assert host.ask(m.PzmotReqDriveOpParams(chan_ident=1))[0].step_rate == 300
    assert host.ask(m.PzmotReqKcubeChanEnableMode())[0].mode == ChannelEnableMode.CHANNEL_1


def test_the_row_shows_steps_and_the_true_position() -> None:
    host = kim(ChannelEnableMode.CHANNEL_3)
    host.say(m.PzmotMoveAbsolute(4, 100))
    host.clock.advance(0.1)
    rows = {row.part: row for row in host.instrument.rows()}
    assert rows["channel 3"].state == "moving"
    assert rows["channel 1"].state == "disabled"
    assert rows["channel 1"].position == "0 steps (6500.000 um)"
