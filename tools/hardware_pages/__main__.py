"""Write the tables of units and stages in README.md and ``docs/hardware/`` from the registry.

``python tools/hardware_pages`` replaces the lines between ``<!-- hardware ... -->`` and ``<!-- end -->``.
``--check`` writes nothing, lists the files that differ, and exits with status 1 if there are any.
"""

from __future__ import annotations

import argparse
import re
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Final

sys.path.insert(0, str(Path(__file__).parents[1]))

from hardware_pages.tables import Page, Units
from stagewire_generator.model import Protocol
from stagewire_generator.pipeline import check

ROOT: Final = Path(__file__).parents[2]
FOLDER: Final = Path("docs", "hardware")
FAMILIES: Final = (
    "| | Controller, and name of its class | Stages, for example | Works | Evidence |",
    "|---|---|---|---|---|",
)
UNITS: Final = (
    "| unit | class | serial numbers begin with | address | documents | further evidence |",
    "|---|---|---|---|---|---|",
)
STAGES: Final = (
    "| `stage=` | name in the catalogue | counts per mm or degree | travel | maximum velocity |",
    "|---|---|--:|---|---|",
)
_PART: Final = re.compile(r"(<!-- hardware (\w+) [^>]*-->\n).*?(?=<!-- end -->)", re.S)


def pages(folder: Path) -> list[Page]:
    """Return the pages that ``pages.toml`` lists."""
    data = tomllib.loads((folder / "pages.toml").read_text(encoding="utf-8"))
    return [Page.of(entry, data["calls"]) for entry in data["page"]]


def described(root: Path) -> list[Units]:
    """Return the units of each page.

    :raises ValueError: if a unit of the registry is on no page or on two, or is unknown.
    """
    protocols = [*check(root / "spec")]
    found = [Units(page, _protocol(page, protocols)) for page in pages(root / FOLDER)]
    listed = [name for units in found for name in units.entries]
    twice = sorted({name for name in listed if listed.count(name) > 1})
    missing = sorted({name for p in protocols for name in p.units["units"]} - {*listed})
    if twice or missing:
        raise ValueError(
            f"pages.toml: each unit must be on one page; on more than one: {', '.join(twice) or 'none'};"
            f" on none: {', '.join(missing) or 'none'}"
        )
    return found


def _protocol(page: Page, protocols: list[Protocol]) -> Protocol:
    return next((p for p in protocols if page.units[0] in p.units["units"]), protocols[0])


def texts(root: Path) -> Iterator[tuple[Path, str]]:
    """Yield each file with tables, and its text with the current ones.

    :raises ValueError: as ``described``, or if a file lacks a place for a table.
    """
    found = described(root)
    readme = [*FAMILIES, *(units.row() for units in found)]
    yield from _replaced(root, Path("README.md"), {"families": readme})
    for file in dict.fromkeys(units.page.file for units in found):
        on_page = [units for units in found if units.page.file == file]
        tables = {"units": [*UNITS, *(row for units in on_page for row in units.unit_rows())]}
        if stages := [row for units in on_page for row in units.stage_rows()]:
            tables["stages"] = [*STAGES, *stages]
        yield from _replaced(root, FOLDER / file, tables)


def _replaced(root: Path, file: Path, tables: dict[str, list[str]]) -> Iterator[tuple[Path, str]]:
    text = (root / file).read_text(encoding="utf-8")
    places = [place[1] for place in _PART.findall(text)]
    if sorted(places) != sorted(tables):
        raise ValueError(f"{file}: expected places for {sorted(tables)}, found {sorted(places)}")
    yield root / file, _PART.sub(lambda m: m[1] + "\n" + "\n".join(tables[m[2]]) + "\n\n", text)


def main() -> int:
    """Write the tables, or list the files whose tables are not current."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", 1)[0])
    parser.add_argument("--check", action="store_true", help="only compare")
    only_check = parser.parse_args().check
    differs = [(path, text) for path, text in texts(ROOT) if path.read_text("utf-8") != text]
    for path, text in differs:
        if only_check:
            print(f"{path.relative_to(ROOT)}: out of date; run python tools/hardware_pages")
        else:
            path.write_text(text, encoding="utf-8", newline="\n")
    return 1 if only_check and differs else 0


if __name__ == "__main__":
    sys.exit(main())
