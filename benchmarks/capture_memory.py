"""``stagewire decode`` needs no more memory for 100 MB than for 10 MB, in any output format.

The captures are mixed (``stream.py``). The command runs in a separate process. The program prints the
processor time and the peak memory for each format. It exits with 1 if the large capture needs a few MiB more
than the small one.

    python benchmarks/capture_memory.py
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path

from stream import frames

from stagewire_apt import messages as m

SMALL, LARGE = 10_000_000, 100_000_000
SLACK = 6.0
"""MiB. Allocators differ by a few MiB from run to run, and Parquet keeps an index of its row groups."""

COMMAND = "from stagewire_cli.main import run; run()"
STATUS = m.MotGetDcStatusUpdate.layout.message
FORMATS = {
    "table": ["--format", "table"],
    "jsonl": ["--format", "jsonl"],
    "csv": ["--format", "csv"],
    "parquet": ["--format", "parquet"],
    "csv, one message": ["--format", "csv", "--message", STATUS],
    "parquet, one message": ["--format", "parquet", "--message", STATUS],
}


def write_capture(path: Path, size: int) -> int:
    """Write a capture in pieces, and return the number of its frames.

    This process must stay small, because the peak of a child process starts at the size of its parent.
    """
    written = 0
    with path.open("wb") as file:
        for frame in frames(size):
            file.write(frame)
            written += 1
    return written


def run(arguments: list[str]) -> tuple[float, float]:
    """Run the command and return its processor time in seconds and its peak memory in MiB."""
    command = [sys.executable, "-c", COMMAND, "decode", *arguments]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise SystemExit(f"exit {process.returncode}: {' '.join(command)}")
    unit = 1 if sys.platform == "darwin" else 1024
    return usage.ru_utime + usage.ru_stime, usage.ru_maxrss * unit / 2**20


def main() -> int:
    """Measure every format; return 1 if memory grows with the capture."""
    over = False
    with tempfile.TemporaryDirectory() as folder:
        captures = [Path(folder) / "small.bin", Path(folder) / "large.bin"]
        sizes = (SMALL, LARGE)
        counts = [write_capture(path, size) for path, size in zip(captures, sizes, strict=True)]
        print(f"{counts[0]:,} and {counts[1]:,} frames")
        run(
            [m.ModIdentify().pack(0x50, 0x01).hex()]
        )  # compile the modules, which needs memory once
        head = "".join(f"{size // 10**6:>7} MB: s{'MiB':>8}" for size in sizes)
        print(f"{'format':24}{head}{'us/frame':>10}{'grows':>8}")
        for name, options in FORMATS.items():
            target = ["--output", str(Path(folder) / "decoded")]
            measured = [run([str(path), "--end", "host", *options, *target]) for path in captures]
            cells = "".join(f"{seconds:>13.1f}{peak:>8.1f}" for seconds, peak in measured)
            each = measured[1][0] / counts[1] * 1e6
            grows = measured[1][1] - measured[0][1]
            over |= grows > SLACK
            print(
                f"{name:24}{cells}{each:>10.2f}{grows:>8.1f}{'  over' * (grows > SLACK)}",
                flush=True,
            )
    return int(over)


if __name__ == "__main__":
    sys.exit(main())
