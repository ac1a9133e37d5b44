"""Fuzz the codec and the framer, guided by coverage, and count the executions.

    python tests/fuzz/atheris_codec.py                       # 10 million executions, three processes
    python tests/fuzz/atheris_codec.py --executions 100000 --seed 7
    python tests/fuzz/atheris_codec.py --replay build/fuzz/stream-crash-…

Of a hundred executions, 40 frame a stream, 59 decode or encode a single frame, which is faster
(``properties.py``), and one reads a stream of commands and replies (``command_properties.py``). The corpus
starts with the worked examples and captures. ``streams.py`` and ``command_streams.py`` mutate the inputs, and
one mutation in ten is libFuzzer's own. Inputs that break a property are kept below ``build/fuzz``.

The exit status is 1 if a property was broken, an undocumented exception was raised, fewer executions than
requested completed, or an expected kind of event or refusal never occurred.

Each worker counts an execution after its last check, in shared memory. A worker that dies early therefore
cannot look complete.
"""

from __future__ import annotations

import argparse
import mmap
import re
import resource
import shutil
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import NamedTuple

EXECUTIONS = 10_000_000
BUILD = Path("build/fuzz")
SHARES = {
    "stream": 40,
    "codec": 59,
    "commands": 1,
}  # in hundredths: one execution of "commands" runs many streams
LONGEST = 512
_SECONDS_AN_INPUT = 20
_MEBIBYTES = 1024
_SECONDS_BETWEEN_LINES = 60
_COVERAGE = re.compile(r"cov: (\d+) ft: (\d+)")
_SLOT = 8  # bytes of a counter


# One process of the fuzzer


def work(target: str, executions: int, seed: int, folder: Path) -> None:
    """Fuzz one target. libFuzzer ends the process."""
    import atheris

    with atheris.instrument_imports(include=["stagewire", "stagewire_apt", "stagewire_ms2000"]):
        import properties
        import streams

        check: Callable[[bytes], None] = getattr(properties, f"check_{target}")
        # Import the modules that are imported on first use.
        for data in streams.beginnings(target):
            check(data)

    with (folder / f"{target}.counts").open("r+b") as file:
        counts = memoryview(mmap.mmap(file.fileno(), 0)).cast("Q")
    properties.count_in(counts[1:])

    def once(data: bytes) -> None:
        check(data)
        counts[0] += 1

    rng = Random(seed)
    change: Callable[[Random, bytes], bytes] = getattr(streams, f"change_{target}")

    def mutate(data: bytes, longest: int, _: int) -> bytes:
        if rng.random() < 0.1:
            return bytes(atheris.Mutate(data, longest))
        return change(rng, data)[:longest]

    corpus = folder / f"{target}-corpus"
    options = [
        f"-runs={executions}",
        f"-seed={seed}",
        f"-max_len={LONGEST}",
        f"-timeout={_SECONDS_AN_INPUT}",
        f"-rss_limit_mb={_MEBIBYTES}",
        f"-artifact_prefix={folder / target}-",
        "-print_final_stats=1",
    ]
    atheris.Setup([sys.argv[0], *options, str(corpus)], once, custom_mutator=mutate)
    atheris.Fuzz()


# All processes


class Worker(NamedTuple):
    """A process that fuzzes one target, with its counters and its log."""

    target: str
    executions: int
    process: subprocess.Popen[bytes]
    counts: memoryview
    log: Path

    @property
    def done(self) -> int:
        """Number of executions that passed all their checks."""
        return int(self.counts[0])


def start(target: str, executions: int, seed: int, names: tuple[str, ...]) -> Worker:
    """Start a worker on a fresh corpus, so that the same seed starts from the same inputs."""
    import streams

    corpus = BUILD / f"{target}-corpus"
    shutil.rmtree(corpus, ignore_errors=True)
    corpus.mkdir(parents=True)
    for number, data in enumerate(streams.beginnings(target)):
        (corpus / f"published-{number:03}").write_bytes(data)
    counters = BUILD / f"{target}.counts"
    counters.write_bytes(bytes(_SLOT * (1 + len(names))))
    with counters.open("r+b") as file:
        counts = memoryview(mmap.mmap(file.fileno(), 0)).cast("Q")
    log = BUILD / f"{target}.log"
    command = [sys.executable, __file__, "--worker", target]
    command += ["--executions", str(executions), "--seed", str(seed)]
    with log.open("wb") as out:
        process = subprocess.Popen(command, stdout=out, stderr=subprocess.STDOUT)
    return Worker(target, executions, process, counts, log)


