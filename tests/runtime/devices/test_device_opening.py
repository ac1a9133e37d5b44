"""Opening a device: identification, invalid options, printing, and reconnecting."""

from __future__ import annotations

import logging
import time
from pathlib import Path
from typing import Any

import pytest
from recording_link import RecordingLink

import stagewire_apt
import stagewire_virtual as virtual
from stagewire import Scale, Stage
from stagewire.errors import (
    BadValueError,
    LinkOpenError,
    MotionUnderWayError,
    OutOfRangeError,
    ReplyTimeoutError,
    TransportError,
    TransportLostError,
    UnknownScaleError,
    WrongUnitError,
)
from stagewire_apt import BBD102, BPC201, K10CR1, MST601, PROTOCOL, TDC001, TST001, stages
from stagewire_apt import messages as m
from stagewire_apt.devices.facts import FACTS
from stagewire_ms2000 import MS2000
from stagewire_virtual.factory import simulated_units


def test_opening_only_requests_the_identity_and_the_state_that_motions_need() -> None:
    line = RecordingLink(virtual.TDC001())
    with TDC001.open(line) as tdc:
        assert line.names(PROTOCOL) == [
            "HW_REQ_INFO",
            "MOT_REQ_HOMEPARAMS",
            "MOD_REQ_CHANENABLESTATE",
            "MOT_REQ_VELPARAMS",
            "MOT_REQ_JOGPARAMS",
        ]
        assert tdc.serial_number == tdc.get_info().serial_number
        assert tdc.info is not None


def test_opening_a_piezo_requests_the_settings_of_its_scales() -> None:
    line = RecordingLink(virtual.BPC201())
    with BPC201.open(line):
        assert line.names(PROTOCOL) == ["HW_REQ_INFO", "PZ_REQ_MAXTRAVEL", "PZ_REQ_OUTPUTMAXVOLTS"]


def test_a_device_can_be_opened_without_identification() -> None:
    line = RecordingLink(virtual.TDC001())
    with TDC001.open(line, identify=False, line="rs232") as tdc:
        assert line.raw == b""
        assert tdc.info is None
        assert tdc.serial_number is None
        assert "identity not read" in str(tdc)


def test_keep_alive_messages_are_sent_only_on_usb() -> None:
    alive = m.MotAckDcStatusUpdate().pack(0x50, 0x01)
    for given, count in (("usb", 4), ("rs232", 0)):
        line = RecordingLink(virtual.TDC001())
        with TDC001.open(line, line=given) as tdc:  # type: ignore[arg-type]
            tdc.session.pause(1.6)
            assert line.raw.count(alive) == count


def test_keep_alive_messages_are_sent_to_every_bay() -> None:
    line = RecordingLink(virtual.BBD102())
    with BBD102.open(line) as rack:
        rack.session.pause(0.1)
        for bay in (0x21, 0x22):
            assert m.MotAckDcStatusUpdate().pack(bay, 0x01) in line.raw
        assert m.MotAckDcStatusUpdate().pack(0x11, 0x01) not in line.raw


# Identification


def test_another_unit_is_refused() -> None:
    line = RecordingLink(virtual.TST001())
    with pytest.raises(
        WrongUnitError,
        match=r"is not a TDC001: .* 80\d+ and model 'TST001', .* open it as TST001",
    ):
        TDC001.open(line)
    with pytest.raises(TransportLostError):  # it was closed
        line.write(b"")


def test_another_unit_is_accepted_without_identification() -> None:
    with TDC001.open(RecordingLink(virtual.TST001()), identify=False) as tdc:
        assert tdc.get_pos_counter().position == 0


def test_another_serial_number_is_refused() -> None:
    controller = virtual.TDC001(serial_number=83000001)
    with pytest.raises(WrongUnitError, match="has serial number 83000001, not 83000002"):
        TDC001.open(RecordingLink(controller), serial_number=83000002)
    with TDC001.open(RecordingLink(controller), serial_number=83000001) as tdc:
        assert tdc.serial_number == 83000001


def test_a_unit_newer_than_the_document_is_named_in_a_warning(
    caplog: pytest.LogCaptureFixture,
) -> None:
    line = RecordingLink(virtual.K10CR1(serial_number=55000001, model="K10CR2"))
    with caplog.at_level(logging.WARNING, "stagewire"), K10CR1.open(line) as mount:
        assert "newer than the document; uses the messages of K10CR1" in str(mount)
        assert "K10CR2: rotation stage" in caplog.text


