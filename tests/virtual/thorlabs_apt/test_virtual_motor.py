"""Moves of virtual motors: stepper and DC, both forms, scales, counters, and moves during moves."""

from __future__ import annotations

import math

import pytest
from motor_host import MotorHost, told, under_way

from stagewire import FramedMessage, Stage
from stagewire_apt import messages as m
from stagewire_apt import stages
from stagewire_virtual.clock import SECOND

MOTORS = ["TDC001", "ODC001", "TST001", "OST001", "BSC001", "BSC103", "MST601", "BBD101", "BBD203"]


@pytest.mark.parametrize("name", MOTORS)
def test_a_move_follows_the_trapezoid_and_is_completed_at_its_end(name: str) -> None:
    """25,000 counts: 0.5 s of acceleration over 2,500 counts, 2 s at 10,000 counts/s, 0.5 s down."""
    host = told(name)
    host.say(m.MotMoveAbsolute(1, 25_000))
    for step in range(1, 300):
        host.wait(0.01)
        time = step / 100
        up, down = min(time, 0.5), max(time - 2.5, 0)
        expected = 10_000 * up**2 + 10_000 * min(max(time - 0.5, 0), 2)
        expected += 10_000 * down - 10_000 * down**2
        assert abs(host.position - expected) <= 1
    assert host.said == []
    host.wait(1)
    [(when, message)] = host.said
    assert message.layout.message == "MOT_MOVE_COMPLETED"
    assert when == 3 * SECOND
    assert message.position == 25_000


@pytest.mark.parametrize("name", ["TDC001", "BSC001"])
@pytest.mark.parametrize(
    ("message", "place"),
    [
        (m.MotMoveAbsolute(1, -7_000), -7_000),
        (m.MotMoveAbsoluteHeader(1), 3_000),
        (m.MotMoveRelative(1, -7_000), -6_000),
        (m.MotMoveRelativeHeader(1), 1_400),
    ],
)
def test_both_forms_of_a_move_reach_their_target(
    name: str, message: FramedMessage, place: int
) -> None:
    host = told(name)
    host.say(m.MotSetMoveAbsParams(1, 3_000))
    host.say(m.MotSetMoveRelParams(1, 400))
    host.wait(1)
    assert (host.position, host.said) == (0, [])  # setting the parameters starts no move
    host.say(m.MotMoveAbsolute(1, 1_000))
    host.wait(5)
    host.say(message)
    host.wait(5)
    assert host.position == place
    assert host.kinds == ["MOT_MOVE_COMPLETED"] * 2


@pytest.mark.parametrize(
    ("name", "stage", "counts_per_mm", "velocity", "acceleration"),
    [
        # 134217.728 on the wire for 1 mm/s, 13.743895 for 1 mm/s² (page 14)
        ("BBD102", stages.MLS203, 20_000, 20_000 / 134217.728, 20_000 / 13.743895),
        # 767367.49 for 1 mm/s (later issues), and 261.93 for 1 mm/s², from a servo cycle of 341.3 µs
        ("TDC001", stages.Z8, 34_304, 34_304 / 767367.49, 34_304 / 261.929),
        # only the scale of positions is known: counts/s and counts/s²
        ("BSC101", stages.APT_STEPPER, 25_600, 1, 1),
        ("ODC001", None, None, 1, 1),
    ],
)
def test_scales_are_those_of_the_stage_on_the_controller(
    name: str,
    stage: Stage | None,
    counts_per_mm: int | None,
    velocity: float,
    acceleration: float,
) -> None:
    host = MotorHost(name, stage=stage, travel=50_000_000, position=0)
    host.say(m.MotSetVelParams(1, 0, 100, 200_000))
    host.say(m.MotMoveVelocity(1, 1))
    host.wait(0.125)
    assert host.velocity == pytest.approx(12.5 * acceleration, rel=1e-5)
    host.say(m.MotSetVelParams(1, 0, 1_000_000_000, 200_000))
    host.say(m.MotMoveVelocity(1, 1))
    host.wait(1)
    assert host.velocity == pytest.approx(200_000 * velocity, rel=1e-5)
    shown = host.row.position
    if counts_per_mm is None:
        assert shown == f"{host.position} counts"
    else:
        assert shown == f"{host.position / counts_per_mm:.4f} mm"


