"""PICS drafts from the answers of a controller. Nothing is set or moved."""

from __future__ import annotations

import tomllib
from collections import Counter

import pytest
from watched_links import DeadLink, WatchedLink, controller_of

import stagewire_virtual
from stagewire.errors import StagewireError
from stagewire.framing import CommandReceived, End
from stagewire.protocols import CommandProtocol, FramedProtocol
from stagewire_apt import messages as m
from stagewire_conformance.device.declaration import Declaration, declare, known_units
from stagewire_conformance.device.errors import NothingAnswersError
from stagewire_conformance.device.permissions import Permissions
from stagewire_conformance.device.pics import Pics
from stagewire_conformance.device.pics_draft import ask_pics
from stagewire_conformance.device.pics_file import parse_pics
from stagewire_conformance.device.plans import plan
from stagewire_conformance.device.results import Result
from stagewire_conformance.device.run import run
from stagewire_virtual import VirtualController
from stagewire_virtual.factory import simulated_units
from stagewire_virtual.linking import SteppedLink

UNITS = sorted({*known_units()} & {*simulated_units()})


def asked(controller: VirtualController, unit: str = "") -> tuple[Pics, WatchedLink]:
    link = WatchedLink(SteppedLink(controller))
    return parse_pics(ask_pics(link, unit).encode()), link


def named(declared: Declaration, writes: list[bytes]) -> Counter[tuple[str, bytes]]:
    """Return how often each message was sent, by name and bytes."""
    protocol = declared.protocol
    if isinstance(protocol, FramedProtocol):
        events = protocol.framer(End.DEVICE).feed(b"".join(writes))
        return Counter((event.frame.message.layout.message, event.raw) for event in events)
    assert isinstance(protocol, CommandProtocol)
    events = protocol.framer().feed(b"".join(writes))
    assert all(isinstance(event, CommandReceived) for event in events)
    return Counter((event.frame.message.layout.message, event.raw) for event in events)


class BayLink(WatchedLink):
    """A line to the cards of a rack whose motherboard gets no message."""

    def write(self, data: bytes) -> None:
        self.writes.append(data)
        if data[4:5] not in (b"\x11", b"\x91"):
            super().write(data)


class DeafLink(WatchedLink):
    """A line that loses the requests for the velocity of bay 2."""

    def write(self, data: bytes) -> None:
        if data != m.MotReqVelParams(1).pack(0x22, 0x01):
            super().write(data)


@pytest.mark.parametrize("unit", UNITS)
def test_a_controller_that_answers_everything_supports_everything(unit: str) -> None:
    pics, link = asked(controller_of(unit), unit)
    assert pics.unit == unit
    assert pics.unsupported == {}
    assert all(not bay.unsupported for bay in pics.bays or ())
    declared = declare(pics)
    effects = {name: entry["effect"] for name, entry in declared.registry.messages.items()}
    sent = named(declared, link.writes)
    switches = {
        "SWITCH_TO_LOW_LEVEL",
        "SWITCH_TO_HIGH_LEVEL",
    }  # an MS-2000 may be in the text format
    assert {effects[name] for name, _ in sent if name not in switches} == {"none"}
    if isinstance(declared.protocol, FramedProtocol):
        found_out_before = {"HW_REQ_INFO", "RACK_REQ_BAYUSED"}
        assert all(times == 1 for (name, _), times in sent.items() if name not in found_out_before)


def test_the_modules_of_a_rack_are_listed() -> None:
    pics, _ = asked(controller_of("RACK"), "RACK")
    assert [(bay.number, bay.unit) for bay in pics.bays or ()] == [(1, "MST601"), (3, "MPZ601")]
    assert [(channel.bay, channel.number) for channel in pics.channels] == [(1, 1), (1, 2)]


def test_the_empty_bays_of_a_rack_of_cards_are_omitted() -> None:
    pics, _ = asked(stagewire_virtual.BBD103(empty_bays=[2]), "BBD103")
    assert [bay.number for bay in pics.bays or ()] == [1, 3]


def test_bays_without_a_motherboard_are_recognised() -> None:
    link = BayLink(SteppedLink(stagewire_virtual.BBD103(empty_bays=[2])))
    pics = parse_pics(ask_pics(link, "BBD103").encode())
    assert not pics.motherboard
    assert [bay.number for bay in pics.bays or ()] == [1, 3]
    assert pics.unsupported == {}


def test_bays_without_a_motherboard_pass_without_its_checks() -> None:
    declared = declare(Pics(unit="BBD101", motherboard=False))
    link = BayLink(SteppedLink(stagewire_virtual.BBD101()))
    report = run(link, plan(declared, Permissions()), declared, Permissions(), seed=1)
    assert not report.unfinished
    results = {outcome.check.id: outcome.result for outcome in report.outcomes}
    assert set(results.values()) <= {Result.PASS, Result.INFO}
    assert not any("0x11" in id or id == "bays/used" for id in results)
    asked = {data for data in link.writes if data[4:5] == b"\x11"}
    assert asked == {m.HwReqInfo().pack(0x11, 0x01)}  # nothing may answer there


