"""Motors whose position counter falls clockwise, which is direction 1, forward."""

from __future__ import annotations

import pytest
from motor_host import MotorHost

import stagewire_virtual as virtual
from stagewire_apt import messages as m

MOTORS = ["TDC001", "BSC001", "BBD101"]
FORWARD, REVERSE = 1, 2
CONTINUOUS, STEP = 1, 2
QUIRK = "clockwise_is_negative"

ways = pytest.mark.parametrize(
    ("quirks", "direction", "way"),
    [
        ((), FORWARD, 1),
        ((), REVERSE, -1),
        ((QUIRK,), FORWARD, -1),
        ((QUIRK,), REVERSE, 1),
    ],
)


def motor(name: str, *quirks: str, position: int = 500_000) -> MotorHost:
    """Return a motor in counts with 10,000 counts/s in the middle of its travel."""
    host = MotorHost(name, travel=1_000_000, position=position, quirks=frozenset(quirks))
    host.say(m.MotSetVelParams(1, 0, 20_000, 10_000))
    host.say(m.MotSetJogParams(1, STEP, 25_000, 0, 20_000, 10_000, 2))
    return host


def named(direction: int) -> str:
    return "forward" if direction == FORWARD else "reverse"


def about_motion(host: MotorHost) -> set[str]:
    return {bit for bit in host.bits if bit.startswith(("moving", "jogging"))}


def about_limits(host: MotorHost) -> set[str]:
    return {bit for bit in host.bits if bit.endswith("_limit")}


@ways
@pytest.mark.parametrize("name", MOTORS)
def test_a_jog_moves_by_its_step_in_either_sense(
    name: str, quirks: tuple[str, ...], direction: int, way: int
) -> None:
    host = motor(name, *quirks)
    host.say(m.MotMoveJog(1, direction))
    host.wait(1)
    assert about_motion(host) == {f"moving_{named(direction)}", f"jogging_{named(direction)}"}
    assert host.velocity == way * 10_000
    host.wait(60)
    assert (host.kinds, host.position) == (["MOT_MOVE_COMPLETED"], way * 25_000)


@ways
@pytest.mark.parametrize("name", MOTORS)
def test_a_continuous_jog_and_a_velocity_move_run_to_the_end(
    name: str, quirks: tuple[str, ...], direction: int, way: int
) -> None:
    for message in (m.MotMoveJog(1, direction), m.MotMoveVelocity(1, direction)):
        host = motor(name, *quirks)
        host.say(m.MotSetJogParams(1, CONTINUOUS, 25_000, 0, 20_000, 10_000, 2))
        host.say(message)
        host.wait(1)
        assert f"moving_{named(direction)}" in about_motion(host)
        host.wait(100)
        assert (host.kinds, host.position) == (["MOT_MOVE_COMPLETED"], way * 500_000)
        # A BBD101 stops at its minimum position, which is above the hard stop.
        at_a_switch = name != "BBD101" or way > 0
        assert about_limits(host) == (
            {f"{named(direction)}_hardware_limit"} if at_a_switch else set()
        )


@pytest.mark.parametrize("name", MOTORS)
@pytest.mark.parametrize(("quirks", "direction"), [((), FORWARD), ((QUIRK,), REVERSE)])
def test_positions_and_distances_keep_their_sign(
    name: str, quirks: tuple[str, ...], direction: int
) -> None:
    """Only the reported direction differs, not the destination."""
    for message in (m.MotMoveAbsolute(1, 25_000), m.MotMoveRelative(1, 25_000)):
        host = motor(name, *quirks)
        host.say(message)
        host.wait(1)
        assert about_motion(host) == {f"moving_{named(direction)}"}
        assert host.velocity == 10_000
        host.wait(60)
        assert host.position == 25_000


@pytest.mark.parametrize("name", ["TDC001", "BSC001"])
@pytest.mark.parametrize("quirks", [(), (QUIRK,)])
def test_homing_goes_to_the_lower_end(name: str, quirks: tuple[str, ...]) -> None:
    host = motor(name, *quirks, position=20_000)
    host.say(m.MotMoveHome(1))
    host.wait(60)
    assert host.kinds == ["MOT_MOVE_HOMED"]
    assert about_limits(host) == {f"{'forward' if quirks else 'reverse'}_hardware_limit"}
    host.say(m.MotMoveRelative(1, 1_000))
    host.wait(60)
    assert host.position == 1_000


@pytest.mark.parametrize(("clockwise", "found"), [(1, False), (2, True)])
def test_the_clockwise_switch_is_the_one_at_the_lower_end(clockwise: int, found: bool) -> None:
    """If that switch is ignored (1), the motor does not find home and runs into the end."""
    host = motor("TDC001", QUIRK, position=20_000)
    host.say(m.MotSetLimSwitchParams(1, clockwise, 3 - clockwise, 0, 0, 1))
    host.say(m.MotMoveHome(1))
    host.wait(60)
    assert host.kinds == ["MOT_MOVE_HOMED" if found else "MOT_MOVE_STOPPED"]


@pytest.mark.parametrize(
    ("quirks", "cw", "ccw"), [((), 109_000, 91_000), ((QUIRK,), 91_000, 109_000)]
)
@pytest.mark.parametrize("direction", [FORWARD, REVERSE])
def test_soft_limits_are_clockwise_and_counterclockwise(
    quirks: tuple[str, ...], cw: int, ccw: int, direction: int
) -> None:
    host = motor("BSC001", *quirks)
    host.say(m.MotSetPosCounter(1, 100_000))
    host.say(m.MotSetLimSwitchParams(1, 2, 2, cw, ccw, 2))
    host.say(m.MotMoveVelocity(1, direction))
    host.wait(60)
    assert host.position == (cw if direction == FORWARD else ccw)
    assert about_limits(host) == {f"{named(direction)}_software_limit"}


@pytest.mark.parametrize("quirks", [(), (QUIRK,)])
def test_the_soft_limits_of_a_new_controller_include_its_travel(quirks: tuple[str, ...]) -> None:
    host = motor("BSC001", *quirks)
    limits = host.ask(m.MotReqLimSwitchParams(1))
    ends = (limits.ccw_soft_limit, limits.cw_soft_limit)
    assert ends == ((1_000_000, 0) if quirks else (0, 1_000_000))


def test_the_quirk_applies_to_every_bay() -> None:
    with virtual.BSC102(travel=1_000_000, position=500_000, quirks=[QUIRK]) as bsc:
        for bay in (0x21, 0x22):
            bsc.write(m.MotMoveJog(1, FORWARD).pack(dest=bay, source=0x01))
        bsc.advance(60)
        positions = [int(row.position.split()[0]) for row in bsc.instrument.rows() if row.position]
    assert len(positions) == 2
    assert all(position < 0 for position in positions)
