"""Follow a Markdown document block by block, and compare the output with the document.

- A file block (``markdown_blocks.Block``) is written, or appended to an existing file.
- A ``console`` block has commands after ``$ ``, continued after a backslash, each followed by its output.
  ``…`` matches any number of lines, or any text within a line. A command must exit with 0 unless it says
  ``# exit status N``.
- A ``python`` block runs as a script. The comment after a ``print`` is the line that it prints.
- Other blocks are errors, so that no block is forgotten.

Each command starts with the working folder and the environment that the command before it left, as in a
terminal. Progress lines (``... ``) are not compared, since they appear only on slow machines.
"""

from __future__ import annotations

import difflib
import os
import re
import shlex
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

from markdown_blocks import Block, said

ANY = "…"

_COMMAND = re.compile(r"^\$ (.*(?:(?<=\\)\n.*)*)\n((?:(?!\$ ).*\n)*)", re.M)
_STATUS = re.compile(r"# exit status (\d+)")
_PROGRESS = re.compile(r"^\.\.\. .*\n", re.M)


class Walk:
    """A walk through a document.

    :param folder: working folder of the first command.
    :param environment: variables to add to the environment of the tests.
    """

    def __init__(self, folder: Path, environment: Mapping[str, str] | None = None) -> None:
        scripts = str(Path(sys.executable).parent)
        self.folder = folder
        self.environment = {
            **os.environ,
            "PATH": os.pathsep.join([scripts, os.environ.get("PATH", os.defpath)]),
            "COLUMNS": "110",
            "LC_ALL": "C.UTF-8",
            "NO_COLOR": "1",
            "PYTHONUTF8": "1",
            **(environment or {}),
        }
        self._state = folder.parent / f"{folder.name}.state"
        self._state.mkdir()

    def follow(self, block: Block) -> None:
        """Follow a block; fail the test if the result differs from the document."""
        if block.path is not None:
            self._write(block)
        elif block.language == "console":
            assert block.text.startswith("$ "), f"line {block.line}: no command after $"
            for command, shown in _COMMAND.findall(block.text):
                status = _STATUS.search(command)
                self._compare(block, command, shown, status=int(status[1]) if status else 0)
        elif block.language == "python":
            script = self._state / "block.py"
            script.write_text(block.text, encoding="utf-8")
            shown = "".join(f"{line}\n" for line in said(block))
            self._compare(block, f"python {shlex.quote(str(script))}", shown)
        else:
            raise AssertionError(
                f"line {block.line}: unsupported block language {block.language!r}"
            )

    def _write(self, block: Block) -> None:
        path = self.folder / str(block.path)
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("a" if block.added else "w", encoding="utf-8", newline="\n") as file:
            file.write(block.text)

    def _run(self, command: str) -> tuple[int, str]:
        """Run a command in the state that the last one left; return its exit status and output."""
        place, variables = self._state / "place", self._state / "variables"
        keep = f"pwd -P > {shlex.quote(str(place))}; env -0 > {shlex.quote(str(variables))}"
        done = subprocess.run(
            ["bash", "-c", f"{command}\nstatus=$?; {keep}; exit $status"],
            cwd=self.folder,
            env=self.environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            encoding="utf-8",
            timeout=300,
            check=False,
        )
        self.folder = Path(place.read_text(encoding="utf-8").rstrip("\n"))
        kept = variables.read_text(encoding="utf-8").split("\0")
        self.environment = dict(entry.split("=", 1) for entry in kept if entry)
        return done.returncode, done.stdout

    def _compare(self, block: Block, command: str, shown: str, status: int = 0) -> None:
        code, printed = self._run(command)
        where = f"line {block.line}: {command}"
        assert code == status, f"{where}\nexited with status {code}, not {status}\n{printed}"
        happens = _PROGRESS.sub("", "".join(f"{line.rstrip()}\n" for line in printed.splitlines()))
        if not re.fullmatch(_pattern(shown), happens):
            both = (shown.splitlines(), happens.splitlines(), "the document", "the output")
            diff = "\n".join(difflib.unified_diff(*both, lineterm=""))
            raise AssertionError(f"{where}\n{diff}")


def _pattern(shown: str) -> str:
    """Return the regular expression for the output shown, ignoring blanks at the ends of lines."""
    lines = (line.rstrip() for line in shown.splitlines())
    return "".join(
        r"(?:.*\n)*?" if line == ANY else re.escape(line).replace(ANY, ".*?") + "\n"
        for line in lines
    )
