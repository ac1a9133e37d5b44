"""The NanoTrak: tracking, latch, home position, ranges, status, trigger ports and the scan of a KNA101."""

import struct

import pytest
from actuator_host import ActuatorHost
from apt_host import BAY, USB

from stagewire.errors import BadValueError
from stagewire_apt import messages as m
from stagewire_apt.flags import BntStatusBits, NanotrakStatusBits
from stagewire_virtual.thorlabs_apt.nanotrak.signal import Spot

NANOTRAKS = ["BNT001", "KNA101", "MNA601", "TNA001"]
LATCH, TRACK, HORIZONTAL, VERTICAL = 2, 3, 4, 5
REVOLUTION = 160 / 7  # ms
NT = 6553.5


def host_of(unit="KNA101", **options):
    return ActuatorHost(unit, address=BAY if unit == "MNA601" else USB, **options)


def real(bits):
    return struct.unpack("<f", struct.pack("<I", bits))[0]


def circle(host):
    answer = host.ask(m.PzReqNtCircCentrePos())
    return answer.circ_pos_a / NT, answer.circ_pos_b / NT


def reading(host):
    answer = host.ask(m.PzReqNtTiaReading())
    return real(answer.abs_reading), answer.rel_reading, answer.range, answer.under_over_read


@pytest.mark.parametrize("unit", NANOTRAKS)
@pytest.mark.parametrize("seed", range(4))
def test_tracking_finds_the_spot_in_the_stated_time(unit, seed):
    host = host_of(unit, seed=seed)
    spot = host.behaviour.spot
    before, *_ = reading(host)
    host.tell(m.PzSetNtMode(TRACK))
    host.to(481)
    a, b = circle(host)
    assert a == pytest.approx(spot.a, abs=0.01 * abs(spot.a - 5) + 1 / NT)
    assert b == pytest.approx(spot.b, abs=0.01 * abs(spot.b - 5) + 1 / NT)
    assert reading(host)[0] > before
    assert reading(host)[0] == pytest.approx(spot.peak, rel=0.01)
    assert host.ask(m.PzReqNtMode()) == m.PzGetNtMode(4, 1)


def test_the_seed_decides_where_the_spot_is():
    assert host_of(seed=1).behaviour.spot == host_of(seed=1).behaviour.spot
    assert host_of(seed=1).behaviour.spot != host_of(seed=2).behaviour.spot


@pytest.mark.parametrize(
    ("gain", "diameter", "share"),
    [(600, 6554, 0.2), (1200, 6554, 0.4), (600, 13107, 0.4), (300, 6554, 0.1)],
)
def test_each_revolution_goes_a_share_of_the_distance(gain, diameter, share):
    host = host_of()
    host.behaviour.spot = Spot(7, 5)
    host.tell(m.PzSetNtGainParams(gain_ctrl_mode=2, nt_gain_sw=gain))
    host.tell(m.PzSetNtCircDia(circ_dia=diameter & 0xFF, circ_dia_high=diameter >> 8))
    host.tell(m.PzSetNtMode(TRACK))
    for revolutions in range(1, 6):
        host.to(revolutions * REVOLUTION + 1)
        assert circle(host)[0] == pytest.approx(7 - 2 * (1 - share) ** revolutions, abs=2e-4)


def test_looking_does_not_change_the_way_of_the_circle():
    watched, alone = host_of(), host_of()
    for host in watched, alone:
        host.tell(m.PzSetNtMode(TRACK))
    for ms in range(0, 300, 7):
        watched.to(ms)
        watched.tell(m.PzReqNtTiaReading())
    for host in watched, alone:
        host.to(300)
    assert circle(watched) == circle(alone)
    assert reading(watched) == reading(alone)


def test_a_high_gain_makes_the_circle_unstable():
    host = host_of()
    host.behaviour.spot = Spot(6, 5)
    host.tell(m.PzSetNtGainParams(gain_ctrl_mode=2, nt_gain_sw=10_000), m.PzSetNtMode(TRACK))
    seen = set()
    for revolutions in range(50, 60):
        host.to(revolutions * REVOLUTION + 1)
        seen.add(round(circle(host)[0]))
    assert len(seen) > 1


