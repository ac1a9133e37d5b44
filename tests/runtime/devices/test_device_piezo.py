"""Piezos and strain gauges, whose scales depend on settings of the controller."""

from __future__ import annotations

import pytest
from recording_link import RecordingLink

import stagewire_virtual as virtual
from stagewire.errors import OutOfRangeError, UnknownScaleError, UnsupportedError
from stagewire_apt import BPC002, BPC201, BPC202, MPZ601, PROTOCOL, TPZ001, TSG001
from stagewire_apt import enumerations as e
from stagewire_apt import messages as m

STOP = m.PzStopLutOutput(chan_ident=1).pack(0x50, 0x01)


def test_volts_are_scaled_by_the_maximum_that_the_controller_reports() -> None:
    line = RecordingLink(virtual.BPC201())
    with BPC201.open(line) as bpc:
        assert bpc.get_output_max_volts().volts == 75
        line.forget()
        bpc.set_output_volts(volts=30)
        expected = m.PzSetOutputVolts(chan_ident=1, voltage=13107)
        assert line.raw == expected.pack(0x50, 0x01)
        assert "maximum_volts 75 V, from PZ_GET_OUTPUTMAXVOLTS" in str(bpc)


def test_changing_the_maximum_changes_the_scale() -> None:
    line = RecordingLink(virtual.BPC201())
    with BPC201.open(line, max_volts=150) as bpc:
        read = bpc.get_output_volts()
        bpc.set_output_volts(voltage=16384)
        before = bpc.get_output_volts()
        bpc.set_output_max_volts(volts=150, flags=0)
        line.forget()
        bpc.set_output_volts(volts=30)
        expected = m.PzSetOutputVolts(chan_ident=1, voltage=6553)
        assert line.raw == expected.pack(0x50, 0x01)
        assert read.volts == 0
        assert before.volts == pytest.approx(
            37.5, abs=0.01
        )  # with the scale at the time of reading


def test_an_unsolicited_setting_updates_the_scale() -> None:
    line = RecordingLink(virtual.BPC201())
    with BPC201.open(line) as bpc:
        line.controller.write(
            m.PzSetOutputMaxVolts(chan_ident=1, voltage=1500, flags=0).pack(0x50, 0x01)
        )  # sent by another host
        bpc.session.pause(0.1)
        line.forget()
        bpc.set_output_volts(volts=30)
        expected = m.PzSetOutputVolts(chan_ident=1, voltage=6553)
        assert line.raw == expected.pack(0x50, 0x01)


def test_a_maximum_from_a_table_is_converted_to_volts() -> None:
    line = RecordingLink(virtual.TPZ001())
    with TPZ001.open(line, max_volts=150) as tpz:
        tpz.change_tpz_io_settings(voltage_limit=e.VoltageLimit.VOLTAGELIMIT_150V)
        line.forget()
        tpz.set_output_volts(volts=75)
        expected = m.PzSetOutputVolts(chan_ident=1, voltage=16384)
        assert line.raw == expected.pack(0x50, 0x01)


def test_a_voltage_above_the_maximum_is_refused_before_anything_is_sent() -> None:
    line = RecordingLink(virtual.BPC201())
    with BPC201.open(line) as bpc:
        line.forget()
        with pytest.raises(OutOfRangeError, match=r"volts must be -75.*to 75 V, not 75\.01"):
            bpc.set_output_volts(volts=75.01)
        assert line.raw == b""


def test_a_setting_that_is_not_reported_must_be_passed_to_open() -> None:
    line = RecordingLink(virtual.TPZ001())
    with TPZ001.open(line) as tpz:
        line.forget()
        with pytest.raises(UnknownScaleError, match=r"maximum_travel.*pass max_travel_um= to open"):
            tpz.set_output_pos(um=1)
        assert line.raw == b""
    with TPZ001.open(RecordingLink(line.controller), max_travel_um=20) as tpz:
        tpz.set_pos_control_mode(mode=e.PositionControlMode.CLOSED_LOOP)
        tpz.set_output_pos(um=10)
        assert tpz.get_output_pos().um == pytest.approx(10, abs=0.001)
        assert "maximum_travel 20 um, set by max_travel_um" in str(tpz)


def test_without_identification_the_maximum_must_be_passed_or_read() -> None:
    line = RecordingLink(virtual.BPC201())
    with BPC201.open(line, identify=False) as bpc:
        way = r"pass settings=\{'maximum_volts': …\} to open or send PZ_REQ_OUTPUTMAXVOLTS"
        with pytest.raises(UnknownScaleError, match=way):
            bpc.set_output_volts(volts=30)
        assert line.raw == b""
        bpc.get_output_max_volts()
        bpc.set_output_volts(volts=30)


