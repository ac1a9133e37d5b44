"""The complete spec has a text at every location where a schema allows one."""

from __future__ import annotations

import copy
from pathlib import Path
from typing import Any

import pytest
import text_places
from text_places import Files, Place, changed, complete_spec, kind_of, locations, representatives

from spec_schemas import spec_kinds

SPEC_SCHEMAS = {kind_of(name) for name in complete_spec()}


def test_every_schema_of_a_spec_has_files() -> None:
    assert spec_kinds() == SPEC_SCHEMAS


# One word, in a spec in which every fact has a second witness; tests of the lint have such a spec.
ONE_WORD = {"protocol#/properties/witness"}


def unreached(files: Files) -> set[str]:
    wanted = {f"{kind}{at}" for kind in SPEC_SCHEMAS for at in locations(text_places.schema(kind))}
    wanted -= ONE_WORD
    reached = set().union(*(place.locations for place in representatives(files)))
    assert reached <= wanted
    return wanted - reached


def test_every_location_has_a_place(files: Files) -> None:
    assert unreached(files) == set()


def test_a_new_text_in_a_schema_is_detected(files: Files, monkeypatch: pytest.MonkeyPatch) -> None:
    units = copy.deepcopy(text_places.schema("units"))
    units["properties"]["motto"] = {"$ref": "#/$defs/text"}
    units["$defs"]["unit_entry"]["properties"]["colours"] = {"items": {"enum": ["red", 1]}}
    units["$defs"]["list"]["patternProperties"] = {"^x": {"prefixItems": [{"const": "y"}]}}
    real = text_places.schema
    monkeypatch.setattr(
        text_places, "schema", lambda kind: units if kind == "units" else real(kind)
    )
    assert unreached(files) == {
        "units#/properties/motto",
        "units#/$defs/unit_entry/properties/colours/items",
        "units#/$defs/list/patternProperties/^x (key)",
        "units#/$defs/list/patternProperties/^x/prefixItems/0",
    }


def test_a_removed_place_is_detected(files: Files) -> None:
    fewer = copy.deepcopy(files)
    del fewer["tiny/stages.yaml"]["stages"]["Slide"]["note"]
    [name] = text_places.schema("stages")["properties"]["stages"]["patternProperties"]
    stage = f"stages#/properties/stages/patternProperties/{name}"
    assert unreached(fewer) == {f"{stage}/properties/note"}
    del fewer["turtle/messages/walk.yaml"]["commands"]["WHERE"]["reply"]["note"]
    del fewer["turtle/messages/walk.yaml"]["commands"]["GO_TO"]["request"]["note"]
    assert "messages#/$defs/part/properties/note" in unreached(fewer)


@pytest.mark.parametrize("is_key", [False, True])
def test_changed_replaces_one_text(files: Files, is_key: bool) -> None:
    path = ("stages", "Slide", "controllers", "TPx")
    place = Place(
        "tiny/stages.yaml", path if is_key else (*path[:2], "title"), is_key, frozenset(), False, 9
    )
    before = copy.deepcopy(files)
    other = changed(files, place, "new")["tiny/stages.yaml"]["stages"]["Slide"]
    assert files == before
    if is_key:
        assert list(other["controllers"]) == ["new", "TP9"]
    else:
        assert other["title"] == "new"


def test_written_files_are_read_back_equal(files: Files, tmp_path: Path) -> None:
    from stagewire_generator.diagnostics import Diagnostics
    from stagewire_generator.strict_yaml import load

    text_places.write(files, tmp_path)
    for name, data in files.items():
        diagnostics = Diagnostics()
        document: Any = load(tmp_path / name, name, diagnostics, any_byte=True)
        assert not diagnostics
        assert document.data == data
