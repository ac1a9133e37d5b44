"""The problems that users of other drivers report most about motions, each with a test named for it."""

from __future__ import annotations

import logging
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest
from recording_link import RecordingLink

import stagewire_virtual as virtual
from stagewire import Stage
from stagewire.capture import read_capture
from stagewire.errors import (
    BadValueError,
    MotionTimeoutError,
    NotReadyError,
    OutOfRangeError,
    SessionClosedError,
    TransportLostError,
    UnsupportedError,
)
from stagewire.quantities import Limit
from stagewire.support import Direction
from stagewire_apt import (
    BBD102,
    BSC203,
    K10CR1,
    KDC101,
    MFF101,
    MFF102,
    MLJ050,
    MST601,
    PROTOCOL,
    TDC001,
    TPZ001,
    aio,
    stages,
)
from stagewire_apt import enumerations as e
from stagewire_apt import messages as m
from stagewire_ms2000 import MS2000
from stagewire_virtual import stepped

STOP = m.MotMoveStop(1, e.StopMode.PROFILED).pack(0x50, 0x01)
STOP_UPDATES = m.HwStopUpdateMsgs().pack(0x50, 0x01)
DISCONNECT = m.HwDisconnect().pack(0x50, 0x01)
HOME = {"home_direction": 2, "limit_switch": 1, "home_velocity": 1_000_000, "offset_distance": 0}


def stage_of(name: str) -> Stage:
    found = getattr(stages, name)
    assert isinstance(found, Stage)
    return found


def home_parameters(channel: int = 1, **fields: int) -> m.MotSetHomeParams:
    return m.MotSetHomeParams(chan_ident=channel, **{**HOME, **fields})


def line_to(controller: Any) -> RecordingLink:
    return RecordingLink(controller)


# Home does nothing, or goes the wrong way


@pytest.mark.parametrize(
    ("field", "cause"),
    [
        ("home_velocity", "home_velocity is 0"),
        ("home_direction", "home_direction is 0, not one of FORWARD (1), REVERSE (2)"),
        ("limit_switch", "limit_switch is 0, not one of REVERSE (1), FORWARD (4)"),
    ],
)
def test_home_parameters_of_zero_are_refused_before_anything_moves(field: str, cause: str) -> None:
    keyword = {"home_velocity": "velocity_mm_per_s"}.get(field, field)
    line = line_to(virtual.KDC101(stage=stages.Z825B))
    with KDC101.open(line, stage="Z825B") as kdc:
        kdc.session.send(home_parameters(**{field: 0}), 0x50)  # as another program would
        line.forget()
        for call in (kdc.home, kdc.start_home):
            with pytest.raises(NotReadyError) as refused:
                call()
            assert refused.value.causes == (cause,)
            for words in ("home was not sent", cause, f"change_home_params({keyword}=...)"):
                assert words in str(refused.value)
            assert "apply_stage_defaults" not in str(refused.value)  # Z825B has no defaults
        assert line.names(PROTOCOL) == ["MOT_REQ_HOMEPARAMS"] * 2
        kdc.set_home_params(**HOME)
        assert kdc.home().message == m.MotMoveHomed(1)


def test_a_home_direction_that_does_not_exist_is_refused() -> None:
    with KDC101.open(line_to(virtual.KDC101())) as kdc:
        kdc.session.send(home_parameters(home_direction=3), 0x50)
        with pytest.raises(NotReadyError, match="home_direction is 3, not one of"):
            kdc.home()


def test_home_parameters_of_zero_are_refused_in_asyncio() -> None:
    async def main() -> None:
        async with aio.KDC101.open("virtual://KDC101") as kdc:
            await kdc.session.send(home_parameters(home_velocity=0), 0x50)
            with pytest.raises(NotReadyError, match="home_velocity is 0"):
                await kdc.home()

    stepped.run(main())


def test_a_zero_that_home_does_not_require_is_named_when_it_never_ends() -> None:
    controller = virtual.KDC101(stage=stages.Z825B, quirks=("zero_motion_parameters",))
    with KDC101.open(line_to(controller), stage="Z825B") as kdc:
        kdc.set_home_params(**HOME)
        with pytest.raises(MotionTimeoutError, match="likely cause: acceleration is 0"):
            kdc.home(timeout=5)


