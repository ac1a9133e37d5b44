"""PICS files: all problems are reported together, and the schema agrees with the reader."""

from __future__ import annotations

import copy
import hashlib
import json
import re
import tomllib
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest
from jsonschema import Draft202012Validator

import plain_yaml
from checkout import SCHEMAS
from stagewire_apt import stages
from stagewire_conformance.device.declaration import Declaration, declare, known_units
from stagewire_conformance.device.errors import PicsError
from stagewire_conformance.device.pics import Pics
from stagewire_conformance.device.pics_file import parse_pics, read_pics

SCHEMA = json.loads((SCHEMAS / "pics.schema.json").read_text(encoding="utf-8"))
Draft202012Validator.check_schema(SCHEMA)
VALIDATOR = Draft202012Validator(SCHEMA)

CUBE = """
schema_version = 1
protocol = "thorlabs_apt"
unit = "TDC001"
line = "usb"
[unsupported]
MOT_REQ_POTPARAMS = "no potentiometer fitted"
[[channel]]
number = 1
stage = "Z8"
travel = "0..12mm"
homes = true
limit_switches = false
[certificate]
vendor = "Example Optics"
product = "Cube"
revision = "board C, firmware 1.3"
tester = "Test laboratory"
[timing]
reply_p99_ms = 50
"""
CARDS = """
schema_version = 1
unit = "BBD103"
issue = "3"
line = "rs232"
motherboard = true
[[bay]]
number = 1
[[bay]]
number = 3
[bay.unsupported]
MOT_REQ_PMDSTAGEAXISPARAMS = "an older card"
[[channel]]
bay = 3
stage = "MLS203"
travel = "0..2000000counts"
"""
RACK = """
schema_version = 1
unit = "RACK"
[[bay]]
number = 2
unit = "MST601"
[[bay]]
number = 4
unit = "MPZ601"
[[channel]]
bay = 2
number = 2
counts_per_mm = "1000/3"
travel = "-3..3mm"
"""
AXES = """
schema_version = 1
unit = "MS2000"
firmware = "3.3"
[[channel]]
axis = "X"
travel = "-50..50mm"
[[channel]]
axis = "Z"
"""
FILES = {"cube": CUBE, "cards": CARDS, "rack": RACK, "axes": AXES}


def declared(text: str) -> Declaration:
    return declare(parse_pics(text.encode()))


def problems(text: str | bytes) -> tuple[str, ...]:
    raw = text if isinstance(text, bytes) else text.encode()
    with pytest.raises(PicsError) as caught:
        parse_pics(raw, "my.toml")
    return caught.value.problems


# Valid files


def test_a_byte_order_mark_is_accepted() -> None:
    text = '\ufeffschema_version = 1\r\nunit = "TDC001"\r\n'
    assert parse_pics(text.encode()).unit == "TDC001"


def test_a_cube() -> None:
    cube = declared(CUBE)
    [place] = cube.places
    assert (place.name, place.channels) == ("0x50", (1,))
    assert "MOT_REQ_POTPARAMS" not in place.messages
    assert cube.unsupported == {"MOT_REQ_POTPARAMS": "no potentiometer fitted"}
    assert place.why_not("MOT_REQ_POTPARAMS") == (
        "the PICS lists MOT_REQ_POTPARAMS as unsupported: no potentiometer fitted"
    )
    assert place.why_not("MOT_REQ_VELPARAMS") == ""
    assert place.travel_of(1) == (0, 411648)
    stage = place.stage_of(1)
    assert stage is not None
    assert stage.name == "Z8"
    assert place.connected_to(1).homes
    assert not place.connected_to(1).limit_switches
    assert cube.pics.timing.reply_p99_ms == 50
    assert cube.pics.certificate.revision == "board C, firmware 1.3"
    assert cube.pics.digest == hashlib.sha256(CUBE.encode()).hexdigest()


