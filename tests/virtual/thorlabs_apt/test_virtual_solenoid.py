"""The solenoid driver: four modes, exact cycles, and the completion of moves."""

import pytest
from actuator_host import ActuatorHost

from stagewire_apt import messages as m

MANUAL, SINGLE, AUTO, TRIGGER = 1, 2, 3, 4
ON, OFF = 1, 2


def driver(mode, on=1000, off=2000, cycles=2):
    """Return a driver with on and off times in steps of 250 µs: 250 ms on, 500 ms off."""
    host = ActuatorHost("TSC001")
    host.tell(m.MotSetSolOperatingMode(1, mode), m.MotSetSolCycleParams(1, on, off, cycles))
    return host


def state(host):
    return host.ask(m.MotReqSolState(1)).state


def changes(host, until):
    """Return the milliseconds at which the output was switched on and off."""
    found, before = [], False
    start = host.clock.now // 1_000_000
    for millisecond in range(start, until, 10):
        host.to(millisecond)
        if host.behaviour.on != before:
            before = host.behaviour.on
            found.append(millisecond - start)
    return found


def test_a_new_driver_is_off_and_manual():
    host = ActuatorHost("TSC001")
    assert state(host) == OFF
    assert host.ask(m.MotReqSolOperatingMode(1)).operating_mode == MANUAL
    assert host.ask(m.MotReqSolInterlockMode(1)).interlock_mode == 1
    assert host.ask(m.MotReqSolCycleParams(1)) == m.MotGetSolCycleParams(1, 4000, 4000, 20)


def test_in_manual_mode_the_output_stays_on_until_off():
    host = driver(MANUAL)
    host.tell(m.MotSetSolState(1, ON))
    host.to(100_000)
    assert state(host) == ON
    assert host.status().position == 1
    assert host.status().status_bits == 0x1001
    host.tell(m.MotSetSolState(1, OFF))
    assert state(host) == OFF
    assert host.status().position == 0
    assert host.status().status_bits == 0x1000


@pytest.mark.parametrize(
    ("mode", "cycles", "expected"),
    [
        (SINGLE, 2, [0, 250]),
        (AUTO, 2, [0, 250, 750, 1000]),
        (AUTO, 0, [0, 250, 750, 1000, 1500, 1750, 2250, 2500, 3000, 3250, 3750]),
        (TRIGGER, 2, []),
    ],
)
def test_the_mode_determines_when_the_output_is_on(mode, cycles, expected):
    host = driver(mode, cycles=cycles)
    host.tell(m.MotSetSolState(1, ON))
    assert changes(host, 4000) == expected


def test_a_cycle_is_exact_to_the_nanosecond():
    host = driver(SINGLE, on=401, off=400)
    host.tell(m.MotSetSolState(1, ON))
    host.clock.run_until(401 * 250_000 - 1)
    assert state(host) == ON
    host.clock.run_until(401 * 250_000)
    assert state(host) == OFF


