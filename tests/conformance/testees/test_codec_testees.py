"""Testees that crash, hang, send garbage or answer out of order are found, and the run continues."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from invented_packets import PROTOCOL as OTHER
from quick_plans import quick_plans
from stagewire.protocols import load_protocol
from stagewire_conformance.testees import (
    NotATesteeError,
    NothingToAskError,
    NotStartedError,
    Outcome,
    Report,
    run,
)
from stagewire_conformance.testees.process import Process
from stagewire_conformance.testees.session import TIME_OUTS

PROGRAM = str(Path(__file__).parent / "bad_testee.py")
PROTOCOL = load_protocol("asi_ms2000")
STUMBLES = "asi_ms2000/WRITE_TARGET_POSITION/request/encode/plain"
RIGHT = "asi_ms2000/WRITE_TARGET_POSITION/request/decode/[!r]*"
PATIENT = 30.0
"""A timeout for testees that answer, longer than any machine needs."""


@pytest.fixture(scope="module", autouse=True)
def _quick() -> Iterator[None]:
    with quick_plans():
        yield


def report_of(how: str, *only: str, timeout: float = PATIENT, **options: Any) -> Report:
    command = [sys.executable, PROGRAM, *how.split()]
    return run(command, [PROTOCOL], only=only, timeout=timeout, **options)


def outcomes(report: Report) -> dict[Outcome, int]:
    found = [result.outcome for result in report.results]
    return {outcome: found.count(outcome) for outcome in dict.fromkeys(found)}


@pytest.mark.parametrize(
    ("how", "outcome", "said"),
    [
        (
            "crash",
            Outcome.CRASHED,
            "the testee has ended with exit status 3 instead of answering",
        ),
        ("crash_half", Outcome.CRASHED, "with exit status 4 in the middle of an answer"),
        ("rubbish", Outcome.RUBBISH, "'oops' is not JSON: "),
        ("list_", Outcome.RUBBISH, "'[1]' is not a JSON object"),
        ("not_utf_8", Outcome.RUBBISH, "is not JSON: "),
        ("not_a_number", Outcome.RUBBISH, "is not JSON: NaN is not a number"),
        ("deep", Outcome.RUBBISH, "nested too deeply"),
    ],
)
def test_the_run_continues_after_a_failure(how: str, outcome: Outcome, said: str) -> None:
    report = report_of(how, STUMBLES, RIGHT)
    (wrong,) = report.failures()
    assert (wrong.case.id, wrong.outcome) == (STUMBLES, outcome)
    assert said in wrong.text
    assert json.loads(wrong.line)["message"] == "WRITE_TARGET_POSITION"
    others = outcomes(report)
    assert others.pop(outcome) == 1
    assert others.keys() == {Outcome.PASSED}
    assert others[Outcome.PASSED] > 5
    assert (report.starts, report.unfinished, report.not_run) == (2, "", ())


def test_a_testee_that_hangs_times_out() -> None:
    report = report_of("hang", STUMBLES, RIGHT, timeout=0.5)
    (wrong,) = [result for result in report.failures() if result.case.id == STUMBLES]
    assert wrong.outcome is Outcome.TIMED_OUT
    assert wrong.text == "no answer within 0.5 seconds"
    assert report.starts >= 2


def test_a_testee_that_does_not_read_times_out() -> None:
    """Writing to it must not block for ever."""
    report = report_of("deaf", "lines/huge", timeout=0.5)
    assert outcomes(report) == {Outcome.TIMED_OUT: 1}


def test_the_end_of_standard_error_is_kept() -> None:
    report = report_of("crash", STUMBLES)
    assert report.results[0].said == "the stack is gone"
    said = report_of("chatty_crash", STUMBLES).results[0].said
    assert said.endswith("line 1999 of output that is not read\nat last")
    assert len(said) <= 8 * 1024


@pytest.mark.parametrize("how", ["good", "chatty", "slow", "stays", "carriage_returns"])
def test_unusual_but_valid_testees_pass(how: str) -> None:
    report = report_of(how, "WRITE_TARGET_POSITION", "lines/unusual*")
    assert outcomes(report) == {Outcome.PASSED: len(report.results)}
    assert (report.starts, report.unfinished) == (1, "")


def test_answers_out_of_order_are_found() -> None:
    report = report_of("backwards", "order", RIGHT)
    found = {result.case.id: result for result in report.results}
    rounds = [result for id, result in found.items() if id.startswith("order/")]
    assert {result.outcome for result in rounds} == {Outcome.OUT_OF_ORDER}
    assert ", expected that to" in rounds[0].text
    assert {result.outcome for id, result in found.items() if id[:5] != "order"} == {Outcome.PASSED}


def test_a_late_answer_is_never_matched() -> None:
    """The expected answer is missing, and the number of timeouts in a run is limited."""
    report = report_of("late", "WRITE_TARGET_POSITION", timeout=0.1)
    assert outcomes(report)[Outcome.TIMED_OUT] == TIME_OUTS
    assert report.unfinished == f"the testee did not answer {TIME_OUTS} lines"
    assert report.not_run


def test_a_doubled_answer_is_found() -> None:
    """The second answer may be read before or after the next line is sent."""
    report = report_of("twice", "asi_ms2000/WRITE_TARGET_POSITION/request/encode/[pl]*")
    found = {result.outcome for result in report.failures()}
    assert found
    assert found <= {Outcome.RUBBISH, Outcome.OUT_OF_ORDER}


def test_a_testee_that_always_crashes_is_given_up() -> None:
    report = report_of("crash_always", STUMBLES, RIGHT)
    assert set(outcomes(report)) == {Outcome.CRASHED}
    assert report.starts == len(report.results)


def test_a_testee_that_cannot_be_restarted_ends_the_run(tmp_path: Path) -> None:
    report = report_of(f"crash_after_the_first {tmp_path / 'mark'}", STUMBLES, RIGHT)
    assert outcomes(report) == {Outcome.CRASHED: 1}
    assert report.unfinished.startswith("the testee could not be restarted: after hello: ")
    assert report.not_run


@pytest.mark.parametrize(
    ("how", "said"),
    [
        ("banner", "'Welcome!' is not JSON: "),
        (
            "other_version",
            "it uses version 2 of the testee protocol; this suite requires version 1",
        ),
        ("refuses_hello", "it refused hello: who asks?"),
        ("no_way", "has ended with exit status 1 instead of answering"),
    ],
)
def test_a_program_that_is_not_a_testee_is_refused(how: str, said: str) -> None:
    with pytest.raises(NotATesteeError) as caught:
        report_of(how, STUMBLES)
    assert said in str(caught.value)
    assert ("KeyError: 'no_way'" in str(caught.value)) == (
        how == "no_way"
    )  # the end of its standard error


def test_an_unsolicited_line_is_found() -> None:
    report = report_of("endless", STUMBLES, RIGHT)
    assert set(outcomes(report)) == {Outcome.RUBBISH}


def test_a_missing_program_is_reported() -> None:
    with pytest.raises(NotStartedError, match=r"^no_such_program cannot be run: "):
        run(["no_such_program"], [PROTOCOL])


def test_a_run_without_cases_is_refused() -> None:
    with pytest.raises(NothingToAskError, match="no case matches nothing"):
        report_of("good", "nothing")
    command = [sys.executable, PROGRAM, "good"]
    with pytest.raises(
        NothingToAskError, match="asi_ms2000, thorlabs_apt, but not invented_packets"
    ):
        run(command, [OTHER])


def test_unsupported_operations_are_skipped() -> None:
    report = report_of("decodes_alone", "WRITE_TARGET_POSITION")
    found = outcomes(report)
    assert set(found) == {Outcome.SKIPPED, Outcome.PASSED}
    skipped = [result for result in report.results if result.outcome is Outcome.SKIPPED]
    assert {result.text for result in skipped} == {
        "the testee does not support encode",
        "the testee does not support stream",
    }
    assert {operation for result in skipped for operation in result.case.operations} == {
        "encode",
        "stream",
    }


def test_ctrl_c_ends_the_run_and_the_testee() -> None:
    def interrupt(done: int, total: int, result: object) -> None:
        if done == 3:
            raise KeyboardInterrupt

    report = report_of("good", RIGHT, progress=interrupt)
    assert (len(report.results), report.interrupted, report.unfinished) == (3, True, "interrupted")
    assert len(report.not_run) > 3


def test_a_process_ends_with_all_its_children(tmp_path: Path) -> None:
    """A testee started by a shell holds the pipes open if only the shell is ended."""
    if sys.platform == "win32":
        pytest.skip("sh is not available")
    process = Process(["sh", "-c", f"'{sys.executable}' '{PROGRAM}' silent & wait"])
    assert process.end() == "is still running"
    assert not any(thread.is_alive() for thread in process._threads)
