"""``stagewire conformance device``: output, files and exit codes, with and without a controller."""

from __future__ import annotations

import contextlib
import json
import os
import re
import shlex
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import jsonschema
import pytest

from checkout import SCHEMAS
from parts import every_nth
from stagewire.links import Link
from stagewire_conformance.device.declaration import declare
from stagewire_conformance.device.lines import apt_contact as contact
from stagewire_conformance.device.permissions import Permissions
from stagewire_conformance.device.plans import plan
from stagewire_virtual import linking
from stagewire_virtual.controller import VirtualController
from stagewire_virtual.linking import SteppedLink, blueprint_of

if TYPE_CHECKING:
    from conftest import Stagewire

SCHEMA = json.loads((SCHEMAS / "conformance-report.schema.json").read_text(encoding="utf-8"))
RUN = "from stagewire_cli.main import run; run()"
DEVICE = ("conformance", "device")
VELOCITY = "answers/0x50/MOT_REQ_VELPARAMS/1"
GOOD = "virtual://TDC001?stage=Z8"
FLIPS = f"{GOOD}&faults=to_host flip frame message=MOT_GET_VELPARAMS bit=49"
"""Answers for channel 3."""
ODD = f"{GOOD}&quirks=zero_addresses"
SILENT = "virtual://TDC001?faults=to_host drop frame"


@pytest.fixture(autouse=True)
def _stepped(monkeypatch: pytest.MonkeyPatch) -> None:
    """Give virtual controllers in this process a stepped clock."""

    def opened(url: str, settings: object) -> Link:
        link = SteppedLink(VirtualController(blueprint_of(url).make))
        link.url = url
        return link

    monkeypatch.setattr(linking, "open_link", opened)


def report(path: Path) -> Any:
    found = json.loads(path.read_text(encoding="utf-8"))
    jsonschema.Draft202012Validator(SCHEMA).validate(found)
    return found


def cases(found: Any) -> dict[str, Any]:
    return {case["id"]: case for group in found["groups"] for case in group["cases"]}


def test_a_run_can_pass(stagewire: Stagewire, tmp_path: Path) -> None:
    files = {name: tmp_path / f"report.{name}" for name in ("json", "junit", "html", "log")}
    options = [word for name, path in files.items() for word in (f"--{name}", path)]
    result = stagewire(*DEVICE, GOOD, "--unit", "TDC001", "--only", "answers", *options)
    assert result.code == 0
    assert "This run does not change settings, write to memory or move anything." in result.out
    assert re.search(r"^answers .* \d+ *$", result.out, re.MULTILINE)
    assert "\x1b" not in result.out + result.err
    assert result.err == ""
    for path in files.values():
        assert f"written: {path}" in result.out
    assert result.out.splitlines()[-1].startswith(
        "PASSED IN PART (partial run): Conformance of the TDC001: "
    )
    found = report(files["json"])
    assert found["verdict"] == "PASSED IN PART"
    assert cases(found)[VELOCITY]["result"] == "PASS"
    assert found["facts"]["identification_model_number"] == "TDC001"
    assert set(found["digests"]) == {"suite", "registry"}
    decoded = stagewire("decode", files["log"])
    assert "MOT_GET_VELPARAMS" in decoded.out
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(
        path.name for path in files.values()
    )