def test_a_rack_of_cards() -> None:
    rack = declared(CARDS)
    assert [(place.name, place.bay) for place in rack.places] == [
        ("0x11", None),
        ("0x21", 1),
        ("0x23", 3),
    ]
    board, first, third = rack.places
    assert board.is_motherboard
    assert board.channels == ()
    assert "RACK_REQ_BAYUSED" in board.messages
    assert "RACK_REQ_BAYUSED" not in first.messages
    assert first.travel_of(1) is None
    assert third.travel_of(1) == (0, 2_000_000)
    assert "MOT_REQ_PMDSTAGEAXISPARAMS" in first.messages - third.messages
    assert not rack.wants_signs


def test_a_rack_of_modules() -> None:
    rack = declared(RACK)
    board, first, second = rack.places
    swapped = RACK.replace("number = 2\nunit", "number = 5\nunit").replace("bay = 2", "bay = 5")
    assert [place.bay for place in declared(swapped).places] == [None, 4, 5]
    assert board.is_motherboard
    assert "RACK_SET_DIGOUTPUTS" in first.messages & second.messages
    assert [(place.name, place.unit.name) for place in rack.places] == [
        ("0x11", "RACK"),
        ("0x22", "MST601"),
        ("0x24", "MPZ601"),
    ]
    stepper = rack.places[1]
    assert stepper.channels == (1, 2)
    assert stepper.stage_of(1) is None
    assert stepper.travel_of(2) == (-1000, 1000)
    scale = stepper.position_scale(2)
    assert scale is not None
    assert scale.counts_per_unit == Fraction(1000, 3)


def test_bays_without_a_motherboard() -> None:
    rack = declared(CARDS.replace("motherboard = true", "motherboard = false"))
    assert [place.name for place in rack.places] == ["0x21", "0x23"]
    with pytest.raises(PicsError, match="motherboard: TDC001 has no bays; omit the key"):
        declared(CUBE.replace('line = "usb"', "motherboard = false"))


def test_axes() -> None:
    axes = declared(AXES)
    assert [(place.name, place.address, place.channels) for place in axes.places] == [
        ("X", 0x18, ()),
        ("Z", 0x1A, ()),
    ]
    assert axes.places[0].travel_of() == (-500_000, 500_000)
    assert axes.firmware == "3.3"


@pytest.mark.parametrize("unit", ["TDC001", "BMS002", "ODC001", "MS2000"])
def test_units_that_move_stages_accept_a_stage(unit: str) -> None:
    assert all(place.moves_stages for place in declare(unit).places)


@pytest.mark.parametrize("unit", ["TPZ001", "TSC001", "TSG001", "BPC301"])
def test_units_that_move_no_stage_refuse_a_stage(unit: str) -> None:
    assert not any(place.moves_stages for place in declare(unit).places)


@pytest.mark.parametrize("unit", sorted(known_units()))
def test_without_a_pics_a_unit_is_declared_as_documented(unit: str) -> None:
    known = declare(unit)
    assert known.unsupported == {}
    claimed = frozenset[str]().union(*(place.messages for place in known.places))
    later = frozenset[str]().union(*(place.later for place in known.places))
    if unit != "RACK":
        assert known.unit.messages <= claimed | later
        assert not claimed & later
    for place in known.places:
        assert all(place.travel_of(channel) is None for channel in place.channels)
        stages = [place.stage_of(channel) for channel in place.channels]
        assert [stage.name if stage else "" for stage in stages] == [
            known.unit.built_in or "" for _ in place.channels
        ]
    assert len({place.address for place in known.places}) == len(known.places)


def test_by_default_firmware_follows_the_first_issue_that_describes_its_unit() -> None:
    assert declare("TDC001").issue == "3"
    assert declare("BBD202").issue == "3"
    assert declare("KDC101").issue == "37"
    assert not declare("TDC001").claims("HUB_REQ_BAYUSED")
    assert declare("KDC101").claims("HUB_REQ_BAYUSED")
    (place,) = declare("TDC001").places
    assert "only a later issue of the document lists HUB_REQ_BAYUSED for TDC001" in place.why_not(
        "HUB_REQ_BAYUSED"
    )


