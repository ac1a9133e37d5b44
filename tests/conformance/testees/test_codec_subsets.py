"""Codecs that implement some messages of a protocol: all cases about these are run, and no others."""

from __future__ import annotations

import contextlib
import json
from collections import deque
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from quick_plans import quick_plans
from stagewire.protocols import FramedProtocol, load_protocol
from stagewire_conformance.comparison import Outcome
from stagewire_conformance.framings import codec_of
from stagewire_conformance.reports import Grade, Omission, Verdict
from stagewire_conformance.reports.codec_sheet import sheet_of
from stagewire_conformance.testee import Testee
from stagewire_conformance.testees import NotATesteeError, Report, run
from stagewire_conformance.testees.case import EndedError

NAME = "thorlabs_apt"
APT = load_protocol(NAME)
assert isinstance(APT, FramedProtocol)
EIGHT = (
    "HW_REQ_INFO",
    "HW_GET_INFO",
    "MOT_MOVE_HOME",
    "MOT_MOVE_ABSOLUTE",
    "MOT_MOVE_STOP",
    "MOT_SET_VELPARAMS",
    "MOT_REQ_VELPARAMS",
    "MOT_GET_VELPARAMS",
)
Json = dict[str, Any]


class Small(Testee):
    """A testee whose protocol has only eight messages."""

    def __init__(self, listed: object = EIGHT, change: Callable[[Json], Json] = dict) -> None:
        super().__init__()
        assert isinstance(APT, FramedProtocol)
        own = FramedProtocol(
            APT.name,
            APT.title,
            APT.package,
            [cls for cls in APT.messages if cls.layout.message in EIGHT],
            APT.host,
            APT.devices,
            {},
            APT.channel,
        )
        self._codecs[NAME] = codec_of(own)
        self._listed = listed
        self._change = change

    def answer(self, line: bytes) -> Json:
        with contextlib.suppress(ValueError, TypeError, RecursionError):
            line = json.dumps(self._change(json.loads(line))).encode()
        said = super().answer(line)
        if "testee" in said:
            said["protocols"] = [NAME]
            said |= {} if self._listed is None else {"messages": {NAME: self._listed}}
        return said


class InProcess:
    """Answers lines without a child process."""

    def __init__(self, testee: Testee) -> None:
        self._testee = testee
        self._answers: deque[bytes] = deque()

    def send(self, data: bytes) -> None:
        for line in data.splitlines(keepends=True):
            self._answers.append(json.dumps(self._testee.answer(line)).encode() + b"\n")

    def receive(self, timeout: float) -> bytes:
        if not self._answers:
            raise EndedError
        return self._answers.popleft()

    def early(self) -> bytes:
        return b""

    def said(self) -> str:
        return ""

    def end(self, patience: float = 0.0) -> str:
        return "has ended"


@pytest.fixture(scope="module", autouse=True)
def _quick() -> Iterator[None]:
    with quick_plans():
        yield


def report_of(testee: Testee, *only: str) -> Report:
    return run(["small"], [APT], only=only, start=lambda: InProcess(testee))


@pytest.fixture(scope="module")
def small() -> Report:
    """The whole run of the small codec, except for hostile lines, which concern no message."""
    return report_of(Small(), f"{NAME}/*", "order")


def test_all_cases_of_the_listed_messages_are_run_and_pass(small: Report) -> None:
    assert not small.failures(), small.failures()[0]
    ran = [result.case for result in small.results if result.ran]
    assert {case.message for case in ran} - {""} == {*EIGHT}
    foreign = [r.case for r in small.results if not r.ran and r.case.message in EIGHT]
    assert all("/context." in case.id for case in foreign)  # a context for other messages
    assert len(ran) > 400
    assert {case.group for case in ran} == {
        *(f"{NAME}/{kind}" for kind in ("examples", "captures", "cases", "cut", "large")),
        "order",
    }
    streams = [case for case in ran if case.id.startswith(f"{NAME}/stream/")]
    assert any(case.id.endswith("/garbage.between") for case in streams)


