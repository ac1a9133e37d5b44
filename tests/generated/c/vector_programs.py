"""The programs that run vectors in C, and their output."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from toolchain import C_WARNINGS, Package, compiles, run

_LINE = re.compile(r"(?P<id>\S+) (?P<outcome>passed|failed|noted)(?:: (?P<detail>.*))?")
_BOTH = "/encode+decode/"


class Finding(NamedTuple):
    """The result of a program for an example or case."""

    outcome: str
    detail: str


def vectors_of(package: Package) -> str:
    """Return the name of the program that runs the examples and the cases of a package."""
    return f"{package.prefix}_vectors"


def build_vectors(package: Package, folder: Path, alone: str = "") -> Path:
    """Compile the program for the examples and cases of a package, or for one of these suites."""
    here, shared = package.folder / "testing", package.folder.parent / "testing"
    sources = [here / "layouts.c", package.source, shared / "vectors.c", shared / "report.c"]
    if not alone:
        sources += [here / "examples.c", here / "cases.c", here / "run_vectors.c"]
        return _built(package, folder / vectors_of(package), sources)
    sources += [here / f"{alone}.c", Path(__file__).with_name("suite_main.c")]
    suite = f"-DSUITE={package.prefix}_{alone}"
    header = f'-DSUITE_H="{package.name}/testing/vectors.h"'
    return _built(package, folder / f"{package.prefix}_{alone}", sources, suite, header)


def build_round_trip(package: Package, folder: Path) -> Path:
    """Compile the round trip of all layouts."""
    sources = [
        package.folder / "testing" / "round_trip.c",
        package.folder.parent / "testing" / "failed.c",
    ]
    return _built(package, folder / f"{package.prefix}_round_trip", sources)


def _built(package: Package, program: Path, sources: list[Path], *defines: str) -> Path:
    words = [*C_WARNINGS, f"-I{package.folder.parent}", *defines, *sources]
    compiles("gcc", "-std=c99", *words, "-o", program)
    return program


def findings_of(program: Path) -> tuple[dict[str, Finding], list[str], int]:
    """Return the results of a program by id, its summary lines, and its status.

    Encoding and decoding the same message is one line of the program, and two cases.
    """
    done = run(program)
    found: dict[str, Finding] = {}
    in_all = []
    for line in done.stdout.splitlines():
        match = _LINE.fullmatch(line)
        if match is None:
            in_all.append(line)
            continue
        ids = [match["id"]]
        if _BOTH in match["id"]:
            ids = [match["id"].replace(_BOTH, way) for way in ("/encode/", "/decode/")]
        for id in ids:
            assert id not in found, f"{id} comes twice"
            found[id] = Finding(match["outcome"], match["detail"] or "")
    return found, in_all, done.returncode


def changed(package: Package, folder: Path, changes: Mapping[str, tuple[str, str]]) -> Package:
    """Return a copy of a package with texts replaced in some of its files."""
    for path in [*package.folder.rglob("*.[ch]"), *package.folder.parent.glob("testing/*.[ch]")]:
        name = path.relative_to(package.folder.parent)
        text = path.read_text(encoding="utf-8")
        for ending, (old, new) in changes.items():
            if name.as_posix().endswith(ending):
                assert old in text, f"{name} does not say {old}"
                text = text.replace(old, new, 1)
        copy = folder / name
        copy.parent.mkdir(parents=True, exist_ok=True)
        copy.write_text(text, encoding="utf-8")
    return Package(folder / package.name)
