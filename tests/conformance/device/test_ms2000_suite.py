"""The suite of the MS-2000 on virtual controllers: every reading passes, and everything is restored."""

from __future__ import annotations

import random
from itertools import product

import pytest
from faulty_ms2000_link import Slow
from ms2000_runs import (
    MOVING,
    NOTHING,
    WIDE,
    controller_of,
    declared_with,
    found,
    run_suite,
    state_of,
    stepped,
    understands_commands,
)

from parts import chosen, every_nth
from stagewire_conformance.device.permissions import Need, Permissions, Range
from stagewire_conformance.device.plans import plan
from stagewire_conformance.device.results import Result
from stagewire_virtual.asi_ms2000.instrument import STRATEGIES

OTHERS = {name: list(readings)[1] for name, readings in STRATEGIES.items()}
"""The second reading of every strategy."""


def drawn(seed: int) -> dict[str, str]:
    chance = random.Random(seed)
    return {name: chance.choice(list(readings)) for name, readings in STRATEGIES.items()}


READINGS = {
    "default": {},
    **{f"{name}={reading}": {name: reading} for name, reading in OTHERS.items()},
    "all others": OTHERS,
    **{f"drawn {seed}": drawn(seed) for seed in range(3)},
}
RUNS = [
    *product(["MS2000"], READINGS),
    *product(["MFC2000"], ["default", "all others"]),
]


@pytest.mark.parametrize(
    ("unit", "readings"),
    chosen(RUNS, lambda run: run in {("MS2000", "default"), ("MFC2000", "all others")}),
)
def test_every_reading_passes_and_everything_is_restored(unit: str, readings: str) -> None:
    controller = controller_of(unit, READINGS[readings])
    declared = declared_with(unit, axes="XYZ" if readings == "default" else "XY")
    before, in_commands = state_of(controller), understands_commands(controller)
    report = run_suite(stepped(controller), declared)
    assert found(report, Result.FAIL, Result.NON_STRICT) == []
    assert {check for check, _, _ in found(report, Result.SKIP)} == {
        check.id for check in plan(declared, WIDE) if check.id.startswith("limits")
    }
    assert not report.not_run
    assert state_of(controller) == before
    assert understands_commands(controller) is in_commands


@pytest.mark.parametrize("seed", every_nth(range(8), 8))
def test_other_seeds_positions_and_settings_pass(seed: int) -> None:
    chance = random.Random(seed)
    controller = controller_of(strategies=drawn(seed))
    instrument = controller.instrument
    for axis in instrument.axes.values():
        axis.set_position(chance.randint(-190_000, 190_000))
        axis.increment = chance.randint(-(1 << 23), (1 << 23) - 1)
        axis.ramp_time = chance.randint(1, 255)
        axis.top_speed = chance.choice([30, 590, 6000, 40_000])
        axis.joystick_enabled = chance.random() < 0.5
    before = state_of(controller)
    report = run_suite(stepped(controller), seed=seed)
    assert found(report, Result.FAIL, Result.NON_STRICT) == []
    assert state_of(controller) == before


@pytest.mark.parametrize("allowed", [NOTHING, Permissions(settings=True)], ids=["none", "settings"])
def test_without_permission_nothing_changes_and_omitted_checks_are_listed(
    allowed: Permissions,
) -> None:
    controller = controller_of(strategies={"power_on_mode": "low"})
    before = state_of(controller)
    report = run_suite(stepped(controller), allowed=allowed)
    assert found(report, Result.FAIL, Result.NON_STRICT) == []
    assert state_of(controller) == before
    not_run = {check.id for check, _ in report.not_run}
    granted = {Need.SETTINGS} if allowed.settings else set()
    assert not_run == {
        check.id
        for check in plan(report.declared, allowed)
        if check.needs - granted and not check.skip
    }


@pytest.mark.parametrize(
    ("motion", "low", "high"),
    [
        ("0..3mm", 0, 30_000),
        ("-3..0mm", -30_000, 0),
        ("-40..40um", -400, 400),
        ("-500..500counts", -500, 500),
    ],
)
def test_a_narrow_range_is_never_left(motion: str, low: int, high: int) -> None:
    controller = controller_of(strategies=OTHERS)
    places: list[int] = []
    axis = controller.instrument.axes["X"]
    link = stepped(controller)
    read = link.read

    def watched(timeout: float) -> bytes:
        places.append(axis.position)
        return read(timeout)

    link.read = watched  # type: ignore[method-assign]
    allowed = Permissions(settings=True, motion=Range.parse(motion))
    moving = [kind for kind in MOVING if kind not in ("counter", "move-together")]
    report = run_suite(link, declared_with(axes="X"), allowed, moving)
    assert found(report, Result.FAIL, Result.NON_STRICT) == []
    assert low <= min(places)
    assert max(places) <= high
    assert max(places) - min(places) >= min(500, (high - low) / 3)


