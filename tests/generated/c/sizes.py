"""Sizes of code and memory of the generated C on a Cortex-M0, and the committed table.

    python tests/generated/c/sizes.py                         # measure, compare, print what grew
    python tests/generated/c/sizes.py --renew "why it grew"   # write sizes.toml, with the reason

Measures the three functions of every layout, shared code (helpers), parser, table and the deepest stack of
each package. The parser is measured without arrays, and with them if the package has any. All layouts of a
package are in one object, as in large firmware, so helpers are shared and not inlined. The checked encoder is
measured without the unchecked one, which it would call.
"""

from __future__ import annotations

import argparse
import re
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

import callgraph
import tools
from size_table import TABLE, Figures, grown, read, write
from toolchain import CORTEX_M0, C, Package, compiles, packages, symbols

GCC = "arm-none-eabi-gcc"
OPTIONS = [*CORTEX_M0, "-std=c99", f"-I{C}", callgraph.OPTION, "-fno-ipa-icf"]
"""Without it, gcc merges identical functions, and the size of one would depend on others."""

PARTS = ("parser", "replies")  # types with state, which the caller owns
# Functions that are compiled together, and the figure that each belongs to.
CHECKED = {"encode": "encode", "encode_unchecked": "encode", "decode": "decode"}
UNCHECKED = {"encode_unchecked": "encode_unchecked"}
_CLONE = re.compile(r"\.(part|constprop|isra|cold)\.?\d*")
_CALLER_OWNED = re.compile(r"^\} (\w+_(?:parser|replies));", re.MULTILINE)


def compiler() -> str:
    """Return the compiler and its version."""
    return compiles(GCC, "--version").splitlines()[0]


def measure(package: Package, folder: Path) -> Figures:
    """Return the figures of a package; object files are written to the folder."""
    accessors = build(
        folder, f"{package.prefix}_accessors", accessors_of(package, ("encode", "decode"))
    )
    unchecked = build(
        folder, f"{package.prefix}_unchecked", accessors_of(package, ("encode_unchecked",))
    )
    figures = _of_accessors(package, unchecked, UNCHECKED)
    figures |= _of_accessors(package, accessors, CHECKED)
    figures |= of_parser(package, folder)
    figures["stack"] = _stack(accessors)
    return {f"{package.prefix}/{name}": size for name, size in figures.items()}


def of_parser(package: Package, folder: Path) -> dict[str, int]:
    """Return the figures of the parser and the table of a package."""
    source = source_of(package)
    names, arrays = (f"-D{package.prefix.upper()}_NO_{what}" for what in ("NAMES", "ARRAYS"))
    whole = build(folder, f"{package.prefix}_whole", source)
    nameless = build(folder, f"{package.prefix}_nameless", source, names)
    parser = build(folder, f"{package.prefix}_parser", source, names, arrays)
    figures = _of_source(package, parser)
    figures["table"] = _read_only(parser)
    figures["names"] = _read_only(whole) - _read_only(nameless)
    figures["parser_stack"] = _stack(parser)
    figures |= sizes_of_types(package, folder, arrays)
    if arrays[2:] in package.source.read_text(encoding="utf-8"):
        figures["arrays/parser"] = _of_source(package, nameless)["parser"]
        figures["arrays/parser_stack"] = _stack(nameless)
        figures["arrays/sizeof_parser"] = sizes_of_types(package, folder)["sizeof_parser"]
    return figures


def _stack(made: Path) -> int:
    """Return the deepest stack of the functions of an object file."""
    graph = callgraph.read([made.with_suffix(".ci")])
    return max(map(graph.deepest, graph.calls))


def source_of(package: Package) -> str:
    """Return parser and table, including their functions in headers."""
    starts = tuple(f"{package.prefix}_{part}_" for part in PARTS)
    names = [name for name in package.functions() if name.startswith(starts)]
    lines = [f'#include "{package.name}/{package.source.name}"', *_addresses(names)]
    return "\n".join([*lines, ""])


def accessors_of(package: Package, functions: Sequence[str]) -> str:
    """Return a file that compiles only these functions, for all layouts."""
    there = set(package.functions())
    wanted = (f"{layout}_{function}" for layout in package.layouts() for function in functions)
    names = [name for name in wanted if name in there]
    return "\n".join([package.include(package.umbrella), *_addresses(names), ""])


