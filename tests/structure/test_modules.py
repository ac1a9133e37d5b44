"""Modules have a readable size, and common class names have one meaning."""

from __future__ import annotations

import ast
import re
import statistics
from pathlib import Path

import pytest
from source_tree import ROOMS, hand_written, modules

from checkout import ROOT

LONGEST = 500
FEWEST = {"stagewire_bluesky": 5, "stagewire_epics": 10, "stagewire_pymmcore": 4}
"""Packages with fewer than 30 hand-written modules, and how many they have at least."""
SHORT = 100
SHORT_SHARE = 0.25
MEDIANS = (150, 250)

MEANINGS = {"Line": 1, "Place": 1, "Axis": 4}
"""Common class names, and how many hand-written modules may define each."""


def lengths(paths: list[Path]) -> dict[str, int]:
    """Return the number of lines of each module."""
    return {
        path.relative_to(ROOT).as_posix(): len(path.read_text(encoding="utf-8").splitlines())
        for path in paths
    }


def classes(path: Path) -> set[str]:
    """Return the names of all classes that a module defines, including nested ones."""
    tree = ast.parse(path.read_bytes())
    return {node.name for node in ast.walk(tree) if isinstance(node, ast.ClassDef)}


def test_every_package_has_hand_written_modules() -> None:
    for package, folder in ROOMS.items():
        assert len(hand_written(folder / package)) > FEWEST.get(package, 30), package


def test_no_module_has_more_than_500_lines() -> None:
    assert {name: lines for name, lines in lengths(modules()).items() if lines > LONGEST} == {}


def test_at_most_a_quarter_of_the_modules_is_short() -> None:
    found = lengths(modules())
    short = {name: lines for name, lines in found.items() if lines < SHORT}
    assert len(short) <= SHORT_SHARE * len(found), short


def test_the_median_length_of_modules_is_moderate() -> None:
    low, high = MEDIANS
    assert low <= statistics.median(lengths(modules()).values()) <= high


@pytest.mark.parametrize("name", MEANINGS)
def test_a_common_class_name_has_one_meaning(name: str) -> None:
    found = [
        path.relative_to(ROOT).as_posix()
        for path in modules()
        if re.search(rf"\bclass {name}\b", path.read_text(encoding="utf-8"))
        and name in classes(path)
    ]
    assert len(found) <= MEANINGS[name], found
