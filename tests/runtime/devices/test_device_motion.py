"""Motions: waiting, starting, stopping, limits, suspended end messages, and closing."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import pytest
from recording_link import RecordingLink

import stagewire_virtual as virtual
from stagewire._devices.synchronous import motion
from stagewire.errors import (
    BadValueError,
    LimitError,
    MotionStoppedError,
    MotionTimeoutError,
    MotionUnderWayError,
    OutOfRangeError,
    UnsupportedError,
)
from stagewire_apt import PROTOCOL, TDC001, TSC001, stages
from stagewire_apt import enumerations as e
from stagewire_apt import messages as m

STOP = m.MotMoveStop(chan_ident=1, stop_mode=e.StopMode.PROFILED).pack(0x50, 0x01)


@pytest.fixture
def line() -> RecordingLink:
    return RecordingLink(virtual.TDC001(stage=stages.Z8, travel=12 * 34304))


@pytest.fixture
def tdc(line: RecordingLink) -> Iterator[TDC001]:
    with TDC001.open(line, stage=stages.Z8, travel_mm=12, line="rs232") as tdc:
        line.forget()
        yield tdc


def test_home_and_move_wait_until_the_motion_ends(tdc: TDC001, line: RecordingLink) -> None:
    end = tdc.home()
    assert end.message == m.MotMoveHomed(chan_ident=1)
    assert 0 < end.seconds < 60
    end = tdc.move_absolute(mm="1.5")
    assert isinstance(end.message, m.MotMoveCompletedDc)
    assert end.values is not None
    assert end.values.exact("position_mm") == 1.5
    assert line.names(PROTOCOL) == ["MOT_REQ_HOMEPARAMS", "MOT_MOVE_HOME", "MOT_MOVE_ABSOLUTE"]


def test_a_started_motion_can_be_waited_for_later(tdc: TDC001, line: RecordingLink) -> None:
    motion = tdc.start_move_absolute(mm=1)
    assert not motion.done
    assert tdc.is_moving()
    tdc.session.pause(30)
    assert motion.done
    assert not tdc.is_moving()
    end = motion.wait()
    assert 0.5 < end.seconds < 3  # until the end, not until the wait
    assert motion.wait() is end


def test_a_wait_can_time_out_before_the_motion_ends(tdc: TDC001) -> None:
    motion = tdc.start_move_absolute(mm=5)
    with pytest.raises(MotionTimeoutError, match="nothing was stopped, so you can wait again"):
        motion.wait(0.1)
    assert isinstance(motion.wait().message, m.MotMoveCompletedDc)


def test_a_second_motion_is_refused_before_anything_is_sent(
    tdc: TDC001, line: RecordingLink
) -> None:
    motion = tdc.start_move_absolute(mm=5)
    line.forget()
    with pytest.raises(MotionUnderWayError, match="is in progress"):
        tdc.move_absolute(mm=1)
    assert line.raw == b""
    assert tdc.stop() is not None  # the first motion is still registered
    with pytest.raises(MotionStoppedError):
        motion.wait()
    tdc.move_absolute(mm=1)


def test_a_stop_ends_the_motion_and_reports_the_position(tdc: TDC001, line: RecordingLink) -> None:
    motion = tdc.start_move_absolute(mm=5)
    tdc.session.pause(1)
    line.forget()
    end = motion.stop()
    assert line.raw == STOP
    assert end is not None
    assert isinstance(end.message, m.MotMoveStoppedDc)
    assert motion.done
    with pytest.raises(MotionStoppedError) as stopped:
        motion.wait()
    assert stopped.value.message is not None


def test_after_a_timeout_a_status_at_rest_ends_the_motion(tdc: TDC001, line: RecordingLink) -> None:
    with pytest.raises(MotionTimeoutError):
        tdc.move_absolute(mm=5, timeout=0.5)
    with pytest.raises(MotionUnderWayError):
        tdc.move_absolute(mm=0)
    assert tdc.is_moving()
    line.twist = lambda data: b""  # the end message is lost
    tdc.session.pause(20)
    line.twist = bytes
    assert not tdc.is_moving()
    tdc.move_absolute(mm=0)


def test_a_status_from_before_the_start_does_not_count_as_rest(
    tdc: TDC001, line: RecordingLink
) -> None:
    still = m.MotGetDcStatusUpdate(chan_ident=1, position=0, velocity=0, status_bits=0)

    def stale(data: bytes) -> bytes:
        return still.pack(0x01, 0x50) if data[:2] == b"\x91\x04" else data

    tdc.start_move_absolute(mm=5)
    line.twist = stale
    assert tdc.is_moving()
    tdc.session.pause(1)
    assert not tdc.is_moving()  # by now a motion would show


def test_an_invalid_stop_mode_is_refused(tdc: TDC001, line: RecordingLink) -> None:
    with pytest.raises(OutOfRangeError):
        tdc.stop(0x10000)
    assert line.raw == b""


# Limits


@pytest.mark.parametrize(
    "move",
    [
        lambda tdc: tdc.move_absolute(mm="12.001"),
        lambda tdc: tdc.move_absolute(mm=-0.001),
        lambda tdc: tdc.move_absolute(counts=12 * 34304 + 1),
        lambda tdc: tdc.start_move_absolute(mm=13),
        lambda tdc: tdc.move_relative(mm="12.001"),
        lambda tdc: tdc.move_relative(mm="-12.001"),
        lambda tdc: tdc.set_move_abs_params(mm=13),
        lambda tdc: tdc.change_move_abs_params(mm=13),
        lambda tdc: tdc.set_move_rel_params(mm=13),
    ],
)
def test_a_target_outside_the_travel_is_refused_before_anything_is_sent(
    tdc: TDC001, line: RecordingLink, move: Callable[[TDC001], object]
) -> None:
    with pytest.raises(LimitError, match="the travel, 0 to 12 mm; nothing was sent"):
        move(tdc)
    assert line.raw == b""


def test_both_ends_of_the_travel_can_be_reached(tdc: TDC001) -> None:
    tdc.home()
    tdc.move_absolute(mm=12)
    assert tdc.get_pos_counter().mm == 12
    tdc.move_absolute(mm=0)


def test_a_distance_is_checked_from_the_current_position(tdc: TDC001, line: RecordingLink) -> None:
    tdc.home()
    tdc.move_absolute(mm=10)
    line.forget()
    with pytest.raises(LimitError, match=r"\+3 mm from the position 10 mm is outside the travel"):
        tdc.move_relative(mm=3)
    assert line.names(PROTOCOL) == ["MOT_REQ_DCSTATUSUPDATE"]
    tdc.move_relative(mm=-3)
    assert tdc.get_pos_counter().mm == 7


def test_stored_targets_are_compared_with_the_travel(line: RecordingLink) -> None:
    with TDC001.open(line, stage=stages.Z8) as tdc:
        tdc.set_move_abs_params(mm=5)
        tdc.set_move_rel_params(mm=4)
    with TDC001.open(line_to(line), stage=stages.Z8, travel_mm=3) as tdc:
        with pytest.raises(LimitError, match="stored absolute_position: 5 mm"):
            tdc.move_absolute_stored()
        with pytest.raises(LimitError, match="stored relative_distance: 4 mm"):
            tdc.move_relative_stored()
    with TDC001.open(line_to(line), stage=stages.Z8, travel_mm=6) as tdc:
        tdc.move_absolute_stored()
        assert tdc.get_pos_counter().mm == 5


def test_a_stored_distance_that_leaves_the_travel_is_refused(line: RecordingLink) -> None:
    with TDC001.open(line, stage=stages.Z8, travel_mm=6) as tdc:
        tdc.set_pos_counter(mm=3)
        tdc.set_move_rel_params(mm=4)
        with pytest.raises(
            LimitError, match=r"\+4 mm from the position 3 mm is outside the travel"
        ):
            tdc.move_relative_stored()
        tdc.set_move_rel_params(mm=1)
        tdc.move_relative_stored()


def line_to(line: RecordingLink) -> RecordingLink:
    """Return another line to the same controller."""
    return RecordingLink(line.controller)


def test_a_travel_can_have_two_ends(line: RecordingLink) -> None:
    with TDC001.open(line, stage=stages.Z8, travel_mm=(-1, "2.5")) as tdc:
        line.forget()
        with pytest.raises(LimitError, match=r"the travel, -1 to 2\.5 mm"):
            tdc.move_absolute(mm=-2)
        tdc.set_move_abs_params(mm=-1)


@pytest.mark.parametrize("travel", [0, -1, (2, 1), (1,), float("nan"), "far", (0, True)])
def test_an_invalid_travel_is_refused(line: RecordingLink, travel: object) -> None:
    with pytest.raises(BadValueError, match="travel_mm"):
        TDC001.open(line, stage=stages.Z8, travel_mm=travel)  # type: ignore[arg-type]
    assert line.raw == b""


def test_without_a_travel_targets_are_not_checked(line: RecordingLink) -> None:
    with TDC001.open(line, stage=stages.Z8) as tdc:
        assert "not checked; set it with travel_mm=" in str(tdc)
        tdc.home()  # then 0 is at the reverse end
        tdc.move_absolute(mm=11)


def test_the_error_of_a_stopped_motion_states_the_position(tdc: TDC001) -> None:
    motion = tdc.start_move_absolute(mm=3)
    tdc.session.pause(0.2)
    tdc.stop()
    told = r"^TDC001: move_absolute was stopped before its end: position \d+, position_mm 0\.\d+, .*homed"
    with pytest.raises(
        MotionStoppedError, match=told.replace(".*homed", ".*status_bits .*settled")
    ) as stop:
        motion.wait()
    assert isinstance(stop.value.message, m.MotMoveStoppedDc)


def test_a_status_that_does_not_show_a_new_motion_yet_does_not_end_it(
    tdc: TDC001, line: RecordingLink
) -> None:
    """A controller may need a moment to start a motion; it reports rest until then."""
    tdc.suspend_end_of_move_msgs()
    standing = m.MotGetDcStatusUpdate(chan_ident=1, position=0, velocity=0, status_bits=0).pack(
        0x01, 0x50
    )
    line.twist = lambda data: standing if data[:2] == standing[:2] else data
    tdc.start_move_absolute(mm=3)
    assert tdc.is_moving()
    tdc.session.pause(0.6)
    line.twist = bytes
    assert tdc.is_moving()
    line.forget()
    tdc.close()
    assert STOP in line.raw


# Suspended end-of-move messages


def test_waiting_is_refused_while_end_messages_are_suspended(
    tdc: TDC001, line: RecordingLink
) -> None:
    tdc.suspend_end_of_move_msgs()
    line.forget()
    with pytest.raises(
        UnsupportedError,
        match="its end is not reported, because end-of-move messages are suspended",
    ):
        tdc.move_absolute(mm=1)
    assert line.raw == b""
    motion = tdc.start_move_absolute(mm=1)
    with pytest.raises(UnsupportedError, match="suspended"):
        motion.wait()
    assert tdc.is_moving()
    assert tdc.stop() is None  # the stop was written, but its end is not reported
    tdc.session.pause(5)
    assert not tdc.is_moving()
    tdc.resume_end_of_move_msgs()
    tdc.move_absolute(mm=1)


def test_a_stop_does_not_wait_for_a_unit_that_sends_no_reply() -> None:
    line = RecordingLink(virtual.TSC001())
    with TSC001.open(line) as tsc:
        line.forget()
        assert tsc.stop() is None
        assert line.raw == m.MotSetSolState(1, e.SolenoidState.SOLENOID_OFF).pack(0x50, 0x01)


# Closing


def test_closing_stops_a_motion(line: RecordingLink) -> None:
    with TDC001.open(line, stage=stages.Z8) as tdc:
        tdc.start_move_absolute(mm=5)
        line.forget()
    assert line.raw == STOP
    tdc.close()
    assert line.raw == STOP


def test_closing_can_leave_a_motion_running(line: RecordingLink) -> None:
    with TDC001.open(line, stage=stages.Z8, on_close="leave") as tdc:
        tdc.start_move_absolute(mm=5)
        line.forget()
    assert line.raw == b""


def test_closing_does_not_stop_a_motion_that_has_ended(line: RecordingLink) -> None:
    with TDC001.open(line, stage=stages.Z8) as tdc:
        tdc.move_absolute(mm=1)
        with pytest.raises(OutOfRangeError):
            tdc.move_absolute(mm=1e9)
        line.forget()
    assert line.raw == b""


def test_closing_does_not_stop_a_stopped_motion_again(line: RecordingLink) -> None:
    with TDC001.open(line, stage=stages.Z8) as tdc:
        tdc.start_move_absolute(mm=2).stop()
        line.forget()
    assert line.raw == b""


def test_closing_stops_a_motion_that_timed_out(line: RecordingLink) -> None:
    with TDC001.open(line, stage=stages.Z8) as tdc:
        with pytest.raises(MotionTimeoutError):
            tdc.move_absolute(mm=5, timeout=0.5)
        with pytest.raises(MotionUnderWayError):
            tdc.home()
        line.forget()
    assert line.raw == STOP


def test_a_refused_motion_does_not_affect_the_motion_under_way(line: RecordingLink) -> None:
    still = m.MotGetDcStatusUpdate(chan_ident=1, position=0, velocity=0, status_bits=0)
    with TDC001.open(line, stage=stages.Z8) as tdc:
        tdc.start_move_absolute(mm=5)
        with pytest.raises(MotionUnderWayError):
            tdc.start_move_absolute(mm=1)
        line.twist = lambda data: still.pack(0x01, 0x50) if data[:2] == b"\x91\x04" else data
        assert tdc.is_moving()
        line.forget()
    assert line.raw == STOP


def test_an_exception_stops_the_motion(line: RecordingLink) -> None:
    def interrupted() -> None:
        with TDC001.open(line, stage=stages.Z8) as tdc:
            tdc.start_move_absolute(mm=5)
            line.forget()
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert line.raw.startswith(STOP)
    assert line.names(PROTOCOL) == ["MOT_MOVE_STOP", "HW_STOP_UPDATEMSGS", "HW_DISCONNECT"]


def test_a_motion_that_is_prepared_while_a_stop_is_sent_is_never_sent(
    tdc: TDC001, line: RecordingLink, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The stop comes from another thread, while the move still reads whether the stage can move."""
    prepare = motion.check_ready

    def stop_meanwhile(*arguments: Any) -> None:
        prepare(*arguments)
        tdc.stop()

    monkeypatch.setattr(motion, "check_ready", stop_meanwhile)
    with pytest.raises(MotionStoppedError, match="was not sent, because a stop was sent"):
        tdc.move_absolute(mm=1)
    monkeypatch.undo()
    assert "MOT_MOVE_ABSOLUTE" not in line.names(PROTOCOL)
    tdc.move_absolute(mm=1)
    assert tdc.position_mm == 1
