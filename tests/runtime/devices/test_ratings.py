"""No voltage above the rating of an actuator is sent, and no limit is raised without a rating."""

from __future__ import annotations

from typing import Any

import pytest
from inertial_controller import controller
from recording_link import RecordingLink

import stagewire_virtual as virtual
from stagewire._devices.ratings import is_rated
from stagewire.errors import LimitError, OutOfRangeError, UnknownScaleError
from stagewire_apt import (
    BPC201,
    KIM101,
    KNA101,
    KPC101,
    KPZ101,
    MPZ601,
    PPC001,
    PROTOCOL,
    TDC001,
    TPZ001,
)
from stagewire_apt import messages as m
from stagewire_apt.devices import tables as every
from stagewire_virtual.linking import SteppedLink


def opened(cls: Any, **options: Any) -> tuple[Any, RecordingLink]:
    line = RecordingLink(getattr(virtual, cls.__name__)())
    device = cls.open(line, **options)
    line.forget()
    return device, line


def nothing_was_set(line: RecordingLink) -> bool:
    return not [name for name in line.names(PROTOCOL) if "_SET_" in name]


def test_output_voltages_above_the_rating_are_refused() -> None:
    device, line = opened(BPC201, max_volts=60)
    with device:
        calls = (
            lambda: device.set_output_volts(volts=61), lambda: device.set_output_volts(volts=-61),
            lambda: device.set_output_volts(voltage=30000), lambda: device.change_output_volts(volts=70),
            lambda: device.set_output_lut(index=0, output=30000),
        )  # fmt: skip
        for call in calls:
            with pytest.raises(
                LimitError, match=r"rating of the actuator, 60 V \(set by max_volts\)"
            ):
                call()
        assert nothing_was_set(line)
        device.set_output_volts(volts=60)
        device.set_output_volts(volts=-10)


LOOPS = (
    lambda part: part.set_pos_control_mode(mode="CLOSED_LOOP"),
    lambda part: part.change_pos_control_mode(mode="CLOSED_LOOP_SMOOTH"),
    lambda part: part.set_output_pos(um=5),
    lambda part: part.set_output_pos(position_sw=1),
)


@pytest.mark.parametrize("call", LOOPS)
@pytest.mark.parametrize("cls", [BPC201, KPC101, KPZ101, PPC001, TPZ001])
def test_a_closed_loop_that_can_exceed_the_rating_is_refused(cls: Any, call: Any) -> None:
    device, line = opened(cls, max_volts=60, max_travel_um=20)
    with device:
        with pytest.raises(
            LimitError, match=r"can reach 75 V .* the actuator, 60 V .*Lower the max"
        ):
            call(device)
        assert nothing_was_set(line)
        device.set_pos_control_mode(mode="OPEN_LOOP")
        device.set_output_pos(position_sw=0)
    device, line = opened(cls, max_volts=75, max_travel_um=20)
    with device:
        call(device)
        assert not nothing_was_set(line)


@pytest.mark.parametrize("call", LOOPS)
def test_a_closed_loop_with_an_unknown_maximum_is_refused(call: Any) -> None:
    line = RecordingLink(virtual.rack("MPZ601"))
    with MPZ601.open(line, max_volts=75) as module:
        line.forget()
        with pytest.raises(UnknownScaleError, match=r"settings=\{'maximum_volts': …\} to open"):
            call(module.channel(1))
        assert nothing_was_set(line)
    line = RecordingLink(virtual.rack("MPZ601"))
    with MPZ601.open(line, max_volts=75, settings={"maximum_volts": 75}) as module:
        call(module.channel(1))


@pytest.mark.parametrize("rating", [None, 20])
def test_the_loop_of_a_kna101_is_not_compared(rating: int | None) -> None:
    device, line = opened(KNA101, **({} if rating is None else {"max_volts": rating}))
    with device:
        device.channel(1).set_pos_control_mode(mode="CLOSED_LOOP")
        assert not nothing_was_set(line)


def test_a_range_above_the_rating_is_refused() -> None:
    for cls, call in (
        (BPC201, lambda d: d.set_output_max_volts(volts=100, flags=0)),
        (BPC201, lambda d: d.change_output_max_volts(voltage=1500)),
        (TPZ001, lambda d: d.change_tpz_io_settings(voltage_limit="VOLTAGELIMIT_100V")),
    ):
        device, line = opened(cls, max_volts=75)
        with device:
            with pytest.raises(LimitError, match="exceeds the rating"):
                call(device)
            assert nothing_was_set(line)


def test_a_range_is_not_raised_without_a_rating() -> None:
    device, line = opened(BPC201)
    with device:
        with pytest.raises(
            LimitError, match=r"above 75 V \(from PZ_GET_OUTPUTMAXVOLTS\).*pass max_volts="
        ):
            device.set_output_max_volts(volts=100, flags=0)
        assert nothing_was_set(line)
        device.set_output_max_volts(volts=75, flags=0)
        device.set_output_volts(volts=75)


@pytest.mark.parametrize(("cls", "call"), [
    (BPC201, lambda d: d.change_output_max_volts(volts=100)),
    (TPZ001, lambda d: d.change_tpz_io_settings(voltage_limit="VOLTAGELIMIT_100V")),
    (KPC101, lambda d: d.change_io_settings(voltage_range="RANGE_150V")),
])  # fmt: skip
def test_a_change_above_the_range_names_the_given_value(cls: Any, call: Any) -> None:
    device, line = opened(cls)
    with device:
        with pytest.raises(LimitError, match=r"above 75 V .*pass max_volts=") as caught:
            call(device)
        assert "cannot be written back" not in str(caught.value)
        assert nothing_was_set(line)


