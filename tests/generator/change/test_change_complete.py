"""The tables of changes cover every attribute of the model, the schemas and the documentation."""

from __future__ import annotations

import dataclasses
import json
import re
from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction
from typing import Any

import pytest

from checkout import ROOT
from stagewire_generator import model, model_scales
from stagewire_generator.change import KINDS, ChangeClass, compare
from stagewire_generator.change.attributes import ATTRIBUTES, SCALE
from stagewire_generator.change.entries import Data, Elsewhere, Entries, Ignored, Names, Sequence
from stagewire_generator.model import Protocol

KeyPath = tuple[str, ...]

DATACLASSES = [
    thing
    for module in (model, model_scales)
    for thing in vars(module).values()
    if dataclasses.is_dataclass(thing) and thing.__module__ == module.__name__
]


@pytest.mark.parametrize("cls", DATACLASSES, ids=lambda cls: cls.__name__)
def test_every_attribute_of_the_model_has_its_entry(cls: Any) -> None:
    assert set(ATTRIBUTES[cls]) == {field.name for field in dataclasses.fields(cls)}


def test_every_kind_that_a_table_names_exists() -> None:
    entries = [entry for table in (*ATTRIBUTES.values(), SCALE) for entry in table.values()]
    entries += [e for d in entries if isinstance(d, Data) for e in d.table.values()]
    for entry in entries:
        if isinstance(entry, str):
            assert entry in KINDS
        elif isinstance(entry, Names | Sequence):
            assert entry.kind in KINDS
        elif isinstance(entry, Entries):
            assert {entry.added, entry.removed} <= set(KINDS)
        else:
            assert isinstance(entry, Data | Elsewhere | Ignored)


def definition(kind: str, *path: str) -> tuple[Any, Any]:
    schema = json.loads((ROOT / f"spec/schema/{kind}.schema.json").read_text(encoding="utf-8"))
    part = schema
    for key in path:
        part = part[key]
    return schema, part


def paths(schema: Any, part: Any, path: str = "") -> set[str]:
    """Return the path of every value that a schema allows, with ``*`` for a name."""
    if "$ref" in part:
        part = {**schema["$defs"][part["$ref"].rpartition("/")[2]], **part}
    properties = {k: below for k, below in part.get("properties", {}).items() if "not" not in below}
    inner = {f"{path}/{name}": below for name, below in properties.items()}
    inner |= {f"{path}/*": below for below in part.get("patternProperties", {}).values()}
    if not inner:
        return {path.removeprefix("/")}
    return set().union(*(paths(schema, below, at) for at, below in inner.items()))


