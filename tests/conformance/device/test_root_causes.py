"""One defect is one finding: later checks that meet it refer to the check that reports it."""

from __future__ import annotations

from collections.abc import Sequence
from random import Random

import pytest
from apt_runs import Bench, bench, run_on
from faulty_apt_link import Change, FaultyAptLink, LinkFault, byte, dropped, of, shorter, twice

from stagewire_conformance.device.causes import DELIVERY, EFFECT, Cause, Causes, Miss
from stagewire_conformance.device.declaration import declare
from stagewire_conformance.device.permissions import Permissions
from stagewire_conformance.device.plans import Plan, plan
from stagewire_conformance.device.report import Outcome, Report
from stagewire_conformance.device.results import Result
from stagewire_conformance.device.run import run
from stagewire_conformance.device.trial import Trial
from stagewire_conformance.reports import Grade, Omission
from stagewire_conformance.reports.device_sheet import missed, sheet_of
from stagewire_virtual.linking import SteppedLink

VEL, INFO, DC, COUNTER = (
    "MOT_GET_VELPARAMS",
    "HW_GET_INFO",
    "MOT_GET_DCSTATUSUPDATE",
    "MOT_GET_POSCOUNTER",
)
MESSAGES = (VEL, DC, COUNTER, "MOT_GET_JOGPARAMS", "MOD_GET_CHANENABLESTATE", "MOT_GET_STATUSBITS")


def a_byte_short(raw: bytes) -> bytes:
    """Lose the last byte, although the header announces it."""
    return raw[:-1]


def ten_bytes_more(raw: bytes) -> bytes:
    """Send ten more bytes than the header announces."""
    return raw + bytes(10)


def to_nobody(raw: bytes) -> bytes:
    """Send the message to the address 0x02."""
    return raw[:4] + bytes((raw[4] & 0x80 | 2,)) + raw[5:]


FAULTS: dict[str, Change] = {
    "a byte short": a_byte_short,
    "a byte short, announced": shorter,
    "to nobody": to_nobody,
    "from an undocumented address": byte(5, 0x33),
    "from a bay": byte(5, 0x22),
    "never sent": dropped,
}
# MOD_GET_CHANENABLESTATE has no packet that could be a byte short.
DAMAGED = [
    (fault, message)
    for fault in FAULTS
    for message in MESSAGES
    if (fault, message) != ("a byte short, announced", "MOD_GET_CHANENABLESTATE")
]


def whole_run(change: LinkFault, on: Bench | None = None) -> Report:
    on = bench("TDC001", "Z8") if on is None else on
    allowed = on.allowed()
    report = run(
        FaultyAptLink(on.link, change), plan(on.declared, allowed), on.declared, allowed, 1
    )
    assert not report.unfinished, report.unfinished
    return report


def of_result(report: Report, result: Result) -> list[Outcome]:
    return [outcome for outcome in report.outcomes if outcome.result is result]


def only_cause(report: Report, names: Sequence[str]) -> Outcome:
    """Return the only check that fails, after checking that all others that met its defect refer to it."""
    [cause] = of_result(report, Result.FAIL)
    assert any(name in finding.text for finding in cause.findings for name in names)
    dependent = of_result(report, Result.NOT_RUN)
    assert {id for outcome in dependent for id in outcome.met} <= {cause.check.id}
    return cause


@pytest.mark.parametrize(("fault", "message"), DAMAGED)
def test_one_damaged_message_is_one_failure(fault: str, message: str) -> None:
    report = whole_run(LinkFault(to_host=of(message, FAULTS[fault])))
    request = message.replace("_GET_", "_REQ_")
    cause = only_cause(report, (message, request))
    assert of_result(report, Result.NOT_RUN)
    [finding] = [each for each in cause.findings if each.result is Result.FAIL]
    assert finding.rule


