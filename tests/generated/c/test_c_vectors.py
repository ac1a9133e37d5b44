"""Worked examples, captures and cases in C: the verdicts equal those of Python, and all gaps are listed."""

from __future__ import annotations

import json
import re
from collections import Counter
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from toolchain import C, Package, need, of_each_package, packages
from vector_programs import Finding, build_vectors, changed, findings_of, vectors_of

from checkout import SMALL_SPECS
from files import write_files
from stagewire.protocols import Protocol, load_protocol
from stagewire_conformance.examples import run as run_in_python
from stagewire_conformance.registry import registry_of
from stagewire_generator import pipeline
from stagewire_generator.model import Protocol as Model
from stagewire_generator.targets.templates import Templates

if TYPE_CHECKING:
    from conftest import Once

Json = dict[str, Any]

PROTOCOLS = {"stagewire_apt": "thorlabs_apt", "stagewire_ms2000": "asi_ms2000"}
PROSE = "prose that a program cannot check"
# Number of examples that only Python checks, by the reason in C; prose, which is never checked, is left out.
LEFT_OUT = {
    "stagewire_apt": {
        "arithmetic in the document, without bytes or a scale": 28 + 95,  # Issue 3, Issue 37
        "a missing name cannot be checked in C": 2,
    },
    "stagewire_ms2000": {
        "arithmetic in the document, without bytes or a scale": 15,
        "does not concern bytes; see the JSON of the registry": 6,
    },
}
# Bytes of the longest message that the runner of the vectors supports; testees answer longer cases.
LONGEST = 480
# Errors of a decoder in C; the compiler reports those of encoding, except values out of range.
DECODED = {"truncated", "trailing", "bad_length", "unknown_message"}


@pytest.fixture(scope="module")
def found(once: Once) -> dict[str, dict[str, Finding]]:
    """The results of the programs, by package and id."""
    need("gcc")
    said = {}
    for package in packages():
        made = once(f"{package.prefix}-vectors", partial(build_vectors, package))
        said[package.name], in_all, status = findings_of(made / vectors_of(package))
        assert status == 0, in_all
        assert len(in_all) == 2
    return said


@cache
def protocol_of(package: Package) -> Protocol:
    return load_protocol(PROTOCOLS[package.name])


def cases_of(package: Package) -> dict[str, Json]:
    """Return the published cases by id."""
    path = C.parent / "vectors" / f"{PROTOCOLS[package.name]}.json"
    return {case["id"]: case for case in json.loads(path.read_text(encoding="utf-8"))["cases"]}


@of_each_package
def test_examples_and_captures_have_the_verdicts_of_python(
    package: Package, found: dict[str, dict[str, Finding]]
) -> None:
    said = found[package.name]
    reasons: Counter[str] = Counter()
    verdicts = run_in_python(protocol_of(package))
    assert len(verdicts) > 150
    for verdict in verdicts:
        finding = said[verdict.id]
        if verdict.outcome == "passed" and finding.outcome == "noted":
            reasons[finding.detail] += 1
        else:
            assert (verdict.outcome, finding.outcome) in (("passed",) * 2, ("noted",) * 2), verdict
            assert finding.detail == (PROSE if finding.outcome == "noted" else "")
    assert reasons == LEFT_OUT[package.name]


@of_each_package
def test_every_case_that_can_be_written_in_c_passes(
    package: Package, found: dict[str, dict[str, Finding]]
) -> None:
    said, cases = found[package.name], cases_of(package)
    examples = {verdict.id for verdict in run_in_python(protocol_of(package))}
    assert said.keys() - examples <= cases.keys()
    assert all(finding.outcome == "passed" for id, finding in said.items() if id in cases)
    sayable = {id for id, case in cases.items() if is_sayable(package, case)}
    assert len(sayable) > 600
    assert sayable - said.keys() == set()


