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

from interruptions import Chosen, Rig, interrupt_kinds, virtual_rig
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


@pytest.mark.parametrize(("title", "count"), [*cases(iter(MS2000), 30)])
def test_an_interrupted_defective_ms2000_is_safe(title: str, count: int) -> None:
    defect: Defect = MS2000[title]

    def make() -> Rig:
        controller = controller_of(strategies=defect.strategies, travel=100_000, position=50_000)
        return virtual_rig(controller, lambda link: defect.make(controller))

    declared = declared_with(**defect.pics)
    interrupt_kinds(Chosen(declared, WIDE, plan(declared, WIDE)), make, count, seed=24)