UNRELATED = {
    "KIM101": ("PZMOT_GET_POSCOUNTERS", "PZMOT_GET_DRIVEOPPARAMS"),
    "KNA101": ("PZ_GET_NTGAINPARAMS", "KNA_GET_KCUBEMMIPARAMS"),
    "KPZ101": ("KPZ_GET_KCUBEMMIPARAMS", "PZ_GET_PICONSTS"),
    "PDXC2": ("PZMOT_GET_AMPOUTPARAMS",),
}
WRONG_LENGTHS = [(unit, message) for unit, messages in UNRELATED.items() for message in messages]


@pytest.mark.parametrize(("unit", "message"), WRONG_LENGTHS)
def test_settings_are_read_back_although_another_message_has_the_wrong_length(
    unit: str, message: str
) -> None:
    report = whole_run(LinkFault(to_host=of(message, shorter)), bench(unit))
    only_cause(report, (message, message.replace("_GET_", "_REQ_")))
    not_run = {
        outcome.check.id
        for outcome in of_result(report, Result.NOT_RUN)
        if outcome.kind.name in ("readback", "eeprom", "enable")
        and message not in outcome.check.messages
    }
    blind = {
        "readback/0x50/PZMOT_SET_KCUBECHANENABLEMODE",
        "readback/0x50/PZMOT_SET_KCUBETRIGIOCONFIG",
        *(f"enable/0x50/{channel}" for channel in (1, 2, 4, 8)),
    }
    assert not_run == (blind if message == "PZMOT_GET_POSCOUNTERS" else set())


def test_bytes_after_the_identity_name_no_other_message() -> None:
    report = whole_run(LinkFault(to_host=of(INFO, ten_bytes_more)))
    cause = only_cause(report, (INFO, "HW_REQ_INFO"))
    assert cause.check.id == "identification/0x50"


def test_another_defect_of_the_same_message_is_another_finding() -> None:
    both = of(VEL, lambda raw: byte(8, 1)(byte(6, 2)(raw)))  # another channel, and a start velocity
    report = run_on(
        on := bench("TDC001"), ("answers",), link=FaultyAptLink(on.link, LinkFault(to_host=both))
    )
    [failed] = of_result(report, Result.FAIL)
    assert [finding.rule for finding in failed.findings if finding.result is Result.FAIL] == [
        "motor-single-channel",
        "minimum-velocity-zero",
    ]


def test_two_defects_are_two_failures() -> None:
    def change(raw: bytes) -> bytes:
        return of(VEL, dropped)(of("MOT_GET_HOMEPARAMS", twice)(raw))

    report = whole_run(LinkFault(to_host=change))
    assert {outcome.check.id for outcome in of_result(report, Result.FAIL)} == {
        "answers/0x50/MOT_REQ_VELPARAMS/1",
        "answers/0x50/MOT_REQ_HOMEPARAMS/1",
    }


def test_a_report_names_the_root_cause_of_each_check_that_was_not_run() -> None:
    on = bench("TDC001", "Z8")
    report = whole_run(LinkFault(to_host=of(COUNTER, dropped)), on)
    checks = plan(on.declared, on.allowed())
    sheet = sheet_of(report, checks, 1.0, lambda id: id)
    [cause] = sheet.cases(Grade.FAILED)
    dependents = sheet.dependents(cause)
    assert dependents
    for case in dependents:
        assert case.grade is Grade.NOT_RUN
        assert case.omission is Omission.CAUSE
        assert case.why == f"root cause: {COUNTER} (delivery), reported by {cause.id}"
    assert Omission.CAUSE in {gap.omission for gap in sheet.gaps}
    assert not sheet.complete


def test_a_silent_bay_is_one_failure() -> None:
    on = bench("BBD102")
    report = whole_run(
        LinkFault(to_controller=lambda raw: b"" if raw[4:5] in (b"\x22", b"\xa2") else raw), on
    )
    failed = {outcome.check.id for outcome in of_result(report, Result.FAIL)}
    assert len(failed) == 1, failed


