"""Testees that crash, hang, say rubbish or answer out of order are found out, and the run goes on."""

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
"""Seconds that an answer may take where the testee gives one: more than any machine needs."""


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
            "the testee has ended with exit status 3, in the place of an answer",
        ),
        ("crash_half", Outcome.CRASHED, "with exit status 4, in the middle of an answer"),
        ("rubbish", Outcome.RUBBISH, "'oops' is no JSON: "),
        ("list_", Outcome.RUBBISH, "'[1]' is no JSON object"),
        ("not_utf_8", Outcome.RUBBISH, "is no JSON: "),
        ("not_a_number", Outcome.RUBBISH, "is no JSON: NaN is no number"),
        ("deep", Outcome.RUBBISH, "nested too deeply"),
    ],
)
def test_the_run_goes_on(how: str, outcome: Outcome, said: str) -> None:
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


def test_one_that_hangs() -> None:
    report = report_of("hang", STUMBLES, RIGHT, timeout=0.5)
    (wrong,) = [result for result in report.failures() if result.case.id == STUMBLES]
    assert wrong.outcome is Outcome.TIMED_OUT
    assert wrong.text == "no answer within 0.5 seconds"
    assert report.starts >= 2


def test_one_that_does_not_read() -> None:
    """Writing to it must not wait for ever, either."""
    report = report_of("deaf", "lines/huge", timeout=0.5)
    assert outcomes(report) == {Outcome.TIMED_OUT: 1}


def test_what_it_said_last_is_kept() -> None:
    report = report_of("crash", STUMBLES)
    assert report.results[0].said == "the stack is gone"
    said = report_of("chatty_crash", STUMBLES).results[0].said
    assert said.endswith("line 1999 of what nobody reads\nat last")
    assert len(said) <= 8 * 1024


@pytest.mark.parametrize("how", ["good", "chatty", "slow", "stays", "carriage_returns"])
def test_what_is_right_all_the_same(how: str) -> None:
    report = report_of(how, "WRITE_TARGET_POSITION", "lines/unusual*")
    assert outcomes(report) == {Outcome.PASSED: len(report.results)}
    assert (report.starts, report.unfinished) == (1, "")


def test_answers_out_of_order() -> None:
    report = report_of("backwards", "order", RIGHT)
    found = {result.case.id: result for result in report.results}
    rounds = [result for id, result in found.items() if id.startswith("order/")]
    assert {result.outcome for result in rounds} == {Outcome.OUT_OF_ORDER}
    assert "has come, that to" in rounds[0].text
    assert {result.outcome for id, result in found.items() if id[:5] != "order"} == {Outcome.PASSED}


def test_an_answer_that_comes_late() -> None:
    """The answer that is due does not come; and a run does not wait again and again for ever."""
    report = report_of("late", "WRITE_TARGET_POSITION", timeout=0.1)
    assert outcomes(report)[Outcome.TIMED_OUT] == TIME_OUTS
    assert report.unfinished == f"the testee has left {TIME_OUTS} lines without an answer"
    assert report.not_run


def test_an_answer_that_comes_twice() -> None:
    """Whether the second is seen before the next line is sent or after it."""
    report = report_of("twice", "asi_ms2000/WRITE_TARGET_POSITION/request/encode/[pl]*")
    found = {result.outcome for result in report.failures()}
    assert found
    assert found <= {Outcome.RUBBISH, Outcome.OUT_OF_ORDER}


def test_one_that_crashes_again_and_again() -> None:
    report = report_of("crash_always", STUMBLES, RIGHT)
    assert set(outcomes(report)) == {Outcome.CRASHED}
    assert report.starts == len(report.results)


def test_one_that_cannot_be_started_again(tmp_path: Path) -> None:
    report = report_of(f"crash_after_the_first {tmp_path / 'mark'}", STUMBLES, RIGHT)
    assert outcomes(report) == {Outcome.CRASHED: 1}
    assert report.unfinished.startswith("the testee could not be started again: asked hello: ")
    assert report.not_run


@pytest.mark.parametrize(
    ("how", "said"),
    [
        ("banner", "'Welcome!' is no JSON: "),
        ("other_version", "it speaks version 2 of the testee protocol; this suite speaks 1"),
        ("refuses_hello", "it refuses hello: who asks?"),
        ("no_way", "has ended with exit status 1, in the place of an answer"),
    ],
)
def test_no_testee(how: str, said: str) -> None:
    with pytest.raises(NotATesteeError) as caught:
        report_of(how, STUMBLES)
    assert said in str(caught.value)
    assert ("KeyError: 'no_way'" in str(caught.value)) == (how == "no_way")  # its last words


def test_more_than_anybody_asked_for() -> None:
    report = report_of("endless", STUMBLES, RIGHT)
    assert set(outcomes(report)) == {Outcome.RUBBISH}


def test_no_program() -> None:
    with pytest.raises(NotStartedError, match=r"^no_such_program cannot be run: "):
        run(["no_such_program"], [PROTOCOL])


def test_nothing_to_ask() -> None:
    with pytest.raises(NothingToAskError, match="no case matches nothing"):
        report_of("good", "nothing")
    command = [sys.executable, PROGRAM, "good"]
    with pytest.raises(
        NothingToAskError, match="asi_ms2000, thorlabs_apt, and not invented_packets"
    ):
        run(command, [OTHER])


def test_what_it_has_not_got_is_skipped() -> None:
    report = report_of("decodes_alone", "WRITE_TARGET_POSITION")
    found = outcomes(report)
    assert set(found) == {Outcome.SKIPPED, Outcome.PASSED}
    skipped = [result for result in report.results if result.outcome is Outcome.SKIPPED]
    assert {result.text for result in skipped} == {
        "the testee does not encode",
        "the testee does not stream",
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


def test_a_process_ends_with_all_that_it_has_started(tmp_path: Path) -> None:
    """A testee that a shell has started holds the pipes open when the shell alone is ended."""
    if sys.platform == "win32":
        pytest.skip("there is no sh")
    process = Process(["sh", "-c", f"'{sys.executable}' '{PROGRAM}' silent & wait"])
    assert process.end() == "goes on running"
    assert not any(thread.is_alive() for thread in process._threads)
