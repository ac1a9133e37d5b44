"""Quad detector units: modes, outputs, loops that centre a beam, trigger ports and status."""

import math

import pytest
from actuator_host import ActuatorHost

from stagewire.errors import BadValueError
from stagewire_apt import messages as m
from stagewire_apt.flags import QuadStatusBits
from stagewire_virtual.thorlabs_apt.beam import Beam

UNITS = ["KPA101", "TPA101", "TQD001"]
MONITOR, OPEN, CLOSED, AUTOMATIC = 1, 2, 3, 4
ZERO, HELD = 1, 2
VOLT = 3276.7


def readings(host):
    """Return the difference signals and the outputs in V."""
    answer = host.ask(m.QuadReqReadings())
    return tuple(
        value / VOLT for value in (answer.x_diff, answer.y_diff, answer.x_pos, answer.y_pos)
    )


def demand(host, **changes):
    """Change some of the position demand parameters."""
    now = host.ask(m.QuadReqPosDemandParams()).values()
    host.tell(m.QuadSetPosDemandParams(**{**now, **changes}))


@pytest.mark.parametrize("unit", UNITS)
def test_a_new_unit_is_in_open_loop_with_outputs_of_zero(unit):
    host = ActuatorHost(unit)
    beam = host.behaviour.beam
    assert host.ask(m.QuadReqOperMode()).mode == OPEN
    assert readings(host) == pytest.approx((5 * beam.left, -5 * beam.top, 0, 0), abs=1e-3)
    assert host.ask(m.QuadReqReadings()).sum == 32768
    assert QuadStatusBits(host.ask(m.QuadReqStatusBits()).status_bits).open_loop


@pytest.mark.parametrize("unit", UNITS)
@pytest.mark.parametrize("seed", range(3))
def test_a_closed_loop_centres_the_beam_in_the_stated_time(unit, seed):
    host = ActuatorHost(unit, seed=seed)
    assert host.behaviour.time_constants == pytest.approx((0.0331, 0.0331), abs=1e-4)
    host.tell(m.QuadSetOperMode(mode=CLOSED))
    first = readings(host)
    host.to(33.1)
    one = readings(host)
    assert one[0] / first[0] == pytest.approx(1 / math.e, rel=0.01)
    assert one[1] / first[1] == pytest.approx(1 / math.e, rel=0.01)
    host.to(1000)
    beam = host.behaviour.beam
    assert readings(host) == pytest.approx((0, 0, 10 * beam.left, 10 * beam.top), abs=1e-3)
    assert QuadStatusBits(host.ask(m.QuadReqStatusBits()).status_bits).closed_loop


@pytest.mark.parametrize(
    ("p_gain", "i_gain", "power", "constant"),
    [(0, 32767, 5, 0.02), (32767, 32767, 5, 0.03), (0, 3277, 10, 0.1), (0, 0, 5, math.inf)],
)
def test_the_time_constant_depends_on_the_gains_and_the_power(p_gain, i_gain, power, constant):
    host = ActuatorHost("TQD001")
    host.behaviour.beam = Beam(0.5, 0.5, power)
    host.tell(m.QuadSetLoopParams(p_gain=p_gain, i_gain=i_gain, d_gain=0))
    assert host.behaviour.time_constants[0] == pytest.approx(constant, rel=1e-3)


def test_the_gains_that_were_set_last_apply():
    host = ActuatorHost("KPA101")
    host.tell(m.QuadSetLoopParams(p_gain=0, i_gain=32767, d_gain=0))
    assert host.behaviour.time_constants[0] == pytest.approx(0.02)
    host.tell(m.QuadSetLoopParams2(**host.ask(m.QuadReqLoopParams2()).values()))
    assert host.behaviour.time_constants[0] == pytest.approx(0.0331, abs=1e-4)


def test_without_integral_gain_an_error_remains():
    host = ActuatorHost("TQD001")
    host.behaviour.beam = Beam(0.4, 0)
    host.tell(m.QuadSetLoopParams(p_gain=32767, i_gain=0, d_gain=0), m.QuadSetOperMode(mode=CLOSED))
    host.to(5000)
    assert readings(host)[0] == pytest.approx(2 / 1.5, abs=1e-3)


def test_a_loop_with_the_wrong_sense_runs_to_its_limit():
    host = ActuatorHost("TQD001")
    host.behaviour.beam = Beam(0.4, 0)
    demand(host, x_pos_demand_fb_sense=-32767)
    host.tell(m.QuadSetOperMode(mode=CLOSED))
    host.to(5000)
    x, _, output, _ = readings(host)
    assert (x, output) == pytest.approx((5, -10), abs=1e-3)


