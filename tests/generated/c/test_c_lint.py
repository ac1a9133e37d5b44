"""clang-tidy, cppcheck, clang-format and doxygen find nothing in the generated C.

Excluded checks would be in ``.clang-tidy`` with their reasons; cppcheck has no suppressions.
"""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest
from toolchain import C, Package, compiles, need, of_each_package, run

from checkout import ROOT, SMALL_SPECS
from stagewire_cli.main import main

HERE = Path(__file__).parent
TIDY = ROOT / ".clang-tidy"
CPPCHECK = [
    "cppcheck",
    "--quiet",
    "--std=c99",
    "--enable=warning,style,performance,portability",
    "--error-exitcode=1",
]


# Enough for test programs; the headers are tested with every set of macros elsewhere.
ONE_SET = ["--max-configs=1", "--suppress=toomanyconfigs"]
ARRAYS = ("examples.c", "cases.c")  # only constants, which would take minutes
ROUND_TRIP = "round_trip.c"
TESTED = ["--target", "c", "--target", "c-tests"]


def user(package: Package, folder: Path) -> list[Path]:
    """Return all headers in one file, and parser and table: the code in a user's program."""
    every = folder / "user.c"
    every.write_text("".join(map(package.include, package.headers())), encoding="ascii")
    return [every, package.source]


def programs(folder: Path) -> list[Path]:
    """Return the sources of test programs in a folder."""
    inside = (path for path in folder.rglob("*.c") if "testing" in path.relative_to(C).parts)
    return sorted(path for path in inside if path.name not in ARRAYS)


def tidy(*paths: Path) -> str:
    words = ["--quiet", f"--config-file={TIDY}", *paths, "--", "-std=c99", f"-I{C}"]
    done = run("clang-tidy", *words)
    assert done.returncode == 0, done.stdout
    return done.stdout


@pytest.mark.matrix
@of_each_package
def test_clang_tidy_finds_nothing(package: Package, tmp_path: Path) -> None:
    need("clang-tidy")
    tidy(*user(package, tmp_path), *programs(package.folder))


@pytest.mark.matrix
def test_clang_tidy_finds_nothing_in_shared_files() -> None:
    need("clang-tidy")
    tidy(*programs(C / "testing"))


@pytest.mark.matrix
def test_clang_tidy_checks_headers(tmp_path: Path) -> None:
    need("clang-tidy")
    (tmp_path / "bad.h").write_text("#define TWICE(a) a * 2\n", encoding="ascii")
    bad = tmp_path / "bad.c"
    bad.write_text('#include "bad.h"\nint f(int a);\nint f(int a) { return TWICE(a); }\n')
    done = run("clang-tidy", "--quiet", f"--config-file={TIDY}", bad, "--", "-std=c99")
    assert done.returncode != 0
    assert "bugprone-macro-parentheses" in done.stdout


@pytest.mark.matrix
def test_every_excluded_check_has_a_reason() -> None:
    text = TIDY.read_text(encoding="utf-8")
    left_out = [name for name in re.findall(r"^  -([\w*-]+)", text, re.MULTILINE) if name != "*"]
    reasons = dict(re.findall(r"^# ([\w-]+): (\S.*)", text, re.MULTILINE))
    assert sorted(reasons) == sorted(left_out)
    need("clang-tidy")
    known = compiles("clang-tidy", "--checks=*", "--list-checks").split()
    assert set(left_out) <= set(known)


@pytest.mark.matrix
@of_each_package
def test_cppcheck_finds_nothing(package: Package, tmp_path: Path) -> None:
    need("cppcheck")
    done = run(*CPPCHECK, f"-I{C}", *user(package, tmp_path))
    assert (done.returncode, done.stdout) == (0, "")


