"""The same programs on every machine: other word sizes and byte order, a chip, and with sanitizers."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from pathlib import Path

import pytest
from machines import MACHINES, MICROBIT, Program, round_trip, round_trip_parts, vectors
from toolchain import C, Package, need, of_each_package, packages

pytestmark = pytest.mark.matrix

FIRST = "x86-64"
PROTOCOLS = {"apt": "thorlabs_apt", "ms2000": "asi_ms2000"}

on_each_machine = pytest.mark.parametrize("machine", MACHINES)
on_each_other_machine = pytest.mark.parametrize("machine", [it for it in MACHINES if it != FIRST])


def ids_of_examples(package: Package) -> set[str]:
    """Return the ids of the worked examples and captures."""
    path = C.parent / "vectors" / f"{PROTOCOLS[package.prefix]}.json"
    published = json.loads(path.read_text(encoding="utf-8"))
    return {entry["id"] for entry in [*published["examples"], *published["captures"]]}


@pytest.fixture(scope="module")
def expected(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """The output of the first machine for the vectors, by package; all of them pass."""
    machine = MACHINES[FIRST]
    need(*machine.needs)
    printed = {}
    for package in packages():
        done = machine.run(machine.build(vectors(package), tmp_path_factory.mktemp(package.prefix)))
        assert done.returncode == 0, done.stdout
        printed[package.prefix] = done.stdout
    return printed


@of_each_package
def test_every_example_is_among_the_vectors(package: Package, expected: dict[str, str]) -> None:
    said = {line.split()[0] for line in expected[package.prefix].splitlines()}
    assert said >= ids_of_examples(package)


@on_each_other_machine
@of_each_package
def test_every_vector_passes_on_other_machines(
    package: Package, machine: str, expected: dict[str, str], tmp_path: Path
) -> None:
    there = MACHINES[machine]
    need(*there.needs)
    done = there.run(there.build(vectors(package), tmp_path))
    assert done.returncode == 0, done.stdout
    said = expected[package.prefix]
    if there.is_chip:  # which is too small for the cases
        examples, mark, _ = said.partition("\n" + said_in_all(said, 0))
        said = examples + mark + "\n"
    assert done.stdout == said


def said_in_all(text: str, suite: int) -> str:
    """Return the summary line of a suite."""
    return [line for line in text.splitlines() if " passed, " in line][suite]


@on_each_machine
@of_each_package
def test_every_round_trip_passes(package: Package, machine: str, tmp_path: Path) -> None:
    there = MACHINES[machine]
    need(*there.needs)
    programs = round_trip_parts(package, tmp_path) if there.is_chip else [round_trip(package)]
    for program in programs:
        done = there.run(there.build(program, tmp_path))
        assert (done.returncode, done.stdout) == (0, "")


@of_each_package
def test_the_parts_of_a_round_trip_call_every_test_once(package: Package, tmp_path: Path) -> None:
    def called(sources: Sequence[Path]) -> list[str]:
        text = "".join(path.read_text(encoding="utf-8") for path in sources)
        return sorted(re.findall(r"failed \+= (test_\w+)\(\)", text))

    parts = [part.sources for part in round_trip_parts(package, tmp_path)]
    assert all(called(part) for part in parts)
    assert called([path for part in parts for path in part]) == called(round_trip(package).sources)


BAD = {
    "sanitizers of gcc": "int a[2]; volatile int i = 2; int main(void) { return a[i]; }",
    "sanitizers of clang": "int main(void) { volatile int i = 2147483647; i = i + 1; return 0; }",
    "valgrind": "#include <stdlib.h>\nint main(void) { int *volatile a = malloc(4); return a[1] == 7; }",
    "big-endian": "int main(void) { int a = 1; return *(char *)&a ? 0 : 1; }",
    "32 bits": "int main(void) { return sizeof(void *) == 8 ? 0 : 1; }",
    "Cortex-M0": "int main(void) { return ((int (*)(void))0xF0000000)(); }",
}


@pytest.mark.parametrize("machine", BAD)
def test_every_machine_has_its_stated_properties(machine: str, tmp_path: Path) -> None:
    there = MACHINES[machine]
    need(*there.needs)
    bad = tmp_path / "bad.c"
    bad.write_text(BAD[machine] + "\n", encoding="ascii")
    done = there.run(there.build(Program("bad", [bad], [], []), tmp_path))
    assert done.returncode not in (0, -11), done.stdout


def test_a_writable_global_does_not_link_for_the_chip(tmp_path: Path) -> None:
    need(*MICROBIT.needs)
    bad = tmp_path / "bad.c"
    bad.write_text("int count = 1; int main(void) { return ++count; }\n", encoding="ascii")
    with pytest.raises(AssertionError, match="a writable global"):
        MICROBIT.build(Program("bad", [bad], [], []), tmp_path)