def test_a_motherboard_that_is_declared_missing_must_not_answer() -> None:
    declared = declare(Pics(unit="BBD101", motherboard=False))
    checks = plan(declared, Permissions(), only=["bays/empty"])
    link = SteppedLink(stagewire_virtual.BBD101())
    (outcome,) = run(link, checks, declared, Permissions(), seed=1).outcomes
    assert outcome.result is Result.FAIL
    assert "HW_REQ_INFO to 0x11, declared without a motherboard" in outcome.findings[0].text


def test_a_silent_motherboard_fails_with_a_hint_about_the_pics() -> None:
    declared = declare("BBD101")
    checks = plan(declared, Permissions(), only=["identification"])
    link = BayLink(SteppedLink(stagewire_virtual.BBD101()))
    board, card = run(link, checks, declared, Permissions(), seed=1).outcomes
    assert [board.result, card.result] == [Result.FAIL, Result.PASS]
    assert "motherboard = false" in board.findings[-1].text


def test_missing_axes_are_omitted() -> None:
    pics, _ = asked(stagewire_virtual.MS2000(), "MS2000")
    assert [channel.axis for channel in pics.channels] == ["X", "Y", "Z"]


@pytest.mark.parametrize("unit", ["TDC001", "TPZ001", "TSC001", "BBD102", "BSC103", "BMS002"])
def test_the_unit_is_read_from_the_controller(unit: str) -> None:
    assert asked(controller_of(unit))[0].unit == unit


def test_a_rack_of_modules_is_recognised_by_its_name() -> None:
    assert asked(stagewire_virtual.MST601())[0].unit == "RACK"


def test_unanswered_requests_are_unsupported_and_then_skipped() -> None:
    fault = "to_host drop frame message=MOT_GET_POTPARAMS"
    pics, _ = asked(stagewire_virtual.TDC001(faults=[fault]))
    assert pics.unsupported == {"MOT_REQ_POTPARAMS": "did not answer"}
    link = SteppedLink(stagewire_virtual.TDC001(faults=[fault]))
    declared, allowed = declare(pics), Permissions()
    checks = plan(declared, allowed, only=["answers"])
    report = run(link, checks, declared, allowed, seed=1)
    results = {outcome.check.id: outcome.result for outcome in report.outcomes}
    skipped = {id for id, result in results.items() if result is Result.SKIP}
    assert skipped == {"answers/0x50/MOT_REQ_POTPARAMS/1"}
    assert set(results.values()) == {Result.PASS, Result.SKIP}


def test_a_lost_request_is_repeated() -> None:
    fault = "to_host drop frame message=MOT_GET_POTPARAMS at=1"
    assert asked(stagewire_virtual.TDC001(faults=[fault]))[0].unsupported == {}


def test_requests_unanswered_by_one_bay_are_listed_for_that_bay() -> None:
    link = DeafLink(SteppedLink(stagewire_virtual.BBD102()))
    pics = parse_pics(ask_pics(link).encode())
    assert pics.unsupported == {}
    assert [dict(bay.unsupported) for bay in pics.bays or ()] == [
        {},
        {"MOT_REQ_VELPARAMS": "did not answer"},
    ]


def test_a_draft_with_the_wrong_unit_lists_what_is_not_answered() -> None:
    pics, _ = asked(stagewire_virtual.TST001(), "TDC001")
    assert set(pics.unsupported) == {"MOT_REQ_DCPIDPARAMS", "MOT_REQ_DCSTATUSUPDATE"}


@pytest.mark.parametrize("unit", ["", "TDC001", "MS2000", "RACK"])
def test_a_dead_line_is_reported_within_seconds(unit: str) -> None:
    link = DeadLink()
    with pytest.raises(NothingAnswersError, match=r"socket://192\.0\.2\.1:4001"):
        ask_pics(link, unit)
    assert link.now < 5


def test_an_unknown_unit_is_refused_before_anything_is_sent() -> None:
    link = WatchedLink(SteppedLink(stagewire_virtual.TDC001()))
    with pytest.raises(StagewireError, match="unknown unit TDC002"):
        ask_pics(link, "TDC002")
    assert link.writes == []


def test_the_reported_identity_cannot_inject_toml() -> None:
    text = ask_pics(SteppedLink(stagewire_virtual.TDC001()), "TDC001")
    told = [line for line in text.splitlines() if line.startswith("# ")]
    assert any("model_number: TDC001" in line for line in told)
    assert tomllib.loads(text) == {
        "schema_version": 1,
        "protocol": "thorlabs_apt",
        "unit": "TDC001",
        "line": "usb",
        "channel": [{"number": 1}],
    }


def test_each_request_is_announced_before_it_is_sent() -> None:
    said: list[str] = []
    ask_pics(SteppedLink(stagewire_virtual.BBD102()), "", said.append)
    assert {"bay 1", "bay 2", "0x22 MOT_REQ_VELPARAMS"} <= set(said)
