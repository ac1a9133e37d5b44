"""Checks of Thorlabs APT that only send requests: virtual controllers pass, and every defect is found."""

from __future__ import annotations

import itertools
import random
from collections.abc import Sequence

import pytest
from broken_apt import BROKEN, ENABLED
from declared_rules import wrongly_named
from faulty_apt_link import FaultyAptLink, LinkFault, dropped, frame, name_of, of, plus
from watched_links import WatchedLink, controller_of, declared_as

import stagewire_virtual
from parts import every_nth
from stagewire_apt import PROTOCOL
from stagewire_conformance.device.declaration import Declaration, declare
from stagewire_conformance.device.permissions import Permissions
from stagewire_conformance.device.pics import BayPics, Pics, Timing
from stagewire_conformance.device.plans import plan
from stagewire_conformance.device.report import Outcome
from stagewire_conformance.device.results import Result
from stagewire_conformance.device.run import run
from stagewire_virtual import VirtualController
from stagewire_virtual.factory import simulated_units
from stagewire_virtual.linking import SteppedLink

UNITS = [
    entry["name"] for entry in PROTOCOL.registry()["units"] if entry["name"] in simulated_units()
]
READING = (
    "quiet", "identification", "bays", "frames", "answers", "status", "identify", "back-to-back", "timing",
    "unknown-id", "wrong-length", "foreign-destination", "truncated", "garbage", "updates", "keep-alive",
    "keep-alive-reply", "enabled-bit",
)  # fmt: skip
NOTHING = Permissions()
PATIENT = tuple(name for name in READING if name != "updates")  # without the twenty seconds


def outcomes(
    link: WatchedLink | SteppedLink | FaultyAptLink,
    declared: Declaration,
    only: Sequence[str] = READING,
    allowed: Permissions = NOTHING,
    seed: int = 1,
) -> list[Outcome]:
    checks = [
        check
        for check in plan(declared, allowed)
        if check.kind and (check.kind.name in only or check.id in only)
    ]
    report = run(link, checks, declared, allowed, seed)
    assert not report.unfinished, report.unfinished
    return list(report.outcomes)


def words_of(outcome: Outcome) -> str:
    return "; ".join(f"{finding.result}: {finding.text}" for finding in outcome.findings)


def complaints(found: Sequence[Outcome]) -> dict[str, str]:
    """Return the problems that were found, by check."""
    return {
        outcome.check.id: words_of(outcome)
        for outcome in found
        if outcome.result in (Result.FAIL, Result.NON_STRICT)
    }


@pytest.mark.parametrize("unit", [*UNITS, "RACK"])
def test_a_virtual_controller_passes(unit: str) -> None:
    declared = declared_as(unit)
    found = outcomes(SteppedLink(controller_of(unit)), declared)
    assert not complaints(found)
    undecided = {outcome.check.kind for outcome in found if outcome.result is not Result.PASS}
    assert {kind.name for kind in undecided if kind} == {"timing"}  # nothing is promised
    kinds = {outcome.kind.name for outcome in found}
    expected = {*READING} - {"bays", "keep-alive", "keep-alive-reply", "enabled-bit"}
    if not any(place.status for place in declared.places):  # flippers have no status message
        expected -= {"status", "updates"}
    if unit in ("KIM101", "TIM101"):  # one status for all channels
        expected -= {"status"}
    assert kinds >= expected


@pytest.mark.matrix
@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("unit", ["TDC001", "BBD103", "MPZ601"])
def test_other_seeds_pass(unit: str, seed: int) -> None:
    found = outcomes(SteppedLink(controller_of(unit)), declared_as(unit), PATIENT, seed=seed)
    assert not complaints(found)


def test_only_requests_are_sent() -> None:
    for unit in ("BBD102", "BPC301", "TSC001"):
        link = WatchedLink(SteppedLink(controller_of(unit)))
        outcomes(link, declared_as(unit))
        entries = {entry["id"]: entry for entry in PROTOCOL.registry()["messages"]}
        sent = {int.from_bytes(raw[:2], "little") for raw in link.writes if len(raw) >= 6}
        effects = {entries[id]["effect"] for id in sent if id in entries}
        assert effects == {"none", "stream"}


