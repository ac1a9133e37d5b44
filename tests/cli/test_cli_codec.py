"""``stagewire conformance codec``: output, exit codes, reports, and the commands to repeat a case."""

from __future__ import annotations

import io
import json
import shlex
import sys
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from checkout import TESTS
from quick_plans import quick_plans
from stagewire_cli.conformance import codec

if TYPE_CHECKING:
    from conftest import Result, Stagewire

PROGRAM = str(TESTS / "conformance" / "testees" / "bad_testee.py")
OURS = [sys.executable, "-c", "from stagewire_cli.main import run; run()", "testee"]
STUMBLES = "asi_ms2000/WRITE_TARGET_POSITION/request/encode/plain"
RIGHT = "asi_ms2000/WRITE_TARGET_POSITION/request/decode/[!r]*"
CODEC = ("conformance", "codec")
BOTH = ("--only", STUMBLES, "--only", RIGHT)


@pytest.fixture(scope="module", autouse=True)
def _quick() -> Iterator[None]:
    with quick_plans():
        yield


def bad(how: str) -> list[str]:
    return ["--", sys.executable, PROGRAM, how]


@pytest.mark.parametrize(
    ("only", "cases", "protocols"),
    [
        (["--protocol", "asi_ms2000"], 1000, {"asi_ms2000"}),
        pytest.param([], 9000, {"asi_ms2000", "thorlabs_apt"}, marks=pytest.mark.matrix),
    ],
    ids=["one-protocol", "all-protocols"],
)
def test_the_python_testee_passes_everything(
    stagewire: Stagewire, tmp_path: Path, only: list[str], cases: int, protocols: set[str]
) -> None:
    """The testee runs in a separate process."""
    report = tmp_path / "report.json"
    result = stagewire(*CODEC, *only, "--timeout", 60, "--json", report, "--", *OURS)
    assert (result.code, "failed" in result.out) == (0, False)
    said = json.loads(report.read_text(encoding="utf-8"))
    assert (said["kind"], said["verdict"], said["unfinished"]) == ("codec", "PASSED", None)
    counts = {name: number for name, number in said["counts"].items() if number}
    assert set(counts) == {"passed"}
    assert counts["passed"] > cases
    assert (said["facts"]["testee"], said["facts"]["starts"]) == ("stagewire-python", 1)
    assert {f"vectors_{protocol}" for protocol in protocols} <= said["digests"].keys()
    assert "PASSED (complete run): Conformance of stagewire-python" in result.out.splitlines()[-1]


# Failures and how to repeat them


def test_a_failure_has_its_line_and_a_command_to_repeat_it(stagewire: Stagewire) -> None:
    result = stagewire(*CODEC, *BOTH, *bad("crash"))
    assert result.code == 1
    assert f"crashed {STUMBLES}" in result.out
    assert "has ended with exit status 3 instead of answering" in result.out
    assert "the stack is gone" in result.out
    asked, again = (
        next(line for line in result.out.splitlines() if line.strip().startswith(start)).strip()
        for start in ("request: ", "repeat with: stage")
    )
    assert json.loads(asked.removeprefix("request: "))["message"] == "WRITE_TARGET_POSITION"
    words = shlex.split(again.removeprefix("repeat with: "))
    assert words[0] == "stagewire"
    repeated = stagewire(*words[1:])
    assert repeated.code == 1
    assert "FAILED (partial run): Conformance of stagewire-python" in repeated.out.splitlines()[-1]
    assert "1 failed" in repeated.out.splitlines()[-1]


def test_output_of_a_testee_cannot_control_a_terminal(stagewire: Stagewire) -> None:
    result = stagewire(*CODEC, *BOTH, *bad("steers"))
    assert result.code == 1
    assert "\x1b" not in result.out + result.err
    result = stagewire(*CODEC, *BOTH, *bad("steers_at_once"))
    assert result.code == 4
    assert "\x1b" not in result.out + result.err


def test_all_reports_are_written(stagewire: Stagewire, tmp_path: Path) -> None:
    files = {kind: tmp_path / f"report.{kind}" for kind in ("json", "junit", "html")}
    options = [word for kind, path in files.items() for word in (f"--{kind}", path)]
    result = stagewire(*CODEC, *BOTH, *options, *bad("rubbish"))
    assert result.code == 1
    said = json.loads(files["json"].read_text(encoding="utf-8"))
    (group,) = said["groups"]
    assert group["name"] == "asi_ms2000/cases"
    found = {case["id"]: case for case in group["cases"]}
    assert (found[STUMBLES]["result"], found[STUMBLES]["grade"]) == ("rubbish", "failed")
    assert "'oops' is not JSON" in found[STUMBLES]["findings"][0]["text"]
    assert {case["result"] for id, case in found.items() if id != STUMBLES} == {"passed"}
    root = ElementTree.parse(files["junit"]).getroot()
    (failed,) = [case for case in root.iter("testcase") if case.find("failure") is not None]
    assert failed.get("name") == STUMBLES
    assert STUMBLES in files["html"].read_text(encoding="utf-8")


# Exit codes


def expected(tmp_path: Path, id: str) -> Path:
    path = tmp_path / "expected.toml"
    path.write_text(f'schema_version = 1\n[[expected]]\nid = "{id}"\nreason = "known"\n', "utf-8")
    return path


