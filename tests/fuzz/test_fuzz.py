"""Short, seeded runs of all fuzzers, and tests that the fuzzers find defects.

The programs for long runs are ``atheris_codec.py``, ``memory_growth.py`` and ``user_input.py``.
"""

from __future__ import annotations

import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import nullcontext
from pathlib import Path
from random import Random

import command_streams
import properties
import pytest
import spec_cases
import streams
import user_input
from sandbox import Case, Ran, Sandbox, Wrong
from streams import PROTOCOL

import stagewire_cli.main
from quick_specs import quick_specs
from spec_schemas import spec_kinds
from stagewire.framing import CommandFramer, Event, Framer, ReplyDecoder
from stagewire.protocols import CommandFrame, Frame

HERE = Path(__file__).parent
SEED = 1
LIMIT = 60.0  # far longer than any case takes, even on a busy machine

CASES = {
    "spec-text": 40,
    "spec-tree": 40,
    "manifest": 30,
    "diff": 25,
    "hex": 150,
    "captures": 150,
    "encode": 200,
    "show": 100,
    "testee": 60,
    "conformance": 12,
    "arguments": 120,
    "bench": 60,
    "replay": 60,
    "fault": 60,
    "pics": 60,
    "expected": 12,
}

PARTS = pytest.mark.parametrize("part", [20, pytest.param(1, marks=pytest.mark.matrix)])
"""`make test` runs one case in 20, `make test-all` runs all."""

OF_A_SPEC = ("spec-text", "spec-tree", "manifest", "diff")
"""Targets that change small parts of a good spec."""


@pytest.fixture
def sandbox(tmp_path: Path) -> Sandbox:
    return Sandbox(tmp_path, LIMIT)


# The codec and the framer


@pytest.fixture
def seen() -> Iterator[list[int]]:
    """Count the events of the properties in a new list."""
    tally = [0] * len(properties.SEEN)
    properties.count_in(tally)
    yield tally
    properties.count_in([0] * len(properties.SEEN))


def run_properties(streamed: int, coded: int, commanded: int = 0) -> None:
    rng = Random(SEED)
    for data in streams.beginnings("stream"):
        properties.check_stream(data)
    for data in streams.beginnings("codec"):
        properties.check_codec(data)
    data = b""
    for _ in range(streamed):
        data = streams.change_stream(rng, data)
        properties.check_stream(data)
        properties.check_stream(streams.new_stream(rng))
    for _ in range(coded):
        data = streams.change_codec(rng, data)
        properties.check_codec(data)
        properties.check_codec(streams.new_codec(rng))
    data = b""
    for _ in range(commanded):
        data = command_streams.change_commands(rng, data)
        properties.check_commands(data)
        properties.check_commands(command_streams.new_commands(rng))


