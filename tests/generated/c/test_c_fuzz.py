"""A short, seeded run of the fuzz targets, and tests that they find broken code.

``libfuzzer.py`` is the program for long runs.
"""

from __future__ import annotations

import json
import shutil
from collections import Counter
from pathlib import Path

import libfuzzer
import pytest
from toolchain import C, need

EXECUTIONS = 160_000
SEED = 1


def short(name: str, c: Path, objects: Path, folder: Path) -> libfuzzer.Ran:
    """Build a target and run it for a short time."""
    program = libfuzzer.build(name, c, objects, "-O1", "-g0")
    corpus = folder / "corpus"
    corpus.mkdir()
    assert libfuzzer.write_corpus(name, C, corpus) > 50
    return libfuzzer.fuzz(program, corpus, EXECUTIONS, SEED, folder / "kept")


@pytest.fixture(scope="module")
def objects(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder for objects that several targets share."""
    return tmp_path_factory.mktemp("objects")


@pytest.mark.matrix
@pytest.mark.parametrize("name", libfuzzer.TARGETS)
def test_the_targets_find_nothing(name: str, objects: Path, tmp_path: Path) -> None:
    need("clang", "clang -fsanitize")
    ran = short(name, C, objects, tmp_path)
    assert ran.code == 0, ran.said
    assert ran.executions >= EXECUTIONS
    assert ran.seen or "codec" in name
    assert libfuzzer.never_seen(name, ran.seen) == []


BROKEN = {
    "a byte is read behind the frame": (
        *("apt_codec", "wire.h"),
        *("size < APT_HEADER_SIZE", "size < 4U"),
    ),
    "an event is too short": (
        *("ms2000_parser", "stagewire_ms2000.c"),
        *("event->size = parser->held;", "event->size = parser->held - (parser->held > 9U);"),
    ),
    "an array has too many integers": (
        *("apt_codec", "messages/motor.h"),
        "message->time_pos.count != apt_mot_set_movesyncharray_0a00_count(message)",
        "message->time_pos.count < apt_mot_set_movesyncharray_0a00_count(message)",
    ),
    "a sign is lost": (
        *("ms2000_codec", "wire.h"),
        *("(int32_t)moved - INT32_C(0x800000)", "(int32_t)moved - INT32_C(0x7FFFFF)"),
    ),
}


@pytest.mark.matrix
@pytest.mark.parametrize("what", BROKEN)
def test_broken_code_is_found(what: str, tmp_path: Path) -> None:
    need("clang", "clang -fsanitize")
    name, file, right, wrong = BROKEN[what]
    broken = tmp_path / "c"
    shutil.copytree(C, broken)
    path = broken / libfuzzer.TARGETS[name].package / file
    text = path.read_text(encoding="utf-8")
    assert right in text
    path.write_text(text.replace(right, wrong), encoding="utf-8")
    ran = short(name, broken, tmp_path, tmp_path)
    assert ran.code != 0
    assert list((tmp_path / "kept").iterdir()), "the input was not kept"


# The program counts executions and events


def fake(monkeypatch: pytest.MonkeyPatch, ran: libfuzzer.Ran) -> None:
    monkeypatch.setattr(libfuzzer, "build", lambda name, *_: Path(name))
    monkeypatch.setattr(libfuzzer, "write_corpus", lambda *_: 0)
    monkeypatch.setattr(libfuzzer, "fuzz", lambda *_: ran)


def test_a_run_passes_if_all_executions_and_events_occurred(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    fake(monkeypatch, libfuzzer.Ran(0, 3, Counter({"message": 1}), ""))
    assert libfuzzer.run(24, SEED, 2, C) == 0


@pytest.mark.parametrize(
    ("ran", "word"),
    [
        (libfuzzer.Ran(0, 2, Counter(message=1), ""), "too few executions"),
        (libfuzzer.Ran(0, 3, Counter(message=0), ""), "never seen: apt_parser message"),
        (libfuzzer.Ran(77, 3, Counter(message=1), "ERROR: libFuzzer"), "ERROR: libFuzzer"),
    ],
    ids=["too few", "never seen", "failed"],
)
def test_a_run_fails(
    ran: libfuzzer.Ran,
    word: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    fake(monkeypatch, ran)
    assert libfuzzer.run(24, SEED, 2, C) == 1
    assert word in capsys.readouterr().out


@pytest.mark.parametrize(
    ("message", "kinds"),
    [
        ({"id": 5, "layouts": []}, ["message", "undocumented"]),
        ({"id": 5, "layouts": [{"form": "header"}]}, ["message"]),
        ({"id": None, "layouts": []}, ["message"]),
    ],
    ids=["undocumented", "documented", "no id"],
)
def test_only_events_that_a_package_can_produce_are_expected(
    message: dict[str, object], kinds: list[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    path = tmp_path / "stagewire_apt" / "registry.json"
    path.parent.mkdir()
    path.write_text(json.dumps({"messages": [message]}), encoding="utf-8")
    monkeypatch.setattr(libfuzzer, "REGISTRIES", tmp_path)
    seen = Counter(message=0, undocumented=0, garbage=1)
    assert libfuzzer.never_seen("apt_parser", seen) == kinds


def test_all_requested_executions_are_distributed() -> None:
    for executions in (1, 99, 20_000_000):
        for processes in (1, 2, 3):
            given = sum(job.executions for job in libfuzzer.jobs(executions, processes))
            assert given >= executions
    assert sum(target.share for target in libfuzzer.TARGETS.values()) == 100


def test_the_program_generates_the_c_with_its_tests(monkeypatch: pytest.MonkeyPatch) -> None:
    fuzzed: list[Path] = []

    def run(executions: int, seed: int, processes: int, c: Path) -> int:
        fuzzed.append(c)
        return 0

    monkeypatch.setattr(libfuzzer.tools, "why_not", lambda _: "")
    monkeypatch.setattr(libfuzzer, "run", run)
    assert libfuzzer.main([]) == 0
    for target in libfuzzer.TARGETS.values():
        assert (fuzzed[0] / target.package / "testing" / "layouts.c").is_file()