def test_a_newer_unit_is_refused_as_a_unit_with_other_messages() -> None:
    line = RecordingLink(virtual.TST001(serial_number=27000001))
    with pytest.raises(
        WrongUnitError, match=r"the number belongs to KDC101, but the model to TST001"
    ):
        TST001.open(line)
    with pytest.raises(
        WrongUnitError, match=r"belongs to BPC103 or BPC203 or BPC303, but the model to BPC201"
    ):
        BPC201.open(RecordingLink(virtual.BPC201(serial_number=71000001)))


@pytest.mark.parametrize("name", sorted({*FACTS.units} & {*simulated_units()}))
def test_every_virtual_unit_can_be_opened_as_its_class(name: str) -> None:
    unit: type[Any] = getattr(stagewire_apt, name)
    controller = virtual.rack(name) if unit.unit.kind == "bay" else getattr(virtual, name)()
    with unit.open(RecordingLink(controller)) as device:
        assert device.serial_number is not None
        assert name in str(device)


def test_opening_without_a_controller_times_out() -> None:
    line = RecordingLink(virtual.TDC001())
    line.twist = lambda data: b""
    with pytest.raises(
        ReplyTimeoutError, match=r"no TDC001 answers at virtual://TDC001: .*identify=False"
    ):
        TDC001.open(line, timeout=0.5)
    assert line.clock() == pytest.approx(0.5, abs=0.01)


# Invalid options


@pytest.mark.parametrize(
    ("options", "error", "text"),
    [
        (
            {"lines": "usb"},
            BadValueError,
            r"open: got an unexpected keyword argument 'lines' \(it takes url, .* line=, ",
        ),
        ({"line": "tcp"}, BadValueError, "line 'tcp' is not one of usb, rs232"),
        ({"on_close": "halt"}, BadValueError, "on_close 'halt' is not one of stop, leave"),
        ({"stages": {2: "Z8"}}, BadValueError, r"stages: unknown key 2 \(choose 1\)"),
        (
            {"stage": "Z9"},
            UnknownScaleError,
            r"unknown stage Z9 \(known on TDC001: Z8, Z806, Z812, Z825, MTS25_Z8, .*\)",
        ),
        ({"stage": 8}, BadValueError, "stage must be a Stage or the name of one"),
        ({"stage": stages.MLS203}, UnknownScaleError, "scales of MLS203 on TDC001 are unknown"),
        ({"stages": ["Z8"]}, BadValueError, "stages must be a mapping, such as {1: …}"),
        ({"max_volts": 75}, BadValueError, "max_volts: a TDC001 sets no voltage at an actuator"),
        ({"travel_mm": 12}, UnknownScaleError, "travel_mm cannot be checked: .* pass stage="),
        ({"serial_number": "8"}, BadValueError, "serial_number must be an integer, not '8'"),
        (
            {"serial_number": 8, "identify": False},
            BadValueError,
            "serial_number cannot be checked, because the controller is not asked",
        ),
        (
            {"stage": Stage.of_user("mine", positon=Scale.counts_per("mm", 1))},
            BadValueError,
            r"stage mine: unknown quantity positon \(choose acceleration",
        ),
        ({"timeout": -1}, OutOfRangeError, "reply_timeout"),
        ({"pacing": -1}, OutOfRangeError, "pacing"),
    ],
)
def test_an_invalid_option_is_refused_before_the_line_is_opened(
    options: dict[str, object], error: type[Exception], text: str
) -> None:
    with pytest.raises(error, match=text):
        TDC001.open("virtual://NO_SUCH_UNIT", **options)  # type: ignore[arg-type]


def test_options_with_named_choices_accept_any_case() -> None:
    options: dict[str, Any] = {"line": "RS232", "on_close": "Leave"}
    line = RecordingLink(virtual.TDC001())
    with TDC001.open(line, **options) as tdc:
        tdc.start_move_velocity("forward")
        line.forget()
    assert line.raw == b""  # no stop, because of `leave`


@pytest.mark.parametrize(
    ("unit", "options", "error", "text"),
    [
        (BPC201, {"max_volts": 0}, BadValueError, "max_volts must be above 0"),
        (BPC201, {"max_volts": float("nan")}, BadValueError, "max_volts must be a number in V"),
        (BPC201, {"travel_mm": 1}, UnknownScaleError, "a BPC201 has no positions in mm"),
        (BBD102, {"address": 0x50}, BadValueError, "a BBD102 always has its documented addresses"),
        (MS2000, {"serial_number": 1}, BadValueError, "because the controller cannot report it"),
    ],
)
def test_an_option_without_effect_is_refused(
    unit: Any, options: dict[str, object], error: type[Exception], text: str
) -> None:
    with pytest.raises(error, match=text):
        unit.open("virtual://NO_SUCH_UNIT", **options)


