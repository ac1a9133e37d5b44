"""Does what a Markdown document tells its reader to do, block by block, and compares what it shows.

- A block that is a file (``fenced.Block``) is written, or added to the end of the file that is there.
- A block of ``console`` has commands after ``$ ``, continued after a backslash, and below each what it
  prints. ``…`` stands for any number of lines, or for any text within a line. A command ends with 0 unless
  it says ``# exit status N``.
- A block of ``python`` runs by itself; a comment behind a ``print`` is the line that it prints.
- Whatever else has a language is only to be read: the test has to name it, so that no block is forgotten.

Where a command leaves the folder and the environment, the next one goes on, as in a terminal. Lines of
progress (``... ``) are not compared, since they come on slow machines only.
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
    """A reader who follows a document in a folder.

    :param folder: where he begins.
    :param environment: what his commands find in their environment besides that of the tests.
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
        """Do what a block says; fails the test where something else is shown than happens."""
        if block.path is not None:
            self._write(block)
        elif block.language == "console":
            assert block.text.startswith("$ "), f"line {block.line}: no command"
            for command, shown in _COMMAND.findall(block.text):
                status = _STATUS.search(command)
                self._compare(block, command, shown, status=int(status[1]) if status else 0)
        elif block.language == "python":
            script = self._state / "block.py"
            script.write_text(block.text, encoding="utf-8")
            shown = "".join(f"{line}\n" for line in said(block))
            self._compare(block, f"python {shlex.quote(str(script))}", shown)
        else:
            raise AssertionError(f"line {block.line}: nothing runs a block of {block.language!r}")

    def _write(self, block: Block) -> None:
        path = self.folder / str(block.path)
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("a" if block.added else "w", encoding="utf-8", newline="\n") as file:
            file.write(block.text)

    def _run(self, command: str) -> tuple[int, str]:
        """Run a command where the last one left off; return how it ends, and what it prints."""
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
        assert code == status, f"{where}\nends with {code}, not {status}\n{printed}"
        happens = _PROGRESS.sub("", "".join(f"{line.rstrip()}\n" for line in printed.splitlines()))
        if not re.fullmatch(_pattern(shown), happens):
            both = (shown.splitlines(), happens.splitlines(), "the document", "what happens")
            diff = "\n".join(difflib.unified_diff(*both, lineterm=""))
            raise AssertionError(f"{where}\n{diff}")


def _pattern(shown: str) -> str:
    """Return the expression for what is shown; blanks at the end of lines do not count."""
    lines = (line.rstrip() for line in shown.splitlines())
    return "".join(
        r"(?:.*\n)*?" if line == ANY else re.escape(line).replace(ANY, ".*?") + "\n"
        for line in lines
    )