def test_a_cause_belongs_to_the_check_that_reports_it_first() -> None:
    causes, cause = Causes(), Cause(VEL, DELIVERY)
    assert causes.check_of(cause) == ""
    causes.report(cause, "frames/0x50")
    causes.report(cause, "answers/0x50")
    assert causes.check_of(cause) == "frames/0x50"
    assert str(cause) == "MOT_GET_VELPARAMS (delivery)"


def test_findings_about_robustness_are_not_part_of_the_verdict() -> None:
    locked = [False]

    def change(raw: bytes) -> bytes:
        locked[0] = locked[0] or len(raw) < 6
        return b"" if locked[0] else raw

    chosen = Plan.of("TDC001", Permissions(), only=["truncated/header"])
    link = FaultyAptLink(bench("TDC001").link, LinkFault(to_controller=change))
    declared = declare("TDC001")
    report = run(link, chosen.checks, declared, Permissions(), 1)
    [outcome] = report.outcomes
    assert outcome.result is Result.FRAGILE
    sheet = sheet_of(report, chosen.checks, 1.0, lambda id: id)
    assert [case.word for case in sheet.cases(Grade.FRAGILE)] == ["FRAGILE"]
    assert (str(sheet.verdict), sheet.exit_status) == ("PASSED", 0)


def test_a_controller_that_damage_silences_has_no_failures() -> None:
    """No sentence of the document demands that a controller recovers, so every bay counts as silent."""
    locked = [False]

    def change(raw: bytes) -> bytes:
        locked[0] = locked[0] or len(raw) < 6
        return b"" if locked[0] else raw

    report = whole_run(LinkFault(to_controller=change), bench("BBD102"))
    assert [outcome.check.id for outcome in of_result(report, Result.FRAGILE)] == [
        "truncated/header"
    ]
    assert not of_result(report, Result.FAIL)
    assert of_result(report, Result.NOT_RUN)


def test_a_correct_controller_meets_no_root_cause() -> None:
    on = bench("BBD102", "MLS203")
    report = whole_run(LinkFault(), on)
    assert not [outcome for outcome in report.outcomes if outcome.met]
    assert isinstance(on.link, SteppedLink)


def test_a_report_says_that_checks_with_a_permission_were_not_selected() -> None:
    on = bench("TDC001", "Z8")
    report = run_on(on, ("answers",))
    clauses = list(missed(report, plan(on.declared, on.allowed())))
    assert "no check that moves produced a result: none was selected" in clauses


def test_a_report_names_a_permission_that_no_check_of_the_unit_needs() -> None:
    on, allowed = bench("TDC001", "Z8"), Permissions(laser=True)
    report = run_on(on, ("answers",), allowed=allowed)
    clauses = list(missed(report, plan(on.declared, allowed)))
    assert clauses == ["allowed, but needed by no check of this run: laser"]


def every_third(change: Change) -> Change:
    """Apply a change to every third message."""
    count = [0]

    def change_some(raw: bytes) -> bytes:
        count[0] += 1
        return change(raw) if count[0] % 3 == 0 else raw

    return change_some


@pytest.mark.parametrize("message", [INFO, DC])
@pytest.mark.parametrize("change", [dropped, to_nobody], ids=["dropped", "to nobody"])
def test_a_reply_that_is_lost_now_and_then_is_one_failure(change: Change, message: str) -> None:
    report = whole_run(LinkFault(to_host=of(message, every_third(change))))
    [failed] = of_result(report, Result.FAIL)
    assert [each.result for each in failed.findings].count(Result.FAIL) == 1


def test_a_message_that_never_comes_is_reported_besides_one_that_is_lost_now_and_then() -> None:
    def change(raw: bytes) -> bytes:
        return of("MOT_GET_POTPARAMS", dropped)(seldom(raw))

    seldom = of("MOT_GET_DCPIDPARAMS", every_third(dropped))
    report = whole_run(LinkFault(to_host=change))
    texts = [
        finding.text
        for outcome in of_result(report, Result.FAIL)
        for finding in outcome.findings
        if finding.result is Result.FAIL
    ]
    assert len(texts) == 2
    for name in ("POTPARAMS", "DCPIDPARAMS"):
        assert any(name in text for text in texts), name


