"""The page on C: its code compiles, its names and files exist, and it lists all MISRA deviations."""

from __future__ import annotations

import os
import re
import shutil
import sysconfig
from pathlib import Path

import pytest
from toolchain import (
    C_WARNINGS,
    WARNINGS,
    C,
    Package,
    compiles,
    need,
    packages,
    run,
)

from checkout import ROOT
from markdown_blocks import blocks
from parts import first_of

PAGE = (ROOT / "docs" / "reference" / "c.md").read_text(encoding="utf-8")
BLOCKS = [block.text for block in blocks(ROOT / "docs" / "reference" / "c.md", "c")]
COMMANDS = [block.text for block in blocks(ROOT / "docs" / "reference" / "c.md", "sh")]
PREFIXES = "|".join(package.prefix for package in packages())


def test_the_page_has_code_blocks() -> None:
    assert len(BLOCKS) >= 5
    assert len(COMMANDS) == 2
    assert len(BLOCKS) + len(COMMANDS) == PAGE.count("```") / 2


@pytest.mark.parametrize("block", BLOCKS)
def test_a_block_compiles(block: str, tmp_path: Path) -> None:
    need("gcc", "g++")
    source = tmp_path / "block.c"
    source.write_text(block, encoding="utf-8")
    compiles("gcc", "-std=c99", *C_WARNINGS, f"-I{C}", "-c", source, "-o", tmp_path / "block.o")
    compiles("g++", "-std=c++17", *WARNINGS, f"-I{C}", "-x", "c++", "-fsyntax-only", source)


def test_a_program_prints_the_stated_output(tmp_path: Path) -> None:
    need("gcc")
    [block] = [block for block in BLOCKS if "int main" in block]
    [said] = re.findall(r"/\* prints (.*?) \*/", block)
    source, program = tmp_path / "block.c", tmp_path / "block"
    source.write_text(block, encoding="utf-8")
    compiles("gcc", "-std=c99", f"-I{C}", source, "-o", program)
    assert compiles(program).strip() == said


@pytest.mark.matrix
@pytest.mark.parametrize("package", first_of(packages()[::-1]), ids=lambda it: it.prefix)
def test_the_commands_make_the_tests_and_run_them(package: Package, tmp_path: Path) -> None:
    """As a reader would, in a checkout; also with the name of the other package."""
    need("gcc")
    shutil.copytree(ROOT / "spec", tmp_path / "spec")
    path = os.pathsep.join([sysconfig.get_path("scripts"), os.environ["PATH"]])
    generate, build = COMMANDS
    made = run("sh", "-e", "-c", generate, cwd=tmp_path, PATH=path)
    assert made.returncode == 0, made.stdout
    [out] = re.findall(r"--out (\S+)", generate)
    assert "cc -std=c99 " in build
    words = build.replace("stagewire_apt", package.name).replace(
        "cc -std=c99 ", "gcc -std=c99 -O0 "
    )
    done = run("sh", "-e", "-c", words, cwd=tmp_path / out / "c")
    assert done.returncode == 0, done.stdout[-2000:]
    assert done.stdout.count(" 0 failed") == 2  # examples and cases


@pytest.mark.parametrize("page", ["docs/reference/c.md", "examples/c/README.md"])
def test_the_names_exist(page: str) -> None:
    files = [path for package in packages() for path in package.folder.rglob("*.[ch]")]
    known = set(re.findall(r"\w+", "\n".join(path.read_text("utf-8") for path in files)))
    text = (ROOT / page).read_text(encoding="utf-8")
    named = set(re.findall(rf"\b(?:(?:{PREFIXES})_|(?:{PREFIXES.upper()})_)\w+", text))
    assert {name for name in named if not name.endswith("_")} <= known


@pytest.mark.parametrize("page", ["docs/reference/c.md", "examples/c/README.md"])
def test_the_files_exist(page: str) -> None:
    text = (ROOT / page).read_text(encoding="utf-8")
    for path in re.findall(r"`((?:docs|tests|examples|spec|generated)/[\w./-]+)`", text):
        at = C / Path(path).relative_to("generated/c") if path.startswith("generated/c") else path
        assert (ROOT / at).exists(), path


def includes(package: Package) -> str:
    """Return the includes of a package, with only two chapters: all come from the same templates."""
    chapters = [path for path in package.headers() if path.parent.name == "messages"]
    longer = sorted(chapters, key=lambda path: path.stat().st_size)[2:]
    kept = [path for path in package.headers() if path not in (package.umbrella, *longer)]
    return "".join(package.include(path) for path in kept)


def deviations(marked: bool) -> set[str]:
    """Return the rules in the list with a mark, or those without."""
    rows = re.findall(r"^\| (?:Directive )?([0-9.]+)( †)? \| \w+ \|", PAGE, re.M)
    return {rule for rule, mark in rows if bool(mark) == marked}


@pytest.mark.matrix
def test_the_page_lists_exactly_the_deviations_found(tmp_path: Path) -> None:
    need("cppcheck")
    user = tmp_path / "user.c"
    user.write_text("".join(map(includes, packages())), encoding="ascii")
    # cppcheck has no standard headers here, and checks only the given configuration.
    constants = ["-DUINT32_C(a)=a##U", "-DINT32_C(a)=a", "-DINT64_C(a)=a##LL"]
    words = ["--addon=misra", "--enable=style", "--std=c99", "--quiet", *constants, f"-I{C}"]
    done = run("cppcheck", *words, user, *(package.source for package in packages()))
    assert done.returncode == 0, done.stdout
    found = set(re.findall(r"\[misra-c2012-([0-9.]+)\]", done.stdout))
    listed = deviations(marked=False)
    assert found - listed == set(), "found, but not listed in docs/reference/c.md"
    assert listed - found == set(), "listed in docs/reference/c.md, but no longer found"
    assert deviations(marked=True)