def test_brushless_stages_home_without_direction_and_limit_switch() -> None:
    line = line_to(virtual.BBD102(stage=stages.MLS203))
    with BBD102.open(line, stage="MLS203") as rack:
        bay = rack.bay(2)
        read = bay.get_home_params().message
        assert (read.home_direction, read.limit_switch) == (0, 0)  # the document's example
        assert bay.home().message == m.MotMoveHomed(1)
        bay.session.send(home_parameters(home_direction=0, limit_switch=0, home_velocity=0), 0x22)
        with pytest.raises(NotReadyError, match=r"bay 2: home .* home_velocity is 0"):
            bay.home()


def test_home_is_refused_while_a_motion_is_under_way_without_a_request() -> None:
    line = line_to(virtual.TDC001(stage=stages.Z8))
    with TDC001.open(line, stage="Z8") as tdc:
        tdc.start_move_absolute(mm=3)
        line.forget()
        with pytest.raises(Exception, match="is or may be under way"):
            tdc.home()
        assert line.names(PROTOCOL) == []


# Waits that never end


def test_a_labjack_reports_ends_because_it_gets_its_own_home_parameters_first() -> None:
    line = line_to(virtual.MLJ050())
    with MLJ050.open(line, scale_source="vendor") as jack:
        before = jack.get_home_params().message
        line.forget()
        jack.move_absolute(mm=1)
        names = line.names(PROTOCOL)
        # The status shows whether the target is within the travel.
        assert names[-3:] == ["MOT_REQ_HOMEPARAMS", "MOT_SET_HOMEPARAMS", "MOT_MOVE_ABSOLUTE"]
        assert m.MotSetHomeParams(**before.values()).pack(0x50, 0x01) in line.raw
        line.forget()
        jack.home()
        assert line.names(PROTOCOL) == ["MOT_REQ_HOMEPARAMS", "MOT_MOVE_HOME"]


def test_a_labjack_with_unusable_home_parameters_is_not_moved() -> None:
    controller = virtual.MLJ050()
    line = line_to(controller)
    with MLJ050.open(line) as jack:
        jack.session.send(home_parameters(home_velocity=0), 0x50)
        line.forget()
        with pytest.raises(NotReadyError, match=r"whose end it would not report.*home_velocity"):
            jack.move_absolute(counts=1000)
        assert line.names(PROTOCOL) == ["MOT_REQ_HOMEPARAMS"]


def test_a_virtual_labjack_reports_no_end_before_it_gets_home_parameters() -> None:
    line = line_to(virtual.MLJ050())
    with MLJ050.open(line, identify=False) as jack, jack.subscribe(m.MotMoveHomed) as ends:
        jack.session.send(m.MotMoveHome(1), 0x50)
        jack.session.pause(60)
        assert ends.take() is None
        jack.session.send(home_parameters(home_velocity=10**7), 0x50)
        jack.session.send(m.MotMoveHome(1), 0x50)
        jack.session.pause(60)
        assert ends.take() == m.MotMoveHomed(1)


# Unusable power-on parameters


@pytest.mark.parametrize(("field", "cause"), [("acceleration", 0), ("max_velocity", 0)])
def test_velocity_parameters_of_zero_are_reported_and_refused(
    field: str, cause: int, caplog: pytest.LogCaptureFixture
) -> None:
    controller = virtual.K10CR1()
    with K10CR1.open(RecordingLink(controller)) as mount:
        usable = mount.get_vel_params().message
        held = {"acceleration": usable.acceleration, "max_velocity": usable.max_velocity}
        mount.session.send(m.MotSetVelParams(1, 0, **{**held, field: 0}), 0x50)
    line = line_to(controller)
    with caplog.at_level(logging.WARNING, "stagewire"), K10CR1.open(line) as mount:
        assert f"motions will be refused: {field} is 0" in caplog.text
        assert f"motions are refused: {field} is 0" in str(mount)
        line.forget()
        with pytest.raises(NotReadyError, match=f"move_absolute was not sent.*{field} is 0"):
            mount.move_absolute(counts=1000)
        assert line.names(PROTOCOL) == ["MOT_REQ_VELPARAMS"]
        mount.set_vel_params(min_velocity=0, **held)
        assert "refused" not in str(mount)
        line.forget()
        mount.move_absolute(counts=1000)
        assert line.names(PROTOCOL) == ["MOT_MOVE_ABSOLUTE"]