@pytest.mark.parametrize("unit", ["TDC001", "TSC001", "BSC102", "BBD203"])
def test_firmware_of_a_later_issue_has_all_messages_of_its_unit(unit: str) -> None:
    later = declare(Pics(unit=unit, issue="37"))
    assert later.issue == "37"
    claimed = frozenset[str]().union(*(place.messages for place in later.places))
    assert later.unit.messages <= claimed


def test_names_are_accepted_in_any_case() -> None:
    text = CUBE.replace('"TDC001"', '"tdc001"').replace('"Z8"', '"z8"')
    stage = declared(text).places[0].stage_of(1)
    assert stage is not None
    assert stage.name == "Z8"


def test_a_stage_may_have_its_name_in_the_catalogue() -> None:
    object.__setattr__(stages.Z8, "catalogue", ("Z8/M",))
    try:
        stage = declared(CUBE.replace('"Z8"', '"z8/m"')).places[0].stage_of(1)
    finally:
        object.__setattr__(stages.Z8, "catalogue", ())
    assert stage is stages.Z8


# Problems

MISTAKES: list[dict[str, str]] = plain_yaml.read(Path(__file__).parent / "pics_mistakes.yaml")


@pytest.mark.parametrize("mistake", MISTAKES, ids=lambda mistake: mistake["said"][:60])
def test_a_problem_is_reported_with_its_key(mistake: dict[str, str]) -> None:
    text = FILES[mistake["in"]]
    assert mistake["instead_of"] in text
    found = problems(text.replace(mistake["instead_of"], mistake["write"], 1))
    assert any(mistake["said"] in problem for problem in found), found
    assert all(problem.startswith("my.toml") for problem in found)
    assert len(found) <= 2  # the problem, and at most one that follows from it


@pytest.mark.parametrize(
    ("unit", "number", "said"),
    [
        (
            "MPC320",
            4,
            "4 does not exist; MPC320 has channels 1 to 3; in messages, channel 3 has the number 4",
        ),
        (
            "KIM101",
            8,
            "8 does not exist; KIM101 has channels 1 to 4; in messages, channel 4 has the number 8",
        ),
        ("KIM101", 5, "5 does not exist; KIM101 has channels 1 to 4"),
        ("KIM101", 0, "0 does not exist; KIM101 has channels 1 to 4"),
    ],
)
def test_a_wrong_channel_is_reported_with_the_channels_that_the_unit_has(
    unit: str, number: int, said: str
) -> None:
    text = CUBE.replace("TDC001", unit).replace("number = 1", f"number = {number}", 1)
    [problem] = [each for each in problems(text) if "key number" in each]
    assert problem == f"my.toml, [[channel]] with number = {number}, key number: {said}"


def test_all_problems_are_reported_together() -> None:
    text = CUBE
    for old, new in (("POTPARAMS", "POTS"), ('"Z8"', '"Z9"'), ("p99_ms = 50", "p99_ms = -1")):
        text = text.replace(old, new)
    found = problems(text)
    assert len(found) == 4  # including the travel in mm, which has no scale now
    assert all(word in "\n".join(found) for word in ("MOT_REQ_POTS", "'Z9'", "-1"))


@pytest.mark.parametrize(
    ("raw", "said"),
    [
        (b"unit = ", "my.toml: not a TOML file"),
        (b"\xff\xfe", "my.toml: not a TOML file"),
        (b"a = " + b"[" * 100_000, "my.toml: nested too deeply"),
        (b"", "key unit: missing"),
        (b"schema_version = 1\nunit = 'TDC001'\n" + b"x" * 9 + b" = 1", "unknown key"),
    ],
)
def test_a_file_that_is_not_a_pics_is_refused(raw: bytes, said: str) -> None:
    assert any(said in problem for problem in problems(raw))


def test_an_unreadable_file_is_reported(tmp_path: Path) -> None:
    with pytest.raises(PicsError, match="cannot read the file"):
        read_pics(tmp_path / "missing.toml")
    with pytest.raises(PicsError, match="cannot read the file"):
        read_pics(tmp_path)
    good = tmp_path / "good.toml"
    good.write_text(CUBE, encoding="utf-8")
    assert read_pics(good).unit == "TDC001"


