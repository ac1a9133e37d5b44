"""Every kind of change, produced by an edit of a small good spec, and the generated output on both sides."""

from __future__ import annotations

import ast
import json
import shutil
from collections import Counter
from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path
from typing import Any, ClassVar

import jsonschema
import pytest

import plain_yaml
from checkout import SCHEMAS, SMALL_SPECS
from stagewire_generator import TARGETS, check, model, render
from stagewire_generator.change import (
    KINDS,
    Change,
    ChangeClass,
    Spec,
    compare,
    compare_specs,
    worst,
)
from stagewire_generator.change.changes import report
from stagewire_generator.model import Protocol

HERE = Path(__file__).parent
SCHEMA = json.loads((SCHEMAS / "changes.schema.json").read_text("utf-8"))
PYTHON_TARGET = import_module("stagewire_generator.targets.python.view")
VALIDATOR = jsonschema.Draft202012Validator(SCHEMA)


FRAMINGS = {"good_spec": "tiny", "good_commands": "turtle", "good_packets": "carousel"}
PROTOCOLS = FRAMINGS | {"good_layouts": "laser"}


@dataclass(frozen=True)
class Edit:
    """An edit of a good spec, which replaces texts in files, and the kinds of changes that it produces."""

    name: str
    kinds: list[str]
    edits: list[dict[str, str]]
    over: str = "good_spec"

    def apply(self, spec: Path) -> None:
        for edit in self.edits:
            path = spec / PROTOCOLS[self.over] / edit["in"]
            text = path.read_text(encoding="utf-8") if edit["old"] else ""
            assert edit["old"] in text, f"{self.name}: {edit['old']!r} is not in {path.name}"
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text.replace(edit["old"], edit["new"]), encoding="utf-8")


EDITS = {entry["name"]: Edit(**entry) for entry in plain_yaml.read(HERE / "change_edits.yaml")}

INVERSE = {
    "added": "removed",
    "removed": "added",
    "named": "unnamed",
    "unnamed": "named",
}


def inverse(kind: str) -> str:
    """Return the kind of the reverse change."""
    if kind == "message-id-added":
        return "message-id"  # the id is removed again
    head, _, last = kind.rpartition("-")
    found = f"{head}-{INVERSE[last]}" if last in INVERSE else kind
    return found if found in KINDS else kind


@dataclass(frozen=True)
class Edited:
    """An edit, with the registries before and after it."""

    edit: Edit
    old: Spec
    new: Spec
    changes: list[Change]


@pytest.fixture(scope="module")
def good(
    protocol: Protocol, layouts: Protocol, commands: Protocol, packets: Protocol
) -> dict[str, Protocol]:
    """The good specs by name."""
    return {
        "good_spec": protocol,
        "good_layouts": layouts,
        "good_commands": commands,
        "good_packets": packets,
    }


@pytest.fixture(scope="module")
def generated(good: dict[str, Protocol]) -> dict[str, dict[str, str]]:
    """The output of all targets for each good spec, by its name."""
    return {name: render([protocol], TARGETS) for name, protocol in good.items()}


@pytest.fixture(scope="module", params=EDITS.values(), ids=lambda edit: edit.name.replace(" ", "-"))
def edited(
    request: pytest.FixtureRequest,
    quick_checking: None,
    good: dict[str, Protocol],
    tmp_path_factory: pytest.TempPathFactory,
) -> Edited:
    edit = request.param
    spec = Path(
        shutil.copytree(SMALL_SPECS / edit.over, tmp_path_factory.mktemp("edited") / "spec")
    )
    edit.apply(spec)
    old, new = Spec([good[edit.over]]), Spec.of(check(spec).checked)
    return Edited(edit, old, new, compare_specs(old, new))


def kinds(changes: list[Change]) -> list[str]:
    return sorted(change.kind for change in changes)


def test_an_edit_and_its_reverse_produce_the_expected_changes(edited: Edited) -> None:
    there = edited.changes
    assert kinds(there) == sorted(edited.edit.kinds)
    back = compare_specs(edited.new, edited.old)
    expected = Counter((inverse(c.kind), c.new, c.old) for c in there)
    if edited.edit.name == "id removed":  # the reverse of this WIRE change adds an id
        expected = Counter({("message-id-added", None, "0x0202"): 1})
    assert Counter((c.kind, c.old, c.new) for c in back) == expected
    data = json.loads(json.dumps(report("old", "new", there)))
    problems = VALIDATOR.iter_errors(data)
    assert [f"{error.json_path}: {error.message}" for error in problems] == []
    assert sum(data["counts"].values()) == len(data["changes"])