@pytest.mark.parametrize("name", ["TDC001", "BSC001"])
def test_only_the_last_of_two_moves_is_completed(name: str) -> None:
    """It turns around after 1 s at 7,500 counts: it stops in 0.5 s and 2,500 counts, then returns."""
    host = under_way(name)
    assert (host.position, host.velocity) == (7_500, 10_000)
    host.say(m.MotMoveAbsolute(1, 0))
    assert host.velocity == 10_000
    host.wait(0.5)
    assert (host.position, host.velocity) == (10_000, 0)
    host.wait(5)
    assert [(when, message.position) for when, message in host.said] == [(3 * SECOND, 0)]


def test_a_relative_move_starts_at_the_present_position() -> None:
    host = under_way("TDC001")
    host.say(m.MotMoveRelative(1, 10_000))
    host.wait(5)
    assert host.position == 17_500


def test_a_move_to_the_present_position_completes_immediately() -> None:
    host = told("TDC001")
    answer = host.ask(m.MotMoveAbsolute(1, 0))
    assert isinstance(answer, m.MotMoveCompletedDc)


def test_a_velocity_move_continues_until_a_stop() -> None:
    host = told("BSC001")
    host.say(m.MotMoveVelocity(1, 2))
    host.wait(10.25)
    assert host.velocity == -10_000
    assert host.position == -100_000
    assert host.said == []
    host.say(m.MotMoveStop(1, 2))
    host.wait(5)
    [(when, message)] = host.said
    assert isinstance(message, m.MotMoveStoppedStepper)
    assert when == 10.75 * SECOND
    assert message.position == -102_500


@pytest.mark.parametrize("name", ["TDC001", "BSC001"])
@pytest.mark.parametrize(("mode", "after", "position"), [(1, 0, 7_500), (2, 0.5, 10_000)])
def test_a_stop_is_immediate_or_profiled(name: str, mode: int, after: float, position: int) -> None:
    host = under_way(name)
    host.say(m.MotMoveStop(1, mode))
    host.wait(5)
    [(when, message)] = host.said
    assert message.layout.message == "MOT_MOVE_STOPPED"
    assert when == (1 + after) * SECOND
    assert message.position == position == host.position


@pytest.mark.parametrize("mode", [0, 1, 2, 200])
def test_a_stop_at_rest_is_answered_immediately(mode: int) -> None:
    assert isinstance(told("TDC001").ask(m.MotMoveStop(1, mode)), m.MotMoveStoppedDc)


def test_an_immediate_stop_overtakes_a_profiled_one() -> None:
    host = told("TDC001")
    host.say(m.MotMoveVelocity(1, 1))
    host.wait(1)
    host.say(m.MotMoveStop(1, 2))
    host.wait(0.1)
    host.say(m.MotMoveStop(1, 1))
    host.wait(5)
    assert [when for when, _ in host.said] == [1.1 * SECOND]


def test_counters_can_be_set_and_continue_from_there() -> None:
    host = told("BSC001")
    host.say(m.MotSetPosCounter(1, 1_000_000))
    host.say(m.MotSetEncCounter(1, -5))
    assert host.ask(m.MotReqPosCounter(1)).position == 1_000_000
    assert host.ask(m.MotReqEncCounter(1)).encoder_count == -5
    host.say(m.MotMoveRelative(1, 20_000))
    host.wait(10)
    assert host.ask(m.MotReqPosCounter(1)).position == 1_020_000
    assert host.ask(m.MotReqEncCounter(1)).encoder_count == 19_995
    host.say(m.MotMoveAbsolute(1, 990_000))
    host.wait(10)
    assert host.ask(m.MotReqEncCounter(1)).encoder_count == -10_005


