"""The moving checks of Thorlabs APT never leave the range and never move after a stop."""

from __future__ import annotations

from typing import Any

import pytest
from apt_runs import (
    MOVES,
    OUTPUTS,
    SETTINGS,
    Bench,
    bench,
    complaints,
    faulty_link,
    readable,
    run_on,
)
from faulty_apt_link import Change, LinkFault, frame, of
from watched_links import WatchedLink

from allowances import ALL_HAZARDS
from parts import every_nth
from stagewire.errors import TransportLostError
from stagewire.links import Link
from stagewire_apt import PROTOCOL
from stagewire_conformance.device.permissions import Permissions, Range
from stagewire_conformance.device.plans import plan
from stagewire_conformance.device.results import Result
from stagewire_conformance.device.run import RunInterrupted, run

EFFECTS = {entry["id"]: entry["effect"] for entry in PROTOCOL.registry()["messages"]}
MOVING = {
    entry["id"]: entry["name"]
    for entry in PROTOCOL.registry()["messages"]
    if entry["name"].startswith("MOT_MOVE_") and entry["effect"] == "motion"
}
STOP = 0x0465


def id_of(raw: bytes) -> int:
    return int.from_bytes(raw[:2], "little")


def watched(on: Bench, line: Link | None = None) -> tuple[WatchedLink, list[int]]:
    """Return a line, and a list of the positions of all motors, sampled at each read."""
    link = WatchedLink(line or on.link)
    seen: list[int] = []
    motors = [
        on.behaviour(channel, place.bay)
        for place in on.declared.places
        for channel in place.channels
    ]

    def look() -> None:
        seen.extend(motor.position()["position"] for motor in motors)

    link.before_read = look
    return link, seen


RANGES = [
    ("TDC001", "Z8", 0, 100_000),
    ("TDC001", "Z8", -3_000, 3_000),
    ("TDC001", None, -20_000, 500),
    ("BBD103", "MLS203", -100_000, 0),
    ("BBD102", "MLS203", -200, 200_000),
    ("BSC002", "APT_STEPPER", 0, 1_500),
    ("MST601", None, -70_000, 40_000),
]


@pytest.mark.parametrize(
    ("unit", "stage", "low", "high", "backlash", "quirks"),
    every_nth(
        [
            (*each, backlash, quirks)
            for quirks in ((), ("clockwise_is_negative",))
            for backlash in (0, 300, -300)
            for each in RANGES
        ],
        4,
    ),
)
def test_no_motor_leaves_the_range(
    unit: str, stage: str | None, low: int, high: int, backlash: int, quirks: tuple[str, ...]
) -> None:
    on = bench(
        unit, stage, ends=False, quirks=quirks
    )  # not homed: it counts from its current position
    for place in on.declared.places:
        for channel in place.channels:
            frame = bytes((0x3A, 0x04, 6, 0, place.address | 0x80, 1, channel, 0))
            on.link.write(frame + backlash.to_bytes(4, "little", signed=True))
    link, seen = watched(on)
    allowed = Permissions(settings=True, motion=Range.parse(f"{low}..{high}counts"))
    report = run_on(on, MOVES, link=link, allowed=allowed)
    assert not complaints(report)
    assert low <= min(seen)
    assert max(seen) <= high
    assert max(seen) > min(seen)  # something did move
    ran = {outcome.kind.name for outcome in report.outcomes if outcome.result is Result.PASS}
    assert {"move-absolute", "move-relative", "move-jog", "move-velocity"} <= ran


