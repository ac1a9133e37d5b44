"""Imports: no cycles, nothing private, and the picture of the packages in ``docs/architecture.md``.

The picture is the block marked ``text`` that begins with the row of ``stagewire_cli``. A row says what
imports what:

    stagewire_cli -> stagewire_conformance, stagewire_generator   # a remark
      formats -> output

A row at the margin is a top package. The rows below it, indented by two blanks more, are its packages and
modules, by the last part of their names; they may have rows below them as well. ``*`` in the place of a name
means any of the others at the same indentation.

Every top package has a row. A package that has rows below it has one for each package inside it; a row for a
module is optional. Between two rows, the arrows are complete, and point downwards. All imports count, also
those in functions and under ``TYPE_CHECKING``.
"""

from __future__ import annotations

import re

import grimp
import pytest
from source_tree import PACKAGES, arrows, graph

from checkout import ROOT
from markdown_blocks import blocks

CYCLES: dict[str, int] = {}
"""Cycles of modules that a package may have; none where it is not named."""

FIRST = "stagewire_cli ->"
SUPPORT = {"stagewire.support"}
"""All that generated packages import of the runtime."""

PAGE = ROOT / "docs" / "architecture.md"
ROW = re.compile(r"^(?P<indent> *)(?P<name>[\w*]+)(?: +-> +(?P<imports>[\w, ]*\w))?(?: +#.*)?$")


# Cycles


def cycles(of: grimp.ImportGraph) -> list[set[str]]:
    """Return the sets of modules that import one another in a circle, however long it is."""
    left = {
        module: of.find_upstream_modules(module) | {module}
        for module in of.modules
        if of.find_modules_directly_imported_by(module)
    }
    found: list[set[str]] = []
    for module, imported in left.items():
        circle = {other for other in imported if module in left.get(other, ())}
        if len(circle) > 1 and circle not in found:
            found.append(circle)
    return found


def test_no_module_imports_itself_by_way_of_others() -> None:
    found = {
        package: [
            sorted(circle)
            for circle in cycles(graph())
            if any(module.split(".")[0] == package for module in circle)
        ]
        for package in PACKAGES
    }
    assert {name: rows for name, rows in found.items() if len(rows) > CYCLES.get(name, 0)} == {}


def test_a_cycle_is_found() -> None:
    made = grimp.ImportGraph()
    for module in "abcdef":
        made.add_module(module)
    for importer, imported in ("ab", "bc", "ca", "de", "ed", "cd", "fa"):
        made.add_import(importer=importer, imported=imported)
    assert sorted(map(sorted, cycles(made))) == [["a", "b", "c"], ["d", "e"]]


# Private modules


def imported_from(package: str) -> set[str]:
    """Return the modules of other packages that a package imports."""
    inside = f"{package}."
    return {
        imported
        for module in graph().modules
        if f"{module}.".startswith(inside)
        for imported in graph().find_modules_directly_imported_by(module)
        if not f"{imported}.".startswith(inside)
    }


@pytest.mark.parametrize("package", PACKAGES)
def test_private_modules_are_imported_in_their_own_package(package: str) -> None:
    assert {module for module in imported_from(package) if "._" in module} == set()


@pytest.mark.parametrize("package", ["stagewire_apt", "stagewire_ms2000"])
def test_generated_packages_import_what_is_there_for_them(package: str) -> None:
    assert "stagewire.support" in imported_from(package) <= SUPPORT


# The picture


Picture = dict[str, dict[str, set[str]]]
"""Package -> the rows below it, in their order: a child and what it imports."""


def read(text: str) -> Picture:
    """Read a picture; the rows at the margin are those of the package ``""``."""
    found: Picture = {}
    above: list[str] = []
    for line in filter(str.strip, text.splitlines()):
        row = ROW.match(line)
        assert row is not None, f"not a row of the picture: {line!r}"
        depth, rest = divmod(len(row["indent"]), 2)
        assert not rest, f"not indented by two blanks: {line!r}"
        assert depth <= len(above), f"indented more than once: {line!r}"
        above = [*above[:depth], row["name"]]
        rows = found.setdefault(".".join(above[:-1]), {})
        imports = {name.strip() for name in (row["imports"] or "").split(",")} - {""}
        rows.setdefault(row["name"], set()).update(imports)
    return found