def test_the_outputs_stay_within_the_limits_in_closed_loop_and_recover():
    host = ActuatorHost("TQD001")
    host.behaviour.beam = Beam(0.4, -0.4)
    demand(host, x_pos_demand_max=6553, y_pos_demand_min=-6553)
    host.tell(m.QuadSetOperMode(mode=CLOSED))
    for ms in range(0, 1000, 50):
        host.to(ms)
        _, _, x, y = readings(host)
        assert -2.001 <= y <= 0.001 <= 0.002 + x <= 2.004
    host.behaviour.beam = Beam(0.1, -0.1)
    host.to(2000)
    assert readings(host) == pytest.approx((0, 0, 1, -1), abs=1e-3)


def test_the_outputs_in_open_loop_steer_the_beam():
    host = ActuatorHost("TQD001")
    host.behaviour.beam = Beam(0.4, 0.2)
    host.tell(m.QuadSetPositionOutputs(x_pos=13107, y_pos=6553))
    assert readings(host) == pytest.approx((0, 0, 4, 2), abs=1e-3)
    assert host.ask(m.QuadReqPositionOutputs()).x_pos == 13107


@pytest.mark.parametrize("mode", [MONITOR, CLOSED])
def test_the_outputs_can_only_be_set_in_open_loop(mode):
    host = ActuatorHost("TQD001")
    host.tell(m.QuadSetOperMode(mode=mode))
    assert "only be set in open loop" in host.refuses(m.QuadSetPositionOutputs(x_pos=1, y_pos=1))


def test_monitor_mode_outputs_the_difference_signals():
    host = ActuatorHost("TQD001")
    host.tell(m.QuadSetOperMode(mode=MONITOR))
    x, y, x_output, y_output = readings(host)
    assert (x_output, y_output) == (x, y)
    assert QuadStatusBits(host.ask(m.QuadReqStatusBits()).status_bits).position_monitoring


@pytest.mark.parametrize(("demands", "share"), [(ZERO, 0), (HELD, 1)])
def test_opening_the_loop_zeroes_or_holds_the_outputs(demands, share):
    host = ActuatorHost("TQD001")
    host.behaviour.beam = Beam(0.4, 0.2)
    demand(host, open_loop_pos_demands=demands)
    host.tell(m.QuadSetOperMode(mode=CLOSED))
    host.to(1000)
    host.tell(m.QuadSetOperMode(mode=OPEN))
    host.to(2000)
    assert readings(host)[2:] == pytest.approx((4 * share, 2 * share), abs=1e-3)
    host.tell(m.QuadSetOperMode(mode=CLOSED))
    assert readings(host)[2] >= 4 * share - 1e-3


def test_a_new_gain_does_not_make_the_output_jump_by_the_integral():
    host = ActuatorHost("TQD001")
    host.tell(m.QuadSetOperMode(mode=CLOSED))
    host.to(1000)
    before = readings(host)
    host.tell(m.QuadSetLoopParams(p_gain=100, i_gain=200, d_gain=0))
    assert readings(host) == pytest.approx(before, abs=1e-3)


def test_automatic_mode_closes_the_loop_while_there_is_light():
    host = ActuatorHost("KPA101")
    host.behaviour.beam = Beam(0.4, 0.2)
    demand(host, open_loop_pos_demands=HELD)
    config = host.ask(m.QuadReqKpaTrigIoConfig()).values()
    del config["reserved"]
    host.tell(m.QuadSetKpaTrigIoConfig(**{**config, "trig1_sum_min": 20}))
    host.tell(m.QuadSetOperMode(mode=AUTOMATIC))
    host.to(1000)
    assert readings(host)[:2] == pytest.approx((0, 0), abs=1e-3)
    host.behaviour.beam = Beam(0.4, 0.2, 0)
    assert QuadStatusBits(host.ask(m.QuadReqStatusBits()).status_bits).open_loop
    assert host.ask(m.QuadReqOperMode()).mode == AUTOMATIC
    host.to(2000)
    assert readings(host) == pytest.approx((0, 0, 4, 2), abs=1e-3)
    host.behaviour.beam = Beam(0.3, 0.2)
    assert QuadStatusBits(host.ask(m.QuadReqStatusBits()).status_bits).closed_loop
    host.to(3000)
    assert readings(host) == pytest.approx((0, 0, 3, 2), abs=1e-3)


@pytest.mark.parametrize("unit", ["TPA101", "TQD001"])
def test_only_a_kpa101_has_automatic_mode(unit):
    host = ActuatorHost(unit)
    frame = bytes.fromhex("70 08 04 00 d0 01 07 00 04 00")
    host.instrument.receive(frame)
    assert "from 1 to 3" in host.refusals[0]


