"""The hand-written modules of the packages, and the imports between modules."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

import grimp

from checkout import ROOT

ROOMS = {
    "stagewire": ROOT / "runtime",
    "stagewire_generator": ROOT / "generator",
    "stagewire_virtual": ROOT / "virtual",
    "stagewire_conformance": ROOT / "conformance",
    "stagewire_bluesky": ROOT / "control",
    "stagewire_epics": ROOT / "control",
    "stagewire_pymmcore": ROOT / "control",
    "stagewire_cli": ROOT / "cli",
}
"""The hand-written packages, and the folder of each."""

PACKAGES = (*ROOMS, "stagewire_apt", "stagewire_ms2000")
MARK = re.compile(r"# generated (from|by) ", re.IGNORECASE)
"""The start of the first line of a generated module."""


def hand_written(folder: Path) -> list[Path]:
    """Return the modules below a folder, except generated ones."""
    return [
        path
        for path in sorted(folder.rglob("*.py"))
        if "compiled" not in path.relative_to(folder).parts
        and not MARK.match(path.read_text(encoding="utf-8"))
    ]


def modules() -> list[Path]:
    """Return all hand-written modules of the packages."""
    return [path for name, folder in ROOMS.items() for path in hand_written(folder / name)]


@cache
def graph() -> grimp.ImportGraph:
    """Return all imports, including those in functions and under ``TYPE_CHECKING``."""
    return grimp.build_graph(*PACKAGES, cache_dir=None)


def arrows(package: str) -> dict[str, set[str]]:
    """Return the imports between the children of a package. A child includes everything below it.

    The children of ``""`` are the packages themselves.
    """
    depth = package.count(".") + 2 if package else 1
    inside = f"{package}." if package else ""
    found: dict[str, set[str]] = {}
    for module in graph().modules:
        if not module.startswith(inside):
            continue
        child = module.split(".")[depth - 1]
        row = found.setdefault(child, set())
        for imported in graph().find_modules_directly_imported_by(module):
            if imported.startswith(inside):
                row.add(imported.split(".")[depth - 1])
    return {child: row - {child} for child, row in found.items()}