def test_parameters_that_another_program_repairs_are_read_again_before_a_motion() -> None:
    line = line_to(virtual.KDC101())
    with KDC101.open(line) as kdc:
        held = kdc.get_vel_params().message.values()
        kdc.change_vel_params(max_velocity=0)
        kdc.session.send(m.MotSetVelParams(**held), 0x50)
        kdc.move_absolute(counts=1000)


def test_jog_parameters_of_zero_are_refused() -> None:
    with KDC101.open("virtual://KDC101") as kdc:
        kdc.change_jog_params(jog_max_velocity=0)
        with pytest.raises(NotReadyError, match="jog_max_velocity is 0"):
            kdc.jog("FORWARD")
        kdc.move_absolute(counts=1000)  # needs other parameters


def test_a_silent_bay_does_not_hide_the_state_of_the_others() -> None:
    controller = virtual.BBD102(stage=stages.MLS203)
    with BBD102.open(RecordingLink(controller), stage="MLS203") as rack:
        held = rack.bay(2).get_vel_params().message
        stopped = m.MotSetVelParams(1, 0, acceleration=held.acceleration, max_velocity=0)
        rack.session.send(stopped, 0x22)
    line = line_to(controller)
    line.twist = lambda data: b"" if data[:2] == b"\x15\x04" and data[5] == 0x21 else data
    with BBD102.open(line, stage="MLS203") as rack, pytest.raises(NotReadyError) as refused:
        rack.bay(2).move_absolute(mm=5)
    assert refused.value.causes == ("max_velocity is 0",)


def test_a_controller_that_does_not_answer_about_its_state_is_opened(
    caplog: pytest.LogCaptureFixture,
) -> None:
    line = line_to(virtual.KDC101())
    line.twist = lambda data: b"" if data[:2] == b"\x42\x04" else data
    with caplog.at_level(logging.WARNING, "stagewire"), KDC101.open(line) as kdc:
        assert "whether it can move is unknown" in caplog.text
        assert line.names(PROTOCOL) == [
            "HW_REQ_INFO", "MOT_REQ_LIMSWITCHPARAMS", "MOT_REQ_HOMEPARAMS"
        ]  # fmt: skip
        kdc.move_absolute(counts=1000)


def test_the_parameters_of_the_stage_are_written_only_when_they_are_asked_for() -> None:
    controller = virtual.K10CR1()
    line = line_to(controller)
    with K10CR1.open(line) as mount:
        for name in ("vel", "jog"):
            prefix = "jog_" if name == "jog" else ""
            change = getattr(mount, f"change_{name}_params")
            change(**{f"{prefix}acceleration": 0, f"{prefix}max_velocity": 0})
        mount.session.send(home_parameters(home_velocity=0), 0x50)
        line.forget()
        for motion in (
            mount.home,
            lambda: mount.jog("FORWARD"),
            lambda: mount.move_absolute(deg=9),
        ):
            with pytest.raises(NotReadyError, match=r"apply_stage_defaults\(\)"):
                motion()
        assert not [name for name in line.names(PROTOCOL) if "_SET_" in name]
        written = mount.apply_stage_defaults()
        assert [values.message.layout.message for values in written] == [
            "MOT_GET_HOMEPARAMS",
            "MOT_GET_VELPARAMS",
            "MOT_GET_JOGPARAMS",
        ]
        assert round(mount.get_vel_params().max_velocity_deg_per_s, 3) == 10
        assert round(mount.get_jog_params().step_size_deg, 3) == 5
        assert mount.get_home_params().home_direction is e.HomeDirection.REVERSE
        assert mount.home().message == m.MotMoveHomed(1)
        mount.jog("FORWARD")


