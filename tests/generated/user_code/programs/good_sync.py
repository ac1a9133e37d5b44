"""Code of users without mistakes: type checkers find nothing and know the types of all results."""

from __future__ import annotations

from decimal import Decimal
from fractions import Fraction
from typing import assert_type

import stagewire
from stagewire import Scale, Stage
from stagewire.devices import Motion, MotionEnd
from stagewire.errors import ReplyTimeoutError
from stagewire.framing import Event
from stagewire.sessions import BlockingSubscription
from stagewire_apt import BBD102, BSC002, MST601, TDC001, TPZ001, enumerations
from stagewire_apt import messages as m
from stagewire_apt.devices import values
from stagewire_ms2000 import MS2000


def one_stage(url: str) -> float:
    """Home a stage and move it, in engineering units and in counts."""
    with TDC001.open(url, stage="Z8", travel_mm=25, log="session.txt") as tdc:
        assert_type(tdc, TDC001)
        assert_type(tdc.home(), MotionEnd[None])
        end = tdc.move_absolute(mm=1.5)
        any_end: MotionEnd = end
        print(any_end.seconds, end.values.asdict(), end.values.received_at)
        assert_type(tdc.move_absolute(mm=1.5).values.position, int)
        assert_type(tdc.move_relative(mm=1).values.position_mm, float)
        tdc.move_absolute(counts=34_304, timeout=30)
        tdc.move_relative(mm=-0.25)
        tdc.jog(enumerations.MoveDirection.FORWARD)
        tdc.jog("reverse")
        tdc.jog(1)
        tdc.stop("immediate")
        tdc.set_av_modes(mode_bits="ledmode_ident|ledmode_moving")
        motion = tdc.start_move_absolute(mm=12)
        started: Motion = motion
        assert_type(started.done, bool)
        assert_type(motion.done, bool)
        motion.stop()
        assert_type(motion.wait(timeout=60).values.position_mm, float)
        tdc.set_vel_params(min_velocity=0, acceleration_mm_per_s2=1.5, max_velocity_mm_per_s=2.3)
        changed = tdc.change_vel_params(max_velocity_mm_per_s="2.5")
        assert_type(changed.max_velocity_mm_per_s, float)
        assert_type(changed.max_velocity, int)
        return tdc.get_dc_status_update().position_mm


def two_bays(url: str) -> list[float]:
    """Each bay has its own stage."""
    with BBD102.open(url, stages={1: "MLS203", 2: "MLS203"}) as bbd102:
        for bay in bbd102.bays:
            bay.home()
        bbd102.bay(2).set_vel_params(
            min_velocity=0, acceleration_mm_per_s2=10, max_velocity_mm_per_s=99
        )
        motions = [bay.start_move_absolute(mm=10) for bay in bbd102.bays]
        return [motion.wait().seconds for motion in motions]


def channels(url: str) -> None:
    """Each channel has its own stage, also in a module of a rack."""
    with BSC002.open(url) as bsc002:
        bsc002.channel(2).move_relative(counts=1000)
        bsc002.channel("CHAN2").stop()
    with MST601.open(url, bay=1) as module:
        module.channel(1).home()


def piezo(url: str) -> float:
    """A piezo has volts and a maximum voltage."""
    with TPZ001.open(url, max_volts=75) as tpz001:
        tpz001.set_output_volts(volts=12.5)
        return tpz001.get_output_volts().volts


def listen(url: str) -> int:
    """Receive unsolicited messages."""
    with (
        TDC001.open(url, stage="Z8") as tdc,
        tdc.subscribe(m.MotGetDcStatusUpdate) as updates,
        tdc.subscribe(values.DcStatusUpdate, m.MotMoveHomed) as news,
        tdc.subscribe() as everything,
    ):
        tdc.start_updates(10)
        for message in updates:
            assert_type(message, m.MotGetDcStatusUpdate)
            assert_type(message.position, int)
        for new in news:
            assert_type(new, values.DcStatusUpdate | m.MotMoveHomed)
            if isinstance(new, values.DcStatusUpdate):
                assert_type(new.position_mm, float)
        assert_type(everything, BlockingSubscription[Event])
        return updates.dropped


def axes(url: str) -> int:
    """The MS-2000 has axes, and enters its low-level mode explicitly."""
    with MS2000.open(url) as ms2000, ms2000.low_level():
        x = ms2000.axis("X")
        x.move_absolute(um=100, timeout=10)
        x.stop()
        return x.read_motor_position().position


def careful(url: str) -> bool:
    """All errors are errors of Stagewire."""
    try:
        with TDC001.open(url) as tdc:
            tdc.move_absolute(mm=1)
    except ReplyTimeoutError as late:
        print(late)
    except stagewire.StagewireError:
        return False
    return True


def own_stage(url: str) -> Fraction:
    """A stage that is not in a document, and a value without float rounding."""
    mine = Stage.of_user("rotary", position=Scale.counts_per("mm", 1919))
    with TDC001.open(url, stage=mine, on_close="leave") as tdc:
        print(tdc.move_absolute(mm=Decimal("0.1")).seconds)
        return tdc.get_pos_counter().exact("mm")


def found() -> list[str]:
    """Connected controllers, and a controller of an unknown unit."""
    with stagewire.open("virtual://TDC001") as device:
        print(device)
    return [each.url for each in stagewire.discover()]
