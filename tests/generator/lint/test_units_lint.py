"""Contradictions between facts about units: each single change to the real registry is an error.

A mutation changes one fact of ``units.yaml`` or ``stages.yaml`` of Thorlabs APT so that it contradicts
another. Of all places where a mutation is possible, a few are drawn with a fixed seed.
"""

from __future__ import annotations

import copy
import random
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml

import plain_yaml
from checkout import ROOT
from stagewire_generator.diagnostics import SpecError
from stagewire_generator.pipeline import check

pytestmark = pytest.mark.usefixtures("quick_checking")

Json = dict[str, Any]
Edit = tuple[
    str, str, Callable[[Json], None]
]  # what is wrong, the file, and the change to its data
APT = ROOT / "spec" / "thorlabs_apt"
UNITS: Json = plain_yaml.read(APT / "units.yaml")
STAGES: Json = plain_yaml.read(APT / "stages.yaml")
SEED, DRAWN = "units", 5


def put(file: str, *path: Any, value: Any) -> Edit:
    """Return an edit that sets one value."""

    def change(data: Json) -> None:
        for key in path[:-1]:
            data = data[key]
        data[path[-1]] = value

    return f"{'.'.join(map(str, path))} is {value}", file, change


def without(file: str, *path: Any, item: str) -> Edit:
    """Return an edit that removes an item from a list, or a key from a mapping."""

    def change(data: Json) -> None:
        for key in path:
            data = data[key]
        data.remove(item) if isinstance(data, list) else data.pop(item)

    return f"{'.'.join(map(str, path))} lacks {item}", file, change


def listed(unit: Json, name: str) -> list[str]:
    """Return the names of the messages in the list of a unit or of its family."""
    lists = [entry["messages"] for entry in UNITS["lists"].values() if name in entry["units"]]
    family = UNITS["families"][unit["family"]]
    found: list[str] = (lists or [family.get("messages")])[0] or listed(
        UNITS["units"][family["like"]], family["like"]
    )
    return found


def sources() -> Iterator[tuple[tuple[str, str, str], list[str]]]:
    """Yield the path and the messages of each list, and of each family with messages of its own."""
    for section in ("lists", "families"):
        for name, entry in UNITS[section].items():
            if "messages" in entry:
                yield (section, name, "messages"), entry["messages"]


def prefixes_of_another_unit() -> Iterator[Edit]:
    prefixes = {unit["usb_prefix"] for unit in UNITS["units"].values() if "usb_prefix" in unit}
    for name, unit in UNITS["units"].items():
        for prefix in sorted(prefixes - {unit.get("usb_prefix")}):
            yield put("units.yaml", "units", name, "usb_prefix", value=prefix)
    for prefix, entry in UNITS["known_prefixes"].items():
        for other in UNITS["known_prefixes"].values():
            if other is not entry:
                path = ("known_prefixes", prefix, "unit")
                yield put("units.yaml", *path, value=other["unit"])


def families_of_another_status() -> Iterator[Edit]:
    status = {unit["family"]: unit["status"] for unit in UNITS["units"].values()}
    for name, unit in UNITS["units"].items():
        for family in UNITS["families"]:
            has_list = any(name in entry["units"] for entry in UNITS["lists"].values())
            if status[family] != unit["status"] and not has_list:
                yield put("units.yaml", "units", name, "family", value=family)
        for kind in sorted({*status.values()} - {unit["status"]}):
            yield put("units.yaml", "units", name, "status", value=kind)


def lists_of_another_unit() -> Iterator[Edit]:
    for key, entry in UNITS["lists"].items():
        for name in UNITS["units"]:
            if name not in entry["units"]:
                yield put("units.yaml", "lists", key, "units", 0, value=name)


def replies_removed() -> Iterator[Edit]:
    for path, messages in sources():
        for name in messages:
            if "_GET_" in name:
                yield without("units.yaml", *path, item=name)


def stages_without_a_scale() -> Iterator[Edit]:
    for name, unit in UNITS["units"].items():
        for stage in unit["stages"]:
            for group, entry in STAGES["controllers"].items():
                scales = STAGES["stages"][STAGES["stages"][stage].get("like", stage)]["controllers"]
                if name in entry.get("units", ()) and len(scales) > 1:
                    path = ("stages", stage, "controllers")
                    yield without("stages.yaml", *path, item=group)
        for group, entry in STAGES["controllers"].items():
            if name in entry.get("units", ()) and len(entry["units"]) > 1:
                yield without("stages.yaml", "controllers", group, "units", item=name)
    for stage, entry in STAGES["stages"].items():
        for group in entry.get("controllers", ()):
            yield without("stages.yaml", "stages", stage, "controllers", group, item="position")