def test_generated_code_differs_for_wire_and_source_changes_only(
    generated: dict[str, dict[str, str]], edited: Edited
) -> None:
    """Every other difference is at least a DOC change."""
    changes = edited.changes
    before = generated[edited.edit.over]
    if not changes:
        assert render(edited.new.protocols, TARGETS) == before
        return
    with (
        pytest.MonkeyPatch.context() as patch
    ):  # the JSON in a package is the same as the registry's
        for name in ("registry_text", "vectors_text"):
            patch.setattr(PYTHON_TARGET, name, lambda _: "")
        after = render(edited.new.protocols, ["python"])
    grave = {change.kind for change in changes if change.level > ChangeClass.DOC}
    paths = {path for path in before.keys() | after.keys() if path.endswith(".py")}
    if any(code_differs(before.get(path), after.get(path)) for path in paths):
        assert grave
    else:
        assert grave <= OF_THE_REGISTRY | OF_THE_RUNTIME | OF_OVERLAYS
        if grave & OF_THE_REGISTRY:
            assert registry(before) != registry(after)


# Facts in registry.json, which the library reads, and not in generated code.
OF_THE_REGISTRY = {
    "address", "alias-added", "alias-removed", "bit-motion", "controller-added", "effect",
    "enumeration-open", "exchange", "family-added", "field-enumeration", "field-flags-by-unit",
    "field-open", "field-quantity", "field-scale", "flags-open", "list-added", "list-messages",
    "message-set", "motion-need", "prefix-added", "prefix-shared", "quantity-added", "quantity-removed",
    "quantity-unit", "scale", "scale-added", "scale-form", "scale-removed", "set-removed",
    "unit-added", "unit-address", "unit-also-at", "unit-baud-rates", "unit-channels",
    "unit-keep-alive", "unit-messages", "unit-model", "unit-prefix", "unit-rate", "unit-stages",
    "unit-state", "unit-status", "value-modifier",
}  # fmt: skip
# Facts that no target writes: they are also in the hand-written library, which would have to be changed.
OF_THE_RUNTIME = {"framing"}
# Facts that are only generated on request.
OF_OVERLAYS = {"overlay-added", "overlay-default"}


def registry(files: dict[str, str]) -> list[str]:
    return [text for path, text in files.items() if path.endswith("/registry.json")]


def code_differs(before: str | None, after: str | None) -> bool:
    """Whether two generated modules differ in more than texts and the order of entries."""
    return before != after and code(before) != code(after)


def code(text: str | None) -> str:
    """Return a generated module as syntax, without texts and without the order of entries."""
    return "" if text is None else ast.dump(Bare().visit(ast.parse(text)))


class Bare(ast.NodeTransformer):
    """Removes docstrings and arguments that are texts for people, and sorts entries without an order."""

    TEXTS: ClassVar = {  # index of the argument
        "Bit": 1, "Stage": 1, "UnknownLimit": 0, "UnknownScale": 1, "FramedProtocol": 1,
        "CommandProtocol": 1, "Known": 1,
    }  # fmt: skip
    KEYWORDS: ClassVar = {
        "Stage": {"page"},
        "Unit": {"title", "page", "messages_from", "pause_source"},
        "of": {"source"},
        "counts_per": {"printed", "source"},
        "unit_per": {"printed", "source"},
    }

    def body(self, node: Any) -> Any:
        self.generic_visit(node)
        node.body = [
            statement
            for statement in node.body
            if not (
                isinstance(statement, ast.Expr)
                and isinstance(statement.value, ast.Constant)
                and isinstance(statement.value.value, str)
            )
        ]
        if not isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            node.body.sort(key=ast.dump)
        return node

    visit_Module = visit_ClassDef = visit_FunctionDef = visit_AsyncFunctionDef = body

    def visit_Call(self, node: ast.Call) -> ast.Call:
        self.generic_visit(node)
        name = node.func.id if isinstance(node.func, ast.Name) else getattr(node.func, "attr", "")
        if name in self.TEXTS:
            del node.args[self.TEXTS[name] : self.TEXTS[name] + 1]
        dropped = self.KEYWORDS.get(name, set())
        node.keywords = [keyword for keyword in node.keywords if keyword.arg not in dropped]
        for keyword in node.keywords:
            if name == "Stage" and keyword.arg == "controllers":
                for units in keyword.value.values:  # type: ignore[attr-defined]
                    units.elts.sort(key=ast.dump)
        return node

    def visit_Dict(self, node: ast.Dict) -> ast.Dict:
        self.generic_visit(node)
        pairs = sorted(zip(node.keys, node.values, strict=True), key=lambda p: ast.dump(p[0]))
        node.keys, node.values = [key for key, _ in pairs], [value for _, value in pairs]
        return node

    def visit_Set(self, node: ast.Set) -> ast.Set:
        self.generic_visit(node)
        node.elts.sort(key=ast.dump)
        return node

    def visit_AnnAssign(self, node: ast.AnnAssign) -> ast.AnnAssign:
        self.generic_visit(node)
        if isinstance(node.target, ast.Name) and node.target.id == "MESSAGES":
            node.value.elts.sort(key=ast.dump)  # type: ignore[union-attr]
        return node


