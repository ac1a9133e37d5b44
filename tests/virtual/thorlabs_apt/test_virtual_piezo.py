"""Piezo channels: loops, slew rates, zeroing, inputs and status bits."""

import math

import pytest
from actuator_host import ActuatorHost

from stagewire.errors import BadValueError
from stagewire_apt import messages as m
from stagewire_apt.flags import BpcStatusBits, TpzStatusBits
from stagewire_virtual.errors import BadOptionError

UNITS = ("BPC001", "BPC002", "BPC101", "BPC201", "BPC301", "TPZ001")
OPEN, CLOSED, OPEN_SMOOTH, CLOSED_SMOOTH = 1, 2, 3, 4
FULL = 32767


def bits(host):
    return BpcStatusBits(host.status().status_bits)


NEW = [
    (m.PzReqPosControlMode(1), {"mode": OPEN}),
    (m.PzReqPiConsts(1), {"prop_const": 100, "int_const": 15}),  # page 100
    (m.PzReqTpzSlewRates(1), {"slew_open": 1266, "slew_closed": 1266}),  # page 123
    (m.PzReqOutputMaxVolts(1), {"voltage": 750}),  # page 96
    (m.PzReqOutputLutParams(1), {"mode": 1, "num_cycles": 1, "delay_time": 1, "op_trig_width": 1}),
]


@pytest.mark.parametrize(("request_", "values"), NEW)
def test_a_new_controller_has_the_parameters_of_the_examples(request_, values):
    answer = ActuatorHost("BPC301").ask(request_)
    assert {name: getattr(answer, name) for name in values} == values


@pytest.mark.parametrize("unit", UNITS)
def test_an_open_loop_outputs_the_voltage_that_was_set(unit):
    host = ActuatorHost(unit)
    for voltage in (0, 12345, -32768, 32767):
        host.tell(m.PzSetOutputVolts(1, voltage=voltage))
        assert host.ask(m.PzReqOutputVolts(1)).voltage == voltage
        host.clock.advance(0.1)
        assert host.status().op_voltage == voltage
        assert host.status().position == max(voltage, 0)


@pytest.mark.parametrize("unit", UNITS)
def test_a_closed_loop_moves_to_the_position_that_was_set(unit):
    host = ActuatorHost(unit)
    host.tell(m.PzSetPosControlMode(1, CLOSED), m.PzSetOutputPos(1, position_sw=0x2666))
    assert host.ask(m.PzReqOutputPos(1)).position_sw == 0x2666
    assert host.status().position == 0
    host.to(1000)
    assert host.status().position == 0x2666
    assert host.behaviour.position == pytest.approx(20 * 0x2666 / FULL)


def test_positions_are_relative_to_the_zero_of_the_strain_gauge():
    host = ActuatorHost("BPC201", travel=200, position=20)
    host.tell(m.PzSetPosControlMode(1, CLOSED), m.PzSetOutputPos(1, position_sw=10000))
    host.to(1000)
    assert host.status().position == 10000
    assert host.status().op_voltage == 10000 - round(FULL / 10)


def test_each_loop_has_its_own_set_point():
    host = ActuatorHost("BPC201")
    assert "open loop (page 97)" in host.refuses(m.PzSetOutputPos(1, position_sw=5))
    host.tell(m.PzSetOutputVolts(1, voltage=7), m.PzSetPosControlMode(1, CLOSED))
    assert "closed loop (page 96)" in host.refuses(m.PzSetOutputVolts(1, voltage=9))
    assert host.ask(m.PzReqOutputVolts(1)).voltage == 7
    assert host.ask(m.PzReqOutputPos(1)).position_sw == 0
    host.tell(m.PzSetPosControlMode(1, OPEN))
    host.to(1000)
    assert host.status().op_voltage == 7