@PARTS
def test_the_properties_hold_and_every_kind_of_event_occurs(part: int, seen: list[int]) -> None:
    run_properties(3000 // part, 10_000 // part, 3000 // part)
    assert [name for name, number in zip(properties.SEEN, seen, strict=True) if not number] == []


def lose_garbage(feed: Callable[..., list[Event]]) -> Callable[..., list[Event]]:
    def broken(framer: Framer, data: bytes) -> list[Event]:
        return [event for event in feed(framer, data) if type(event).__name__ != "Garbage"]

    return broken


def look_at_reads(feed: Callable[..., list[Event]]) -> Callable[..., list[Event]]:
    def broken(framer: Framer, data: bytes) -> list[Event]:
        return (
            feed(framer, data[:-1]) + feed(framer, data[-1:]) + framer.abandon() * (len(data) == 5)
        )

    return broken


def drop_extra(encode: Callable[[Frame], bytes]) -> Callable[[Frame], bytes]:
    return lambda frame: frame.message.pack(frame.dest, frame.source)


def drop_ignored(encode: Callable[..., bytes]) -> Callable[..., bytes]:
    def broken(frame: CommandFrame, **options: bool) -> bytes:
        if frame.extra:
            frame = CommandFrame(frame.message, frame.axis, sized=frame.sized)
        return encode(frame, **options)

    return broken


def forget_to_poison(abandon: Callable[[ReplyDecoder], list[Event]]) -> Callable[..., list[Event]]:
    def broken(decoder: ReplyDecoder) -> list[Event]:
        events = abandon(decoder)
        decoder.drained()
        return events

    return broken


@pytest.mark.parametrize(
    ("owner", "name", "breaking"),
    [
        (Framer, "feed", lose_garbage),
        (Framer, "feed", look_at_reads),
        (Frame, "encode", drop_extra),
        (CommandFramer, "feed", lose_garbage),
        (CommandFrame, "encode", drop_ignored),
        (ReplyDecoder, "abandon", forget_to_poison),
    ],
    ids=[
        "garbage is lost",
        "events depend on the chunks",
        "extra bytes are lost",
        "garbage between commands is lost",
        "ignored bytes are lost",
        "a late reply answers the next request",
    ],
)
def test_the_properties_detect_a_broken_codec(
    owner: type, name: str, breaking: Callable[..., object], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(owner, name, breaking(getattr(owner, name)))
    with pytest.raises(AssertionError):
        run_properties(300, 300, 300)


def test_the_properties_detect_an_undocumented_exception(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object) -> None:
        raise KeyError("id")

    monkeypatch.setattr(PROTOCOL, "decode", broken)
    with pytest.raises(KeyError):
        properties.check_codec(bytes(7))


def test_generated_frames_cover_every_message_id() -> None:
    rng = Random(SEED)
    met = {int.from_bytes(streams.frame(rng)[:2], "little") for _ in range(20_000)}
    assert met >= streams.IDS


@pytest.mark.matrix
def test_memory_does_not_grow_with_the_stream() -> None:
    command = [sys.executable, str(HERE / "memory_growth.py"), "--frames", "100000"]
    ran = subprocess.run(command, capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stdout + ran.stderr
    assert "grown by" in ran.stdout


# User input of the command


@PARTS
@pytest.mark.parametrize("target", user_input.TARGETS)
def test_any_user_input_ends_with_a_documented_exit_status(
    target: str, part: int, sandbox: Sandbox
) -> None:
    cases = max(2, CASES[target] // part)
    with quick_specs() if target in OF_A_SPEC else nullcontext():
        codes = user_input.fuzz(sandbox, target, SEED, cases=cases, as_process=0)
    assert codes.total() == cases
    assert len(codes) > 1 or target == "testee" or part > 1, (
        "every case ended with the same exit status"
    )


@pytest.mark.parametrize("target", ["spec-tree", "captures", "encode", "testee"])
def test_a_separate_process_gives_the_same_result(target: str, sandbox: Sandbox) -> None:
    case = user_input.case_of(target, SEED, 0)
    here, apart = sandbox.run(case), sandbox.run(case, as_process=True)
    assert (apart.code, apart.out, apart.err) == (here.code, here.out, here.err)


def test_every_kind_of_spec_file_is_damaged() -> None:
    made = [user_input.case_of("spec-tree", SEED, number) for number in range(500)]
    assert {name for case in made for name in case.files} >= {f"spec/{n}" for n in spec_cases.FILES}
    assert spec_kinds() == set(spec_cases.KINDS)


Main = Callable[[Sequence[str]], int]


def writes(path: str) -> Main:
    def main(arguments: Sequence[str]) -> int:
        Path(path).write_text("x", encoding="utf-8")
        return 0

    return main


def raises(arguments: Sequence[str]) -> int:
    raise ValueError("a bug")


def hangs(arguments: Sequence[str]) -> int:
    while True:
        time.sleep(0.01)


def removes(arguments: Sequence[str]) -> int:
    Path("../precious/file.txt").unlink()
    return 0


def starts(arguments: Sequence[str]) -> int:
    return subprocess.call(["true"])


def listens(address: str) -> Main:
    def main(arguments: Sequence[str]) -> int:
        with socket.socket() as line:
            line.bind((address, 0))
        return 0

    return main


def prints(text: str, code: int = 0) -> Main:
    def main(arguments: Sequence[str]) -> int:
        print(text)
        return code

    return main


@pytest.mark.parametrize(
    ("main", "found"),
    [
        (raises, "ValueError: a bug"),
        (hangs, "still running after"),
        (prints("", 3), "exit status 3"),
        (prints("", 1), "exit status 1 without a message"),
        (prints("", 2), "exit status 2 without a message"),
        (prints("Traceback (most recent call last)\n"), "a traceback"),
        (prints("\x1b[2J"), "control a terminal"),
        (writes("here.txt"), "forbidden operation: open"),
        (writes("../outside.txt"), "forbidden operation: open"),
        (writes("out/../../precious/file.txt"), "forbidden operation: open"),
        (removes, "forbidden operation: os.remove"),
        (starts, "forbidden operation: subprocess.Popen"),
        (listens("127.0.0.1"), "forbidden operation: socket.bind"),
    ],
)
def test_the_sandbox_detects_a_broken_command(
    main: Main, found: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(stagewire_cli.main, "main", main)
    seconds = 0.5 if main is hangs else LIMIT
    case = Case((), files={"out/readme.txt": b""}, may_write="out")
    with pytest.raises(Wrong, match=found):
        Sandbox(tmp_path, seconds).run(case)
    assert signal.getitimer(signal.ITIMER_REAL)[0] == 0


def test_writing_to_the_allowed_folder_passes(
    sandbox: Sandbox, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(stagewire_cli.main, "main", writes("out/made.txt"))
    ran = sandbox.run(Case((), files={"out/readme.txt": b""}, may_write="out"))
    assert (ran.folder / "out" / "made.txt").read_text(encoding="utf-8") == "x"


def test_a_case_that_may_listen_may_bind_local_addresses_only(
    sandbox: Sandbox, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(stagewire_cli.main, "main", listens("127.0.0.1"))
    sandbox.run(Case((), may_listen=True))
    monkeypatch.setattr(stagewire_cli.main, "main", listens("0.0.0.0"))
    with pytest.raises(Wrong, match=r"forbidden operation: socket.bind .*'0\.0\.0\.0'"):
        sandbox.run(Case((), may_listen=True))


def test_a_failure_is_minimised_and_can_be_repeated(
    sandbox: Sandbox, monkeypatch: pytest.MonkeyPatch
) -> None:
    def chokes(arguments: Sequence[str]) -> int:
        if b"?" in sys.stdin.buffer.read():
            raise ValueError("a bug")
        return 0

    monkeypatch.setattr(stagewire_cli.main, "main", chokes)
    case = Case(("decode", "-"), stdin=b"53 04 06 00 ? 01\n" * 40, files={"a.txt": b"1"})
    monkeypatch.setitem(user_input.TARGETS, "hex", lambda rng: case)
    with pytest.raises(user_input.Failure) as failure:
        user_input.fuzz(sandbox, "hex", SEED, cases=1)
    assert "--target hex --seed 1 --first 0 --cases 1" in str(failure.value)
    assert "standard input: b'?'" in str(failure.value)
    assert "a.txt" not in str(failure.value)


def test_a_missing_answer_of_the_testee_is_detected(sandbox: Sandbox) -> None:
    case = user_input.case_of("testee", SEED, 0)
    ran = sandbox.run(case)
    with pytest.raises(Wrong, match="answers to"):
        case.holds(case, Ran(0, ran.out + ran.out, b"", ran.folder))