def test_changed_parameters_apply_from_the_present_position():
    host = host_of()
    host.behaviour.spot = Spot(7, 5)
    host.tell(m.PzSetNtMode(TRACK))
    host.to(2 * REVOLUTION + 1)
    host.tell(m.PzSetNtGainParams(gain_ctrl_mode=2, nt_gain_sw=1200))
    host.to(3 * REVOLUTION + 1)
    assert circle(host)[0] == pytest.approx(7 - 2 * 0.8**2 * 0.6, abs=2e-4)


@pytest.mark.parametrize(
    ("mode", "axes", "moved"),
    [(HORIZONTAL, 2, (True, False)), (VERTICAL, 3, (False, True)), (TRACK, 1, (True, True))],
)
def test_one_axis_can_be_tracked_alone(mode, axes, moved):
    host = host_of()
    host.tell(m.PzSetNtMode(mode))
    host.to(100)
    assert tuple(abs(at - 5) > 0.1 for at in circle(host)) == moved
    assert host.ask(m.PzReqNtMode()).mode == axes
    bits = NanotrakStatusBits(host.ask(m.PzReqNtStatusBits(1)).status_bits)
    assert bits.tracking
    assert (bits.tracking_channel_a, bits.tracking_channel_b) == (axes == 2, axes == 3)


def test_latch_holds_the_position_and_tracking_follows_the_spot():
    host = host_of()
    host.tell(m.PzSetNtMode(TRACK))
    host.to(400)
    host.tell(m.PzSetNtMode(LATCH))
    held = circle(host)
    spot = host.behaviour.spot
    host.behaviour.spot = Spot(10 - spot.a, spot.b)
    host.to(1000)
    assert circle(host) == held
    assert host.ask(m.PzReqNtMode()) == m.PzGetNtMode(LATCH, 1)
    host.tell(m.PzSetNtMode(TRACK))
    host.to(2000)
    assert circle(host) == pytest.approx((10 - spot.a, spot.b), abs=1e-3)


def test_without_light_the_circle_does_not_move():
    host = host_of()
    host.behaviour.spot = Spot(7, 7, peak=0)
    host.tell(m.PzSetNtMode(TRACK))
    host.to(1000)
    assert circle(host) == pytest.approx((5, 5), abs=1e-4)
    assert host.ask(m.PzReqNtMode()).state == 3
    assert reading(host) == (0, 0, 3, 2)


def test_the_circle_moves_to_its_home_position():
    host = host_of()
    host.tell(m.PzSetNtCircHomePos(13107, 52428), m.PzMoveNtCircToHomePos())
    host.to(50)
    assert circle(host) == pytest.approx((3.5, 6.5), abs=1e-3)
    host.to(100)
    assert circle(host) == pytest.approx((2, 8), abs=1e-4)
    host.to(500)
    assert circle(host) == pytest.approx((2, 8), abs=1e-4)


def test_tracking_continues_after_the_home_position():
    host = host_of()
    host.behaviour.spot = Spot(6, 6)
    host.tell(m.PzSetNtMode(TRACK))
    host.to(500)
    host.tell(m.PzMoveNtCircToHomePos())
    host.to(600)
    assert circle(host) == pytest.approx((5, 5), abs=1e-4)
    host.to(600 + REVOLUTION + 0.1)
    assert circle(host) == pytest.approx((5.2, 5.2), abs=1e-3)


def test_latch_stops_the_circle_on_its_way_home():
    host = host_of()
    host.tell(m.PzSetNtCircHomePos(0, 32767), m.PzMoveNtCircToHomePos())
    host.to(40)
    host.tell(m.PzSetNtMode(LATCH))
    host.to(400)
    assert circle(host) == pytest.approx((3, 5), abs=1e-3)