def test_the_parameters_of_the_stage_include_its_limit_switches() -> None:
    async def main() -> None:
        async with aio.KDC101.open("virtual://KDC101?stage=Z825V", stage="Z825V") as kdc:
            *_, switches = await kdc.apply_stage_defaults()
            assert switches.message == (await kdc.get_lim_switch_params()).message
            assert switches.message.cw_hard_limit == e.HardLimit.MAKES

    stepped.run(main())


def test_a_stage_without_known_parameters_is_an_error_and_nothing_is_sent() -> None:
    line = line_to(virtual.KDC101(stage=stages.Z825B))
    with KDC101.open(line, stage="Z825B") as kdc:
        line.forget()
        with pytest.raises(UnsupportedError, match="no default parameters of Z825B"):
            kdc.apply_stage_defaults()
        assert line.raw == b""
    with KDC101.open("virtual://KDC101") as kdc, pytest.raises(UnsupportedError, match="stage="):
        kdc.apply_stage_defaults()


def test_a_value_that_the_defaults_lack_is_set_by_its_own_call_with_the_limit_of_the_stage() -> (
    None
):
    line = line_to(virtual.KDC101(stage=stages.MTS50_Z8))
    with KDC101.open(line, stage="MTS50_Z8") as kdc:
        kdc.change_vel_params(max_velocity=0)
        advice = r"call change_vel_params\(max_velocity_mm_per_s=\.\.\.\), at most 2\.4 mm/s"
        with pytest.raises(NotReadyError, match=advice) as refused:
            kdc.move_absolute(mm=1)
        assert "apply_stage_defaults" not in str(refused.value)
        assert "at most 2.4 mm/s" in str(kdc)
        kdc.change_vel_params(max_velocity_mm_per_s=2.4)
        kdc.apply_stage_defaults()
        kdc.move_absolute(mm=1)


def test_defaults_that_would_leave_a_value_of_0_are_not_written() -> None:
    line = line_to(virtual.KDC101(stage=stages.MTS25_Z8))
    with KDC101.open(line, stage="MTS25_Z8") as kdc:
        kdc.change_vel_params(max_velocity=0)
        kdc.change_jog_params(jog_max_velocity=0)
        line.forget()
        with pytest.raises(NotReadyError, match="nothing was written") as refused:
            kdc.apply_stage_defaults()
        assert refused.value.causes == ("max_velocity is 0", "jog_max_velocity is 0")
        assert not [name for name in line.names(PROTOCOL) if "_SET_" in name]


def test_without_a_stage_the_advice_names_the_values_in_counts() -> None:
    with TDC001.open("virtual://TDC001") as tdc:
        tdc.change_vel_params(max_velocity=0)
        with pytest.raises(NotReadyError, match=r"call change_vel_params\(max_velocity=\.\.\.\)"):
            tdc.move_absolute(counts=1000)


@pytest.mark.parametrize("name", [name for name in stages.__all__ if stage_of(name).defaults])
def test_the_parameters_of_each_stage_are_within_its_limits(name: str) -> None:
    stage = stage_of(name)
    for values in stage.defaults.values():
        for field, value in values.items():
            limit = stage.limits.get(
                "max_velocity" if "velocity" in field else f"max_{field.rpartition('_')[2]}"
            )
            if isinstance(limit, Limit) and value[-1:].isdigit():
                assert 0 < Fraction(value) <= limit.value


# Closed devices, and parts of devices


def test_a_closed_device_cannot_be_entered() -> None:
    kdc = KDC101.open("virtual://KDC101")
    kdc.close()
    with pytest.raises(SessionClosedError, match=r"was closed: call reconnect\(\)"), kdc:
        pass


def test_a_bay_shows_its_own_stage_and_limits() -> None:
    with BBD102.open("virtual://BBD102?stage=MLS203", stages={2: "MLS203"}) as bbd:
        assert "stage MLS203, chosen by the user" in str(bbd.bay(2))
        assert "maximum velocity" in str(bbd.bay(2))
        assert "stage MLS203_X, reported" in str(bbd.bay(1))
        assert "MLS203_X, reported" not in str(bbd.bay(2))


# Channel not enabled