def test_an_axis_does_not_move_when_its_counter_is_set() -> None:
    controller = controller_of(strategies=OTHERS)
    axis = controller.instrument.axes["X"]
    numbers: set[int] = set()
    link = stepped(controller)
    read = link.read

    def watched(timeout: float) -> bytes:
        numbers.add(axis.position)
        assert axis.speed == 0
        return read(timeout)

    link.read = watched  # type: ignore[method-assign]
    report = run_suite(link, declared_with(axes="X"), only=["counter"])
    assert found(report, Result.FAIL) == []
    assert len(numbers) == 4
    assert axis.position == 0


def test_an_axis_outside_the_range_is_not_moved() -> None:
    controller = controller_of()
    before = state_of(controller)
    link = stepped(controller)
    allowed = Permissions(settings=True, motion=Range.parse("1..2mm"))
    report = run_suite(link, allowed=allowed, only=["move-target", "counter", "stop-start"])
    assert {outcome.result for outcome in report.outcomes} == {Result.INFO}
    for _, _, text in found(report, Result.INFO):
        assert "is at 0, outside of the allowed 10000..20000 counts; nothing was moved" in text
    assert state_of(controller) == before


def test_a_range_in_volts_is_reported_and_nothing_runs() -> None:
    allowed = Permissions(motion=Range.parse("0..5V"))
    report = run_suite(stepped(controller_of()), allowed=allowed, only=["move-target"])
    assert report.outcomes == ()
    assert all("0..5V" in why for _, why in report.not_run)


def test_limits_are_approached_if_the_range_includes_them() -> None:
    controller = controller_of(travel=60_000, position=30_000)
    before = state_of(controller)
    declared = declared_with(travel="-3..3mm")
    report = run_suite(stepped(controller), declared)
    assert found(report, Result.FAIL, Result.NON_STRICT, Result.SKIP) == []
    assert state_of(controller) == before
    narrow = Permissions(settings=True, motion=Range.parse("-3..2.9mm"))
    report = run_suite(stepped(controller), declared, narrow, only=["limits"])
    assert {(check.id, why) for check, why in report.not_run} == {
        (
            f"limits/{axis}/upper",
            f"axis {axis} goes to 30000 counts; --allow-motion must include this position",
        )
        for axis in "XY"
    }


def test_unsupported_commands_are_skipped_with_their_reason() -> None:
    declared = declared_with(unsupported={"WRITE_VECTOR_SPEED": "not in this firmware"})
    report = run_suite(stepped(controller_of()), declared)
    skipped = [each for each in found(report, Result.SKIP) if "limits" not in each[0]]
    assert {check.partition("/")[0] for check, _, _ in skipped} == {"move-vector", "ramps"}
    assert all("not in this firmware" in text for _, _, text in skipped)
    assert found(report, Result.FAIL, Result.NON_STRICT) == []


def test_the_report_states_which_reading_a_controller_follows() -> None:
    told = {}
    for name, strategies in (("first", {}), ("second", OTHERS)):
        report = run_suite(stepped(controller_of(strategies=strategies)))
        told[name] = {outcome.check.id: str(outcome.findings) for outcome in report.outcomes}
    for check, first, second in (
        ("sizes/X/READ_MOTOR_POSITION", "is accepted", "is ignored"),
        ("marks-in-data/X/colon-low", "a colon in the data is data", "any colon ends"),
        ("marks-in-data/X/prefix", "255 in the data is data", "a setup command anywhere"),
        ("stop-start/X", "returned b", "returned B"),
        ("stop-start/X", "go to its target", "only enables"),
        ("move-vector/X/sign", "is unsigned", "is signed"),
    ):
        assert first in told["first"][check], check
        assert second in told["second"][check], check


@pytest.mark.parametrize("seconds", every_nth([0.03, 0.005, 0.016, 0.1], 4))
def test_slow_replies_cause_no_failure(seconds: float) -> None:
    controller = controller_of()
    before = state_of(controller)
    report = run_suite(Slow(controller, seconds))
    assert found(report, Result.FAIL, Result.NON_STRICT) == []
    assert state_of(controller) == before
    undecided = {check.partition("/")[0] for check, _, _ in found(report, Result.INFO)}
    too_slow = {
        "ramps": 0.02,
        "move-increment": 0.02,
        "stop-start": 0.04,
        "move-together": 0.04,
    }  # fails above this number of seconds
    assert undecided == {"timing", *(kind for kind, least in too_slow.items() if seconds > least)}


def test_the_same_seed_sends_the_same_bytes_even_for_a_single_check() -> None:
    reports = [run_suite(stepped(controller_of()), allowed=NOTHING, seed=5) for _ in range(2)]
    alone = run_suite(
        stepped(controller_of()), allowed=NOTHING, seed=5, only=["silence/unknown-command"]
    )
    other = run_suite(
        stepped(controller_of()), allowed=NOTHING, seed=6, only=["silence/unknown-command"]
    )
    sent = [
        {
            outcome.check.id: [entry.raw for entry in outcome.entries if entry.sent]
            for outcome in report.outcomes
        }
        for report in (*reports, alone, other)
    ]
    assert sent[0] == sent[1]
    assert sent[2]["silence/unknown-command"] == sent[0]["silence/unknown-command"]
    assert sent[3]["silence/unknown-command"] != sent[0]["silence/unknown-command"]
