"""The C testee: building it, running it, and comparing it with the Python testee."""

from __future__ import annotations

import io
import json
import subprocess
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from toolchain import Package, compiles, packages

from stagewire_conformance.testee import Testee, lines_of

Json = dict[str, Any]
PROTOCOLS = {"stagewire_apt": "thorlabs_apt", "stagewire_ms2000": "asi_ms2000"}
SANITIZERS = ("-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-g")
VERSION = '-DSTAGEWIRE_VERSION="0"'
_ITS_OWN = ("detail", "implementation", "version", "protocols")  # differs between all testees


class Program(NamedTuple):
    """A program for one protocol, or the command that runs it."""

    protocol: str
    words: Sequence[str | Path]

    def output(self, text: bytes) -> bytes:
        """Return the output for an input; the program must succeed and print no errors."""
        done = subprocess.run(self.words, input=text, capture_output=True, timeout=300, check=False)
        assert (done.returncode, done.stderr) == (0, b""), done.stderr.decode()
        return done.stdout

    def ask(self, text: bytes) -> list[Json]:
        """Return the answers to the lines of a text."""
        return [json.loads(line) for line in self.output(text).splitlines()]


def sources(package: Package) -> list[Path]:
    """Return the sources of the testee of a package."""
    testing = package.folder / "testing"
    shared = sorted((package.folder.parent / "testing" / "testee").glob("*.c"))
    return [*shared, testing / "layouts.c", testing / "testee.c", package.source]


def name_of(package: Package) -> str:
    """Return the name of the testee of a package."""
    return f"{package.prefix}_testee"


def build(package: Package, folder: Path, *flags: str, compiler: str = "gcc") -> Path:
    """Compile the testee of a package."""
    program = folder / name_of(package)
    include = f"-I{package.folder.parent}"
    compiles(compiler, "-std=c99", *flags, include, "-o", program, *sources(package))
    return program


def lines(requests: Iterable[Json]) -> bytes:
    """Return requests as the lines of a text."""
    return b"".join(json.dumps(request).encode() + b"\n" for request in requests)


class Testees:
    """The testees in C of all packages, and the one in Python."""

    __test__ = False  # not a test class for pytest

    def __init__(self, folder: Path) -> None:
        """Run what was built in a folder."""
        self.programs = [
            Program(PROTOCOLS[package.name], [folder / name_of(package)]) for package in packages()
        ]
        self.python = Testee()

    @staticmethod
    def build(folder: Path) -> None:
        """Compile the testees of all packages."""
        for package in packages():
            build(package, folder, "-O0", VERSION)

    def program(self, protocol: str) -> Program:
        """Return the program for a protocol."""
        return next(program for program in self.programs if program.protocol == protocol)

    def compare(self, text: bytes) -> list[Json]:
        """Run Python and C with each line of a text; return the answers of Python, which C must equal."""
        asked = list(lines_of(io.BytesIO(text)))
        answers = [self.python.answer(line) for line in asked]
        for program in self.programs:
            mine = [i for i, line in enumerate(asked) if _speaks(program, line)]
            parts = [asked[i] if asked[i].endswith(b"\n") else asked[i] + b"\n" for i in mine]
            given = program.ask(b"".join(parts))
            assert len(given) == len(mine)
            for i, answer in zip(mine, given, strict=True):
                assert _alike(answer) == _alike(answers[i]), asked[i][:2000]
                assert answer["ok"] or answer["detail"]
        return answers

    def serve(self, asked: Iterable[bytes], write: Callable[[str], None]) -> None:
        """Answer lines like the Python testee, after checking that C gives the same answers."""
        kept = list(asked)
        self.compare(b"".join(line if line.endswith(b"\n") else line + b"\n" for line in kept))
        for line in kept:
            write(json.dumps(self.python.answer(line)) + "\n")


def _alike(answer: Json) -> Json:
    return {key: value for key, value in answer.items() if key not in _ITS_OWN}


def _speaks(program: Program, line: bytes) -> bool:
    """Whether a program should answer a line: it names no other protocol."""
    try:
        named = json.loads(line).get("protocol")
    except (ValueError, AttributeError, RecursionError):
        return True
    return named == program.protocol or named not in PROTOCOLS.values()
