"""The interlock of the solenoid driver: required or not, fitted or not."""

import pytest
from actuator_host import ActuatorHost

from stagewire_apt import messages as m
from stagewire_apt.flags import StepperStatusBits

ON, OFF = 1, 2
NEEDED, NOT_NEEDED = 1, 2


def state(host):
    return host.ask(m.MotReqSolState(1)).state


@pytest.mark.parametrize("mode", [NEEDED, NOT_NEEDED])
@pytest.mark.parametrize("fitted", [True, False])
def test_the_output_works_if_the_interlock_is_fitted_or_not_required(mode, fitted):
    host = ActuatorHost("TSC001")
    host.behaviour.interlock_closed = fitted
    host.tell(m.MotSetSolInterlockMode(1, mode))
    works = fitted or mode == NOT_NEEDED
    if works:
        host.tell(m.MotSetSolState(1, ON))
    else:
        assert "interlock is open" in host.refuses(m.MotSetSolState(1, ON))
        assert "interlock is open" in host.refuses(m.MotMoveAbsoluteHeader(1))
        assert host.instrument.rows()[0].state == "manual, interlock open"
    host.behaviour.press_enable()  # switches off, or is refused
    host.behaviour.press_enable()
    assert state(host) == (ON if works else OFF)
    assert StepperStatusBits(host.status().status_bits).interlock_enabled == fitted


@pytest.mark.parametrize("operating_mode", [1, 2, 3])
def test_opening_the_interlock_switches_off_permanently(operating_mode):
    host = ActuatorHost("TSC001")
    host.tell(m.MotSetSolOperatingMode(1, operating_mode), m.MotMoveAbsoluteHeader(1))
    host.said.clear()
    host.to(100)
    assert state(host) == ON
    host.behaviour.interlock_closed = False
    assert state(host) == OFF
    host.behaviour.interlock_closed = True
    host.to(10_000)
    assert state(host) == OFF
    assert [type(message) for _, message in host.said] == [m.MotGetSolState] * 3
    host.tell(m.MotSetSolState(1, ON))
    assert state(host) == ON


def test_an_open_interlock_disarms_the_trigger():
    host = ActuatorHost("TSC001")
    host.tell(m.MotSetSolOperatingMode(1, 4), m.MotSetSolState(1, ON))
    host.behaviour.interlock_closed = False
    host.behaviour.interlock_closed = True
    host.behaviour.trigger()
    assert state(host) == OFF


def test_requiring_a_missing_interlock_switches_off():
    host = ActuatorHost("TSC001")
    host.tell(m.MotSetSolInterlockMode(1, NOT_NEEDED))
    host.behaviour.interlock_closed = False
    host.tell(m.MotSetSolState(1, ON))
    assert state(host) == ON
    host.tell(m.MotSetSolInterlockMode(1, NEEDED))
    assert state(host) == OFF
