"""What must hold of anything that is generated, whatever the spec says."""

from __future__ import annotations

import ast
import io
import json
import re
import subprocess
import sys
import tokenize
import unicodedata
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from c_tokens import blanked_c, faults_of_c
from payloads import SENTINEL

from files import write_files

ROOT = Path(__file__).parents[2]
PROGRAM = Path(__file__).with_name("run_packages.py")

_PATH = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]*(/[A-Za-z0-9_][A-Za-z0-9_.-]*)*\Z")
_DEVICE = re.compile(r"(con|prn|aux|nul|com[0-9]|lpt[0-9])(\.|\Z)", re.IGNORECASE)
_DATA = "/testing/examples.c"  # what somebody types in an example is bytes there, and numbers in C
_IN_TEXTS = {tokenize.STRING, tokenize.COMMENT}
_HIDDEN = {"Cc", "Cf", "Cs", "Zl", "Zp"}


def faults(files: dict[str, str], known: dict[str, str]) -> Iterator[str]:
    """Yield what is wrong with rendered files.

    :param known: files that are known to be right; what is equal to them is not looked at again.
    """
    if len({path.casefold() for path in files}) < len(files):
        yield "paths that differ in case only"
    for path, text in files.items():
        if not _PATH.match(path) or any(_DEVICE.match(part) for part in path.split("/")):
            yield f"{path!r} is no portable path"
        if known.get(path) == text:
            continue
        hidden = {char for char in set(text) if unicodedata.category(char) in _HIDDEN} - {"\n"}
        if hidden:
            yield f"{path}: holds {hidden}"
        try:
            if path.endswith(".py"):
                yield from (f"{path}: {fault}" for fault in _faults_of_source(text))
            elif path.endswith((".c", ".h")):
                yield from (f"{path}: {fault}" for fault in faults_of_c(text, SENTINEL))
            elif path.endswith(".json"):
                json.loads(text)
        except (SyntaxError, ValueError, tokenize.TokenError) as error:
            yield f"{path}: {error}"


def _faults_of_source(text: str) -> Iterator[str]:
    ast.parse(text)
    if text.isascii() and SENTINEL not in text:
        return
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type not in _IN_TEXTS and (not token.string.isascii() or SENTINEL in token.string):
            yield f"{token.string!r} in line {token.start[0]} is neither text nor comment"


def is_code(path: str) -> bool:
    """Whether a file must be the same, but for comments and strings, whatever the texts are."""
    return path.endswith((".py", ".c", ".h")) and not path.endswith(_DATA)


def blanked(path: str, source: str) -> str:
    """Return the syntax of a file of Python or C without the contents of its strings."""
    if not path.endswith(".py"):
        return " ".join(blanked_c(source))
    tree = ast.parse(source)
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            node.value = ""
    return ast.dump(tree)


def strings(
    data: Any, path: tuple[str | int, ...] = ()
) -> Iterator[tuple[tuple[str | int, ...], str]]:
    """Yield every text of a JSON value, and its path."""
    if isinstance(data, str):
        yield path, data
    elif isinstance(data, dict):
        for key, value in data.items():
            yield from strings(value, (*path, key))
    elif isinstance(data, list):
        for index, value in enumerate(data):
            yield from strings(value, (*path, index))


def write_tree(files: dict[str, str], out: Path) -> Path:
    write_files(out, files)
    return out


def ruff(*arguments: str) -> str:
    """Run ruff with the project's settings; return what it finds."""
    config = ["--config", str(ROOT / "pyproject.toml"), "--no-cache"]
    command = [sys.executable, "-m", "ruff", *arguments, *config]
    result = subprocess.run(command, capture_output=True, check=False)
    found = result.stdout.decode("utf-8") + result.stderr.decode("utf-8")
    return "" if result.returncode == 0 else found or f"ruff ended with {result.returncode}"


def run_packages(folders: list[Path], workplace: Path) -> dict[str, str]:
    """Import each package in a process of its own for all, and let its messages go round.

    Returns what went wrong, by folder. ``workplace`` is the working folder; whatever code comes to
    life there leaves a file.
    """
    workplace.mkdir(parents=True, exist_ok=True)
    listed = "\n".join(str(folder / "python") for folder in folders)
    command = [sys.executable, "-W", "error", str(PROGRAM)]
    result = subprocess.run(
        command, input=listed, capture_output=True, check=False, cwd=workplace, encoding="utf-8"
    )
    assert result.returncode == 0, result.stderr
    assert result.stderr == ""
    left = [path.name for path in workplace.iterdir()]
    assert left == [], f"something ran and left {left}"
    found: dict[str, str] = json.loads(result.stdout)
    return found
