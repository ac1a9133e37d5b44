"""Every place of a spec that holds a text, found by walking its files along the JSON Schemas.

A *location* is a position in a schema that allows a text: a property, a map key or an item of a list. A
*place* is the position of a text in a file. Walking a file along its schema gives the locations of its
places, and so reveals locations without a place.
"""

from __future__ import annotations

import copy
import json
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import jsonschema

import plain_yaml
from checkout import SCHEMAS, SMALL_SPECS

GOOD = SMALL_SPECS / "good_spec"
COMMANDS = SMALL_SPECS / "good_commands"
PACKETS = SMALL_SPECS / "good_packets"
MORE = Path(__file__).parent / "more_spec"

KeyPath = tuple[str | int, ...]
Files = dict[str, Any]  # path below the folder of the spec -> data

_GROUPS = ("messages", "errata", "printed", "examples", "captures")
_TEXT = 'a "b" \\ {c} é'  # allowed only where any visible text is
# These keywords select a schema and do not describe values.
_CONDITIONS = frozenset({"if", "not", "propertyNames"})


@dataclass(frozen=True)
class Place:
    """A text in a file of the spec: a value or a key."""

    file: str
    path: KeyPath
    is_key: bool
    locations: frozenset[str]  # in the schema, as "kind#/pointer"
    free: bool  # any visible text is allowed
    longest: int

    def __str__(self) -> str:
        return f"{self.file}:{'.'.join(map(str, self.path))}{' (key)' * self.is_key}"

    @property
    def unread(self) -> bool:
        """Whether any text is valid here: it is compared neither with the witness nor with bytes."""
        of_commands = self.file.startswith("turtle/") and (
            self.path[0] == "document"
            or (self.path[0] in ("commands", "setup_commands") and self.path[-1] == "title")
        )
        of_bytes = Path(self.file).stem in ("examples", "captures") and "fields" in self.path
        of_errata = "/errata/" in self.file and "places" in self.path
        of_scales = Path(self.file).stem in ("quantities", "stages") and self.path[-1] == "printed"
        of_decisions = Path(self.file).stem == "decisions" and "states" in self.path
        compared = "/printed/" in self.file or any(
            (of_bytes, of_commands, of_errata, of_scales, of_decisions)
        )
        return self.free and not compared


# The spec


def complete_spec() -> Files:
    """Return the good specs of the generator's tests, and additions for everything they lack."""
    files = {}
    for folder in (GOOD, COMMANDS, PACKETS, MORE):
        for path in sorted(folder.rglob("*.yaml")):
            name = path.relative_to(folder).as_posix()
            files[name] = plain_yaml.load(path.read_text(encoding="utf-8"))
    return files


def kind_of(file: str) -> str:
    """Return the kind of a file, which is the name of its schema."""
    folder, _, name = file.rpartition("/")
    group = folder.rpartition("/")[2]
    return group if group in _GROUPS else name.removesuffix(".yaml")


def write(files: Files, folder: Path, *, raw: str = "") -> Path:
    """Write the files as JSON, which is also YAML, with escapes for characters beyond ASCII.

    :param raw: characters to write without an escape.
    """
    for name, data in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        text = json.dumps(data, ensure_ascii=False, indent=1)
        text = re.sub(
            r"[^\x00-\x7e]",
            lambda char: char[0] if char[0] in raw else f"\\U{ord(char[0]):08x}",
            text,
        )
        path.write_bytes(text.encode("utf-8"))
    return folder


def changed(files: Files, place: Place, text: str) -> Files:
    """Return the files with another text in one place."""
    return all_changed(files, [(place, text)])


def all_changed(files: Files, texts: Iterable[tuple[Place, str]]) -> Files:
    """Return the files with other texts in several places."""
    copies: Files = {}
    for place, text in texts:
        if place.file not in copies:
            copies[place.file] = copy.deepcopy(files[place.file])
        *way, last = place.path
        holder = copies[place.file]
        for part in way:
            holder = holder[part]
        if place.is_key:
            entries = [(text if key == last else key, value) for key, value in holder.items()]
            holder.clear()
            holder.update(entries)
        else:
            holder[last] = text
    return {**files, **copies}


# The schemas


@cache
def schema(kind: str) -> Any:
    return json.loads((SCHEMAS / f"{kind}.schema.json").read_text(encoding="utf-8"))


def _target(root: Any, reference: str) -> Any:
    for part in reference.removeprefix("#/").split("/"):
        root = root[part]
    return root


def _resolved(node: Any, root: Any) -> Any:
    """Return a schema merged with the schemas it refers to."""
    while isinstance(node, dict) and "$ref" in node:
        rest = {key: value for key, value in node.items() if key != "$ref"}
        node = {**_target(root, node["$ref"]), **rest}
    return node


def _takes_text(node: Any, root: Any) -> bool:
    """Return whether a schema accepts a text."""
    node = _resolved(node, root)
    if not isinstance(node, dict):
        return False
    if "enum" in node:
        return any(isinstance(value, str) for value in node["enum"])
    if "const" in node:
        return isinstance(node["const"], str)
    kinds = node.get("type", ())
    return "string" in ([kinds] if isinstance(kinds, str) else kinds)


