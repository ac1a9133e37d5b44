"""Ranges in millimetres use the scales of the controller that answers, not those of the declared unit."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import pytest
from apt_runs import MOVES, Bench, bench, readable, run_on
from faulty_apt_link import Change, FaultyAptLink, LinkFault, name_of, of, of_source
from test_suite_apt_range import MOVING, id_of
from watched_links import ALL, WatchedLink

import stagewire_virtual
from stagewire._devices.unit import Alias
from stagewire.devices import Facts
from stagewire_apt import messages as m
from stagewire_apt import stages
from stagewire_conformance.device.checks.apt.motion.pace import is_printed, velocity_scale
from stagewire_conformance.device.declaration import declare
from stagewire_conformance.device.permissions import Permissions, Range
from stagewire_conformance.device.pics import BayPics, ChannelPics, Pics
from stagewire_conformance.device.plans import plan
from stagewire_conformance.device.report import Report
from stagewire_conformance.device.results import Result
from stagewire_conformance.device.run import run
from stagewire_conformance.device.targets import RACK
from stagewire_conformance.reports.device_sheet import facts
from stagewire_virtual.linking import SteppedLink

MM_OF_TST001 = 25_600
MM_OF_KST101 = 409_600
TARGETED = ("move-absolute", "move-relative", "move-stored")


def on_bench(
    model: str = "KST101",
    serial_number: int = 26_000_001,
    *,
    travel: str | None = None,
    position: int = 0,
) -> Bench:
    """Return a controller with the messages of the TST001, declared as a TST001.

    The declaration has two aliases of the TST001: the KST101, and the KST901, whose scale is unknown.

    :param position: the value of its counter.
    """
    controller = stagewire_virtual.TST001(
        model=model,
        serial_number=serial_number,
        stage=stages.APT_STEPPER,
        travel=25 * MM_OF_KST101,
        position=10 * MM_OF_KST101,
    )
    fitted = ChannelPics(stage="APT_STEPPER", travel=Range.parse(travel) if travel else None)
    declared = declare(Pics(unit="TST001", channels=(fitted,)))
    on = Bench(controller, replace(declared, facts=with_aliases(declared.facts)), "2..5mm")
    on.link.write(bytes.fromhex("1004 0600 d001 0100") + position.to_bytes(4, "little"))
    return on


def with_aliases(known: Facts) -> Facts:
    """Return facts in which the KST101 and an invented unit are aliases of the TST001."""
    prefixes = known.units["KST101"].prefixes
    units = {name: unit for name, unit in known.units.items() if unit.prefixes != prefixes}
    newer = [Alias(name, "", "TST001", prefixes=prefixes) for name in ("KST101", "KST901")]
    return replace(known, units=units, aliases={alias.name: alias for alias in newer})


def of_model(model: bytes, source: int) -> Change:
    """Replace the model that an address reports."""
    return of_source(
        source, of("HW_GET_INFO", lambda raw: raw[:10] + model.ljust(8, b"\0") + raw[18:])
    )


def targets(writes: Iterable[bytes]) -> list[int]:
    """Return the targets of the absolute moves that were sent."""
    return [
        int.from_bytes(raw[8:12], "little", signed=True)
        for raw in writes
        if MOVING.get(id_of(raw)) == "MOT_MOVE_ABSOLUTE" and len(raw) > 6
    ]


def moving(writes: Iterable[bytes]) -> list[str]:
    return [MOVING[id_of(raw)] for raw in writes if id_of(raw) in MOVING]


def not_run(report: Report) -> dict[str, str]:
    return {check.id: why for check, why in report.not_run}


def test_a_range_uses_the_scale_of_the_reported_alias() -> None:
    on = on_bench(position=3 * MM_OF_KST101)
    before = readable(on)
    link = WatchedLink(on.link)
    report = run_on(on, TARGETED, link=link)
    assert {outcome.result for outcome in report.outcomes} == {Result.PASS}
    assert all(2 <= target / MM_OF_KST101 <= 5 for target in targets(link.writes))
    assert readable(on) == before
    [said] = [fact.value for fact in facts(report) if fact.key.startswith("place")]
    assert said == "TST001; identified as KST101; channel 1: APT_STEPPER"


def test_a_documented_unit_keeps_its_scale() -> None:
    on = on_bench("TST001", 80_000_001, position=3 * MM_OF_TST001)
    link = WatchedLink(on.link)
    report = run_on(on, TARGETED, link=link)
    assert {outcome.result for outcome in report.outcomes} == {Result.PASS}
    assert all(2 <= target / MM_OF_TST001 <= 5 for target in targets(link.writes))
    assert report.declared is on.declared


def test_a_rotary_stage_moves_within_a_range_in_degrees() -> None:
    on = bench("K10CR1")
    link = WatchedLink(on.link)
    report = run_on(on, TARGETED, link=link, allowed=on.allowed("0..6deg"))
    assert {outcome.result for outcome in report.outcomes} == {Result.PASS}
    assert targets(link.writes)
    assert all(0 <= target <= 2 * 409_600 for target in targets(link.writes))
    in_mm = run_on(on, TARGETED, allowed=on.allowed("0..6mm"))
    assert in_mm.outcomes == ()
    assert all("0..6mm cannot be converted to deg" in why for why in not_run(in_mm).values())


def test_a_declared_travel_uses_the_scale_of_the_alias() -> None:
    on = on_bench(travel="0..25mm")
    report = run_on(on, TARGETED)
    assert report.declared.places[0].travel_of(1) == (0, 25 * MM_OF_KST101)


@pytest.mark.parametrize(
    ("model", "serial_number", "who"),
    [
        ("KST901", 26_000_001, "APT_STEPPER on KST901"),
        ("", 26_000_001, "APT_STEPPER on KST101 or KST901"),
        ("TDC001", 99_000_001, "APT_STEPPER on a controller with the serial number 99000001 and"),
        ("TST001", 26_000_001, "APT_STEPPER on KST101 or KST901 or TST001"),
    ],
)
def test_without_a_scale_nothing_moves_and_the_reason_is_given(
    model: str, serial_number: int, who: str
) -> None:
    on = on_bench(model or "KST101", serial_number)
    line = on.link if model else FaultyAptLink(on.link, LinkFault(to_host=of_model(b"", 0x50)))
    link = WatchedLink(line)
    report = run_on(on, MOVES, link=link)
    assert report.outcomes == ()
    assert moving(link.writes) == []
    for why in not_run(report).values():
        assert who in why
        assert why.endswith("; allow counts, or give counts_per_mm in a PICS")


@pytest.mark.parametrize("unit", ["TST001", "KST101"])
def test_nothing_is_sent_to_a_stepper_that_is_another_unit(unit: str) -> None:
    """A KST101 that is declared as a TST001, and a TST001 as a KST101: their microsteps differ by 16."""
    models = {"TST001": ("KST101", 26_000_001), "KST101": ("TST001", 80_000_001)}
    model, serial_number = models[unit]
    on = on_bench(model, serial_number)
    on.declared = declare(Pics(unit=unit, channels=(ChannelPics(stage="APT_STEPPER"),)))
    link = WatchedLink(on.link)
    report = run(link, plan(on.declared, on.allowed()), on.declared, on.allowed(), seed=1)
    assert report.outcomes == ()
    assert report.unfinished == other_unit(model, serial_number, unit)
    asked = [raw for raw in link.writes if "_ACK_" not in name_of(raw)]  # without keep-alives
    assert asked == [m.HwReqInfo().pack(0x50, 1)]


@pytest.mark.parametrize("unit", ["KLS635", "KPZ101", "TDC001"])
def test_nothing_is_sent_to_another_unit_than_the_declared_one(unit: str) -> None:
    number = declare(unit).unit.prefixes[0] * 1_000_000 + 1
    controller = getattr(stagewire_virtual, unit)(serial_number=number)
    link = WatchedLink(SteppedLink(controller))
    report = run(link, plan(declare("KDC101"), ALL), declare("KDC101"), ALL, seed=1)
    assert report.outcomes == ()
    assert report.unfinished == other_unit(unit, number, "KDC101")
    asked = [raw for raw in link.writes if "_ACK_" not in name_of(raw)]  # without keep-alives
    assert asked == [m.HwReqInfo().pack(0x50, 1)]


def other_unit(model: str, number: int, declared: str) -> str:
    return (
        f"0x50: {model} answered (serial number {number}, model {model!r}) instead of the declared "
        f"{declared}; declare {model}"
    )


def test_a_range_in_counts_needs_no_scale() -> None:
    on = on_bench("KST901")
    report = run_on(on, TARGETED, allowed=on.allowed("0..500000counts"))
    assert {outcome.result for outcome in report.outcomes} == {Result.PASS}


def test_the_scale_of_the_pics_applies_to_every_controller() -> None:
    on = on_bench("KST901", position=3 * MM_OF_KST101)
    fitted = ChannelPics(counts_per_mm=MM_OF_KST101)
    on.declared = declare(Pics(unit="TST001", channels=(fitted,)))
    link = WatchedLink(on.link)
    report = run_on(on, TARGETED, link=link)
    assert {outcome.result for outcome in report.outcomes} == {Result.PASS}
    assert all(2 <= target / MM_OF_KST101 <= 5 for target in targets(link.writes))


def test_a_declared_travel_without_a_scale_ends_the_run_before_the_first_check() -> None:
    on = on_bench("KST901", travel="0..25mm")
    link = WatchedLink(on.link)
    report = run(link, plan(on.declared, on.allowed()), on.declared, on.allowed(), seed=1)
    assert report.unfinished == (
        "0x50: travel 0..25mm: the number of counts per mm is not known on KST901; give counts_per_mm, or "
        "the travel in counts, in the PICS"
    )
    assert report.outcomes == ()
    assert moving(link.writes) == []
    assert report.defect is None


@pytest.mark.parametrize("model", ["MST602", "MST699"])
def test_each_module_of_a_rack_is_identified(model: str) -> None:
    """The MST602 shares the prefix of the MST601, and has 16 times its microsteps; an MST699 is unknown."""
    rack = stagewire_virtual.rack("MST601", "MST601")
    bays = tuple(BayPics(number=number, unit="MST601") for number in (1, 2))
    fitted = tuple(
        ChannelPics(bay=bay, number=number, stage="APT_STEPPER")
        for bay in (1, 2)
        for number in (1, 2)
    )
    on = Bench(rack, declare(Pics(unit=RACK, bays=bays, channels=fitted)), "0..5mm")
    link = WatchedLink(FaultyAptLink(on.link, LinkFault(to_host=of_model(model.encode(), 0x22))))
    allowed = Permissions(motion=on.allowed().motion)
    checks = [each for each in plan(on.declared, allowed) if each.id.startswith("move-absolute")]
    report = run(link, checks, on.declared, allowed, seed=1)
    assert report.outcomes == ()
    assert moving(link.writes) == []
    if model == "MST602":
        assert report.unfinished.startswith("0x22: MST602 answered (serial number ")
        assert report.unfinished.endswith(" instead of the declared MST601; declare MST602")
        return
    assert not report.unfinished
    assert set(not_run(report).values()) == {
        "its motors are declared alike but report different controllers; give counts_per_mm of each in a "
        "PICS",
        "not allowed: needs --allow-settings",
    }


@pytest.mark.parametrize(
    ("unit", "stage", "printed"), [("BBD102", "MLS203", True), ("TDC001", "Z812", False)]
)
def test_only_a_scale_of_the_document_excludes_the_printed_unit(
    unit: str, stage: str, printed: bool
) -> None:
    place = bench(unit, stage).declared.places[-1]
    assert velocity_scale(place, 1) is not None
    assert is_printed(place, 1) is printed
