"""The start-up cost of a process: importing the library, and generating all code.

Each figure is for a whole process. Bytecode and templates are compiled beforehand, as in an installed wheel.
The bounds apply to processor time, which other programs do not affect; wall-clock time is also printed. Only
the time until the first output of a command is measured on the wall.

    python benchmarks/start_up.py
"""

from __future__ import annotations

import compileall
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from measure import Bound, interleave, report

from stagewire_generator.targets.environment import COMPILED, compile_templates

ROOT = Path(__file__).resolve().parent.parent
PACKAGES = ("runtime", "generated/python", "generator", "conformance", "cli")
BARE = [sys.executable, "-c", "pass"]
RUNTIME = "import stagewire"
IMPORT = "import stagewire_apt"
MESSAGES = "from stagewire_apt import decode"
COMMANDS = "from stagewire_ms2000 import decode"
DEVICES = "from stagewire_apt import TDC001"

FIRST_OUTPUTS = (
    ("--help",),
    ("move", "--help"),
    ("list",),
    ("show", "MOT_MOVE_ABSOLUTE"),
    ("decode", "53 04 06 00 D0 01 01 00 40 0D 03 00"),
    ("encode", "MOT_MOVE_HOME", "--form", "header", "chan_ident=1"),
    ("move", "virtual://TDC001?stage=Z8", "--stage", "Z8", "--to", "0.1", "--yes"),
    ("monitor", "virtual://TDC001", "--for", "0.1"),
    ("conformance", "examples", "--summary"),
    ("virtual", "TDC001", "--pty", "--for", "0.1"),
)


class Processes:
    """Runs commands and records their wall-clock times."""

    def __init__(self) -> None:
        self.wall: dict[str, list[float]] = {}

    def runner(self, name: str, command: list[str]) -> Callable[[], float]:
        """Return a runner of one command: the processor time of the process in seconds."""

        def run() -> float:
            start = time.perf_counter()
            process = subprocess.Popen(
                command, cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
            )
            _, status, usage = os.wait4(process.pid, 0)
            process.returncode = os.waitstatus_to_exitcode(status)
            if process.returncode:
                raise SystemExit(f"{' '.join(command)} failed")
            self.wall.setdefault(name, []).append(time.perf_counter() - start)
            return usage.ru_utime + usage.ru_stime

        return run


def memory(code: str) -> float:
    """Return the peak memory of a Python process that runs ``code``, in MiB."""
    # The peak that the kernel reports to a parent starts at the memory of the parent.
    code += "; print(*(line for line in open('/proc/self/status') if line.startswith('VmHWM')))"
    output = subprocess.run([sys.executable, "-c", code], capture_output=True, check=True).stdout
    return int(output.split()[1]) / 1024


def milliseconds(seconds: float) -> str:
    """Format seconds as milliseconds."""
    return f"{seconds * 1e3:,.1f} ms"


def importing() -> bool:
    """Measure the import of the APT package, and the first use of the messages of both packages."""
    processes = Processes()
    contenders = {"bare Python": processes.runner("bare Python", BARE)}
    for code in (RUNTIME, IMPORT, MESSAGES, COMMANDS, DEVICES):  # no bound for the last
        contenders[code] = processes.runner(code, [sys.executable, "-c", code])
    bounds = [
        Bound(code, over, at_most=at_most, difference=True, scale=1e3, unit="ms")
        for code, over, at_most in (
            (IMPORT, "bare Python", 20),
            (MESSAGES, IMPORT, 30),
            (COMMANDS, RUNTIME, 10),
        )
    ]
    kept = report("Import the library", interleave(contenders, 15), bounds, milliseconds)
    for code in (IMPORT, MESSAGES):
        more = statistics.median(memory(code) - memory("pass") for _ in range(9))
        verdict = "" if more <= 6 else "     NOT KEPT"
        print(f"  {f'memory of {code}':<58}{more:>9.2f}  <= 6 MiB{verdict}")
        kept = kept and more <= 6
    return kept


def generating() -> bool:
    """Measure ``stagewire generate`` of the whole registry into an empty directory."""
    processes = Processes()
    with tempfile.TemporaryDirectory() as folder:
        command = [str(Path(sys.executable).parent / "stagewire"), "generate", "--spec", "spec"]
        contenders = {
            "one second": lambda: 1.0,
            "stagewire generate": processes.runner("generate", [*command, "--out", folder]),
        }
        bound = Bound("stagewire generate", "one second", at_most=1.5)
        kept = report("Generate all code", interleave(contenders, 9), [bound], milliseconds)
    print(f"  on the wall{milliseconds(sorted(processes.wall['generate'])[5]):>49}")
    return kept


def answering() -> bool:
    """Measure the time until the first output of commands, on the wall."""
    contenders: dict[str, Callable[[], float]] = {"0.3 s": lambda: 0.3}
    for words in FIRST_OUTPUTS:
        contenders[" ".join(words)] = lambda words=words: first_output(words)  # type: ignore[misc]
    bounds = [Bound(name, "0.3 s", at_most=1.0) for name in contenders if name != "0.3 s"]
    return report("First output of a command", interleave(contenders, 9), bounds, milliseconds)


def first_output(words: tuple[str, ...]) -> float:
    """Return the seconds from the start of a command to its first byte of output."""
    command = [str(Path(sys.executable).parent / "stagewire"), *words]
    start = time.perf_counter()
    with subprocess.Popen(
        command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT
    ) as process:
        assert process.stdout is not None
        process.stdout.read(1)
        seconds = time.perf_counter() - start
        process.stdout.read()
    return seconds


if __name__ == "__main__":
    compile_templates(COMPILED)
    for package in PACKAGES:
        compileall.compile_dir(str(ROOT / package), quiet=1)
    sys.exit(0 if all([importing(), answering(), generating()]) else 1)
