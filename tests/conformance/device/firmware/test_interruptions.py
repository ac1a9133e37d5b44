"""An interrupted run makes nothing faster, and either everything rests or the report says that it does not.

Each kind of check that moves something is interrupted at fifty seeded points of its dialogue, by signals and
by a lost line, on a unit of each family. Every faulty controller that can move is interrupted at fifty
points, spread over these kinds.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from firmware_bench import bench
from firmware_commands import CommandDefect, FaultyCommandLink
from firmware_corpus import COMMANDS, DEFECTS
from firmware_defects import Defect
from firmware_line import FaultyLink
from runaways import RUNAWAYS, with_runaway, with_runaway_axis

from interruptions import (
    Firmware,
    Interruption,
    Rig,
    correct,
    interrupt,
    interrupt_kinds,
    kinds_that_move,
    run_kind,
    virtual_rig,
)
from parts import PROOF
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
    "inertial": "KIM101",
    "closed loop": "PDXC2",
    "paddles": "MPC320",
    "MS-2000": "MS2000",
}
POINTS = 50


def rigs(unit: str, firmware: Firmware = correct) -> Callable[[], Rig]:
    """Return a function that makes a unit with defective firmware."""
    return lambda: virtual_rig(bench(unit).make(seed=0), firmware)


def cases() -> Iterator[Any]:
    """Yield each kind on each family: a few points in `make test`, all of them in `make proofs`."""
    for unit in FAMILIES.values():
        for number, kind in enumerate(kinds_that_move(bench(unit))):
            if number % 6 == 0:
                yield pytest.param(unit, kind, 2, id=f"{unit}-{kind}-some")
            yield pytest.param(unit, kind, POINTS, id=f"{unit}-{kind}", marks=PROOF)


@pytest.mark.parametrize(("unit", "kind", "count"), [*cases()])
def test_an_interrupted_check_is_safe(unit: str, kind: str, count: int) -> None:
    interrupt(bench(unit), kind, rigs(unit), count, f"{unit}/{kind}")


def runaway_cases() -> Iterator[Any]:
    for unit in ("TDC001", "TST001", "BBD102"):
        for name in RUNAWAYS:
            for kind in kinds_that_move(bench(unit)):
                sample = unit == "TDC001" and kind in ("move-velocity", "move-absolute")
                marks = () if sample else PROOF
                count = 4 if sample else POINTS // (5 if unit == "TDC001" else 15)
                yield pytest.param(unit, name, kind, count, marks=marks)


@pytest.mark.parametrize(("unit", "name", "kind", "count"), [*runaway_cases()])
def test_a_runaway_motor_is_never_made_faster(unit: str, name: str, kind: str, count: int) -> None:
    def firmware(link: Link) -> Link:
        return with_runaway(name, link, bench(unit).status)

    interrupt(bench(unit), kind, rigs(unit, firmware), count, f"{unit}/{name}/{kind}")


@pytest.mark.parametrize("kind", kinds_that_move(bench("MS2000")))
def test_a_runaway_axis_is_never_made_faster(kind: str) -> None:
    interrupt(bench("MS2000"), kind, rigs("MS2000", with_runaway_axis), 2, f"runaway axis/{kind}")


def moves(defect: Defect) -> bool:
    """Return whether the unit of a defect moves something."""
    return bool(kinds_that_move(bench(defect.draw(0).unit)))


MOVING = (*filter(moves, DEFECTS), *COMMANDS)


def faulty_cases() -> Iterator[Any]:
    for number, defect in enumerate(MOVING):
        if number % 40 == 0:
            yield pytest.param(defect, 3, id=f"{defect.name}-some".replace(" ", "-"))
        yield pytest.param(defect, POINTS, id=defect.name.replace(" ", "-"), marks=PROOF)


def faulty(defect: Defect | CommandDefect) -> tuple[str, Firmware]:
    """Return the unit of a defect, and its firmware, which is made anew for each link."""
    if isinstance(defect, CommandDefect):
        return defect.draw(0)[0], lambda link: FaultyCommandLink(link, defect.draw(0)[1])
    unit = defect.draw(0).unit
    return unit, lambda link: FaultyLink(link, defect.draw(0).firmware, bench(unit).status)


@pytest.mark.parametrize(("defect", "count"), [*faulty_cases()])
def test_an_interrupted_faulty_controller_is_safe(
    defect: Defect | CommandDefect, count: int
) -> None:
    unit, firmware = faulty(defect)
    interrupt_kinds(bench(unit), rigs(unit, firmware), count, defect.seed)


def test_the_last_line_and_every_report_say_that_a_motor_still_moves(
    capsys: pytest.CaptureFixture[str],
) -> None:
    on = bench("TDC001")

    def firmware(link: Link) -> Link:
        return with_runaway("obeys nothing", link, on.status)

    make = rigs("TDC001", firmware)
    whole = run_kind(on, make(), "move-velocity", Interruption())
    at = (whole.link.began + whole.link.operations) // 2
    ended = run_kind(on, make(), "move-velocity", Interruption(at, "SIGINT"))
    assert any(ended.rig.commanded().values())
    [text] = ended.report.adrift
    sheet = sheet_of(ended.report, on.checks, 1.0, lambda only: f"repeat {only}")
    show_end(sheet, [])
    last = capsys.readouterr().out.splitlines()[-1]
    assert last.startswith("NOT AT REST: 0x50 channel 1 still moves at about ")
    assert "after MOT_MOVE_STOP, an immediate MOT_MOVE_STOP, MOD_SET_CHANENABLESTATE" in last
    assert json.loads(as_json(sheet))["adrift"] == [text]
    assert text in as_html(sheet)
    assert text in as_junit(sheet)