@pytest.mark.parametrize(
    ("cls", "attribute", "where"),
    [
        (Protocol, "document", ("protocol", "properties", "document")),
        (Protocol, "formats", ("protocol", "properties", "formats")),
        (Protocol, "framing", ("protocol", "properties", "framing")),
        (Protocol, "contexts", ("protocol", "properties", "contexts")),
        (Protocol, "units", ("units",)),
        (Protocol, "settings", ("quantities", "properties", "settings")),
        (model.Message, "call", ("messages", "$defs", "call")),
        (model.Message, "exchange", ("messages", "$defs", "exchange")),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_every_plain_fact_that_a_schema_allows_has_its_entry(
    cls: type, attribute: str, where: tuple[str, ...]
) -> None:
    data = ATTRIBUTES[cls][attribute]
    assert isinstance(data, Data)
    allowed = paths(*definition(*where))
    if attribute == "framing":  # the resolver adds the size of a format to its name
        named = {path for path in allowed if path.endswith("/format")}
        allowed |= {path.replace("/format", "/size") for path in named}

    if attribute == "units":  # the resolver adds the lists that name a unit
        allowed |= {"units/*/list", "units/*/more_lists"}

    def pattern(path: str) -> str:
        return re.sub(r"^addresses/\w+", "addresses/*", path)

    leaves = {p for p in data.table if not any(q.startswith(f"{p}/") for q in data.table)}
    marks = {path for path in leaves if path.endswith("/overlay")}  # added when one is applied
    assert {pattern(path) for path in allowed} == leaves - marks


def test_every_fact_of_a_scale_has_its_entry() -> None:
    _, scale = definition("quantities", "$defs", "scale", "properties")
    assert set(scale) == set(SCALE)
    for kind in ("quantities", "stages"):
        _, factor = definition(kind, "$defs", "factor", "properties")
        assert set(factor) <= set(ATTRIBUTES[model_scales.Factor]) | {"unknown", "conflict"}


def altered(value: Any) -> Any:
    """Return another value of the same type, or None if there is no other."""
    if isinstance(value, bool):
        return not value
    if isinstance(value, str):
        return f"{value}x"
    if isinstance(value, int | Fraction):
        return value + 1
    if isinstance(value, tuple) and value:
        return value[:-1]
    if isinstance(value, dict) and value:
        return dict(list(value.items())[:-1])
    return None


def objects(thing: Any, found: dict[tuple[type, str], Any]) -> None:
    """Find an object with a value for every attribute of every class of the model."""
    if dataclasses.is_dataclass(thing):
        for field in dataclasses.fields(thing):
            value = getattr(thing, field.name)
            if altered(value) is not None:
                found.setdefault((type(thing), field.name), thing)
            objects(value, found)
    elif isinstance(thing, dict):
        for value in thing.values():
            objects(value, found)
    elif isinstance(thing, tuple):
        for value in thing:
            objects(value, found)


def rebuilt(thing: Any, target: Any, instead: Any) -> Any:
    """Return the model with one object in it replaced everywhere."""
    if thing is target:
        return instead
    if dataclasses.is_dataclass(thing):
        fields = {f.name: getattr(thing, f.name) for f in dataclasses.fields(thing)}
        return replace(thing, **{n: rebuilt(v, target, instead) for n, v in fields.items()})
    if isinstance(thing, dict):
        return {key: rebuilt(value, target, instead) for key, value in thing.items()}
    if isinstance(thing, tuple):
        return tuple(rebuilt(value, target, instead) for value in thing)
    return thing


@pytest.fixture(scope="module")
def good(
    protocol: Protocol, layouts: Protocol, commands: Protocol, packets: Protocol
) -> tuple[Protocol, ...]:
    """The small good specs."""
    return protocol, layouts, commands, packets


def test_no_attribute_can_change_unnoticed(
    good: tuple[Protocol, ...], overlaid: dict[str, Protocol]
) -> None:
    tried = set()
    for whole in (*good, overlaid["tiny/second"]):
        found: dict[tuple[type, str], Any] = {}
        objects(whole, found)
        for (cls, name), thing in found.items():
            entry = ATTRIBUTES.get(cls, {}).get(name)
            if entry is None or isinstance(entry, Ignored):
                continue
            new = rebuilt(whole, thing, replace(thing, **{name: altered(getattr(thing, name))}))
            assert compare([whole], [new]), (whole.name, cls.__name__, name)
            tried.add((cls, name))
    wanted = {
        (cls, name)
        for cls, table in ATTRIBUTES.items()
        for name, entry in table.items()
        if not isinstance(entry, Ignored)
    }
    # Values that are objects, or missing, in all specs: the objects themselves are tested.
    assert {f"{cls.__name__}.{name}" for cls, name in wanted - tried} == {
        "Array.item", "Column.quantity", "Field.array", "Field.enum", "Field.flags", "Field.format",
        "Field.omitted", "Field.quantity",
        "FlagTable.format", "Layout.param1", "Layout.param2", "Quantity.factor",
    }  # fmt: skip


def leaves(data: Any, path: KeyPath = ()) -> Iterator[KeyPath]:
    """Yield the path of every value in plain data."""
    if isinstance(data, dict) and data:
        for key, value in data.items():
            yield from leaves(value, (*path, key))
    else:
        yield path


def with_leaf(data: Any, path: KeyPath, value: Any) -> Any:
    if not path:
        return value
    return {**data, path[0]: with_leaf(data[path[0]], path[1:], value)}


def value_at(data: Any, path: KeyPath) -> Any:
    for key in path:
        data = data[key]
    return data


@pytest.mark.parametrize(
    "attribute", ["document", "formats", "framing", "contexts", "settings", "units"]
)
def test_no_plain_fact_can_change_unnoticed(good: tuple[Protocol, ...], attribute: str) -> None:
    for whole in good:
        data = getattr(whole, attribute)
        for path in leaves(data) if data else ():
            value = value_at(data, path)
            if isinstance(value, list):
                other: Any = [altered(value[0]), *value[1:]] if value else ["more"]
            else:
                other = altered(value)
            new = replace(whole, **{attribute: with_leaf(data, path, other)})
            assert compare([whole], [new]), (whole.name, attribute, path)


def test_every_fact_of_the_framing_is_wire(
    protocol: Protocol, commands: Protocol, packets: Protocol
) -> None:
    """The page is an exception."""
    for whole, other in ((protocol, commands), (commands, packets), (packets, protocol)):
        for key, value in whole.framing.items():
            new = other.framing["kind"] if key == "kind" else altered(value)
            changed = replace(whole, framing={**whole.framing, key: new or []})
            [change] = compare([whole], [changed])
            assert change.kind == ("page" if key == "page" else "framing"), key
            assert (change.level is ChangeClass.WIRE) == (key != "page"), key


@pytest.mark.parametrize("part", ["order", "start", "end"])
def test_the_order_of_bytes_is_wire(packets: Protocol, part: str) -> None:
    """The order of the parts that a length counts is not, because it counts the same bytes."""
    framing = {**packets.framing, "end": [0x0D, 0x0A]}
    turned = {**framing, part: framing[part][::-1]}
    old, new = (replace(packets, framing=each) for each in (framing, turned))
    [change] = compare([old], [new])
    assert (change.kind, change.level) == ("framing", ChangeClass.WIRE)
    length = packets.framing["length"]
    turned = {**packets.framing, "length": {**length, "counts": length["counts"][::-1]}}
    [change] = compare([packets], [replace(packets, framing=turned)])
    assert (change.kind, change.level) == ("order", ChangeClass.DOC)


@pytest.mark.parametrize("part", ["length", "address", "id", "check"])
def test_the_size_of_a_number_is_wire_and_the_name_of_its_format_is_not(
    packets: Protocol, part: str
) -> None:
    for key, kind in (("size", "framing"), ("format", "format")):
        other = {**packets.framing[part], key: altered(packets.framing[part][key])}
        changed = replace(packets, framing={**packets.framing, part: other})
        assert [c.kind for c in compare([packets], [changed])] == [kind]


def test_the_schema_names_every_kind_and_class() -> None:
    _, change = definition("changes", "$defs", "change", "properties")
    assert change["kind"]["enum"] == list(KINDS)
    assert change["class"]["enum"] == [level.name for level in sorted(ChangeClass, reverse=True)]


def test_the_documentation_lists_every_kind() -> None:
    text = (ROOT / "docs" / "reference" / "changes.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| `([a-z-]+)` \| (WIRE|SOURCE|DOC) \| (.*) \|$", text, re.MULTILINE)
    assert rows == [(name, kind.level.name, kind.meaning) for name, kind in KINDS.items()]