def test_setting_a_counter_in_motion_does_not_change_the_destination() -> None:
    host = under_way("TDC001")
    host.say(m.MotSetPosCounter(1, 0))
    host.wait(5)
    assert host.position == 25_000 - 7_500


def test_a_counter_wraps_around_at_32_bits() -> None:
    host = told("TDC001")
    host.say(m.MotSetPosCounter(1, 0x7FFF_FFFF))
    host.say(m.MotMoveRelative(1, 1))
    host.wait(5)
    assert host.ask(m.MotReqPosCounter(1)).position == -0x8000_0000


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ([m.MotSetVelParams(1, 0, 0, 1000)], m.MotMoveRelative(1, 1000)),
        ([m.MotSetVelParams(1, 0, 1000, 0)], m.MotMoveAbsolute(1, 1000)),
        ([m.MotSetVelParams(1, 0, 1000, 0)], m.MotMoveVelocity(1, 1)),
        ([m.MotSetHomeParams(1, 2, 1, 0, 0)], m.MotMoveHome(1)),
        ([m.MotSetJogParams(1, 2, 1000, 0, 1000, -1, 2)], m.MotMoveJog(1, 1)),
        ([], m.MotMoveVelocity(1, 0)),
        ([], m.MotMoveJog(1, 3)),
        ([m.ModSetChanEnableState(1, 2)], m.MotMoveRelative(1, 1000)),
    ],
    ids=lambda value: "" if isinstance(value, list) else value.layout.message,
)
def test_a_move_without_velocity_or_acceleration_is_refused(
    parameters: list[FramedMessage], message: FramedMessage
) -> None:
    host = MotorHost("TDC001", answer_unsupported=True)
    for setting in parameters:
        host.say(setting)
    assert host.said == []
    assert isinstance(host.ask(message), m.HwResponse)
    host.wait(10)
    assert (host.position, host.said) == (0, [])
    silent = MotorHost("TDC001")
    for setting in parameters:
        silent.say(setting)
    silent.say(message)
    silent.wait(10)
    assert (silent.position, silent.said) == (0, [])


def test_a_refused_move_does_not_affect_the_present_one() -> None:
    host = under_way("TDC001")
    host.say(m.MotMoveJog(1, 9))
    host.wait(5)
    assert [(when, message.position) for when, message in host.said] == [(3 * SECOND, 25_000)]


def test_disabling_a_moving_channel_stops_it_immediately() -> None:
    host = under_way("TDC001")
    stopped = host.ask(m.ModSetChanEnableState(1, 2))
    assert isinstance(stopped, m.MotMoveStoppedDc)
    assert stopped.position == 7_500
    host.wait(5)
    assert (host.position, host.said) == (7_500, [])
    host.say(m.ModSetChanEnableState(1, 1))
    host.wait(5)
    assert (host.position, host.said) == (7_500, [])


def test_a_power_cycle_keeps_the_place_and_resets_the_counters() -> None:
    host = MotorHost("TDC001", travel=100_000, position=50_000)
    host.say(m.MotMoveHome(1))
    host.wait(10)
    host.say(m.MotMoveAbsolute(1, 30_000))
    host.wait(10)
    host.say(m.MotMoveAbsolute(1, 90_000))
    host.said.clear()
    host.instrument.power_cycle()
    host.wait(10)
    assert (host.position, host.said) == (0, [])
    assert "homed" not in host.bits
    host.say(m.MotMoveHome(1))
    host.wait(10)
    host.say(m.MotMoveAbsolute(1, 30_000))
    host.wait(10)
    assert host.position == 30_000


def test_a_power_cycle_in_motion_sends_no_message() -> None:
    host = told("ODC001")
    for state in (2, 1):
        host.say(m.ModSetChanEnableState(1, state))
        if state == 2:
            host.say(m.MotSetEepromParams(1, m.ModSetChanEnableState.layout.id))
    host.say(m.MotMoveAbsolute(1, 25_000))
    host.wait(1)
    host.instrument.power_cycle()
    host.wait(5)
    assert (host.said, host.position, host.bits) == ([], 0, set())


