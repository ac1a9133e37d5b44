"""The cost of the generated C in instructions, as counted by valgrind: the same in every run on any machine.

The accessors are compared with a packed struct and with absolute bounds. The parser is compared with a loop
over packed structs, both on the complete stream of the other benchmarks (``stream.py``).

    python benchmarks/c_speed.py                    # needs gcc and valgrind, on x86-64
"""

from __future__ import annotations

import platform
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from measure import Bound, report
from stream import frames as make_frames

ROOT = Path(__file__).parents[1]
HERE = Path(__file__).parent / "c"
C = ROOT / "generated" / "c"
SIZE = 1_000_000
COMPILE = ["gcc", "-std=gnu99", "-O2", f"-I{C}"]
NOTHING = "nothing"

ACCESSORS = {
    "decode": "decode the DC status",
    "decode_packed": "the same with a packed struct",
    "encode": "encode MOVE_ABSOLUTE",
    "encode_unchecked": "the same unchecked",
}
STREAM = {
    "by_hand": "a loop over packed structs",
    "by_parser": "parser and accessors",
    "by_parser, no index": "the same without APT_HOST_INDEX",
}
ACCESSOR_BOUNDS = [
    Bound(
        "decode the DC status",
        "the same with a packed struct",
        at_most=2,
        difference=True,
        unit="instructions",
    ),
    Bound("encode MOVE_ABSOLUTE", NOTHING, at_most=20, difference=True, unit="instructions"),
    Bound("the same unchecked", NOTHING, at_most=14, difference=True, unit="instructions"),
]
STREAM_BOUNDS = [Bound("parser and accessors", "a loop over packed structs", at_most=1.5)]


def made(folder: Path, name: str, *words: object) -> Path:
    """Compile a program and return its path."""
    program = folder / name
    subprocess.run([*COMPILE, *map(str, words), "-o", str(program)], check=True)
    return program


def counted(function: str, program: Path, *words: object) -> tuple[int, str]:
    """Return the instructions executed inside a function of a program, and the output of the program."""
    counting = ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null",
                f"--toggle-collect={function}"]  # fmt: skip
    done = subprocess.run(
        [*counting, str(program), *map(str, words)], capture_output=True, text=True, check=True
    )
    found = re.search(r"Collected : (\d+)", done.stderr)
    if not found:
        raise RuntimeError(f"valgrind did not print its counts:\n{done.stderr}")
    return int(found[1]), done.stdout


def accessors(folder: Path) -> dict[str, float]:
    """Return the instructions for one call of each accessor, including its return."""
    program = made(folder, "accessors", HERE / "accessors.c")
    costs = {NOTHING: 0.0}
    for function, name in ACCESSORS.items():
        instructions, printed = counted(function, program, function)
        costs[name] = instructions / int(printed.split()[0])
    return costs


def stream(folder: Path) -> tuple[dict[str, float], int]:
    """Return the instructions for each message of the stream, and the number of messages."""
    frames = list(make_frames(SIZE))
    path = folder / "stream.bin"
    path.write_bytes(b"".join(frames))
    source = C / "stagewire_apt" / "stagewire_apt.c"
    indexed = made(folder, "indexed", "-DAPT_HOST_INDEX", HERE / "stream.c", source)
    plain = made(folder, "plain", HERE / "stream.c", source)
    costs, results = {}, set()
    for way, name in STREAM.items():
        function, _, no_index = way.partition(",")
        instructions, printed = counted(function, plain if no_index else indexed, path, function)
        costs[name] = instructions / len(frames)
        results.add(printed)
    if len(results) != 1:
        raise RuntimeError(f"the programs found different messages in the stream: {results}")
    return costs, len(frames)


def main() -> int:
    """Count; return 1 if a bound is exceeded."""
    missing = [tool for tool in ("gcc", "valgrind") if not shutil.which(tool)]
    if missing or platform.machine() != "x86_64":
        print(f"needs {' and '.join(missing) or 'x86-64'}: skipped")
        return 1
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        of_accessors = accessors(folder)
        of_stream, messages = stream(folder)
    show = "{:,.1f}".format
    kept = report("Instructions per call", [of_accessors], ACCESSOR_BOUNDS, show)
    title = f"Parse a stream of {messages:,} messages, instructions per message"
    return 0 if report(title, [of_stream], STREAM_BOUNDS, show) and kept else 1


if __name__ == "__main__":
    sys.exit(main())
