"""Parameter sets: reading, writing and changing them, in counts and in units."""

from __future__ import annotations

import copy
import threading
from collections.abc import Iterator
from decimal import Decimal
from fractions import Fraction

import pytest
from recording_link import RecordingLink

import stagewire_virtual as virtual
from stagewire import Scale, Stage
from stagewire.errors import (
    BadValueError,
    MissingFieldError,
    OutOfRangeError,
    ReplyTimeoutError,
    UnknownFieldError,
    UnknownScaleError,
)
from stagewire_apt import BBD302, BPC301, PROTOCOL, TDC001, stages
from stagewire_apt import enumerations as e
from stagewire_apt import messages as m
from stagewire_apt.flags import AuxOutputPortMask, SynchronizedChannels


@pytest.fixture
def line() -> RecordingLink:
    return RecordingLink(virtual.TDC001(stage=stages.Z8))


@pytest.fixture
def tdc(line: RecordingLink) -> Iterator[TDC001]:
    with TDC001.open(line, stage=stages.Z8, line="rs232") as tdc:
        line.forget()
        yield tdc


def test_get_returns_counts_and_units(tdc: TDC001, line: RecordingLink) -> None:
    values = tdc.get_vel_params()
    assert values.max_velocity == 1534735
    assert values.max_velocity_mm_per_s == pytest.approx(2)
    assert values.exact("max_velocity_mm_per_s") == Fraction(1534735) / Fraction(35970351104, 46875)
    assert values.chan_ident is e.Channel.CHAN1
    assert line.raw == m.MotReqVelParams(chan_ident=1).pack(0x50, 0x01)


def test_set_writes_one_frame(tdc: TDC001, line: RecordingLink) -> None:
    tdc.set_vel_params(min_velocity=0, acceleration=100, max_velocity_mm_per_s="1.5")
    counts = stages.Z8.scale("velocity", "TDC001").to_counts("1.5")
    expected = m.MotSetVelParams(
        chan_ident=1, min_velocity=0, acceleration=100, max_velocity=counts
    )
    assert line.raw == expected.pack(0x50, 0x01)
    assert tdc.get_vel_params().max_velocity == counts


@pytest.mark.parametrize("value", [0.1, Decimal("0.1"), Fraction(1, 10), "0.1"])
def test_all_types_of_numbers_are_exact(tdc: TDC001, line: RecordingLink, value: object) -> None:
    tdc.set_pos_counter(mm=value)  # type: ignore[arg-type]
    assert line.raw == m.MotSetPosCounter(chan_ident=1, position=3430).pack(0x50, 0x01)


def test_counts_round_to_nearest_on_both_sides_of_zero(tdc: TDC001, line: RecordingLink) -> None:
    for mm, counts in ((Fraction(3, 2 * 34304), 2), (Fraction(-3, 2 * 34304), -2)):
        line.forget()
        tdc.set_pos_counter(mm=mm)
        assert line.raw == m.MotSetPosCounter(chan_ident=1, position=counts).pack(0x50, 0x01)


class _Quantity:
    """A quantity with the interface of pint."""

    def __init__(self, magnitude: float, unit: str) -> None:
        self.magnitude = magnitude
        self.unit = unit

    def to(self, unit: str) -> _Quantity:
        if (self.unit, unit) == ("um", "mm"):
            return _Quantity(self.magnitude / 1000, unit)
        raise ValueError(f"cannot convert {self.unit} to {unit}")


def test_a_quantity_is_converted_to_the_unit_of_the_keyword(
    tdc: TDC001, line: RecordingLink
) -> None:
    tdc.set_pos_counter(mm=_Quantity(1500, "um"))  # type: ignore[arg-type]
    assert line.raw == m.MotSetPosCounter(chan_ident=1, position=51456).pack(0x50, 0x01)
    line.forget()
    with pytest.raises(BadValueError, match="mm must be in mm: cannot convert s to mm"):
        tdc.set_pos_counter(mm=_Quantity(1, "s"))  # type: ignore[arg-type]
    assert line.raw == b""


def test_numbers_of_numpy_are_accepted(tdc: TDC001, line: RecordingLink) -> None:
    numpy = pytest.importorskip("numpy")
    tdc.set_pos_counter(position=numpy.int64(7))
    assert line.raw == m.MotSetPosCounter(chan_ident=1, position=7).pack(0x50, 0x01)
    line.forget()
    tdc.set_pos_counter(mm=numpy.float64(1.5))
    assert line.raw == m.MotSetPosCounter(chan_ident=1, position=51456).pack(0x50, 0x01)