def test_two_fields_with_different_defects_are_two_findings() -> None:
    def change(raw: bytes) -> bytes:
        """Store the step size with its lower byte 0, and never store the acceleration."""
        return raw[:10] + b"\0" + raw[11:18] + (1048).to_bytes(4, "little") + raw[22:]

    on = bench("TDC001", "Z8")
    link = FaultyAptLink(on.link, LinkFault(to_controller=of("MOT_SET_JOGPARAMS", change)))
    report = run_on(on, ("readback",), link=link)
    [failed] = [
        outcome for outcome in of_result(report, Result.FAIL) if "JOGPARAMS" in outcome.check.id
    ]
    texts = [each.text for each in failed.findings if each.result is Result.FAIL]
    assert len(texts) == 2
    assert "jog_step_size" in texts[0]
    assert "jog_acceleration" in texts[1]


def trial_of(causes: Causes, check: str) -> Trial:
    on = bench("TDC001")
    return Trial(None, on.declared, Permissions(), Random(1), check=check, causes=causes)


def test_a_failure_is_a_new_finding_after_a_departure_with_the_same_cause() -> None:
    causes, cause = Causes(), Cause(VEL, "sign")
    first, second = trial_of(causes, "first"), trial_of(causes, "second")
    first.should(False, "no sign", cause=cause)
    second.must(False, "the wrong sign", cause=cause)
    assert (first.result, second.result) == (Result.NON_STRICT, Result.FAIL)
    third = trial_of(causes, "third")
    third.must(False, "the wrong sign again", cause=cause)
    assert (third.result, third.met) == (Result.NOT_RUN, {"second": str(cause)})


def test_in_one_check_a_failure_replaces_a_departure_with_the_same_cause() -> None:
    trial = trial_of(Causes(), "first")
    trial.should(False, "no sign", cause=Cause(VEL, "sign"))
    trial.must(False, "the wrong sign", cause=(Cause(VEL, "value"), Cause(VEL, "sign")))
    assert [finding.text for finding in trial.findings] == ["the wrong sign"]


def test_a_problem_with_unreliable_evidence_is_a_note() -> None:
    causes = Causes()
    trial_of(causes, "first").must(False, "a wrong position", cause=Cause(DC, "position"))
    trial = trial_of(causes, "second")
    trial.must(False, "too fast", because=[Cause(DC, "position")])
    assert trial.result is Result.NOT_RUN
    [note] = trial.findings
    assert note.text == f"too fast (follows from a defect that is reported: {DC} (position))"
    trial.must(False, "too slow", because=[Cause(DC, "velocity")])
    assert trial.result is Result.FAIL


def test_a_departure_explains_no_failure() -> None:
    causes = Causes()
    trial_of(causes, "first").should(False, "rounded", cause=Cause(VEL, EFFECT))
    trial = trial_of(causes, "second")
    trial.must(False, "not restored", because=[Cause(VEL, EFFECT)])
    assert trial.result is Result.FAIL


@pytest.mark.parametrize(
    ("one", "other", "alike"),
    [
        (Miss(200, -8576), Miss(200, -3000), True),  # both end 200 counts too high
        (Miss(200, -8576), Miss(-200, 3000), True),  # both end 200 counts short
        (Miss(-170, -8576), Miss(20, 1000), True),  # both go 2 % too far
        (Miss(200, -8576), Miss(500, -3000), False),
        (Miss(8576, -8576), Miss(3000, -3000), False),  # neither has moved
    ],
)
def test_targets_that_are_missed_alike_have_one_cause(one: Miss, other: Miss, alike: bool) -> None:
    assert one.is_like(other) is alike
    assert other.is_like(one) is alike
