"""Rotary stages, names in the catalogue, and sources that contradict each other, in every target."""

from __future__ import annotations

import json
from fractions import Fraction
from typing import Any

import pytest

from stagewire import Scale, Stage
from stagewire.errors import UnknownScaleError
from stagewire.quantities import EndlessTravel, Limit, ScaleConflict
from stagewire_generator import render
from stagewire_generator.model import Protocol


@pytest.fixture(scope="module")
def files(overlaid: dict[str, Protocol]) -> dict[str, str]:
    """The files generated from the small good spec with its second edition."""
    return render([overlaid["tiny/second"]])


@pytest.fixture(scope="module")
def turret(files: dict[str, str]) -> Stage:
    """The rotary stage of the generated package."""
    names: dict[str, Any] = {}
    exec(files["python/stagewire_tiny/stages.py"], names)
    stage: Stage = names["Turret"]
    return stage


def test_a_rotary_stage_has_limits_in_degrees(turret: Stage) -> None:
    assert turret.rotary
    assert turret.limits["max_velocity"] == Limit(Fraction(25), "deg/s", "a data sheet")
    assert turret.limits["travel"] == EndlessTravel("a data sheet")


def test_a_stage_has_its_names_in_the_catalogue(turret: Stage) -> None:
    assert turret.catalogue == ("T-1", "T-1/M")


def test_contradicting_sources_are_scales_of_their_own(turret: Stage) -> None:
    scale = turret.scale("distance", "TP10")
    assert isinstance(scale, ScaleConflict)
    assert scale.scales == {
        "document": Scale.counts_per("deg", 20),
        "vendor": Scale.counts_per("deg", 30),
    }
    with pytest.raises(
        UnknownScaleError,
        match=r"document: 20 counts per deg \(Issue 2, page 2\); vendor: 30 counts per deg \(a data sheet\)",
    ):
        scale.to_counts(1)


def test_the_registry_has_every_figure_of_a_conflict(files: dict[str, str]) -> None:
    registry = json.loads(files["python/stagewire_tiny/registry.json"])
    [turret] = [stage for stage in registry["stages"] if stage["name"] == "Turret"]
    assert turret["rotary"] is True
    assert turret["catalogue"] == ["T-1", "T-1/M"]
    assert turret["limits"]["travel"] == {
        "endless": True,
        "source": "a data sheet",
        "evidence": ["vendor_program"],
    }
    assert turret["controllers"]["TP10"]["distance"]["conflict"] == {
        "document": {
            "counts_per_deg": {"numerator": 20, "denominator": 1},
            "page": 2,
            "document": "Issue 2",
            "note": "as printed",
        },
        "vendor": {
            "counts_per_deg": {"numerator": 30, "denominator": 1},
            "source": "a data sheet",
            "evidence": ["vendor_program"],
        },
    }
    assert registry["quantities"]["distance"]["rotary_unit"] == "deg"


def test_c_has_a_scale_for_each_source(files: dict[str, str]) -> None:
    header = files["c/stagewire_tiny/quantities.h"]
    for source, counts in (("DOCUMENT", 20), ("VENDOR", 30)):
        name = f"TINY_SCALE_TURRET_TP10_DISTANCE_{source}"
        assert f"#define {name} TINY_BRACED(INT64_C({counts}), INT64_C(1))" in header
    assert "TINY_SCALE_TURRET_TP10_DISTANCE " not in header
    assert "of Turret on TP10 according to document, which contradicts vendor, in deg" in header