def swapped(protocol: Protocol, **changes: Any) -> list[Change]:
    return compare([protocol], [replace(protocol, **changes)])


@pytest.mark.parametrize("name", PROTOCOLS)
def test_equal_specs_have_no_changes(good: dict[str, Protocol], name: str) -> None:
    assert compare([good[name]], check(SMALL_SPECS / name)) == []
    assert compare([], []) == []
    assert worst([]) is None


def made(over: str) -> set[str]:
    """Return the kinds of changes from the edits of a good spec and their reverses."""
    kinds = {kind for edit in EDITS.values() if edit.over == over for kind in edit.kinds}
    return kinds | {inverse(kind) for kind in kinds}


# Kinds that no edit of a single protocol's files can produce; tests below produce them.
BY_HAND = {
    "chapter-renamed", "protocol-added", "protocol-removed", "protocol-renamed", "unclassified",
}  # fmt: skip
# Kinds that a framing does not support, or for which the spec has no entries.
OF_LAYOUTS = {
    "field-array",
    "layout-sent-when",
    "message-not-sent",
    "message-without-flag",
    "message-sub-message",
    "unit-context",
}  # only in the spec of such layouts
NOT_IN = {
    "good_spec": {"command-dummy", "command-size", "message-kind", "setup-switch"},
    "good_commands": {
        "address", "controller-unit-removed", "layout-context", "layout-only-zero", "message-direction",
        "unit-address", "unit-also-at", "unit-channels", "unit-keep-alive", "unit-prefix", "unit-rate",
        "unit-status", "addressee", "setting", "parameter-omitted",
    },
    "good_packets": {
        "addressee", "call-default", "setting", "parameter-omitted",
        "address", "command-dummy", "command-size", "controller-unit-removed", "layout-context",
        "layout-only-zero", "message-kind", "setup-switch", "unit-address", "unit-also-at", "unit-channels",
        "unit-keep-alive", "unit-prefix", "unit-rate", "unit-status",
    },
}  # fmt: skip


def test_every_kind_is_produced_by_an_edit_or_its_reverse() -> None:
    found = set().union(*map(made, PROTOCOLS))
    assert found | BY_HAND == set(KINDS)
    assert not found & BY_HAND


@pytest.mark.parametrize("over", FRAMINGS)
def test_every_wire_kind_is_produced_in_every_framing(over: str) -> None:
    wire = {kind for kind, found in KINDS.items() if found.level is ChangeClass.WIRE}
    assert made(over) & wire == wire - BY_HAND - NOT_IN[over] - OF_LAYOUTS


def test_added_removed_and_renamed_protocols_are_reported(protocol: Protocol) -> None:
    other = replace(protocol, name="other", messages=protocol.messages[:1])
    [added] = compare([protocol], [protocol, other])
    assert (added.kind, added.level, added.protocol) == (
        "protocol-added",
        ChangeClass.SOURCE,
        "other",
    )
    [removed] = compare([protocol, other], [protocol])
    assert (removed.kind, removed.level, removed.old) == (
        "protocol-removed",
        ChangeClass.WIRE,
        "other",
    )
    [renamed] = compare([protocol, other], [replace(protocol, name="small"), other])
    assert (renamed.kind, renamed.old, renamed.new) == ("protocol-renamed", "tiny", "small")


