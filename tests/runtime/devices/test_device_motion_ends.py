"""Ends of motions: on or off their target, with a fault, or after a timeout; and their errors."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from recording_link import RecordingLink

import stagewire_virtual as virtual
from stagewire.errors import (
    BadValueError,
    ControllerFaultError,
    MotionTimeoutError,
    MotionUnderWayError,
    StagewireError,
    TargetNotReachedError,
    TransportLostError,
    UnknownScaleError,
)
from stagewire_apt import PROTOCOL, TDC001, TPZ001, TST001, stages
from stagewire_apt import enumerations as e
from stagewire_apt import messages as m
from stagewire_apt.aio import TDC001 as AsyncTDC001
from stagewire_ms2000 import MS2000
from stagewire_virtual import stepped

TRAVEL = 5 * 34304
SHORT = "virtual://TDC001?stage=Z8&travel=171520"
DISABLE = m.ModSetChanEnableState(1, e.EnableState.DISABLE)
COMPLETED, STATUS = b"\x64\x04", b"\x91\x04"


def short(**options: Any) -> RecordingLink:
    """Return a line to a stage with 5 mm of travel; its counter is 0 at 1 mm above its reverse end."""
    return RecordingLink(virtual.TDC001(stage=stages.Z8, travel=TRAVEL, **options))


# Targets


@pytest.mark.parametrize(
    ("move", "target"),
    [
        (lambda tdc: tdc.move_absolute(mm=10), 343040),
        (lambda tdc: tdc.start_move_absolute(mm=10).wait(), 343040),
        (lambda tdc: tdc.move_relative(mm=10), 343040),
        (lambda tdc: tdc.move_absolute_stored(), 343040),
        (lambda tdc: tdc.move_relative_stored(), 343040),
        (lambda tdc: tdc.jog(e.MoveDirection.FORWARD), 343040),
    ],
)
def test_a_motion_that_misses_its_target_raises_an_error(
    move: Callable[[TDC001], object], target: int
) -> None:
    line = short()
    with TDC001.open(line, stage="Z8", line="rs232") as tdc:
        tdc.set_move_abs_params(mm=10)
        tdc.set_move_rel_params(mm=10)
        tdc.change_jog_params(jog_mode=e.JogMode.SINGLE_STEP, step_size_mm=10)
        with pytest.raises(TargetNotReachedError) as caught:
            move(tdc)
        missed: Any = caught.value
        assert (missed.target, missed.position, missed.tolerance) == (target, 137216, 343)
        assert (missed.unit, missed.target_in_units, missed.position_in_units) == ("mm", 10, 4)
        assert missed.limits == ("forward_hardware_limit",)
        assert missed.end.message.position == 137216
        assert missed.end.seconds > 0
        assert "the forward hardware limit switch is active" in str(missed)
        assert not tdc.is_moving()
        tdc.move_absolute(mm=1)  # the motion has ended


def test_without_a_scale_the_error_is_in_counts() -> None:
    with TDC001.open(short()) as tdc, pytest.raises(TargetNotReachedError) as caught:
        tdc.move_absolute(counts=200_000)
    missed = caught.value
    assert (missed.tolerance, missed.unit, missed.target_in_units) == (500, "", None)
    assert "62784 counts from its target" in str(missed)


def test_each_wait_raises_the_error_again_also_in_asyncio() -> None:
    with TDC001.open(short(), stage="Z8") as tdc:
        motion = tdc.start_move_absolute(mm=10)
        for _ in range(2):
            with pytest.raises(TargetNotReachedError):
                motion.wait()

    async def main() -> None:
        async with AsyncTDC001.open(SHORT, stage="Z8") as tdc:
            with pytest.raises(TargetNotReachedError):
                await tdc.move_absolute(mm=10)
            motion = await tdc.start_move_relative(mm=-1)
            assert (await motion.wait()).values.position_mm == 3  # type: ignore[union-attr]

    stepped.run(main())


def test_a_motion_without_a_target_ends_at_a_limit_without_an_error() -> None:
    with TDC001.open(short(), stage="Z8") as tdc:
        assert tdc.move_velocity(e.MoveDirection.FORWARD).values.position_mm == 4  # type: ignore[union-attr]
        tdc.change_jog_params(jog_mode=e.JogMode.CONTINUOUS)
        tdc.jog(e.MoveDirection.REVERSE)
        tdc.home()


@pytest.mark.parametrize(
    ("option", "passes"),
    [
        ({}, True),
        ({"target_tolerance_mm": "0.011"}, True),
        ({"target_tolerance_mm": "0.009"}, False),
        ({"target_tolerance_counts": 343}, True),
        ({"target_tolerance_counts": 0}, False),
        ({"target_tolerance_mm": 0}, False),
    ],
)
def test_a_motion_may_miss_its_target_by_the_tolerance(option: Any, passes: bool) -> None:
    line = short()
    with TDC001.open(line, stage="Z8", **option) as tdc:
        end = m.MotMoveCompletedDc(1, 34304 + 343, 0, 0x80000000).pack(1, 0x50)
        line.twist = lambda data: end if data[:2] == COMPLETED else data
        if passes:
            assert tdc.move_absolute(mm=1).values.position == 34304 + 343  # type: ignore[union-attr]
        else:
            with pytest.raises(TargetNotReachedError):
                tdc.move_absolute(mm=1)


@pytest.mark.parametrize(
    ("options", "error"),
    [
        ({"target_tolerance_mm": -1, "stage": "Z8"}, BadValueError),
        ({"target_tolerance_counts": -1}, BadValueError),
        ({"target_tolerance_counts": 1.5}, BadValueError),
        ({"target_tolerance_counts": True}, BadValueError),
        ({"target_tolerance_counts": 1, "target_tolerance_mm": 1, "stage": "Z8"}, BadValueError),
        ({"target_tolerance_mm": 1}, UnknownScaleError),
    ],
)
def test_an_invalid_tolerance_is_refused(options: Any, error: type[StagewireError]) -> None:
    line = short()
    with pytest.raises(error, match="target_tolerance"):
        TDC001.open(line, **options)
    assert line.raw == b""


def test_a_unit_without_positions_has_no_tolerance() -> None:
    with pytest.raises(BadValueError, match="a TPZ001 does not report positions"):
        TPZ001.open(RecordingLink(virtual.TPZ001()), target_tolerance_counts=1)


def test_an_end_without_a_position_is_followed_by_a_status_request() -> None:
    line = short(quirks=["header_only_completion"])
    with TDC001.open(line, stage="Z8", line="rs232") as tdc:
        line.forget()
        end = tdc.move_absolute(mm=2)
        assert line.names(PROTOCOL) == ["MOT_MOVE_ABSOLUTE", "MOT_REQ_DCSTATUSUPDATE"]
        assert end.message == m.MotMoveCompletedHeader(1)
        assert end.values.position_mm == 2  # type: ignore[union-attr]
        with pytest.raises(TargetNotReachedError) as caught:
            tdc.move_absolute(mm=10)
        assert caught.value.limits == ("forward_hardware_limit",)


def test_the_status_is_read_until_it_shows_rest() -> None:
    line = short()
    with TDC001.open(line, stage="Z8", line="rs232") as tdc:
        early = m.MotMoveCompletedDc(1, 20_000, 0, 0x80000030).pack(1, 0x50)
        moving = m.MotGetDcStatusUpdate(1, 30_000, 0, 0x80000010).pack(1, 0x50)
        there = [moving, moving]

        def twist(data: bytes) -> bytes:
            if data[:2] == COMPLETED:
                return early
            return there.pop() if data[:2] == STATUS and there else data

        line.twist = twist
        assert tdc.move_absolute(mm=1).values.position == 34304  # type: ignore[union-attr]
        assert not there


def test_a_relative_move_reads_its_start_position_once() -> None:
    line = short()
    with TDC001.open(line, line="rs232") as tdc:
        line.forget()
        motion = tdc.start_move_relative(counts=20_000)
        assert line.names(PROTOCOL) == ["MOT_REQ_DCSTATUSUPDATE", "MOT_MOVE_RELATIVE"]
        line.forget()
        with pytest.raises(MotionUnderWayError):
            tdc.move_relative(counts=1)
        assert line.raw == b""
        motion.wait()


def test_an_ms2000_that_misses_its_target_raises_an_error() -> None:
    line = RecordingLink(virtual.MS2000(travel=100_000, position=50_000))
    with MS2000.open(line) as ms, ms.low_level():
        x = ms.axis("X")
        x.write_motor_position(um=0)
        with pytest.raises(TargetNotReachedError) as caught:
            x.move_absolute(um=6000)
        assert (caught.value.position_in_units, caught.value.unit) == (5000, "um")
        assert caught.value.limits == ("upper_limit",)
        x.write_increment_value(um=7000)
        with pytest.raises(TargetNotReachedError):
            x.increment_move_up()
        x.move_absolute(um=100)


# Why a motion does not end


def test_a_timeout_names_the_likely_cause_but_does_not_end_the_motion() -> None:
    with TDC001.open(short(), stage="Z8", on_close="leave") as tdc:
        tdc.session.send(DISABLE, 0x50)  # not noticed by the device
        with pytest.raises(
            MotionTimeoutError, match="likely cause: the channel is disabled"
        ) as end:
            tdc.move_absolute(mm=1, timeout=2)
        assert end.value.causes == ("the channel is disabled",)
        with pytest.raises(MotionUnderWayError):
            tdc.move_absolute(mm=1)
        assert not tdc.is_moving()
        motion = tdc.start_home()
        with pytest.raises(MotionTimeoutError) as end:
            motion.wait(0.1)
        assert end.value.causes == ()  # the motion can still be waited for


def test_a_timeout_names_the_likely_cause_in_asyncio() -> None:
    async def main() -> None:
        async with AsyncTDC001.open(SHORT, stage="Z8", motion_timeout=2) as tdc:
            await tdc.session.send(DISABLE, 0x50)
            motion = await tdc.start_move_absolute(mm=1)
            for _ in range(2):
                with pytest.raises(MotionTimeoutError, match="the channel is disabled"):
                    await motion.wait()

    stepped.run(main())


def test_a_state_without_a_status_bit_is_requested_separately() -> None:
    line = RecordingLink(virtual.TST001())
    with TST001.open(line, line="rs232", on_close="leave") as tst:
        tst.session.send(DISABLE, 0x50)
        line.forget()
        with pytest.raises(MotionTimeoutError) as end:
            tst.move_absolute(counts=10_000, timeout=2)
        assert end.value.causes == ("the channel is disabled",)
        asked = ["MOT_REQ_STATUSUPDATE", "MOD_REQ_CHANENABLESTATE"]
        assert line.names(PROTOCOL) == ["MOT_MOVE_ABSOLUTE", *asked]


def test_a_stepper_timeout_names_the_motor_and_the_interlock() -> None:
    line = RecordingLink(virtual.TST001())
    with TST001.open(line, on_close="leave") as tst:
        status = m.MotGetStatusUpdate(1, 0, 0, 1).pack(0x01, 0x50)
        line.twist = lambda data: status if data[:2] == b"\x81\x04" else b""
        with pytest.raises(MotionTimeoutError) as end:
            tst.move_absolute(counts=10_000, timeout=2)
        assert end.value.causes == (
            "the forward hardware limit switch is active",
            "no motor is connected",
            "the interlock is not enabled",
        )


def test_a_timeout_quotes_a_status_that_shows_no_cause() -> None:
    line = short()
    with TDC001.open(line, stage="Z8", on_close="leave") as tdc:
        line.twist = lambda data: b"" if data[:2] == COMPLETED else data
        with pytest.raises(
            MotionTimeoutError, match="the status shows no cause: position 34304"
        ) as end:
            tdc.move_absolute(mm=1, timeout=10)
        assert end.value.causes == ()


def test_an_unresponsive_controller_is_asked_once_with_a_short_timeout() -> None:
    line = RecordingLink(virtual.TST001())
    with TST001.open(line, line="rs232", on_close="leave") as tst:
        line.twist = lambda data: b""
        line.forget()
        begun = tst.session.now()
        with pytest.raises(MotionTimeoutError, match="does not answer a status request either"):
            tst.move_absolute(counts=10_000, timeout=4)
        assert tst.session.now() - begun < 4.3
        assert line.names(PROTOCOL) == ["MOT_MOVE_ABSOLUTE", "MOT_REQ_STATUSUPDATE"]


def test_no_status_is_requested_after_the_line_is_lost() -> None:
    line = short()

    def lost(data: bytes) -> bytes:
        raise TransportLostError("the plug was pulled")

    with TDC001.open(line, stage="Z8", line="rs232") as tdc:
        line.forget()
        motion = tdc.start_move_absolute(mm=3)
        line.twist = lost
        with pytest.raises(TransportLostError):
            motion.wait()
        assert line.names(PROTOCOL) == ["MOT_MOVE_ABSOLUTE"]


# Fault reports


@pytest.mark.parametrize(
    ("quirks", "code", "fault"),
    [
        ([], 0, ""),
        (["fault_codes_in_response"], 1, ""),
        (["rich_responses"], 1, "Command refused"),
        (["fault_codes_in_response", "unswapped_addresses"], 1, ""),
        (["fault_codes_in_response", "zero_addresses"], 1, ""),
    ],
)
def test_a_fault_report_ends_the_wait_immediately(quirks: list[str], code: int, fault: str) -> None:
    line = short(quirks=quirks, answer_unsupported=True)
    with TDC001.open(line, stage="Z8") as tdc:
        tdc.session.send(DISABLE, 0x50)
        begun = tdc.session.now()
        with pytest.raises(ControllerFaultError, match="may still be in progress") as end:
            tdc.move_absolute(mm=1)
        assert tdc.session.now() - begun < 1
        assert (end.value.code, end.value.fault) == (code, fault)
        assert end.value.causes == ("the channel is disabled",)
        with pytest.raises(MotionUnderWayError):
            tdc.home()
        line.forget()
    assert m.MotMoveStop(1, e.StopMode.PROFILED).pack(0x50, 0x01) in line.raw


def test_a_fault_report_during_a_motion_ends_the_wait() -> None:
    line = short()
    with TDC001.open(line, stage="Z8") as tdc:
        motion = tdc.start_move_absolute(mm=3)
        tdc.session.pause(0.5)
        line.twist = lambda data_: (
            data_ + m.HwRichResponse(0x0453, 12, "Over current").pack(0x01, 0x50)
        )
        with pytest.raises(ControllerFaultError, match="'Over current'"):
            motion.wait()
        line.twist = bytes
        assert motion.done
        assert tdc.is_moving()
        assert tdc.stop() is not None
        tdc.home()
