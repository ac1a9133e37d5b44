"""The stages of Issue 37, in a package generated with the overlay.

The counts are computed from the figures that pages 39 to 41, 122 and 149 print, not from the registry.
"""

from __future__ import annotations

import ast
import json
import os
import runpy
import subprocess
import sys
from fractions import Fraction
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest

from checkout import ROOT
from stagewire import Scale, Stage
from stagewire.errors import UnknownScaleError
from stagewire.quantities import ScaleConflict
from stagewire_cli.main import main

SPEC = ROOT / "spec" / "thorlabs_apt"
NAME = "thorlabs_apt/issue_37"

POSITIONS = [
    # stage, controllers, mm or degrees, counts
    ("MTS50_Z8", "KDC101", 10, 345_550),  # 34554.96 counts per mm
    ("MTS25_Z8", "TDC001", 25, 863_874),
    ("Z8", "TDC001", 1, 34_304),  # Issue 3
    ("Z8", "KDC101", 1, 34_555),
    ("Z825", "TDC001", 25, 857_600),
    ("Z825", "KDC101", 25, 863_874),
    ("Z825B", "TDC001", 25, 863_874),
    ("PRM1_Z8", "KDC101", 90, 172_768),  # 1919.6418578623391 counts per degree
    ("KVS30", "KVS30", 30, 600_000),
    ("DDSM100", "KBD101", 5, 10_000),
    ("DDS220", "BBD10x", 100, 2_000_000),
    ("DDS600", "KBD101", 600, 12_000_000),
    ("MLS203_X", "KBD101", 110, 2_200_000),
    ("DDR100", "BBD10x", 360, 3_276_800),
    ("DDR100", "BBD30x", 5, 45_511),
    ("DDR05", "KBD101", 90, 500_000),
    ("DDR25", "BBD10x", 90, 360_000),
    ("ZST213B", "STEPPER_128", 1, 125_540),
    ("ZST213B", "STEPPER_2048", 13, 26_112_393),
    ("ZFS25B", "STEPPER_128", 3, 409_600),
    ("ZFS25B", "STEPPER_2048", 25, 54_613_333),  # page 122
    ("DRV001", "STEPPER_128", 1, 51_200),
    ("DRV208", "STEPPER_2048", 1, 819_200),
    ("DRV014", "STEPPER_128", 10, 256_000),
    ("DRV014", "STEPPER_2048", 10, 4_096_000),
    ("DRV113", "STEPPER_2048", 1, 327_680),
    ("NRT150", "STEPPER_2048", 150, 61_440_000),
    ("FW103", "STEPPER_128", 360, 25_600),
    ("FW103", "STEPPER_2048", 360, 409_600),
    ("NR360", "STEPPER_128", 1, 4_693),
    ("HDR50", "STEPPER_2048", Fraction("0.99997"), 75_091),
    ("K10CR1", "K10CR1", 3, 409_600),
    ("K10CR2", "K10CR1", 360, 49_152_000),
    ("LNR50SE", "BSC20x", 1, 409_600),  # page 149
    ("LTS300C", "LTS", 10, 4_096_000),
]
VELOCITIES = [
    ("MTS50_Z8", "KDC101", 2, 1_545_963),  # 772981.3692 per mm/s
    ("PRM1_Z8", "TDC001", 10, 429_417),  # 42941.66 per degree/s
    ("KVS30", "KVS30", 8, 3_579_139),
    ("DDS220", "KBD101", 100, 13_421_773),
    ("DDR05", "BBD10x", 1, 37_283),
    ("ZST206", "STEPPER_2048", 1, 107_824_098),
    ("DRV013", "STEPPER_128", 2, 51_200),
    ("DRV013", "STEPPER_2048", 1, 21_987_328),
    ("DRV114", "STEPPER_2048", 1, 17_589_862),
    ("K10CR1", "K10CR1", 1, 7_329_109),
]
ACCELERATIONS = [
    ("Z812B", "KDC101", 4, 1_055),  # 263.8443072 per mm/s^2
    ("PRM1_Z8", "KDC101", 25, 366),
    ("DDS300", "BBD10x", 1000, 13_744),
    ("DDR25", "KBD101", 1000, 2_749),
    ("DRV001", "STEPPER_2048", 1, 9_012),
    ("DRV013", "STEPPER_2048", 1, 4_506),
    ("DRV113", "STEPPER_2048", 1, 3_605),
    ("HDR50", "STEPPER_2048", 1, 826),
    ("K10CR1", "K10CR1", 1, 1_502),
]
CONFLICTS = [
    # stage, controllers, counts per mm or degree by source
    ("DDSM50", "BBD10x", {"document": 2000, "vendor": 20_000}),
    ("MLJ050", "MLJ", {"document": 409_600, "vendor": 1_228_800}),
    ("MLJ150", "MLJ", {"document": 409_600, "vendor": 1_228_800}),
    ("CR1_Z7", "KDC101", {"document": 12_288, "vendor": Fraction("1638.4")}),
    ("LTS150", "LTS", {"before_hardware_3": 25_600, "since_hardware_3": 409_600}),
    ("LTS300", "LTS", {"before_hardware_3": 25_600, "since_hardware_3": 409_600}),
    ("ZST6", "STEPPER_128", {"document": Fraction("125540.352"), "vendor": 466_944}),
]


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The path of the package ``stagewire_apt`` with the overlay."""
    out = tmp_path_factory.mktemp("stages-of-issue-37")
    assert main(["generate", "--spec", str(SPEC), "--out", str(out), "--overlay", NAME]) == 0
    return out / "python"


@pytest.fixture(scope="module")
def stages(package: Path) -> dict[str, Stage]:
    """The stages of the package, by name."""
    names: dict[str, Any] = runpy.run_path(str(package / "stagewire_apt" / "stages.py"))
    return {name: value for name, value in names.items() if isinstance(value, Stage)}


def test_stages_with_the_same_scales_share_them(stages: dict[str, Stage]) -> None:
    z812, z825 = stages["Z812"], stages["Z825"]
    assert z812.scales["KDC101"] is z825.scales["KDC101"]
    assert z812.limits != z825.limits


def test_the_package_imports_public_names_only(package: Path) -> None:
    """Type checkers know no other names, even if the runtime can load them."""
    for path in (package / "stagewire_apt").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("stagewire."):
                names = {name.name for name in node.names}
                assert names <= {*import_module(node.module or "").__all__}, path.name


def scale(stage: Stage, quantity: str, group: str) -> Scale | ScaleConflict:
    found = stage.scale(quantity, group)
    assert isinstance(found, Scale | ScaleConflict)
    return found


@pytest.mark.parametrize(
    ("quantity", "name", "group", "value", "counts"),
    [
        *(("position", *case) for case in POSITIONS),
        *(("velocity", *case) for case in VELOCITIES),
        *(("acceleration", *case) for case in ACCELERATIONS),
    ],
)
def test_a_value_converts_as_the_document_prints(
    stages: dict[str, Stage],
    quantity: str,
    name: str,
    group: str,
    value: int | Fraction,
    counts: int,
) -> None:
    found = scale(stages[name], quantity, group)
    assert isinstance(found, Scale)
    assert (
        found.unit
        == {
            "position": ("mm", "deg"),
            "velocity": ("mm/s", "deg/s"),
            "acceleration": ("mm/s^2", "deg/s^2"),
        }[quantity][stages[name].rotary]
    )
    assert found.to_counts(value) == counts


@pytest.mark.parametrize(("name", "group", "figures"), CONFLICTS)
def test_a_scale_with_contradicting_sources_is_refused(
    stages: dict[str, Stage], name: str, group: str, figures: dict[str, int | Fraction]
) -> None:
    found = scale(stages[name], "position", group)
    assert isinstance(found, ScaleConflict)
    with pytest.raises(UnknownScaleError):
        found.to_counts(1)
    given = {source: figure.counts_per_unit for source, figure in found.scales.items()}
    assert given == figures


def test_there_are_at_least_a_hundred_stages(stages: dict[str, Stage]) -> None:
    assert len(stages) >= 100


def test_every_stage_of_issue_37_has_a_travel_or_the_reason_why_it_has_none(
    stages: dict[str, Stage],
) -> None:
    assert [name for name, stage in stages.items() if "travel" not in stage.limits] == []


def test_a_unit_lists_the_stages_that_it_can_drive(package: Path) -> None:
    program = """