def test_closed_loop_requires_a_strain_gauge():
    host = ActuatorHost("BPC201", travel=0)
    assert "strain gauge" in host.refuses(m.PzSetPosControlMode(1, CLOSED))
    assert "strain gauge" in host.refuses(m.PzSetZero(1))
    assert host.ask(m.PzReqPosControlMode(1)).mode == OPEN
    assert host.ask(m.PzReqMaxTravel(1)).travel == 0
    host.tell(m.PzSetOutputVolts(1, voltage=100))
    host.to(100)
    assert host.status().position == 0
    assert not bits(host).strain_gauge_connected
    assert host.instrument.rows()[0].position == "0.23 V"


LOOPS = [
    # slew open, slew closed, mode -> counts/ms
    (1266, 5, OPEN, 1266 * FULL / 19000),
    (5, 1266, OPEN, 5 * FULL / 19000),
    (0, 5, OPEN, FULL / 5),
    (32767, 5, OPEN, FULL / 5),
    (1266, 100, CLOSED, 100 * FULL / 19000),
]


@pytest.mark.parametrize(("slew_open", "slew_closed", "mode", "rate"), LOOPS)
def test_the_slew_rate_is_that_of_the_loop(slew_open, slew_closed, mode, rate):
    host = ActuatorHost("BPC301")
    host.tell(m.PzSetTpzSlewRates(1, slew_open, slew_closed), m.PzSetPosControlMode(1, mode))
    if mode == OPEN:
        host.tell(m.PzSetOutputVolts(1, voltage=FULL))
    else:
        host.tell(m.PzSetOutputPos(1, position_sw=FULL))
    for milliseconds in (0, 0.5, 1, 2.25, 4):
        host.to(milliseconds)
        assert host.status().op_voltage == pytest.approx(rate * milliseconds, abs=0.5)


def test_a_slew_rate_in_volts():
    """The example of page 123: 10 V/ms for a piezo of 150 V."""
    host = ActuatorHost("BPC301")
    host.tell(m.PzSetOutputMaxVolts(1, voltage=1500, flags=0), m.PzSetTpzSlewRates(1, 1266, 0))
    host.tell(m.PzSetOutputVolts(1, voltage=FULL))
    host.to(7)
    assert host.behaviour.volts == pytest.approx(70, rel=1e-3)


@pytest.mark.parametrize(("prop", "integral"), [(100, 15), (10, 10), (255, 255), (0, 5)])
def test_a_loop_settles_according_to_its_constants(prop, integral):
    host = ActuatorHost("BPC201")
    host.tell(m.PzSetPiConsts(1, prop, integral), m.PzSetPosControlMode(1, CLOSED))
    host.tell(m.PzSetOutputPos(1, position_sw=1000))
    constant = 1000 / (
        prop + integral
    )  # ms; the slew limit is above 1000 counts / constant if that is over 0.16
    for parts in (1, 2, 3):
        host.to(parts * constant)
        assert host.status().position == pytest.approx(1000 * (1 - math.exp(-parts)), abs=0.51)


def test_a_loop_without_gain_does_not_move():
    host = ActuatorHost("BPC201")
    host.tell(m.PzSetPiConsts(1, 0, 0), m.PzSetPosControlMode(1, CLOSED))
    host.tell(m.PzSetOutputPos(1, position_sw=1000))
    host.to(10_000)
    assert host.status().position == 0
    host.tell(m.PzSetPiConsts(1, 100, 15))
    host.to(20_000)
    assert host.status().position == 1000


def test_smooth_modes_change_the_loop_slowly_and_then_follow_normally():
    host = ActuatorHost("BPC201")
    host.tell(m.PzSetOutputVolts(1, voltage=16000))
    host.to(1000)
    host.tell(m.PzSetPosControlMode(1, CLOSED_SMOOTH))
    host.to(1250)
    assert host.status().op_voltage == round(16000 - FULL / 4)
    host.to(3000)
    assert host.status().op_voltage == 0
    host.tell(m.PzSetOutputPos(1, position_sw=16000))
    host.to(3100)
    assert host.status().position == 16000
    host.tell(m.PzSetPosControlMode(1, OPEN))  # and back immediately
    host.tell(m.PzSetOutputVolts(1, voltage=0))
    host.to(3105)
    assert host.status().op_voltage == 0


