"""Imports have no cycles, use no private modules, and match the diagram in ``docs/architecture.md``.

The diagram is the ``text`` block that starts with the row of ``stagewire_cli``. A row lists the imports of a
package or module:

    stagewire_cli -> stagewire_conformance, stagewire_generator   # a remark
      formats -> output

A row at the margin is a top-level package. The rows below it, indented by two more spaces, are its packages
and modules, named by the last part of their names. They may also have rows below them. ``*`` in place of a
name means every other row at the same indentation.

Every top-level package has a row. A package with rows below it has one for each package inside it; rows for
modules are optional. The arrows between rows are complete and point downwards. All imports count, including
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
"""Number of module cycles that a package may have. Other packages may have none."""

FIRST = "stagewire_cli ->"
SUPPORT = {"stagewire.support"}
"""The only runtime modules that generated packages may import."""

PAGE = ROOT / "docs" / "architecture.md"
ROW = re.compile(r"^(?P<indent> *)(?P<name>[\w*]+)(?: +-> +(?P<imports>[\w, ]*\w))?(?: +#.*)?$")


# Cycles


def cycles(of: grimp.ImportGraph) -> list[set[str]]:
    """Return the sets of modules that import one another in a cycle of any length."""
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


def test_modules_do_not_import_one_another_in_a_cycle() -> None:
    found = {
        package: [
            sorted(circle)
            for circle in cycles(graph())
            if any(module.split(".")[0] == package for module in circle)
        ]
        for package in PACKAGES
    }
    assert {name: rows for name, rows in found.items() if len(rows) > CYCLES.get(name, 0)} == {}


def test_cycles_are_detected() -> None:
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
def test_private_modules_are_imported_only_in_their_own_package(package: str) -> None:
    assert {module for module in imported_from(package) if "._" in module} == set()


@pytest.mark.parametrize("package", ["stagewire_apt", "stagewire_ms2000"])
def test_generated_packages_import_only_the_support_module(package: str) -> None:
    assert "stagewire.support" in imported_from(package) <= SUPPORT


# The diagram


Picture = dict[str, dict[str, set[str]]]
"""Package -> the rows below it, in order: each child and its imports."""


def read(text: str) -> Picture:
    """Read a diagram. The rows at the margin belong to the package ``""``."""
    found: Picture = {}
    above: list[str] = []
    for line in filter(str.strip, text.splitlines()):
        row = ROW.match(line)
        assert row is not None, f"not a row of the diagram: {line!r}"
        depth, rest = divmod(len(row["indent"]), 2)
        assert not rest, f"not indented by a multiple of two spaces: {line!r}"
        assert depth <= len(above), f"indented by more than one level: {line!r}"
        above = [*above[:depth], row["name"]]
        rows = found.setdefault(".".join(above[:-1]), {})
        imports = {name.strip() for name in (row["imports"] or "").split(",")} - {""}
        rows.setdefault(row["name"], set()).update(imports)
    return found


def faults(rows: dict[str, set[str]], real: dict[str, set[str]]) -> list[str]:
    """Return the errors in the rows below one package, compared with its real imports."""
    place = {name: at for at, name in enumerate(rows)}
    drawn = {(name, other) for name, others in rows.items() for other in others if name != "*"}
    there = {(name, other) for name in real for other in real[name] if {name, other} <= rows.keys()}
    by_all = rows.get("*", set())
    wrong = [f"{name} does not import {other}" for name, other in sorted(drawn - there)]
    wrong += [
        f"{name} imports {other}, but the diagram has no such arrow"
        for name, other in sorted(there - drawn)
        if other not in by_all
    ]
    wrong += [
        f"{name} imports {other}, whose row is above"
        for name, other in sorted(there)
        if place[other] < place[name]
    ]
    wrong += [f"nothing imports {name}" for name in sorted(by_all - {other for _, other in there})]
    return wrong + [f"{name} does not exist" for name in rows if name not in real and name != "*"]


@pytest.fixture(scope="module")
def picture() -> Picture:
    found = [block.text for block in blocks(PAGE, "text") if block.first.startswith(FIRST)]
    if not found:
        pytest.fail(f"{PAGE.name} lacks the diagram, a text block that starts with {FIRST!r}")
    return read("".join(found))


def test_the_diagram_has_every_package(picture: Picture) -> None:
    assert picture[""].keys() == set(PACKAGES)
    for package in picture.keys() - {""}:
        inside = {
            m.rpartition(".")[2] for m in graph().find_children(package) if graph().find_children(m)
        }
        assert inside <= picture[package].keys(), package


def test_the_diagram_matches_the_imports(picture: Picture) -> None:
    found = {package: faults(rows, arrows(package)) for package, rows in picture.items()}
    assert {package: wrong for package, wrong in found.items() if wrong} == {}


def test_files_and_folders_named_on_the_page_exist() -> None:
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
        "control",
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
        ("b -> c\n", "b\n", ["b imports c, but the diagram has no such arrow"]),
        ("* -> e\n", "", [f"{x} imports e, but the diagram has no such arrow" for x in "abc"]),
        ("* -> e", "* -> e, f", ["nothing imports f"]),
        ("c\ne\n", "e\nc\n", ["c imports e, whose row is above"]),
        ("c\ne\n", "e\n", ["b does not import c"]),
        ("b -> c\nc\n", "b\n", []),
        ("e\n", "e\ng\n", ["g does not exist"]),
    ],
)
def test_errors_in_a_diagram_are_detected(old: str, new: str, wrong: list[str]) -> None:
    rows = read(RIGHT.replace(old, new, 1))
    assert rows["a"] == {"x": {"y", "z"}, "y": set()}
    assert faults(rows[""], REAL) == wrong