from stagewire_apt import BBD103, BSC101, TDC001
for unit in (TDC001, BSC101, BBD103):
    print(*({"MTS50_Z8", "DRV014", "DDS220", "K10CR1"} & set(unit.unit.stages)))
"""
    environment = {**os.environ, "PYTHONPATH": str(package)}
    command = [sys.executable, "-c", program]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.split() == ["MTS50_Z8", "DRV014", "DDS220"]


def test_a_stage_is_found_by_its_name_in_the_catalogue(stages: dict[str, Stage]) -> None:
    for name, wanted in (("MTS50/M-Z8", "MTS50_Z8"), ("PRM1Z8", "PRM1_Z8"), ("ZST6(B)", "ZST6")):
        assert [stage.name for stage in stages.values() if name in stage.catalogue] == [wanted]


def test_a_stage_has_the_number_that_controllers_report(stages: dict[str, Stage]) -> None:
    found: dict[str, dict[int, list[str]]] = {}
    for name, stage in stages.items():
        for field, number in stage.ids.items():
            found.setdefault(field, {}).setdefault(number, []).append(name)
    assert found["HW_GET_INFO.stage_id"] == {
        2: ["Z606"], 3: ["Z612"], 4: ["Z625"], 5: ["CR1_Z6"], 6: ["PRM1_Z8"], 7: ["MTS25_Z8"],
        8: ["MTS50_Z8"], 9: ["Z825"], 10: ["Z812"], 11: ["Z806"], 12: ["CR1_Z7"], 13: ["PRMTZ8"],
        21: ["Z906"], 22: ["Z912"], 23: ["Z925"], 24: ["MTS100_Z8"],
    }  # fmt: skip
    assert found["MOT_GET_PMDSTAGEAXISPARAMS.stage_id"] == {
        0x10: ["MLS203_X"], 0x11: ["MLS203_Y"], 0x13: ["DDS220"], 0x14: ["DDS300"], 0x15: ["DDS600"],
        0x75: ["DDR100"],
    }  # fmt: skip
    assert found["MOT_SET_TSTACTUATORTYPE.actuator_ident"][0x41] == ["ZFS13", "ZFS13B"]


def test_the_registry_has_the_evidence_of_an_id(package: Path) -> None:
    registry = json.loads((package / "stagewire_apt" / "registry.json").read_text(encoding="utf-8"))
    ids = {stage["name"]: stage.get("ids") for stage in registry["stages"]}
    assert ids["MTS25_Z8"]["HW_GET_INFO.stage_id"]["evidence"] == ["vendor_program"]
    assert ids["MLS203_X"]["MOT_GET_PMDSTAGEAXISPARAMS.stage_id"] == {
        "id": 0x10,
        "page": 76,
        "document": "Issue 3",
    }
    families = registry["families"]
    assert families["dc_servo_kcube"]["reports_stage"]["field"] == "HW_GET_INFO.stage_id"
