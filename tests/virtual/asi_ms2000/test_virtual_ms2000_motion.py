"""The motion of MS-2000 axes compared with the closed formula, and their status during it."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from ms2000_host import Host

from stagewire_virtual.asi_ms2000.instrument import STRATEGIES
from stagewire_virtual.asi_ms2000.servo_axis import SETTLING

# Bits of the status byte (section 14).
MOVES, SERVO, JOYSTICK, RAMPS, DOWN, UPPER, LOWER = 1, 2, 8, 16, 32, 64, 128
IDLE = SERVO | JOYSTICK

WRITE_POSITION, WRITE_TARGET, WRITE_INCREMENT = 65, 84, 68
WRITE_RAMP, WRITE_TOP, WRITE_VECTOR = 81, 83, 94


def trapezoid(distance: float, top: float, ramp: float, time: float) -> tuple[float, float]:
    """Return distance and speed after a time: linear ramps of top speed / ramp time (section 22)."""
    acceleration = top / ramp
    peak = min(top, math.sqrt(acceleration * distance))
    ramps = peak / acceleration
    duration = distance / peak + ramps
    if time >= duration:
        return distance, 0.0
    if time <= ramps:
        return acceleration * time**2 / 2, acceleration * time
    if time <= duration - ramps:
        return peak * (time - ramps / 2), peak
    left = duration - time
    return distance - acceleration * left**2 / 2, acceleration * left


MOVES_OF = [
    # distance in tenths of a micrometre, top speed in µm/s, ramp time in ms
    (100_000, 6000, 100),
    (-100_000, 6000, 100),
    (5_000, 6000, 100),  # too short for the top speed
    (-37, 6000, 100),
    (1, 6000, 100),
    (20_000, 590, 255),
    (400_000, 65_535, 1),
    (400_000, 65_535, 255),
]


@pytest.mark.parametrize(("distance", "top", "ramp"), MOVES_OF)
def test_a_move_follows_the_closed_formula_within_one_count(
    distance: int, top: int, ramp: int
) -> None:
    host = Host()
    host.write(WRITE_TOP, 2, top)
    host.write(WRITE_RAMP, 1, ramp)
    host.write(WRITE_TARGET, 3, distance)
    direction = math.copysign(1, distance)
    time = 0
    while True:
        host.to(time)
        way, speed = trapezoid(abs(distance), top * 10, ramp / 1000, time / 1000)
        assert abs(host.position - direction * way) <= 1
        shown = (round(direction * speed / 10) + 32768) % 65536 - 32768  # the two lower bytes
        assert abs(host.speed - shown) <= 1
        assert bool(host.status & MOVES) == (way != abs(distance))
        if way == abs(distance):
            break
        time += 10
    assert host.position == distance


def test_status_and_busy_change_at_exact_instants() -> None:
    host = Host()
    host.write(WRITE_TARGET, 3, 60_000)  # 100 ms of ramp, 900 ms at 6000 µm/s, 100 ms of ramp
    for milliseconds, status, busy in [
        (0, IDLE | MOVES | RAMPS, True),
        (99.999, IDLE | MOVES | RAMPS, True),
        (100, IDLE | MOVES, True),
        (999.999, IDLE | MOVES, True),
        (1000.001, IDLE | MOVES | RAMPS | DOWN, True),
        (1099.999, IDLE | MOVES | RAMPS | DOWN, True),
        (1100, IDLE, True),
        (1100 + SETTLING / 1e6 - 0.001, IDLE, True),
        (1100 + SETTLING / 1e6, IDLE, False),
    ]:
        host.to(milliseconds)
        assert (host.status, host.busy) == (status, busy), milliseconds
    assert host.position == host.target == 60_000


def test_axes_move_independently() -> None:
    host = Host()
    host.write(WRITE_TARGET, 3, 30_000, axis=24)
    host.write(WRITE_TARGET, 3, -10_000, axis=25)
    host.to(1000)
    assert [host.number(97, 3, axis=axis) for axis in (24, 25, 26)] == [30_000, -10_000, 0]


def test_a_move_turns_around_when_the_target_changes() -> None:
    host = Host()
    host.write(WRITE_TARGET, 3, 60_000)
    host.to(500)
    before = host.position
    host.write(WRITE_TARGET, 3, 0)
    assert (host.position, host.speed) == (before, 6000)
    assert host.status == IDLE | MOVES | RAMPS | DOWN
    host.to(600)
    assert host.position == before + 3000  # the distance of one ramp
    host.to(650)
    assert host.speed == -3000
    assert host.status == IDLE | MOVES | RAMPS
    host.to(3000)
    assert (host.position, host.busy) == (0, False)


def test_increments_start_at_the_present_position() -> None:
    host = Host()
    host.write(WRITE_INCREMENT, 3, 10_000)
    host.ask("24 43 0 58")
    host.to(150)
    there = host.position
    host.ask("24 43 0 58")
    assert there > 0
    assert host.target == there + 10_000
    host.to(2000)
    assert host.position == there + 10_000
    host.write(WRITE_INCREMENT, 3, -500)  # exchanges up and down
    host.ask("24 45 0 58")
    assert host.target == there + 10_500


def test_writing_the_position_moves_nothing_and_keeps_the_target() -> None:
    host = Host()
    host.write(WRITE_TARGET, 3, 60_000)
    host.to(500)
    before = host.position
    host.write(WRITE_POSITION, 3, -7)
    assert (host.position, host.target) == (-7, 60_000 - before - 7)
    host.to(2000)
    assert (host.position, host.target, host.busy) == (60_000 - before - 7,) * 2 + (False,)


def test_speed_and_ramp_apply_from_the_next_move() -> None:
    host = Host()
    host.write(WRITE_TARGET, 3, 60_000)
    host.to(500)
    host.write(WRITE_TOP, 2, 1000)
    assert host.speed == 6000
    host.write(WRITE_TARGET, 3, 60_000)
    host.to(1500)
    assert host.speed == 1000


def test_with_a_top_speed_of_zero_a_move_never_ends() -> None:
    host = Host()
    host.write(WRITE_TOP, 2, 0)
    host.write(WRITE_TARGET, 3, 60_000)
    host.to(60_000)
    assert (host.position, host.speed, host.busy) == (0, 0, True)
    host.write(WRITE_TOP, 2, 6000)
    host.write(WRITE_TARGET, 3, 60_000)
    host.to(62_000)
    assert (host.position, host.busy) == (60_000, False)


@pytest.mark.parametrize("stuck", [False, True])
def test_a_command_without_motion_completes_on_an_axis_that_cannot_move(stuck: bool) -> None:
    host = Host()
    host.write(WRITE_VECTOR, 2, 3000)
    host.to(500)
    if stuck:
        host.instrument.stick("axis X", True)
    else:
        host.write(WRITE_TOP, 2, 0)
    for command, size, number in ((WRITE_VECTOR, 2, 0), (WRITE_TARGET, 3, host.position)):
        host.write(command, size, number)
        assert (host.speed, host.status, host.busy) == (0, IDLE, True)
        host.clock.run_until(host.clock.now + SETTLING)
        assert not host.busy


class TestVectorSpeed:
    def test_it_continues_until_the_next_target(self) -> None:
        host = Host()
        host.write(WRITE_VECTOR, 2, 3000)
        assert host.status == IDLE | MOVES | RAMPS
        host.to(50)  # half of the top speed after half of the ramp time
        assert host.speed == 3000
        host.to(1000)
        assert host.position == 750 + 28_500
        assert host.target == host.position
        host.write(WRITE_TARGET, 3, 0)
        host.to(4000)
        assert (host.position, host.target, host.busy) == (0, 0, False)

    def test_zero_ramps_to_rest(self) -> None:
        host = Host()
        host.write(WRITE_VECTOR, 2, 6000)
        host.to(1000)
        host.write(WRITE_VECTOR, 2, 0)
        assert host.status == IDLE | MOVES | RAMPS | DOWN
        host.to(1100)
        assert (host.status, host.busy) == (IDLE, True)
        host.to(1120)
        assert (host.status, host.busy) == (IDLE, False)
        assert host.position == host.target == 3000 + 54_000 + 3000

    def test_the_top_speed_limits_it(self) -> None:
        host = Host()
        host.write(WRITE_VECTOR, 2, 20_000)
        host.to(1000)
        assert host.speed == 6000

    @pytest.mark.parametrize(("reading", "speed"), [("unsigned", 6000), ("signed", -3000)])
    def test_a_speed_above_32767_has_two_readings(self, reading: str, speed: int) -> None:
        host = Host(strategies={"vector_speed": reading})
        host.write(WRITE_VECTOR, 2, -3000)
        host.to(1000)
        assert host.speed == speed

    def test_a_stopped_axis_ignores_it_even_when_started(self) -> None:
        host = Host()
        host.ask("24 66 58")
        host.write(WRITE_TARGET, 3, 10)
        host.write(WRITE_VECTOR, 2, 3000)
        assert host.target == 10
        host.ask("24 71 58")
        host.to(1000)
        assert (host.position, host.busy) == (10, False)


class TestStop:
    def test_it_stops_immediately_and_start_continues(self) -> None:
        host = Host()
        host.write(WRITE_TARGET, 3, 60_000)
        host.to(500)
        host.ask("24 66 58")
        there = host.position
        assert (host.speed, host.status, host.busy, host.target) == (0, IDLE, False, 60_000)
        host.to(1000)
        assert host.position == there
        host.ask("24 71 58")
        assert host.busy
        host.to(3000)
        assert (host.position, host.busy) == (60_000, False)

    @pytest.mark.parametrize(("reading", "busy"), [("not_busy", False), ("busy", True)])
    def test_the_strategy_decides_whether_a_stopped_axis_is_busy(
        self, reading: str, busy: bool
    ) -> None:
        host = Host(strategies={"disabled_axis": reading})
        host.write(WRITE_TARGET, 3, 60_000)
        host.to(500)
        host.ask("24 66 58")
        assert host.busy is busy
        host.write(WRITE_TARGET, 3, host.position)
        assert not host.busy

    @pytest.mark.parametrize(("reading", "position"), [("resumes", 60_000), ("stays", 0)])
    def test_the_strategy_decides_whether_start_resumes_the_move(
        self, reading: str, position: int
    ) -> None:
        host = Host(strategies={"start_motor": reading})
        host.ask("24 66 58")
        host.write(WRITE_TARGET, 3, 60_000)
        host.ask("24 71 58")
        host.to(3000)
        assert (host.position, host.target, host.busy) == (position, position, False)

    def test_starting_a_moving_axis_has_no_effect(self) -> None:
        host = Host(strategies={"start_motor": "stays"})
        host.write(WRITE_TARGET, 3, 60_000)
        host.to(500)
        host.ask("24 71 58")
        host.to(3000)
        assert host.position == 60_000

    def test_stopping_a_vector_motion_makes_the_present_place_the_target(self) -> None:
        host = Host()
        host.write(WRITE_VECTOR, 2, 6000)
        host.to(500)
        host.ask("24 66 58 24 66 58")
        there = host.position
        host.ask("24 71 58")
        host.to(1000)
        assert host.position == host.target == there


class TestEndsOfTravel:
    @pytest.mark.parametrize(
        ("target", "ends_at", "switch"), [(20_000, 9_000, UPPER), (-20_000, -1_000, LOWER)]
    )
    def test_a_switch_stops_the_axis_and_ends_the_move(
        self, target: int, ends_at: int, switch: int
    ) -> None:
        host = Host(travel=10_000, position=1_000)
        assert host.status == IDLE
        host.write(WRITE_TARGET, 3, target)
        host.to(3000)
        assert (host.position, host.target, host.busy) == (ends_at, ends_at, False)
        assert (host.speed, host.status) == (0, IDLE | switch)
        host.write(WRITE_TARGET, 3, 0)
        host.to(6000)
        assert (host.position, host.status) == (0, IDLE)

    def test_an_axis_can_run_into_an_end_or_start_at_one(self) -> None:
        host = Host(travel=10_000, position=0)
        assert host.status == IDLE | LOWER
        assert Host(travel=10_000, position=1).status == IDLE
        host.write(WRITE_VECTOR, 2, 6000)
        host.to(3000)
        assert (host.position, host.status, host.busy) == (10_000, IDLE | UPPER, False)

    def test_a_position_beyond_24_bits_returns_its_lower_bytes(self) -> None:
        host = Host()
        host.write(WRITE_POSITION, 3, 8_388_607)
        host.write(WRITE_INCREMENT, 3, 10)
        host.ask("24 43 0 58")
        host.to(1000)
        assert host.position == host.target == -8_388_608 + 9


class TestStuck:
    def test_the_servo_pushes_until_the_axis_is_released(self) -> None:
        host = Host()
        host.write(WRITE_TARGET, 3, 60_000)
        host.to(500)
        host.instrument.stick("axis X", True)
        there = host.position
        host.to(60_000)
        assert (host.position, host.speed, host.busy) == (there, 0, True)
        assert host.status == IDLE | MOVES
        host.write(WRITE_TARGET, 3, 30_000)
        host.to(70_000)
        assert (host.position, host.busy) == (there, True)
        assert [row.state for row in host.instrument.rows()] == ["stuck", "idle", "idle"]
        host.instrument.stick("axis X", False)
        host.to(80_000)
        assert (host.position, host.busy) == (30_000, False)

    def test_stop_ends_the_pushing(self) -> None:
        host = Host()
        host.instrument.stick("axis X", True)
        host.write(WRITE_VECTOR, 2, 3000)
        assert host.busy
        host.ask("24 66 58")
        host.instrument.stick("axis X", False)
        host.to(1000)
        assert (host.position, host.busy) == (0, False)


_TELL = st.one_of(
    st.tuples(st.just(WRITE_TARGET), st.just(3), st.integers(-60_000, 60_000)),
    st.tuples(st.just(WRITE_POSITION), st.just(3), st.integers(-60_000, 60_000)),
    st.tuples(st.just(WRITE_INCREMENT), st.just(3), st.integers(-60_000, 60_000)),
    st.tuples(st.just(WRITE_RAMP), st.just(1), st.integers(0, 255)),
    st.tuples(st.just(WRITE_TOP), st.just(2), st.integers(0, 65_535)),
    st.tuples(st.just(WRITE_VECTOR), st.just(2), st.integers(0, 65_535)),
    st.tuples(st.sampled_from([43, 45, 66, 71, 74, 75]), st.just(0), st.just(0)),
)


@settings(max_examples=60, deadline=None)
@given(
    turns=st.lists(st.tuples(_TELL, st.integers(0, 400_000_000)), max_size=12),
    strategies=st.fixed_dictionaries(
        {name: st.sampled_from(list(STRATEGIES[name])) for name in ("start_motor", "vector_speed")}
    ),
)
def test_the_state_of_an_axis_is_always_consistent(
    turns: list[tuple[tuple[int, int, int], int]], strategies: dict[str, str]
) -> None:
    host = Host(strategies=strategies, travel=50_000, position=20_000)
    offset = 20_000  # place minus position
    for (command, size, number), nanoseconds in turns:
        before = host.position
        host.write(command, size, number)
        if command == WRITE_POSITION:
            offset += before - host.position
        for _ in range(2):
            moves, speed, status = host.status & MOVES, host.speed, host.status
            assert moves or (speed == 0 and not status & RAMPS)
            assert not moves or host.busy
            assert not status & DOWN or status & RAMPS
            assert 0 <= host.position + offset <= 50_000
            assert bool(status & UPPER) <= (host.position + offset == 50_000)
            assert bool(status & LOWER) <= (host.position + offset == 0)
            host.clock.run_until(host.clock.now + nanoseconds)