def test_a_move_on_a_disabled_channel_says_so_and_does_not_enable_it() -> None:
    line = line_to(virtual.KDC101())
    with KDC101.open(line) as kdc:
        kdc.disable()
        assert not kdc.is_enabled()
        line.forget()
        for call in (kdc.home, lambda: kdc.move_absolute(counts=1000), lambda: kdc.jog("FORWARD")):
            with pytest.raises(NotReadyError, match=r"the channel is disabled.*enable\(\)"):
                call()
        assert "MOD_SET_CHANENABLESTATE" not in line.names(PROTOCOL)
        kdc.enable()
        assert kdc.is_enabled()
        kdc.move_absolute(counts=1000)


def test_a_channel_that_was_disabled_before_is_reported_when_it_is_opened(
    caplog: pytest.LogCaptureFixture,
) -> None:
    controller = virtual.BSC203()
    with BSC203.open(RecordingLink(controller)) as rack:
        rack.bay(2).disable()
    with caplog.at_level(logging.WARNING, "stagewire"), BSC203.open(RecordingLink(controller)) as r:
        assert [bay.is_enabled() for bay in r.bays] == [True, False, True]
        assert "motions will be refused: the channel is disabled; call enable()" in caplog.text
        assert "bay 2" in str(r)
        assert "motions are refused: the channel is disabled" in str(r)
        r.bay(1).move_absolute(counts=1000)
        with pytest.raises(NotReadyError, match="bay 2"):
            r.bay(2).move_absolute(counts=1000)


def test_an_enable_that_the_controller_does_not_confirm_is_an_error() -> None:
    line = line_to(virtual.KDC101())
    with KDC101.open(line) as kdc:
        kdc.disable()
        disabled = m.ModGetChanEnableState(1, e.EnableState.DISABLE).pack(0x01, 0x50)
        line.twist = lambda data: disabled if data[:2] == b"\x12\x02" else data
        with pytest.raises(NotReadyError, match=r"was to be enabled, but .* as disabled"):
            kdc.enable()


def test_a_channel_can_be_enabled_in_asyncio_and_by_channel() -> None:
    async def main() -> None:
        async with aio.KDC101.open("virtual://KDC101") as kdc:
            await kdc.disable()
            assert not await kdc.is_enabled()
            await kdc.enable()
            assert await kdc.is_enabled()

    stepped.run(main())
    with MST601.open("virtual://rack?bays=MST601", bay=1) as module:
        module.channel(2).disable()
        assert [channel.is_enabled() for channel in module.channels] == [True, False]


def test_a_unit_without_motors_says_that_it_cannot_be_enabled() -> None:
    with TPZ001.open("virtual://TPZ001") as piezo, pytest.raises(UnsupportedError, match="TPZ001"):
        piezo.is_enabled()


# Device lost after an aborted session


def sent(log: Path) -> bytes:
    """Return the bytes that a capture has from the host."""
    return b"".join(
        one.data for one in read_capture(log).recorded if one.direction is Direction.TO_CONTROLLER
    )


def aborted(line: RecordingLink, opened: Any) -> None:
    """Start a move, and let an exception end the block."""

    def use() -> None:
        with opened as device:
            device.start_move_absolute(counts=100_000)
            line.forget()
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        use()


def test_after_an_exception_the_stop_is_sent_before_the_updates_and_the_connection_end() -> None:
    line = line_to(virtual.TDC001())
    aborted(line, TDC001.open(line))
    assert line.raw == STOP + STOP_UPDATES + DISCONNECT


def test_after_an_exception_no_message_is_sent_that_the_unit_does_not_have() -> None:
    line = line_to(virtual.K10CR1())
    aborted(line, K10CR1.open(line))
    assert line.raw == STOP + STOP_UPDATES


def test_after_an_exception_an_axis_of_an_ms2000_is_stopped() -> None:
    line = line_to(virtual.MS2000())

    def use() -> None:
        with MS2000.open(line) as ms2000, ms2000.low_level():
            ms2000.axis("X").start_move_absolute(um=5000)
            line.forget()
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        use()
    assert line.raw == bytes.fromhex("ff41 ff42 18423a ff41")  # text, the stop in low level, text


