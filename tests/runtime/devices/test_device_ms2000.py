"""The MS-2000: modes, reads, polled moves, and stops."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from recording_link import RecordingLink

import stagewire_virtual as virtual
from stagewire.errors import (
    BadValueError,
    LimitError,
    MotionStoppedError,
    MotionTimeoutError,
    MotionUnderWayError,
    OutOfRangeError,
    WrongModeError,
)
from stagewire.framing import CommandReceived
from stagewire_ms2000 import MS2000, PROTOCOL
from stagewire_ms2000 import enumerations as e
from stagewire_ms2000 import messages as c

LOW, HIGH = b"\xff\x42", b"\xff\x41"
STOP_X = c.StopMotor().pack(0x18)


@pytest.fixture
def line() -> RecordingLink:
    return RecordingLink(virtual.MS2000())


@pytest.fixture
def ms(line: RecordingLink) -> Iterator[MS2000]:
    with MS2000.open(line, travel_mm={"X": (-10, 10)}) as ms:
        yield ms


def commands(line: RecordingLink) -> list[str]:
    events = PROTOCOL.framer().feed(line.raw)
    assert all(isinstance(event, CommandReceived) for event in events)
    return [event.frame.message.layout.message for event in events]


def test_opening_sends_nothing(ms: MS2000, line: RecordingLink) -> None:
    assert line.raw == b""
    assert ms.mode == "unknown"


def test_in_the_wrong_mode_calls_are_refused_before_anything_is_sent(
    ms: MS2000, line: RecordingLink
) -> None:
    x = ms.axis("X")
    for call in (x.read_motor_position, lambda: x.move_absolute(um=1), x.is_moving):
        with pytest.raises(WrongModeError):
            call()
    with pytest.raises(WrongModeError):
        ms.text("W X")
    assert line.raw == b""
    ms.switch_to_high_level()
    with pytest.raises(WrongModeError):
        x.start_move_absolute(um=1)
    assert line.raw == HIGH
    ms.close()
    assert line.raw == HIGH  # nothing was started, so nothing is stopped


def test_the_mode_is_entered_and_left(ms: MS2000, line: RecordingLink) -> None:
    with ms.low_level() as same:
        assert same is ms
        assert ms.mode == "low_level"
        assert ms.axis("X").read_motor_position().um == 0
    assert ms.mode == "high_level"
    assert ms.text("W X").startswith(":A")
    assert line.raw.startswith(LOW)
    with pytest.raises(BadValueError), ms.low_level():
        ms.axis("Q")
    assert ms.mode == "high_level"


def test_values_are_in_units(ms: MS2000, line: RecordingLink) -> None:
    with ms.low_level():
        x = ms.axis("X")
        line.forget()
        x.write_ramping_time(ms=50)
        x.write_top_speed(um_per_s=2000)
        assert line.raw == c.WriteRampingTime(50).pack(0x18) + c.WriteTopSpeed(2000).pack(0x18)
        assert x.read_ramp_time().ms == 50
        with pytest.raises(OutOfRangeError):
            x.write_ramping_time(ms=256)


def test_a_move_ends_when_the_axis_is_idle(ms: MS2000, line: RecordingLink) -> None:
    with ms.low_level():
        x = ms.axis(e.Axis.X)
        assert x is ms.axis("x")
        end = x.move_absolute(um=1500)
        assert x.read_motor_position().um == pytest.approx(1500, abs=1)
        assert end.message is None
        polls = commands(line).count("READ_STATUS")
        assert polls <= end.seconds * 10 + 1  # one poll every 0.1 s
        assert commands(line).count("WRITE_TARGET_POSITION") == 1


def test_closing_does_not_stop_a_move_that_has_ended(line: RecordingLink) -> None:
    with MS2000.open(line) as ms:
        ms.switch_to_low_level()
        ms.axis("X").move_absolute(um=10)
        line.forget()
    assert line.raw == b""


def test_a_second_move_is_refused_while_one_is_under_way(ms: MS2000, line: RecordingLink) -> None:
    with ms.low_level():
        x, y = ms.axis("X"), ms.axis("Y")
        motion = x.start_move_absolute(um=9000)
        with pytest.raises(
            MotionUnderWayError, match="MS2000 axis X: move_absolute is still under"
        ):
            x.start_move_absolute(um=0)
        y.move_absolute(um=10)  # another axis
        assert not motion.done
        motion.wait()
        assert motion.done
        x.move_absolute(um=8999)


def test_a_stop_does_not_wait(ms: MS2000, line: RecordingLink) -> None:
    with ms.low_level():
        x = ms.axis("X")
        motion = x.start_move_absolute(um=9000)
        line.forget()
        assert x.stop() is None
        assert line.raw == STOP_X
        with pytest.raises(MotionStoppedError, match="MS2000 axis X: move_absolute was stopped"):
            motion.wait()
        assert not x.is_moving()


def test_after_an_exception_a_moving_axis_is_stopped(line: RecordingLink) -> None:
    def use() -> None:
        with MS2000.open(line) as ms, ms.low_level():
            ms.axis("X").start_move_absolute(um=9000)
            line.forget()
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        use()
    assert STOP_X in line.raw.removeprefix(HIGH)


def test_a_wait_for_a_long_move_times_out(ms: MS2000) -> None:
    with ms.low_level():
        motion = ms.axis("X").start_move_absolute(um=9000)
        with pytest.raises(MotionTimeoutError, match="still busy after"):
            motion.wait(0.3)
        motion.wait()


def test_a_lost_reply_does_not_end_a_move(ms: MS2000, line: RecordingLink) -> None:
    lost = [b""] * 3
    with ms.low_level():
        motion = ms.axis("X").start_move_absolute(um=5000)
        line.twist = lambda data: lost.pop() if data and lost else data
        motion.wait()
        assert ms.axis("X").read_motor_position().um == pytest.approx(5000, abs=1)
    assert not lost


def test_targets_are_compared_with_the_travel(ms: MS2000, line: RecordingLink) -> None:
    with ms.low_level():
        line.forget()
        with pytest.raises(LimitError, match="11 mm is outside the travel, -10 to 10 mm"):
            ms.axis("X").move_absolute(um=11000)
        with pytest.raises(LimitError):
            ms.axis("X").write_increment_value(um=20001)
        assert line.raw == b""
        ms.axis("Y").start_move_absolute(um=11000).stop()


def test_closing_stops_a_move_in_the_low_level_format(line: RecordingLink) -> None:
    for leave in ("low", "high"):
        with MS2000.open(RecordingLink(line.controller)) as ms:
            ms.switch_to_low_level()
            ms.axis("X").write_vector_speed(um_per_s=100)
            if leave == "high":
                ms.switch_to_high_level()
            used = ms.session._link
            assert isinstance(used, RecordingLink)
            used.forget()
        assert used.raw == (STOP_X if leave == "low" else LOW + STOP_X + HIGH)


def test_axes_can_have_undocumented_identifiers(ms: MS2000, line: RecordingLink) -> None:
    with ms.low_level():
        line.forget()
        ms.axis(0x30).stop()
        assert line.raw == c.StopMotor().pack(0x30)
    for axis, error in ((0x3A, OutOfRangeError), (256, OutOfRangeError), ("Q", BadValueError)):
        with pytest.raises(error):
            ms.axis(axis)  # type: ignore[arg-type]


def test_values_that_look_like_a_setup_command_are_refused_on_request(line: RecordingLink) -> None:
    with MS2000.open(line, refuse_prefix_bytes=True) as ms, ms.low_level():
        line.forget()
        with pytest.raises(OutOfRangeError, match="may take for"):
            ms.axis("X").move_absolute(counts=0x42FF)
        assert line.raw == b""


def test_printing_a_device_shows_its_axes_and_scales(ms: MS2000) -> None:
    lines = str(ms).splitlines()
    assert lines[:5] == [
        "MS2000: MS-2000 controller, at virtual://MS2000",
        "  axis X: no stage",
        "    travel: -10 to 10 mm (set by travel_mm)",
        "    maximum velocity: unknown; not checked; set it with max_velocity_mm_per_s=",
        "    position: 10 counts per um (the document)",
    ]
    assert "counts per ms" not in str(ms)  # because the counts are milliseconds