def watch(workers: list[Worker]) -> dict[str, float]:
    """Wait for all workers, printing progress every minute; return the seconds that each one took."""
    began = said = time.monotonic()
    seconds: dict[str, float] = {}
    while len(seconds) < len(workers):
        time.sleep(0.2)
        now = time.monotonic()
        for worker in workers:
            if worker.target not in seconds and worker.process.poll() is not None:
                seconds[worker.target] = now - began
        if now - said >= _SECONDS_BETWEEN_LINES:
            said = now
            done = ", ".join(f"{worker.target} {worker.done:,}" for worker in workers)
            print(f"{now - began:6.0f} s: {done}", flush=True)
    return seconds


def report(worker: Worker, seconds: float, names: tuple[str, ...]) -> list[str]:
    """Print the figures of a worker and return the problems found in them."""
    text = worker.log.read_text(encoding="utf-8", errors="replace")
    coverage = _COVERAGE.findall(text)
    edges, features = coverage[-1] if coverage else ("no", "no")
    print(
        f"{worker.target}: {worker.done:,} executions, {worker.done / seconds:,.0f} per second, "
        f"{edges} edges covered, {features} features"
    )
    seen = dict(zip(names, worker.counts[1:], strict=True))
    print("  " + ", ".join(f"{name} {number:,}" for name, number in seen.items() if number))
    wrong = []
    if worker.process.returncode:
        print(text[-4000:])
        wrong.append(f"exited with status {worker.process.returncode}; see {worker.log}")
    if worker.done < worker.executions:
        wrong.append(f"only {worker.done:,} of {worker.executions:,} executions completed")
    if not coverage:
        wrong.append("libFuzzer reported no coverage, so the run was not guided")
    return [f"{worker.target}: {what}" for what in wrong]


def fuzz(executions: int, seed: int) -> int:
    """Run a worker for each target; return the exit code."""
    from properties import SEEN

    BUILD.mkdir(parents=True, exist_ok=True)
    shares = {
        target: executions * share // sum(SHARES.values()) for target, share in SHARES.items()
    }
    shares["codec"] += executions - sum(shares.values())
    workers = [
        start(target, share, seed + number, SEEN)
        for number, (target, share) in enumerate(shares.items())
    ]
    try:
        seconds = watch(workers)
    finally:
        for worker in workers:
            worker.process.kill()
    wrong = []
    for worker in workers:
        wrong += report(worker, seconds[worker.target], SEEN)
    for slot, name in enumerate(SEEN, 1):
        if not any(worker.counts[slot] for worker in workers):
            wrong.append(f"{name} never occurred")
    done = sum(worker.done for worker in workers)
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    print(
        f"{done:,} executions in {max(seconds.values()):,.0f} s, "
        f"{done / max(seconds.values()):,.0f} per second; "
        f"{used.ru_utime + used.ru_stime:,.0f} s of processor time"
    )
    for problem in wrong:
        print(f"problem: {problem}")
    return int(bool(wrong))


def replay(path: Path) -> None:
    """Run one kept input without the fuzzer, and raise its error."""
    import properties

    target = next(target for target in SHARES if path.name.startswith(target))
    getattr(properties, f"check_{target}")(path.read_bytes())
    print(f"{path}: every property holds")


def main() -> int:
    """Parse the arguments and fuzz."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--executions", type=int, default=EXECUTIONS)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--replay", type=Path, metavar="FILE")
    parser.add_argument("--worker", choices=SHARES, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.replay:
        replay(given.replay)
        return 0
    if given.worker:
        work(given.worker, given.executions, given.seed, BUILD)
    return fuzz(given.executions, given.seed)


if __name__ == "__main__":
    sys.exit(main())