def test_a_smooth_mode_also_opens_the_loop_slowly():
    host = ActuatorHost("BPC201")
    host.tell(m.PzSetOutputVolts(1, voltage=16000))
    host.tell(m.PzSetPosControlMode(1, CLOSED_SMOOTH))
    host.to(2000)
    assert host.status().op_voltage == 0
    host.tell(m.PzSetPosControlMode(1, OPEN_SMOOTH))
    host.to(2250)
    assert host.status().op_voltage == round(FULL / 4)
    host.to(3000)
    assert host.status().op_voltage == 16000
    host.tell(m.PzSetOutputVolts(1, voltage=0))
    host.to(3005)
    assert host.status().op_voltage == 0


def test_zeroing_uses_the_reading_at_zero_volts():
    host = ActuatorHost("BPC201", travel=200, position=20)
    tenth = round(FULL / 10)
    host.tell(m.PzSetOutputVolts(1, voltage=16000))
    host.to(100)
    assert host.status().position == pytest.approx(16000 + tenth, abs=1)
    assert not bits(host).zeroed
    host.tell(m.PzSetZero(1))
    assert bits(host).zeroing
    assert host.behaviour.row().state == "zeroing"
    assert "zeroed" in host.refuses(m.PzSetOutputVolts(1, voltage=5))
    assert "zeroed" in host.refuses(m.PzStartLutOutput(1))
    host.to(110)
    assert host.status().op_voltage == 0
    assert host.status().position == pytest.approx(tenth, abs=1)
    ramp = 16000 / FULL * 5
    host.to(100 + ramp + 999.9)
    assert bits(host).zeroing
    host.to(100 + ramp + 1000.1)
    assert bits(host).zeroed
    assert not bits(host).zeroing
    assert host.status().position == 0
    assert host.ask(m.PzReqOutputVolts(1)).voltage == 0
    host.tell(m.PzSetPosControlMode(1, CLOSED), m.PzSetOutputPos(1, position_sw=1000))
    host.to(5000)
    assert host.status().position == 1000
    assert host.status().op_voltage == 1000


def test_zeroing_again_restarts_with_one_timer():
    host = ActuatorHost("BPC201")
    host.tell(m.PzSetZero(1))
    host.to(500)
    host.tell(*[m.PzSetZero(1)] * 500)
    assert len(host.clock._due) < 200
    host.to(1400)
    assert bits(host).zeroing
    assert not bits(host).zeroed
    host.to(1600)
    assert bits(host).zeroed
    assert host.clock.next_due is None


@pytest.mark.parametrize(
    "meanwhile",
    [
        m.PzSetTpzSlewRates(1, 1, 1),
        m.PzSetPosControlMode(1, CLOSED_SMOOTH),
        m.PzSetInputVoltsSrc(1, 1),
        m.PzStopLutOutput(1),
    ],
)
def test_no_setting_affects_the_voltage_during_zeroing(meanwhile):
    host = ActuatorHost("BPC301")
    host.behaviour.external_signal = 0.5
    host.tell(m.PzSetTpzSlewRates(1, 0, 0), m.PzSetOutputVolts(1, voltage=FULL))
    host.to(50)
    # 1 s for the whole range, so that any new motion of the output is visible
    host.tell(m.PzSetZero(1), m.PzSetTpzSlewRates(1, 19, 19))
    host.to(51)
    host.tell(meanwhile)
    host.to(56)
    assert host.status().op_voltage == 0
    host.to(1054)
    assert bits(host).zeroing
    assert host.status().op_voltage == 0


def test_a_position_below_zero_is_reported_as_zero():
    host = ActuatorHost("BPC201")
    host.tell(m.PzSetOutputVolts(1, voltage=-5000))
    host.to(100)
    assert host.status().position == 0
    assert host.behaviour.position < 0


