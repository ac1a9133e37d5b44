"""The waveform table and its output: exact samples, triggers, gates, and what ends the output."""

import itertools
from fractions import Fraction

import pytest
from actuator_host import ActuatorHost
from hypothesis import given, settings
from hypothesis import strategies as st

from stagewire_apt import messages as m
from stagewire_apt.flags import LutOutputMode as Mode
from stagewire_virtual.thorlabs_apt.piezo.waveform import Pulses, Waveform

MS = 1_000_000
CONTINUOUS, FIXED = Mode.outputlut_continuous, Mode.outputlut_fixed
IN, IN_HI = Mode.outputlut_inputtrig, Mode.outputlut_inputtrig_sense_hi
OUT, OUT_HI = Mode.outputlut_outputtrig, Mode.outputlut_outputtrig_sense_hi
GATE, REPEAT = Mode.outputlut_lutgated, Mode.outputlut_outputtrig_repeat

SAMPLES = (1000, -2000, 3000, 4000)


def parameters(mode=FIXED, **others):
    values = {
        "cycle_length": len(SAMPLES),
        "num_cycles": 2,
        "delay_time": 1,
        "pre_cycle_rest": 0,
        "post_cycle_rest": 0,
        "op_trig_start": 0,
        "op_trig_width": 1,
        "trig_repeat_cycle": 0,
    }
    return m.PzSetOutputLutParams(1, mode=mode, **{**values, **others})


def loaded(unit="BPC201", mode=FIXED, samples=SAMPLES, **others):
    host = ActuatorHost(unit)
    for index, sample in enumerate(samples):
        host.tell(m.PzSetOutputLut(1, index=index, output=sample))
    host.tell(parameters(mode, **others))
    assert host.refusals == []
    return host


def outputs(host, milliseconds, start=0):
    """Return the voltage in the middle of each millisecond."""
    found = []
    for millisecond in range(start, milliseconds):
        host.to(millisecond + 0.5)
        found.append(host.status().op_voltage)
    return found


def test_after_the_samples_the_set_point_is_output_again():
    host = loaded(pre_cycle_rest=3, post_cycle_rest=2, delay_time=1)
    host.tell(m.PzStartLutOutput(1))
    cycle = [1000] * (3 + 2) + [-2000] * 2 + [3000] * 2 + [4000] * (2 + 2)
    assert outputs(host, 26) == cycle * 2
    host.to(40)
    assert host.status().op_voltage == 0


@pytest.mark.parametrize(("unit", "rate"), [("BPC301", 1), ("TPZ001", 4)])
def test_the_sample_interval_depends_on_the_unit(unit, rate):
    host = loaded(unit, CONTINUOUS)
    host.tell(m.PzStartLutOutput(1))
    for number in range(20):
        host.to((number + 0.5) * 2 / rate)
        assert host.status().op_voltage == SAMPLES[number % 4]