def test_a_renamed_chapter_without_messages_is_reported(protocol: Protocol) -> None:
    chapter = model.Chapter("empty", "Nothing", 9, 3, "")
    old = replace(protocol, chapters=(*protocol.chapters, chapter))
    new = replace(protocol, chapters=(*protocol.chapters, replace(chapter, name="void")))
    assert kinds(compare([old], [new])) == ["chapter-renamed"]


@pytest.mark.parametrize("value", [3, {"deep": {"deeper": 3}}])
def test_an_unknown_fact_counts_as_wire(protocol: Protocol, value: object) -> None:
    [change] = swapped(protocol, units={**protocol.units, "colours": value})
    assert (change.kind, change.level, change.new) == ("unclassified", ChangeClass.WIRE, "3")


def test_an_unknown_fact_of_a_scale_counts_as_wire(protocol: Protocol) -> None:
    quantities = tuple(
        replace(q, rule={**q.rule, "humour": "dry"}) if q.name == "share" else q
        for q in protocol.quantities
    )
    assert kinds(swapped(protocol, quantities=quantities)) == ["unclassified"]


@pytest.mark.parametrize(
    ("name", "kind", "said"),
    [
        (
            "layout of the same length",
            "layout-context",
            "ambiguous: a packet of 6 bytes may also be data:coil, and only the context (status: servo)",
        ),
        ("layout of the same length", "layout-added", "may also be data:servo, and"),
        ("context no longer needed", "layout-context", "a context is no longer needed"),
        ("layout renamed", "layout-renamed", "the class PosMovedServo is now PosMovedMotor"),
        ("message added", "message-added", "were unknown and can now be read"),
        ("message renamed and changed", "message-added", "frames with this id were LAMP"),
        ("layout for an undocumented message", "layout-added", "its bytes were kept raw"),
        ("words", "message-words", "the class LampTest is now Lamptest"),
        ("id removed", "message-id", "no longer has an id"),
    ],
)
def test_a_change_states_its_meaning(
    protocol: Protocol, spec: Path, name: str, kind: str, said: str
) -> None:
    EDITS[name].apply(spec)
    [text] = [change.text for change in compare([protocol], check(spec)) if change.kind == kind]
    assert said in text


def test_a_setup_command_is_not_confused_with_the_command_that_has_its_byte(
    commands: Protocol, commands_spec: Path
) -> None:
    EDITS["setup command added with the byte of another command"].apply(commands_spec)
    changes = compare([commands], check(commands_spec))
    [added] = [change for change in changes if change.kind == "message-added"]
    assert (added.new, "were unknown" in added.text, "WHERE" in added.text) == ("STAY", True, False)


def test_a_message_that_loses_its_layout_is_reported(protocol: Protocol) -> None:
    messages = tuple(replace(m, layouts=()) if m.name == "LAMP" else m for m in protocol.messages)
    [change] = swapped(protocol, messages=messages)
    assert change.kind == "layout-removed"
    assert "no longer has a layout" in change.text


def test_a_change_has_its_location_and_both_values(protocol: Protocol, spec: Path) -> None:
    EDITS["wider format"].apply(spec)
    changes = compare([protocol], check(spec))
    found = {change.kind: change for change in changes}
    format = found["field-format"]
    assert format.where == {"message": "LAMP", "form": "data", "field": "force"}
    assert (format.old, format.new, format.protocol) == ("word", "dword", "tiny")
    assert found["layout-length"].where["attribute"] == "length"


def test_the_gravest_changes_come_first(protocol: Protocol) -> None:
    flags = tuple(
        replace(t, page=99, bits=(replace(t.bits[0], bit=7), *t.bits[1:])) for t in protocol.flags
    )
    changes = swapped(protocol, title="Another", package="another", flags=flags)
    levels = [change.level for change in changes]
    assert levels == sorted(levels, reverse=True)
    assert set(levels) == set(ChangeClass)
    assert worst(changes) is ChangeClass.WIRE
    counts = report("a", "b", changes)["counts"]
    assert counts == {"WIRE": 2, "SOURCE": 1, "DOC": 3}


def test_an_ambiguous_match_is_not_a_rename(protocol: Protocol) -> None:
    """Either of two new stages with the same scales could be the removed one."""
    [slide] = protocol.stages
    new = (replace(slide, name="One"), replace(slide, name="Two"))
    assert kinds(swapped(protocol, stages=new)) == ["stage-added", "stage-added", "stage-removed"]
