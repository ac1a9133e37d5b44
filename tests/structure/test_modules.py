"""Modules are of a size that can be read, and a class name means one thing."""

from __future__ import annotations

import ast
import re
import statistics
from pathlib import Path

import pytest
from source_tree import ROOMS, hand_written, modules

from checkout import ROOT

LONGEST = 500
SHORT = 100
SHORT_SHARE = 0.25
MEDIANS = (150, 250)

MEANINGS = {"Line": 1, "Place": 1, "Axis": 4}
"""Class names that are easily given twice: how many hand-written modules may define each."""


def lengths(paths: list[Path]) -> dict[str, int]:
    """Return the lines of modules."""
    return {
        path.relative_to(ROOT).as_posix(): len(path.read_text(encoding="utf-8").splitlines())
        for path in paths
    }


def classes(path: Path) -> set[str]:
    """Return the names of the classes that a module defines, also inside others."""
    tree = ast.parse(path.read_bytes())
    return {node.name for node in ast.walk(tree) if isinstance(node, ast.ClassDef)}


def test_all_modules_are_seen() -> None:
    for package, folder in ROOMS.items():
        assert len(hand_written(folder / package)) > 30, package


def test_no_module_is_too_long() -> None:
    assert {name: lines for name, lines in lengths(modules()).items() if lines > LONGEST} == {}


def test_few_modules_are_short() -> None:
    found = lengths(modules())
    short = {name: lines for name, lines in found.items() if lines < SHORT}
    assert len(short) <= SHORT_SHARE * len(found), short


def test_the_median_module() -> None:
    low, high = MEDIANS
    assert low <= statistics.median(lengths(modules()).values()) <= high


@pytest.mark.parametrize("name", MEANINGS)
def test_a_class_name_means_one_thing(name: str) -> None:
    found = [
        path.relative_to(ROOT).as_posix()
        for path in modules()
        if re.search(rf"\bclass {name}\b", path.read_text(encoding="utf-8"))
        and name in classes(path)
    ]
    assert len(found) <= MEANINGS[name], found