@pytest.mark.parametrize(
    ("unit", "current", "steps", "range_", "share"),
    [
        ("BNT001", 1e-9, 1, 3, 1 / 3),
        ("TNA001", 1e-9, 1, 5, 1 / 30),
        ("KNA101", 1e-9, 1, 3, 1 / 5),
        ("BNT001", 2e-6, 1, 10, 1 / 5),
        ("BNT001", 2e-6, 2, 9, 2 / 3),
        ("BNT001", 1e-6, 3, 10, 1 / 10),
        ("KNA101", 2e-6, 1, 9, 2 / 5),
        ("BNT001", 5e-3, 1, 16, 1 / 2),
        ("KNA101", 4.5e-3, 1, 15, 0.9),
    ],
)
def test_the_range_follows_the_signal(unit, current, steps, range_, share):
    host = host_of(unit)
    host.tell(m.PzSetNtTiaRangeParams(1, 850, 150, 4, steps, 7))
    host.behaviour.spot = Spot(5, 5, peak=current)
    host.tell(m.PzSetNtCircHomePos(32768, 32768), m.PzMoveNtCircToHomePos())
    host.to(100)
    absolute, relative, now, check = reading(host)
    assert absolute == pytest.approx(current, rel=1e-3)
    assert now == range_
    assert relative == pytest.approx(share * 32767, rel=2e-3)
    assert check == (1 if share >= 0.05 else 2)


@pytest.mark.parametrize(("range_", "check"), [(8, 3), (9, 1), (10, 1), (12, 2)])
def test_a_manual_range_stays_and_reports_a_signal_beyond_it(range_, check):
    host = host_of("BNT001")
    host.behaviour.spot = Spot(5, 5, width=100, peak=2e-6)
    host.tell(m.PzSetNtTiaRangeParams(3, 850, 150, 4, 1, range_))
    assert reading(host)[2:] == (range_, check)
    bits = BntStatusBits(host.ask(m.PzReqNtStatusBits(1)).status_bits)
    assert (bits.under_read, bits.over_read) == (check == 2, check == 3)
    assert not bits.auto_ranging
    host.tell(m.PzSetNtTiaRangeParams(2, 850, 150, 4, 1, 5))  # stays at the present range
    assert reading(host)[2] == range_
    host.tell(m.PzSetNtTiaRangeParams(1, 850, 150, 4, 1, 5))
    assert reading(host)[2] == min(max(range_, 9), 10)  # 20 % of range 10 is above its lower limit
    assert BntStatusBits(host.ask(m.PzReqNtStatusBits(1)).status_bits).auto_ranging


def test_a_signal_beyond_the_range_is_not_followed():
    host = host_of()
    host.tell(m.PzSetNtTiaRangeParams(3, 850, 150, 4, 1, 3), m.PzSetNtMode(TRACK))
    host.to(500)
    assert circle(host) == pytest.approx((5, 5), abs=1e-4)


def test_the_threshold_only_decides_the_reported_state():
    host = host_of()
    host.tell(m.PzSetNtTrackThreshold(struct.unpack("<I", struct.pack("<f", 1e-3))[0]))
    host.tell(m.PzSetNtMode(TRACK))
    host.to(481)
    assert host.ask(m.PzReqNtMode()).state == 3
    assert not NanotrakStatusBits(host.ask(m.PzReqNtStatusBits(1)).status_bits).tracking_with_signal
    assert circle(host)[0] == pytest.approx(host.behaviour.spot.a, abs=0.05)


def test_an_external_voltage_has_no_ranges():
    host = host_of("BNT001")
    host.behaviour.spot = Spot(5, 5, width=100, peak=50e-6)
    before = reading(host)[2]
    host.tell(m.PzSetNtFeedbackSrc(4))
    assert reading(host) == (pytest.approx(2.0, rel=1e-4), 13107, before, 1)
    host.tell(m.PzSetNtFeedbackSrc(2))
    assert reading(host) == (pytest.approx(1.0), 32767, before, 3)


