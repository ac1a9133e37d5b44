"""Fuzz the generated C with libFuzzer, AddressSanitizer and UndefinedBehaviorSanitizer.

    python tests/generated/c/libfuzzer.py                          # 20 million executions, a process a core
    python tests/generated/c/libfuzzer.py --executions 200000 --seed 7
    python tests/generated/c/libfuzzer.py --replay build/fuzz/c/apt_parser-crash-...

The targets stand in ``tests/fuzz/c``: the parsers, and all layouts of each package encoded and
decoded. The corpus begins with the vectors. The exit is 1 when a check of a target was broken, a
sanitizer spoke, fewer executions than asked for were made (libFuzzer counts them), or a kind of
event never came. What broke a check is kept below ``build/fuzz/c``. Standard library only.
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

ROOT = Path(__file__).parents[3]
HERE = ROOT / "tests" / "fuzz" / "c"
KEPT = ROOT / "build" / "fuzz" / "c"
EXECUTIONS = 20_000_000
OPTIONS = [
    *("-std=c11", "-O2", "-g", "-fno-omit-frame-pointer"),
    *("-fsanitize=address,undefined", "-fno-sanitize-recover=all"),
]
# Only what is tried guides the fuzzer, not the loops of what checks it.
GUIDED = ["-fsanitize=fuzzer-no-link", "-fno-sanitize-coverage=trace-cmp"]
SECONDS_AN_INPUT = 20

_DONE = re.compile(r"^stat::number_of_executed_units: +(\d+)", re.MULTILINE)
_SEEN = re.compile(r"^seen: (\w+) (\d+)$", re.MULTILINE)


class Target(NamedTuple):
    """A program, the package that it tries, its share of all executions, and the longest input."""

    source: str
    package: str
    protocol: str
    share: int  # in hundredths
    longest: int
    options: tuple[str, ...] = ()

    def defines(self) -> list[str]:
        """Return what tells a source that fits every package which it tries."""
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
    """Compile a target; return the program. What targets have in common is compiled once."""
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


# What the fuzzer begins with


def _bytes_of(path: Path) -> list[bytes]:
    """Return the bytes of examples, captures and cases, the refused ones included."""
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
    except ValueError:  # an example in prose, or with a misprinted digit
        return


def _beginnings(name: str, c: Path) -> Iterator[bytes]:
    """Yield inputs of a target, control bytes first; the sources say what these mean."""
    target = TARGETS[name]
    published = _bytes_of(c.parent / "vectors" / f"{target.protocol}.json")
    if target.source == "codec.c":
        yield from (bytes((0, 0, 2, 0x21)) + raw for raw in published)
        for number in range(256):  # whatever the struct of a layout is filled with
            yield from (bytes((number, 0, 0, 0x21)) + fill * 40 for fill in (b"\0", b"\xff"))
    else:
        controls = 3 if target.source == "apt_parser.c" else 2
        runs = [b"".join(published[first : first + 4]) for first in range(0, len(published), 4)]
        for number, raw in enumerate([*published, *runs]):
            yield bytes((number & 0xFF, number & 0xFF, 0xFF))[-controls:] + raw


def write_corpus(name: str, c: Path, folder: Path) -> int:
    """Write the inputs that a target begins with; return how many there are.

    The vectors stand beside the C that they are for.
    """
    inputs = [raw[: TARGETS[name].longest] for raw in _beginnings(name, c)]
    for number, raw in enumerate(inputs):
        (folder / f"{number:05}").write_bytes(raw)
    return len(inputs)


# Running


class Ran(NamedTuple):
    """What one process of the fuzzer came to."""

    code: int
    executions: int
    seen: Counter[str]
    said: str


def fuzz(program: Path, corpus: Path, executions: int, seed: int, kept: Path) -> Ran:
    """Run a target, which begins with the files of a folder."""
    kept.mkdir(parents=True, exist_ok=True)
    begins = corpus.with_suffix(
        ".list"
    )  # named one by one: a folder would be filled with what it finds
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
    """One process: a target and the number of it."""

    name: str
    part: int
    executions: int


def jobs(executions: int, processes: int) -> list[Job]:
    """Return what to run, so that every process has a part of every target."""
    found = []
    for name, target in TARGETS.items():
        share = -(-executions * target.share // 100 // processes) + 1
        found += [Job(name, part, share) for part in range(processes)]
    return found


def run(executions: int, seed: int, processes: int, c: Path) -> int:
    """Build everything, fuzz everything, and say what came of it."""
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
        seen: Counter[str] = Counter()
        for job, ran, seconds in pool.map(work, jobs(executions, processes)):
            total += ran.executions
            seen.update({f"{job.name} {kind}": number for kind, number in ran.seen.items()})
            speed = int(ran.executions / max(seconds, 0.001))
            print(
                f"{job.name} {job.part}: {ran.executions:,} executions, {speed:,} a second",
                flush=True,
            )
            if ran.code:
                failed = True
                print(ran.said)
    never = [kind for kind, number in seen.items() if not number]
    print(f"{total:,} executions of {executions:,}")
    if failed:
        print(f"the input that failed is kept below {KEPT.relative_to(ROOT)}")
    for kind in never:
        print(f"never seen: {kind}")
    if total < executions:
        print("too few executions")
    return 1 if failed or never or total < executions else 0


def main(arguments: Sequence[str] | None = None) -> int:
    """Run as the module says."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--executions", type=int, default=EXECUTIONS)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--processes", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--c", type=Path, default=ROOT / "generated" / "c", help="the generated C")
    parser.add_argument("--replay", type=Path, help="run one kept input")
    options = parser.parse_args(arguments)
    reason = tools.why_not(["clang", "clang -fsanitize"])
    if reason:
        print(reason)
        return 2
    if options.replay:
        with tempfile.TemporaryDirectory() as folder:
            program = build(options.replay.name.partition("-")[0], options.c, Path(folder))
            return subprocess.run([str(program), str(options.replay)], check=False).returncode
    return run(options.executions, options.seed, options.processes, options.c)


if __name__ == "__main__":
    sys.exit(main())