# The schema

VALUES: list[Any] = [
    *(True, 0, 1, 2, -1, 3.5),
    *("", " ", "X", "usb", "3.3", "0..1counts", "0..1", "TDC001", "1/2"),
    *([], {}, [1], {"a": "b"}),
]

ONLY_THE_REGISTRY_KNOWS = re.compile(
    r"is not a message of|unknown (unit|stage|axis|issue) |uses|does not depend on it|has no bays|"
    r"does not exist|is not occupied|does not move a stage|give only one of them|is not known|"
    r"is a duplicate of|has (axes|channels), not|missing; (the (occupied bays|axes|modules) are|list each)|"
    r"no keep-alive|must not exceed|cannot be converted|counts in tenths|is not a number|above 0, not 0|"
    r"contains no whole count"
)
"""Problems of a file that satisfies the schema."""


def changed(document: Any) -> Iterator[Any]:
    """Yield documents with one difference: another value, a missing one, or an additional one."""
    for path in paths(document):
        for value in VALUES:
            yield put(document, path, value)
        if path:
            yield put(document, path, None)
        inner = at(document, path)
        if isinstance(inner, dict):
            yield put(document, (*path, "something"), "more")


def paths(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    yield path
    entries = value.items() if isinstance(value, dict) else ()
    for key, inner in enumerate(value) if isinstance(value, list) else entries:
        yield from paths(inner, (*path, key))


def at(document: Any, path: tuple[Any, ...]) -> Any:
    for key in path:
        document = document[key]
    return document


def put(document: Any, path: tuple[Any, ...], value: Any) -> Any:
    """Return a copy with another value at one path; None removes it."""
    if not path:
        return value
    made = copy.deepcopy(document)
    holder = at(made, path[:-1])
    if value is None:
        del holder[path[-1]]
    else:
        holder[path[-1]] = value
    return made


def toml(value: Any) -> str:
    """Return a value as inline TOML."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{json.dumps(k)} = {toml(v)}" for k, v in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(toml, value)) + "]"
    return json.dumps(value)


def refused(document: dict[str, Any]) -> tuple[str, ...]:
    text = "\n".join(f"{json.dumps(key)} = {toml(value)}" for key, value in document.items())
    assert tomllib.loads(text) == document
    try:
        parse_pics(text.encode())
    except PicsError as error:
        return error.problems
    return ()


@pytest.mark.parametrize("file", FILES)
def test_the_schema_and_the_reader_agree(file: str) -> None:
    whole = tomllib.loads(FILES[file])
    VALIDATOR.validate(whole)
    counts = {"both accept": 0, "both refuse": 0, "only the reader refuses": 0}
    for document in changed(whole):
        if not isinstance(document, dict):
            continue  # a file is a table
        valid, found = VALIDATOR.is_valid(document), refused(document)
        if not valid:
            assert found, f"only the schema refuses {document}"
            counts["both refuse"] += 1
        elif found:
            assert all(map(ONLY_THE_REGISTRY_KNOWS.search, found)), (document, found)
            counts["only the reader refuses"] += 1
        else:
            counts["both accept"] += 1
    assert min(counts.values()) >= 5, counts


def test_every_key_of_the_schema_is_read() -> None:
    def keys(schema: dict[str, Any]) -> set[str]:
        return set(schema.get("properties", ()))

    used = set()
    for text in FILES.values():
        for path in paths(tomllib.loads(text)):
            used.add(tuple(key for key in path if isinstance(key, str)))
    of_channel = {path[1] for path in used if path[:1] == ("channel",) and len(path) > 1}
    of_bay = {path[1] for path in used if path[:1] == ("bay",) and len(path) > 1}
    assert {path[0] for path in used if path} == keys(SCHEMA)
    assert of_channel == keys(SCHEMA["$defs"]["channel"])
    assert of_bay == keys(SCHEMA["$defs"]["bay"])