def stops_removed() -> Iterator[Edit]:
    for path, messages in sources():
        if "MOT_MOVE_HOME" in messages:
            yield without("units.yaml", *path, item="MOT_MOVE_STOP")


def addresses_outside_the_framing() -> Iterator[Edit]:
    for address in (0x02, 0x12, 0x20, 0x2B, 0x51, 0x7F):
        for owner in ("host", "motherboard", "generic_usb"):
            yield put("units.yaml", "addresses", owner, "value", value=address)
        for end in ("first", "last"):
            yield put("units.yaml", "addresses", "bays", end, value=address)
        for name, family in UNITS["families"].items():
            for index, _ in enumerate(family.get("also_at", {}).get("addresses", ())):
                path = ("families", name, "also_at", "addresses", index)
                yield put("units.yaml", *path, value=address)


def bays_that_disagree() -> Iterator[Edit]:
    for count in (1, 9, 11):
        yield put("units.yaml", "addresses", "bays", "count", value=count)
    for end, other in (("first", 0x22), ("last", 0x29)):
        yield put("units.yaml", "addresses", "bays", end, value=other)
    for name, unit in UNITS["units"].items():
        if "bays" in unit:
            yield put("units.yaml", "units", name, "bays", value=11)
            yield put("units.yaml", "units", name, "bays", value=unit["bays"] + 1)


def stages_of_another_controller() -> Iterator[Edit]:
    for name, unit in UNITS["units"].items():
        for stage in STAGES["stages"]:
            if stage not in unit["stages"]:
                yield put("units.yaml", "units", name, "stages", value=[*unit["stages"], stage])
        for stage in unit["stages"]:
            yield without("units.yaml", "units", name, "stages", item=stage)


def ids_that_disagree() -> Iterator[Edit]:
    field = "MOT_GET_PMDSTAGEAXISPARAMS.stage_id"
    yield put("stages.yaml", "stages", "MLS203_X", "ids", field, "id", value=0x11)
    yield put(
        "stages.yaml",
        "stages",
        "MLS203_X",
        "ids",
        value={"HW_GET_INFO.stage": {"id": 2, "page": 76}},
    )
    report = ("families", "brushless_dc", "reports_stage", "field")
    for name in (
        "MOT_GET_PMDSTAGEAXISPARAMS.stage",
        "MOT_MOVE_HOMED.chan_ident",
        "PZ_GET_IOSETTINGS.chan_ident",
    ):
        yield put("units.yaml", *report, value=name)


MUTATIONS = [
    ids_that_disagree,
    prefixes_of_another_unit,
    families_of_another_status,
    lists_of_another_unit,
    replies_removed,
    stages_without_a_scale,
    stops_removed,
    addresses_outside_the_framing,
    bays_that_disagree,
    stages_of_another_controller,
]


@pytest.fixture(scope="module")
def apt(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the registry of Thorlabs APT, without overlays."""
    folder = tmp_path_factory.mktemp("registry") / APT.name
    return Path(shutil.copytree(APT, folder, ignore=shutil.ignore_patterns("overlays")))


def drawn() -> Iterator[Any]:
    for mutation in MUTATIONS:
        edits = list(mutation())
        generator = random.Random(f"{SEED} {mutation.__name__}")
        for what, file, change in generator.sample(edits, min(DRAWN, len(edits))):
            yield pytest.param(file, change, id=f"{mutation.__name__}: {what}")


@pytest.mark.parametrize(("file", "change"), list(drawn()))
def test_a_contradiction_is_an_error(apt: Path, file: str, change: Callable[[Json], None]) -> None:
    path = apt / file
    before = path.read_text(encoding="utf-8")
    data = copy.deepcopy(plain_yaml.load(before))
    change(data)
    path.write_text(yaml.safe_dump(data, sort_keys=False, allow_unicode=True), encoding="utf-8")
    try:
        with pytest.raises(SpecError) as caught:
            check(apt)
    finally:
        path.write_text(before, encoding="utf-8")
    assert not {d.code for d in caught.value.diagnostics} & {"SW001", "SW004", "SW010"}