@pytest.mark.parametrize(
    ("url", "code", "word"), [(FLIPS, 1, "FAIL"), (ODD, 3, "NON-STRICT")], ids=["fail", "odd"]
)
def test_the_printed_command_repeats_the_result(
    stagewire: Stagewire, tmp_path: Path, url: str, code: int, word: str
) -> None:
    path = tmp_path / "report.json"
    result = stagewire(*DEVICE, url, "--unit", "TDC001", "--only", "answers/*/MOT_REQ_VELPARAMS/1",
                       "--seed", 7, "--json", path)  # fmt: skip
    assert result.code == code
    case = cases(report(path))[VELOCITY]
    assert case["result"] == word
    finding = next(one for one in case["findings"] if one["grade"] in ("failed", "deviates"))
    for part in (f"{word} {VELOCITY}: ", finding["text"], "received      15 04 0E 00", "^^"):
        assert part in result.out
    for line in case["lines"]:
        assert bytes.fromhex(line["hex"]).hex(" ").upper() in result.out
    assert case["rules"]
    assert re.search(r"  rule [a-z-]+ \(must, Issue 3, page \d+\): ", result.out)
    [command] = [
        line.strip() for line in result.out.splitlines() if line.startswith("  repeat with: ")
    ]
    assert command == f"repeat with: {case['repeat']}"
    words = shlex.split(case["repeat"])
    assert words[:3] == ["stagewire", *DEVICE]
    assert "7" in words
    once_more = tmp_path / "again.json"
    again = stagewire(*words[1:], "--json", once_more)
    assert again.code == code
    [repeated] = cases(report(once_more)).values()
    assert repeated["id"] == VELOCITY
    assert repeated["result"] == word
    assert [one["text"] for one in repeated["findings"]] == [
        one["text"] for one in case["findings"]
    ]


def test_checks_that_are_not_allowed_are_skipped_and_listed(
    stagewire: Stagewire, tmp_path: Path
) -> None:
    path = tmp_path / "report.json"
    result = stagewire(
        *DEVICE, GOOD, "--unit", "TDC001", "--only", "MOT_REQ_VELPARAMS", "--json", path
    )
    assert result.code == 0
    left_out = [case for case in cases(report(path)).values() if case["grade"] == "not run"]
    assert left_out
    for case in left_out:
        assert "needs --allow-" in case["why"]
    assert re.search(
        r"^NOT RUN: \d+ checks? \(not allowed: needs --allow-", result.out, re.MULTILINE
    )


def test_the_plan_is_announced_before_the_run(stagewire: Stagewire) -> None:
    result = stagewire(*DEVICE, GOOD, "--unit", "TDC001", "--allow-settings", "--only",
                       "readback/0x50/MOT_SET_VELPARAMS/1")  # fmt: skip
    assert result.code == 0
    before = result.out.partition("kind ")[0]
    assert "This run changes settings, and restores them: 1 check" in before
    assert "MOT_SET_VELPARAMS" in before


def test_a_pics_determines_the_skipped_checks(stagewire: Stagewire, tmp_path: Path) -> None:
    pics = tmp_path / "pics.toml"
    pics.write_text(
        'schema_version = 1\nprotocol = "thorlabs_apt"\nunit = "TDC001"\n'
        '[unsupported]\nMOT_REQ_POTPARAMS = "no potentiometer fitted"\n',
        encoding="utf-8",
    )
    path = tmp_path / "report.json"
    result = stagewire(*DEVICE, GOOD, "--pics", pics, "--only", "MOT_REQ_POTPARAMS", "--only",
                       "MOT_REQ_HOMEPARAMS", "--json", path)  # fmt: skip
    assert result.code == 0
    found = report(path)
    skipped = [case for case in cases(found).values() if case["result"] == "SKIP"]
    assert skipped
    assert all("no potentiometer fitted" in case["why"] for case in skipped)
    assert "no potentiometer fitted" in result.out
    assert set(found["digests"]) == {"suite", "registry", "pics"}
    [row] = [one for one in found["coverage"]["messages"] if one["name"] == "MOT_REQ_POTPARAMS"]
    assert row["unsupported"] == "no potentiometer fitted"