@pytest.mark.parametrize(
    ("given", "error", "text"),
    [
        ({}, MissingFieldError, "requires position or mm"),
        ({"mm": 1, "position": 1}, BadValueError, "position and mm set the same value"),
        ({"mm": float("nan")}, BadValueError, "mm must be a number in mm: nan is not a finite"),
        ({"mm": float("inf")}, BadValueError, "mm must be a number in mm: inf is not a finite"),
        ({"mm": True}, BadValueError, "mm must be a number in mm: True is not a number"),
        ({"mm": "far"}, BadValueError, "mm must be a number in mm: 'far' is not a number"),
        ({"mm": [1]}, BadValueError, "mm must be a number in mm"),
        ({"mm": 1e9}, OutOfRangeError, "mm must be -62601.*to 62601.* mm, not 1000000000.0"),
        ({"position": 1.5}, BadValueError, "position must be an integer"),
        ({"position": True}, BadValueError, "position must be an integer"),
        ({"position": 1 << 31}, OutOfRangeError, "position must be -2147483648 to 2147483647"),
    ],
)
def test_invalid_values_are_refused_before_anything_is_sent(
    tdc: TDC001, line: RecordingLink, given: dict[str, object], error: type[Exception], text: str
) -> None:
    with pytest.raises(error, match=text):
        tdc.set_pos_counter(**given)  # type: ignore[arg-type]
    assert line.raw == b""


def test_set_requires_every_value(tdc: TDC001, line: RecordingLink) -> None:
    with pytest.raises(
        MissingFieldError, match="requires min_velocity or min_velocity_mm_per_s, accel"
    ):
        tdc.set_vel_params(max_velocity=1)
    assert line.raw == b""


# change


def test_change_reads_and_writes_once(tdc: TDC001, line: RecordingLink) -> None:
    before = tdc.get_vel_params()
    line.forget()
    written = tdc.change_vel_params(max_velocity_mm_per_s=1)
    assert line.names(PROTOCOL) == ["MOT_REQ_VELPARAMS", "MOT_SET_VELPARAMS"]
    assert written == tdc.get_vel_params()
    assert written.acceleration == before.acceleration
    assert written.max_velocity_mm_per_s == pytest.approx(1)


def test_change_checks_its_arguments_before_reading(tdc: TDC001, line: RecordingLink) -> None:
    with pytest.raises(OutOfRangeError, match="max_velocity_mm_per_s must be"):
        tdc.change_vel_params(max_velocity_mm_per_s=1e9)
    with pytest.raises(MissingFieldError, match="requires at least one of"):
        tdc.change_vel_params()
    assert line.raw == b""


def test_change_writes_nothing_if_a_stored_value_is_out_of_range(
    tdc: TDC001, line: RecordingLink
) -> None:
    def illegal(data: bytes) -> bytes:
        """Replace the stored proportional gain by 40000; the documented maximum is 32767."""
        return data.replace((65).to_bytes(4, "little"), (40000).to_bytes(4, "little"))

    line.twist = illegal
    assert tdc.get_dc_pid_params().proportional == 40000
    line.forget()
    with pytest.raises(OutOfRangeError, match=r"holds a value that cannot be written back.*prop"):
        tdc.change_dc_pid_params(integral=1)
    assert line.names(PROTOCOL) == ["MOT_REQ_DCPIDPARAMS"]
    changed = tdc.change_dc_pid_params(proportional=100)
    assert (changed.proportional, changed.filter_control) == (100, 15)


