"""Git repositories with a small spec, and edits of the spec."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest

from checkout import SMALL_SPECS

GOOD = SMALL_SPECS / "good_spec"

Edit = tuple[str, str, str]
"""A file of the protocol, with its old and new text."""


def edit(spec: Path, file: str, old: str, new: str) -> None:
    path = spec / "tiny" / file
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new), encoding="utf-8")


def git(*arguments: str) -> None:
    """Run git in the current folder, without user settings; submodules may be local files."""
    who = ("-c", "user.name=Somebody", "-c", "user.email=somebody@example.org")
    more = ("-c", "protocol.file.allow=always")
    subprocess.run(["git", *who, *more, *arguments], check=True, capture_output=True)


def commit() -> None:
    git("add", "--all")
    git("commit", "--quiet", "--message", "a change")


def make_repository(top: Path, good: Path, change: Edit, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Make a repository with two commits, a good spec and a change of it, and change into it."""
    for name in [name for name in os.environ if name.startswith("GIT_")]:
        monkeypatch.delenv(name)
    monkeypatch.setenv("GIT_CONFIG_GLOBAL", os.devnull)
    monkeypatch.setenv("GIT_CEILING_DIRECTORIES", str(top.parents[1]))
    shutil.copytree(good / "tiny", top / "spec" / "tiny")
    monkeypatch.chdir(top)
    git("init", "--quiet")
    commit()
    edit(top / "spec", *change)
    commit()
    return top
