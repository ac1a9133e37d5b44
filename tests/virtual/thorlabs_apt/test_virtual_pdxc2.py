"""The channel of a PDXC2: moves in open and in closed loop, homing, and the detection of a blocked stage."""

from __future__ import annotations

import pytest
from apt_host import Host, host_of

import stagewire_virtual as virtual
from stagewire_apt import PROTOCOL
from stagewire_apt import messages as m
from stagewire_apt.enumerations import EnableState, JogMode, MoveDirection, PositionControlMode
from stagewire_apt.flags import Pdxc2StatusBits
from stagewire_virtual.options import Settings

OPEN, CLOSED = PositionControlMode.OPEN_LOOP, PositionControlMode.CLOSED_LOOP


def pdxc2(loop: int = OPEN, **settings) -> Host:
    """Return the host of an enabled PDXC2."""
    host = host_of("PDXC2", channels=(Settings(**settings),))
    host.say(m.ModSetChanEnableState(1, EnableState.ENABLE))
    host.say(m.PzSetPosControlMode(1, loop))
    return host


def true_position(host: Host) -> float:
    return host.instrument.channel(1).behaviour.actuator.position


def status(host: Host) -> tuple[int, set[str]]:
    [said] = host.ask(m.PzmotReqStatusUpdate())
    assert type(said) is m.PzmotGetStatusUpdateShort
    return said.position, {n for n, mask in Pdxc2StatusBits.bits.items() if said.status_bits & mask}


def start(host: Host, seconds: float = 5) -> list[str]:
    """Start the stored move, and return the names of the messages until it has ended."""
    host.say(m.PzmotMoveStart(1))
    host.clock.advance(seconds)
    return [each.layout.message for each in host.messages()]


def test_a_new_channel_is_disabled_and_in_open_loop() -> None:
    host = host_of("PDXC2")
    assert status(host) == (0, {"motor_connected", "power_ok"})
    host.say(m.PzmotSetOpenMoveParams(1, 100))
    assert start(host) == []


@pytest.mark.parametrize(
    ("settings", "half"), [({}, 10_000_000), ({"travel": 4_000_000}, 2_000_000)]
)
def test_a_controller_reports_its_stage_with_its_travel(settings, half: int) -> None:
    [stage] = pdxc2(**settings).ask(m.MotReqPmdStageAxisParams(1))
    assert (stage.stage_id, stage.axis_id, stage.part_no_axis) == (1, 18, "PDX1")
    assert (stage.min_pos, stage.max_pos, stage.cnts_per_unit) == (-half, half, 1_000_000)


def test_a_move_in_open_loop_is_relative_and_counts_steps() -> None:
    host = pdxc2()
    place = true_position(host)
    host.say(m.PzmotSetOpenMoveParams(1, 100))
    for end in (100, 200):
        assert start(host) == ["PZMOT_MOVE_COMPLETED"]
        assert status(host)[0] == end
    forward = true_position(host) - place
    host.say(m.PzmotSetOpenMoveParams(1, -200))
    assert start(host) == ["PZMOT_MOVE_COMPLETED"]
    assert status(host)[0] == 0
    assert 180_000 <= forward <= 220_000
    assert 0.85 <= (place + forward - true_position(host)) / forward <= 0.95


@pytest.mark.parametrize(
    ("capture", "preset", "ask"),
    [
        ("open", m.PzmotSetOpenMoveParams(1, 100), m.PzmotReqOpenMoveParams(1)),
        ("close", m.PzmotSetCloseMoveParams(1, 100), m.PzmotReqCloseMoveParams(1)),
    ],
)
def test_parameters_of_a_move_are_accepted_without_the_data_flag(
    capture: str, preset: m.PzmotSetOpenMoveParams, ask: m.PzmotReqOpenMoveParams
) -> None:
    """The frames are those of the serial example of the vendor, which set 0."""
    captures = {each["id"]: each["printed"] for each in PROTOCOL.vectors()["captures"]}
    captured = bytes.fromhex(captures[f"pdxc2-{capture}-move-params-without-bar"])
    assert captured[4] == 0x50
    with virtual.PDXC2() as controller:
        stored = []
        for frame in (preset.pack(dest=0x50, source=1), captured, captured[:10] + b"\7\0\0\0"):
            controller.write(frame + ask.pack(dest=0x50, source=1))
            stored.append(int.from_bytes(controller.read()[10:14], "little"))
    assert stored == [100, 0, 7]


def test_the_amplitude_scales_the_steps_of_its_direction() -> None:
    moved = []
    for amplitude in (100, 50):
        host = pdxc2()
        place = true_position(host)
        host.say(m.PzmotSetAmpOutParams(1, 1, amplitude, 100))
        host.say(m.PzmotSetOpenMoveParams(1, 100))
        start(host)
        moved.append(true_position(host) - place)
    assert moved[1] / moved[0] == pytest.approx(0.5)


