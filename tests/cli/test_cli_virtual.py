"""``stagewire virtual``: serving, output and exit codes."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager
from pathlib import Path
from typing import IO, TYPE_CHECKING
from urllib.parse import urlsplit

import pytest

from stagewire.capture import read_capture
from stagewire_cli.virtual_units import of_names
from stagewire_virtual.clock import SteppedClock
from stagewire_virtual.serving.link import Observer

if TYPE_CHECKING:
    from conftest import Stagewire

COMMAND = [sys.executable, "-c", "from stagewire_cli.main import run; run()", "virtual"]
INFO = bytes.fromhex("05 00 00 00 50 01")
INFO_SIZE = 6 + 84
ENABLE_STATE = bytes.fromhex("11 02 01 00 50 01")
posix = pytest.mark.skipif(os.name != "posix", reason="needs signals and pseudo-terminals")


class Running:
    """The command in a separate process."""

    def __init__(self, process: subprocess.Popen[str]) -> None:
        self.process = process
        self.places: dict[str, str] = {}

    def listen(self, stream: IO[str] | None, units: int) -> None:
        """Read the URLs of the units."""
        assert stream is not None
        for _ in range(units):
            label, _, url = stream.readline().rstrip("\n").partition(" at ")
            self.places[label] = url

    def end(self, number: int | None = None) -> tuple[int, str, str]:
        """Send a signal, if one is given; return exit code and output."""
        if number is not None:
            self.process.send_signal(number)
        out, err = self.process.communicate(timeout=20)
        assert "Traceback" not in out + err
        return self.process.returncode, out, err


@contextmanager
def running(*words: object, units: int = 1) -> Iterator[Running]:
    """Start the command and wait until it listens."""
    process = subprocess.Popen(
        [*COMMAND, *map(str, words)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    # Ends a command that hangs.
    guard = threading.Timer(30, process.kill)
    guard.start()
    try:
        made = Running(process)
        made.listen(process.stderr if "-" in words else process.stdout, units)
        yield made
    finally:
        guard.cancel()
        process.kill()
        process.communicate()


def ask(url: str, *requests: bytes, size: int = INFO_SIZE) -> bytes:
    """Connect and send requests, each after ``size`` bytes of answer to the previous one."""
    host, port = url.removeprefix("socket://").rsplit(":", 1)
    answers = b""
    with closing(socket.create_connection((host, int(port)), timeout=10)) as line:
        for request in requests:
            line.sendall(request)
            got = b""
            while len(got) < size and (part := line.recv(size - len(got))):
                got += part
            answers += got
    return answers


# Output and exit codes


def test_help_has_an_example(stagewire: Stagewire) -> None:
    result = stagewire("virtual", "--help")
    assert result.code == 0
    assert "  stagewire virtual TDC001" in result.out


def test_list_prints_all_units_and_options(stagewire: Stagewire) -> None:
    result = stagewire("virtual", "--list")
    assert result.code == 0
    first = {line.split()[0] for line in result.out.splitlines() if line.strip()}
    assert {"BSC103", "TPZ001", "MS2000", "long_status", "colon_in_data", "flood", "RACK"} <= first
    assert "[byte|frame]" in result.out


def test_each_unit_has_a_line_and_for_ends_the_command(stagewire: Stagewire) -> None:
    result = stagewire("virtual", "TDC001", "bpc301", "--for", "0.01")
    assert result.code == 0
    lines = result.out.splitlines()
    assert [line.rpartition(":")[0] for line in lines] == [
        "TDC001 at socket://127.0.0.1",
        "BPC301 at socket://127.0.0.1",
    ]


def test_command_line_options_match_those_of_a_bench() -> None:
    makers = of_names(
        ["TDC001", "TDC001"], "4001", False, None, {"seed": 0, "position": 7, "quirks": None}
    )
    links = [make(SteppedClock(), Observer()) for make in makers]
    assert [link.url for link in links] == ["socket://127.0.0.1:4001", "socket://127.0.0.1:4002"]
    assert len({link.label for link in links}) == 2


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ([], "--bench or --replay"),
        (["TDC001", "--bench", "x.toml"], "give only one of UNIT and --bench"),
        (
            ["--replay", "x", "--seed", "1"],
            "--seed only applies to units named on the command line",
        ),
        (
            ["--bench", "x.toml", "--quirk", "long_status"],
            "--quirk only applies to units named on the command line",
        ),
        (["TDC001", "--lenient"], "--lenient requires --replay"),
        (["TDC001", "--tcp", "1", "--pty"], "--tcp and --pty"),
        (["TDC01"], "did you mean TDC001"),
        (["TDC001", "--tcp", "0.0.0.0:0"], "--bind 0.0.0.0"),
        (["TDC001", "--tcp", "65536"], "65535"),
        (["TDC001", "--tcp", "here:there"], "here:there"),
        (["TDC001", "BSC103", "--tcp", "65535"], "65536"),
        (["TDC001", "--bind", "203.0.113.9"], "203.0.113.9"),
        (["TDC001", "--bind", "nosuch.invalid"], "cannot listen on nosuch.invalid:0: "),
        (["TDC001", "--stage", "Z9"], "--stage: "),
        (["TDC001", "--stage", "Z91"], "unknown stage Z91; did you mean Z912"),
        (["TDC001", "--travel", "0"], "(TDC001), --travel: TDC001 requires a travel"),
        (["TDC001", "--travel", "9", "--position", "10"], ", --travel, --position: "),
        (["TDC001", "--travel", "1 mm"], "'--travel': expected a whole number, not '1 mm'"),
        (["TDC001", "--position", "x"], "'--position': expected a whole number, not 'x'"),
        (["TDC001", "--seed", "1.5"], "'--seed': expected a whole number, not '1.5'"),
        (["TDC001", "--model", "KDC101-LONG"], "--model: model must have 1 to 8"),
        (
            ["TDC001", "--serial-number", "2147483648"],
            "--serial-number: serial number must be from 1 to 2147",
        ),
        (["TDC001", "--serial-number", "x"], "'--serial-number': expected a whole number"),
        (
            ["TDC001", "--hardware-type", "65536"],
            "--hardware-type: hardware type must be from 0 to 65535",
        ),
        (["TDC001", "--stage-id", "-1"], "--stage-id: stage id must be from 0 to 65535"),
        (["MS2000", "--model", "MS"], "--model: MS2000 does not report a model"),
        (
            ["--replay", "x", "--stage-id", "7"],
            "--stage-id only applies to units named on the command line",
        ),
        (["TDC001", "RACK"], "serve it with --bench FILE"),
        (["RAK"], "did you mean RACK?"),
        (["TDC001", "--quirk", "none"], "long_status"),
        (["TDC001", "--fault", "to_host fly"], "duplicate"),
        (["TDC001", "--line", "wire"], "rs232"),
        (["MS2000", "--strategy", "colon_in_data"], "NAME=VALUE"),
        (["MS2000", "--strategy", "colon_in_data=maybe"], "end"),
        *(
            (["TDC001", "--for", time], f"'--for': expected a number of seconds, not '{time}'")
            for time in ("-1", "inf", "nan", "x")
        ),
        (["TDC001", "--log", "no/such/folder/log.txt"], "no/such/folder/log.txt"),
        (["--bench", "no-such-file.toml"], "no-such-file.toml"),
        (["--replay", "no-such-file.txt"], "no-such-file.txt"),
    ],
)
def test_wrong_arguments_are_refused(
    stagewire: Stagewire,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    words: Sequence[str],
    said: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    result = stagewire("virtual", *words, *([] if "--for" in words else ["--for", "0"]))
    assert result.code == 2
    assert said in result.err
    assert "[errno" not in result.err.lower()
    assert result.out == ""


def test_a_port_in_use_is_an_error(stagewire: Stagewire) -> None:
    with closing(socket.create_server(("127.0.0.1", 0))) as taken:
        port = taken.getsockname()[1]
        result = stagewire("virtual", "TDC001", "--tcp", port, "--for", "0")
    assert result.code == 2
    assert f"127.0.0.1:{port}" in result.err


def test_a_log_does_not_replace_its_source(stagewire: Stagewire, tmp_path: Path) -> None:
    session, bench = tmp_path / "session.txt", tmp_path / "bench.toml"
    session.write_text(f"# stagewire capture 1 protocol=thorlabs_apt\n0 > {INFO.hex()}\n")
    bench.write_text('[[unit]]\nname = "TDC001"\n')
    for option, source in (("--replay", session), ("--bench", bench)):
        before = source.read_text()
        result = stagewire("virtual", option, source, "--log", source, "--for", "0")
        assert result.code == 2
        assert f"--log {source}" in result.err
        assert source.read_text() == before


def test_a_log_is_kept_if_serving_fails(stagewire: Stagewire, tmp_path: Path) -> None:
    log = tmp_path / "log.txt"
    log.write_text("the last session")
    with closing(socket.create_server(("127.0.0.1", 0))) as taken:
        port = taken.getsockname()[1]
        result = stagewire("virtual", "TDC001", "--tcp", port, "--log", log, "--for", "0")
    assert result.code == 2
    assert log.read_text() == "the last session"
    assert stagewire("virtual", "TDC001", "--log", log, "--for", "0").code == 0
    assert log.read_text() == "# stagewire capture 1 protocol=thorlabs_apt unit=TDC001\n"


def test_a_file_that_is_not_a_capture_is_refused(stagewire: Stagewire, tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("05 00 00 00 50 01\n")
    result = stagewire("virtual", "--replay", tmp_path / "notes.txt")
    assert result.code == 2
    assert "notes.txt" in result.err


def test_a_capture_of_an_unknown_protocol_is_refused(stagewire: Stagewire, tmp_path: Path) -> None:
    session = tmp_path / "session.txt"
    session.write_text("# stagewire capture 1 protocol=nothing\n")
    result = stagewire("virtual", "--replay", session, "--for", "0")
    assert result.code == 2
    assert f"{session}, line 1: no protocol nothing" in result.err


def test_all_problems_of_a_bench_are_printed(stagewire: Stagewire, tmp_path: Path) -> None:
    bench = tmp_path / "bench.toml"
    bench.write_text('[[unit]]\nname = "TDC01"\n\n[[unit]]\nname = "BSC103"\nsped = 1\n')
    result = stagewire("virtual", "--bench", bench)
    assert result.code == 2
    assert "TDC01" in result.err
    assert "sped" in result.err


def test_other_commands_do_not_import_virtual_controllers() -> None:
    code = "import sys, stagewire_cli.main as main; main.command(); print(*sys.modules)"
    loaded = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert not {"stagewire_virtual", "asyncio"} & set(loaded.stdout.split())


# During a session


@posix
def test_a_logged_session_can_be_replayed(tmp_path: Path) -> None:
    log = tmp_path / "session.txt"
    with running("TDC001", "--log", log) as serving:
        answer = ask(serving.places["TDC001"], INFO)
        assert serving.end(signal.SIGTERM)[0] == 0
    capture = read_capture(log)
    assert (capture.heading.protocol, capture.heading.unit) == ("thorlabs_apt", "TDC001")
    assert [recorded.data for recorded in capture.recorded] == [INFO, answer]
    assert capture.recorded[0].comment == "0x01->0x50 HW_REQ_INFO"
    assert capture.recorded[1].comment.startswith("0x50->0x01 HW_GET_INFO serial_number=83")

    with running("--replay", log) as playing:
        assert ask(*playing.places.values(), INFO) == answer
        code, _, err = playing.end()
    assert code == 0
    assert "1 of 1 recorded requests" in err

    with running("--replay", log) as playing:
        assert ask(*playing.places.values(), ENABLE_STATE, size=0) == b""
        code, _, err = playing.end()
    assert code == 1
    assert "MOD_REQ_CHANENABLESTATE" in err


@posix
def test_a_replay_reports_the_recorded_identity(tmp_path: Path) -> None:
    log = tmp_path / "session.txt"
    words = (
        "--model",
        "KDC101",
        "--serial-number",
        27000001,
        "--hardware-type",
        16,
        "--stage-id",
        7,
    )
    with running("TDC001", *words, "--log", log) as serving:
        answer = ask(serving.places["TDC001"], INFO)
        assert serving.end(signal.SIGTERM)[0] == 0
    assert answer[6:20] == (27000001).to_bytes(4, "little") + b"KDC101\0\0\x10\0"
    assert answer[6 + 76 : 6 + 78] == b"\7\0"
    with running("--replay", log) as playing:
        assert ask(*playing.places.values(), INFO) == answer
        assert playing.end()[0] == 0


@posix
@pytest.mark.parametrize(("words", "answer"), [([], b""), (["--lenient"], b"\x12\x02")])
def test_a_lenient_replay_continues_at_the_received_request(
    tmp_path: Path, words: list[str], answer: bytes
) -> None:
    session = tmp_path / "session.txt"
    lines = [f"0 > {INFO.hex()}", "0 < 06 00", f"1 > {ENABLE_STATE.hex()}", "1 < 12 02"]
    session.write_text("\n".join(["# stagewire capture 1 protocol=thorlabs_apt", *lines]))
    with running("--replay", session, *words) as playing:
        assert ask(*playing.places.values(), ENABLE_STATE, size=len(answer)) == answer
        code, _, err = playing.end()
    assert code == 1
    assert "HW_REQ_INFO" in err


@posix
def test_a_log_on_standard_output_has_it_alone(tmp_path: Path) -> None:
    with running("TDC001", "--log", "-") as serving:
        ask(serving.places["TDC001"], INFO)
        code, out, _ = serving.end(signal.SIGINT)
    assert code == 0
    (tmp_path / "out.txt").write_text(out)
    assert [recorded.data[:1] for recorded in read_capture(tmp_path / "out.txt").recorded] == [
        b"\x05",
        b"\x06",
    ]


@posix
def test_several_units_have_separate_logs(tmp_path: Path) -> None:
    with running("TDC001", "MS2000", "--log", tmp_path / "log.txt", units=2) as serving:
        ask(serving.places["TDC001"], INFO)
        assert serving.end(signal.SIGTERM)[0] == 0
    first, second = (read_capture(tmp_path / f"log-{number}.txt") for number in (1, 2))
    assert (first.heading.unit, len(first.recorded)) == ("TDC001", 2)
    assert (second.heading.unit, len(second.recorded)) == ("MS2000", 0)
    with running("TDC001", "MS2000", "--log", "-", units=2) as serving:
        ask(serving.places["TDC001"], INFO)
        _, out, _ = serving.end(signal.SIGTERM)
    assert {line.partition(": ")[0] for line in out.splitlines()} == {"TDC001", "MS2000"}


@posix
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_bench_on_a_pty_removes_its_links(tmp_path: Path, number: int) -> None:
    bench, port = tmp_path / "bench.toml", tmp_path / "x-stage"
    bench.write_text(f'[[unit]]\nname = "TDC001"\nlabel = "x stage"\npty = "{port}"\n')
    with running("--bench", bench) as serving:
        assert serving.places == {"x stage": str(port)}
        assert port.is_symlink()
        assert serving.end(number)[0] == 0
    assert not port.is_symlink()


@posix
def test_faults_are_printed(tmp_path: Path) -> None:
    log = tmp_path / "log.txt"
    fault = "to_host drop frame at=1"
    with running("TDC001", "--fault", fault, "--log", log) as serving:
        ask(serving.places["TDC001"], INFO + ENABLE_STATE, size=6)
        assert serving.end(signal.SIGTERM)[0] == 0
    assert "drop" in log.read_text()
    with running("TDC001", "--fault", fault) as serving:
        ask(serving.places["TDC001"], INFO + ENABLE_STATE, size=6)
        _, _, err = serving.end(signal.SIGTERM)
    assert "TDC001: " in err
    assert "drop" in err


def test_a_second_host_is_turned_away_with_a_note(stagewire: Stagewire, tmp_path: Path) -> None:
    for words in ((), ("--log", tmp_path / "log.txt")):
        with running("TDC001", *words) as serving:
            url = serving.places["TDC001"]
            parts = urlsplit(url)
            with socket.create_connection((parts.hostname, parts.port)) as first:
                first.sendall(INFO)
                assert first.recv(1)
                for options in ((), ("--unit", "TDC001")):
                    result = stagewire("home", url, "--yes", *options)
                    assert result.code == 1
                    assert "Another host may be connected" in result.err
                    assert "carried out" not in result.err
            _, _, err = serving.end(signal.SIGTERM)
        said = (tmp_path / "log.txt").read_text() if words else err
        assert "turned away: a line has one host" in said


@posix
@pytest.mark.parametrize(("columns", "shown_when_wide"), [("80", False), ("160", True)])
def test_a_terminal_shows_a_live_table(columns: str, shown_when_wide: bool) -> None:
    import pty

    ours, theirs = pty.openpty()
    environment = {**os.environ, "TERM": "xterm", "COLUMNS": columns}
    words = ["BSC103", "--stage", "APT_STEPPER", "--for", "0.3"]
    with subprocess.Popen([*COMMAND, *words], stdout=theirs, stderr=theirs, env=environment) as run:
        os.close(theirs)
        shown = b""
        try:
            while part := os.read(ours, 4096):
                shown += part
        except OSError:  # a pty raises this when the other end is closed
            pass
        assert run.wait(20) == 0
    os.close(ours)
    text = shown.decode()
    assert "BSC103 at socket://" in text
    for whole in ("position", "state", " mm", "bay 2, channel 1"):
        assert whole in text
    assert ("frames out" in text) is shown_when_wide


@posix
def test_a_closed_pipe_ends_a_log_on_standard_output() -> None:
    with running("TDC001", "--log", "-") as serving:
        assert serving.process.stdout is not None
        serving.process.stdout.close()
        ask(serving.places["TDC001"], INFO)
        assert serving.process.wait(20) == 1
        assert serving.process.stderr is not None
        assert "Traceback" not in serving.process.stderr.read()