def test_the_other_cases_are_not_implemented_and_the_run_is_partial(small: Report) -> None:
    others = [result for result in small.results if not result.ran]
    assert {result.outcome for result in others} == {Outcome.NOT_IMPLEMENTED}
    assert len(others) > 5000
    sheet = sheet_of(small, [APT], lambda id: id)
    assert sheet.verdict is Verdict.PARTIAL
    assert sheet.counts()[Grade.NOT_RUN] == len(others)
    gaps = {gap.omission: gap for gap in sheet.gaps}
    assert gaps[Omission.NOT_IMPLEMENTED].cases == len(others)
    facts = {fact.key: fact.value for fact in sheet.facts}
    assert [fact.key for fact in sheet.declaration] == [
        "speaks",
        "operations",
        f"implements_{NAME}",
    ]
    every = {cls.layout.message for cls in APT.messages} | {*APT.nameless}
    implemented = f"8 of {len(every)}: HW_GET_INFO, HW_REQ_INFO, "
    assert str(facts[f"implements_{NAME}"]).startswith(implemented)


def test_without_a_list_all_messages_are_expected() -> None:
    report = report_of(Small(None), f"{NAME}/MOT_MOVE_JOG/*")
    assert {result.outcome for result in report.results if result.ran} >= {Outcome.REFUSED_WRONGLY}


def test_a_list_does_not_hide_a_message_that_is_implemented_wrongly() -> None:
    report = report_of(Small((*EIGHT, "MOT_MOVE_JOG")), "MOT_MOVE_JOG")
    assert len(report.failures()) > 10


def _without_high_byte(raw: bytes) -> Iterator[int]:
    """Yield the bytes of a stream of data frames as a codec reads them that ignores the high byte."""
    at = 0
    while at < len(raw):
        framed = len(raw) - at >= 6 and raw[at + 4] & 0x80
        size = 6 + raw[at + 2] if framed else 6
        frame = bytearray(raw[at : at + size])
        if framed:
            frame[3] = 0
        yield from frame
        at += size


def ignoring_the_high_byte(request: Json) -> Json:
    """Clear the high byte of the length before a frame is decoded."""
    if request.get("op") == "decode":
        raw = bytes.fromhex(request["hex"])
        return request | {"hex": bytes(_without_high_byte(raw)).hex()}
    if request.get("op") == "stream":
        raw = bytes.fromhex("".join(request["chunks"]))
        return request | {"chunks": [bytes(_without_high_byte(raw)).hex()]}
    return request


@pytest.mark.parametrize("message", ["HW_GET_INFO", "MOT_MOVE_ABSOLUTE", "MOT_SET_VELPARAMS"])
def test_a_codec_that_ignores_the_high_byte_of_the_length_is_found(message: str) -> None:
    report = report_of(Small([message], ignoring_the_high_byte), f"{NAME}/{message}/*")
    found = {result.case.id.partition("/data/")[2] for result in report.failures()}
    assert {"decode/length.high", "stream/length.high"} <= found


@pytest.mark.parametrize(
    ("listed", "said"),
    [
        (
            ["MOT_MOVE_HOM"],
            "thorlabs_apt has no message 'MOT_MOVE_HOM'; did you mean MOT_MOVE_HOME",
        ),
        (
            "MOT_MOVE_HOME",
            "messages in its answer to hello is not an object with a list of message",
        ),
        ([1], "messages in its answer to hello is not an object with a list of message names"),
    ],
)
def test_an_invalid_list_is_refused(listed: object, said: str) -> None:
    with pytest.raises(NotATesteeError) as caught:
        report_of(Small(listed), "MOT_MOVE_HOME")
    assert said in str(caught.value)


def test_every_message_with_a_packet_has_a_case_with_a_high_length() -> None:
    ids = {case["id"] for case in APT.vectors()["cases"]}
    for cls in APT.messages:
        layout = cls.layout
        if layout.form.startswith("data") and layout.form != "data:undecided":
            for operation in ("decode", "stream"):
                assert f"{layout.message}/{layout.form}/{operation}/length.high" in ids
