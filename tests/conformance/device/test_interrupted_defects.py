"""An interrupted run makes no defective controller faster, and says whether it rests.

Each defective controller that can move is interrupted at fifty points, spread over the kinds that move.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import pytest
from apt_runs import UNITS, Bench, bench
from broken_apt import BROKEN, broken
from broken_apt_changing import MOTION, OUTPUTS, SETTINGS, Broken, name
from broken_ms2000_errors import WRONG
from broken_ms2000_motion import MOTION as MS2000_MOTION
from broken_ms2000_reading import READING, STATUS
from broken_ms2000_settings import SETTINGS as MS2000_SETTINGS
from faulty_apt_link import FaultyAptLink, LinkFault
from ms2000_defects import Defect
from ms2000_runs import WIDE, controller_of, declared_with

from interruptions import (
    LOST,
    Chosen,
    Ended,
    Interruption,
    Rig,
    interrupt_kinds,
    judge,
    run_kind,
    virtual_rig,
)
from parts import PROOF
from stagewire_conformance.device.plans import plan

POINTS = 50
SAMPLE = 2
MS2000 = {**READING, **STATUS, **WRONG, **MS2000_SETTINGS, **MS2000_MOTION}


def chosen(on: Bench) -> Chosen:
    return Chosen(on.declared, on.allowed(), plan(on.declared, on.allowed()))


def rig_of(on: Bench, fault: LinkFault) -> Rig:
    return virtual_rig(on.controller, lambda link: FaultyAptLink(link, fault))


def told_wrongly(title: str) -> tuple[Bench, Callable[[], Rig]]:
    """Return a controller with a wrong reply, and a function that makes it."""
    unit = BROKEN[title].unit
    return bench(unit), lambda: rig_of(bench(unit), broken()[title].spoil)


def moved_wrongly(which: Broken) -> tuple[Bench, Callable[[], Rig]]:
    """Return a controller that sets or moves something wrongly, and a function that makes it."""
    return which.bench(), lambda: rig_of(which.bench(), which.make())


CONTROLLERS = {
    **{title: (each.unit, partial(told_wrongly, title)) for title, each in BROKEN.items()},
    **{
        name(each): (each.unit, partial(moved_wrongly, each))
        for each in (*SETTINGS, *OUTPUTS, *MOTION)
    },
}
MOVING = {
    title: make
    for title, (unit, make) in CONTROLLERS.items()
    if "MOT_MOVE_STOP" in UNITS[unit]["messages"]
}


def cases(every: Iterator[Any], nth: int) -> Iterator[Any]:
    """Yield each controller for `make proofs`, and some of them with a few points for `make test`."""
    for number, each in enumerate(every):
        if number % nth == 0:
            yield pytest.param(each, SAMPLE, id=f"{each}-some".replace(" ", "-"))
        yield pytest.param(each, POINTS, id=f"{each}".replace(" ", "-"), marks=PROOF)


@pytest.mark.parametrize(("title", "count"), [*cases(iter(MOVING), 40)])
def test_an_interrupted_defective_controller_is_safe(title: str, count: int) -> None:
    on, make = MOVING[title]()
    interrupt_kinds(chosen(on), make, count, seed=24)


def defective_ms2000(title: str) -> tuple[Chosen, Callable[[], Rig]]:
    """Return the declaration of a defective MS-2000, and a function that makes one."""
    defect: Defect = MS2000[title]

    def make() -> Rig:
        controller = controller_of(strategies=defect.strategies, travel=100_000, position=50_000)
        return virtual_rig(controller, lambda link: defect.make(controller))

    declared = declared_with(**defect.pics)
    return Chosen(declared, WIDE, plan(declared, WIDE)), make


@pytest.mark.parametrize(("title", "count"), [*cases(iter(MS2000), 30)])
def test_an_interrupted_defective_ms2000_is_safe(title: str, count: int) -> None:
    interrupt_kinds(*defective_ms2000(title), count, seed=24)


def interrupted(title: str, kind: str, way: str) -> Ended:
    """Interrupt a check of a defective MS-2000 soon after something begins to move, and judge the run."""
    on, make = defective_ms2000(title)
    began = run_kind(on, make(), kind, Interruption()).link.began
    ended = run_kind(on, make(), kind, Interruption(began + 1, way))
    judge(on, ended)
    return ended


def vector_speeds(ended: Ended) -> set[bytes]:
    """Return the commands after the interruption that set a vector speed."""
    return {raw for raw, _ in ended.interruption.sent if raw[1] == ord("^")}


def test_an_axis_that_ignores_its_stops_at_a_vector_speed_gets_the_speed_0() -> None:
    ended = interrupted("does_not_stop", "move-vector", "SIGINT")
    assert vector_speeds(ended) == {bytes.fromhex("18 5e 02 00 00 3a")}
    assert not any(ended.rig.commanded().values())
    assert not ended.report.adrift


def test_an_axis_at_rest_that_reports_a_speed_gets_no_vector_speed() -> None:
    ended = interrupted("speed_at_rest", "move-vector", "SIGINT")
    assert not vector_speeds(ended)
    for axis, text in zip("XY", ended.report.adrift, strict=True):
        assert text.startswith(
            f"axis {axis} still reports motion after STOP_MOTOR, another STOP_MOTOR;"
        )


def test_an_axis_that_a_new_counter_may_move_is_reported_when_the_line_is_lost() -> None:
    ended = interrupted("counter_moves", "counter", LOST)
    assert any(ended.rig.commanded().values())
    [text] = ended.report.adrift
    assert text.startswith("axis X may still be moving: the line was lost before it came to rest")
