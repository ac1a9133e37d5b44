"""Read a spec from a revision in a git repository.

Nothing is checked out: the files are copied byte for byte from the object store into a temporary directory.
Only files that the pipeline reads are copied: the spec, and worked examples and captures in the places of
0.1.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import tempfile
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path, PurePosixPath

from stagewire_generator.diagnostics import Diagnostic, Place
from stagewire_generator.reader import OF_WIRE, OLD_FOLDER, find_spec

_REVISION = re.compile(r"((?:[^:{}]|\{[^{}]*\})+)(?::(.*))?", re.DOTALL)  # HEAD@{12:30}:path
_LINKS = {"120000": "a symbolic link", "160000": "a submodule"}  # by file mode in git
_HEAD = 200  # enough bytes for the line before a file's contents: id, kind, size
_DEPTH = ("in", "side")  # directories above the extracted ones: the reader looks next to the spec


class RevisionError(Exception):
    """The spec of a revision cannot be read; the text is a message for the user."""


@dataclass(frozen=True, slots=True)
class Revision:
    """The spec of a revision while it is extracted."""

    name: str  # as the user wrote it, without a path
    spec: Path
    top: Path  # the directory that represents the top of the repository

    def named(self, diagnostic: Diagnostic) -> Diagnostic:
        """Return a diagnostic with its file as ``REVISION:path``."""
        place = diagnostic.place
        found = find_spec(self.spec).locate(place.file)
        if not found.is_relative_to(self.top):
            return diagnostic
        path = found.relative_to(self.top).as_posix()
        return replace(diagnostic, place=Place(f"{self.name}:{path}", place.line, place.column))


@contextmanager
def revision(name: str, spec: str = "spec") -> Iterator[Revision]:
    """Extract the spec of a revision in the repository of the current directory.

    :param name: a revision. ``REVISION:path`` names another directory, as in git: relative to the top of the
        repository, or to the current directory if it begins with ``./`` or ``../``.
    :param spec: the directory of the spec, relative to the current one.
    Raises :class:`RevisionError` if the revision or directory does not exist, or if it contains anything that
    cannot be extracted safely: symbolic links, submodules, or paths that lead out of the directory.
    """
    match = _REVISION.fullmatch(name)
    if match is None or name.startswith("-") or not name.isprintable():
        raise RevisionError(f"{name!r} is not a revision")
    rev, path = match.groups()
    if path is None:
        path = spec if os.path.isabs(spec) else f"./{spec}"
    top, prefix = _repository()
    if os.path.isabs(path):
        path = os.path.relpath(os.path.realpath(path), os.path.realpath(top)) if top else path
    elif path.startswith(("./", "../")) or path in (".", ".."):
        path = f"{prefix}{path}"
    folder = PurePosixPath(os.path.normpath(path or ".").replace(os.sep, "/"))
    if folder.is_absolute() or ".." in folder.parts:
        raise RevisionError(f"{path} is outside the repository")
    commit = _git("rev-parse", "--verify", "--quiet", "--end-of-options", f"{rev}^{{commit}}")
    if commit is None:
        shallow = (_git("rev-parse", "--is-shallow-repository") or b"").strip() == b"true"
        why = "; this clone is shallow: fetch the revision, or the whole history" if shallow else ""
        raise RevisionError(f"the repository has no revision {rev}{why}")
    sha = commit.decode("ascii").strip()
    with tempfile.TemporaryDirectory(prefix="stagewire-") as temporary:
        root = Path(temporary, *_DEPTH).resolve()
        root.mkdir(parents=True)
        _extract(sha, rev, folder, root)
        with warnings.catch_warnings():  # files of an old revision cannot be moved
            warnings.simplefilter("ignore", FutureWarning)
            yield Revision(rev, root / folder, root)


def _repository() -> tuple[str, str]:
    """Return the top directory ("" in a bare repository) and the path from there to the current one."""
    if shutil.which("git") is None:
        raise RevisionError("reading a revision requires git, which is not installed")
    found = _run("rev-parse", "--git-dir")
    if found.returncode:
        said = found.stderr.decode("utf-8", "replace").partition("\n")[0].strip()
        raise RevisionError(f"the current directory is not in a git repository ({said})")
    prefix = _git("rev-parse", "--show-prefix") or b""
    top = _git("rev-parse", "--show-toplevel") or b""
    return os.fsdecode(top).rstrip("\n"), os.fsdecode(prefix).rstrip("\n")


def _extract(sha: str, rev: str, folder: PurePosixPath, root: Path) -> None:
    """Write the files that the pipeline reads: those in ``folder``, and those of 0.1 next to it."""
    parents = list(folder.parents)[:2]  # of the spec, or of a single protocol
    wanted = [folder, *(parent / OLD_FOLDER / kind for parent in parents for kind in OF_WIRE)]
    files: dict[PurePosixPath, str] = {}
    exists = False
    for mode, id, name in _listed(sha):
        path = PurePosixPath(name)
        inside = any(path.is_relative_to(room) for room in wanted)
        if mode in _LINKS and (inside or any(room.is_relative_to(path) for room in wanted)):
            raise RevisionError(f"{rev}:{name} is {_LINKS[mode]}; a spec must consist of files")
        if not inside:
            continue
        if {"", ".", ".."} & set(name.split("/")) or "\\" in name or ":" in name:
            raise RevisionError(f"{rev}:{name!r} leads out of the directory")
        exists = exists or folder in path.parents
        if path.suffix == ".yaml":
            files[path] = id
    if not exists:
        raise RevisionError(f"the revision {rev} has no directory {folder}")
    (root / folder).mkdir(parents=True, exist_ok=True)
    for path, data in zip(files, _blobs(list(files.values())), strict=True):
        target = root / path
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(data)


def _listed(sha: str) -> Iterator[tuple[str, str, str]]:
    """Yield mode, id and path of each file in a commit."""
    for line in (_git("ls-tree", "-r", "-z", "--full-tree", sha) or b"").split(b"\0")[:-1]:
        facts, _, name = line.partition(b"\t")
        mode, _, id = facts.decode("ascii").split(" ")
        yield mode, id, os.fsdecode(name)


def _blobs(ids: Sequence[str]) -> Iterator[bytes]:
    """Yield the contents of files, in the order of their ids."""
    asked = "".join(f"{id}\n" for id in ids).encode("ascii")
    output = _git("cat-file", "--batch", input=asked) or b""
    at = 0
    for id in ids:
        head = output[at : at + _HEAD].partition(b"\n")[0]
        words = head.decode("ascii", "replace").split(" ")
        if words[1:2] != ["blob"]:
            raise RevisionError(f"the object {id} is missing from the repository")
        start = at + len(head) + 1
        end = start + int(words[2])
        yield output[start:end]
        at = end + 1


def _git(*arguments: str, input: bytes = b"") -> bytes | None:
    """Return the output of git, or None if it fails."""
    done = _run(*arguments, input=input)
    return done.stdout if done.returncode == 0 else None


def _run(*arguments: str, input: bytes = b"") -> subprocess.CompletedProcess[bytes]:
    quiet = {"GIT_OPTIONAL_LOCKS": "0", "GIT_TERMINAL_PROMPT": "0", "LC_ALL": "C"}
    try:
        return subprocess.run(
            ["git", "--no-pager", *arguments],
            input=input,
            capture_output=True,
            check=False,
            env={**os.environ, **quiet},
        )
    except OSError as error:
        raise RevisionError(f"cannot run git: {error.strerror}") from None
