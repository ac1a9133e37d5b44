"""Checks that every generated file must pass, for any spec."""

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
_DATA = "/testing/examples.c"  # examples are text in the spec, but bytes and numbers in this file
_IN_TEXTS = {tokenize.STRING, tokenize.COMMENT}
_HIDDEN = {"Cc", "Cf", "Cs", "Zl", "Zp"}


def faults(files: dict[str, str], known: dict[str, str]) -> Iterator[str]:
    """Yield the problems of rendered files.

    :param known: files without problems; equal files are not checked again.
    """
    if len({path.casefold() for path in files}) < len(files):
        yield "paths that differ only in case"
    for path, text in files.items():
        if not _PATH.match(path) or any(_DEVICE.match(part) for part in path.split("/")):
            yield f"{path!r} is not a portable path"
        if known.get(path) == text:
            continue
        hidden = {char for char in set(text) if unicodedata.category(char) in _HIDDEN} - {"\n"}
        if hidden:
            yield f"{path}: contains hidden characters {hidden}"
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
            yield f"{token.string!r} in line {token.start[0]} is outside strings and comments"


def is_code(path: str) -> bool:
    """Return whether texts may change only the comments and strings of a file."""
    return path.endswith((".py", ".c", ".h")) and not path.endswith(_DATA)


def blanked(path: str, source: str) -> str:
    """Return the syntax of a Python or C file without the content of its strings."""
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
    """Yield every text of a JSON value with its path."""
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
    """Run ruff with the project's settings; return its findings."""
    config = ["--config", str(ROOT / "pyproject.toml"), "--no-cache"]
    command = [sys.executable, "-m", "ruff", *arguments, *config]
    result = subprocess.run(command, capture_output=True, check=False)
    found = result.stdout.decode("utf-8") + result.stderr.decode("utf-8")
    return "" if result.returncode == 0 else found or f"ruff exited with status {result.returncode}"


def run_packages(folders: list[Path], workplace: Path) -> dict[str, str]:
    """Import each package in one separate process, and encode and decode its messages.

    Returns the problems by folder. ``workplace`` is the working folder, in which executed payloads leave a
    file.
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
    assert left == [], f"a payload was executed and left {left}"
    found: dict[str, str] = json.loads(result.stdout)
    return found