def test_nothing_is_sent_to_a_declared_empty_bay() -> None:
    controller = stagewire_virtual.BSC103(empty_bays={2})
    bays = (BayPics(number=1), BayPics(number=3))
    found = outcomes(SteppedLink(controller), declare(Pics(unit="BSC103", bays=bays)), PATIENT)
    assert not complaints(found)
    assert not any("0x22" in outcome.check.id for outcome in found)


def test_on_rs232_no_keep_alive_is_sent() -> None:
    controller = stagewire_virtual.TDC001(line="rs232")
    found = outcomes(SteppedLink(controller), declare(Pics(unit="TDC001", line="rs232")))
    assert not complaints(found)
    assert "keep-alive" not in {outcome.kind.name for outcome in found}


def test_unsupported_messages_are_skipped_with_their_reason() -> None:
    pics = Pics(
        unit="TDC001",
        unsupported={
            "MOT_REQ_POTPARAMS": "no potentiometer",
            "HW_START_UPDATEMSGS": "none",
            "MOT_REQ_DCSTATUSUPDATE": "none, either",
        },
    )
    found = outcomes(SteppedLink(controller_of("TDC001")), declare(pics))
    assert not complaints(found)
    skipped = {each.check.id: words_of(each) for each in found if each.result is Result.SKIP}
    assert "no potentiometer" in skipped["answers/0x50/MOT_REQ_POTPARAMS/1"]
    assert {"status/0x50/1", "updates/start-stop", "updates/rate", "keep-alive"} < set(skipped)


@pytest.mark.parametrize(
    ("unit", "quirk", "where"),
    [
        ("TDC001", "long_status", "answers/0x50/MOT_REQ_DCSTATUSUPDATE/1"),
        ("TDC001", "zero_addresses", "identification/0x50"),
        ("BSC001", "zero_addresses", "identification/0x50"),
        ("BBD102", "unswapped_addresses", "identification/0x11"),
        ("TDC001", "serial_number_of_another_model", "identification/0x50"),
    ],
)
def test_known_behaviour_of_real_controllers_is_not_a_failure(
    unit: str, quirk: str, where: str
) -> None:
    controller: VirtualController = getattr(stagewire_virtual, unit)(quirks=[quirk])
    found = complaints(outcomes(SteppedLink(controller), declare(unit)))
    assert where in found
    assert not [words for words in found.values() if "FAIL" in words]


def test_the_longer_status_of_steppers_is_documented() -> None:
    """Issue 37 has it on page 123. It has no longer status of DC servo controllers."""
    controller = stagewire_virtual.BMS002(quirks=["long_status"])
    found = outcomes(SteppedLink(controller), declare("BMS002"))
    lengths = {
        len(entry.raw) for each in found for entry in each.entries if entry.raw[:2] == b"\x81\x04"
    }
    assert lengths == {6 + 28}
    assert not complaints(found)


@pytest.mark.parametrize("unit", ["TDC001", "BBD102"])
def test_error_messages_after_invalid_frames_are_not_a_failure(unit: str) -> None:
    controller: VirtualController = getattr(stagewire_virtual, unit)(answer_unsupported=True)
    found = outcomes(SteppedLink(controller), declare(unit), PATIENT)
    assert not complaints(found)
    unknown = next(each for each in found if each.check.id == "unknown-id/header")
    assert "HW_RESPONSE" in words_of(unknown) or unit == "BBD102"