def test_fractions_of_a_nanosecond_do_not_accumulate():
    """A sample of the MPZ601 lasts 1/7 ms, which is not a whole number of nanoseconds."""
    waveform = Waveform(range(8000), 8000, None, 1, Fraction(MS, 7))
    assert waveform.sample(7999 * MS // 7) == 7998
    assert waveform.sample(7999 * MS // 7 + 1) == 7999
    assert waveform.sample(8000 * MS // 7 + 1) == 0


@given(
    samples=st.lists(st.integers(-32768, 32767), min_size=1, max_size=6),
    hold=st.integers(1, 4),
    before=st.integers(0, 5),
    after=st.integers(0, 5),
    first=st.integers(0, 7),
    width=st.integers(0, 9),
    repeat=st.integers(0, 4),
)
@settings(max_examples=60)
def test_the_formula_agrees_with_counting_intervals(
    samples, hold, before, after, first, width, repeat
):
    pulses = Pulses(first, width * MS, repeat)
    waveform = Waveform(samples, len(samples), 2, hold, Fraction(MS), before, after, pulses)
    cycle = [(sample, index, step) for index, sample in enumerate(samples) for step in range(hold)]
    cycle = [(samples[0], -1, 0)] * before + cycle + [(samples[-1], len(samples) - 1, -1)] * after
    active_for = 0
    for number, (sample, index, step) in enumerate(itertools.chain(cycle, cycle)):
        if number == len(cycle):
            active_for = 0
        late = index - first
        if step == 0 and (late == 0 or (repeat and late > 0 and late % repeat == 0)):
            active_for = width
        elapsed = number * MS + MS // 2
        assert waveform.sample(elapsed) == sample
        assert waveform.pulse(elapsed) == (active_for > 0)
        active_for -= 1
    assert waveform.duration == 2 * len(cycle) * MS


def test_a_continuous_output_continues_until_a_stop_without_a_timer():
    host = loaded(mode=CONTINUOUS | FIXED)
    host.tell(m.PzSetOutputVolts(1, voltage=16000))
    host.to(100)
    host.tell(m.PzStartLutOutput(1))
    host.to(100 + 8 * 1000 + 0.5)
    assert host.status().op_voltage == 1000
    assert host.clock.next_due is None
    host.tell(m.PzStopLutOutput(1))
    assert host.status().op_voltage == 1000
    host.to(8200)
    assert host.status().op_voltage == 16000


def test_an_output_without_cycles_or_samples_is_refused():
    host = loaded(mode=0)
    assert "neither continuous nor" in host.refuses(m.PzStartLutOutput(1))
    host.tell(parameters(FIXED, cycle_length=0))
    assert "cycle_length is 0" in host.refuses(m.PzStartLutOutput(1))
    host.tell(parameters(FIXED), m.ModSetChanEnableState(1, 2))
    assert "disabled" in host.refuses(m.PzStartLutOutput(1))


@pytest.mark.parametrize("sense", [0, IN_HI])
def test_an_armed_waveform_waits_for_its_edge(sense):
    host = loaded(mode=FIXED | IN | sense)
    host.tell(m.PzStartLutOutput(1))
    assert set(outputs(host, 20)) == {0}
    assert host.behaviour.row().state == "waveform armed"
    host.behaviour.trigger_input = True
    assert host.status().op_voltage == (1000 if sense else 0)
    host.behaviour.trigger_input = bool(sense)  # the falling edge, or none
    assert host.status().op_voltage == 1000
    host.to(30)
    host.behaviour.trigger()  # has no effect during the output
    assert outputs(host, 36, 30) == [-2000, 3000, 3000, 4000, 4000, 4000]
    assert host.behaviour.row().state == "open loop"  # it starts to return from 4000 to 0
    host.to(60)
    host.behaviour.trigger()  # one start, one waveform
    assert host.status().op_voltage == 0


def test_a_trigger_pulse_includes_the_active_edge():
    for sense, level in itertools.product((0, IN_HI), (False, True)):
        host = loaded(mode=FIXED | IN | sense)
        host.behaviour.trigger_input = level
        host.tell(m.PzStartLutOutput(1))
        assert host.status().op_voltage == 0
        host.behaviour.trigger()
        assert host.status().op_voltage == 1000
        assert host.behaviour.trigger_input == level


def test_a_constant_level_is_not_an_edge():
    host = loaded(mode=FIXED | IN | IN_HI)
    host.behaviour.trigger_input = True
    host.tell(m.PzStartLutOutput(1))
    host.behaviour.trigger_input = True
    assert host.behaviour.row().state == "waveform armed"


def test_an_armed_waveform_has_no_trigger_output():
    host = loaded(mode=FIXED | IN | OUT | OUT_HI, op_trig_start=1)
    host.tell(m.PzStartLutOutput(1))
    assert not host.behaviour.trigger_output
    host.behaviour.trigger()
    assert host.behaviour.trigger_output


def test_a_closed_gate_pauses_the_waveform():
    host = loaded(mode=FIXED | IN | IN_HI | GATE)
    host.tell(m.PzStartLutOutput(1))
    host.to(10)
    assert host.status().op_voltage == 0
    host.behaviour.trigger_input = True
    assert outputs(host, 13, 10) == [1000, 1000, -2000]
    host.to(13)
    host.behaviour.trigger_input = False
    assert set(outputs(host, 50, 13)) == {-2000}
    host.to(50)
    host.behaviour.trigger_input = True
    assert outputs(host, 53, 50) == [-2000, 3000, 3000]
    assert outputs(host, 63, 53)[-1] == 4000
    assert host.behaviour.row().state == "waveform"
    host.to(63.001)  # 16 ms, 3 of them before the gate closed
    assert host.behaviour.row().state == "open loop"
    host.to(80)
    assert host.status().op_voltage == 0
    host.tell(m.PzStartLutOutput(1))  # the gate is open
    assert host.status().op_voltage == 1000


@pytest.mark.parametrize(
    ("mode", "high"),
    [
        (OUT | OUT_HI, {2, 3, 4}),
        (OUT, {0, 1, 5, 6, 7}),
        (OUT | OUT_HI | REPEAT, {2, 3, 4, 6, 7}),
        (OUT_HI, set()),
        (0, set()),
    ],
)
def test_the_trigger_output_marks_a_sample(mode, high):
    host = loaded(mode=FIXED | mode, op_trig_start=2, op_trig_width=3, trig_repeat_cycle=2)
    assert not host.behaviour.trigger_output
    host.tell(m.PzStartLutOutput(1))
    for millisecond in range(16):
        host.to(millisecond + 0.5)
        assert host.behaviour.trigger_output == (millisecond % 8 in high)


def test_a_cube_has_no_triggers_and_a_smaller_table():
    host = loaded("TPZ001", FIXED | IN | OUT, op_trig_start=2)
    host.tell(m.PzStartLutOutput(1))
    host.to(0.1)
    assert host.status().op_voltage == 1000
    host.tell(m.PzSetOutputLut(1, index=512, output=5))
    assert "index must be from 0 to 512, not 513" in host.refuses(
        m.PzSetOutputLut(1, index=513, output=6)
    )
    assert host.ask(m.PzReqOutputLut(1)) == m.PzGetOutputLut(1, index=512, output=5)
    for name in ("cycle_length", "trig_repeat_cycle"):
        refused = host.refuses(parameters(**{name: 513}))
        assert f"{name} must be from 0 to 512, not 513" in refused
    assert host.ask(m.PzReqOutputLutParams(1)).cycle_length == 4


def test_a_cube_ignores_a_gate():
    host = loaded("TPZ001", FIXED | IN | OUT | GATE)
    host.tell(m.PzStartLutOutput(1))
    host.behaviour.trigger_input = True
    host.to(0.75)
    assert host.status().op_voltage == -2000
    assert not host.behaviour.trigger_output


def test_a_table_has_the_size_in_the_document():
    host = ActuatorHost("BPC201")
    host.tell(m.PzSetOutputLut(1, index=7999, output=-32768))
    host.tell(parameters(CONTINUOUS, cycle_length=7999))
    assert host.refusals == []
    assert "below cycle_length" in host.refuses(parameters(CONTINUOUS | OUT, op_trig_start=4))
    assert "below cycle_length" in host.refuses(parameters(CONTINUOUS | OUT))


@pytest.mark.parametrize("lut_type", [1, 2])
def test_setting_the_type_clears_the_samples(lut_type):
    host = ActuatorHost("MPZ601", address=0x21)
    host.tell(m.PzSetLutValueType(lut_type), parameters(CONTINUOUS, cycle_length=1))
    host.tell(m.PzSetOutputLut(1, index=0, output=500), m.PzStartLutOutput(1))
    assert host.status().op_voltage == 500
    host.tell(m.PzSetLutValueType(lut_type))  # ends the output and clears the table
    host.to(100)
    assert host.status().op_voltage == 0
    assert host.behaviour.row().state == "open loop"
    host.tell(m.PzStartLutOutput(1))
    assert host.status().op_voltage == 0
    assert host.behaviour.row().state == "waveform"


def test_samples_are_positions_in_closed_loop():
    host = ActuatorHost("BPC201", travel=200, position=20)
    host.tell(m.PzSetOutputLut(1, index=0, output=10000), parameters(CONTINUOUS, cycle_length=1))
    host.tell(m.PzSetPosControlMode(1, 2), m.PzStartLutOutput(1))
    assert host.status().position == 10000
    assert host.status().op_voltage == 10000 - round(32767 / 10)
    host.tell(m.PzSetPosControlMode(1, 1))  # samples change their meaning, so the waveform ends
    host.to(100)
    assert host.status().op_voltage == 0


def test_a_power_cycle_clears_the_table():
    host = loaded(mode=CONTINUOUS)
    host.tell(m.PzStartLutOutput(1))
    host.instrument.power_cycle()
    assert host.status().op_voltage == 0
    host.tell(parameters(CONTINUOUS), m.PzStartLutOutput(1))
    assert set(outputs(host, 10)) == {0}