@contextmanager
def deaf() -> Iterator[str]:
    """Yield the URL of a server that accepts a connection and never sends anything."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        taken: list[socket.socket] = []

        def take() -> None:
            taken.append(server.accept()[0])

        thread = threading.Thread(target=take)
        thread.start()
        yield f"socket://127.0.0.1:{server.getsockname()[1]}"
        thread.join()
        taken[0].close()


def dead(stagewire: Stagewire, url: str, tmp_path: Path) -> str:
    path = tmp_path / "report.json"
    page = tmp_path / "report.html"
    log = tmp_path / "log.txt"
    result = stagewire(
        *DEVICE, url, "--unit", "TDC001", "--json", path, "--html", page, "--log", log
    )
    assert result.code == 4
    found = report(path)
    assert found["verdict"] == "NOT FINISHED"
    assert {case["grade"] for case in cases(found).values()} == {"not run"}
    assert found["unfinished"] in result.err
    assert "NOT FINISHED" in page.read_text(encoding="utf-8")
    assert result.out.splitlines()[-1].startswith("NOT FINISHED (partial run): ")
    assert (f"written: {log}" in result.out) == log.exists()
    return result.err


def test_a_line_on_which_nothing_answers(stagewire: Stagewire, tmp_path: Path) -> None:
    assert "no answer at virtual://TDC001" in dead(stagewire, SILENT, tmp_path)


def test_a_silent_server_ends_the_run(stagewire: Stagewire, tmp_path: Path) -> None:
    with deaf() as url:
        assert f"no answer at {url}" in dead(stagewire, url, tmp_path)


def test_a_server_that_refuses_connections_is_an_error(
    stagewire: Stagewire, tmp_path: Path
) -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
    assert "the connection was refused" in dead(stagewire, f"socket://127.0.0.1:{port}", tmp_path)


@pytest.mark.parametrize("url", ["/dev/there-is-none", "COM399", "nowhere://x"])
def test_a_line_that_cannot_be_opened_is_an_error(
    stagewire: Stagewire, tmp_path: Path, url: str
) -> None:
    assert f"{url} cannot be opened" in dead(stagewire, url, tmp_path)


def test_a_lost_line_ends_the_run(stagewire: Stagewire, tmp_path: Path) -> None:
    path, junit = tmp_path / "report.json", tmp_path / "report.xml"
    url = f"{GOOD}&faults=to_host disconnect frame message=MOT_GET_VELPARAMS"
    result = stagewire(*DEVICE, url, "--unit", "TDC001", "--only", "answers", "--json", path,
                       "--junit", junit)  # fmt: skip
    found = report(path)
    assert result.code == (1 if found["verdict"] == "FAILED" else 4)
    assert "the line was lost" in found["unfinished"]
    assert "the line was lost" in junit.read_text(encoding="ascii")
    done = cases(found)
    assert done["answers/0x50/HW_REQ_INFO"]["result"] == "PASS"
    assert done["answers/0x50/MOT_REQ_HOMEPARAMS/1"]["result"] == "NOT RUN"


def interrupted(words: list[str], log: Path, message: str, number: int) -> tuple[int, str, str]:
    """Run a process, send it a signal when its log has a message; return its exit code and output."""
    command = [sys.executable, "-c", RUN, *words, "--log", str(log)]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        end = time.monotonic() + 60
        while not log.exists() or message not in log.read_text(encoding="utf-8"):
            assert process.poll() is None, process.communicate()
            assert time.monotonic() < end
            time.sleep(0.005)
        process.send_signal(number)
        out, err = process.communicate(timeout=60)
    return process.returncode, out, err


@pytest.mark.skipif(os.name != "posix", reason="sends a signal to another process")
@pytest.mark.parametrize("number", every_nth([signal.SIGINT, signal.SIGTERM], 2))
def test_ctrl_c_stops_the_motion_and_reports_it(tmp_path: Path, number: signal.Signals) -> None:
    path, log = tmp_path / "report.json", tmp_path / "log.txt"
    words = [*DEVICE, GOOD, "--unit", "TDC001", "--only", "move-velocity",
             "--allow-motion", "0..100000counts", "--allow-settings", "--json", str(path)]  # fmt: skip
    code, out, err = interrupted(words, log, "MOT_MOVE_VELOCITY", number)
    assert code == 130, err
    assert "Traceback" not in err
    assert f"ended by {number.name}" in err
    assert re.search(r"^stop sent: .*MOT_MOVE_STOP chan_ident=1", err, re.MULTILINE)
    assert re.search(r"^restored: .*MOT_SET_VELPARAMS", err, re.MULTILINE)
    assert out.splitlines()[-1].startswith("NOT FINISHED")
    assert f"ended by {number.name}" in report(path)["unfinished"]
    recorded = log.read_text(encoding="utf-8")
    sent = re.findall(r"^\S+ > .*# (\w+)", recorded.partition("MOT_MOVE_VELOCITY")[2], re.MULTILINE)
    assert "MOT_MOVE_VELOCITY" not in sent
    assert sent.index("MOT_MOVE_STOP") < sent.index("MOT_SET_VELPARAMS")


@pytest.mark.skipif(os.name != "posix", reason="needs a pseudo-terminal")
@pytest.mark.parametrize("colour", every_nth([True, False], 2))
def test_a_terminal_shows_a_bar_and_optional_colour(colour: bool) -> None:
    import pty

    main, part = pty.openpty()
    environment = {**os.environ, "TERM": "xterm-256color"} | ({} if colour else {"NO_COLOR": "1"})
    words = [*DEVICE, FLIPS, "--unit", "TDC001", "--only", "answers/*/MOT_REQ_VELPARAMS/1"]
    process = subprocess.Popen(
        [sys.executable, "-c", RUN, *words], stdout=part, stderr=part, env=environment
    )
    os.close(part)
    seen = b""
    with contextlib.suppress(OSError):  # Linux raises this when the other end is closed
        while data := os.read(main, 65536):
            seen += data
    os.close(main)
    assert process.wait(60) == 1
    text = seen.decode("utf-8")
    assert "answers/0x50/MOT_REQ_VELPARAMS/1" in text
    assert "━" in text
    assert "... 0 of" not in text
    assert bool(re.search(r"\x1b\[[0-9;]*3[1-6]m", text)) is colour


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ([GOOD], "missing unit: give --unit"),
        ([GOOD, "--unit", "RACK"], "a rack of modules needs a PICS that lists its bays"),
        (["--unit", "TDC001"], "missing URL"),
        ([GOOD, "--unit", "TDC999"], "unknown unit TDC999"),
        (
            [GOOD, "--unit", "TDC001", "--allow-motion", "5..1mm"],
            "the first number must not exceed the second",
        ),
        ([GOOD, "--unit", "TDC001", "--allow-motion", "far"], "expected a range with its unit"),
        ([GOOD, "--unit", "TDC001", "--only", "nothing-like-this"], "nothing-like-this"),
        ([GOOD, "--unit", "TDC001", "--only", "answers,nothing-like-this"], "nothing-like-this"),
        ([GOOD, "--pics", "there-is-none.toml"], "there-is-none.toml"),
        ([GOOD, "--unit", "TDC001", "--json", "no/such/folder/x.json"], "missing folder"),
        ([GOOD, "--unit", "TDC001", "--html", "."], "--html"),
        ([GOOD, "--unit", "TDC001", "--junit", "-"], "--junit: - is not a file"),
        ([GOOD, "--unit", "TDC001", "--json", "-"], "--json: - is not a file"),
        ([GOOD, "--unit", "TDC001", "--html", "-"], "--html: - is not a file"),
        ([GOOD, "--unit", "TDC001", "--log", "-"], "--log: - is not a file"),
        (["virtual://NOTHING", "--unit", "TDC001"], "virtual://NOTHING cannot be opened"),
        (["VIRTUAL://TDC001?wings=2", "--unit", "TDC001"], "unknown option 'wings'"),
        (["virtual://TDC001?stage=Z9999", "--unit", "TDC001"], "Z9999"),
        ([GOOD, "--unit", "TDC001", "--log", "no/such/folder/x.txt"], "--log: missing folder"),
        ([GOOD, "--unit", "TDC001", "--json", "x", "--html", "x"], "name the same file"),
        ([GOOD, "--unit", "TDC001", "--json", "x", "--log", "x"], "name the same file"),
        ([GOOD, "--unit", "TDC001", "--only", "readback"], "nothing to run"),
    ],
    ids=lambda value: " ".join(value[1:])[:40] if isinstance(value, list) else "",
)
def test_wrong_arguments_are_refused(
    stagewire: Stagewire,
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    words: list[str],
    said: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    result = stagewire(*DEVICE, *words)
    assert result.code == 2
    assert said in result.err
    assert result.out == ""
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(("option", "module"), [("--html", "jinja2"), ("--junit", "junitparser")])
def test_a_missing_extra_is_named_before_the_run(
    stagewire: Stagewire, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, option: str, module: str
) -> None:
    monkeypatch.setitem(sys.modules, module, None)
    result = stagewire(*DEVICE, GOOD, "--unit", "TDC001", option, tmp_path / "report")
    assert result.code == 2
    assert result.out == ""
    assert f"{option} needs {module}: run pip install 'stagewire[conformance]'" in result.err


@pytest.mark.parametrize("unit", ["TDC001", "BBD102", "TPZ001", "OST001", "MS2000"])
def test_the_list_has_every_check(stagewire: Stagewire, unit: str) -> None:
    result = stagewire(*DEVICE, "--unit", unit, "--list")
    assert result.code == 0
    for check in plan(declare(unit), Permissions()):
        assert re.search(rf"^{re.escape(check.id)}\s", result.out, re.MULTILINE), check.id
        for need in check.needs:
            assert str(need) in result.out
    where = "section " if unit == "MS2000" else "page "
    assert where in result.out


def test_names_of_checks_are_separated_by_commas(stagewire: Stagewire) -> None:
    words = [*DEVICE, "--unit", "TDC001", "--list"]
    result = stagewire(*words, "--only", "quiet, identify", "--only", "MOT_REQ_VELPARAMS,garbage/*")
    assert result.code == 0
    found = {line.split("/")[0].split()[0] for line in result.out.splitlines() if line.strip()}
    assert {"quiet", "identify", "answers", "garbage"} <= found
    assert "truncated" not in found


@pytest.mark.parametrize(
    "command", [[*DEVICE, "--unit", "TDC001"], ["conformance", "codec", "--protocol", "asi_ms2000"]]
)
def test_the_reader_of_a_list_may_close_the_pipe(command: list[str]) -> None:
    reader, writer = os.pipe()
    os.close(reader)
    with os.fdopen(writer, "wb") as closed:
        done = subprocess.run(
            [sys.executable, "-c", RUN, *command, "--list"],
            stdout=closed,
            stderr=subprocess.PIPE,
            timeout=60,
        )
    assert (done.returncode, done.stderr) == (0, b"")


def test_allowed_checks_that_were_not_run_are_in_the_last_line(
    stagewire: Stagewire, tmp_path: Path
) -> None:
    path, page = tmp_path / "report.json", tmp_path / "report.html"
    words = [*DEVICE, GOOD, "--unit", "TDC001", "--allow-motion"]
    only = ["--only", "move-absolute", "--only", "answers/*/MOT_REQ_VELPARAMS/1"]
    result = stagewire(*words, "0..1counts", *only, "--json", path, "--html", page)
    assert result.code == 0
    last = result.out.splitlines()[-1]
    missed = "; no check that moves produced a result: 0x50 channel 1, at 0 counts"
    assert last.startswith("PASSED IN PART (partial run): ")
    assert missed in last
    assert missed in report(path)["summary"]
    assert missed in page.read_text(encoding="utf-8").partition("<main")[0]
    assert "Rules without" in page.read_text(encoding="utf-8")
    assert "MOT_SET_LIMSWITCHPARAMS" not in page.read_text(encoding="utf-8")
    moved = stagewire(*words, "0..100000counts", *only)
    assert moved.code == 0
    assert "produced a result" not in moved.out


def test_the_identity_of_a_controller_cannot_control_the_terminal(
    stagewire: Stagewire, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    hostile = "<b>x</b>\x1b[2J\u202e"
    real = contact.first_contact
    monkeypatch.setattr(
        "stagewire_conformance.device.lines.apt_line.first_contact",
        lambda line: {**real(line), "notes": hostile},
    )
    page, path = tmp_path / "report.html", tmp_path / "report.json"
    result = stagewire(*DEVICE, GOOD, "--unit", "TDC001", "--only", "identification", "--html", page,
                       "--json", path)  # fmt: skip
    assert result.code == 0
    assert report(path)["facts"]["identification_notes"] == hostile
    text = page.read_text(encoding="utf-8")
    assert "<b>x" not in text
    assert "&lt;b&gt;x&lt;/b&gt;\\x1b[2J\\u202e" in text
    assert "\x1b" not in text + result.out + result.err