@pytest.mark.parametrize("seed", every_nth(range(4), 4))
def test_a_servo_loop_that_dithers_by_some_counts_is_not_a_failure(seed: int) -> None:
    chance = random.Random(seed)

    def dithering(raw: bytes) -> bytes:
        return plus(8, chance.choice((0, 0, 1, 1, 2, 3)))(raw)

    names = ("MOT_GET_DCSTATUSUPDATE", "MOT_GET_POSCOUNTER", "MOT_GET_ENCCOUNTER")
    link = FaultyAptLink(SteppedLink(controller_of("BBD102")), LinkFault(of(names, dithering)))
    assert not complaints(outcomes(link, declare("BBD102"), ["status", "answers"]))


def test_updates_that_were_left_on_are_stopped() -> None:
    link = SteppedLink(controller_of("BBD102"))
    link.write(frame("HW_START_UPDATEMSGS", dest=0x22, source=1))
    (quiet,) = outcomes(link, declare("BBD102"), ["quiet"])
    assert quiet.result is Result.PASS
    assert "were stopped" in words_of(quiet)


def test_a_channel_without_updates_is_undecided() -> None:
    """Page 77 and others: the channel of a status message is always channel 1."""

    def of_channel_one(raw: bytes) -> bytes:
        return b"" if name_of(raw) == "PZ_GET_PZSTATUSUPDATE" and raw[6] == 2 else raw

    link = FaultyAptLink(SteppedLink(controller_of("BPC002")), LinkFault(of_channel_one))
    found = outcomes(link, declare("BPC002"))
    assert not complaints(found)
    results = {outcome.check.id: outcome.result for outcome in found}
    assert results["status/0x50/2"] is Result.INFO
    assert results["status/0x50/1"] is results["updates/start-stop"] is Result.PASS


@pytest.mark.parametrize("what", BROKEN)
def test_a_broken_rule_is_found_and_named(what: str) -> None:
    unit, spoil, where, result, words = BROKEN[what]
    declared = declare(Pics(unit=unit, timing=Timing(reply_p99_ms=10)))
    link = FaultyAptLink(SteppedLink(controller_of(unit)), spoil)
    (outcome,) = outcomes(link, declared, [where], Permissions(settings=True))
    assert outcome.result is result, words_of(outcome)
    assert words in words_of(outcome)
    assert not wrongly_named("thorlabs_apt", [outcome])


def test_every_kind_fails_for_some_defect() -> None:
    failed = {broken.where.split("/")[0] for broken in BROKEN.values()}
    assert failed == {*READING} - {"quiet"}  # it has separate tests


def test_unsolicited_messages_are_found() -> None:
    """Unsolicited messages arrive from time to time."""

    class Talkative(SteppedLink):
        def read(self, timeout: float) -> bytes:
            return super().read(timeout) or (frame(ENABLED, 1, 1) if timeout > 0.2 else b"")

    (quiet,) = outcomes(Talkative(controller_of("TDC001")), declare("TDC001"), ["quiet"])
    assert quiet.result is Result.FAIL
    assert "without any request, the controller sent MOD_GET_CHANENABLESTATE" in words_of(quiet)


def test_updates_that_do_not_end_are_found() -> None:
    stepped = SteppedLink(controller_of("BBD102"))
    stepped.write(frame("HW_START_UPDATEMSGS", dest=0x22, source=1))
    link = FaultyAptLink(stepped, LinkFault(to_controller=of("HW_STOP_UPDATEMSGS", dropped)))
    (quiet,) = outcomes(link, declare("BBD102"), ["quiet"])
    assert quiet.result is Result.FAIL
    assert "after they were stopped; the first was MOT_GET_DCSTATUSUPDATE" in words_of(quiet)


def test_a_controller_that_never_falls_silent_is_found() -> None:
    controller = stagewire_virtual.TDC001(line="rs232")
    (outcome,) = outcomes(SteppedLink(controller), declare("TDC001"), ["keep-alive"])
    assert outcome.result is Result.FAIL
    assert "after the last MOT_ACK_DCSTATUSUPDATE and did not stop" in words_of(outcome)


