"""Fuzz the generated C with libFuzzer, AddressSanitizer and UndefinedBehaviorSanitizer.

    python tests/generated/c/libfuzzer.py                        # 20 million executions, one process per core
    python tests/generated/c/libfuzzer.py --executions 200000 --seed 7
    python tests/generated/c/libfuzzer.py --replay build/fuzz/c/apt_parser-crash-...

The targets are in ``tests/fuzz/c``: the parsers, and encoding and decoding of all layouts of each package.
The initial corpus is the vectors. The exit status is 1 if a check of a target failed, a sanitizer found an
error, libFuzzer counted fewer executions than requested, or a kind of event did not occur. Inputs that fail a
check are kept in ``build/fuzz/c``. The program uses only the standard library.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple

import tools
from generated_c import generated

ROOT = Path(__file__).parents[3]
HERE = ROOT / "tests" / "fuzz" / "c"
REGISTRIES = ROOT / "generated" / "python"
KEPT = ROOT / "build" / "fuzz" / "c"
EXECUTIONS = 20_000_000
OPTIONS = [
    *("-std=c11", "-O2", "-g", "-fno-omit-frame-pointer"),
    *("-fsanitize=address,undefined", "-fno-sanitize-recover=all"),
]
# Only the code under test guides the fuzzer, not the loops of the checks.
GUIDED = ["-fsanitize=fuzzer-no-link", "-fno-sanitize-coverage=trace-cmp"]
SECONDS_AN_INPUT = 20
MOST_LAYOUTS = 600  # at least those of the largest package, so that the corpus has each

_DONE = re.compile(r"^stat::number_of_executed_units: +(\d+)", re.MULTILINE)
_SEEN = re.compile(r"^seen: (\w+) (\d+)$", re.MULTILINE)


class Target(NamedTuple):
    """A fuzz target: its package, its share of all executions, and the maximum length of inputs."""

    source: str
    package: str
    protocol: str
    share: int  # per cent
    longest: int
    options: tuple[str, ...] = ()

    def defines(self) -> list[str]:
        """Return the macros that configure a generic source for a package."""
        prefix = self.package.removeprefix("stagewire_")
        return [
            f'-DLAYOUTS_H="{self.package}/testing/layouts.h"',
            f"-DLAYOUTS={prefix}_layouts",
            f"-DLAYOUT_COUNT={prefix}_layout_count",
            *self.options,
        ]


_APT = ("stagewire_apt", "thorlabs_apt")
_MS2000 = ("stagewire_ms2000", "asi_ms2000")
TARGETS = {
    "apt_parser": Target("apt_parser.c", *_APT, 20, 320),
    "apt_parser_indexed": Target("apt_parser.c", *_APT, 15, 320, ("-DAPT_HOST_INDEX",)),
    "apt_codec": Target("codec.c", *_APT, 30, 300),
    "ms2000_parser": Target("ms2000_parser.c", *_MS2000, 15, 300),
    "ms2000_codec": Target("codec.c", *_MS2000, 20, 64),
}


def build(name: str, c: Path, folder: Path, *options: str) -> Path:
    """Compile a target and return the program. Code that targets share is compiled once."""
    target = TARGETS[name]
    package = c / target.package
    compiler = ["clang", *OPTIONS, f"-I{c}", *options]
    made = folder / name
    sources = {
        folder / f"{target.package}_layouts.o": [*GUIDED, package / "testing" / "layouts.c"],
        folder / f"{name}_parser.o": [*GUIDED, *target.options, package / f"{target.package}.c"],
        folder / f"{name}.o": [*target.defines(), HERE / target.source],
    }
    for path, words in sources.items():
        if not path.exists():
            subprocess.run([*compiler, "-c", *map(str, words), "-o", str(path)], check=True)
    subprocess.run(
        [*compiler, "-fsanitize=fuzzer", *map(str, sources), "-o", str(made)], check=True
    )
    return made


# The initial corpus


def _bytes_of(path: Path) -> list[bytes]:
    """Return the bytes of examples, captures and cases, including invalid ones."""
    vectors = json.loads(path.read_text(encoding="utf-8"))
    texts = [entry.get("printed") for entry in [*vectors["examples"], *vectors["captures"]]]
    for case in vectors["cases"]:
        request = case["request"]
        texts += [request.get("hex"), case["answer"].get("hex")]
        texts.append("".join(map(str, request.get("chunks", ()))))
    return sorted({raw for text in texts if text for raw in _hex(text)})


def _hex(text: object) -> Iterator[bytes]:
    try:
        yield bytes.fromhex(str(text))
    except ValueError:  # an example in prose or with a misprint
        return


def _beginnings(name: str, c: Path) -> Iterator[bytes]:
    """Yield inputs of a target, beginning with control bytes; the sources describe these."""
    target = TARGETS[name]
    published = _bytes_of(c.parent / "vectors" / f"{target.protocol}.json")
    if target.source == "codec.c":
        yield from (bytes((0, 0, 2, 0x21)) + raw for raw in published)
        for number in range(MOST_LAYOUTS):  # bytes that fill the struct of a layout
            controls = number.to_bytes(2, "little") + b"\0\x21"
            yield from (controls + fill * 40 for fill in (b"\0", b"\xff"))
    else:
        controls = 3 if target.source == "apt_parser.c" else 2
        runs = [b"".join(published[first : first + 4]) for first in range(0, len(published), 4)]
        for number, raw in enumerate([*published, *runs]):
            yield bytes((number & 0xFF, number & 0xFF, 0xFF))[-controls:] + raw


def write_corpus(name: str, c: Path, folder: Path) -> int:
    """Write the initial inputs of a target; return their number.

    The vectors are next to the C code.
    """
    inputs = [raw[: TARGETS[name].longest] for raw in _beginnings(name, c)]
    for number, raw in enumerate(inputs):
        (folder / f"{number:05}").write_bytes(raw)
    return len(inputs)


# Running


class Ran(NamedTuple):
    """The result of one fuzzer process."""

    code: int
    executions: int
    seen: Counter[str]
    said: str


def fuzz(program: Path, corpus: Path, executions: int, seed: int, kept: Path) -> Ran:
    """Run a target with the files of a folder as its corpus."""
    kept.mkdir(parents=True, exist_ok=True)
    begins = corpus.with_suffix(
        ".list"
    )  # named one by one: the fuzzer would write its findings to a folder
    begins.write_text(",".join(str(path) for path in sorted(corpus.iterdir())), encoding="utf-8")
    longest = TARGETS[program.name].longest
    command = [
        str(program),
        f"-runs={executions}",
        f"-seed={seed}",
        f"-max_len={longest}",
        f"-timeout={SECONDS_AN_INPUT}",
        f"-artifact_prefix={kept}/{program.name}-",
        "-print_final_stats=1",
        "-print_funcs=0",
        "-detect_leaks=0",
        f"-seed_inputs=@{begins}",
    ]
    ran = subprocess.run(
        command, capture_output=True, encoding="utf-8", errors="replace", check=False
    )
    done = _DONE.search(ran.stderr)
    seen = Counter({name: int(number) for name, number in _SEEN.findall(ran.stderr)})
    return Ran(ran.returncode, int(done[1]) if done else 0, seen, ran.stderr)


class Job(NamedTuple):
    """One process: a target and its number."""

    name: str
    part: int
    executions: int


def never_seen(name: str, seen: Counter[str]) -> list[str]:
    """Return the kinds of events that did not occur, without those that the package cannot produce."""
    path = REGISTRIES / TARGETS[name].package / "registry.json"
    messages = json.loads(path.read_text(encoding="utf-8"))["messages"]
    never = [kind for kind, number in seen.items() if not number]
    if all(message["layouts"] or message["id"] is None for message in messages):
        never = [kind for kind in never if kind != "undocumented"]
    return never


def jobs(executions: int, processes: int) -> list[Job]:
    """Return the jobs, divided so that every process runs a part of every target."""
    found = []
    for name, target in TARGETS.items():
        share = -(-executions * target.share // 100 // processes) + 1
        found += [Job(name, part, share) for part in range(processes)]
    return found


def run(executions: int, seed: int, processes: int, c: Path) -> int:
    """Build and run everything, and print the results."""
    with tempfile.TemporaryDirectory() as name, ThreadPoolExecutor(processes) as pool:
        folder = Path(name)
        programs = {name: build(name, c, folder) for name in TARGETS}

        def work(job: Job) -> tuple[Job, Ran, float]:
            corpus = folder / f"{job.name}-{job.part}"
            corpus.mkdir()
            write_corpus(job.name, c, corpus)
            start = time.monotonic()
            ran = fuzz(programs[job.name], corpus, job.executions, seed + job.part, KEPT)
            return job, ran, time.monotonic() - start

        failed = False
        total = 0
        seen: dict[str, Counter[str]] = {name: Counter() for name in TARGETS}
        for job, ran, seconds in pool.map(work, jobs(executions, processes)):
            total += ran.executions
            seen[job.name].update(ran.seen)
            speed = int(ran.executions / max(seconds, 0.001))
            print(
                f"{job.name} {job.part}: {ran.executions:,} executions, {speed:,} a second",
                flush=True,
            )
            if ran.code:
                failed = True
                print(ran.said)
    never = [f"{name} {kind}" for name in seen for kind in never_seen(name, seen[name])]
    print(f"{total:,} executions of {executions:,}")
    if failed:
        print(f"the input that failed is kept below {KEPT.relative_to(ROOT)}")
    for kind in never:
        print(f"never seen: {kind}")
    if total < executions:
        print("too few executions")
    return 1 if failed or never or total < executions else 0


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the program; see the module."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--executions", type=int, default=EXECUTIONS)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--processes", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--c", type=Path, help="the C with its tests (default: generate it)")
    parser.add_argument("--replay", type=Path, help="run one kept input")
    options = parser.parse_args(arguments)
    reason = tools.why_not(["clang", "clang -fsanitize"])
    if reason:
        print(reason)
        return 2
    c = options.c or generated()
    if options.replay:
        with tempfile.TemporaryDirectory() as folder:
            program = build(options.replay.name.partition("-")[0], c, Path(folder))
            return subprocess.run([str(program), str(options.replay)], check=False).returncode
    return run(options.executions, options.seed, options.processes, c)


if __name__ == "__main__":
    sys.exit(main())
