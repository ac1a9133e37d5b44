"""All headers and sources of the generated C with every compiler, standard, optimisation level and macro.

Compilers report some warnings only for emitted code, so a table of addresses makes them emit all functions.
"""

from __future__ import annotations

from pathlib import Path

import pytest
from all_declarations import everything
from toolchain import (
    C_STANDARDS,
    C_WARNINGS,
    WARNINGS,
    C,
    Package,
    compiles,
    need,
    of_each_package,
    packages,
    run,
)

from parts import first_of
from stagewire.protocols import load_protocol

LANGUAGES = [
    *((compiler, standard) for compiler in ("gcc", "clang") for standard in C_STANDARDS),
    ("g++", "c++17"),
    ("clang++", "c++17"),
]
OPTIMISATIONS = ("-O0", "-O2", "-Os")
MACROS = ("NO_RANGE_CHECKS", "NO_TABLE", "NO_NAMES", "NO_ARRAYS", "HOST_INDEX")
STANDARD_HEADERS = {"stdint.h", "stddef.h", "stdbool.h"}

of_each_language = pytest.mark.parametrize(("compiler", "standard"), first_of(LANGUAGES))
of_each_compiler = pytest.mark.parametrize("compiler", first_of(["gcc", "clang"]))


def command(compiler: str, standard: str, *more: str) -> list[str]:
    """Return the command that compiles a file without warnings, for a chip without a library."""
    cpp = standard.startswith("c++")
    return [
        compiler,
        *("-x", "c++" if cpp else "c"),
        f"-std={standard}",
        *(WARNINGS if cpp else C_WARNINGS),
        "-ffreestanding",
        f"-I{C}",
        *more,
    ]


def test_every_layout_of_the_registry_has_functions() -> None:
    by_name = {package.prefix: len(package.layouts()) for package in packages()}
    for prefix, protocol in {"apt": "thorlabs_apt", "ms2000": "asi_ms2000"}.items():
        messages = load_protocol(protocol).registry()["messages"]
        layouts = [layout for message in messages for layout in message["layouts"]]
        assert by_name[prefix] == len(layouts)


@of_each_language
def test_every_header_compiles_alone(compiler: str, standard: str, tmp_path: Path) -> None:
    need(compiler)
    for package in packages():
        for header in package.headers():
            alone = tmp_path / "alone.c"
            alone.write_text(package.include(header) * 2, encoding="ascii")
            compiles(*command(compiler, standard, "-fsyntax-only", str(alone)))


@pytest.mark.parametrize(
    ("compiler", "standard", "optimisation"),
    first_of(
        (compiler, standard, optimisation)
        for compiler, standard in LANGUAGES
        for optimisation in OPTIMISATIONS
        # C11 and C17 differ from C99 only in parsing, not in the code: compiling once is enough.
        if standard in ("c99", "c++17") or optimisation == "-Os"
    ),
)
def test_everything_compiles(
    compiler: str, standard: str, optimisation: str, tmp_path: Path
) -> None:
    need(compiler)
    for package in packages():
        user = tmp_path / f"{package.name}_user.c"
        user.write_text(everything(package), encoding="ascii")
        for source in (user, package.source):
            compiles(
                *command(compiler, standard, optimisation, "-c", f"{source}", "-o", "/dev/null")
            )


@of_each_compiler
def test_the_test_programs_compile(compiler: str) -> None:
    need(compiler)
    sources = sorted(C.rglob("testing/**/*.c"))
    assert len(sources) > 10
    words = [compiler, "-std=c99", *C_WARNINGS, f"-I{C}", "-fsyntax-only"]
    compiles(*words, *sources)


OTHER_MACHINES = {  # uint32_t and size_t are other types
    "arm-none-eabi-gcc": ("arm-none-eabi-gcc", "-mcpu=cortex-m0", "-mthumb"),
    "s390x-linux-gnu-gcc": ("s390x-linux-gnu-gcc",),
    "gcc -m32": ("gcc", "-m32"),
    "clang": ("clang", "--target=msp430", "-fsyntax-only"),  # int and size_t have 16 bits
}


