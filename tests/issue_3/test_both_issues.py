"""Everything of Issue 3 is still in the package with both issues, with the same bytes.

The base is built in memory. The changes that the later issue may make are listed here, with the reasons.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import pytest

from checkout import ROOT
from stagewire_apt import PROTOCOL
from stagewire_conformance.examples import run_capture, run_example
from stagewire_conformance.verdict import succeeded
from stagewire_generator import check, render

Json = dict[str, Any]

REPLACED = {
    "hw-get-info": "HW_GET_INFO: 16 characters of the notes are now versions",
    "identify": "MOD_IDENTIFY: the unused first parameter is now the channel",
    "richresponse": "HW_RICHRESPONSE: it has a layout",
    "suspend-richresponse": "HW_RICHRESPONSE: it has a layout",
    "kdc101-identify": "MOD_IDENTIFY: the unused first parameter is now the channel",
}
"""Worked examples and captures of Issue 3 that the later issue restates, with the changed fact."""

SPLIT = {
    ("HW_GET_INFO", "notes"),
    *(
        (f"PZ_{kind}_TSG_IOSETTINGS", name)
        for kind in ("SET", "GET")
        for name in ("force_calib", "future_use_1", "future_use_2")
    ),
}
"""Fields that the later issue divides or widens; their bytes stay."""


@pytest.fixture(scope="module")
def base() -> Mapping[str, Any]:
    """The registry and the vectors of Issue 3, built in memory."""
    files = render(check(ROOT / "spec" / "thorlabs_apt", base=True), ["python"])
    folder = "python/stagewire_apt"
    return {kind: json.loads(files[f"{folder}/{kind}.json"]) for kind in ("registry", "vectors")}


def by_name(entries: list[Json]) -> dict[str, Json]:
    return {entry["name"]: entry for entry in entries}


def test_the_base_has_only_its_own_document(base: Mapping[str, Any]) -> None:
    assert base["registry"]["document"]["issue"] == "3"
    assert "overlays" not in base["registry"]["document"]
    assert [o["name"] for o in PROTOCOL.registry()["document"]["overlays"]] == [
        "issue_37",
        "vendor_software",
    ]


def test_every_worked_example_of_issue_3_passes_with_both_issues(base: Mapping[str, Any]) -> None:
    vectors = base["vectors"]
    examples = [entry for entry in vectors["examples"] if entry["id"] not in REPLACED]
    captures = [entry for entry in vectors["captures"] if entry["id"] not in REPLACED]
    total = len(vectors["examples"]) + len(vectors["captures"])
    assert len(examples) + len(captures) == total - len(REPLACED)
    verdicts = [run_example(PROTOCOL, entry) for entry in examples]
    verdicts += [run_capture(PROTOCOL, entry) for entry in captures]
    assert not [(v.id, v.detail) for v in verdicts if v.failed]
    assert succeeded(verdicts)


def test_a_restated_example_has_the_same_bytes(base: Mapping[str, Any]) -> None:
    now = {e["id"]: e for kind in ("examples", "captures") for e in PROTOCOL.vectors()[kind]}
    was = {e["id"]: e for kind in ("examples", "captures") for e in base["vectors"][kind]}
    for slug in REPLACED:
        assert now[slug].get("bytes") == was[slug].get("bytes"), slug
        assert now[slug]["overlay"] == "issue_37"


def _bytes(field: Json) -> tuple[int, int]:
    return field["offset"], field["size"]


def test_every_layout_and_field_of_issue_3_has_the_same_bytes(base: Mapping[str, Any]) -> None:
    now = by_name(PROTOCOL.registry()["messages"])
    for name, was in by_name(base["registry"]["messages"]).items():
        assert (now[name]["id"], now[name]["direction"]) == (was["id"], was["direction"])
        forms = {layout["form"]: layout for layout in now[name]["layouts"]}
        for layout in was["layouts"]:
            if layout["form"] == "undocumented":
                continue
            same = forms[layout["form"]]
            assert same["length"] == layout["length"], (name, layout["form"])
            fields = by_name(same["fields"])
            for field in layout["fields"]:
                place = (name, layout["form"], field["name"])
                if (name, field["name"]) in SPLIT:
                    continue
                if field["role"] == "reserved":  # the later issue may name it
                    assert _bytes(field) in map(_bytes, same["fields"]), place
                else:
                    assert _bytes(fields[field["name"]]) == _bytes(field), place
                    assert fields[field["name"]]["format"] == field["format"], place


def test_every_unit_of_issue_3_has_its_messages_address_and_status(base: Mapping[str, Any]) -> None:
    now = by_name(PROTOCOL.registry()["units"])
    for name, was in by_name(base["registry"]["units"]).items():
        assert set(was["messages"]) <= set(now[name]["messages"]), name
        assert set(was["stages"]) <= set(now[name]["stages"]), name
        for key in ("address", "channels", "status", "keep_alive", "update_rate_hz"):
            assert now[name].get(key) == was.get(key), (name, key)


def test_every_value_of_issue_3_keeps_its_name_and_number(base: Mapping[str, Any]) -> None:
    registry = PROTOCOL.registry()
    for kind in ("enumerations", "flags"):
        for name, was in base["registry"][kind].items():
            now = registry[kind][name]
            for part in ("values", "bits"):
                for word, entry in was.get(part, {}).items():
                    assert _number(now[part][word]) == _number(entry), (name, word)


def _number(entry: Any) -> Any:
    return entry if isinstance(entry, int) else entry.get("value", entry.get("bit"))


def _scales(registry: Json, stage: str, unit: str) -> Json:
    """Return the scales of a stage on a unit, by quantity."""
    controllers = registry["controllers"]
    return {
        quantity: {part: value for part, value in scale.items() if part.startswith("counts_per")}
        for name, scales in by_name(registry["stages"])[stage]["controllers"].items()
        if unit in controllers.get(name, {"units": [name]})["units"]
        for quantity, scale in scales.items()
    }


def test_every_scale_of_issue_3_is_the_same(base: Mapping[str, Any]) -> None:
    compared = 0
    units = by_name(base["registry"]["units"])
    for stage in by_name(base["registry"]["stages"]):
        for unit in units:
            was = _scales(base["registry"], stage, unit)
            now = _scales(PROTOCOL.registry(), stage, unit)
            for quantity, scale in was.items():
                assert not scale or now[quantity] == scale, (stage, unit, quantity)
                compared += bool(scale)
    assert compared > 50