def test_the_keyword_gives_the_unit_of_samples_unless_the_unit_is_known() -> None:
    line = RecordingLink(virtual.TPZ001())
    with TPZ001.open(line, settings={"maximum_volts": 150}, identify=False) as tpz:
        tpz.set_output_lut(index=2, volts=10)
        expected = m.PzSetOutputLut(chan_ident=1, index=2, output=2184)
        assert line.raw == expected.pack(0x50, 0x01)
        line.forget()
        with pytest.raises(UnknownScaleError, match="by the maximum output voltage only"):
            tpz.set_output_lut(index=2, um=10)
        assert line.raw == b""
        with pytest.raises(UnknownScaleError, match="depends on lut_value_type"):
            _ = tpz.get_output_lut().volts
        assert (
            "    lut_output in raw counts only: it depends on lut_value_type, which the controller "
            "does not report"
        ) in str(tpz).splitlines()


def test_closing_stops_a_waveform() -> None:
    for stops in (0, 1):
        line = RecordingLink(virtual.BPC201())
        with BPC201.open(line) as bpc:
            bpc.start_lut_output()
            for _ in range(stops):
                assert bpc.stop_lut_output() is None
            line.forget()
        assert line.raw == (b"" if stops else STOP)


def test_closing_can_leave_a_waveform_running() -> None:
    line = RecordingLink(virtual.BPC201())
    with BPC201.open(line, on_close="leave") as bpc:
        bpc.start_lut_output()
        line.forget()
    assert line.raw == b""


def test_a_reading_is_in_the_unit_of_the_display() -> None:
    line = RecordingLink(virtual.TSG001())
    with TSG001.open(line) as tsg:
        values = tsg.values(m.PzGetTsgReading(chan_ident=1, reading=16384, smoothed=0))
        assert values is not None
        assert values.exact("um") == pytest.approx(10, abs=0.01)
        with pytest.raises(UnknownScaleError, match="is in um, not in N, while display_mode is"):
            values.exact("newtons")
        assert "from PZ_GET_MAXTRAVEL; display_mode is DISPUNITS_POSITION)" in str(tsg)
        assert str(tsg).count("strain_gauge_reading") == 1
        tsg.change_tsg_io_settings(display_mode=e.DisplayMode.DISPUNITS_FORCE)
        now = tsg.values(values.message)
        assert now is not None
        assert now.exact("newtons") == pytest.approx(15, abs=0.01)
        assert values.exact("um") == pytest.approx(
            10, abs=0.01
        )  # with the scale at the time of the reading


def test_only_occupied_bays_are_asked_for_their_settings() -> None:
    line = RecordingLink(virtual.BPC202(empty_bays=[2]))
    with BPC202.open(line) as rack:
        assert line.names(PROTOCOL) == [
            "HW_REQ_INFO",
            "RACK_REQ_BAYUSED",
            "PZ_REQ_MAXTRAVEL",
            "PZ_REQ_OUTPUTMAXVOLTS",
            "RACK_REQ_BAYUSED",
        ]
        rack.bay(1).set_output_volts(volts=1)
        with pytest.raises(UnknownScaleError):
            rack.bay(2).set_output_volts(volts=1)


def test_each_channel_has_its_own_maximum() -> None:
    line = RecordingLink(virtual.BPC002())
    with BPC002.open(line, max_volts=150) as bpc:
        first, second = bpc.channels
        first.set_output_max_volts(volts=150, flags=0)
        line.forget()
        for channel in (first, second):
            channel.set_output_volts(volts=30)
        assert line.raw == b"".join(
            m.PzSetOutputVolts(chan_ident=channel, voltage=voltage).pack(0x50, 0x01)
            for channel, voltage in ((1, 6553), (2, 13107))
        )


def test_channels_of_a_module_have_their_own_settings() -> None:
    line = RecordingLink(virtual.rack("MPZ601"))
    with MPZ601.open(line, settings={"maximum_volts": 75}) as module:
        first, second = module.channels
        first.set_output_volts(volts=1)
        second.set_output_volts(volts=1)


def test_is_moving_raises_for_a_unit_that_cannot_be_asked() -> None:
    with (
        BPC201.open(RecordingLink(virtual.BPC201())) as bpc,
        pytest.raises(UnsupportedError, match="a BPC201 has no request for whether it moves"),
    ):
        bpc.is_moving()