@pytest.mark.matrix
@pytest.mark.parametrize("machine", OTHER_MACHINES)
def test_everything_compiles_for_other_machines(machine: str, tmp_path: Path) -> None:
    need(machine)
    compiler, *options = OTHER_MACHINES[machine]
    for package in packages():
        user = tmp_path / f"{package.name}_user.c"
        user.write_text(everything(package), encoding="ascii")
        for source in (user, package.source):
            words = command(compiler, "c99", *options, "-Os", "-c", f"{source}")
            compiles(*words, "-o", "/dev/null")


@of_each_language
@of_each_package
def test_every_macro_can_be_defined(
    package: Package, compiler: str, standard: str, tmp_path: Path
) -> None:
    need(compiler)
    user = tmp_path / "user.c"
    user.write_text(everything(package), encoding="ascii")
    sets = [*((name,) for name in MACROS), ("NO_TABLE", "HOST_INDEX"), MACROS]
    for names in sets:
        defined = [f"-D{package.prefix.upper()}_{name}" for name in names]
        for source in (user, package.source):
            compiles(*command(compiler, standard, *defined, "-fsyntax-only", f"{source}"))


@of_each_language
def test_both_protocols_fit_into_one_file(compiler: str, standard: str, tmp_path: Path) -> None:
    need(compiler)
    both = tmp_path / "both.c"
    headers = [package.include(header) for package in packages() for header in package.headers()]
    for order in (headers, headers[::-1]):
        both.write_text("".join(order), encoding="ascii")
        compiles(*command(compiler, standard, "-fsyntax-only", str(both)))


@of_each_package
def test_only_three_standard_headers_are_included(package: Package, tmp_path: Path) -> None:
    need("gcc")
    every = tmp_path / "every.c"
    every.write_text("".join(map(package.include, package.headers())), encoding="ascii")
    for source in (every, package.source):
        shown = compiles("gcc", "-std=c99", f"-I{C}", "-H", "-fsyntax-only", source).splitlines()
        tree = [(len(dots), Path(path)) for dots, _, path in (row.partition(" ") for row in shown)
                if dots and not dots.strip(".")]  # fmt: skip
        ours = {path for _, path in tree if path.is_relative_to(C)}
        assert ours, "none of our headers was included"
        inside = 0  # depth of the standard header of the row; 0 for none
        for depth, path in tree:
            if path in ours:
                inside = 0
            elif not inside or depth <= inside:
                inside = depth
                assert path.name in STANDARD_HEADERS, f"{source.name} includes {path}"


BAD = {
    "-Wsign-compare": "int f(int a, unsigned b); int f(int a, unsigned b) { return a < b; }",
    "-Wconversion": "#include <stdint.h>\nuint8_t f(int a); uint8_t f(int a) { return a; }",
    "-Wsign-conversion": "unsigned f(int a); unsigned f(int a) { return a; }",
    "-Wshadow": "int f(int a); int f(int a) { { int a = 1; return a; } }",
    "-Wcast-qual": "char *f(const char *a); char *f(const char *a) { return (char *)a; }",
    "-Wundef": "#if NOT_DEFINED\n#endif\nextern int a;",
    "-Wunused-variable": "void f(void); void f(void) { int a; }",
    "-Wstrict-prototypes": "int f();",
    "-Wpedantic": "int f(void); int f(void) { return ({ 1; }); }",
}


@pytest.mark.parametrize("warning", BAD)
@of_each_compiler
def test_the_warnings_are_enabled(compiler: str, warning: str, tmp_path: Path) -> None:
    need(compiler)
    bad = tmp_path / "bad.c"
    bad.write_text(BAD[warning] + "\n", encoding="ascii")
    done = run(*command(compiler, "c99", "-fsyntax-only", str(bad)))
    assert done.returncode != 0, f"no word about {warning}"
    assert "error:" in done.stdout
