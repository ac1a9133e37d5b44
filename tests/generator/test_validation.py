"""The two libraries that validate files agree on every file."""

from __future__ import annotations

import copy
import json
import math
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from random import Random
from typing import Any

import jsonschema
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stagewire_generator import check
from stagewire_generator.diagnostics import Diagnostics
from stagewire_generator.schemas import KINDS, fits_schema, schema_folder
from stagewire_generator.strict_yaml import Document, load

HERE = Path(__file__).parent
NAMES = ("good_spec", "good_layouts", "good_commands", "good_packets", "good_overlays")
GOOD = [HERE / name for name in NAMES]
BAD = HERE / "bad_specs"
_FOLDERS = {"messages", "errata", "printed", "examples", "captures"}  # of files of one kind

# Values that patterns, lengths and types should reject, or that the libraries might treat differently.
HOSTILE = [
    "", "a", "A", "a\n", "A\n", "\n", "a b", "\x00", "a\x7f", "\u00ad", "\u200b", "\u2028", "\ud800",
    "\U0001f600", "\u0663", "\u017f", "\u212a", "é", "lower_snake", "UPPER_SNAKE", "-", "_", "a" * 5000,
    0, -1, 1, 2, 255, 256, 1 << 63, 1 << 64, -(1 << 64), 10**40, 1.0, 1.5, -0.0, math.inf, math.nan,
    True, False, None, [], {}, [[]], ["a", "a"], [1, True], [0, False, 0.0], {"a": None}, {"": 1},
    {"a\n": 1}, '"""',
]  # fmt: skip


def kind_of(path: Path) -> str | None:
    """Return the kind of a file of a spec, from its location."""
    kind = path.parent.name if path.parent.name in _FOLDERS else path.stem
    return kind if kind in KINDS else None


@cache
def documents(folders: tuple[Path, ...]) -> list[tuple[str, Document]]:
    found = []
    for path in sorted(path for folder in folders for path in folder.rglob("*.yaml")):
        kind = kind_of(path)
        document = load(path, path.as_posix(), Diagnostics(), any_byte=True)
        if kind is not None and document is not None:
            found.append((kind, document))
    return found


@cache
def oracle(kind: str) -> jsonschema.Draft202012Validator:
    """Return the unchanged schema in the library that decides."""
    text = (schema_folder() / f"{kind}.schema.json").read_text(encoding="utf-8")
    return jsonschema.Draft202012Validator(json.loads(text))


def agree(kind: str, document: Document) -> bool:
    """Validate a document with both libraries, and return whether it is valid."""
    diagnostics = Diagnostics()
    fits = fits_schema(document, kind, diagnostics)
    assert fits == oracle(kind).is_valid(document.data), (kind, document.data)
    assert fits == (not diagnostics.found)
    return fits


def nodes(data: Any) -> Iterator[tuple[Any, Any]]:
    """Yield every container with each of its keys or indices."""
    for key, value in [*(data.items() if isinstance(data, dict) else enumerate(data))]:
        yield data, key
        if isinstance(value, (dict, list)):
            yield from nodes(value)


def test_good_files_are_valid() -> None:
    found = documents(tuple(GOOD))
    assert {kind for kind, _ in found} == set(KINDS)
    for kind, document in found:
        part = kind in ("stages", "units") and "/overlays/" in document.name
        assert agree(kind, document) or part, document.name
        assert fits_schema(document, kind, Diagnostics(), part=part)


def test_broken_files_are_invalid_in_both() -> None:
    assert not all(agree(kind, document) for kind, document in documents((BAD,)))
    # The name of a replacement file does not give its kind, so every kind is tried.
    for path in sorted(BAD.glob("sw010-*.yaml")):
        document = load(path, path.name, Diagnostics())
        if document is not None:
            assert not all(agree(kind, document) for kind in KINDS), path.name


@settings(max_examples=400, deadline=None)
@given(st.integers(0, 2**32))
def test_both_libraries_agree_on_damaged_files(seed: int) -> None:
    """The seed selects a value or key of a good file, and its replacement."""
    rng = Random(seed)
    kind, document = rng.choice(documents(tuple(GOOD)))
    data = copy.deepcopy(document.data)
    for _ in range(rng.choice((1, 1, 1, 3))):
        found = list(nodes(data))
        if not found:
            break
        holder, key = rng.choice(found)
        way = rng.random()
        if way < 0.6:
            holder[key] = copy.deepcopy(rng.choice(HOSTILE))
        elif way < 0.75:
            del holder[key]
        elif isinstance(holder, dict):
            name = rng.choice([text for text in HOSTILE if isinstance(text, str)])
            holder[name] = holder.pop(key) if way < 0.9 else copy.deepcopy(rng.choice(HOSTILE))
        else:
            holder.append(copy.deepcopy(rng.choice(HOSTILE)))
    agree(kind, Document(document.name, data, {}))


def test_a_valid_spec_only_needs_the_fast_library(
    good_spec: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in [name for name in sys.modules if name.partition(".")[0] == "jsonschema"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "jsonschema", None)
    assert [protocol.name for protocol in check(good_spec)] == ["tiny"]
