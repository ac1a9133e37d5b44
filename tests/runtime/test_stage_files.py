"""Stages that users describe in a TOML file."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import pytest

from stagewire.errors import BadValueError
from stagewire.stage_files import read_stages
from stagewire_apt import TDC001

SLIDE = """\
[slide]
counts_per_mm = 20000
counts_per_mm_per_s = 53687.0912
counts_per_mm_per_s2 = "450000/7"
travel_mm = 25
max_velocity_mm_per_s = 2.5

[turret]
counts_per_deg = 1919.64
"""


def write(folder: Path, text: str) -> Path:
    path = folder / "lab.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_scales_are_exact_and_limits_have_units(tmp_path: Path) -> None:
    stages = read_stages(write(tmp_path, SLIDE))
    slide = stages["slide"]
    assert slide.scale("position", "TDC001").counts_per_unit == 20000  # type: ignore[union-attr]
    assert slide.scale("velocity", "TDC001").counts_per_unit == Fraction("53687.0912")  # type: ignore[union-attr]
    assert slide.scale("acceleration", "TDC001").counts_per_unit == Fraction(450000, 7)  # type: ignore[union-attr]
    assert (slide.limits["travel"].value, slide.limits["travel"].unit) == (25, "mm")  # type: ignore[union-attr]
    assert stages["turret"].rotary


def test_a_controller_uses_a_stage_of_a_file(tmp_path: Path) -> None:
    stage = read_stages(write(tmp_path, SLIDE))["slide"]
    with TDC001.open("virtual://TDC001?stage=Z8", stage=stage, background=False) as tdc:
        tdc.move_absolute(counts=20000)
        assert tdc.position_mm == 1.0


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "no stage; expected a table such as [slide]"),
        ("slide", "not a TOML file: "),
        ("slide = 3", "[slide]: expected a table"),
        ("[slide]\ntravel_mm = 3", "[slide]: counts_per_mm or counts_per_deg is missing"),
        (
            "[slide]\ncounts_per_mm = 3\npitch = 1",
            "unknown key pitch (choose counts_per_mm, counts",
        ),
        ("[slide]\ncounts_per_deg = 3\ntravel_mm = 1", "unknown key travel_mm"),
        ("[slide]\ncounts_per_mm = true", "counts_per_mm: expected a positive number"),
        ('[slide]\ncounts_per_mm = "1/0"', "counts_per_mm: expected a positive number"),
        ("[slide]\ncounts_per_mm = -3", "counts_per_mm: expected a positive number"),
        ("[slide]\ncounts_per_mm = nan", "counts_per_mm: expected a positive number"),
        ("[slide]\ncounts_per_mm = inf", "counts_per_mm: expected a positive number"),
        ("[slide]\ncounts_per_mm = [1]", "counts_per_mm: expected a positive number"),
    ],
)
def test_a_wrong_file_is_refused_with_its_name(tmp_path: Path, text: str, said: str) -> None:
    path = write(tmp_path, text)
    with pytest.raises(BadValueError) as raised:
        read_stages(path)
    assert str(raised.value).startswith(f"{path}: ")
    assert said in str(raised.value)