def test_change_does_not_write_back_a_value_missing_from_its_enumeration(
    tdc: TDC001, line: RecordingLink
) -> None:
    """A newer controller uses jog mode 7; it can be read, but only an explicit value replaces it."""
    held = m.MotGetJogParams(
        chan_ident=1, jog_mode=7, jog_step_size=1, jog_min_velocity=0, jog_acceleration=2,
        jog_max_velocity=3, jog_stop_mode=2,
    )  # fmt: skip
    line.twist = lambda data: held.pack(0x01, 0x50) if data[:2] == b"\x18\x04" else data
    assert tdc.get_jog_params().jog_mode == 7
    line.forget()
    with pytest.raises(OutOfRangeError) as refused:
        tdc.change_jog_params(jog_step_size=5)
    assert str(refused.value) == (
        "TDC001: change_jog_params: the controller holds a value that cannot be written back: jog_mode 7 "
        "is not one of CONTINUOUS (1), SINGLE_STEP (2); nothing was written. Also pass this value, or "
        "write all values with set_jog_params"
    )
    assert line.names(PROTOCOL) == ["MOT_REQ_JOGPARAMS"]
    changed = tdc.change_jog_params(jog_step_size=5, jog_mode="single_step")
    assert (changed.jog_mode, changed.jog_step_size) == (e.JogMode.SINGLE_STEP, 5)


def test_change_writes_back_unknown_bits() -> None:
    """Unknown bits that a newer controller has set are kept, but a caller cannot set them."""
    line = RecordingLink(virtual.BPC301())
    with BPC301.open(line, line="rs232", identify=False) as bpc:
        held = bpc.get_output_lut_params().message.values() | {"mode": 0x8001}
        reply = m.PzGetOutputLutParams(**held).pack(0x01, 0x50)
        line.twist = lambda data: reply if data[:2] == reply[:2] else data
        line.forget()
        with pytest.raises(OutOfRangeError, match=r"mode 32769 is not one of outputlut_continuous"):
            bpc.change_output_lut_params(mode=0x8001)
        assert line.raw == b""
        assert bpc.change_output_lut_params(num_cycles=3).mode == 0x8001
        assert m.PzSetOutputLutParams(**held | {"num_cycles": 3}).pack(0x50, 0x01) in line.sent


@pytest.mark.parametrize(
    ("direction", "said"),
    [
        ("forwards", "TDC001: jog direction 'forwards' is not one of FORWARD, REVERSE"),
        (3, "TDC001: jog direction 3 is not one of FORWARD (1), REVERSE (2)"),
        (0, "TDC001: jog direction 0 is not one of FORWARD (1), REVERSE (2)"),
        (True, "TDC001: jog direction True is not one of FORWARD (1), REVERSE (2)"),
        (
            e.StopMode.PROFILED,
            "TDC001: jog direction StopMode.PROFILED is not one of FORWARD (1), REVERSE (2)",
        ),
    ],
)
def test_an_error_lists_the_choices(
    tdc: TDC001, line: RecordingLink, direction: int | str, said: str
) -> None:
    with pytest.raises((BadValueError, OutOfRangeError)) as refused:
        tdc.jog(direction)
    assert (
        str(refused.value)
        == f"{said}; see MOT_MOVE_JOG.direction, page 47 of Issue 3 and page 86 of Issue 37"
    )
    assert line.raw == b""


def test_concurrent_changes_by_threads_are_all_kept() -> None:
    with TDC001.open("virtual://TDC001", pacing=0) as tdc:
        tdc.set_vel_params(min_velocity=0, acceleration=0, max_velocity=0)
        changes = [{"min_velocity": 1}, {"acceleration": 2}, {"max_velocity": 3}]
        threads = [
            threading.Thread(target=tdc.change_vel_params, kwargs=change) for change in changes
        ]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        values = tdc.get_vel_params()
        assert (values.min_velocity, values.acceleration, values.max_velocity) == (1, 2, 3)


# Scales


def test_without_a_stage_only_counts_are_available() -> None:
    line = RecordingLink(virtual.TDC001(stage=stages.Z8))
    with TDC001.open(line, line="rs232") as tdc:
        line.forget()
        with pytest.raises(
            UnknownScaleError, match=r"pass stage= \(the document lists Z8, Z806, Z812, Z825, "
        ):
            tdc.move_absolute(mm=1)
        assert line.raw == b""
        values = tdc.get_pos_counter()
        assert values.position == 0
        with pytest.raises(UnknownScaleError, match="depends on the stage"):
            _ = values.mm
        assert "mm=" not in repr(values)
        assert "position 0" in repr(values)


def test_an_undocumented_scale_is_not_guessed(tdc: TDC001, line: RecordingLink) -> None:
    with pytest.raises(UnknownScaleError, match="neither figure is used; raw counts need no scale"):
        tdc.change_vel_params(acceleration_mm_per_s2=1)
    assert line.raw == b""


