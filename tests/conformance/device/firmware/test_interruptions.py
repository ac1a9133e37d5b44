"""An interrupted run makes nothing faster, and either everything rests or the report says that it does not.

Each kind of check that moves something is interrupted at fifty seeded points of its dialogue, by signals and
by a lost line, on a unit of each family. Every faulty controller that can move is interrupted at fifty
points, spread over these kinds.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from random import Random
from typing import Any

import pytest
from faulty_commands import COMMANDS
from faulty_dynamics import DYNAMICS
from faulty_moves import MOVES
from firmware_bench import bench
from firmware_commands import CommandDefect, FaultyCommandLink
from firmware_defects import Defect
from firmware_line import FaultyLink
from interruptions import (
    Firmware,
    Interruption,
    commanded,
    correct,
    draws,
    judge,
    kinds_that_move,
    run_kind,
)
from runaways import RUNAWAYS, with_runaway, with_runaway_axis

from stagewire.links import Link
from stagewire_cli.conformance.sheets import show_end
from stagewire_conformance.reports import as_html, as_json, as_junit
from stagewire_conformance.reports.device_sheet import sheet_of

FAMILIES = {
    "DC servo": "TDC001",
    "stepper": "TST001",
    "stepper rack": "BSC102",
    "brushless": "BBD102",
    "solenoid": "TSC001",
    "MS-2000": "MS2000",
}
POINTS = 50


def interrupt(unit: str, kind: str, firmware: Callable[[], Firmware], count: int, name: str) -> int:
    """Interrupt the checks of a kind at some points, and judge each run; return the number of runs."""
    on = bench(unit)
    whole = run_kind(on, kind, Interruption(), firmware())
    if not whole.link.began:
        return 0  # nothing moves there
    number = 0
    for what in draws(name, whole.link.began, whole.link.operations, count):
        judge(on, run_kind(on, kind, what, firmware()))
        number += 1
    return number


def cases() -> Iterator[Any]:
    """Yield each kind on each family: a few points in `make test`, all of them in the matrix."""
    for unit in FAMILIES.values():
        for number, kind in enumerate(kinds_that_move(bench(unit))):
            if number % 6 == 0:
                yield pytest.param(unit, kind, 2, id=f"{unit}-{kind}-some")
            yield pytest.param(unit, kind, POINTS, id=f"{unit}-{kind}", marks=pytest.mark.matrix)


@pytest.mark.parametrize(("unit", "kind", "count"), [*cases()])
def test_an_interrupted_check_is_safe(unit: str, kind: str, count: int) -> None:
    interrupt(unit, kind, lambda: correct, count, f"{unit}/{kind}")


def runaway_cases() -> Iterator[Any]:
    for unit in ("TDC001", "TST001", "BBD102"):
        for name in RUNAWAYS:
            for kind in kinds_that_move(bench(unit)):
                sample = unit == "TDC001" and kind in ("move-velocity", "move-absolute")
                marks = () if sample else (pytest.mark.matrix,)
                count = 4 if sample else POINTS // (5 if unit == "TDC001" else 15)
                yield pytest.param(unit, name, kind, count, marks=marks)


@pytest.mark.parametrize(("unit", "name", "kind", "count"), [*runaway_cases()])
def test_a_runaway_motor_is_never_made_faster(unit: str, name: str, kind: str, count: int) -> None:
    def make() -> Firmware:
        return lambda link: with_runaway(name, link, bench(unit).status)

    interrupt(unit, kind, make, count, f"{unit}/{name}/{kind}")


@pytest.mark.parametrize("kind", kinds_that_move(bench("MS2000")))
def test_a_runaway_axis_is_never_made_faster(kind: str) -> None:
    interrupt("MS2000", kind, lambda: with_runaway_axis, 2, f"runaway axis/{kind}")


def faulty_cases() -> Iterator[Any]:
    for number, defect in enumerate((*MOVES, *DYNAMICS, *COMMANDS)):
        if number % 24 == 0:
            yield pytest.param(defect, 3, id=f"{defect.name}-some".replace(" ", "-"))
        yield pytest.param(
            defect, POINTS, id=defect.name.replace(" ", "-"), marks=pytest.mark.matrix
        )


def faulty(defect: Defect | CommandDefect) -> tuple[str, Callable[[], Firmware]]:
    """Return the unit of a defect, and a function that makes its firmware."""
    if isinstance(defect, CommandDefect):
        unit, _, _ = defect.draw(0)

        def command(link: Link) -> Link:
            return FaultyCommandLink(link, defect.draw(0)[1])

        return unit, lambda: command
    unit = defect.draw(0).unit

    def framed(link: Link) -> Link:
        return FaultyLink(link, defect.draw(0).firmware, bench(unit).status)

    return unit, lambda: framed


@pytest.mark.parametrize(("defect", "count"), [*faulty_cases()])
def test_an_interrupted_faulty_controller_is_safe(
    defect: Defect | CommandDefect, count: int
) -> None:
    unit, make = faulty(defect)
    kinds = kinds_that_move(bench(unit))
    Random(defect.name).shuffle(kinds)
    each = max(1, count // len(kinds))
    for kind in kinds[:count]:
        interrupt(unit, kind, make, each, f"{defect.name}/{kind}")


def test_the_last_line_and_every_report_say_that_a_motor_still_moves(
    capsys: pytest.CaptureFixture[str],
) -> None:
    on = bench("TDC001")

    def firmware(link: Link) -> Link:
        return with_runaway("obeys nothing", link, on.status)

    whole = run_kind(on, "move-velocity", Interruption(), firmware)
    at = (whole.link.began + whole.link.operations) // 2
    ended = run_kind(on, "move-velocity", Interruption(at, "SIGINT"), firmware)
    assert any(commanded(ended.controller).values())
    [text] = ended.report.adrift
    sheet = sheet_of(ended.report, on.checks, 1.0, lambda only: f"repeat {only}")
    show_end(sheet, [])
    last = capsys.readouterr().out.splitlines()[-1]
    assert last.startswith("NOT AT REST: 0x50 channel 1 still moves at about ")
    assert "after MOT_MOVE_STOP, an immediate MOT_MOVE_STOP, MOD_SET_CHANENABLESTATE" in last
    assert json.loads(as_json(sheet))["adrift"] == [text]
    assert text in as_html(sheet)
    assert text in as_junit(sheet)
