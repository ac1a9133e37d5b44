"""Clients of EPICS scan, fly, home, tweak and calibrate, and the line has the right frames."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import bluesky.plan_stubs as bps
import bluesky.plans as bp
import ca
import pytest
from bluesky import RunEngine
from conftest import Documents
from epics_motors import MOTORS, OF_OPHYD, OF_OPHYD_ASYNC, published
from iocs import bench_of
from lines import Line, recorded, run
from ophyd import EpicsMotor
from ophyd.utils import LimitError
from ophyd_async.core import FlyMotorInfo
from ophyd_async.epics.motor import OffsetMode, UseSetMode

import stagewire_virtual as virtual
from checkout import ROOT
from markdown_blocks import blocks
from stagewire.errors import ReplyTimeoutError
from stagewire_apt import stages
from stagewire_bluesky.checking import MoveFailedError
from stagewire_bluesky.epics import CheckedMotor

MOVE = bytes((0x53, 0x04, 0x06, 0x00, 0xD0, 0x01))
HOME = bytes((0x43, 0x04))
STARTS = (MOVE, HOME, bytes((0x48, 0x04)), bytes((0x57, 0x04)), bytes((0x6A, 0x04)))
"""Frames, or their first bytes, that start a motion of a TDC001."""
COUNT = 1 / 34304.0
"""The length of a count of a Z8 in mm."""


def starts(line: Line) -> int:
    return sum(line.sent.count(one) for one in STARTS)


@pytest.fixture
def line() -> Iterator[Line]:
    with virtual.TDC001(stage=stages.Z8).tcp() as tdc, recorded(tdc.url) as found:
        yield found


@pytest.fixture
def ioc(line: Line, tmp_path: Path) -> Iterator[tuple[str, ca.IocProcess]]:
    """An IOC, after the name of its motor record."""
    with published(tmp_path, bench_of(line.url)) as found:
        yield found


@pytest.fixture
def name(ioc: tuple[str, ca.IocProcess]) -> str:
    """The name of a motor record."""
    return ioc[0]


@pytest.fixture(params=MOTORS)
def x(plans: RunEngine, name: str, request: pytest.FixtureRequest) -> Any:
    """A motor of each class."""
    return MOTORS[request.param](name)


def near(*positions: float) -> Any:
    return [pytest.approx(position, abs=COUNT) for position in positions]


def test_scans_record_each_target(
    x: Any, plans: RunEngine, documents: Documents, line: Line
) -> None:
    plans(bp.scan([], x, 0.2, 0.4, 3))
    assert [data["x"] for data in documents.data] == near(0.2, 0.3, 0.4)
    assert starts(line) == 3
    plans(bp.rel_scan([], x, -0.1, 0.1, 3))
    assert [data["x"] for data in documents.data[3:]] == near(0.3, 0.4, 0.5)
    assert starts(line) == 7  # it returns to its start
    plans(bp.grid_scan([], x, 0.1, 0.2, 2))
    assert [data["x"] for data in documents.data[6:]] == near(0.1, 0.2)
    assert starts(line) == 9
    plans(bps.mv(x, 0.2))
    assert starts(line) == 9
    assert {document["exit_status"] for document in documents.of("stop")} == {"success"}


@pytest.mark.parametrize("kind", OF_OPHYD_ASYNC)
def test_a_flight_is_two_moves_at_the_velocity_of_the_flight(
    plans: RunEngine, name: str, line: Line, kind: str
) -> None:
    x = OF_OPHYD_ASYNC[kind](name)

    def plan() -> Any:
        yield from bps.prepare(
            x, FlyMotorInfo(start_position=0.5, end_position=1.0, time_for_move=0.5), wait=True
        )
        at = yield from bps.rd(x.user_readback)
        yield from bps.open_run()
        yield from bps.kickoff(x, wait=True)
        yield from bps.complete(x, wait=True)
        yield from bps.close_run()
        return at, (yield from bps.rd(x.user_readback)), (yield from bps.rd(x.velocity))

    assert plans(plan()).plan_result == (*near(0.25, 1.25), pytest.approx(1.0, rel=1e-4))
    assert starts(line) == 2


def calibrate(x: Any, position: float, mode: str) -> Any:
    """Give the position another number, as ``set_current_position`` of ophyd does."""
    if isinstance(x, EpicsMotor):
        yield from bps.mv(x.offset_freeze_switch, mode)
        x.set_current_position(position)
    else:  # this version of ophyd-async has no method for it
        yield from bps.mv(x.offset_freeze_switch, OffsetMode(mode))
        yield from bps.mv(x.set_use_switch, UseSetMode.SET)
        yield from bps.mv(x.user_setpoint, position)
        yield from bps.mv(x.set_use_switch, UseSetMode.USE)


def test_setting_the_current_position_sends_no_motion_frame(
    x: Any, plans: RunEngine, documents: Documents, line: Line
) -> None:
    offset = x.user_offset if isinstance(x, EpicsMotor) else x.offset

    def plan() -> Any:
        yield from bps.mv(x, 0.3)
        yield from calibrate(x, 5.0, "Variable")
        first = (yield from bps.rd(x.user_readback)), (yield from bps.rd(offset))
        yield from calibrate(x, 6.0, "Frozen")
        return *first, (yield from bps.rd(x.user_readback)), (yield from bps.rd(offset))

    assert plans(plan()).plan_result == tuple(near(5.0, 4.7, 6.0, 4.7))
    assert starts(line) == 1
    plans(bp.list_scan([], x, [6.1]))
    assert [data["x"] for data in documents.data] == near(6.1)
    assert starts(line) == 2


@pytest.mark.parametrize("kind", OF_OPHYD)
def test_ophyd_homes_and_sets_limits(plans: RunEngine, name: str, line: Line, kind: str) -> None:
    x = OF_OPHYD[kind](name)
    plans(bps.mv(x, 0.2))
    x.home("forward", wait=True)
    assert line.sent.count(HOME) == 1
    assert x.user_readback.get(use_monitor=False) == pytest.approx(0.0, abs=COUNT)
    x.set_lim(0, 5)
    assert (x.low_limit_travel.get(), x.high_limit_travel.get()) == (0, 5)
    end = time.monotonic() + ca.FOUND
    while x.limits != (0, 5) and time.monotonic() < end:  # ophyd checks those that it was last sent
        time.sleep(0.01)
    with pytest.raises(LimitError):
        x.move(5.5)
    assert starts(line) == 2


def test_pyepics_tweaks_and_calibrates(name: str, line: Line) -> None:
    from epics import Motor  # ophyd warns unless it is imported first

    x = Motor(name, timeout=10)
    x.tweak_val = 0.2
    assert x.tweak("forward", wait=True) == 0
    assert x.get_position(readback=True) == pytest.approx(0.2, abs=COUNT)
    assert x.tweak("reverse", wait=True) == 0
    assert starts(line) == 2
    x.set_position(3.0)
    assert x.get_position(readback=True) == pytest.approx(3.0, abs=COUNT)
    assert x.move(3.1, wait=True) == 0
    assert starts(line) == 3


@pytest.mark.parametrize("kind", [kind for kind in MOTORS if kind.startswith("Checked")])
@pytest.mark.parametrize("lost", ["line", "IOC"])
def test_a_loss_between_move_and_reading_records_no_event(
    plans: RunEngine,
    documents: Documents,
    ioc: tuple[str, ca.IocProcess],
    line: Line,
    kind: str,
    lost: str,
) -> None:
    name, process = ioc
    x = MOTORS[kind](name)

    def plan() -> Any:
        yield from bps.stage(x)
        yield from bps.open_run()
        yield from bps.mv(x, 0.1)
        yield from bps.trigger_and_read([x])
        if lost == "line":
            line.cut()
            process.wait_for("t: socket://")
            yield from bps.sleep(0.2)
        else:
            process.process.kill()
            process.process.wait()
        yield from bps.trigger_and_read([x])

    with pytest.raises((MoveFailedError, ReplyTimeoutError)):
        plans(plan())
    assert [data["x"] for data in documents.data] == near(0.1)


def test_the_program_of_the_page_scans(line: Line, tmp_path: Path) -> None:
    """Run the block of ``control-systems.md#Over EPICS``."""
    [program] = [
        block.text
        for block in blocks(ROOT / "docs" / "control-systems.md")
        if block.section == "Over EPICS" and block.language == "python"
    ]
    with ca.ioc(tmp_path, 'prefix = "LAB:"\n' + bench_of(line.url)):
        words = [sys.executable, "-c", program]
        subprocess.run(words, check=True, capture_output=True, timeout=60)
    assert starts(line) == 2  # it is at the first of three targets


def test_checked_motors_move_in_mock_mode(plans: RunEngine) -> None:
    x = CheckedMotor("LAB:x", "x")
    run(lambda: x.connect(mock=True))
    plans(bps.mv(x, 3.0))
    assert run(x.locate)["readback"] == 3.0