@pytest.mark.matrix
@pytest.mark.parametrize("folder", sorted(C.iterdir()), ids=lambda it: it.name)
def test_cppcheck_finds_nothing_in_test_programs(folder: Path) -> None:
    need("cppcheck")
    # One set of macros is enough here: another test checks the headers with all sets.
    one_set = ["--max-configs=1", "--suppress=toomanyconfigs"]
    sources = [path for path in programs(folder) if path.name not in ARRAYS]
    done = run(
        *CPPCHECK, f"-I{C}", *one_set, *[path for path in sources if path.name != ROUND_TRIP]
    )
    assert (done.returncode, done.stdout) == (0, "")


@pytest.mark.matrix
@pytest.mark.parametrize("spec", ["good_spec", "good_layouts", "good_commands"])
def test_cppcheck_finds_nothing_in_a_small_package(spec: str, tmp_path: Path) -> None:
    """With options that take minutes for many layouts. The same templates make the small package."""
    need("cppcheck")
    source = SMALL_SPECS / spec
    assert main(["generate", "--spec", str(source), "--out", str(tmp_path), *TESTED]) == 0
    made = tmp_path / "c"
    sources = sorted(made.rglob("*.c"))
    assert ROUND_TRIP in {path.name for path in sources}
    done = run(*CPPCHECK, *ONE_SET, f"-I{made}", *sources)
    assert (done.returncode, done.stdout) == (0, "")


@pytest.mark.matrix
def test_cppcheck_reports_errors(tmp_path: Path) -> None:
    need("cppcheck")
    bad = tmp_path / "bad.c"
    bad.write_text("int f(void) { int a[2] = {0, 1}; return a[2]; }\n", encoding="ascii")
    done = run(*CPPCHECK, bad)
    assert done.returncode == 1
    assert "arrayIndexOutOfBounds" in done.stdout


def written_in_c() -> list[Path]:
    """Return all C files of the repository, generated or not."""
    folders = (C, ROOT / "examples" / "c", HERE, ROOT / "tests" / "fuzz", ROOT / "benchmarks")
    return sorted(p for folder in folders for p in folder.rglob("*.[ch]"))


@pytest.mark.matrix
def test_clang_format_changes_nothing() -> None:
    need("clang-format")
    paths = written_in_c()
    assert len(paths) > 20
    done = run(
        "clang-format", f"--style=file:{ROOT / '.clang-format'}", "--dry-run", "--Werror", *paths
    )
    assert (done.returncode, done.stdout) == (0, "")


@pytest.mark.matrix
def test_clang_format_reports_differences(tmp_path: Path) -> None:
    need("clang-format")
    bad = tmp_path / "bad.c"
    bad.write_text("int f( int a ){return a;}\n", encoding="ascii")
    style = f"--style=file:{ROOT / '.clang-format'}"
    assert run("clang-format", style, "--dry-run", "--Werror", bad).returncode != 0


def doxygen(folder: Path, source: Path) -> str:
    """Return the output of doxygen for the headers in a folder; empty without warnings."""
    shutil.copy(HERE / "Doxyfile", folder)
    with (folder / "Doxyfile").open("a", encoding="utf-8") as settings:
        settings.write(f'INPUT = "{source}"\nOUTPUT_DIRECTORY = "{folder}/made"\n')
    return run("doxygen", "Doxyfile", cwd=folder).stdout


@pytest.mark.matrix
def test_doxygen_gives_no_warnings(tmp_path: Path) -> None:
    need("doxygen")
    assert doxygen(tmp_path, C) == ""
    assert any((tmp_path / "made" / "xml").glob("motor_8h.xml"))


@pytest.mark.matrix
@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("/** @file */\nint f(int a);\n", "not documented"),
        ("/** @file */\n/** A function. @param b nothing */\nint f(int a);\n", "argument 'b'"),
        ("/** @file */\n/** A \\nonsense. */\nint f(int a);\n", "nonsense"),
    ],
)
def test_doxygen_reports_errors(text: str, word: str, tmp_path: Path) -> None:
    need("doxygen")
    source = tmp_path / "source"
    source.mkdir()
    (source / "bad.h").write_text(text, encoding="ascii")
    assert word in doxygen(tmp_path, source)