def is_sayable(package: Package, case: Json) -> bool:
    """Whether C has a function for a case, and types for its values."""
    request, answer = case["request"], case["answer"]
    form = str(answer.get("form", request.get("form", "")))
    if len(request.get("hex") or answer.get("hex") or "") > 2 * LONGEST:
        return False
    if form.endswith((":undecided", "undocumented")) or request.get("refuse_prefix_bytes"):
        return False
    if request.get("op") == "encode":
        return bool(answer["ok"]) and bool(layouts_of(package, request["message"]))
    if request.get("op") != "decode":
        return False
    return bool(answer["ok"]) or (answer["error"] in DECODED and has_layout(package, request))


def layouts_of(package: Package, name: str) -> list[Json]:
    """Return the layouts of a message; none for an unknown message."""
    message = registry_of(protocol_of(package)).messages.get(name)
    return message["layouts"] if message else []


def has_layout(package: Package, request: Json) -> bool:
    """Whether a layout can be tried with the bytes: undocumented messages have none."""
    if request.get("direction") == "reply":
        forms = [layout["form"] for layout in layouts_of(package, request["command"])]
        return "reply" in forms
    raw = bytes.fromhex(request["hex"])
    id = int.from_bytes(raw[:2], "little")
    messages = registry_of(protocol_of(package)).messages.values()
    known = [message for message in messages if message["id"] == id and len(raw) > 1]
    return package.name != "stagewire_apt" or not known or bool(known[0]["layouts"])


@of_each_package
def test_omitted_cases_are_counted(package: Package, found: dict[str, dict[str, Finding]]) -> None:
    text = (package.folder / "testing" / "cases.c").read_text(encoding="utf-8").partition("*/")[0]
    here, total = map(int, re.findall(r"(\d+) of (\d+) cases, in", text)[0])
    reasons = [int(count) for count in re.findall(r"^ \* - (\d+) with ", text, re.MULTILINE)]
    cases = cases_of(package)
    assert total == len(cases)
    assert here == len(found[package.name].keys() & cases.keys())
    assert here + sum(reasons) == total


def test_a_case_that_encodes_out_of_range_is_refused_in_c(
    found: dict[str, dict[str, Finding]],
) -> None:
    for package in packages():
        refused = [
            id
            for id, case in cases_of(package).items()
            if case["answer"].get("error") == "out_of_range" and id in found[package.name]
        ]
        assert len(refused) > 10


# For each kind of vector: a file, a change of it, and the message of the vector.
WRONG = {
    "values": ("examples.c", ".position = INT32_C(100000)", ".position = INT32_C(100001)",
               "encoded to other bytes (READ_MOTOR_POSITION)"),
    "axis": ("examples.c", "STAGEWIRE_ENVELOPE(.axis = 0x18)", "STAGEWIRE_ENVELOPE(.axis = 0x19)",
             "encoded to other bytes (INCREMENT_MOVE_UP)"),
    "events": ("examples.c", "EVENTS(STAGEWIRE_EVENT_GARBAGE)", "EVENTS(STAGEWIRE_EVENT_MESSAGE)",
               "parsed into other events"),
    "layout": ("examples.c", '.message = "START_MOTOR"', '.message = "READ_STATUS"',
               "has a layout (READ_STATUS)"),
    "constant": ("examples.c", "MS2000_BUSY_BUSY == 66", "MS2000_BUSY_BUSY == 67",
                 "differs from the document"),
    "counts": ("examples.c", ".counts = INT64_C(100000)", ".counts = INT64_C(100001)",
               "converted to other counts"),
    "range": ("examples.c", ".verdict = STAGEWIRE_OUT_OF_RANGE,", "",
              "encoding failed (READ_RAMP_TIME)"),
    "writing": ("wire.h", "bytes[2] = (uint8_t)((value >> 16) & 0xFFU);", "bytes[2] = 0U;",
                "encoded to other bytes"),
    "reading": ("wire.h", "((uint32_t)bytes[2] << 16)", "0U", "decoded another value (position)"),
    "sign": ("wire.h", "- INT32_C(0x800000)", "- INT32_C(0x7FFFFF)", "decoded another value"),
    "end": ("wire.h", "return end + 1U == size", "return end <= size",
            "decoding succeeded, or failed with another error"),
    "beyond": ("testing/layouts.c", "*size = made;", "*size = made; out[made] = 0U;",
               "wrote past the buffer"),
}  # fmt: skip