def test_the_diameter_depends_on_the_mode():
    host = host_of()
    status = m.PzReqNtStatusUpdate(1)
    host.tell(m.PzSetNtCircParams(1, 10_000, 160, 1000, 5000, 1))
    assert host.ask(status).circ_dia == 10_000
    host.tell(m.PzSetNtCircParams(3, 10_000, 160, 1000, 5000, 1))
    now = host.ask(status)
    table = host.ask(m.PzReqNtCircDiaLut()).values()
    assert now.circ_dia == table[f"lut_val_{now.range}"]
    for adjust in 1, 2, 3, 4:
        host.tell(m.PzSetNtCircParams(2, 10_000, 160, 1000, 5000, adjust))
        assert 1000 < host.ask(status).circ_dia < 5000
    host.behaviour.spot = Spot(5, 5, peak=0)
    assert host.ask(status).circ_dia == 5000


@pytest.mark.parametrize(
    ("unit", "message", "why"),
    [
        ("KNA101", m.PzSetNtCircParams(1, 6554, 161, 0, 0, 1), "a multiple of 4"),
        ("KNA101", m.PzSetNtCircParams(1, 6554, 0, 0, 0, 1), "a multiple of 4"),
        ("TNA001", m.PzSetNtCircParams(1, 6554, 40, 0, 0, 1), "from 80 to 400"),
        ("TNA001", m.PzSetNtTiaRangeParams(3, 850, 150, 4, 1, 4), "does not have range 4"),
        ("KNA101", m.PzSetNtTiaRangeParams(3, 850, 150, 4, 1, 16), "range_sw must be one of"),
        ("KNA101", m.PzSetNtFeedbackSrc(5), "does not have input 5"),
        ("BNT001", m.PzSetNtMode(7), "unknown mode 7"),
    ],
)
def test_a_set_that_the_document_excludes_is_refused(unit, message, why):
    assert why in host_of(unit).refuses(message)


def test_a_new_unit_is_latched_in_the_middle_and_again_after_a_restart():
    host = host_of()
    assert host.ask(m.PzReqNtMode()) == m.PzGetNtMode(LATCH, 1)
    host.tell(m.PzSetNtGainParams(gain_ctrl_mode=2, nt_gain_sw=700))
    host.tell(m.NtSetEepromParams(1, m.PzSetNtGainParams.layout.id), m.PzSetNtMode(TRACK))
    host.tell(m.PzSetNtCircHomePos(1, 1))
    host.to(500)
    host.instrument.power_cycle()
    assert host.ask(m.PzReqNtMode()) == m.PzGetNtMode(LATCH, 1)
    assert circle(host) == pytest.approx((5, 5), abs=1e-4)
    assert host.ask(m.PzReqNtGainParams()).nt_gain_sw == 700
    assert host.ask(m.PzReqNtCircHomePos()).circ_home_pos_a == 32767


def test_updates_are_sent_once_for_both_channels_until_the_keep_alive_is_missing():
    host = host_of()
    host.tell(m.HwStartUpdateMsgs(10))
    host.to(1000)
    assert len(host.said) == 10
    assert {type(message) for _, message in host.said} == {m.PzGetNtStatusUpdate}
    host.to(10_000)
    assert len(host.said) == 50
    host.tell(m.PzAckNtStatusUpdate())
    host.to(11_000)
    assert len(host.said) == 60
    assert host.ask(m.PzReqNtStatusUpdate(2)) == host.ask(m.PzReqNtStatusUpdate(1))


def test_the_status_has_the_gain_and_the_phases():
    host = host_of("TNA001")
    host.tell(m.PzSetNtPhaseCompParams(2, 147, 12), m.PzSetNtGainParams(2, 650))
    status = host.ask(m.PzReqNtStatusUpdate(1))
    assert (status.nt_gain, status.phase_comp_a, status.phase_comp_b) == (650, 147, 12)
    assert (status.circ_pos_a, status.circ_pos_b) == (32768, 32768)


def test_the_loop_of_each_channel_is_in_the_status_bits():
    host = host_of()
    host.tell(m.PzSetPosControlMode(2, 2))
    bits = NanotrakStatusBits(host.ask(m.PzReqNtStatusBits(2)).status_bits)
    assert (bits.channel_a_closed_loop, bits.channel_b_closed_loop) == (False, True)
    assert host.ask(m.PzReqNtStatusBits(1)).status_bits == int(bits)