def faults(rows: dict[str, set[str]], real: dict[str, set[str]]) -> list[str]:
    """Return what is wrong with the rows below one package, whose real imports are given."""
    place = {name: at for at, name in enumerate(rows)}
    drawn = {(name, other) for name, others in rows.items() for other in others if name != "*"}
    there = {(name, other) for name in real for other in real[name] if {name, other} <= rows.keys()}
    by_all = rows.get("*", set())
    wrong = [f"{name} does not import {other}" for name, other in sorted(drawn - there)]
    wrong += [
        f"{name} imports {other}, which is not drawn"
        for name, other in sorted(there - drawn)
        if other not in by_all
    ]
    wrong += [
        f"{name} imports {other}, whose row is above"
        for name, other in sorted(there)
        if place[other] < place[name]
    ]
    wrong += [f"nothing imports {name}" for name in sorted(by_all - {other for _, other in there})]
    return wrong + [f"there is no {name}" for name in rows if name not in real and name != "*"]


@pytest.fixture(scope="module")
def picture() -> Picture:
    found = [block.text for block in blocks(PAGE, "text") if block.first.startswith(FIRST)]
    if not found:
        pytest.fail(f"{PAGE.name} lacks the picture: a text block that begins with {FIRST!r}")
    return read("".join(found))


def test_the_picture_has_every_package(picture: Picture) -> None:
    assert picture[""].keys() == set(PACKAGES)
    for package in picture.keys() - {""}:
        inside = {
            m.rpartition(".")[2] for m in graph().find_children(package) if graph().find_children(m)
        }
        assert inside <= picture[package].keys(), package


def test_the_picture_is_true(picture: Picture) -> None:
    found = {package: faults(rows, arrows(package)) for package, rows in picture.items()}
    assert {package: wrong for package, wrong in found.items() if wrong} == {}


def test_the_page_names_files_and_folders_that_exist() -> None:
    named = set(
        re.findall(r"`((?:[\w<>-]+/)*(?:[\w-]+\.py|[\w-]+/))`", PAGE.read_text(encoding="utf-8"))
    )
    tops = (
        "spec",
        "tools",
        "generator",
        "runtime",
        "generated",
        "virtual",
        "conformance",
        "cli",
        "tests",
    )
    paths = ["/hatch_build.py"] + [
        f"/{path.relative_to(ROOT).as_posix()}{'/' * path.is_dir()}"
        for top in tops
        for path in (ROOT / top, *(ROOT / top).rglob("*"))
        if "__pycache__" not in path.parts
    ]
    pattern = {name: re.sub(r"<\w+>", "[^/]+", re.escape(name)) for name in named}
    missing = [n for n in named if not any(re.search(f"/{pattern[n]}$", path) for path in paths)]
    assert len(named) > 60
    assert missing == []


REAL = {"a": {"b", "e"}, "b": {"c", "e"}, "c": {"e"}, "d": {"e"}, "e": set()}
RIGHT = """
* -> e
a -> b   # the first
  x -> y, z
  y
b -> c
c
e
"""


@pytest.mark.parametrize(
    ("old", "new", "wrong"),
    [
        ("", "", []),
        ("a -> b", "a -> b, c", ["a does not import c"]),
        ("b -> c\n", "b\n", ["b imports c, which is not drawn"]),
        ("* -> e\n", "", [f"{x} imports e, which is not drawn" for x in "abc"]),
        ("* -> e", "* -> e, f", ["nothing imports f"]),
        ("c\ne\n", "e\nc\n", ["c imports e, whose row is above"]),
        ("c\ne\n", "e\n", ["b does not import c"]),
        ("b -> c\nc\n", "b\n", []),
        ("e\n", "e\ng\n", ["there is no g"]),
    ],
)
def test_what_is_wrong_with_a_picture_is_found(old: str, new: str, wrong: list[str]) -> None:
    rows = read(RIGHT.replace(old, new, 1))
    assert rows["a"] == {"x": {"y", "z"}, "y": set()}
    assert faults(rows[""], REAL) == wrong
