"""Stages of a user in a TOML file: ``stagewire.read_stages``."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import pytest

from stagewire import Scale, Stage, read_stages
from stagewire.errors import BadValueError, LimitError
from stagewire.quantities import Limit
from stagewire_apt import K10CR1, TDC001

SLIDE = """
[slide]
unit = "mm"
title = "Linear slide"
travel = 50
max_velocity = 2.4

[slide.counts_per_unit]
position = 1919.5
velocity = "16777216/125"

[slide.controllers.k10cr1]
position = 2000
"""


def write(folder: Path, text: str) -> Path:
    path = folder / "stages.toml"
    path.write_text(text)
    return path


def counts_per_unit(stage: Stage, quantity: str, controller: str) -> Fraction:
    scale = stage.scale(quantity, controller)
    assert isinstance(scale, Scale)
    return scale.counts_per_unit


def test_numbers_and_fractions_of_a_file_are_exact(tmp_path: Path) -> None:
    slide = read_stages(write(tmp_path, SLIDE))["slide"]
    assert counts_per_unit(slide, "position", "TDC001") == Fraction("1919.5")
    assert counts_per_unit(slide, "velocity", "TDC001") == Fraction(16777216, 125)
    limit = slide.limits["max_velocity"]
    assert isinstance(limit, Limit)
    assert limit.value == Fraction("2.4")


def test_a_controller_has_its_own_scales_and_the_common_ones(tmp_path: Path) -> None:
    slide = read_stages(write(tmp_path, SLIDE))["slide"]
    assert counts_per_unit(slide, "position", "K10CR1") == 2000
    assert counts_per_unit(slide, "velocity", "K10CR1") == Fraction(16777216, 125)


def test_a_stage_of_a_file_moves_within_its_limits(tmp_path: Path) -> None:
    slide = read_stages(str(write(tmp_path, SLIDE)))["slide"]
    with TDC001.open("virtual://TDC001", stage=slide) as tdc:
        tdc.set_pos_counter(mm=2)
        assert tdc.get_pos_counter().position == 3839
        with pytest.raises(LimitError):
            tdc.change_vel_params(max_velocity_mm_per_s=3)


def test_a_rotary_stage_has_scales_in_degrees(tmp_path: Path) -> None:
    text = '[mount]\nunit = "deg"\n[mount.counts_per_unit]\nposition = 1920\n'
    mount = read_stages(write(tmp_path, text))["mount"]
    assert mount.rotary
    with K10CR1.open("virtual://K10CR1", stage=mount) as controller:
        controller.set_pos_counter(deg=90)
        assert controller.get_pos_counter().position == 172800


BASE = '[a]\nunit = "mm"\n'
SCALE = "[a.counts_per_unit]\nposition = 1\n"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", r"no stage; expected a table for each stage, such as \[slide\]"),
        ("a = ", "not valid TOML: "),
        ("a = 1", r"a: expected a table, \[a\], not '1'"),
        ("[a]\n" + SCALE, 'a.unit: expected "mm" or "deg"'),
        ('[a]\nunit = "um"\n' + SCALE, "a.unit: expected .*, not 'um'"),
        (BASE, "a.counts_per_unit: missing"),
        (BASE + "speed = 1\n" + SCALE, "a.speed: unknown key; expected unit, title, travel"),
        (BASE + "travl = 1\n" + SCALE, "a.travl: unknown key; did you mean travel?"),
        (BASE + "title = 1\n" + SCALE, "a.title: expected text, not '1'"),
        (BASE + "travel = true\n" + SCALE, "a.travel: expected a number above 0.*, not 'True'"),
        (BASE + "travel = -1\n" + SCALE, "a.travel: expected a number above 0"),
        (BASE + "travel = nan\n" + SCALE, "a.travel: expected a number above 0"),
        (BASE + "counts_per_unit = 5\n", r"expected a table, \[a.counts_per_unit\], not '5'"),
        (
            BASE + "[a.counts_per_unit]\nposition = 0\n",
            "a.counts_per_unit.position: expected a num",
        ),
        (BASE + '[a.counts_per_unit]\nposition = "1/0"\n', "position: expected a number"),
        (
            BASE + "[a.counts_per_unit]\npositon = 1\n",
            "positon: unknown key; did you mean position",
        ),
        (
            BASE + "[a.controllers.TDC01]\nposition = 1\n",
            "TDC01: unknown controller; did you mean TDC",
        ),
        (
            BASE + SCALE + '[A]\nunit = "mm"\n[A.counts_per_unit]\nposition = 1\n',
            "A: a is the same",
        ),
        ('[z8]\nunit = "mm"\n', "z8: Z8 is a stage in the registry; choose another name"),
        ('["PRM1-Z8"]\nunit = "mm"\n', "is a stage in the registry; choose another name"),
    ],
)
def test_an_invalid_file_is_refused_with_its_key(tmp_path: Path, text: str, said: str) -> None:
    path = write(tmp_path, text)
    with pytest.raises(BadValueError, match=said) as refused:
        read_stages(path)
    assert str(refused.value).startswith(f"{path}: ")
