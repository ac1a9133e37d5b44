"""Checks of Thorlabs APT that change something: virtual controllers pass, and are restored afterwards."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import product

import pytest
from apt_pairs import BARE, FITTED, PAIRS
from apt_runs import (
    EVERY,
    MOVES,
    OUTPUTS,
    SETTINGS,
    UNITS,
    Bench,
    bench,
    complaints,
    faulty_link,
    readable,
    run_on,
)
from faulty_apt_link import LinkFault, byte, of

from allowances import ALL_HAZARDS
from parts import chosen, every_nth
from stagewire_apt import messages as m
from stagewire_apt.enumerations import EnableState, PositionControlMode
from stagewire_conformance.device.declaration import declare
from stagewire_conformance.device.permissions import Permissions, Range
from stagewire_conformance.device.plans import plan
from stagewire_conformance.device.results import Result

GIVING_UP = ("home", "piezo-zero")
"""Kinds that change the zero permanently, and announce this."""

PUTTING_BACK = tuple(
    kind for kind in (*SETTINGS, *OUTPUTS, *MOVES) if kind not in (*GIVING_UP, "limits")
)
"""Kinds that restore everything. Limits can be approached only if the zero is known."""

UNDECIDED = {
    "CT1P": {"piezo-position", "piezo-zero"},
}
"""Kinds that cannot run, because no source defines the status bits of the unit."""
SLOW = {
    "CR1_Z6": {"backlash", "move-absolute", "profile"},
    "CR1_Z7": {"backlash", "move-absolute", "profile"},
    "FW103": {"backlash", "disabled", "limits"},
    "GNL10_Z6": {"backlash", "profile"},
    "GNL18_Z6": {"backlash"},
    "PRM1_Z7": {"backlash", "profile"},
    "PRM1_Z8": {"backlash"},
    "PRMTZ8": {"backlash"},
    "PY004Z8_Yaw": {"backlash"},
    "PY004Z9_Yaw": {"backlash"},
    "Z625_B_64_1": {"backlash"},
}
"""Kinds that cannot run on stages with few counts, because their moves have too few or are too quick."""

QUICK = {"LTS150": {"backlash"}, "LTS300": {"backlash"}}
"""Kinds that cannot run without a stage, because the scales of the unit depend on its hardware version."""


QUIRKS = ("header_only_completion", "long_status", "unswapped_addresses", "fault_codes_in_response")
FAULTS = (
    "to_host drop frame every=7",
    "to_controller drop frame every=25",
    "to_host drop byte p=0.002",
    "to_controller drop byte p=0.001",
    "to_host duplicate frame every=9",
    "to_host flip p=0.001",
)


@pytest.mark.parametrize(
    ("unit", "stage"),
    chosen(PAIRS, lambda case: case in FITTED or case == ("TDC001", None)),
)
def test_a_virtual_controller_passes_and_is_restored(unit: str, stage: str | None) -> None:
    on = bench(unit, stage)
    before = readable(on)
    report = run_on(on, PUTTING_BACK)
    assert not complaints(report)
    assert readable(on) == before
    later = run_on(on, (*GIVING_UP, "limits"))
    assert not complaints(later)
    outcomes = [*report.outcomes, *later.outcomes]
    undecided = {outcome.kind.name for outcome in outcomes if outcome.result is Result.INFO}
    quick = QUICK.get(unit, set()) if stage is None else SLOW.get(stage, set())
    assert undecided == UNDECIDED.get(unit, set()) | quick
    lacking = dict.fromkeys(why for _, why in [*report.not_run, *later.not_run])
    assert all("declares no travel" in why or "axis limits" in why for why in lacking)
    assert stage is None or not any("declares no travel" in why for why in lacking)


@pytest.mark.matrix
@pytest.mark.parametrize("seed", range(1, 6))
@pytest.mark.parametrize("unit", ["TDC001", "BBD102", "MST601", "BPC103", "TPZ001", "TSC001"])
def test_other_seeds_pass_and_restore(unit: str, seed: int) -> None:
    on = bench(unit, seed=seed)
    before = readable(on)
    report = run_on(on, PUTTING_BACK, seed=seed)
    assert not complaints(report)
    assert readable(on) == before


@pytest.mark.parametrize("state", [1, 2])
def test_a_disabled_channel_is_disabled_afterwards(state: int) -> None:
    on = bench("TDC001", "Z8")
    on.link.write(bytes((0x10, 0x02, 1, state, 0x50, 1)))
    before = readable(on)
    assert not complaints(run_on(on, PUTTING_BACK))
    assert readable(on) == before


@pytest.mark.parametrize("paddle", [1, 2, 4])
def test_a_paddle_that_was_enabled_is_enabled_afterwards(paddle: int) -> None:
    """Enabling one paddle of an MPC320 disables the others, which is not a fault of theirs."""
    on = bench("MPC320")
    on.link.write(m.ModSetChanEnableState(paddle, EnableState.ENABLE).pack(0x50, 0x01))
    before = readable(on)
    report = run_on(on, ("enable",))
    assert not complaints(report)
    assert {outcome.result for outcome in report.outcomes} == {Result.PASS}
    assert readable(on) == before


def test_several_enabled_paddles_are_left_alone() -> None:
    on = bench("MPC320")
    on.link.write(m.ModSetChanEnableState(1 | 2, EnableState.ENABLE).pack(0x50, 0x01))
    before = readable(on)
    report = run_on(on, ("enable",))
    assert {outcome.result for outcome in report.outcomes} == {Result.INFO}
    assert readable(on) == before


def test_a_paddle_that_enables_another_is_found() -> None:
    on = bench("MPC320")
    both = of("MOD_SET_CHANENABLESTATE", lambda raw: byte(2, 3)(raw) if raw[2] == 1 else raw)
    found = complaints(run_on(on, ("enable",), link=faulty_link(on, LinkFault(to_controller=both))))
    assert list(found) == ["enable/0x50/1"]
    assert "channel 2 then returned 1 instead of 2" in found["enable/0x50/1"]


ACTUATOR = ("actuator-move", "actuator-stop", "actuator-jog", "actuator-disabled")


def closed_loop() -> Bench:
    """Return a PDXC2 in closed loop, whose moves have targets in nm."""
    on = bench("PDXC2")
    on.link.write(m.PzSetPosControlMode(1, PositionControlMode.CLOSED_LOOP).pack(0x50, 0x01))
    return on


def test_an_inertial_drive_passes_in_closed_loop() -> None:
    on = closed_loop()
    results = {outcome.check.id: outcome.result for outcome in run_on(on, ACTUATOR).outcomes}
    assert results.pop("actuator-jog/0x50/1/continuous") is Result.INFO  # it needs a wider range
    assert {id.partition("/")[0] for id in results} == {*ACTUATOR}
    assert {*results.values()} == {Result.PASS}
    assert on.behaviour().closed


def test_a_closed_loop_that_stops_halfway_is_found() -> None:
    def halved(raw: bytes) -> bytes:
        target = int.from_bytes(raw[10:14], "little", signed=True) // 2
        return raw[:10] + target.to_bytes(4, "little", signed=True)

    fault = LinkFault(to_controller=of("PZMOT_SET_CLOSEMOVEPARAMS", halved))
    on = closed_loop()
    found = complaints(run_on(on, ACTUATOR, link=faulty_link(on, fault)))
    assert "actuator-move/0x50/1" in found
    assert "it should be at" in found["actuator-move/0x50/1"]


@pytest.mark.parametrize("unit", ["BPC301", "TPZ001"])
def test_a_piezo_in_closed_loop_stays_in_closed_loop(unit: str) -> None:
    on = bench(unit)
    on.link.write(bytes((0x40, 0x06, 1, 2, 0x50, 1)))
    before = readable(on)
    report = run_on(on, PUTTING_BACK)
    assert not complaints(report)
    passed = {o.kind.name for o in report.outcomes if o.result is Result.PASS}
    assert {"piezo-position", "piezo-mode", "enable"} <= passed
    assert readable(on) == before


def test_zeroing_restores_everything_but_the_zero() -> None:
    on = bench("BPC301")
    on.link.write(bytes.fromhex("4306 0400 d001 0100 0010"))
    bits = "PZ_REQ_PZSTATUSBITS"
    before = readable(on, leave_out=(bits,))
    assert not complaints(run_on(on, ("piezo-zero",)))
    assert readable(on, leave_out=(bits,)) == before


def test_a_motor_returns_to_its_position_although_its_counter_changed() -> None:
    on = bench("TDC001", "Z8", travel=34304 * 25)
    report = run_on(on, ("home",))
    assert not complaints(report)
    assert on.behaviour().position()["position"] == pytest.approx(34304 * 5, abs=4000)


@pytest.mark.parametrize(
    ("unit", "quirk"),
    every_nth(product(("TDC001", "BBD103", "BSC002", "BPC301", "TSC001"), QUIRKS), 6),
)
def test_known_behaviour_of_real_controllers_is_at_most_non_strict(unit: str, quirk: str) -> None:
    on = bench(unit, quirks={quirk})
    assert Result.FAIL not in {outcome.result for outcome in run_on(on, EVERY).outcomes}


@pytest.mark.parametrize(
    ("unit", "stage", "backlash"),
    every_nth(
        [
            (unit, stage, backlash)
            for backlash in (0, 300, -300)
            for unit, stage in (
                ("TDC001", "Z8"),
                ("TDC001", None),
                ("BSC103", "APT_STEPPER"),
                ("MST601", None),
            )
        ],
        5,
    ),
)
def test_a_counter_that_decreases_clockwise_is_not_a_fault(
    unit: str, stage: str | None, backlash: int
) -> None:
    """The document does not define the direction; limit switches and motion bits follow it."""
    on = bench(unit, stage, quirks={"clockwise_is_negative"})
    for place in on.declared.places:
        for channel in place.channels:
            backlash_parameters = bytes((0x3A, 0x04, 6, 0, place.address | 0x80, 1, channel, 0))
            on.link.write(backlash_parameters + backlash.to_bytes(4, "little", signed=True))
    before = readable(on)
    report = run_on(on, PUTTING_BACK)
    assert not complaints(report)
    assert readable(on) == before
    later = run_on(on, (*GIVING_UP, "limits"))
    assert not complaints(later)
    outcomes = [*report.outcomes, *later.outcomes]
    passed = {outcome.kind.name for outcome in outcomes if outcome.result is Result.PASS}
    assert {"move-jog", "move-velocity", "move-absolute", "home"} <= passed
    assert ("limits" in passed) == (stage is not None)


@pytest.mark.parametrize("unit", ["TDC001", "BSC002", "BPC301", "TSC001"])
def test_an_address_of_zero_is_non_strict_if_it_is_unambiguous(unit: str) -> None:
    on = bench(unit, quirks={"zero_addresses"})
    results = {outcome.result for outcome in run_on(on, EVERY).outcomes}
    assert Result.NON_STRICT in results
    assert Result.FAIL not in results


@pytest.mark.parametrize(
    ("unit", "fault"), every_nth(product(("TDC001", "BBD102", "BPC103", "TSC001"), FAULTS), 10)
)
def test_on_a_bad_line_every_check_finishes(unit: str, fault: str) -> None:
    on = bench(unit, faults=[fault])
    report = run_on(on, EVERY)
    assert len(report.outcomes) + len(report.not_run) > 5


def taken_back() -> Iterator[tuple[str, str]]:
    """Yield units, each with a message that a PICS may list as unsupported."""
    for unit in ("TDC001", "MST601", "BPC103", "TSC001"):
        names = [name for name in UNITS[unit]["messages"] if not name.startswith("HW_")]
        for name in names[:: max(1, len(names) // 12)]:
            yield unit, name


@pytest.mark.parametrize(("unit", "name"), every_nth(taken_back(), 6))
def test_unsupported_messages_are_skipped_and_not_sent(unit: str, name: str) -> None:
    on = bench(unit)
    on.declared = declare(replace(on.declared.pics, unsupported={name: "not fitted"}))
    report = run_on(on, EVERY)
    id = on.declared.registry.messages[name]["id"].to_bytes(2, "little")
    sent = [
        outcome.check.id
        for outcome in report.outcomes
        for entry in outcome.entries
        if entry.sent and entry.raw[:2] == id
    ]
    assert not sent
    for outcome in report.outcomes:
        if outcome.result is Result.SKIP:
            assert name in outcome.findings[0].text


def test_an_undocumented_value_is_reported_and_restored() -> None:
    on = bench("BPC301")
    link = faulty_link(on, LinkFault(to_host=of("PZ_GET_OUTPUTLUTPARAMS", byte(12, 0))))
    found = complaints(run_on(on, ("readback",), link=link))
    assert list(found) == ["readback/0x50/PZ_SET_OUTPUTLUTPARAMS/1"]
    assert "num_cycles is 0; the document allows 1 to 2147483647" in found[next(iter(found))]


def test_a_voltage_outside_its_range_is_reported_and_never_written() -> None:
    on = bench("KIM101")
    low, high = byte(10, 0x4C), byte(11, 0x04)  # 1100 V
    spoil = LinkFault(to_host=of("PZMOT_GET_DRIVEOPPARAMS", lambda raw: low(high(raw))))
    report = run_on(on, ("readback",), link=faulty_link(on, spoil))
    name = "readback/0x50/PZMOT_SET_DRIVEOPPARAMS"
    [first, *_] = complaints(report).values()
    assert "max_voltage is 1100; the document allows 85 to 125" in first
    assert "are not safe to write back" in first
    assert set(complaints(report)) <= {f"{name}/{channel}" for channel in (1, 2, 3, 4)}
    sub_message = b"\xc0\x08", b"\x07\x00"
    sent = [entry.raw for outcome in report.outcomes for entry in outcome.entries if entry.sent]
    assert not [raw for raw in sent if (raw[:2], raw[6:8]) == sub_message]


def test_ids_do_not_depend_on_permissions() -> None:
    for unit in UNITS:
        on = bench(unit)
        ids = [
            [check.id for check in plan(on.declared, allowed)]
            for allowed in (
                Permissions(),
                on.allowed(),
                Permissions(motion=Range.parse("5..6V")),
                Permissions(motion=Range.parse("1..2mm"), settings=True),
            )
        ]
        assert all(each == ids[0] for each in ids)


def test_every_check_with_needs_describes_its_actions() -> None:
    for unit, stage in [*BARE, *FITTED]:
        on = bench(unit, stage)
        for check in plan(on.declared, on.allowed()):
            assert bool(check.does) == bool(check.needs), check.id


def test_a_range_without_a_scale_is_reported_and_nothing_runs() -> None:
    on = bench("TDC001")
    report = run_on(on, EVERY, allowed=Permissions(motion=Range.parse("0..1mm"), settings=True))
    not_run = {check.kind.name: why for check, why in report.not_run if check.kind}
    assert set(MOVES) - {"move-alone"} <= set(not_run)
    assert "the number of counts per mm is not known" in not_run["move-absolute"]


def test_voltages_and_positions_of_piezos_have_separate_ranges() -> None:
    for motion, runs, lacks in (
        (
            "0..20V",
            {"piezo-volts", "piezo-lut", "piezo-limit", "piezo-zero", "enable"},
            {"piezo-position"},
        ),
        (
            "0..5um",
            {"piezo-position"},
            {"piezo-volts", "piezo-lut", "piezo-limit", "piezo-zero", "enable"},
        ),
    ):
        on = bench("BPC001")
        allowed = Permissions(motion=Range.parse(motion), settings=True, **ALL_HAZARDS)
        report = run_on(on, OUTPUTS, allowed=allowed)
        assert not complaints(report)
        passed = {o.kind.name for o in report.outcomes if o.result is Result.PASS}
        assert runs <= passed
        assert lacks == {check.kind.name for check, _ in report.not_run if check.kind}