def test_a_motor_outside_the_range_is_reported_and_not_moved() -> None:
    on = bench("BBD102", "MLS203")
    link = WatchedLink(on.link)
    allowed = Permissions(settings=True, tuning=True, motion=Range.parse("10..20mm"))
    report = run_on(on, (*MOVES, "home", "enable", "loops"), link=link, allowed=allowed)
    assert not {id_of(raw) for raw in link.writes} & MOVING.keys()
    changing = ("motion", "settings", "tuning")
    assert all(EFFECTS[id_of(raw)] not in changing for raw in link.writes)
    assert not complaints(report)  # the controller is not to blame for it
    undecided = {
        outcome.kind.name: " ".join(finding.text for finding in outcome.findings)
        for outcome in report.outcomes
        if outcome.result is Result.INFO
    }
    assert undecided.keys() >= {"move-absolute", "move-velocity", "enable", "loops"}
    for words in undecided.values():
        assert "was not moved" in words
        assert "is at 0 counts, outside of the allowed range (200000..400000 counts)" in words
    assert "homing goes to 0" in next(
        why for check, why in report.not_run if check.kind and check.kind.name == "home"
    )


def test_a_piezo_outside_the_range_is_not_driven() -> None:
    on = bench("BPC001")
    link = WatchedLink(on.link)
    allowed = Permissions(settings=True, motion=Range.parse("10..20V"), **ALL_HAZARDS)
    report = run_on(on, ("piezo-volts", "piezo-lut", "piezo-zero"), link=link, allowed=allowed)
    assert len(complaints(report)) == 3
    assert all(EFFECTS[id_of(raw)] == "none" for raw in link.writes)


@pytest.mark.parametrize(("unit", "stage"), [("TDC001", "Z8"), ("BBD103", "MLS203")])
@pytest.mark.parametrize("kind", ["move-velocity", "move-stop", "move-absolute"])
def test_a_motor_that_ignores_stops_is_disabled(unit: str, stage: str, kind: str) -> None:
    """In a rack only the first bay ignores stops, and the others are still stopped."""
    on = bench(unit, stage, ends=False)
    first = next(place.address for place in on.declared.places if place.channels)

    def unheard(raw: bytes) -> bytes:
        return b"" if raw[4] == first else raw

    link, seen = watched(on, faulty_link(on, LinkFault(to_controller=of("MOT_MOVE_STOP", unheard))))
    allowed = Permissions(settings=True, motion=Range.parse("0..100000counts"))
    report = run_on(on, (kind, "move-updates"), link=link, allowed=allowed)
    assert min(seen) >= -5_000
    assert max(seen) <= 105_000
    bays = len([place for place in on.declared.places if place.channels])
    assert seen[-bays:] == seen[-2 * bays : -bays]  # at rest
    assert not report.adrift
    left_out = [why for check, why in report.not_run if "had to be disabled" in why]
    assert bool(left_out) is (kind == "move-velocity")  # other motions end by themselves


@pytest.mark.parametrize("kind", ["move-absolute", "move-relative", "move-jog", "move-velocity"])
def test_a_motor_that_goes_too_far_is_stopped_and_brought_back(kind: str) -> None:
    """Every move is replaced by a move at constant velocity that only a stop ends."""
    on = bench("TDC001", "Z8", ends=False)
    moves = ("MOT_MOVE_ABSOLUTE", "MOT_MOVE_RELATIVE", "MOT_MOVE_JOG")
    once = [True]

    def run_away(raw: bytes) -> bytes:
        first, once[0] = once[0], False
        return frame("MOT_MOVE_VELOCITY", 1, 1, 0x50, 1) if first else raw

    link = WatchedLink(faulty_link(on, LinkFault(to_controller=of(moves, run_away))))
    seen: list[int] = []
    link.before_read = lambda: seen.append(on.behaviour().position()["position"])
    allowed = Permissions(settings=True, motion=Range.parse("0..20000counts"))
    report = run_on(on, (kind,), link=link, allowed=allowed)
    assert max(seen) <= 28_000  # sampled every 0.05 s at 2 mm/s, plus the stopping distance
    words = "; ".join(complaints(report).values())
    assert "it was stopped" in words
    assert seen[-1] == 0


def frozen() -> Change:
    """Repeat the first position of each motor for ever."""
    first: dict[bytes, bytes] = {}

    def change(raw: bytes) -> bytes:
        motor, position = raw[5:8], raw[8:12]  # source and channel
        return raw[:8] + first.setdefault(motor, position) + raw[12:]

    return change