def test_after_an_exception_in_asyncio_the_connection_is_ended(tmp_path: Path) -> None:
    async def use(name: str, error: bool) -> None:
        async with aio.TDC001.open("virtual://TDC001", log=tmp_path / name) as tdc:
            await tdc.start_updates()
            if error:
                raise ZeroDivisionError

    stepped.run(use("normal.txt", False))
    with pytest.raises(ZeroDivisionError):
        stepped.run(use("error.txt", True))
    normal, failed = (sent(tmp_path / name) for name in ("normal.txt", "error.txt"))
    assert normal.endswith(STOP_UPDATES)
    assert DISCONNECT not in normal
    assert failed.endswith(STOP_UPDATES + DISCONNECT)


def test_a_signal_sends_the_stop_before_the_updates_and_the_connection_end() -> None:
    async def main() -> None:
        async with aio.TDC001.open("virtual://TDC001") as tdc:
            await tdc.start_move_absolute(counts=100_000)
            words = tdc._at.connection.last_words()
        assert words == STOP + STOP_UPDATES + DISCONNECT

    stepped.run(main())


def test_a_normal_close_ends_the_updates_that_were_started_here() -> None:
    line = line_to(virtual.TDC001())
    with TDC001.open(line) as tdc:
        tdc.start_updates()
        line.forget()
    assert line.raw == STOP_UPDATES
    line = line_to(virtual.TDC001())
    with TDC001.open(line) as tdc:
        tdc.start_updates()
        tdc.stop_updates()
        line.forget()
    assert line.raw == b""


def test_the_updates_of_a_bay_are_ended_at_its_address() -> None:
    line = line_to(virtual.BBD102())
    with BBD102.open(line) as rack:
        rack.bay(2).start_updates()
        line.forget()
    assert line.raw == m.HwStopUpdateMsgs().pack(0x22, 0x01)


def test_a_module_ends_its_updates_but_not_the_connection_of_the_others() -> None:
    line = line_to(virtual.rack("MST601", "MST601"))
    with MST601.open(line, bay=1) as first:

        def use() -> None:
            with MST601.open(first, bay=2) as second:
                second.start_updates()
                line.forget()
                raise ZeroDivisionError

        with pytest.raises(ZeroDivisionError):
            use()
        assert line.raw == m.HwStopUpdateMsgs().pack(0x22, 0x01)
        assert first.channel(1).is_enabled()


def test_close_lists_the_motions_that_continue(caplog: pytest.LogCaptureFixture) -> None:
    line = line_to(virtual.TDC001())
    with caplog.at_level(logging.WARNING, "stagewire"):
        with TDC001.open(line, on_close="leave") as tdc:
            tdc.start_move_absolute(counts=100_000)
            line.forget()
        assert tdc.left_moving == ("TDC001: move_absolute",)
        assert 'on_close="leave" and no stop was sent; may still be moving' in caplog.text
        assert line.raw == b""


def test_close_lists_no_motion_after_its_end_or_a_stop(
    caplog: pytest.LogCaptureFixture,
) -> None:
    with caplog.at_level(logging.WARNING, "stagewire"):
        with TDC001.open("virtual://TDC001", on_close="leave") as tdc:
            tdc.move_absolute(counts=1000)
        assert tdc.left_moving == ()
        with TDC001.open("virtual://TDC001") as tdc:
            tdc.start_move_absolute(counts=100_000)
        assert tdc.left_moving == ()
    assert caplog.text == ""


def test_close_lists_the_motions_that_continue_when_the_line_was_lost() -> None:
    line = line_to(virtual.TDC001())
    with TDC001.open(line) as tdc:
        motion = tdc.start_move_absolute(counts=100_000)

        def lost(data: bytes) -> bytes:
            raise TransportLostError("the plug was pulled")

        line.twist = lost
        with pytest.raises(TransportLostError):
            motion.wait()
    assert tdc.left_moving == ("TDC001: move_absolute",)


# Waiting on a SET


def test_a_set_has_no_reply_and_does_not_wait_for_one() -> None:
    line = line_to(virtual.KDC101())
    with KDC101.open(line) as kdc:
        before = kdc.session.now()
        kdc.set_vel_params(min_velocity=0, acceleration=100, max_velocity=10_000)
        assert kdc.session.now() - before < kdc._at.connection.choices.timeout / 2
        assert kdc.get_vel_params().max_velocity == 10_000