def test_a_unit_whose_printed_lists_omit_the_keep_alive_may_do_without() -> None:
    """Page 13 of Issue 37 lists no MOT_ACK_DCSTATUSUPDATE for the KST101; page 9 does for the KDC101."""
    for unit, result in (("KST101", Result.INFO), ("KDC101", Result.FAIL)):
        controller = getattr(stagewire_virtual, unit)(line="rs232")
        (outcome,) = outcomes(SteppedLink(controller), declare(unit), ["keep-alive"])
        assert outcome.result is result
        assert ("lists of the messages" in words_of(outcome)) == (unit == "KST101")


def test_rare_updates_are_not_mistaken_for_silence() -> None:
    """Updates arrive once per second; fifty of them take longer than the check waits."""
    numbers = itertools.count(1)
    seldom = of("MOT_GET_DCSTATUSUPDATE", lambda raw: raw if next(numbers) % 10 == 0 else b"")
    controller = stagewire_virtual.TDC001(line="rs232")
    link = FaultyAptLink(SteppedLink(controller), LinkFault(seldom))
    (outcome,) = outcomes(link, declare("TDC001"), ["keep-alive"])
    assert outcome.result is Result.INFO
    assert "too rarely to show" in words_of(outcome)


def test_bays_counted_from_one_as_printed_are_non_strict() -> None:
    """The table of page 23 counts from 1, its example from 0."""

    def one_more(raw: bytes) -> bytes:
        return plus(2, 1)(raw) if name_of(raw) == "RACK_GET_BAYUSED" else raw

    def one_less(raw: bytes) -> bytes:
        is_request = name_of(raw) == "RACK_REQ_BAYUSED"
        return (b"" if raw[2] == 0 else plus(2, 255)(raw)) if is_request else raw

    link = FaultyAptLink(SteppedLink(controller_of("BSC103")), LinkFault(one_more, one_less))
    (outcome,) = outcomes(link, declare("BSC103"), ["bays/used"])
    assert outcome.result is Result.NON_STRICT
    assert "numbers the first bay 1" in words_of(outcome)


def test_a_controller_locked_by_damage_does_not_fail_the_next_check() -> None:
    """The controller waits for the rest of a header, which zeros complete."""
    rest = [0]

    def waiting(raw: bytes) -> bytes:
        if len(raw) < 6:
            rest[0] = (rest[0] + len(raw)) % 6
            return b""
        return b"" if rest[0] else raw

    link = FaultyAptLink(SteppedLink(controller_of("TDC001")), LinkFault(to_controller=waiting))
    found = outcomes(link, declare("TDC001"), ["truncated/header", "foreign-destination"])
    results = {outcome.check.id: outcome.result for outcome in found}
    assert results.pop("truncated/header") is Result.FRAGILE
    assert set(results.values()) == {Result.PASS}


def test_a_setting_from_an_incomplete_message_is_restored() -> None:
    broken = BROKEN["an incomplete setting that is accepted"]
    controller = controller_of(broken.unit)
    before = dict(controller.instrument.channel(1).parameters)
    outcomes(
        FaultyAptLink(SteppedLink(controller), broken.spoil),
        declare(broken.unit),
        [broken.where],
        Permissions(settings=True),
    )
    assert dict(controller.instrument.channel(1).parameters) == before


def test_a_promised_reply_time_is_kept_or_undecided() -> None:
    pics = Pics(unit="TDC001", timing=Timing(reply_p99_ms=10))
    (timing,) = outcomes(SteppedLink(controller_of("TDC001")), declare(pics), ["timing"])
    assert timing.result is Result.PASS
    assert timing.figures == {"p50_ms": 0.0, "p99_ms": 0.0, "jitter_ms": 0.0}

    class Sleepy(SteppedLink):
        def read(self, timeout: float) -> bytes:
            return super().read(timeout + 0.003 if 0 < timeout < 0.01 else timeout)

    (timing,) = outcomes(Sleepy(controller_of("TDC001")), declare(pics), ["timing"])
    assert timing.result is Result.INFO
    assert "too late to judge" in words_of(timing)
