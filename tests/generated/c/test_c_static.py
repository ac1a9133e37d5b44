"""Properties of the generated C, checked in its text, its call graph and its objects."""

from __future__ import annotations

import re
from pathlib import Path

import callgraph
import pytest
from all_declarations import everything
from toolchain import C, Package, compiles, need, of_each_package, run, symbols

COMMENT_OR_STRING = re.compile(
    r"//[^\n]*|/\*.*?\*/|\"(?:\\.|[^\"\\])*\"|'(?:\\.|[^'\\])*'", re.DOTALL
)
FORBIDDEN = {
    "floating point": re.compile(r"\b(?:float|double|_Complex)\b|\b\d+\.\d*|\.\d|\b\d+[eE][-+]?\d"),
    "a layout of its own": re.compile(r"\b(?:packed|__packed|_Alignas|alignas|aligned)\b|__attribute__|\[\["),
    "a pragma": re.compile(r"#\s*pragma|\b_Pragma\b"),
    "a union": re.compile(r"\bunion\b"),
    "a bit field": re.compile(r"\b\w+\s+\w+\s*:\s*\d+\s*;"),
    "allocation": re.compile(r"\b(?:malloc|calloc|realloc|free|alloca)\b"),
    "a jump": re.compile(r"\b(?:goto|setjmp|longjmp)\b"),
    "a pointer cast": re.compile(
        r"\((?:const |volatile |struct )*(?!(?:u?int8_t|char|void)\b)(?:unsigned |signed )?\w+ *"
        r"(?:const )?\*+ *\) *[\w&(*]"
    ),
    "a macro with a side": re.compile(r"\b__(?:int128|extension__|typeof__|asm__)\b|\basm\b"),
}  # fmt: skip


def tokens(text: str) -> str:
    """Return C text without comments and string literals."""
    return COMMENT_OR_STRING.sub(" ", text)


def broken(text: str) -> list[str]:
    """Return the rules that C text breaks."""
    return [name for name, rule in FORBIDDEN.items() if rule.search(tokens(text))]


@of_each_package
def test_the_text_follows_the_rules(package: Package) -> None:
    for path in [*package.headers(), package.source]:
        assert broken(path.read_text(encoding="utf-8")) == [], path.name


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("static float x;", "floating point"),
        ("x = 1.5 * y;", "floating point"),
        ("x = 1e3;", "floating point"),
        ("struct __attribute__((packed)) s { int a; };", "a layout of its own"),
        ("#pragma pack(1)", "a pragma"),
        ("union u { int a; char b[4]; };", "a union"),
        ("struct s { unsigned a : 3; };", "a bit field"),
        ("p = malloc(4);", "allocation"),
        ("x = *(const uint32_t *)&frame[6];", "a pointer cast"),
        ("x = ((uint16_t*)frame)[3];", "a pointer cast"),
        ("x = (apt_x *)frame;", "a pointer cast"),
    ],
)
def test_a_broken_rule_is_found(text: str, found: str) -> None:
    assert found in broken(text)


def test_comments_and_strings_break_no_rule() -> None:
    assert (
        broken(
            '/* a float of 1.5 */ // union\nx = (const uint8_t *)y; f(a * b);\nconst char *x = "goto 1.5";'
        )
        == []
    )


# Objects of the machine that runs the tests


def build(folder: Path, package: Package, *options: str) -> list[Path]:
    """Compile all functions, the parser and the table, and return the object files."""
    user = folder / "user.c"
    user.write_text(everything(package), encoding="ascii")
    made = []
    for source in (user, package.source):
        path = folder / f"{source.stem}.o"
        compiles("gcc", "-std=c99", "-ffreestanding", "-fno-pic", "-fno-stack-protector", f"-I{C}",
                 *options, "-c", source, "-o", path)  # fmt: skip
        made.append(path)
    return made


STRICT = ["-O0", "-mgeneral-regs-only", "-Wcast-align=strict", "-Werror", callgraph.OPTION]
"""Compilation fails where floating point needs a register, or a cast raises the alignment."""


@of_each_package
def test_compiled_functions_are_plain_and_pure(package: Package, tmp_path: Path) -> None:
    """No recursion, no writable globals, and no calls to other code."""
    need("gcc")
    made = build(tmp_path, package, *STRICT)
    graph = callgraph.read(path.with_suffix(".ci") for path in made)
    assert graph.calls.keys() >= set(package.functions())
    assert graph.cycle() == []
    assert graph.indirect() == []
    assert graph.unbounded == frozenset()
    assert impure(made) == []


@pytest.mark.matrix
@of_each_package
def test_no_global_is_writable_and_nothing_is_called_when_it_is_optimised(
    package: Package, tmp_path: Path
) -> None:
    need("gcc")
    assert impure(build(tmp_path, package, "-O2")) == []


def impure(made: list[Path]) -> list[str]:
    """Return the names of writable symbols in object files, and of undefined ones."""
    rows = [row for path in made for row in symbols("nm", path)]
    defined = {name for name, kind, _ in rows if kind != "U"}
    missing = [name for name, kind, _ in rows if kind == "U" and name not in defined]
    return [*missing, *(name for name, kind, _ in rows if kind in "dDbBC")]


def test_recursion_and_indirect_calls_are_found(tmp_path: Path) -> None:
    need("gcc")
    bad = tmp_path / "bad.c"
    bad.write_text(
        "int odd(int n); int even(int n); int call(int (*f)(int)); int grow(int n);\n"
        "int odd(int n) { return n ? even(n - 1) : 0; }\n"
        "int even(int n) { return n ? odd(n - 1) : 1; }\n"
        "int call(int (*f)(int)) { return f(1); }\n"
        "int grow(int n) { volatile char a[n]; a[0] = 1; return a[0]; }\n"
    )
    compiles("gcc", "-O0", callgraph.OPTION, "-c", bad, "-o", tmp_path / "bad.o")
    graph = callgraph.read([tmp_path / "bad.ci"])
    assert sorted(graph.cycle()) == ["even", "odd"]
    assert graph.indirect() == ["call"]
    assert graph.unbounded == {"grow"}


def test_writable_globals_and_calls_are_found(tmp_path: Path) -> None:
    need("gcc")
    bad, made = tmp_path / "bad.c", tmp_path / "bad.o"
    bad.write_text("extern int far(void);\nint count = 1;\nint f(void) { return far(); }\n")
    compiles("gcc", "-c", bad, "-o", made)
    assert impure([made]) == ["far", "count"]


def test_such_casts_and_registers_are_found(tmp_path: Path) -> None:
    need("gcc")
    bad = tmp_path / "bad.c"
    bad.write_text(
        "int word(char *a);\nint word(char *a) { return *(int *)a; }\n"
        "double half(double a);\ndouble half(double a) { return a / 2; }\n"
    )
    cast = run("gcc", "-Wcast-align=strict", "-Werror", "-fsyntax-only", bad)
    assert "cast-align" in cast.stdout
    assert run("gcc", "-mgeneral-regs-only", "-S", bad, "-o", "/dev/null").returncode != 0