def test_a_move_in_closed_loop_is_absolute_and_reaches_its_position() -> None:
    host = pdxc2(CLOSED)
    place = true_position(host)
    for target in (250_000, -100_000):
        host.say(m.PzmotSetCloseMoveParams(1, target))
        assert start(host) == ["PZMOT_MOVE_COMPLETED"]
        assert status(host)[0] == target
        assert true_position(host) == pytest.approx(place + target)
    assert status(host)[1] == {"motor_connected", "power_ok", "channel_enabled", "closed_loop"}


def test_the_speed_is_that_of_the_closed_loop() -> None:
    """1 mm at 1 mm/s with 1 mm/s² take 2 s."""
    host = pdxc2(CLOSED)
    host.say(m.PzmotSetClosedLoopParams(1, 1_000_000, 100, 100, 0, 1_000_000))
    host.say(m.PzmotSetCloseMoveParams(1, 1_000_000))
    assert start(host, 1.99) == []
    host.clock.advance(0.02)
    assert len(host.messages()) == 1


@pytest.mark.parametrize("loop", [OPEN, CLOSED])
def test_homing_moves_to_the_index(loop: int) -> None:
    host = pdxc2(loop, position=4_000_000)
    host.say(m.MotMoveHome(1))
    host.clock.advance(0.5)
    assert status(host)[1] >= {"homing", "moving_forward", "active"}
    host.clock.advance(2)
    assert [type(each) for each in host.messages()] == [m.MotMoveHomed]
    position, bits = status(host)
    assert (position, true_position(host)) == (0, 10_000_000)
    assert "homed" in bits


@pytest.mark.parametrize(("loop", "step"), [(OPEN, 30), (CLOSED, 5000)])
def test_jogs_have_the_step_of_their_loop(loop: int, step: int) -> None:
    host = pdxc2(loop)
    host.say(
        m.PzmotSetPdxc2JogParams(1, JogMode.SINGLE_STEP, 30, 1000, 20_000, 5000, 10_000, 100_000)
    )
    for direction, end in [(MoveDirection.FORWARD, step), (MoveDirection.REVERSE, 0)]:
        host.say(m.PzmotMoveJog(1, direction))
        host.clock.advance(0.01)
        assert any(name.startswith("jogging") for name in status(host)[1])
        host.clock.advance(2)
        assert [each.layout.message for each in host.messages()] == ["PZMOT_MOVE_COMPLETED"]
        assert status(host)[0] == end


@pytest.mark.parametrize("loop", [OPEN, CLOSED])
def test_a_continuous_jog_ends_with_a_stop(loop: int) -> None:
    host = pdxc2(loop)
    host.say(
        m.PzmotSetPdxc2JogParams(1, JogMode.CONTINUOUS, 30, 1000, 20_000, 5000, 10_000, 100_000)
    )
    host.say(m.PzmotMoveJog(1, MoveDirection.FORWARD))
    host.clock.advance(1)
    assert host.messages() == []
    host.say(m.MotMoveStop(1, 1))
    [stopped] = host.messages()
    assert isinstance(stopped, m.MotMoveStoppedStepper)
    assert stopped.position == status(host)[0] > 0


def test_a_closed_loop_ends_at_the_end_of_the_travel() -> None:
    host = pdxc2(CLOSED, travel=1_000_000, position=900_000)
    host.say(m.PzmotSetCloseMoveParams(1, 500_000))
    assert start(host) == ["PZMOT_MOVE_COMPLETED"]
    position, bits = status(host)
    assert position == 100_000
    assert "forward_hardware_limit" in bits


def test_another_loop_stops_a_move() -> None:
    host = pdxc2(CLOSED)
    host.say(m.PzmotSetCloseMoveParams(1, 1_000_000))
    host.say(m.PzmotMoveStart(1))
    host.clock.advance(0.1)
    host.say(m.PzSetPosControlMode(1, OPEN))
    assert [each.layout.message for each in host.messages()] == ["MOT_MOVE_STOPPED"]


@pytest.mark.parametrize("detection", [1, 0])
def test_a_blocked_stage_is_noticed_if_the_detection_is_on(detection: int) -> None:
    host = pdxc2(CLOSED)
    host.say(m.PzmotSetAbnormalMoveDetection(1, detection))
    host.say(m.PzmotSetCloseMoveParams(1, 1_000_000))
    host.say(m.PzmotMoveStart(1))
    host.clock.advance(0.1)
    host.instrument.stick("channel 1", True)
    between, _ = status(host)
    host.clock.advance(2)
    position, bits = status(host)
    assert position == between
    assert ("abnormal_movement" in bits) is ("error" in bits) is bool(detection)
    host.instrument.stick("channel 1", False)
    if detection:
        assert start(host) == ["PZMOT_MOVE_COMPLETED"]
    else:
        host.clock.advance(2)
    position, bits = status(host)
    assert position == 1_000_000
    assert "abnormal_movement" not in bits