def test_an_expected_failure_counts_as_passed(stagewire: Stagewire, tmp_path: Path) -> None:
    path = expected(tmp_path, STUMBLES)
    result = stagewire(*CODEC, *BOTH, "--expected", path, *bad("crash"))
    assert (result.code, "expected failure: known" in result.out) == (0, True)
    result = stagewire(*CODEC, *BOTH, "--expected", path, *bad("good"))
    assert (result.code, f"unexpected pass {STUMBLES}" in result.out) == (1, True)
    assert "expected to fail: known" in result.out
    result = stagewire(*CODEC, *BOTH, "--expected", expected(tmp_path, "no/such/*"), *bad("good"))
    assert (result.code, "no case matches 'no/such/*'" in result.err) == (2, True)


@pytest.mark.parametrize(
    ("how", "said"),
    [
        ("banner", "is not a testee: after hello: 'Welcome!' is not JSON"),
        ("crash_at_once", "has ended with exit status 9"),
        ("other_version", "uses version 2 of the testee protocol"),
    ],
)
def test_a_program_that_is_not_a_testee_is_reported(
    stagewire: Stagewire, how: str, said: str
) -> None:
    result = stagewire(*CODEC, *bad(how))
    assert (result.code, result.out) == (4, "")
    assert said in result.err


def test_a_testee_that_cannot_be_restarted_ends_the_run(
    stagewire: Stagewire, tmp_path: Path
) -> None:
    """A failure determines the exit code, and the early end is also reported."""
    mark, report = tmp_path / "mark", tmp_path / "report.json"
    command = [*bad("crash_after_the_first"), mark]
    result = stagewire(*CODEC, *BOTH, "--json", report, *command)
    assert result.code == 1
    assert "not finished: the testee could not be restarted: " in result.err
    counts = json.loads(report.read_text(encoding="utf-8"))["counts"]
    assert counts["failed"] == 1 < counts["not run"]


def test_an_interrupt_ends_the_run(
    stagewire: Stagewire, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def interrupt(*_: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(codec, "_progress_display", lambda: nullcontext(interrupt))
    report = tmp_path / "report.json"
    result = stagewire(*CODEC, *BOTH, "--json", report, *bad("good"))
    assert result.code == 130
    assert json.loads(report.read_text(encoding="utf-8"))["unfinished"] == "interrupted"


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ([], "missing testee: give its command after --"),
        (["--", "no_such_program"], "no_such_program cannot be run: "),
        (["--timeout", "0", *bad("good")], "--timeout must be a number of seconds above 0"),
        (["--timeout", "nan", *bad("good")], "--timeout must be a number of seconds above 0"),
        (["--timeout", "1e12", *bad("good")], "at most 86400, not 1e+12"),
        (["--protocol", "nothing", *bad("good")], "no protocol nothing is installed"),
        (["--only", "nothing", *bad("good")], "no case matches nothing"),
        (["--only", "nothing", "--list"], "no case matches nothing"),
        (["--only", "order,nothing", "--list"], "no case matches nothing"),
        (["--only", "order,", "--list"], "--only 'order,' contains an empty name"),
        (["--expected", "no_such_file.toml", *bad("good")], "no_such_file.toml: No such file"),
        (["--json", "no_such_folder/x.json", *bad("good")], "no_such_folder"),
        (["--json", "x.json", "--html", "x.json", *bad("good")], "name the same file"),
    ],
)
def test_wrong_arguments_are_refused(stagewire: Stagewire, arguments: list[str], said: str) -> None:
    result = stagewire(*CODEC, *arguments)
    assert (result.code, result.out) == (2, "")
    assert said in result.err


def test_a_protocol_that_the_testee_does_not_support_is_reported(stagewire: Stagewire) -> None:
    result = stagewire(*CODEC, "--protocol", "thorlabs_apt", *bad("speaks_one"))
    assert result.code == 2
    assert "supports asi_ms2000, but not thorlabs_apt" in result.err
    result = stagewire(*CODEC, "--only", "*/START_MOTOR/*,HW_DISCONNECT", *bad("speaks_one"))
    assert result.code == 0
    assert "the testee does not support thorlabs_apt" in result.out


# Lists and progress


def test_a_list_starts_no_testee(stagewire: Stagewire) -> None:
    result = stagewire(*CODEC, "--list", "--only", "order, lines/nan", "--only", "lines/twice")
    assert result.code == 0
    assert (
        "order/at_once.0     300   300 lines are sent before the first answer is read" in result.out
    )
    assert result.out.splitlines()[-1] == "7 cases"
    every = stagewire(*CODEC, "--list", "--protocol", "asi_ms2000")
    assert "thorlabs" not in every.out


def test_no_progress_is_shown_without_a_terminal(stagewire: Stagewire) -> None:
    assert "..." not in stagewire(*CODEC, *BOTH, *bad("rubbish")).err


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_a_bar_shows_progress_on_a_terminal(
    stagewire: Stagewire, monkeypatch: pytest.MonkeyPatch
) -> None:
    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    result: Result = stagewire(*CODEC, *BOTH, *bad("good"))
    assert result.code == 0
    assert "\x1b" in terminal.getvalue()
    assert "\x1b" not in result.out