@pytest.mark.parametrize(
    ("unit", "stage", "high"),
    [
        ("TDC001", "Z8", 100_000),
        ("TST001", None, 100_000),
        ("BSC103", "APT_STEPPER", 100_000),
        ("BBD102", "MLS203", 800_000),
    ],
)
def test_a_motor_that_reports_a_frozen_position_stays_in_the_range(
    unit: str, stage: str | None, high: int
) -> None:
    """Remaining displacements would add up, because each check begins at the reported position."""
    on = bench(unit, stage, ends=False)
    telling = (
        "MOT_GET_STATUSUPDATE", "MOT_GET_DCSTATUSUPDATE", "MOT_MOVE_COMPLETED", "MOT_MOVE_STOPPED",
        "MOT_GET_POSCOUNTER",
    )  # fmt: skip
    link, seen = watched(on, faulty_link(on, LinkFault(to_host=of(telling, frozen()))))
    allowed = Permissions(settings=True, motion=Range.parse(f"0..{high}counts"))
    report = run_on(on, MOVES, link=link, allowed=allowed)
    assert min(seen) >= 0
    assert max(seen) <= high
    assert max(seen) > 0
    assert "move-absolute" in {check.partition("/")[0] for check in complaints(report)}


@pytest.mark.parametrize("kind", ["move-absolute", "move-jog", "move-velocity", "home", "limits"])
def test_after_ctrl_c_a_stop_is_sent_and_nothing_moves(kind: str) -> None:
    on = bench("TDC001", "Z8")
    run_on(on, ("home",))
    settings = ("MOT_REQ_VELPARAMS", "MOT_REQ_JOGPARAMS")
    before = {name: said for name, said in readable(on).items() if name.split("/")[1] in settings}
    link = WatchedLink(on.link)
    state: dict[str, Any] = {"moving": False, "raised": 0}

    def note(data: bytes) -> None:
        state["moving"] = state["moving"] or id_of(data) in MOVING

    def interrupt() -> None:
        if state["moving"] and not state["raised"]:
            state["raised"] = len(link.writes)
            raise KeyboardInterrupt

    link.before_write, link.before_read = note, interrupt
    allowed = on.allowed()
    checks = [c for c in plan(on.declared, allowed) if c.kind and c.kind.name == kind]
    with pytest.raises(RunInterrupted):
        run(link, checks, on.declared, allowed, 1)
    after = [id_of(raw) for raw in link.writes[state["raised"] :]]
    assert after[0] == STOP
    assert not set(after) & MOVING.keys()
    now = {name: said for name, said in readable(on).items() if name in before}
    assert now == before


def test_a_lost_line_ends_the_run_without_further_motion() -> None:
    on = bench("TDC001", "Z8")
    link = WatchedLink(on.link)
    gone: list[int] = []

    def lose(data: bytes) -> None:
        if gone:
            raise TransportLostError("the other end hung up")
        if id_of(data) in MOVING:
            gone.append(id_of(data))

    link.before_write = lose
    allowed = on.allowed()
    checks = [c for c in plan(on.declared, allowed) if c.kind and c.kind.name == "move-absolute"]
    report = run(link, checks, on.declared, allowed, 1)
    assert "hung up" in report.unfinished
    assert sum(id_of(raw) in MOVING for raw in link.writes) == 1


def test_with_only_settings_allowed_nothing_moves() -> None:
    for unit in ("TDC001", "BPC301", "TSC001", "MPZ601"):
        on = bench(unit)
        link = WatchedLink(on.link)
        report = run_on(
            on, (*SETTINGS, *OUTPUTS, *MOVES, "home"), link=link, allowed=Permissions(settings=True)
        )
        assert not complaints(report)
        assert all(EFFECTS[id_of(raw)] in ("none", "settings", "stream") for raw in link.writes)
