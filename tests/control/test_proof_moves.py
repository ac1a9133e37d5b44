"""Random moves of a motor end at their targets, and are done only when their end was on the line."""

from __future__ import annotations

import random
from pathlib import Path
from typing import Any

import bluesky.plan_stubs as bps
import pytest
from bluesky import RunEngine
from conftest import Documents
from epics_motors import MOTORS, published
from iocs import bench_of
from lines import Line, connected, recorded

import stagewire_virtual as virtual
from stagewire_apt import stages
from stagewire_apt.aio import BBD102, TDC001
from stagewire_bluesky import Controller, Motor

NEAR = 1.0
"""Counts by which a position may differ from its target."""
MLS203_COUNTS, Z8_COUNTS = 20000.0, 34304.0
"""Counts of both stages in a millimetre."""
SOME = [10, pytest.param(200, marks=[pytest.mark.matrix, pytest.mark.proof])]
"""Numbers of moves."""


def prove(
    plans: RunEngine,
    documents: Documents,
    motor: Any,
    scale: float,
    line: Line,
    address: int,
    targets: list[float],
) -> None:
    """Move to each target, and compare events with targets and completions with the line."""
    move = bytes((0x53, 0x04, 0x06, 0x00, address | 0x80, 0x01))
    ends = bytes((0x64, 0x04, 0x0E, 0x00, 0x81, address))
    seen: list[tuple[int, int]] = []

    def plan() -> Any:
        yield from bps.open_run()
        for target in targets:
            status = yield from bps.abs_set(motor, target, group="move")
            status.add_callback(
                lambda _: seen.append((line.sent.count(move), line.received.count(ends)))
            )
            yield from bps.wait("move")
            yield from bps.trigger_and_read([motor])
        yield from bps.close_run()

    plans(plan())
    assert seen == [(number, number) for number in range(1, len(targets) + 1)]
    misses = [
        abs(data[motor.name] - target) * scale
        for data, target in zip(documents.data, targets, strict=True)
    ]
    assert max(misses) <= NEAR


def scale_of(motor: Motor) -> float:
    return float(motor.reference.part.scales.of("position", "mm").counts_per_unit)


def test_a_move_is_done_when_its_end_was_reported_and_not_when_the_axis_is_there(
    plans: RunEngine, documents: Documents
) -> None:
    faults = ["to_host delay message=MOT_MOVE_COMPLETED by=1 overtaken=yes"]
    with (
        virtual.TDC001(stage=stages.Z8, faults=faults).tcp() as tdc,
        recorded(tdc.url) as line,
    ):
        motor = Motor(Controller(TDC001, line.url, stage="Z8"), "x")
        with connected(motor):
            prove(plans, documents, motor, scale_of(motor), line, 0x50, [0.1, 0.2])


@pytest.mark.parametrize("count", SOME)
def test_random_moves_end_within_a_count_and_are_done_after_their_reported_end(
    plans: RunEngine, documents: Documents, count: int
) -> None:
    numbers = random.Random(28)
    targets = [numbers.uniform(0, 20) for _ in range(count)]
    with virtual.BBD102(stage=stages.MLS203).tcp() as bbd, recorded(bbd.url) as line:
        controller = Controller(BBD102, line.url, stage="MLS203", travel_mm=110)
        motor = Motor(controller.bay(1), "x")
        with connected(motor):
            prove(plans, documents, motor, scale_of(motor), line, 0x21, targets)


BENCH = """
[controllers.rack]
unit = "BBD102"
url = "{url}"
stage = "MLS203"
travel_mm = 110
[motors.x]
controller = "rack"
bay = 1
"""


@pytest.mark.parametrize("count", SOME)
@pytest.mark.parametrize("kind", MOTORS)
def test_random_moves_over_epics_end_within_a_count_and_are_done_after_their_reported_end(
    plans: RunEngine, documents: Documents, tmp_path: Path, kind: str, count: int
) -> None:
    numbers = random.Random(28)
    targets = [numbers.uniform(0, 20) for _ in range(count)]
    with (
        virtual.BBD102(stage=stages.MLS203).tcp() as bbd,
        recorded(bbd.url) as line,
        published(tmp_path, BENCH.format(url=line.url)) as (name, _),
    ):
        prove(plans, documents, MOTORS[kind](name), MLS203_COUNTS, line, 0x21, targets)


@pytest.mark.parametrize("kind", MOTORS)
def test_a_move_over_epics_is_done_when_its_end_was_reported_and_not_when_the_axis_is_there(
    plans: RunEngine, documents: Documents, tmp_path: Path, kind: str
) -> None:
    faults = ["to_host delay message=MOT_MOVE_COMPLETED by=1 overtaken=yes"]
    with (
        virtual.TDC001(stage=stages.Z8, faults=faults).tcp() as tdc,
        recorded(tdc.url) as line,
        published(tmp_path, bench_of(line.url)) as (name, _),
    ):
        prove(plans, documents, MOTORS[kind](name), Z8_COUNTS, line, 0x50, [0.1, 0.2])