@pytest.mark.parametrize("name", MOTORS)
def test_moves_of_a_new_controller_take_seconds(name: str) -> None:
    host = MotorHost(name)
    travel = host._motor._axis.travel
    host.say(m.MotMoveRelative(1, travel // 2))
    host.wait(120)
    [(when, _)] = host.said
    assert 0.5 * SECOND < when < 20 * SECOND


def test_the_velocity_of_a_dc_status_has_a_sign_and_the_scale_of_the_stage() -> None:
    """100 mm/s is reported as 205 (page 79)."""
    host = MotorHost("BBD102", stage=stages.MLS203)
    host.say(m.MotMoveVelocity(1, 1))
    host.wait(0.5)
    assert host.ask(m.MotReqDcStatusUpdate(1)).velocity == 205
    host.say(m.MotMoveVelocity(1, 2))
    host.wait(0.5)
    assert host.ask(m.MotReqDcStatusUpdate(1)).velocity == -205


def test_the_velocity_of_a_dc_status_is_limited_to_16_bits() -> None:
    host = told("TDC001", velocity=100_000, acceleration=1_000_000)
    host.say(m.MotMoveVelocity(1, 2))
    host.wait(1)
    assert host.ask(m.MotReqDcStatusUpdate(1)).velocity == -32_767


def test_status_messages_have_the_counters() -> None:
    host = told("BSC001")
    host.say(m.MotSetEncCounter(1, 77))
    host.say(m.MotMoveRelative(1, 10))
    host.wait(1)
    update = host.ask(m.MotReqStatusUpdate(1))
    assert (update.position, update.enc_count) == (10, 87)


def test_start_velocities_are_ignored() -> None:
    """Page 30: "Currently, this 4 byte value is always zero"."""
    host = told("TDC001")
    host.say(m.MotSetVelParams(1, 5_000, 20_000, 10_000))
    host.say(m.MotMoveAbsolute(1, 25_000))
    assert host.velocity == 0
    host.wait(5)
    assert [when for when, _ in host.said] == [3 * SECOND]


def test_the_same_seed_produces_the_same_stage() -> None:
    def stage(seed: int) -> FramedMessage:
        return MotorHost("BBD102", seed=seed).ask(m.MotReqPmdStageAxisParams(1))

    assert stage(3) == stage(3)
    assert stage(3) != stage(4)


def test_the_stage_of_a_brushless_controller_is_that_of_page_76() -> None:
    stage = MotorHost("BBD102", stage=stages.MLS203).ask(m.MotReqPmdStageAxisParams(1))
    assert stage.part_no_axis == "MLS203 X Axis"
    assert (stage.stage_id, stage.cnts_per_unit) == (0x10, 20_000)
    assert (stage.min_pos, stage.max_pos) == (0, 2_200_000)
    assert (stage.max_accn, stage.max_dec, stage.max_vel) == (27488, 27488, 26843546)


def test_a_flood_of_moves_ends_at_the_last_target() -> None:
    host = told("TDC001")
    for step in range(200):
        host.say(m.MotMoveAbsolute(1, 1_000 * (-1) ** step))
        host.wait(0.003)
    host.wait(10)
    assert host.position == -1_000
    assert host.kinds == ["MOT_MOVE_COMPLETED"]


def test_a_triangle_that_never_reaches_its_velocity() -> None:
    host = told("TDC001", velocity=1_000_000)
    host.say(m.MotMoveAbsolute(1, 10_000))
    duration = 2 * math.sqrt(10_000 / 20_000)
    host.wait(duration / 2)
    assert host.velocity == pytest.approx(math.sqrt(10_000 * 20_000))
    host.wait(5)
    assert [when for when, _ in host.said] == [pytest.approx(duration * SECOND, abs=1)]