def test_limits_in_the_wrong_order_are_refused():
    host = ActuatorHost("TQD001")
    now = host.ask(m.QuadReqPosDemandParams()).values()
    bad = m.QuadSetPosDemandParams(**{**now, "x_pos_demand_min": 2, "x_pos_demand_max": 1})
    assert "above the highest" in host.refuses(bad)


def test_saved_parameters_survive_but_the_unit_starts_in_open_loop():
    host = ActuatorHost("TPA101")
    demand(host, x_pos_demand_max=1000, open_loop_pos_demands=HELD)
    host.tell(m.QuadSetOperMode(mode=CLOSED), m.QuadSetEepromParams(msg_id=0x0870))
    host.tell(m.QuadSetDisplaySettings(disp_intensity=1, disp_mode=2, disp_dim_timeout=3))
    host.to(500)
    host.instrument.power_cycle()
    assert host.ask(m.QuadReqPosDemandParams()).x_pos_demand_max == 1000
    assert host.ask(m.QuadReqOperMode()).mode == OPEN
    assert readings(host)[2:] == (0, 0)
    assert host.ask(m.QuadReqDisplaySettings()).disp_intensity == 255


def test_updates_stop_without_a_keep_alive_on_units_that_have_one():
    aligner, reader = ActuatorHost("TPA101"), ActuatorHost("TQD001")
    for host in aligner, reader:
        host.tell(m.HwStartUpdateMsgs(10))
        host.to(10_000)
    assert (len(aligner.said), len(reader.said)) == (50, 100)
    aligner.tell(m.QuadAckStatusUpdate())
    aligner.to(11_000)
    assert len(aligner.said) == 60
    status, now = aligner.ask(m.QuadReqStatusUpdate()), aligner.ask(m.QuadReqReadings())
    assert status.status_bits == 2
    assert (status.x_diff, status.sum, status.y_pos) == (now.x_diff, now.sum, now.y_pos)


@pytest.mark.parametrize(
    ("mode", "beam", "active"),
    [
        (0x0B, Beam(0.4, 0, 5), True),
        (0x0B, Beam(0.4, 0, 1), False),
        (0x0B, Beam(0.4, 0, 9), False),
        (0x0C, Beam(0.1, 0.1, 5), True),
        (0x0C, Beam(0.1, -0.4, 5), False),
        (0x0D, Beam(0.1, 0.1, 5), True),
        (0x0D, Beam(0.1, 0.1, 1), False),
        (0x0D, Beam(0.4, 0.1, 5), False),
    ],
)
def test_the_outputs_of_the_ports_follow_the_signals(mode, beam, active):
    host = ActuatorHost("KPA101")
    for polarity in 1, 2:
        config = m.QuadSetKpaTrigIoConfig(
            **{f"trig{port}_mode": mode for port in (1, 2)},
            **{f"trig{port}_polarity": polarity for port in (1, 2)},
            **{f"trig{port}_sum_min": 20 for port in (1, 2)},
            **{f"trig{port}_sum_max": 80 for port in (1, 2)},
            **{f"trig{port}_diff_threshold": 10 for port in (1, 2)},
        )
        host.tell(config)
        host.behaviour.beam = beam
        assert host.behaviour.outputs == (active == (polarity == 1),) * 2


def test_a_port_toggles_the_loop_and_another_is_a_plain_output():
    host = ActuatorHost("KPA101")
    config = host.ask(m.QuadReqKpaTrigIoConfig()).values()
    del config["reserved"]
    config.update(trig1_mode=2, trig1_polarity=2, trig2_mode=0x0A, trig2_polarity=2)
    host.tell(m.QuadSetKpaTrigIoConfig(**config))
    for mode in CLOSED, OPEN:
        host.behaviour.set_input(1, False)
        assert host.ask(m.QuadReqOperMode()).mode == mode
        host.behaviour.set_input(1, True)
        assert host.ask(m.QuadReqOperMode()).mode == mode
    assert host.behaviour.outputs == (True, True)
    host.tell(m.QuadSetKpaDigOutputs(dig_ops=2))
    assert host.behaviour.outputs == (True, False)


def test_the_row_shows_the_signals_and_the_mode():
    host = ActuatorHost("TQD001")
    host.behaviour.beam = Beam(0.4, 0.2)
    row = host.instrument.rows()[0]
    assert (row.position, row.state) == ("2.000, -1.000 V", "open loop")


@pytest.mark.parametrize("values", [(1.5, 0, 5), (0, -2, 5), (0, 0, 11), (0, 0, -1)])
def test_a_beam_out_of_range_is_refused(values):
    with pytest.raises(BadValueError):
        Beam(*values)
