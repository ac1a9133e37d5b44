"""A virtual controller that a separate process serves, for tests of commands in a process of their own."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

COMMAND = [sys.executable, "-c", "from stagewire_cli.main import run; run()"]


@contextmanager
def serving(*words: object) -> Iterator[str]:
    """Serve a virtual controller in a separate process; yield its URL."""
    with subprocess.Popen(
        [*COMMAND, "virtual", *map(str, words)],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    ) as process:
        assert process.stdout is not None
        try:
            yield process.stdout.readline().rstrip("\n").partition(" at ")[2]
        finally:
            process.terminate()
            process.stdout.read()


def wait_for(log: Path, text: str) -> None:
    end = time.monotonic() + 30
    while text not in log.read_text():
        assert time.monotonic() < end
        time.sleep(0.05)
