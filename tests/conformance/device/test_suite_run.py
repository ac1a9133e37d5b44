"""Runs: first contact, order, selection, checks that are not run, and the contents of a report."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime, timedelta

import pytest
from watched_links import ALL, DeadLink, WatchedLink, declared_as, made, run_made

import stagewire_virtual
from stagewire.errors import StagewireError
from stagewire_apt import messages as m
from stagewire_conformance.device.declaration import declare, known_units
from stagewire_conformance.device.errors import NothingAnswersError, NothingToRunError
from stagewire_conformance.device.permissions import Need, Permissions, Range
from stagewire_conformance.device.plans import plan
from stagewire_conformance.device.results import Result, worst
from stagewire_conformance.device.run import run
from stagewire_conformance.device.trial import Trial
from stagewire_virtual.factory import simulated_units
from stagewire_virtual.linking import SteppedLink

UNITS = sorted({*known_units()} & {*simulated_units()})


def link_to(unit: str = "TDC001", **options: object) -> WatchedLink:
    return WatchedLink(SteppedLink(getattr(stagewire_virtual, unit)(**options)))


# First contact


@pytest.mark.parametrize("unit", UNITS)
def test_a_dead_port_is_reported_within_four_seconds_of_line_time(unit: str) -> None:
    link = DeadLink()
    with pytest.raises(NothingAnswersError) as caught:
        run(link, [], declared_as(unit), ALL, seed=1)
    assert link.now < 4
    assert f"no answer at {link.url}" in str(caught.value)
    assert "switched on" in str(caught.value)


def test_garbage_is_reported_as_garbage() -> None:
    link = DeadLink(says=b"\x91\x00\xff" * 20)
    with pytest.raises(NothingAnswersError, match="60 bytes arrived that are not a message"):
        run(link, [], declare("TDC001"), ALL, seed=1)
    assert link.now < 4


def test_a_controller_without_identity_is_checked() -> None:
    link = link_to(faults=["to_host drop frame message=HW_GET_INFO"])
    report = run_made(link, lambda trial: None)
    assert report.identification == {}
    assert [outcome.result for outcome in report.outcomes] == [Result.PASS]


def test_a_lost_identity_is_requested_again() -> None:
    report = run_made(
        link_to(faults=["to_host drop frame message=HW_GET_INFO at=1"]), lambda trial: None
    )
    assert report.identification["model_number"] == "TDC001"


def test_first_contact_only_sends_requests() -> None:
    link = link_to()
    run_made(link)
    ids = [int.from_bytes(data[:2], "little") for data in link.writes]
    assert set(ids) == {m.HwReqInfo.layout.id, m.MotAckDcStatusUpdate.layout.id}


# Results of checks


def test_the_worst_finding_decides() -> None:
    def mixed(trial: Trial) -> None:
        assert trial.must(True, "no")
        assert not trial.should(False, "that is advised")
        trial.info("just so", p99_ms=3.2)
        assert not trial.must(False, "that is a must", wanted=b"\x01", came=b"\x02")

    [outcome] = run_made(link_to(), mixed).outcomes
    assert outcome.result is Result.FAIL
    assert [finding.result for finding in outcome.findings] == ["NON-STRICT", "PASS", "FAIL"]
    assert (outcome.findings[2].wanted, outcome.findings[2].came) == (b"\x01", b"\x02")
    assert outcome.figures == {"p99_ms": 3.2}


@pytest.mark.parametrize(
    ("body", "result"),
    [
        (lambda trial: None, Result.PASS),
        (lambda trial: trial.info("a figure", ms=1.0), Result.PASS),
        (lambda trial: trial.inconclusive("this computer is late"), Result.INFO),
        (lambda trial: trial.should(False, "advised"), Result.NON_STRICT),
        (lambda trial: trial.must(False, "stated"), Result.FAIL),
    ],
)
def test_the_result_of_a_check_for_each_finding(body: object, result: Result) -> None:
    [outcome] = run_made(link_to(), body).outcomes
    assert outcome.result is result


def test_the_order_of_results_by_severity() -> None:
    order = [Result.PASS, Result.SKIP, Result.INFO, Result.NON_STRICT, Result.FAIL]
    for index, result in enumerate(order):
        assert worst([*order[:index], result, *order[:index]]) is result
    assert worst([]) is Result.PASS


def test_an_unanswered_request_fails_and_ends_the_check() -> None:
    went_on = []

    def asks(trial: Trial) -> None:
        trial.reply(m.MotReqVelParams(1), 0x50)
        went_on.append(True)

    report = run_made(link_to(faults=["to_host drop frame message=MOT_GET_VELPARAMS"]), asks)
    [outcome] = report.outcomes
    assert outcome.result is Result.FAIL
    [finding] = outcome.findings
    assert finding.text == (
        "MOT_REQ_VELPARAMS to 0x50 was not answered by MOT_GET_VELPARAMS within 1 s"
    )
    assert not went_on
    assert not report.unfinished


def test_messages_after_a_check_are_noted_with_it() -> None:
    def leaves_updates(trial: Trial) -> None:
        trial.line.send(m.HwStartUpdateMsgs(10), 0x50)
        trial.line.listen(0.15)
        trial.line.send(m.HwReqInfo(), 0x50)

    [outcome] = run_made(link_to(), leaves_updates).outcomes
    assert outcome.result is Result.PASS
    assert any(
        "received after the check, unsolicited" in finding.text for finding in outcome.findings
    )
    assert any("HW_GET_INFO" in finding.text for finding in outcome.findings)


# Checks that run or do not run


def test_a_forbidden_check_is_not_run_and_states_its_needs() -> None:
    ran = []
    checks = [
        made(lambda trial: ran.append("reads"), "reads"),
        made(lambda trial: ran.append("sets"), "sets", needs=frozenset({Need.SETTINGS})),
        made(
            lambda trial: ran.append("moves"),
            "moves",
            needs=frozenset({Need.MOTION, Need.SETTINGS}),
        ),
        made(lambda trial: ran.append("saves"), "saves", needs=frozenset({Need.EEPROM})),
        made(lambda trial: ran.append("lacks"), "lacks", lacks="homing goes to 0"),
    ]
    report = run_made(link_to(), *checks, allowed=Permissions(settings=True))
    assert ran == ["reads", "sets"]
    assert [why for _, why in report.not_run] == [
        "not allowed: needs --allow-motion MIN..MAX",
        "not allowed: needs --allow-eeprom",
        "homing goes to 0",
    ]
    [check, _, _] = [check for check, _ in report.not_run]
    assert check.refusal(Permissions()) == (
        "not allowed: needs --allow-settings and --allow-motion MIN..MAX"
    )


def test_a_check_skipped_by_the_pics_is_not_run() -> None:
    ran = []
    skipped = made(lambda trial: ran.append(1), needs=frozenset({Need.EEPROM}), skip="not fitted")
    report = run_made(link_to(), skipped, allowed=Permissions())
    [outcome] = report.outcomes
    assert report.not_run == ()
    assert (outcome.result, ran) == (Result.SKIP, [])
    assert [finding.text for finding in outcome.findings] == ["not fitted"]


def test_progress_is_reported_for_checks_that_run() -> None:
    heard = []
    checks = [
        made(lambda trial: None, "first"),
        made(lambda trial: None, "second", needs=frozenset({Need.EEPROM})),
        made(lambda trial: None, "skipped", skip="not fitted"),
        made(lambda trial: None, "third"),
    ]
    run(
        link_to(),
        checks,
        declare("TDC001"),
        Permissions(),
        1,
        lambda check, before, total: heard.append((check.id, before, total)),
    )
    assert heard == [("first/one", 0, 2), ("third/one", 1, 2)]


@pytest.mark.parametrize("unit", ["TDC001", "BBD102", "MS2000"])
def test_a_single_check_is_repeated_byte_for_byte_with_its_seed(unit: str) -> None:
    declared = declare(unit)
    checks = plan(declared, Permissions())

    def sent(chosen: list, seed: int) -> dict[str, list[bytes]]:
        report = run(link_to(unit), chosen, declared, Permissions(), seed)
        return {
            outcome.check.id: [
                entry.raw for entry in outcome.entries if entry.sent and not entry.keep_alive
            ]
            for outcome in report.outcomes
        }

    whole = sent(checks, 5)
    assert whole == sent(checks, 5)
    assert whole != sent(checks, 6)
    for check in [check for check in checks if check.id in whole][::4]:
        assert sent([check], 5)[check.id] == whole[check.id], check.id


# Selection


@pytest.mark.parametrize("unit", UNITS)
def test_the_ids_of_a_plan_do_not_depend_on_permissions(unit: str) -> None:
    declared = declared_as(unit)
    ids = [check.id for check in plan(declared, Permissions())]
    assert ids == [check.id for check in plan(declared, ALL)]
    assert len(set(ids)) == len(ids)
    for check in plan(declared, ALL):
        assert check.kind is not None
        assert check.id == check.kind.name or check.id.startswith(f"{check.kind.name}/")


def test_checks_are_selected_by_kind_message_and_pattern() -> None:
    declared = declare("TDC001")
    every = plan(declared, Permissions())

    def chosen(*only: str) -> set[str]:
        return {check.id for check in plan(declared, Permissions(), only=only)}

    of_kind = {check.id for check in every if check.kind and check.kind.name == "answers"}
    of_message = {check.id for check in every if "MOT_REQ_VELPARAMS" in check.messages}
    assert chosen("answers") == of_kind
    assert chosen("mot_req_velparams") == of_message
    assert chosen("answers/*/MOT_REQ_VELPARAMS/?") == {"answers/0x50/MOT_REQ_VELPARAMS/1"}
    assert chosen("answers", "identification") == of_kind | chosen("identification")
    assert chosen("*") == {check.id for check in every}


@pytest.mark.parametrize(
    ("pattern", "hint"),
    [
        ("answer", "did you mean answers"),
        ("MOT_REQ_VELPARAM", "did you mean MOT_REQ_VELPARAMS"),
        ("zzz", "--list shows all checks"),
    ],
)
def test_a_selection_without_matches_is_refused_with_a_hint(pattern: str, hint: str) -> None:
    with pytest.raises(NothingToRunError, match=f"no check of TDC001 matches {pattern}; {hint}"):
        plan(declare("TDC001"), ALL, only=["answers", pattern])


def test_an_unknown_unit_is_refused() -> None:
    with pytest.raises(StagewireError, match="unknown unit TDC002"):
        declare("TDC002")


# The report


def test_a_report_contains_the_inputs_of_the_run() -> None:
    before = datetime.now(UTC)
    report = run_made(link_to(), lambda trial: trial.line.listen(0.25), seed=42)
    assert report.url == "virtual://TDC001"
    assert report.seed == 42
    assert before <= report.started <= before + timedelta(minutes=1)
    assert {len(digest) for digest in report.digests.values()} == {64, 0}
    assert report.digests["pics"] == ""
    assert report.identification["model_number"] == "TDC001"
    assert report.jitter < 1e-6  # the clock of the line is never late
    [outcome] = report.outcomes
    assert outcome.seconds == pytest.approx(0.3)  # plus 50 ms until the line was quiet
    assert [entry.text for entry in outcome.entries] == ["0x01->0x50 MOT_ACK_DCSTATUSUPDATE"]
    assert outcome.entries[0].keep_alive


def test_entries_are_the_decoded_traffic_in_order() -> None:
    def asks(trial: Trial) -> None:
        trial.reply(m.MotReqVelParams(1), 0x50)
        trial.line.send_bytes(b"\x12\x34\x56", "three bytes")

    [outcome] = run_made(link_to(), asks).outcomes
    entries = [entry for entry in outcome.entries if not entry.keep_alive]
    assert [(entry.sent, entry.text) for entry in entries] == [
        (True, "0x01->0x50 MOT_REQ_VELPARAMS chan_ident=1"),
        (
            False,
            "0x50->0x01 MOT_GET_VELPARAMS chan_ident=1 min_velocity=0 acceleration=400000 "
            "max_velocity=200000",
        ),
        (True, "three bytes"),
    ]
    assert entries[2].raw == b"\x12\x34\x56"


def test_the_digest_of_the_pics_is_that_of_its_file() -> None:
    declared = declare("TDC001")
    declared = replace(declared, pics=replace(declared.pics, digest="ab" * 32))
    assert run_made(link_to(), declared=declared).digests["pics"] == "ab" * 32


# Ranges


@pytest.mark.parametrize(
    ("text", "scale", "counts"),
    [
        ("0..5mm", "Z8", (0, 171520)),
        ("0.5..1.5 mm", "Z8", (17152, 51456)),
        ("500..1500um", "Z8", (17152, 51456)),
        ("-0.0001..0.0001mm", "Z8", (-3, 3)),  # rounded towards zero from 3.43 counts
        ("7..9counts", "Z8", (7, 9)),
        ("7..9counts", None, (7, 9)),
    ],
)
def test_a_range_in_counts_lies_within_the_range_in_mm(
    text: str, scale: str | None, counts: tuple[int, int]
) -> None:
    from stagewire_apt import stages

    known = None if scale is None else getattr(stages, scale).scale("position", "TDC001")
    assert Range.parse(text).in_counts(known) == counts


def test_a_range_in_degrees_is_for_rotary_stages() -> None:
    from stagewire_apt import stages

    rotary = stages.K10CR1.scale("position", "K10CR1")  # 409600 counts per 3 degrees
    linear = stages.Z8.scale("position", "TDC001")
    assert Range.parse("-1.5..3deg").in_counts(rotary) == (-204_800, 409_600)
    with pytest.raises(StagewireError, match=r"0\.\.3mm cannot be converted to deg"):
        Range.parse("0..3mm").in_counts(rotary)
    with pytest.raises(StagewireError, match=r"0\.\.3deg cannot be converted to mm"):
        Range.parse("0..3deg").in_counts(linear)


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("5..0mm", "the first number must not exceed the second"),
        ("0..5", "expected a range with its unit"),
        ("0-5mm", "expected a range with its unit"),
        ("0..5miles", "unknown unit miles"),
        ("0..1.5counts", "counts must be integers"),
        ("", "expected a range with its unit"),
        ("0..1e5mm", "expected a range with its unit"),
        ("0..١mm", "expected a range with its unit"),
    ],
)
def test_an_invalid_range_is_refused_with_an_example(text: str, problem: str) -> None:
    with pytest.raises(StagewireError, match=problem):
        Range.parse(text)


@pytest.mark.parametrize(
    "text", ["0..5mm", "-8..8deg", "-1.5..1.5mm", "0..100000counts", "0.000001..2V"]
)
def test_a_range_is_written_as_it_is_read(text: str) -> None:
    assert str(Range.parse(text)) == text
