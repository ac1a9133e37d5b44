"""The machines that run the generated C, and the programs that run on them."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from toolchain import CORTEX_M0, C, Package, compiles, run

CHIP = Path(__file__).with_name("microbit")
CHIP_PARTS = 4
_CALL = re.compile(r"^    failed \+= test_\w+\(\);\n", re.MULTILINE)
SANITIZERS = ["-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-g", "-O0"]


class Program(NamedTuple):
    """A program of a package; its output depends on the machine: a host, or a chip without a library."""

    name: str
    sources: Sequence[Path]
    on_host: Sequence[Path]
    on_chip: Sequence[Path]
    defines: Sequence[str] = ()


def vectors(package: Package) -> Program:
    """Return the program that runs the worked examples, and on a host also the cases."""
    testing, here = C / "testing", package.folder / "testing"
    return Program(
        f"{package.prefix}_vectors",
        [here / "examples.c", here / "layouts.c", package.source, testing / "vectors.c"],
        [here / "run_vectors.c", here / "cases.c", testing / "report.c"],
        [CHIP / "run_vectors.c"],
        [
            f'-DSUITE_H="{package.name}/testing/vectors.h"',
            f"-DSUITE={package.prefix}_examples",
        ],
    )


def round_trip(package: Package) -> Program:
    """Return the round trip test of all layouts."""
    return Program(
        f"{package.prefix}_round_trip",
        [package.folder / "testing" / "round_trip.c"],
        [C / "testing" / "failed.c"],
        [CHIP / "failed.c"],
    )


def round_trip_parts(package: Package, folder: Path) -> list[Program]:
    """Return round trip tests of a part of the layouts each: all of them do not fit into a chip."""
    [source] = round_trip(package).sources
    text = source.read_text(encoding="utf-8")
    calls = _CALL.findall(text)
    before, after = text.split("".join(calls))
    parts = []
    for part in range(CHIP_PARTS):
        made = folder / f"round_trip_{part}.c"
        made.write_text(before + "".join(calls[part::CHIP_PARTS]) + after, encoding="utf-8")
        whole = round_trip(package)
        parts.append(whole._replace(name=f"{whole.name}_{part}", sources=[made]))
    return parts


class Machine(NamedTuple):
    """How programs are built for a machine, and run on it."""

    needs: Sequence[str]
    compiler: Sequence[str]
    runs: Sequence[str] = ()
    is_chip: bool = False

    def build(self, program: Program, folder: Path) -> Path:
        """Compile a program for the machine."""
        made = folder / program.name
        sources = [*program.sources, *(program.on_chip if self.is_chip else program.on_host)]
        words = [*self.compiler, f"-I{C}", *program.defines, *sources, "-o", made]
        compiles(*words, *(["-lgcc"] if self.is_chip else []))
        return made

    def run(self, program: Path) -> subprocess.CompletedProcess[str]:
        """Run a program on the machine."""
        return run(*self.runs, program)


MICROBIT = Machine(
    ("arm-none-eabi-gcc", "qemu-system-arm"),
    [
        *("arm-none-eabi-gcc", "-std=c11", *CORTEX_M0, "-fno-tree-loop-distribute-patterns"),
        "-fno-inline-functions-called-once",  # or main needs the stack of all tests of arrays
        *("-nostdlib", f"-I{CHIP}", f"-T{CHIP / 'microbit.ld'}"),
        *(str(CHIP / name) for name in ("startup.c", "semihosting.c", "memory.c")),
        *("-Wl,--gc-sections", "-ffunction-sections", "-fdata-sections"),
    ],
    [
        *("qemu-system-arm", "-M", "microbit", "-global", "nrf51-soc.flash-size=524288"),
        *("-display", "none", "-monitor", "none"),
        *("-serial", "none", "-semihosting-config", "enable=on,target=native", "-kernel"),
    ],
    is_chip=True,
)

# The others are compared with the first.
MACHINES = {
    "x86-64": Machine(("gcc",), ["gcc", "-std=c99", "-O2"]),
    "x86-64 by clang": Machine(("clang",), ["clang", "-std=c99", "-O2"]),
    "32 bits": Machine(("gcc -m32",), ["gcc", "-std=c99", "-O1", "-m32"]),
    "big-endian": Machine(
        ("s390x-linux-gnu-gcc", "qemu-s390x"),
        ["s390x-linux-gnu-gcc", "-std=c99", "-O1", "-static"],
        ["qemu-s390x"],
    ),
    "sanitizers of gcc": Machine(("gcc",), ["gcc", "-std=c99", *SANITIZERS]),
    "sanitizers of clang": Machine(
        ("clang", "clang -fsanitize"), ["clang", "-std=c99", *SANITIZERS]
    ),
    "valgrind": Machine(
        ("gcc", "valgrind"),
        ["gcc", "-std=c99", "-O0", "-g"],
        ["valgrind", "--quiet", "--error-exitcode=9", "--leak-check=full"],
    ),
    "Cortex-M0": MICROBIT,
}