def locations(root: Any) -> set[str]:
    """Return the pointers of all texts in a schema, with " (key)" after those of keys."""
    return set(_locations(root, root, "#"))


def _locations(root: Any, node: Any, pointer: str) -> Iterator[str]:
    if isinstance(node, list):
        node = {str(index): item for index, item in enumerate(node)}
        yield from (
            found for k, v in node.items() for found in _locations(root, v, f"{pointer}/{k}")
        )
    if not isinstance(node, dict):
        return
    for key, value in node.items():
        at = f"{pointer}/{key}"
        if key in ("properties", "patternProperties", "prefixItems"):
            named = enumerate(value) if key == "prefixItems" else value.items()
            for name, below in named:
                if key == "patternProperties":
                    yield f"{at}/{name} (key)"
                if _takes_text(below, root):
                    yield f"{at}/{name}"
                yield from _locations(root, below, f"{at}/{name}")
        elif key in ("items", "additionalProperties", "unevaluatedProperties", "contains"):
            if _takes_text(value, root):
                yield at
            yield from _locations(root, value, at)
        elif key not in _CONDITIONS:
            yield from _locations(root, value, at)


# Places


def places(files: Files) -> list[Place]:
    """Return every place of the files."""
    found = []
    for file, data in files.items():
        kind = kind_of(file)
        walk = _Walk(schema(kind))
        walk.apply(schema(kind), "#", data, ())
        for path, is_key in sorted(walk.locations, key=str):
            pointers = frozenset(f"{kind}{p}" for p in walk.locations[path, is_key])
            applied = [] if is_key else [walk.schemas[p] for p in walk.locations[path, is_key]]
            free = bool(applied) and all(walk.holds(node, _TEXT) for node in applied)
            longest = min((node.get("maxLength", 10**6) for node in applied), default=0)
            found.append(Place(file, path, is_key, pointers, free, longest))
    return found


def representatives(files: Files) -> list[Place]:
    """Return one place for each set of locations in each protocol."""
    found = {
        (place.locations, place.file.partition("/")[0]): place for place in reversed(places(files))
    }
    return list(found.values())[::-1]


class _Walk:
    """A walk along the data of a file and its schema in parallel."""

    def __init__(self, root: Any) -> None:
        self.root = root
        self.locations: dict[tuple[KeyPath, bool], set[str]] = {}
        self.schemas: dict[str, Any] = {}  # by location
        self.validators: dict[int, Any] = {}

    def holds(self, node: Any, data: Any) -> bool:
        if id(node) not in self.validators:
            whole = {"$defs": self.root.get("$defs", {}), "allOf": [node]}
            self.validators[id(node)] = jsonschema.Draft202012Validator(whole)
        return bool(self.validators[id(node)].is_valid(data))

    def note(self, pointer: str, path: KeyPath, is_key: bool = False) -> None:
        self.locations.setdefault((path, is_key), set()).add(pointer)

    def enter(self, node: Any, pointer: str, data: Any, path: KeyPath) -> None:
        if isinstance(data, str) and _takes_text(node, self.root):
            self.note(pointer, path)
            if pointer not in self.schemas:
                self.schemas[pointer] = _resolved(node, self.root)
        self.apply(node, pointer, data, path)

    def apply(self, node: Any, pointer: str, data: Any, path: KeyPath) -> None:
        """Follow every part of a schema that applies to the data."""
        if not isinstance(node, dict):
            return
        if "$ref" in node:
            self.apply(_target(self.root, node["$ref"]), node["$ref"], data, path)
        for key in ("allOf", "anyOf", "oneOf"):
            for index, below in enumerate(node.get(key, ())):
                if key == "allOf" or self.holds(below, data):
                    self.apply(below, f"{pointer}/{key}/{index}", data, path)
        if "if" in node:
            branch = "then" if self.holds(node["if"], data) else "else"
            self.apply(node.get(branch), f"{pointer}/{branch}", data, path)
        if isinstance(data, dict):
            self.mapping(node, pointer, data, path)
        elif isinstance(data, list):
            first = node.get("prefixItems", ())
            for index, item in enumerate(data):
                if index < len(first):
                    at = f"{pointer}/prefixItems/{index}"
                    self.enter(first[index], at, item, (*path, index))
                else:
                    self.enter(node.get("items"), f"{pointer}/items", item, (*path, index))

    def mapping(self, node: Any, pointer: str, data: dict[str, Any], path: KeyPath) -> None:
        for name, value in data.items():
            at = (*path, name)
            if name in node.get("properties", ()):
                self.enter(node["properties"][name], f"{pointer}/properties/{name}", value, at)
            patterns = [p for p in node.get("patternProperties", {}) if re.search(p, name)]
            for pattern in patterns:
                below = node["patternProperties"][pattern]
                where = f"{pointer}/patternProperties/{pattern}"
                self.note(f"{where} (key)", at, is_key=True)
                self.enter(below, where, value, at)
            if name not in node.get("properties", ()) and not patterns:
                below = node.get("additionalProperties")
                self.enter(below, f"{pointer}/additionalProperties", value, at)
        for name, below in node.get("dependentSchemas", {}).items():
            if name in data:
                self.apply(below, f"{pointer}/dependentSchemas/{name}", data, path)
