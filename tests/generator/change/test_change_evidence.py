"""Changes on the wire require evidence: what counts, what does not count, and the messages."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import pytest
import yaml

import plain_yaml
from checkout import SMALL_SPECS
from stagewire_generator import check
from stagewire_generator.change import ChangeClass, Spec, compare, compare_specs, unvouched
from stagewire_generator.diagnostics import Diagnostic

HERE = Path(__file__).parent
PROTOCOLS = {"good_spec": "tiny", "good_commands": "turtle", "good_packets": "carousel"}
EDITS = {entry["name"]: entry for entry in plain_yaml.read(HERE / "change_edits.yaml")}


@dataclass(frozen=True)
class Case:
    """A change, and the evidence in the same change."""

    name: str
    vouched: bool
    change: str = ""
    over: str = "good_spec"
    edits: list[dict[str, str]] = field(default_factory=list)
    erratum: dict[str, Any] | None = None
    example: dict[str, Any] | None = None

    @property
    def evidence(self) -> bool:
        """Whether the case has more than the bare change."""
        return bool(self.edits or self.erratum is not None or self.example)

    def apply(self, spec: Path) -> None:
        folder = spec / PROTOCOLS[self.over]
        for edit in (*(EDITS[self.change]["edits"] if self.change else ()), *self.edits):
            path = folder / edit["in"]
            text = path.read_text(encoding="utf-8") if edit["old"] else ""
            assert edit["old"] in text, f"{self.name}: {edit['old']!r} is not in {path.name}"
            path.write_text(text.replace(edit["old"], edit["new"]), encoding="utf-8")
        if self.erratum is not None:
            add_erratum(spec, folder.name, self.erratum)
        if self.example:
            add_example(spec, folder.name, "shown", SHOWN | self.example)


CASES = [
    Case(**{"edits" if key == "with" else key: value for key, value in entry.items()})
    for entry in plain_yaml.read(HERE / "evidence_cases.yaml")
]

ERRATUM = {
    "pages": [6],
    "subject": "Something",
    "messages": [],
    "printed": "one thing",
    "encoded": "another",
    "evidence": "It is invented.",
    "class": "meaning",
    "origin": "document",
}
STATEMENT = {
    "page": 6,
    "line": 70,
    "kind": "statement",
    "says": "Something.",
    "means": "Something else.",
    "claim": {"prose": True},
}
SHOWN = {
    "page": 6,
    "line": 71,
    "kind": "tx",
    "title": "shows it",
    "dest": 0x50,
    "source": 0x01,
    "verdict": "reproduced",
}


def add_erratum(spec: Path, protocol: str, facts: dict[str, Any]) -> None:
    """Add an erratum to the spec, and the statement that supports it."""
    path = spec / protocol / "errata" / "more.yaml"
    name = f"{protocol}-more"
    path.write_text(yaml.safe_dump({"errata": {name: ERRATUM | facts}}), encoding="utf-8")
    add_example(spec, protocol, "more", {**STATEMENT, "errata": [name]})


def add_example(spec: Path, protocol: str, name: str, facts: dict[str, Any]) -> None:
    path = spec / protocol / "examples.yaml"
    entry = yaml.safe_dump({name: facts}, default_flow_style=True, width=1000)
    text = path.read_text(encoding="utf-8").rstrip("\n")
    path.write_text(f"{text}\n  {entry.strip()[1:-1]}\n", encoding="utf-8")


def load(spec: Path) -> Spec:
    return Spec.of(check(spec).checked)


def left(old: Spec, new: Spec) -> list[Diagnostic]:
    """Return the diagnostics for changes without evidence."""
    changes = compare_specs(old, new)
    assert any(change.level is ChangeClass.WIRE for change in changes)
    return unvouched(changes, old, new)


def lines(found: list[Diagnostic]) -> list[str]:
    return [str(diagnostic).splitlines()[0] for diagnostic in found]


@pytest.fixture(scope="module")
def good() -> dict[str, Spec]:
    return {over: load(SMALL_SPECS / over) for over in PROTOCOLS}


@pytest.fixture
def folders(tmp_path: Path) -> Iterator[Path]:
    """Yield folders for copies of a good spec."""
    return (tmp_path / str(number) for number in range(9))


def edited(case: Case, folder: Path) -> Spec:
    shutil.copytree(SMALL_SPECS / case.over, folder)
    case.apply(folder)
    return load(folder)


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name.replace(" ", "-"))
def test_a_change_is_accepted_only_with_evidence(
    good: dict[str, Spec], folders: Iterator[Path], case: Case
) -> None:
    old, new = good[case.over], edited(case, next(folders))
    assert (left(old, new) == []) is case.vouched
    if (
        case.vouched and case.change and case.evidence
    ):  # without the evidence, the change is not accepted
        bare = replace(case, edits=[], erratum=None, example=None)
        assert left(old, edited(bare, next(folders)))


@pytest.mark.parametrize(
    ("change", "over", "expected"),
    [
        ("direction", "good_spec", [
            "tiny/messages/extra.yaml:7:3: SW050 LAMP direction: message-direction, "
            "to_controller -> both; no new or changed erratum, page, witness or example for it",
        ]),
        ("wider format", "good_spec", [
            "tiny/messages/extra.yaml:14:5: SW050 LAMP data length: layout-length, 4 -> 6; "
            "no new or changed erratum, page, witness or example for it",
            "tiny/messages/extra.yaml:14:83: SW050 LAMP data force: field-format, word -> dword; "
            "no new or changed erratum, page, witness or example for it",
        ]),
        ("layout removed", "good_spec", [
            "tiny/messages/core.yaml:65:3: SW050 POS_MOVE header: layout-removed, header -> nothing; "
            "no new or changed erratum, page, witness or example for it",
        ]),
        ("bit", "good_spec", [
            "tiny/messages/core.yaml:15:3: SW050 flags state_bits at_rest bit: bit-number, 1 -> 2; "
            "no new or changed erratum, page, witness or example for it",
        ]),
        ("scale of a stage", "good_spec", [
            "tiny/stages.yaml:6:3: SW050 stage Slide TPx distance: scale, counts_per_mm 20000 -> "
            "counts_per_mm 40001/2; no new or changed erratum, page, witness or example for it",
        ]),
        ("channels", "good_spec", [
            "tiny/units.yaml:23:50: SW050 unit TP9 channels: unit-channels, 1 -> 2; "
            "no new or changed erratum, page, witness or example for it",
        ]),
        ("longest packet", "good_spec", [
            "tiny/protocol.yaml:23:3: SW050 maximum_length: framing, 0xFF -> 0x80; "
            "no new or changed erratum, page, witness or example for it",
        ]),
        ("polynomial", "good_packets", [
            "carousel/protocol.yaml:36:5: SW050 polynomial: framing, 0x1021 -> 0x8005; "
            "no new or changed erratum, page, witness or example for it",
        ]),
        ("field of a setting", "good_spec", [
            "tiny/quantities.yaml:3:3: SW050 setting pace POS_VELPARAMS CHANNEL_1: setting, "
            "nothing -> CHANNEL_1; no new or changed erratum, page, witness or example for it",
            "tiny/quantities.yaml:3:3: SW050 setting pace POS_VELPARAMS field: setting, "
            "wait -> chan_ident; no new or changed erratum, page, witness or example for it",
            "tiny/quantities.yaml:4:5: SW050 setting pace unit: setting, us -> ms; "
            "no new or changed erratum, page, witness or example for it",
        ]),
        ("message removed", "good_spec", [
            "tiny/protocol.yaml:2:1: SW051 LAMP: message-removed, LAMP -> nothing; "
            "no new erratum names LAMP in its subject",
        ]),
        ("message that a command stops", "good_commands", [
            "turtle/messages/walk.yaml:28:3: SW050 GO_TO stops: exchange, HALT -> SPIN; "
            "no new or changed erratum, page, witness or example for it",
        ]),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)  # fmt: skip
def test_a_change_without_evidence_has_a_place_and_a_message(
    good: dict[str, Spec], folders: Iterator[Path], change: str, over: str, expected: list[str]
) -> None:
    case = Case("bare", vouched=False, change=change, over=over)
    assert lines(left(good[over], edited(case, next(folders)))) == expected


def test_the_hint_explains_how_an_erratum_names_the_changed_thing(
    good: dict[str, Spec], folders: Iterator[Path]
) -> None:
    [found] = left(good["good_spec"], edited(Case("", False, "scale"), next(folders)))
    assert found.cure.endswith("or an erratum with `quantity interval` in its subject")
    [found] = left(good["good_spec"], edited(Case("", False, "direction"), next(folders)))
    assert found.cure.endswith("or an erratum that names it")


def test_evidence_for_one_change_does_not_count_for_another(
    good: dict[str, Spec], folders: Iterator[Path]
) -> None:
    both = [*EDITS["direction"]["edits"], *EDITS["only zero"]["edits"]]
    case = Case("", False, edits=both, erratum={"messages": ["LAMP"]})
    [line] = lines(left(good["good_spec"], edited(case, next(folders))))
    assert "POS_ALIVE header only_zero: layout-only-zero" in line


def test_a_change_that_is_not_on_the_wire_needs_no_evidence(
    good: dict[str, Spec], folders: Iterator[Path]
) -> None:
    old, new = good["good_spec"], edited(Case("", True, "message added"), next(folders))
    changes = compare_specs(old, new)
    assert changes
    assert unvouched(changes, old, new) == []


def test_a_removed_protocol_is_always_reported(
    good: dict[str, Spec], folders: Iterator[Path]
) -> None:
    """A new document of another protocol does not count as evidence."""
    spec = next(folders)
    shutil.copytree(SMALL_SPECS / "good_spec", spec)
    shutil.copytree(SMALL_SPECS / "good_commands", spec, dirs_exist_ok=True)
    old = load(spec)
    head = spec / "turtle" / "protocol.yaml"
    (spec / "tiny").rename(spec.parent / "elsewhere")
    found = left(old, load(spec))
    assert lines(found) == ["tiny/protocol.yaml:1:1: SW051 the protocol tiny was removed"]
    assert found[0].cure.startswith("restore the protocol")
    head.write_text(head.read_text("utf-8").replace('issue: "2"', 'issue: "3"'), encoding="utf-8")
    printed = spec / "turtle" / "printed" / "document.yaml"
    printed.write_text(printed.read_text("utf-8").replace("rev=2", "rev=3"), encoding="utf-8")
    assert len(left(old, load(spec))) == 1


def test_changes_of_a_renamed_protocol_need_evidence(
    good: dict[str, Spec], folders: Iterator[Path]
) -> None:
    spec = next(folders)
    shutil.copytree(SMALL_SPECS / "good_spec", spec)
    Case("", False, "direction").apply(spec)
    for path in spec.rglob("*.yaml"):
        text = path.read_text(encoding="utf-8")
        path.write_text(text.replace("protocol: tiny", "protocol: small"), encoding="utf-8")
    [line] = lines(left(good["good_spec"], load(spec)))
    assert "SW050 LAMP direction" in line


def test_every_change_on_the_wire_needs_evidence(good: dict[str, Spec]) -> None:
    """Each change between protocols that have little in common is reported."""
    for name, noun in (("message", "POS_MOVE"), ("stage", "Slide")):
        old = good["good_spec"]
        [protocol] = old.protocols
        less = replace(
            protocol,
            messages=tuple(replace(m, layouts=()) for m in protocol.messages),
            stages=tuple(replace(s, scales={}) for s in protocol.stages),
        )
        changes = [c for c in compare([protocol], [less]) if c.level is ChangeClass.WIRE]
        found = unvouched(changes, old, Spec([less], old.files))
        assert len(found) == len(changes)
        assert any(change.where.get(name) == noun for change in changes)
