"""The strain gauge reader: three modes, zeroing, samples at 500 Hz, smoothing and noise."""

import pytest
from actuator_host import ActuatorHost
from hypothesis import given, settings
from hypothesis import strategies as st

from stagewire.errors import BadValueError
from stagewire_apt import messages as m
from stagewire_apt.flags import BpcStatusBits

POSITION, VOLTAGE, FORCE = 1, 2, 3
FULL = 32767


def reading(host):
    answer = host.ask(m.PzReqTsgReading(1))
    return answer.reading, answer.smoothed


def show(host, mode, force_calib=30000):
    host.tell(m.PzSetTsgIoSettings(1, 1, mode, force_calib))


def test_a_new_reader_has_the_parameters_of_the_document():
    host = ActuatorHost("TSG001")
    settings = host.ask(m.PzReqTsgIoSettings(1))
    assert (settings.display_mode, settings.force_calib) == (POSITION, 30000)
    assert host.ask(m.PzReqMaxTravel(1)).travel == 200
    assert ActuatorHost("TSG001", travel=1000).ask(m.PzReqMaxTravel(1)).travel == 1000


@pytest.mark.parametrize(
    ("mode", "before", "after", "shown"),
    [
        (POSITION, 16384, 0, "0.000 µm"),
        (FORCE, 16384, 0, "0.000 N"),
        (VOLTAGE, 16384, 16384, "5.000 V"),
    ],
)
def test_zeroing_applies_to_positions_and_forces(mode, before, after, shown):
    host = ActuatorHost("TSG001", travel=200, position=100)
    show(host, mode)
    assert reading(host) == (before, before)
    host.tell(m.PzSetZero(1))
    host.to(999)
    assert reading(host)[0] == before
    assert BpcStatusBits(host.status().status_bits).zeroing
    host.to(1001)
    assert reading(host) == (after, after)
    assert BpcStatusBits(host.status().status_bits).zeroed
    assert host.instrument.rows()[0].position == shown
    host.instrument.power_cycle()
    show(host, mode)
    assert reading(host) == (before, before)


@pytest.mark.parametrize(
    ("mode", "shown"), [(POSITION, "-10.000 µm"), (FORCE, "-15.000 N"), (VOLTAGE, "-5.000 V")]
)
def test_a_row_has_the_displayed_unit(mode, shown):
    host = ActuatorHost("TSG001")
    host.behaviour.signal = -0.5
    show(host, mode)
    assert float(host.instrument.rows()[0].position.split()[0]) == pytest.approx(
        float(shown.split()[0]), abs=1e-3
    )
    assert host.instrument.rows()[0].position.split()[1] == shown.split()[1]


def test_a_reading_is_the_last_sample_of_the_signal():
    host = ActuatorHost("TSG001")
    host.behaviour.signal = lambda seconds: seconds
    for milliseconds, sampled in ((0, 0), (1.9, 0), (2, 2), (3.99, 2), (100, 100)):
        host.to(milliseconds)
        assert reading(host)[0] == round(sampled / 1000 * FULL)


def test_smoothing_includes_earlier_signals():
    host = ActuatorHost("TSG001")
    host.to(100)
    host.behaviour.signal = 0.5
    host.behaviour.signal = 1.0  # in the same sample
    for samples in range(1, 20):
        assert reading(host) == (FULL, round(min(samples, 16) * FULL / 16))
        host.clock.advance(0.002)


def test_smoothing_uses_the_signal_of_each_sample():
    host = ActuatorHost("TSG001")
    signals = [(-1) ** sample * sample / 100 for sample in range(40)]
    for signal in signals:
        host.clock.advance(0.002)
        host.behaviour.signal = signal
    counts = [round(signal * FULL) for signal in signals[-16:]]
    assert reading(host) == (counts[-1], round(sum(counts) / 16) & 0xFFFF)


def test_several_signals_in_one_sample_count_once():
    host = ActuatorHost("TSG001", travel=200, position=200)
    host.to(100)
    for _ in range(20):
        host.behaviour.signal = 0.0
    assert reading(host) == (0, round(15 * FULL / 16))


def test_a_smoothed_reading_below_zero_is_twos_complement():
    host = ActuatorHost("TSG001")
    host.behaviour.signal = -1.0
    host.to(100)
    assert reading(host) == (-FULL, 0x10000 - FULL)


@given(st.lists(st.tuples(st.integers(0, 40), st.floats(-2, 2)), max_size=40))
@settings(max_examples=30)
def test_smoothing_keeps_every_signal_that_it_needs(steps):
    host = ActuatorHost("TSG001")
    truth = [0.0]  # by sample
    for wait, signal in steps:
        host.clock.advance(wait / 1000)
        now = host.clock.now // 2_000_000
        truth += [truth[-1]] * (now - len(truth) + 1)
        truth[now] = signal
        host.behaviour.signal = signal
        counts = [round(max(-1, min(1, value)) * FULL) for value in truth[-16:]]
        assert host.ask(m.PzReqTsgReading(1)).smoothed == round(sum(counts) / len(counts)) & 0xFFFF


def test_noise_depends_only_on_the_seed_and_the_sample():
    def readings(seed, asked_twice):
        host = ActuatorHost("TSG001", seed=seed)
        host.behaviour.noise = 0.01
        found = []
        for _ in range(20):
            host.clock.advance(0.002)
            if asked_twice:
                reading(host)
            found.append(reading(host))
        return found

    assert readings(1, False) == readings(1, True)
    assert readings(1, False) != readings(2, False)
    assert len(set(readings(1, False))) > 10
    assert all(abs(value) < 0.06 * FULL for value, _ in readings(1, False))


@pytest.mark.parametrize("name", ["noise", "signal"])
@pytest.mark.parametrize("share", [float("nan"), float("inf")])
def test_a_value_that_does_not_fit_is_refused(name, share):
    host = ActuatorHost("TSG001")
    with pytest.raises(BadValueError, match="a signal must be a fraction of full scale"):
        setattr(host.behaviour, name, share)
    assert reading(host) == (0, 0)


@pytest.mark.parametrize(
    ("signal", "voltage", "position"), [(0.5, 16384, 16384), (-0.5, -16384, 0), (9, FULL, FULL)]
)
def test_updates_have_voltage_and_position(signal, voltage, position):
    host = ActuatorHost("TSG001")
    host.behaviour.signal = signal
    host.tell(m.HwStartUpdateMsgs(0))
    host.to(100)
    ((time, update),) = host.said
    assert (time, update.op_voltage, update.position) == (100_000_000, voltage, position)
    assert set(BpcStatusBits(update.status_bits).names) == {
        "strain_gauge_connected", "active", "channel_enabled"
    }  # fmt: skip