def test_inputs_are_added_to_the_set_point():
    host = ActuatorHost("BPC201")
    host.tell(m.PzSetOutputVolts(1, voltage=1000))
    host.behaviour.external_signal = 0.5
    host.behaviour.potentiometer = 0.25
    for source, expected in ((0, 1000), (1, 17384), (2, 9192), (3, 25575), (0, 1000)):
        host.tell(m.PzSetInputVoltsSrc(1, source))
        host.clock.advance(0.1)
        assert host.status().op_voltage == expected
    host.tell(m.PzSetInputVoltsSrc(1, 3))
    host.behaviour.external_signal = -3.0
    host.clock.advance(0.1)
    assert host.status().op_voltage == -32768
    host.behaviour.external_signal = 0.0
    host.behaviour.potentiometer = 0.0
    host.tell(m.PzSetPosControlMode(1, CLOSED))
    host.behaviour.external_signal = 0.5
    host.clock.advance(1)
    assert host.status().position == 16384


@pytest.mark.parametrize("unit", ["BPC201", "TSG001"])
@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_a_signal_must_be_a_finite_number(unit, value):
    behaviour = ActuatorHost(unit).behaviour
    for name in ("external_signal", "potentiometer") if unit == "BPC201" else ("signal",):
        with pytest.raises(
            BadValueError, match=f"fraction of full scale, such as 0.5, not {value}"
        ):
            setattr(behaviour, name, value)


def test_a_disabled_channel_outputs_zero_volts_and_stores_settings():
    host = ActuatorHost("BPC201")
    host.tell(m.PzSetOutputVolts(1, voltage=1000))
    host.to(100)
    host.tell(m.ModSetChanEnableState(1, 2))
    host.to(200)
    assert host.status().op_voltage == 0
    assert not bits(host).channel_enabled
    host.tell(m.PzSetOutputVolts(1, voltage=2000))
    host.to(300)
    assert host.status().op_voltage == 0
    assert "disabled" in host.refuses(m.PzSetZero(1))
    host.tell(m.ModSetChanEnableState(1, 1))
    host.to(400)
    assert host.status().op_voltage == 2000


def test_disabling_ends_zeroing():
    host = ActuatorHost("BPC201")
    host.tell(m.PzSetZero(1), m.ModSetChanEnableState(1, 2))
    host.to(5000)
    assert not bits(host).zeroing
    assert not bits(host).zeroed


def test_a_stuck_actuator_does_not_move_but_its_voltage_does():
    host = ActuatorHost("BPC201")
    host.tell(m.PzSetOutputVolts(1, voltage=1000))
    host.to(100)
    host.instrument.stick("channel 1", True)
    host.tell(m.PzSetOutputVolts(1, voltage=2000))
    host.to(200)
    assert (host.status().op_voltage, host.status().position) == (2000, 1000)
    host.instrument.stick("channel 1", True)  # again
    assert host.status().position == 1000
    host.instrument.stick("channel 1", False)
    assert host.status().position == 2000


def test_a_power_cycle_resets_the_output_and_the_zero():
    host = ActuatorHost("TPZ001")
    host.tell(m.PzSetOutputVolts(1, voltage=1000), m.PzSetPiConsts(1, 7, 8))
    host.tell(m.PzSetEepromParams(1, 0x0655))
    host.to(100)
    host.instrument.power_cycle()
    assert host.status().op_voltage == 0
    assert host.ask(m.PzReqOutputVolts(1)).voltage == 0
    assert host.ask(m.PzReqPiConsts(1)) == m.PzGetPiConsts(1, 7, 8)
    host.to(200)
    assert host.status().op_voltage == 0


def test_parameters_can_be_restored_to_their_defaults():
    host = ActuatorHost("BPC301")
    asked = (m.PzReqPiConsts(1), m.PzReqTpzSlewRates(1), m.PzReqPosControlMode(1))
    new = [host.ask(message) for message in asked]
    host.tell(m.PzSetPiConsts(1, 1, 2), m.PzSetTpzSlewRates(1, 3, 4))
    host.tell(m.PzSetPosControlMode(1, CLOSED), m.PzSetOutputPos(1, position_sw=1000))
    host.to(10_000)
    assert [host.ask(message) for message in asked] != new
    host.tell(m.ModSetChanEnableState(1, 2), m.MotSetPzStageParamDefaults(1))
    assert bits(host).channel_enabled
    assert [host.ask(message) for message in asked] == new
    host.to(20_000)
    assert host.status().op_voltage == 0


