"""User input for ``stagewire diff``: two specs, as folders and as revisions of a repository."""

from __future__ import annotations

import atexit
import json
import os
import shutil
import subprocess
import tempfile
from functools import cache
from pathlib import Path
from random import Random

from malformed_text import word
from sandbox import Case, Content, Ran
from spec_cases import FILES, damaged_texts, damaged_trees, good

_REVISIONS = (
    "HEAD", "HEAD~1", "HEAD:spec", "HEAD:spec/tiny", "HEAD~1:spec", "main", "HEAD~9", "HEAD:", ":spec",
    "HEAD:../spec", "HEAD:/etc", ":/first", "@{u}", "HEAD^{tree}", "HEAD:spec/tiny/units.yaml", "HEAD..main",
    "-x", "--output=precious", "--exec=id", "--help", "0" * 40, "refs/heads/main", "HEAD@{0}", "", " ",
)  # fmt: skip


def diff(rng: Random) -> Case:
    """A good spec and a damaged one, as folders and as revisions."""
    changed = {**FILES, **(damaged_trees(rng) if rng.random() < 0.8 else damaged_texts(rng))}
    files: dict[str, Content] = {f"new/{name}": content for name, content in changed.items()}
    sides = ["spec", "new"]
    if rng.random() < 0.25:
        repository = _repository() / ".git"
        files[".git"] = f"gitdir: {repository}\n".encode()
        sides[rng.randrange(2)] = rng.choice(_REVISIONS)
    elif rng.random() < 0.1:
        sides[rng.randrange(2)] = word(rng).replace("\0", "").encode("utf-8", "replace").decode()
    if rng.random() < 0.3:
        sides.reverse()
    options = ["--json"] * (rng.random() < 0.4)
    if rng.random() < 0.3:
        options += ["--fail-on", rng.choice(("wire", "source", "doc", "WIRE", "all"))]
    if rng.random() < 0.05:
        options += ["--spec", rng.choice(("spec", "spec/tiny", "..", "", "-x", "a" * 300))]
    arguments = ("diff", *options, "--", *sides)
    return Case(arguments, files=files, base=good(), may_start=("git",), holds=_compared)


def _compared(case: Case, ran: Ran) -> None:
    """Check that a completed comparison with ``--json`` prints one JSON object."""
    if "--json" in case.arguments and ran.code != 2:
        json.loads(ran.out)


@cache
def _repository() -> Path:
    """Return a git repository with two revisions of the good spec, removed when the process ends."""
    folder = Path(tempfile.mkdtemp())
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    shutil.copytree(good(), folder / "spec")
    git = ["git", "-c", "user.name=nobody", "-c", "user.email=nobody@example.org"]
    # Ignore the user's settings. In a Git hook, GIT_DIR is the repository that is being committed to.
    environment = {key: value for key, value in os.environ.items() if not key.startswith("GIT_")}
    environment |= {"GIT_CONFIG_GLOBAL": os.devnull, "GIT_CONFIG_SYSTEM": os.devnull}
    units = folder / "spec" / "tiny" / "units.yaml"
    for arguments in (
        ["init", "--quiet", "--initial-branch=main"],
        ["add", "spec"],
        ["commit", "--quiet", "--message=first"],
        ["commit", "--quiet", "--all", "--message=second"],
    ):
        subprocess.run([*git, *arguments], cwd=folder, env=environment, check=True)
        if arguments[-1] == "--message=first":
            units.write_bytes(units.read_bytes() + b"# a comment\n")
    return folder