def _addresses(names: Sequence[str]) -> list[str]:
    """Return a table that makes a compiler emit functions that are ``static inline``."""
    if not names:
        return []
    lines = ["typedef void (*any_function)(void);", "extern const any_function functions[];"]
    return [
        *lines,
        "const any_function functions[] = {",
        *(f"(any_function){n}," for n in names),
        "};",
    ]


def build(folder: Path, name: str, text: str, *options: str) -> Path:
    """Compile a text for the chip and return the object file."""
    source = folder / f"{name}.c"
    source.write_text(text, encoding="ascii")
    made = source.with_suffix(".o")
    compiles(GCC, *OPTIONS, *options, "-c", source.name, "-o", made.name, cwd=folder)
    return made


def _of_accessors(package: Package, made: Path, parts: Mapping[str, str]) -> dict[str, int]:
    """Return the sizes of the functions of layouts, and of the remaining functions together: the helpers.

    ``parts`` maps the suffix of a function to its figure.
    """
    names = {
        f"{layout}_{function}": f"{layout.removeprefix(package.prefix + '_')}/{part}"
        for layout in package.layouts()
        for function, part in parts.items()
    }
    figures = {"helpers": 0}
    for symbol, kind, size in symbols("arm-none-eabi-nm", made):
        if kind in "Tt":
            name = names.get(_CLONE.sub("", symbol), "helpers")
            figures[name] = figures.get(name, 0) + size
    return figures


def _of_source(package: Package, made: Path) -> dict[str, int]:
    """Return the sizes of the parser, the decoder of replies, and all code together."""
    rows = symbols("arm-none-eabi-nm", made)
    code = {name: size for name, kind, size in rows if kind in "Tt"}
    graph = callgraph.read([made.with_suffix(".ci")])
    figures = {"source": sum(code.values())}
    for part in PARTS:
        roots = [name for name in code if name.startswith(f"{package.prefix}_{part}_")]
        if roots:
            figures[part] = sum(code.get(name, 0) for name in graph.reached(roots))
    return figures


def _read_only(made: Path) -> int:
    """Return the size of constants, including those without a symbol (text), but not our own."""
    rows = (row.split() for row in compiles("arm-none-eabi-size", "-A", made).splitlines())
    found = sum(int(row[1]) for row in rows if row and row[0].startswith(".rodata"))
    ours = [size for name, _, size in symbols("arm-none-eabi-nm", made) if name == "functions"]
    return found - sum(ours)


def sizes_of_types(package: Package, folder: Path, *options: str) -> Figures:
    """Return the sizes of the types that users need for the parser, by name."""
    texts = (path.read_text(encoding="utf-8") for path in package.headers())
    types = [name for text in texts for name in _CALLER_OWNED.findall(text)]
    lines = [f"const unsigned char size_of_{name}[sizeof({name})] = {{0}};" for name in types]
    text = "\n".join([package.include(package.umbrella), *lines, ""])
    made = build(folder, f"{package.prefix}_types", text, *options)
    sizes = {symbol: size for symbol, _, size in symbols("arm-none-eabi-nm", made)}
    return {
        f"sizeof_{name.removeprefix(package.prefix + '_')}": sizes[f"size_of_{name}"]
        for name in types
    }


def main() -> int:
    """Measure, and write the table or compare with it."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--renew", metavar="REASON", help="write the table, and why")
    parser.add_argument("--print", action="store_true", help="only print the figures")
    options = parser.parse_args()
    if (options.renew is not None and not options.renew.isprintable()) or options.renew == "":
        parser.error('say in one line why the figures change: make c-sizes REASON="..."')
    reason = tools.why_not(["gcc", GCC])
    if reason:
        parser.error(reason)
    now: dict[str, int] = {}
    with tempfile.TemporaryDirectory() as folder:
        for package in packages():
            now.update(measure(package, Path(folder)))
    made_by, table = read() if TABLE.exists() else ("", {})
    if options.renew:
        if (made_by, table) == (compiler(), now):
            print(f"{TABLE.name}: as before, not written")
            return 0
        write(now, compiler(), options.renew)
        print(f"{TABLE.name}: {len(now)} figures")
        return 0
    if options.print:
        print("\n".join(f"{name} {size}" for name, size in now.items()))
        return 0
    if made_by != compiler():
        print(f"the table is of {made_by}, this is {compiler()}")
    larger = grown(table, now)
    print("\n".join(larger) or f"{len(now)} figures, none of them more than the table allows")
    return 1 if larger else 0


if __name__ == "__main__":
    sys.exit(main())
