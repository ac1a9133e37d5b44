"""The cases of the vectors: they cover everything the registry states of a message, and match the schema.

Expected cases are derived from the JSON of the registry and compared with the JSON of the vectors. The tests
of testees (``conformance/testees/test_cases.py``, ``generated/c``) check the answers.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import jsonschema
import pytest

from checkout import ROOT, SMALL_SPECS, TESTS
from files import write_files
from stagewire_conformance.comparison import mismatches
from stagewire_conformance.testee import Testee
from stagewire_generator import check, render
from stagewire_generator.model import Protocol
from stagewire_generator.targets.vectors import cases_of

SPECS = {
    "thorlabs_apt": ROOT / "spec",
    "asi_ms2000": ROOT / "spec",
    "tiny": SMALL_SPECS / "good_spec",
    "laser": SMALL_SPECS / "good_layouts",
    "turtle": SMALL_SPECS / "good_commands",
    "carousel": SMALL_SPECS / "good_packets",
    "spark": TESTS / "injection" / "more_spec",
}
SCHEMA = json.loads((ROOT / "spec/schema/vectors.schema.json").read_text(encoding="utf-8"))
Json = dict[str, Any]

LONGEST = 6000
"""Characters of a line with a case."""

LONGEST_WITH_ARRAY = 20000
"""The same for an array, which may fill a packet of four kilobytes; a case has its bytes and its values."""


@cache
def checked(spec: Path) -> dict[str, Protocol]:
    return {protocol.name: protocol for protocol in check(spec)}


@cache
def files_of(name: str) -> dict[str, str]:
    return render([checked(SPECS[name])[name]], ["registry", "vectors"])


@pytest.fixture(params=SPECS)
def name(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture
def registry(name: str) -> Json:
    return dict(json.loads(files_of(name)[f"registry/{name}.json"]))


@pytest.fixture
def cases(name: str) -> list[Json]:
    return list(json.loads(files_of(name)[f"vectors/{name}.json"])["cases"])


# Expected cases


def layouts(registry: Json) -> Iterator[tuple[Json, Json, list[Json]]]:
    """Yield message, layout and all named fields of each layout."""
    for message in registry["messages"]:
        for layout in message["layouts"]:
            named = [layout[key] for key in ("param1", "param2") if layout[key]]
            yield message, layout, [*named, *layout["fields"]]


def wanted(registry: Json) -> Iterator[tuple[Any, ...]]:
    """Yield the expected cases as tuples, like :func:`found`."""
    kind = registry["framing"]["kind"]
    for message, layout, fields in layouts(registry):
        here = message["name"], layout["form"]
        yield *here, "encode", "ok"
        yield *here, "decode", "ok"
        yield *here, "stream", "ok"
        yield *here, "encode", "unknown_field"
        yield message["name"], "encode", "bad_length"
        if "sub_message" in message:
            yield message["name"], "decode", "unknown_message"
        for position, field in enumerate(fields):
            selects = "sub_message" in message and position == 0
            selects |= field["name"] in shape_of(fields)
            for item in wanted_of(field, here):  # with another sub-message it is another message
                if not selects or item[2:4] != ("decode", field["name"]):
                    yield item
        if any(field["role"] == "value" for field in fields):
            yield *here, "encode", "bad_value"
        if message["kind"] != "setup":
            yield *here, "decode", "truncated"
        yield *here, "decode", "trailing"
        has_array = any("array" in field for field in fields)  # its length must fit
        if layout["length"] and kind != "slots" and not has_array:
            yield *here, "decode", "extra"
    for code in {
        "truncated", "trailing", "bad_length", "unknown_message", "unknown_field", "missing_field",
        "out_of_range", "bad_value", "bad_request", "unsupported",
    }:  # fmt: skip
        yield ("refused", code)
    for event in {"message", "unknown", "bad_length", "garbage"}:
        yield ("event", event)
    no_layout = [message for message in registry["messages"] if not message["layouts"]]
    if kind == "header" and any(message["id"] is not None for message in no_layout):
        yield ("event", "undocumented")


def shape_of(fields: list[Json]) -> set[str]:
    """Return the fields on which the length of an array depends; with another value, it does not fit."""
    arrays = [field["array"] for field in fields if "array" in field]
    each = {column["each"] or "" for array in arrays for column in array["columns"]}
    return each | {str(array["rows"]) for array in arrays}


def wanted_of(field: Json, here: tuple[str, str]) -> Iterator[tuple[Any, ...]]:
    name = field["name"]
    may_lack = here[1] == "header" and field["default"] is not None  # tried by leaving it out
    if field["role"] == "value" and not may_lack:
        yield *here, "encode", "missing_field", name
    if field["role"] == "reserved":
        yield *here, "decode", name, "kept"
        yield *here, "encode", name, "kept"
        yield *here, "encode", "out_of_range", name
        return
    if field["kind"] == "integer":
        least, greatest = field["minimum"], field["maximum"]
        inside = {least, greatest} - ({field["default"]} if may_lack else set())
        outside = {"out_of_range": (least - 1, greatest + 1), "ok": inside}
        for verdict, values in outside.items():
            for value in values:
                yield *here, "encode", verdict, name, value
        bits = 8 * field["size"]
        lowest, highest = (
            (-(1 << bits - 1), (1 << bits - 1) - 1) if field["signed"] else (0, (1 << bits) - 1)
        )
        if (least, greatest) != (lowest, highest):
            yield *here, "encode", "out_of_range", name, "beyond the format"
            yield *here, "decode", name, -1 if field["signed"] else highest
        for value in (least - 1, greatest + 1, *field.get("enum", {}).values()):
            if lowest <= value <= highest:
                yield *here, "decode", name, value
        for value in field.get("enum", {}).values():
            yield (
                *here,
                "encode",
                "ok" if least <= value <= greatest else "out_of_range",
                name,
                value,
            )
        for mask in field.get("flags", {}).values():
            value = mask - (1 << bits) if mask > highest else mask
            yield *here, "decode", name, value
            yield (
                *here,
                "encode",
                "ok" if least <= value <= greatest else "out_of_range",
                name,
                value,
            )
        if "enum" in field:
            yield *here, "decode", name, "without a name"
    else:
        yield *here, "encode", "out_of_range", name


# Actual cases


def found(registry: Json, cases: list[Json]) -> Iterator[tuple[Any, ...]]:
    """Yield a tuple for everything that the cases check."""
    enums = {
        (message["name"], layout["form"], field["name"]): set(field["enum"].values())
        for message, layout, fields in layouts(registry)
        for field in fields
        if "enum" in field
    }
    for case in cases:
        request, answer = case["request"], case["answer"]
        verdict = "ok" if answer["ok"] else answer["error"]
        operation = request.get("op")
        if not answer["ok"]:
            yield ("refused", verdict)
        for event in answer.get("events", ()):
            yield ("event", event["event"])
            if event["event"] == "message":
                yield event["message"], event["form"], "stream", "ok"
        here = tuple(case["id"].split("/")[:2])
        yield *here, operation, verdict
        yield here[0], operation, verdict
        if operation == "decode" and answer["ok"]:
            here = answer["message"], answer["form"]
            if "extra" in answer:
                yield *here, "decode", "extra"
            for field, value in answer["fields"].items():
                value = hashable(value)
                yield *here, "decode", field, value
                if is_something(value):
                    yield *here, "decode", field, "kept"
                if value not in enums.get((*here, field), {value}):
                    yield *here, "decode", field, "without a name"
        if operation == "encode" and case["id"].count("/") == 3:
            yield from found_in_fields(here, request.get("fields", {}), verdict, case["id"])


def is_something(value: Any) -> bool:
    """Whether a value is not all zeros; zeros are also sent for missing fields."""
    return value not in ((), []) and str(value).strip("0") != ""


def hashable(value: Any) -> Any:
    """Return a value, with the rows of an array as tuples."""
    if isinstance(value, list):
        return tuple(map(hashable, value))
    return tuple(sorted(value.items())) if isinstance(value, dict) else value


def found_in_fields(
    here: tuple[str, ...], fields: Json, verdict: str, id: str
) -> Iterator[tuple[Any, ...]]:
    about = id.split("/")[-1].partition(".")[0].partition("=")[0]
    if verdict == "missing_field":
        assert about not in fields
        yield *here, "encode", verdict, about
    for field, value in fields.items():
        if verdict == "ok":
            yield *here, "encode", verdict, field, hashable(value)
            if is_something(value):
                yield *here, "encode", field, "kept"
        elif field == about and not isinstance(value, bool):
            yield *here, "encode", verdict, field
            yield *here, "encode", verdict, field, hashable(value)
            if id.endswith(".beyond") and value.bit_length() > 8:  # its low bytes are in range
                yield *here, "encode", verdict, field, "beyond the format"


def missing(registry: Json, cases: list[Json]) -> list[tuple[Any, ...]]:
    there = set(found(registry, cases))
    return [item for item in wanted(registry) if item not in there]


def test_everything_has_a_case(registry: Json, cases: list[Json]) -> None:
    assert missing(registry, cases) == []


@pytest.mark.parametrize("key", ["enum", "flags"])
def test_a_name_without_a_case_is_found(
    name: str, key: str, registry: Json, cases: list[Json]
) -> None:
    """A value or a flag of the registry that no case has."""
    there = set(found(registry, cases))
    for message, layout, fields in layouts(registry):
        for field in [field for field in fields if key in field]:
            known = {case["answer"].get("fields", {}).get(field["name"]) for case in cases}
            field[key]["ANOTHER"] = next(n for n in range(0x7F, 0, -1) if n not in known)
            lost = [item for item in wanted(registry) if item not in there]
            assert {item[:2] for item in lost} == {(message["name"], layout["form"])}
            return


def test_a_layout_without_cases_is_found(registry: Json, cases: list[Json]) -> None:
    every = list(layouts(registry))
    for message, layout, fields in every[:: len(every) // 5 or 1]:
        here = message["name"], layout["form"]
        others = [case for case in cases if not case["id"].startswith("/".join(here) + "/")]
        lost = [item[2:] for item in missing(registry, others) if item[:2] == here]
        assert {("encode", "ok"), ("encode", "unknown_field"), ("decode", "trailing")} <= set(lost)
        unmissed = {item[2] for item in lost if item[:2] == ("encode", "missing_field")}
        assert unmissed == {field["name"] for field in fields if field["role"] == "value"}


def test_ids_are_unique_and_sorted(registry: Json, cases: list[Json]) -> None:
    ids = [case["id"] for case in cases]
    assert len(set(ids)) == len(ids)
    order = [message["name"] for message in registry["messages"]] + ["frame", "stream", "request"]
    places = [order.index(id.split("/")[0]) for id in ids]
    common = [place for place in places if place >= len(order) - 3]
    assert places == sorted(places[: len(places) - len(common)]) + common


def test_every_case_is_on_one_line(name: str, registry: Json, cases: list[Json]) -> None:
    lines = files_of(name)[f"vectors/{name}.json"].splitlines()
    written = [line for line in lines if line.startswith('    {"')]
    assert [json.loads(line.rstrip(",")) for line in written] == cases
    arrays = {message["name"] for message, _, fields in layouts(registry) if shape_of(fields)}
    for case, line in zip(cases, written, strict=True):
        has_array = any(array in case["id"] for array in arrays)
        assert len(line) < (LONGEST_WITH_ARRAY if has_array else LONGEST), case["id"]


# The schema


def errors(data: Json) -> list[str]:
    return [error.message for error in jsonschema.Draft202012Validator(SCHEMA).iter_errors(data)]


def first(cases: list[Json], operation: str, ok: bool = True) -> Json:
    return next(c for c in cases if c["request"].get("op") == operation and c["answer"]["ok"] == ok)


DAMAGE: dict[str, Callable[[list[Json]], object]] = {
    "no id": lambda cases: cases[0].pop("id"),
    "an id with a blank": lambda cases: cases[0].update(id="a b/c"),
    "an id without parts": lambda cases: cases[0].update(id="MESSAGE"),
    "no request": lambda cases: cases[0].pop("request"),
    "no answer": lambda cases: cases[0].pop("answer"),
    "another key": lambda cases: cases[0].update(note="x"),
    "an answer without verdict": lambda cases: cases[0]["answer"].pop("ok"),
    "a request with an id": lambda cases: cases[0]["request"].update(id=1),
    "a request with a protocol": lambda cases: cases[0]["request"].update(protocol="x"),
    "an unknown code": lambda cases: first(cases, "encode", False)["answer"].update(error="no"),
    "a detail": lambda cases: first(cases, "encode", False)["answer"].update(detail="why"),
    "bytes in capitals": lambda cases: first(cases, "encode")["answer"].update(hex="FF"),
    "half a byte": lambda cases: first(cases, "encode")["answer"].update(hex="0"),
    "bytes to decode in capitals": lambda cases: first(cases, "decode")["request"].update(hex="FF"),
    "no message to encode": lambda cases: first(cases, "encode")["request"].pop("message"),
    "a form in capitals": lambda cases: first(cases, "decode")["answer"].update(form="DATA"),
    "a field that is true": lambda cases: first(cases, "decode")["answer"]["fields"].update(a=True),
    "a field in capitals": lambda cases: first(cases, "decode")["answer"]["fields"].update(A=1),
    "an unknown event": lambda cases: first(cases, "stream")["answer"].update(
        events=[{"event": "noise", "hex": "00"}]
    ),
    "garbage without bytes": lambda cases: first(cases, "stream")["answer"].update(
        events=[{"event": "garbage"}]
    ),
    "a message without fields": lambda cases: first(cases, "stream")["answer"].update(
        events=[{"event": "message", "message": "A", "form": "data"}]
    ),
    "a message with bytes": lambda cases: first(cases, "stream")["answer"].update(
        events=[{"event": "message", "message": "A", "form": "data", "fields": {}, "hex": "00"}]
    ),
    "a stream without an end of it": lambda cases: first(cases, "stream")["answer"].pop("pending"),
}


@pytest.mark.parametrize("damage", DAMAGE)
def test_the_schema_rejects_wrong_vectors(damage: str) -> None:
    data = json.loads(files_of("tiny")["vectors/tiny.json"])
    cases = data["cases"]
    some = [first(cases, operation) for operation in ("encode", "decode", "stream")]
    data = {**data, "cases": [*some, first(cases, "encode", False)], "examples": []}
    assert errors(data) == []
    DAMAGE[damage](data["cases"])
    assert errors(data) != []


# The model of cases that other targets use


def test_the_model_equals_the_json(name: str, cases: list[Json]) -> None:
    made = cases_of(checked(SPECS[name])[name])
    assert len(made) == len(cases)
    for case, said in zip(made, cases, strict=True):
        assert (case.id, case.about) == (said["id"], said.get("about", ""))
        assert (case.request, case.answer) == (said["request"], said["answer"])
        assert case.refusal == said["answer"].get("error", "")
        if case.layout is not None:
            assert case.message is not None
            assert case.layout in case.message.layouts
            assert case.id.startswith(f"{case.message.name}/{case.layout.form}/")
        if case.operation == "encode" and not case.refusal:
            assert case.raw == bytes.fromhex(said["answer"]["hex"])
            assert case.fields == said["request"].get("fields", {})
        if case.operation == "decode" and not case.refusal:
            assert case.raw == bytes.fromhex(said["request"]["hex"])
            assert case.fields == said["answer"]["fields"]


# Protocols of users: their packages pass their own cases


def answered(protocol: Protocol, folder: Path, imported: Callable[[Path], Any]) -> list[str]:
    """Generate a package, run its cases, and return the wrong answers."""
    write_files(folder, render([protocol], ["python"]))
    package = imported(folder)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("stagewire_conformance.testee.load_protocol", lambda _: package.PROTOCOL)
        cases = package.PROTOCOL.vectors()["cases"]
        assert len(cases) > 100
        return [str(wrong) for wrong in mismatches(Testee(), protocol.name, cases)]


@pytest.mark.parametrize("name", ["tiny", "turtle", "carousel"])
def test_the_package_of_a_protocol_passes_its_cases(
    name: str, tmp_path: Path, imported: Callable[[Path], Any]
) -> None:
    assert answered(checked(SPECS[name])[name], tmp_path, imported) == []


NUMBER = {"format": "u8", "size": 1}
WORD = {"format": "u16", "size": 2}
SHAPES: dict[str, Json] = {
    "bare": {
        "order": ["start", "length", "id", "payload"], "start": [0xAA],
        "length": {**NUMBER, "counts": ["payload"]}, "id": NUMBER,
    },
    "sum": {
        "order": ["start", "id", "length", "payload", "check", "end"], "start": [2], "end": [3, 10],
        "length": {**WORD, "counts": ["start", "id", "length", "payload", "check", "end"]}, "id": WORD,
        "check": {"method": "sum", **WORD, "complement": "twos", "covers": ["payload"]},
    },
    "ones": {
        "order": ["start", "id", "length", "payload", "check", "address"], "start": [0xAA, 0xAA, 0x55],
        "length": {**NUMBER, "counts": ["id", "payload", "address"]}, "id": NUMBER, "address": WORD,
        "check": {"method": "sum", **NUMBER, "complement": "ones", "covers": ["address", "id", "payload"]},
    },
    "xor": {
        "order": ["start", "length", "address", "id", "payload", "check"], "start": [0xAA],
        "length": {**NUMBER, "counts": ["payload"]}, "id": NUMBER, "address": NUMBER,
        "check": {"method": "xor", **NUMBER, "covers": ["start", "length", "id", "payload"]},
    },
    "reflected": {
        "order": ["start", "length", "id", "payload", "check", "end"], "start": [0xAA], "end": [0x0D],
        "length": {**NUMBER, "counts": ["payload", "check"]}, "id": NUMBER,
        "check": {
            "method": "crc", "format": "u32", "size": 4, "polynomial": 0x04C11DB7, "initial": 0xFFFFFFFF,
            "reflected": True, "final": 0xFFFFFFFF, "covers": ["id", "payload"],
        },
    },
}  # fmt: skip


@pytest.mark.parametrize("shape", SHAPES)
def test_packets_of_any_shape_pass_their_cases(
    shape: str, tmp_path: Path, imported: Callable[[Path], Any]
) -> None:
    carousel = checked(SPECS["carousel"])["carousel"]
    framing = {"kind": "packet", "page": 1, "maximum_length": 32, **SHAPES[shape]}
    assert answered(replace(carousel, framing=framing), tmp_path, imported) == []