def test_volts_out_of_range_name_the_range_and_the_setting() -> None:
    device, _ = opened(BPC201)
    with (
        device,
        pytest.raises(OutOfRangeError, match=r"to 75 V, not 80 .*maximum_volts 75 V, from PZ_GET"),
    ):
        device.set_output_volts(volts=80)


@pytest.mark.parametrize("call", [
    lambda d: d.set_output_volts(volts=10), lambda d: d.set_output_volts(voltage=1),
    lambda d: d.set_output_lut(index=0, output=1),
])  # fmt: skip
@pytest.mark.parametrize("cls", [BPC201, TPZ001, MPZ601])
def test_the_rating_is_not_used_as_the_full_scale(cls: Any, call: Any) -> None:
    made = virtual.rack("MPZ601") if cls is MPZ601 else getattr(virtual, cls.__name__)()
    line = RecordingLink(made)
    with cls.open(line, max_volts=20, identify=False) as device:
        part = device.channel(1) if cls is MPZ601 else device
        line.forget()
        with pytest.raises(UnknownScaleError, match=r"settings=\{'maximum_volts': …\} to open"):
            call(part)
        assert nothing_was_set(line)
        part.set_output_volts(voltage=0)


def test_a_given_full_scale_is_compared_with_the_rating() -> None:
    line = RecordingLink(virtual.rack("MPZ601"))
    with MPZ601.open(line, max_volts=20, settings={"maximum_volts": 75}) as module:
        line.forget()
        for given in ({"volts": 21}, {"voltage": 8739}):
            with pytest.raises(LimitError, match="rating of the actuator, 20 V"):
                module.channel(1).set_output_volts(**given)
        assert nothing_was_set(line)
        module.channel(1).set_output_volts(volts=20)
        sent = m.PzSetOutputVolts(chan_ident=1, voltage=8738)  # 20 / 75 of 32767
        assert line.raw == sent.pack(0x21, 0x01)


@pytest.mark.parametrize(("rating", "bits", "allowed"), [
    (None, 0, True), (None, 0x01, False), (None, 0x11, False),
    (75, 0, True), (75, 0x10, False), (20, 0x01, False), (150, 0x11, True),
])  # fmt: skip
def test_ranges_of_a_kna101(rating: int | None, bits: int, allowed: bool) -> None:
    device, line = opened(KNA101, **({} if rating is None else {"max_volts": rating}))
    with device:
        if allowed:
            device.channel(1).change_tna_io_settings(hv_out_range=bits)
            assert device.channel(1).get_tna_io_settings().hv_out_range == bits
        else:
            with pytest.raises(LimitError, match=r"hv_out_range: 150 V .*rating of the actuator"):
                device.channel(1).change_tna_io_settings(hv_out_range=bits)
            assert nothing_was_set(line)


def test_a_second_channel_is_not_raised_without_a_rating() -> None:
    controller = virtual.KNA101()
    with KNA101.open(RecordingLink(controller), max_volts=150) as device:
        device.channel(1).change_tna_io_settings(hv_out_range=0x01)
    line = RecordingLink(controller)
    with KNA101.open(line) as device:
        channel = device.channel(1)
        channel.change_tna_io_settings(hv_out_range=0x01)  # unchanged
        line.forget()
        with pytest.raises(LimitError, match="pass max_volts="):
            channel.change_tna_io_settings(hv_out_range=0x11)
        assert nothing_was_set(line)


def test_a_snapshot_with_a_higher_voltage_is_not_restored() -> None:
    line, instrument = controller("KIM101")
    with KIM101.open(SteppedLink(line)) as device:
        channel = device.channel(1)
        taken = channel.snapshot()
        taken["settings"]["drive_op_params"]["max_voltage"] = 125
        instrument.frames.clear()
        with pytest.raises(LimitError, match="pass max_volts="):
            channel.restore(taken, tuning=True)
        assert not [frame for frame in instrument.frames if frame[:2] == b"\xc0\x08"]


@pytest.mark.parametrize(("rating", "volts", "allowed"), [
    (None, 85, True), (None, 86, False), (110, 110, True), (110, 111, False), (125, 125, True)
])  # fmt: skip
def test_drive_voltages(rating: int | None, volts: int, allowed: bool) -> None:
    line, instrument = controller("KIM101")
    options = {} if rating is None else {"max_volts": rating}
    with KIM101.open(SteppedLink(line), **options) as device:
        instrument.frames.clear()
        given = {"max_voltage": volts, "step_rate": 500, "step_accn": 1000}
        if allowed:
            device.channel(2).set_drive_op_params(**given)
        else:
            with pytest.raises(LimitError):
                device.channel(2).set_drive_op_params(**given)
        assert bool(instrument.frames) is allowed


def test_every_call_that_sets_a_voltage_is_checked() -> None:
    """The quantities in volts of all calls are those that are checked, and three that drive no actuator."""
    tables = [table for table in vars(every).values() if not isinstance(table, type)]
    entries = [entry for table in tables for entry in getattr(table, "given", ())]
    volts = {e.quantity for e in entries if any(unit == "V" for _, unit, _ in e.ways)}
    checked = {quantity for quantity in volts if is_rated(TDC001.facts, quantity)}
    assert checked == {"drive_volts", "lut_output", "maximum_volts", "output_volts", "volts"}
    assert volts - checked <= {"quad_volts", "monitor_volts", "analog_input"}
