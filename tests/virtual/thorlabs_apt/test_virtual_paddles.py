"""Paddles of MPC220 and MPC320: moves, homing, jogs, the mask of enabled paddles, and stops."""

from __future__ import annotations

import pytest
from apt_host import Host, host_of

from stagewire_apt import messages as m
from stagewire_apt.enumerations import EnableState, MoveDirection
from stagewire_apt.flags import DcStatusBits

IDENTS = {"MPC220": (1, 2), "MPC320": (1, 2, 4)}


def mpc(mask: int = 1, unit: str = "MPC320", **options) -> Host:
    """Return the host of a controller with enabled paddles."""
    host = host_of(unit, **options)
    host.say(m.ModSetChanEnableState(mask, EnableState.ENABLE))
    return host


def status(host: Host, ident: int = 1) -> tuple[int, set[str]]:
    [said] = host.ask(m.MotReqDcStatusUpdate(ident))
    assert said.chan_ident == ident
    return said.position, {n for n, mask in DcStatusBits.bits.items() if said.status_bits & mask}


def ends(host: Host, seconds: float = 5) -> list[tuple[str, int]]:
    """Return the names and channels of the messages that follow."""
    host.clock.advance(seconds)
    return [(each.layout.message, each.chan_ident) for each in host.messages()]


def enabled(host: Host) -> set[int]:
    unit = host.instrument.unit.name
    return {ident for ident in IDENTS[unit] if "channel_enabled" in status(host, ident)[1]}


@pytest.mark.parametrize("unit", IDENTS)
def test_each_paddle_turns_to_its_angle_alone(unit: str) -> None:
    host = host_of(unit)
    for number, ident in enumerate(IDENTS[unit], 1):
        host.say(m.ModSetChanEnableState(ident, EnableState.ENABLE))
        host.say(m.MotMoveAbsolute(ident, 300 * number))
        assert ends(host) == [("MOT_MOVE_COMPLETED", ident)]
    positions = [status(host, ident)[0] for ident in IDENTS[unit]]
    assert positions == [300 * number for number in range(1, len(positions) + 1)]
    assert host.instrument.channel(2).behaviour.angle == pytest.approx(600 * 17 / 137)


def test_the_velocity_is_a_share_of_400_degrees_per_second() -> None:
    """170° at 200°/s with 2000°/s² take 0.95 s; at 40°/s, 4.27 s."""
    host = mpc()
    for percent, end, seconds in [(50, 1370, 0.95), (10, 0, 4.27)]:
        host.say(
            m.PolSetParams(velocity=percent, home_position=0, jog_step1=1, jog_step2=1, jog_step3=1)
        )
        host.say(m.MotMoveAbsolute(1, end))
        assert ends(host, seconds - 0.01) == []
        assert ends(host, 0.02) == [("MOT_MOVE_COMPLETED", 1)]


@pytest.mark.parametrize("mask", range(8))
def test_enabling_is_by_mask_and_disables_the_others(mask: int) -> None:
    host = mpc(7)
    host.say(m.ModSetChanEnableState(mask, EnableState.ENABLE))
    assert enabled(host) == {ident for ident in (1, 2, 4) if ident & mask}
    for ident in (1, 2, 4):
        [state] = host.ask(m.ModReqChanEnableState(ident))
        assert (state.chan_ident, state.enable_state) == (ident, 1 if ident & mask else 2)
        host.say(m.MotMoveAbsolute(ident, 100))
    assert {ident for _, ident in ends(host)} == enabled(host)


def test_disabling_disables_only_the_paddles_in_the_mask() -> None:
    host = mpc(7)
    host.say(m.ModSetChanEnableState(2, EnableState.DISABLE))
    assert enabled(host) == {1, 4}


def test_a_mask_with_an_unknown_paddle_is_refused() -> None:
    host = mpc(1, "MPC220")
    host.say(m.ModSetChanEnableState(4, EnableState.ENABLE))
    assert enabled(host) == {1}
    assert host.refusals == ["MPC220 at 0x50: unknown channels 0x04 in the mask"]