def test_a_trigger_starts_the_cycles_of_an_armed_driver():
    host = driver(TRIGGER)
    host.behaviour.trigger()
    assert state(host) == OFF
    host.tell(m.MotSetSolState(1, ON))
    assert state(host) == OFF
    assert host.instrument.rows()[0].state == "trigger, primed"
    for _ in range(2):
        host.behaviour.trigger()
        assert host.instrument.rows()[0].state == "trigger, cycling"
        host.clock.advance(0.1)
        host.behaviour.trigger()  # has no effect during cycles
        assert changes(host, host.clock.now // 1_000_000 + 1500) == [0, 150, 650, 900]
    host.tell(m.MotSetSolState(1, OFF))
    host.behaviour.trigger()
    assert state(host) == OFF


def test_off_ends_the_cycles():
    host = driver(AUTO, cycles=0)
    host.tell(m.MotSetSolState(1, ON))
    host.to(800)
    assert state(host) == ON
    host.tell(m.MotSetSolState(1, OFF))
    assert changes(host, 3000) == []


def test_parameters_take_effect_at_the_next_start():
    host = driver(SINGLE)
    host.tell(m.MotSetSolState(1, ON), m.MotSetSolCycleParams(1, 400, 400, 2))
    assert changes(host, 1000) == [0, 250]
    host.tell(m.MotSetSolState(1, ON))
    assert changes(host, 2000) == [0, 100]


def test_another_mode_switches_off():
    host = driver(AUTO, cycles=0)
    host.tell(m.MotSetSolState(1, ON), m.MotSetSolOperatingMode(1, AUTO))
    assert state(host) == ON
    host.tell(m.MotSetSolOperatingMode(1, MANUAL))
    assert changes(host, 3000) == []


def test_the_button_on_the_front_panel_switches():
    host = driver(MANUAL)
    for expected in (ON, OFF, ON):
        host.behaviour.press_enable()
        assert state(host) == expected
    host.tell(m.MotSetSolOperatingMode(1, TRIGGER))
    host.behaviour.press_enable()
    host.behaviour.trigger()
    assert state(host) == ON


@pytest.mark.parametrize("refused", [m.MotSetSolState(1, ON), m.MotMoveAbsoluteHeader(1)])
def test_a_disabled_driver_is_off(refused):
    host = driver(MANUAL)
    host.tell(m.MotSetSolState(1, ON), m.ModSetChanEnableState(1, 2))
    assert state(host) == OFF
    assert "disabled" in host.refuses(refused)
    assert state(host) == OFF
    host.tell(m.ModSetChanEnableState(1, 1))
    assert state(host) == OFF


MOVES = [
    # mode, cycles, move -> position and instant in ms of MOT_MOVE_COMPLETED
    (MANUAL, 1, m.MotMoveAbsoluteHeader(1), (1, 0)),
    (MANUAL, 1, m.MotMoveAbsolute(1, absolute_distance=5), (1, 0)),
    (MANUAL, 1, m.MotMoveAbsolute(1, absolute_distance=0), (0, 0)),
    (SINGLE, 9, m.MotMoveAbsoluteHeader(1), (0, 750)),
    (AUTO, 3, m.MotMoveAbsoluteHeader(1), (0, 2250)),
    (AUTO, 0, m.MotMoveAbsoluteHeader(1), None),
    (TRIGGER, 3, m.MotMoveAbsoluteHeader(1), (0, 0)),
]


@pytest.mark.parametrize(("mode", "cycles", "move", "completed"), MOVES)
def test_a_move_is_completed_when_its_cycles_are_over(mode, cycles, move, completed):
    host = driver(mode, cycles=cycles)
    host.tell(move)
    host.to(10_000)
    told = [(message, time // 1_000_000) for time, message in host.said]
    if completed is None:
        assert told == []
    else:
        ((message, time),) = told
        assert isinstance(message, m.MotMoveCompletedStepper)
        assert (message.position, time) == completed


@pytest.mark.parametrize("end", [m.MotMoveStop(1, 2), m.MotSetSolState(1, OFF)])
def test_an_aborted_move_is_not_completed(end):
    host = driver(AUTO)
    host.tell(m.MotMoveAbsoluteHeader(1))
    host.to(100)
    assert host.tell(end) == []
    assert state(host) == OFF
    host.tell(m.MotSetSolState(1, ON))
    host.said.clear()
    host.to(10_000)
    assert host.said == []


def test_a_start_during_cycles_restarts_them():
    host = driver(AUTO)
    host.tell(m.MotMoveAbsoluteHeader(1))
    host.to(1200)
    host.tell(m.MotSetSolState(1, ON))
    assert changes(host, 5000) == [0, 250, 750, 1000]
    assert host.said == []


def test_setting_the_state_sends_no_completion():
    host = driver(SINGLE)
    host.tell(m.MotSetSolState(1, ON))
    host.to(10_000)
    assert host.said == []


def test_updates_report_the_output_and_a_power_cycle_ends_everything():
    host = driver(AUTO, cycles=0)
    host.tell(m.MotSetSolState(1, ON), m.HwStartUpdateMsgs(0))
    host.to(1000)
    told = [update.position for _, update in host.said]
    assert told == [1, 1, 0, 0, 0, 0, 0, 1, 1, 0]
    host.instrument.power_cycle()
    assert changes(host, 5000) == []


def test_invalid_values_change_nothing():
    host = driver(MANUAL)
    for message in (
        m.MotSetSolOperatingMode(1, 5),
        m.MotSetSolState(1, 3),
        m.MotSetSolInterlockMode(1, 0),
        m.MotSetSolCycleParams.keep(
            {"chan_ident": 1, "on_time": 399, "off_time": 400, "num_cycles": 0}
        ),
    ):
        assert host.refuses(message)
    assert state(host) == OFF
    assert host.ask(m.MotReqSolCycleParams(1)).on_time == 1000