@pytest.mark.parametrize("url", [None, 3, Path("/dev/ttyUSB0")])
def test_a_line_must_be_given_as_text(url: Any) -> None:
    with pytest.raises(BadValueError, match="open requires a URL or the name of a port as text"):
        TDC001.open(url)


@pytest.mark.parametrize("bay", [0, 11, True, "1"])
def test_a_module_must_be_in_an_existing_bay(bay: object) -> None:
    with pytest.raises(OutOfRangeError, match="a rack has bays 1 to 10"):
        MST601.open("virtual://NO_SUCH_UNIT", bay=bay)  # type: ignore[arg-type]


def test_the_line_is_closed_if_its_log_cannot_be_written(tmp_path: Path) -> None:
    line = RecordingLink(virtual.TDC001())
    with pytest.raises(TransportError):
        TDC001.open(line, log=tmp_path / "missing" / "log.txt")
    with pytest.raises(TransportLostError, match="closed"):
        line.write(b"")


# Printing


def test_printing_a_device_shows_its_identity_stage_and_scales() -> None:
    controller = virtual.TDC001(stage=stages.Z8, serial_number=83000001)
    with TDC001.open(RecordingLink(controller), stage="Z8", travel_mm=12) as tdc:
        lines = str(tdc).splitlines()
        assert lines[:4] == [
            "TDC001: One-channel T-Cube DC servo driver, at virtual://TDC001",
            "  serial number 83000001, model TDC001, firmware 1.0.0",
            "  channel 1: stage Z8, chosen by the user",
            "    travel: 0 to 12 mm (set by travel_mm)",
        ]
        assert "    position: 34304 counts per mm (Z8, Issue 3, page 56)" in lines
        text = "status_velocity in raw counts only: the registry does not state it for Z8 on TDC001"
        assert f"    {text}" in lines
        assert "milliseconds" not in str(tdc)  # they need no conversion
        assert repr(tdc) == "<TDC001 at virtual://TDC001>"


def test_identical_channels_are_printed_once() -> None:
    line = RecordingLink(virtual.BBD102())
    with BBD102.open(line, stage="MLS203", identify=False) as rack:
        assert "  bays 1, 2: stage MLS203, chosen by the user\n    travel: unknown" in str(rack)
        assert str(rack).count("position: 20000 counts per mm") == 2  # position, encoder_position
    line = RecordingLink(virtual.BBD102())
    with BBD102.open(line, stages={2: "MLS203"}, identify=False) as rack:
        assert "  bay 1: no stage\n    travel: unknown" in str(rack)
        assert str(rack).count(" position, ") == str(rack).count("pass stage= (the document") == 1
        assert "  bay 2: stage MLS203" in str(rack)


# Reconnecting


def test_reconnecting_identifies_again_but_resends_nothing() -> None:
    with TDC001.open("virtual://TDC001?stage=Z8", stage="Z8", travel_mm=12) as tdc:
        first = tdc.session
        tdc.start_move_absolute(mm=5)
        tdc.reconnect()
        assert first.closed
        assert tdc.serial_number is not None
        while tdc.is_moving():  # a motion may show in the status only after a moment
            time.sleep(0.05)
        with pytest.raises(Exception, match="outside the travel"):
            tdc.move_absolute(mm=13)


def test_after_a_lost_line_a_motion_may_still_be_under_way(tmp_path: Path) -> None:
    with virtual.TDC001(stage=stages.Z8, travel=12 * 34304).tcp() as served:
        log = tmp_path / "session.txt"
        with TDC001.open(served.url, stage="Z8", log=log, reconnect_pause=0) as tdc:
            motion = tdc.start_move_absolute(mm=5)
            served.unplug()
            with pytest.raises(TransportLostError):
                motion.wait()
            tdc.reconnect()
            assert tdc.is_moving()
            with pytest.raises(
                MotionUnderWayError, match="when its line was lost or closed, and may still"
            ):
                tdc.move_absolute(mm=1)
            tdc.stop()
            tdc.move_absolute(counts=tdc.get_pos_counter().position)
        assert "MOT_MOVE_ABSOLUTE" in log.read_text()
        assert "MOT_MOVE_STOP" in log.with_stem("session-2").read_text()


def test_a_line_opened_by_the_caller_cannot_be_reopened() -> None:
    with (
        TDC001.open(RecordingLink(virtual.TDC001())) as tdc,
        pytest.raises(LinkOpenError, match="was not opened by this device and cannot be reopened"),
    ):
        tdc.reconnect()


def test_every_call_on_a_lost_line_raises_the_same_error() -> None:
    line = RecordingLink(virtual.TDC001())
    with TDC001.open(line) as tdc:
        line.controller.unplug()
        for call in (tdc.get_info, tdc.home, tdc.stop, tdc.is_moving):
            with pytest.raises(TransportLostError):
                call()