def test_an_edge_at_a_port_starts_tracking_or_homing():
    host = host_of()
    host.tell(m.KnaSetKcubeTrigIoConfig(t1_mode=2, t1_polarity=1, t2_mode=3, t2_polarity=2))
    host.behaviour.set_input(2, True)
    host.behaviour.set_input(1, True)
    assert host.ask(m.PzReqNtMode()).state in (3, 4)
    host.to(400)
    host.tell(m.PzSetNtMode(LATCH))
    host.behaviour.set_input(1, True)
    assert host.ask(m.PzReqNtMode()).state == LATCH
    host.behaviour.set_input(2, False)
    host.to(500)
    assert circle(host) == pytest.approx((5, 5), abs=1e-3)


def test_the_ports_are_outputs():
    host = host_of()
    host.tell(m.KnaSetKcubeTrigIoConfig(t1_mode=0x0B, t1_polarity=1, t2_mode=0x0A, t2_polarity=2))
    assert host.behaviour.outputs == (False, True)
    host.tell(m.PzSetNtMode(TRACK), m.ModSetDigOutputs(2))
    assert host.behaviour.outputs == (True, False)


def test_piezo_mode_takes_effect_after_a_restart():
    host = host_of()
    assert "piezo mode" in host.refuses(m.KnaReqXyScan())
    host.tell(m.PzSetNtMode(1))
    assert host.ask(m.PzReqNtMode()).state == LATCH
    host.instrument.power_cycle()
    assert host.ask(m.PzReqNtMode()).state == 1
    assert "piezo amplifier" in host.refuses(m.PzMoveNtCircToHomePos())
    assert "next restart" in host.refuses(m.PzSetNtMode(TRACK))
    host.instrument.power_cycle()
    assert host.ask(m.PzReqNtMode()).state == LATCH


def test_a_scan_shows_the_spot_and_can_be_stopped():
    host = host_of()
    host.tell(m.PzSetNtMode(1))
    host.instrument.power_cycle()
    host.tell(m.PzSetNtTiaRangeParams(3, 850, 150, 4, 1, 12), m.KnaReqXyScan())
    host.to(10_000)
    lines = [message for _, message in host.said if isinstance(message, m.KnaGetXyScan)]
    assert [line.line_number for line in lines] == list(range(96))
    values = {
        (line.line_number, at): x for line in lines for at, x in enumerate(line.intensity_map)
    }
    highest = max(values.values())
    row, column = next(at for at, value in values.items() if value == highest)
    spot = host.behaviour.spot
    assert (column / 95 * 10, row / 95 * 10) == pytest.approx((spot.a, spot.b), abs=0.5)
    host.said.clear()
    host.tell(m.KnaReqXyScan())
    host.to(10_175)
    host.tell(m.KnaStopXyScan())
    host.to(11_000)
    assert len(host.said) == 3


def test_defaults_come_back_from_the_eeprom():
    host = host_of()
    host.tell(m.PzSetNtTiaRangeParams(3, 850, 150, 4, 1, 9), m.MotSetPzStageParamDefaults(1))
    assert host.ask(m.PzReqNtTiaRangeParams()).range_mode == 1


def test_the_row_shows_position_and_state():
    host = host_of()
    row = host.instrument.rows()[0]
    assert (row.position, row.state) == ("5.000, 5.000 NT", "latched")
    host.tell(m.PzSetNtMode(TRACK))
    assert host.instrument.rows()[1].state == "tracking"


@pytest.mark.parametrize(
    ("a", "b", "width", "peak"),
    [(-1, 5, 3, 1), (5, 10.5, 3, 1), (5, 5, 0, 1), (5, 5, 3, -1), (5, 5, 3, float("nan"))],
)
def test_a_spot_out_of_range_is_refused(a, b, width, peak):
    with pytest.raises(BadValueError):
        Spot(a, b, width, peak)
