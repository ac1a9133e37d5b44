"""The runner on a packet protocol: addresses, both directions, errata, captures, and the schemas."""

from __future__ import annotations

import json
from functools import partial
from typing import Any

import jsonschema
import pytest
import testee_calls

from checkout import SCHEMAS, TESTS
from invented_packets import PROTOCOL
from stagewire_conformance import coverage, run
from stagewire_conformance.examples import run_capture

INSTALLED = TESTS / "support" / "installed"
VECTORS = json.loads((INSTALLED / "stagewire_invented" / "vectors.json").read_text("utf-8"))
MOVE, STATE, MISPRINT = VECTORS["examples"]
STOP, CUT_OFF = VECTORS["captures"]
Json = dict[str, Any]


@pytest.fixture(autouse=True)
def installed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(INSTALLED))


failure = partial(testee_calls.failure, PROTOCOL)
passes = partial(testee_calls.passes, PROTOCOL)


def schema(name: str) -> jsonschema.Draft202012Validator:
    text = (SCHEMAS / f"{name}.schema.json").read_text(encoding="utf-8")
    return jsonschema.Draft202012Validator(json.loads(text))


def test_every_example_and_capture() -> None:
    schema("vectors").validate(VECTORS)
    schema("registry").validate(PROTOCOL.registry())
    assert {verdict.id: verdict.outcome for verdict in run(PROTOCOL)} == {
        entry["id"]: "passed" for entry in (*VECTORS["examples"], *VECTORS["captures"])
    }
    rows = {row.message: (row.examples, row.captures) for row in coverage(PROTOCOL)}
    assert rows == {"STOP": (0, 1), "SET_ANGLE": (2, 0), "STATE": (1, 0), "PAGE": (0, 0)}


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"address": 4}, "have address 3, expected 4"),
        ({"address": 4}, "the stated values give AA 55 08 04"),
        ({"address": None}, "lacks address"),
        ({"address": 256}, "do not encode"),
        ({"fields": {"angle": -90_001, "speed": 10}}, "have angle -90000, expected -90001"),
        ({"fields": {"angle": -90_000}}, "lacks speed"),
        ({"extra": "00"}, "have extra bytes (none)"),
        ({"printed": MOVE["printed"][:-3]}, "the printed bytes do not decode"),
        ({"printed": MOVE["printed"].replace("70", "71")}, "the check of length, address"),
        ({"message": "STATE", "form": "header", "fields": {}}, "have message SET_ANGLE"),
    ],
)
def test_a_wrong_example_of_a_packet_fails(changes: Json, said: str) -> None:
    assert said in failure({**MOVE, **changes})


def test_an_erratum_must_not_pass() -> None:
    assert "bad_value" in passes(MISPRINT)
    assert "unexpected pass" in failure({**MISPRINT, "printed": MISPRINT["encoded"]})
    wrong = {"rejected": "bad_length"}
    assert "refused as bad_value" in failure({**MISPRINT, "printed_is": wrong})
    other = {"decodes": {"address": 3, "fields": {"angle": -90_000, "speed": 10}}}
    assert "the printed bytes do not decode" in failure({**MISPRINT, "printed_is": other})


def test_a_rejected_capture() -> None:
    assert "truncated" in passes(CUT_OFF, runner=run_capture)
    whole = {**CUT_OFF, "printed": STOP["printed"]}
    assert "unexpected pass: decodes as STOP" in failure(whole, runner=run_capture)


# The schemas


def wrong(name: str, entry: Json) -> bool:
    document = {**VECTORS, name: [entry]}
    return not schema("vectors").is_valid(document)


@pytest.mark.parametrize(
    ("changes", "is_wrong"),
    [
        ({}, False),
        ({"address": None}, True),
        ({"address": -1}, True),
        ({"address": 0xFFFFFFFF}, False),
        ({"dest": 1, "source": 2}, True),
        ({"axis": 3}, True),
        ({"context": {"status": "dc"}}, True),
        ({"data": "00"}, True),
        ({"form": "request"}, True),
    ],
)
def test_the_schema_of_packet_examples(changes: Json, is_wrong: bool) -> None:
    assert wrong("examples", {**MOVE, **changes}) is is_wrong
    assert wrong("captures", {**STOP, **changes}) is is_wrong


@pytest.mark.parametrize(
    ("said", "is_wrong"),
    [
        ({"dest": 0x50, "source": 1}, False),
        ({"dest": 0x50}, True),
        ({"source": 1}, True),
        ({}, False),  # a packet without an address: the runner knows the protocol
        ({"form": "request", "axis": 24}, False),
        ({"form": "request"}, False),  # a setup command
        ({"form": "reply"}, False),
        ({"form": "reply", "axis": 24}, True),
        ({"form": "request", "address": 1}, True),
        ({"form": "request", "dest": 1, "source": 2}, True),
        ({"form": "reqest", "axis": 24}, True),
    ],
)
def test_the_schema_of_captures_with_other_framings(said: Json, is_wrong: bool) -> None:
    bare = {key: value for key, value in STOP.items() if key != "address"}
    assert wrong("captures", {**bare, **said}) is is_wrong
    written = {key: value for key, value in {**bare, **said}.items() if key != "id"}
    captures = {"protocol": "invented", "captures": {"one": written}}
    assert schema("captures").is_valid(captures) is not is_wrong