def test_a_stage_of_a_user_has_the_scales_of_the_user(line: RecordingLink) -> None:
    mine = Stage.of_user("mine", position=Scale.counts_per("mm", 1000))
    with TDC001.open(line, stage=mine) as tdc:
        line.forget()
        tdc.set_pos_counter(mm=2)
        assert line.raw == m.MotSetPosCounter(chan_ident=1, position=2000).pack(0x50, 0x01)
        with pytest.raises(
            UnknownScaleError,
            match="the scale of velocity in mm/s on TDC001 is unknown: mine was created without it",
        ):
            tdc.change_vel_params(max_velocity_mm_per_s=1)
        assert "position: 1000 counts per mm (mine, your own stage)" in str(tdc)
    mine = Stage.of_user("mine", position=Scale.counts_per("mm", 1))
    with TDC001.open(RecordingLink(line.controller), stage=mine) as tdc:
        assert "position: 1 counts per mm (mine, your own stage)" in str(tdc)


def test_a_scale_of_a_user_in_another_unit_is_refused(line: RecordingLink) -> None:
    mine = Stage.of_user("mine", position=Scale.counts_per("um", 1))
    with pytest.raises(
        BadValueError, match="stage mine: position must be a Scale in mm, not <Scale 1"
    ):
        TDC001.open(line, stage=mine)
    assert line.raw == b""


def test_exact_supports_only_values_in_units(tdc: TDC001) -> None:
    with pytest.raises(
        UnknownFieldError, match=r"has no value position in units \(choose mm, deg\)"
    ):
        tdc.get_pos_counter().exact("position")


def test_values_are_read_only(tdc: TDC001) -> None:
    params = tdc.get_vel_params()
    for name in ("max_velocity", "max_velocity_mm_per_s", "max_velocty", "message"):
        with pytest.raises(AttributeError, match=f"cannot set {name}: .* read-only"):
            setattr(params, name, 3)
    assert copy.deepcopy(params) == params


def test_values_are_equal_if_their_messages_are_equal(tdc: TDC001) -> None:
    first, second = tdc.get_vel_params(), tdc.get_vel_params()
    assert first == second
    assert hash(first) == hash(second)
    assert first != tdc.get_pos_counter()
    assert first != first.message


@pytest.mark.parametrize("timeout", [0, -1, float("nan"), True, "1"])
def test_an_invalid_timeout_is_refused(tdc: TDC001, line: RecordingLink, timeout: object) -> None:
    with pytest.raises(BadValueError, match="timeout must be "):
        tdc.get_vel_params(timeout=timeout)  # type: ignore[arg-type]
    assert line.raw == b""


def test_calls_to_an_unresponsive_controller_time_out(tdc: TDC001, line: RecordingLink) -> None:
    line.twist = lambda data: b""
    before = line.clock()
    with pytest.raises(ReplyTimeoutError):
        tdc.get_vel_params(timeout=0.2)
    with pytest.raises(ReplyTimeoutError):
        tdc.change_vel_params(min_velocity=0, timeout=0.2)
    assert line.clock() - before == pytest.approx(0.4, abs=0.01)
    # The second request waits for the late reply of the first.
    assert line.names(PROTOCOL) == ["MOT_REQ_VELPARAMS"]


def test_a_mask_of_connectors_changes_each_of_them() -> None:
    with BBD302.open("virtual://BBD302") as rack:
        bay = rack.bay(1)
        bay.set_aux_io_config(out_port="portnum_1|portnum_3", mode="ENC", sw_source="LOW")
        modes = [bay.get_aux_io_config(out_port=port).mode for port in (1, 2, 4)]
        assert modes == [e.AuxPortMode.ENC, e.AuxPortMode.SW, e.AuxPortMode.ENC]


def test_the_connector_of_an_answer_can_be_asked_for_and_changed() -> None:
    with BBD302.open("virtual://BBD302") as rack:
        bay = rack.bay(1)
        port = bay.get_aux_io_config(out_port=2).out_port
        assert bay.get_aux_io_config(out_port=port).out_port == 2
        bay.change_aux_io_config(out_port=port, mode="ENC")
        assert bay.get_aux_io_config(out_port=AuxOutputPortMask(2)).mode is e.AuxPortMode.ENC
        with pytest.raises(BadValueError, match="out_port <SynchronizedChannels channel_1>"):
            bay.get_aux_io_config(out_port=SynchronizedChannels(1))
