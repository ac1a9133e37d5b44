"""The cases for codecs, expected failures, and the texts of failures."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from broken_codecs import NAMES, InProcess
from testee_calls import REQUEST

from checkout import TESTS
from invented_packets import PROTOCOL as PACKETS
from stagewire.protocols import load_protocol
from stagewire_conformance.testee import Testee
from stagewire_conformance.testees import (
    Case,
    ExpectedFileError,
    Outcome,
    Report,
    Result,
    chosen,
    read_expected,
    run,
)
from stagewire_conformance.testees.case import EndedError, ask
from stagewire_conformance.testees.explanation import name_at
from stagewire_conformance.testees.runner import plan
from stagewire_conformance.testees.session import STARTS, Session

Json = dict[str, Any]
PROTOCOLS = [load_protocol(name) for name in NAMES]
ALL_POSITIONS, EACH_END, BETWEEN = 1000, 128, 64
"""Bytes of a stream that is split at all positions, of each end of a longer one, and between its splits."""


@cache
def cases() -> list[Case]:
    """Every case, in order."""
    return plan(PROTOCOLS, seed=1)


# Cases


def test_every_case_of_the_vectors_is_included() -> None:
    asked = {case.id for case in cases()}
    assert len(asked) == len(cases())
    for protocol in PROTOCOLS:
        for case in protocol.vectors()["cases"]:
            assert f"{protocol.name}/{case['id']}" in asked


def test_every_example_and_capture_with_bytes_is_included() -> None:
    asked = {case.id.rpartition("/")[0] for case in cases()}
    for protocol in PROTOCOLS:
        vectors = protocol.vectors()
        for kind in ("examples", "captures"):
            for entry in vectors[kind]:
                # a displayed reply is text, and a terminal may have lost bytes
                bytes_ = "form" in entry and "shown" not in entry
                assert (f"{protocol.name}/{kind}/{entry['id']}" in asked) == bytes_


def test_every_stream_is_split_at_every_position_or_at_many_if_it_is_long() -> None:
    asked = {case.id: case for case in cases()}
    for protocol in PROTOCOLS:
        seen = set()
        for case in protocol.vectors()["cases"]:
            request = case["request"]
            if request.get("op") != "stream" or not case["answer"]["ok"]:
                continue
            raw = "".join(request["chunks"])
            rest = json.dumps({**request, "chunks": []}, sort_keys=True)
            if len(raw) < 4 or (key := raw + rest) in seen:
                continue
            seen.add(key)
            steps = asked[f"{protocol.name}/cut/{case['id']}"].steps
            chunks = [step.request["chunks"] for step in steps if step.request]
            places = {len(pieces[0]) for pieces in chunks if len(pieces) == 2}
            if len(raw) <= 2 * ALL_POSITIONS:
                assert places == {*range(2, len(raw), 2)}
            else:
                ends = {*range(2, 2 * EACH_END + 2, 2)}
                assert places >= ends | {len(raw) - at for at in ends}
                between = sorted(places)
                assert max(after - at for at, after in pairwise(between)) <= 2 * BETWEEN
            assert [raw] in chunks
            assert [raw[at : at + 2] for at in range(0, len(raw), 2)] in chunks
            assert {"".join(pieces) for pieces in chunks} == {raw}


def test_every_protocol_has_all_large_cases() -> None:
    large = Counter(case.protocol for case in cases() if case.group.endswith("/large"))
    assert large == dict.fromkeys(NAMES, 6)


def test_random_cases_depend_on_the_seed() -> None:
    def lines(seed: int) -> list[bytes]:
        cases = plan(PROTOCOLS, seed)
        return [step.line(1) for case in cases for step in case.steps if len(step.line(1)) < 10_000]

    first = lines(1)
    assert first == lines(1)
    different = [one for one, other in zip(first, lines(2), strict=False) if one != other]
    assert len(different) > 1000


def test_hostile_lines_violate_the_schema() -> None:
    """Lines that must be refused violate the schema, and lines that must be granted satisfy it."""
    for case in cases():
        if case.group != "lines":
            continue
        step = case.steps[0]
        try:
            request = json.loads(step.line(1))
        except (ValueError, RecursionError):
            assert step.wanted.get("error", "bad_request") == "bad_request", case.id
            continue
        if step.wanted.get("ok"):
            assert REQUEST.is_valid(request), case.id
        elif step.wanted and "NaN" not in case.id:
            assert not REQUEST.is_valid(request) or step.wanted["error"] == "unsupported", case.id


def test_patterns_select_cases() -> None:
    assert chosen(cases(), ()) == cases()
    assert {case.message for case in chosen(cases(), ["MOT_SET_VELPARAMS"])} == {
        "MOT_SET_VELPARAMS"
    }
    assert {case.group for case in chosen(cases(), ["*/large", "order"])} == {
        "asi_ms2000/large", "thorlabs_apt/large", "order",
    }  # fmt: skip
    (one,) = chosen(cases(), ["thorlabs_apt/MOT_MOVE_HOME/header/encode/plain"])
    assert one.steps[0].wanted == {"ok": True, "hex": "430401005001"}


def test_a_third_party_protocol(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(TESTS / "support" / "installed"))
    report = run([], [PACKETS], start=lambda: InProcess(Testee().answer))
    assert report.failures() == []
    assert {"invented_packets/examples", "lines", "order"} <= {r.case.group for r in report.results}


# Expected failures


def written(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "expected.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_expected_failures(tmp_path: Path) -> None:
    path = written(
        tmp_path,
        "schema_version = 1\n"
        '[[expected]]\nid = "asi_ms2000/WRITE_TOP_SPEED/*/encode/p*"\nreason = "ours differs"\n'
        '[[expected]]\nid = "asi_ms2000/WRITE_TOP_SPEED/*/encode/plain"\nreason = "never read"\n'
        '[[expected]]\nid = "thorlabs_apt/MOT_*"\nreason = "not run here"\n',
    )

    def mute(line: bytes) -> Json:
        said = Testee().answer(line)
        return {**said, "hex": "00"} if b'"op": "encode"' in line and "hex" in said else said

    report = run(
        [],
        [PROTOCOLS[0]],
        only=["WRITE_TOP_SPEED"],
        expected=read_expected(path),
        start=lambda: InProcess(mute),
    )
    found = {result.case.id.partition("WRITE_TOP_SPEED/")[2]: result for result in report.results}
    plain = found["request/encode/plain"]
    assert (plain.outcome, plain.expected, plain.failed) == (Outcome.FAILED, "ours differs", False)
    assert plain.word == "failed, as expected"
    safe = found["request/encode/prefix.extra"]  # correctly refused
    assert (safe.outcome, safe.failed, safe.word) == (Outcome.PASSED, True, "unexpected pass")
    other = found["request/encode/direction"]
    assert (other.expected, other.failed, other.word) == ("", True, "failed")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("x", "not a TOML file"),
        ("", "missing schema_version; write schema_version = 1"),
        ("schema_version = true", "schema_version must be 1, not True"),
        (
            "schema_version = 1\n" + '[[expected]]\nid = "a"\nreason = "b"\n' * 2,
            "'a' is listed 2 times",
        ),
        ("schema_version = 1\nwhy = 1", "unknown key 'why'"),
        ("schema_version = 1\nexpected = 1", "expected must be a list of tables"),
        ("schema_version = 1\nexpected = [1]", "expected 1 is not a table"),
        (
            'schema_version = 1\n[[expected]]\nid = "a"',
            "expected 1: reason must be a non-empty string",
        ),
        ('schema_version = 1\n[[expected]]\nid = 1\nreason = " "', "expected 1: id must be a"),
        ('schema_version = 1\n[[expected]]\nid = "a"\nreason = "b"\nx = 1', "unknown key 'x'"),
        ('schema_version = 1\n[[expected]]\nid = "a"\nreason = "b"', "no case matches 'a'"),
        (
            'schema_version = 1\n[[expected]]\nid = "asi_ms2000/NOTHING/*"\nreason = "b"',
            "no case matches 'asi_ms2000/NOTHING/*'",
        ),
    ],
)
def test_an_invalid_file_of_expected_failures_is_refused(
    tmp_path: Path, text: str, said: str
) -> None:
    path = written(tmp_path, text)
    with pytest.raises(ExpectedFileError) as caught:
        read_expected(path).reasons(cases())
    assert said in str(caught.value)
    assert str(caught.value).startswith(str(path))


def test_all_problems_of_a_file_are_reported_together(tmp_path: Path) -> None:
    path = written(tmp_path, "schema_version = 2\nwhy = 1\n[[expected]]\nid = 1\n")
    with pytest.raises(ExpectedFileError) as caught:
        read_expected(path)
    assert len(str(caught.value).splitlines()) == 4


# Texts of failures


ENCODE: Json = {
    "op": "encode", "protocol": "thorlabs_apt", "message": "MOT_SET_VELPARAMS", "form": "data", "dest": 80,
    "source": 1,
    "fields": {"chan_ident": 1, "min_velocity": 0, "acceleration": 0x01020304, "max_velocity": 5},
}  # fmt: skip
RAW = "13040e00d0010100000000000403020105000000"
DECODED: Json = {
    "ok": True, "message": "MOT_MOVE_HOME", "form": "header", "dest": 80, "source": 1,
    "fields": {"chan_ident": 1},
}  # fmt: skip
STREAM: Json = {
    "ok": True, "pending": "", "events": [{"event": "message", **DECODED}, {"event": "garbage", "hex": "00"}],
}  # fmt: skip
REFUSED: Json = {"ok": False, "error": "truncated"}
Change = Callable[[Json], Json]


def judged(wanted: Json, came: Json, request: Json = ENCODE) -> Result:
    case = Case(
        id="x",
        group="lines",
        steps=(ask(request, wanted),),
        protocol="thorlabs_apt",
        message="MOT_X",
        field="f",
    )
    (number,) = [1000]
    session = Session(lambda: InProcess(lambda line: answer(line, number, came)), timeout=1)
    session.hello()
    return session.ask(case)


def answer(line: bytes, number: int, came: Json) -> Json:
    return Testee().answer(line) if b"hello" in line else {"id": number, **came}


@pytest.mark.parametrize(
    ("wanted", "came", "outcome", "said"),
    [
        ({"ok": True, "hex": RAW}, {"ok": True, "hex": RAW}, Outcome.PASSED, ""),
        (
            {"ok": True, "hex": RAW},
            {"ok": True, "hex": RAW.replace("04030201", "01020304")},
            Outcome.FAILED,
            "acceleration (bytes 12 to 15) is 01 02 03 04, expected 04 03 02 01",
        ),
        (
            {"ok": True, "hex": RAW},
            {"ok": True, "hex": RAW[:-2]},
            Outcome.FAILED,
            "19 bytes, expected 20 (max_velocity)",
        ),
        (
            {"ok": True, "hex": RAW},
            {"ok": True, "hex": RAW.replace("0403", "04")},
            Outcome.FAILED,
            "19 bytes, expected 20, first difference at byte 13 (acceleration)",
        ),
        (
            {"ok": True, "hex": RAW},
            {"ok": True, "hex": RAW.upper()},
            Outcome.FAILED,
            'hex is "13040E',
        ),
        (
            {"ok": True, "hex": RAW},
            {"ok": True, "hex": 5},
            Outcome.FAILED,
            "hex is 5, expected",
        ),
        ({"ok": True, "hex": RAW}, {"ok": True}, Outcome.FAILED, "hex is missing"),
        (
            {"ok": True, "hex": RAW},
            {**REFUSED, "detail": "why"},
            Outcome.REFUSED_WRONGLY,
            f'refused with truncated (why), expected {{"hex": "{RAW}"}}',
        ),
        (
            REFUSED,
            {"ok": True, "hex": "00"},
            Outcome.ACCEPTED_WRONGLY,
            'granted with {"hex": "00"}, expected a refusal with truncated',
        ),
        (
            REFUSED,
            {**REFUSED, "error": "trailing", "detail": "why"},
            Outcome.FAILED,
            "refused with trailing (why), expected a refusal with truncated",
        ),
        (REFUSED, REFUSED, Outcome.FAILED, "shape: detail must be a text"),
        (REFUSED, {**REFUSED, "detail": ""}, Outcome.FAILED, "shape: detail must be a text"),
        (
            REFUSED,
            {**REFUSED, "error": "no"},
            Outcome.FAILED,
            "invalid shape: error must be one of",
        ),
        ({}, {"ok": 1}, Outcome.FAILED, "invalid shape: ok must be true or false"),
        (
            {},
            {"ok": True, "detail": "fine"},
            Outcome.FAILED,
            "invalid shape: only a refusal has detail",
        ),
        ({}, {"ok": True, "id": "1000"}, Outcome.FAILED, 'has the id "1000", expected 1000'),
        ({}, {"ok": True, "id": True}, Outcome.FAILED, "has the id true, expected 1000"),
        ({}, {"ok": True, "what": "ever"}, Outcome.PASSED, ""),
        (
            DECODED,
            {**DECODED, "fields": {"chan_ident": True}},
            Outcome.FAILED,
            "chan_ident is true, expected 1",
        ),
        (
            DECODED,
            {**DECODED, "fields": {}},
            Outcome.FAILED,
            "chan_ident is missing, expected 1",
        ),
        (DECODED, {**DECODED, "fields": 5}, Outcome.FAILED, "fields is 5, expected"),
        (DECODED, {**DECODED, "dest": 81}, Outcome.FAILED, "dest is 81, expected 80"),
        (
            DECODED,
            {**DECODED, "extra": "00"},
            Outcome.FAILED,
            'extra is "00", but must be absent',
        ),
        (
            STREAM,
            {**STREAM, "events": STREAM["events"][:1]},
            Outcome.FAILED,
            "1 events, expected 2",
        ),
        (
            STREAM,
            {**STREAM, "events": [{**STREAM["events"][0], "dest": 7}, STREAM["events"][1]]},
            Outcome.FAILED,
            "event 1 (MOT_MOVE_HOME): dest is 7, expected 80",
        ),
        (
            STREAM,
            {**STREAM, "events": [STREAM["events"][0], {"event": "garbage", "hex": "01"}]},
            Outcome.FAILED,
            "event 2 (garbage): bytes (byte 0) is 01, expected 00",
        ),
        (STREAM, {**STREAM, "events": [5, 6]}, Outcome.FAILED, "event 1 (MOT_MOVE_HOME) is 5"),
        (STREAM, {**STREAM, "pending": "00"}, Outcome.FAILED, 'pending is "00", expected ""'),
    ],
)
def test_differences_are_described(wanted: Json, came: Json, outcome: Outcome, said: str) -> None:
    request = {"op": "stream"} if "events" in wanted else ENCODE
    result = judged(wanted, came, request)
    assert result.outcome is outcome
    assert said in result.text
    assert result.text.startswith("MOT_X, f: ") == (outcome is not Outcome.PASSED)


MOVE: Json = {"message": "WRITE_TARGET_POSITION", "form": "request"}
REPLY: Json = {"message": "READ_MOTOR_POSITION_AND_STATUS", "form": "reply"}
SETUP: Json = {"message": "RESET_CONTROLLER", "form": "request"}
BAY: Json = {"message": "RACK_REQ_BAYUSED", "form": "header"}


@pytest.mark.parametrize(
    ("name", "request_", "raw", "names"),
    [
        ("thorlabs_apt", ENCODE, RAW, "id id length length dest source chan_ident chan_ident min_velocity"),
        ("thorlabs_apt", ENCODE, f"{RAW}a5", "extra@20"),
        ("thorlabs_apt", BAY, "600000001101", "id id bay_ident param2 dest source"),
        ("thorlabs_apt", {"message": "MOT_MOVE_COMPLETED"}, "6404", "frame frame"),
        ("asi_ms2000", MOVE, "185403a0860100013a", "axis command size target_position extra@6 terminator@8"),
        ("asi_ms2000", REPLY, "01020304", "position position position status"),
        ("asi_ms2000", SETUP, "ff52", "prefix command"),
        ("invented_packets", {"message": "SET_ANGLE"}, "aa5508030200000000000000000d",
         "start start length address id angle angle angle speed speed reserved check check end"),
    ],
)  # fmt: skip
def test_the_name_of_every_byte_of_a_message(
    monkeypatch: pytest.MonkeyPatch, name: str, request_: Json, raw: str, names: str
) -> None:
    monkeypatch.syspath_prepend(str(TESTS / "support" / "installed"))
    protocol = load_protocol(name)
    for place, wanted in enumerate(names.split()):
        field, _, at = wanted.partition("@")
        assert name_at(protocol, request_, bytes.fromhex(raw), int(at or place)) == field


# Early ends


def test_the_number_of_starts_is_limited() -> None:
    class Dying(InProcess):
        def receive(self, timeout: float) -> bytes:
            if b'"hello"' not in self._asked:
                raise EndedError
            return super().receive(timeout)

        def send(self, data: bytes) -> None:
            self._asked = data
            super().send(data)

    report = run([], [PROTOCOLS[0]], start=lambda: Dying(Testee().answer))
    assert report.starts == STARTS == len(report.results)
    assert report.unfinished == f"the testee was started {STARTS} times"
    assert {result.outcome for result in report.results} == {Outcome.CRASHED}
    assert len(report.not_run) == len(plan([PROTOCOLS[0]], 1)) - STARTS
    assert counts(report) == {"crashed": STARTS}


def counts(report: Report) -> dict[str, int]:
    return dict(report.counts())