def test_status_bits_are_those_of_the_unit():
    always = {"actuator_connected", "strain_gauge_connected"}
    cube = ActuatorHost("TPZ001")
    assert set(TpzStatusBits(cube.status().status_bits).names) == always
    assert TpzStatusBits(cube.status().status_bits).unnamed == 0
    bench = ActuatorHost("BPC201")
    assert set(bits(bench).names) == always | {"active", "channel_enabled"}
    bench.behaviour.digital_inputs = 0b1000_0001
    bench.tell(m.PzSetPosControlMode(1, CLOSED))
    assert set(bits(bench).names) == always | {
        "active", "channel_enabled", "closed_loop", "digital_input_1", "digital_input_8"
    }  # fmt: skip
    assert bench.ask(m.PzReqPzStatusBits(1)).status_bits == bench.status().status_bits


def test_updates_report_every_channel_at_its_instant():
    host = ActuatorHost("MPZ601", address=0x21)
    host.tell(m.PzSetOutputVolts(3, voltage=500), m.PzSetOutputVolts(2, voltage=600))
    host.tell(m.HwStartUpdateMsgs(0))
    host.to(250)
    told = [(time, update.chan_ident, update.op_voltage) for time, update in host.said]
    assert told == [
        (100_000_000, 1, 500), (100_000_000, 2, 600), (200_000_000, 1, 500), (200_000_000, 2, 600)
    ]  # fmt: skip


def test_a_row_describes_the_state_of_a_channel():
    host = ActuatorHost("BPC201")
    host.tell(m.PzSetOutputVolts(1, voltage=FULL))
    host.to(100)
    row = host.instrument.rows()[0]
    assert (row.position, row.state) == ("75.00 V, 20.000 µm", "open loop")
    host.tell(m.PzSetPosControlMode(1, CLOSED))
    assert host.instrument.rows()[0].state == "closed loop"
    host.tell(m.ModSetChanEnableState(1, 2))
    assert host.instrument.rows()[0].state == "disabled"


@pytest.mark.parametrize("unit", ["BPC201", "TSG001"])
@pytest.mark.parametrize(
    ("told", "expected"),
    [
        ({"travel": 0x10000}, "from 0 to 65535 steps of 100 nm, not 65536"),
        ({"travel": -1}, "from 0 to 65535 steps of 100 nm, not -1"),
        ({"travel": 10, "position": 11}, "from -10 to 10 for a travel of 10 .*, not 11"),
    ],
)
def test_an_invalid_actuator_is_refused(unit, told, expected):
    with pytest.raises(BadOptionError, match=expected):
        ActuatorHost(unit, **told)


def test_rearming_a_running_output_returns_it_to_the_set_point():
    host = ActuatorHost("BPC201")
    parameters = {
        "cycle_length": 1, "num_cycles": 1, "delay_time": 1, "pre_cycle_rest": 0, "post_cycle_rest": 0,
        "op_trig_start": 0, "op_trig_width": 0, "trig_repeat_cycle": 0,
    }  # fmt: skip
    host.tell(m.PzSetOutputLut(1, index=0, output=FULL))
    host.tell(m.PzSetOutputLutParams(1, mode=1, **parameters), m.PzStartLutOutput(1))
    host.to(100)
    assert host.status().op_voltage == FULL
    host.tell(m.PzSetOutputLutParams(1, mode=1 | 8, **parameters), m.PzStartLutOutput(1))
    assert host.status().op_voltage == FULL
    host.to(102.5)
    assert host.status().op_voltage == round(FULL / 2)
    host.to(105)
    assert host.status().op_voltage == 0
