"""The tables in README.md and ``docs/hardware/`` match the registry, the classes and the virtual units."""

from __future__ import annotations

import dataclasses
import re
import sys
from pathlib import Path
from typing import Any

import pytest

import stagewire
import stagewire_apt
import stagewire_ms2000
from checkout import ROOT
from stagewire_conformance.device.permissions import Permissions
from stagewire_conformance.device.plans import Plan
from stagewire_generator.model import Protocol
from stagewire_generator.model_evidence import Evidence, EvidenceTable, Source
from stagewire_generator.pipeline import check
from stagewire_virtual.factory import simulated_units

sys.path.insert(0, str(ROOT / "tools"))

from hardware_pages.__main__ import FOLDER, described, pages, texts
from hardware_pages.tables import Page, Units

README = (ROOT / "README.md").read_text(encoding="utf-8")
FIRST_SCREEN = README.partition("## Install")[0]
OWNED = [
    *(
        "KDC101",
        "K10CR1",
        "K10CR2",
        "KST101",
        "KST201",
        "BSC201",
        "BSC203",
        "LTS150",
        "LTS300",
        "KVS30",
    ),
    *("KBD101", "TBD001", "BBD202", "BBD302", "MLJ050", "MLJ150", "MFF101", "MFF102", "MS2000"),
    *("Z825B", "MTS50-Z8", "PRM1-Z8", "DDS100", "MLS203"),
]


@pytest.fixture(scope="module")
def apt() -> Protocol:
    """The registry of Thorlabs APT, with the overlays that are on by default."""
    return next(protocol for protocol in check(ROOT / "spec") if protocol.name == "thorlabs_apt")


def page(**changes: Any) -> Page:
    entry = {
        "file": "x.md",
        "title": "X",
        "units": ["KDC101"],
        "stages": [],
        "calls": {"home": "home"},
    }
    return Page(**{**entry, **changes})


def test_every_table_matches_the_registry() -> None:
    """To update the tables, run ``python tools/hardware_pages``."""
    found = dict(texts(ROOT))
    assert {path.parent for path in found} == {ROOT, ROOT / FOLDER}
    assert [path for path, text in found.items() if path.read_text("utf-8") != text] == []


@pytest.mark.parametrize("name", OWNED)
def test_the_first_screen_of_the_readme_names_what_people_own(name: str) -> None:
    assert re.search(rf"\b{re.escape(name)}\b", FIRST_SCREEN)


@pytest.mark.parametrize("unit", [name for page in pages(ROOT / FOLDER) for name in page.units])
def test_each_unit_has_a_class(unit: str) -> None:
    package = stagewire_ms2000 if unit in ("MS2000", "MFC2000") else stagewire_apt
    assert getattr(package, unit).unit.name == unit


@pytest.mark.parametrize("page", pages(ROOT / FOLDER), ids=lambda page: page.title)
def test_a_page_says_if_its_units_cannot_be_simulated_yet(page: Page) -> None:
    missing = {*page.units} - {*simulated_units()}
    text = " ".join((ROOT / FOLDER / page.file).read_text(encoding="utf-8").split())
    assert re.search("no virtual controllers? yet", text) if missing else True


@pytest.mark.parametrize(
    "unit",
    [name for page in pages(ROOT / FOLDER) for name in page.units if name in simulated_units()],
)
def test_each_simulated_unit_opens_and_has_conformance_checks(unit: str) -> None:
    with stagewire.open(f"virtual://{unit}", unit) as device:
        assert type(device).__name__ == unit
    assert len(Plan.of(unit, Permissions()).checks) >= 20


def test_a_unit_without_a_page_and_one_on_two_pages_are_errors(tmp_path: Path) -> None:
    (tmp_path / "spec").symlink_to(ROOT / "spec")
    folder = tmp_path / FOLDER
    folder.mkdir(parents=True)
    text = (ROOT / FOLDER / "pages.toml").read_text(encoding="utf-8")
    changed = text.replace('"KDC101", ', "").replace('"K10CR1"', '"K10CR1", "MLJ050"')
    (folder / "pages.toml").write_text(changed, encoding="utf-8")
    with pytest.raises(ValueError, match="on more than one: MLJ050; on none: KDC101"):
        described(tmp_path)


def test_an_unknown_unit_or_stage_is_an_error(apt: Protocol) -> None:
    with pytest.raises(ValueError, match=r"x\.md: the registry has no unit KDC999"):
        Units(page(units=["KDC999"]), apt)
    with pytest.raises(
        ValueError, match=r"x\.md: unknown stage for the units of this page: DDS100"
    ):
        Units(page(stages=["DDS100"]), apt)


def test_a_row_has_only_what_all_its_units_can_do(apt: Protocol) -> None:
    calls = {"home": "home", "jog": "jog", "set_sol_state": "open"}
    assert "| home, jog, stop; mm or degrees |" in Units(page(calls=calls), apt).row()
    both = Units(page(units=["KDC101", "MFF101"], calls=calls), apt)
    assert "| jog; mm or degrees |" in both.row()


def test_a_scale_that_sources_contradict_has_to_be_chosen(apt: Protocol) -> None:
    row = Units(page(units=["MLJ050"]), apt).row()
    assert "home, stop; mm, after you choose a source of the scale" in row
    [stage] = Units(page(units=["MLJ050"]), apt).stage_rows()
    assert "| `document` 409,600 or `vendor` 1,228,800 | 50 mm |" in stage


def test_a_scale_that_differs_between_units_names_them(apt: Protocol) -> None:
    rows = [*Units(page(units=["KDC101", "TDC001"]), apt).stage_rows()]
    assert any(
        "| `Z812` |  | 34,554.962 (KDC101); 34,304 (TDC001) | 12 mm |" in row for row in rows
    )
    assert any("| `MTS50_Z8` | MTS50-Z8 | 34,554.962 | 50 mm | 2.4 mm/s |" in row for row in rows)


def test_the_address_of_a_rack_has_its_bays(apt: Protocol) -> None:
    [bbd202] = Units(page(units=["BBD202"]), apt).unit_rows()
    assert "| 0x11; bays 0x21, 0x22 |" in bbd202
    [bsc201] = Units(page(units=["BSC201"]), apt).unit_rows()
    assert "| 40 | 0x50 (also 0x11, 0x21) |" in bsc201


def test_only_a_trial_on_hardware_removes_the_warning(apt: Protocol) -> None:
    assert Units(page(), apt).row().endswith("; not yet tried on hardware |")
    report = {"program": "report.json", "version": "1"}
    source = Source("report", "hardware_trial", report, "", apt.evidence.sources[0].place)
    entries = {("units", "KDC101"): (Evidence(source, "", "homed and moved"),)}
    tried = dataclasses.replace(apt, evidence=EvidenceTable((source,), entries))
    assert Units(page(), tried).row().endswith("p. 8–9, 61; tried on hardware |")