ONLY_CASES = ("end",)


@pytest.mark.parametrize("wrong", WRONG)
def test_errors_are_found(wrong: str, tmp_path: Path) -> None:
    need("gcc")
    package = next(package for package in packages() if package.name == "stagewire_ms2000")
    ending, old, new, finds = WRONG[wrong]
    copy = changed(package, tmp_path / "c", {ending: (old, new)})
    alone = "cases" if wrong in ONLY_CASES else "examples"
    found, in_all, status = findings_of(build_vectors(copy, tmp_path, alone))
    failed = {finding.detail for finding in found.values() if finding.outcome == "failed"}
    assert status == 1
    assert finds in {detail if "(" in finds else detail.partition(" (")[0] for detail in failed}
    assert any(" 0 failed" not in line for line in in_all)


def written(protocol: Model, folder: Path) -> Package:
    """Return the package of a protocol, generated to a folder."""
    write_files(folder, pipeline.render([protocol], ["c", "c-tests"], Templates()))
    return Package(folder / "c" / protocol.package)


@pytest.mark.parametrize("spec", ["good_spec", "good_layouts", "good_commands"])
def test_vectors_of_test_protocols_pass(spec: str, tmp_path: Path) -> None:
    """Formats of 1 to 8 bytes, names that C reserves: properties that our protocols do not have."""
    need("gcc")
    [protocol] = pipeline.check(SMALL_SPECS / spec)
    package = written(protocol, tmp_path)
    found, _, status = findings_of(build_vectors(package, tmp_path))
    assert status == 0
    outcomes = {finding.outcome for finding in found.values()}
    assert "passed" in outcomes
    assert outcomes <= {"passed", "noted"}
    assert len(found) > 100


STATEMENT = {"page": 1, "kind": "statement", "says": "s", "means": "m"}
FRAME = {
    "page": 1,
    "kind": "rx",
    "title": "t",
    "verdict": "reproduced",
    "form": "request",
    "axis": 1,
}
NUMBER = {
    "page": 1,
    "kind": "number_format",
    "title": "t",
    "verdict": "reproduced",
    "printed": "01",
}
SCALED = {
    "value": 1,
    "unit": "mm",
    "quantity": "no_such",
    "counts": 1,
    "factor": "exact",
    "exact": 1,
}
# Examples that the schema accepts but a conformance run would report; the C must still compile.
ODD = {
    "no-flag": {**STATEMENT, "claim": {"flag": "no_such.bit", "bit": 1}},
    "no-field": {**STATEMENT, "claim": {"range": "NO_SUCH.field", "minimum": 1}},
    "no-value": {**STATEMENT, "claim": {"enum": "no_such", "member": "X", "value": 2**64 - 1}},
    "no-command": {**STATEMENT, "claim": {"without_size": ["NO_SUCH"]}},
    "no-dummy": {**STATEMENT, "claim": {"dummies": ["NO_SUCH"]}},
    "no-size": {**STATEMENT, "claim": {"sizes": {"minimum": -1, "maximum": 2**64 - 1}}},
    "no-message": {**FRAME, "message": "NO_SUCH", "printed": "01", "fields": {}},
    "no-format": {**NUMBER, "format": "no_such", "value": 1},
    "no-scale": {"page": 1, "kind": "scaling", "title": "t", "stated": [SCALED]},
    "no-key": {"page": 1, "kind": "keyboard", "title": "t", "verdict": "reproduced", "axis": 1,
               "typed": "Alt[999]", "printed": "01", "notation": "decimal"},
}  # fmt: skip


def test_examples_that_cannot_be_written_in_c_are_noted(tmp_path: Path) -> None:
    need("gcc")
    [protocol] = pipeline.check(SMALL_SPECS / "good_commands")
    package = written(replace(protocol, examples={"examples": ODD}), tmp_path)
    found, _, status = findings_of(build_vectors(package, tmp_path, "examples"))
    assert status == 0
    assert {id: finding.outcome for id, finding in found.items()} == dict.fromkeys(ODD, "noted")
    assert all(finding.detail.startswith("cannot be written in C: ") for finding in found.values())