def test_no_paddle_of_a_new_controller_is_enabled() -> None:
    host = host_of("MPC320")
    assert enabled(host) == set()
    host.say(m.MotMoveAbsolute(1, 100))
    host.say(m.MotMoveHome(1))
    assert ends(host) == []


def test_a_moving_paddle_that_is_disabled_stops() -> None:
    host = mpc()
    host.say(m.MotMoveAbsolute(1, 1370))
    host.clock.advance(0.3)
    host.say(m.ModSetChanEnableState(2, EnableState.ENABLE))
    assert ends(host, 0) == [("MOT_MOVE_STOPPED", 1)]
    position, _ = status(host)
    assert 0 < position < 1370
    host.clock.advance(1)
    assert status(host)[0] == position


def test_home_is_a_position_for_all_paddles() -> None:
    host = mpc(7)
    host.say(m.PolSetParams(velocity=100, home_position=200, jog_step1=1, jog_step2=2, jog_step3=3))
    for ident in (1, 4):
        host.say(m.MotMoveHome(ident))
        assert "homing" in status(host, ident)[1]
        assert ends(host) == [("MOT_MOVE_HOMED", ident)]
        position, bits = status(host, ident)
        assert position == 200
        assert "homed" in bits


def test_each_paddle_has_its_own_jog_step() -> None:
    host = mpc(7)
    host.say(
        m.PolSetParams(velocity=100, home_position=0, jog_step1=10, jog_step2=20, jog_step3=30)
    )
    for ident, step in [(1, 10), (2, 20), (4, 30)]:
        host.say(m.MotMoveJog(ident, MoveDirection.FORWARD))
        assert "jogging_forward" in status(host, ident)[1]
        assert ends(host) == [("MOT_MOVE_COMPLETED", ident)]
        assert status(host, ident)[0] == step
    host.say(m.MotMoveJog(2, MoveDirection.REVERSE))
    ends(host)
    assert status(host, 2)[0] == 0


def test_a_paddle_stays_within_its_travel() -> None:
    host = mpc()
    for target in (-1, 1371):
        host.say(m.MotMoveAbsolute(1, target))
    assert (ends(host), len(host.refusals)) == ([], 2)
    host.say(m.MotMoveJog(1, MoveDirection.REVERSE))
    assert ends(host) == [("MOT_MOVE_COMPLETED", 1)]
    assert status(host)[0] == 0
    host.say(m.MotMoveJog(1, 0))
    assert host.refusals[-1].endswith("the direction must be 1 or 2")


def test_a_stop_stops() -> None:
    host = mpc()
    host.say(m.MotMoveAbsolute(1, 1370))
    host.clock.advance(0.3)
    host.say(m.MotMoveStop(1, 1))
    [stopped] = host.messages()
    assert isinstance(stopped, m.MotMoveStoppedDc)
    assert stopped.position == status(host)[0] < 1370
    assert ends(host) == []


def test_a_counter_moves_its_zero() -> None:
    host = mpc()
    host.say(m.MotSetPosCounter(1, 100))
    assert (status(host)[0], host.instrument.channel(1).behaviour.angle) == (100, 0)
    host.say(m.MotMoveAbsolute(1, 200))
    ends(host)
    assert host.instrument.channel(1).behaviour.angle == pytest.approx(100 * 17 / 137)
    assert host.ask(m.MotReqPosCounter(1))[0].position == 200


def test_a_blocked_paddle_continues_when_it_is_released() -> None:
    host = mpc()
    host.say(m.MotMoveAbsolute(1, 1370))
    host.clock.advance(0.3)
    host.instrument.stick("channel 1", True)
    assert ends(host) == []
    host.instrument.stick("channel 1", False)
    assert ends(host) == [("MOT_MOVE_COMPLETED", 1)]
    assert status(host)[0] == 1370


def test_a_power_cycle_disables_and_keeps_the_angle() -> None:
    host = mpc()
    host.say(m.MotMoveAbsolute(1, 500))
    ends(host)
    host.instrument.power_cycle()
    position, bits = status(host)
    assert position == 500
    assert "channel_enabled" not in bits
    assert host.instrument.rows()[0].position == "62.04 deg"
    assert host.instrument.rows()[0].state == "disabled"
