"""Run ``sh`` blocks of the documentation line by line in a safe folder.

- A shell runs each line. In a quick test, lines that call ``stagewire`` run in this process instead.
- A line must exit with 0 unless its comment says ``exit status N``. Programs have no input and no terminal.
- A line that serves a virtual controller keeps running during the lines after it. It then receives Ctrl-C and
  must exit with 0, or with 1 if it replays a recording, since the session is not repeated.
- Port numbers are replaced by free ports.
"""

from __future__ import annotations

import io
import os
import re
import shlex
import signal
import socket
import subprocess
import sys
import sysconfig
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from quick_command import quick_command
from stagewire_cli.main import main

PATIENCE = 180.0
MOST_SHOWN = 2000  # characters from the end of the output

_SERVES = re.compile(r"stagewire (serve|virtual (?!--list))")
_SERVED = re.compile(r" at (socket://|/dev/|\w+)")
_COMMENT = re.compile(r"\s+#\s.*$")
_STATUS = re.compile(r"# exit status (\d+)")
_PORT = re.compile(r"(?<=127\.0\.0\.1:)\d+|(?<=--tcp )\d+(?![.\d])")


def lines(text: str) -> Iterator[tuple[str, int]]:
    """Yield the commands of a block, each with its expected exit status."""
    for line in text.replace("\\\n", " ").splitlines():
        status = _STATUS.search(line)
        command = _COMMENT.sub("", line).strip()
        if command and not command.startswith("#"):
            yield command, int(status[1]) if status else 0


class Shell:
    """A shell in which the lines of one block are typed.

    :param folder: working folder.
    :param output: folder for the output of the programs.
    :param quick: whether the command runs in this process.
    """

    def __init__(self, folder: Path, output: Path, *, quick: bool = False) -> None:
        self.folder = folder
        self.output = output
        self.quick = quick
        self.served: list[tuple[str, subprocess.Popen[bytes]]] = []
        self.ports: dict[str, str] = {}
        path = os.pathsep.join([sysconfig.get_path("scripts"), os.environ.get("PATH", os.defpath)])
        self.environment = {**os.environ, "PATH": path, "PYTHONUNBUFFERED": "1"}

    def type(self, command: str, *statuses: int) -> None:
        """Run a command; fail the test if its exit status is not one of ``statuses``."""
        command = _PORT.sub(lambda port: self._free(port[0]), command)
        if _SERVES.match(command):
            self._serve(command)
            return
        if self.quick and command.startswith("stagewire "):
            code, text = self._call(shlex.split(command)[1:])
        else:
            process, printed = self._start(command)
            code, text = process.wait(PATIENCE), printed.read_text()
        text = text[-MOST_SHOWN:]
        assert code in statuses, f"{command}\nexited with status {code}\n{text}"
        assert "Traceback" not in text, text

    def __enter__(self) -> Shell:
        """Return the shell."""
        return self

    def __exit__(self, kind: object, *_: object) -> None:
        """Send Ctrl-C to serving programs; check their exit status unless a line failed."""
        for _, process in self.served:
            process.send_signal(signal.SIGINT)
        for command, process in self.served:
            status = process.wait(PATIENCE)
            wanted = 1 if "--replay" in command else 0
            assert kind or status == wanted, f"{command}\nexited with status {status}, not {wanted}"

    def _call(self, arguments: list[str]) -> tuple[int, str]:
        """Run the command in this process; return its exit status and output."""
        printed = io.TextIOWrapper(io.BytesIO(), encoding="utf-8", write_through=True)
        with quick_command(), pytest.MonkeyPatch.context() as patch:
            patch.chdir(self.folder)
            patch.setenv("PATH", self.environment["PATH"])
            patch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(), encoding="utf-8"))
            patch.setattr(sys, "stdout", printed)
            patch.setattr(sys, "stderr", printed)
            code = main(arguments)
        return code, printed.buffer.getvalue().decode()

    def _start(self, command: str) -> tuple[subprocess.Popen[bytes], Path]:
        printed = self.output / f"{len(list(self.output.iterdir()))}.txt"
        with printed.open("wb") as file:
            process = subprocess.Popen(
                ["bash", "-c", f"exec {command}" if _SERVES.match(command) else command],
                cwd=self.folder,
                env=self.environment,
                stdin=subprocess.DEVNULL,
                stdout=file,
                stderr=subprocess.STDOUT,
            )
        return process, printed

    def _serve(self, command: str) -> None:
        process, printed = self._start(command)
        self.served.append((command, process))
        end = time.monotonic() + PATIENCE
        while not _SERVED.search(printed.read_text()):
            assert process.poll() is None, f"{command}\nexited immediately\n{printed.read_text()}"
            assert time.monotonic() < end, (
                f"{command}\ndid not start to serve\n{printed.read_text()}"
            )
            time.sleep(0.02)

    def _free(self, port: str) -> str:
        """Return a free port, always the same one for a port of the document."""
        if port not in self.ports:
            with socket.create_server(("127.0.0.1", 0)) as server:
                self.ports[port] = str(server.getsockname()[1])
        return self.ports[port]