# A flipper that moves one way only


def test_a_flipper_moves_to_both_positions_and_reports_them() -> None:
    line = line_to(virtual.MFF101())
    with MFF101.open(line) as flipper:
        for position in (2, 1, 2):
            flipper.move_to(position)
            assert flipper.position == position
        jogs = [name for name in line.names(PROTOCOL) if name == "MOT_MOVE_JOG"]
        assert len(jogs) == 3


def test_a_flipper_at_its_position_is_not_moved() -> None:
    line = line_to(virtual.MFF102())
    with MFF102.open(line) as flipper:
        assert flipper.position == 1
        line.forget()
        flipper.move_to(1)
        assert line.names(PROTOCOL) == ["MOT_REQ_STATUSBITS"]


def test_a_flipper_waits_for_its_transit_time_and_reports_no_position_before() -> None:
    line = line_to(virtual.MFF101())
    with MFF101.open(line) as flipper:
        flipper.set_transit_time(2800)
        assert flipper.transit_time == 2800
        begun = flipper.session.now()
        flipper.move_to(2)
        assert 2.8 <= flipper.session.now() - begun < 3
        flipper.jog("FORWARD")
        assert flipper.position is None


@pytest.mark.parametrize(("milliseconds", "counts"), [(500, 508), (300, 1145), (2800, 33)])
def test_a_transit_time_is_also_set_in_the_counts_of_the_document(
    milliseconds: int, counts: int
) -> None:
    with MFF101.open("virtual://MFF101") as flipper:
        before = flipper.get_mff_oper_params().message.values()
        flipper.set_transit_time(milliseconds)
        after = flipper.get_mff_oper_params().message.values()
    assert after == {**before, "transit_time": milliseconds, "transit_time_adc": counts}


def test_a_flipper_refuses_a_position_and_a_transit_time_that_do_not_exist() -> None:
    line = line_to(virtual.MFF101())
    with MFF101.open(line) as flipper:
        line.forget()
        for position, error in ((0, OutOfRangeError), (3, OutOfRangeError), ("up", BadValueError)):
            with pytest.raises(error, match="not one of 1, 2"):
                flipper.move_to(position)  # type: ignore[arg-type]
        for time in (299, 2801):
            with pytest.raises(OutOfRangeError, match="300 to 2800"):
                flipper.set_transit_time(time)
        assert line.raw == b""


def test_a_flipper_that_arrives_after_its_timeout_is_not_left_moving() -> None:
    flipper = MFF101.open(line_to(virtual.MFF101()))
    with pytest.raises(MotionTimeoutError):
        flipper.move_to(2, timeout=0.1)
    flipper.session.pause(1)
    assert flipper.position == 2
    flipper.close()
    assert flipper.left_moving == ()


def test_a_flipper_that_does_not_arrive_is_an_error_and_is_not_moved_again() -> None:
    line = line_to(virtual.MFF101())
    with MFF101.open(line) as flipper:
        line.twist = lambda data: (
            m.MotGetStatusBits(1, 0x20).pack(0x01, 0x50) if data[:2] == b"\x2a\x04" else data
        )
        line.forget()
        with pytest.raises(MotionTimeoutError, match=r"within 2 s \(transit time 500 ms\).*no pos"):
            flipper.move_to(2)
        assert line.names(PROTOCOL).count("MOT_MOVE_JOG") == 1


def test_closing_a_flipper_in_motion_does_not_pretend_to_stop_it(
    caplog: pytest.LogCaptureFixture,
) -> None:
    line = line_to(virtual.MFF101())
    with caplog.at_level(logging.WARNING, "stagewire"):
        with MFF101.open(line) as flipper:
            flipper.jog("REVERSE")
            line.forget()
        assert line.raw == b""
        assert flipper.left_moving == ("MFF101: jog",)
        assert "the unit cannot stop and no stop was sent" in caplog.text


def test_a_flipper_moves_in_asyncio() -> None:
    async def main() -> None:
        async with aio.MFF101.open("virtual://MFF101") as flipper:
            await flipper.move_to(2)
            assert await flipper.position == 2
            await flipper.set_transit_time(700)
            assert await flipper.transit_time == 700

    stepped.run(main())
