"""Compare rendered files with an output folder, or write them there.

``manifest.json`` in the folder lists every generated file and its digest; a file that is not in
it was made by somebody else and is neither overwritten nor deleted. The folder may come from anybody:
its manifest cannot point out of it, and no link in it is followed.
"""

from __future__ import annotations

import contextlib
import difflib
import hashlib
import json
import re
import stat
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from stagewire_generator.files import replace
from stagewire_generator.targets.templates import canonical

MANIFEST = "manifest.json"


def digest(text: str) -> str:
    """Return the SHA-256 of a text as it is written."""
    return hashlib.sha256(text.encode("utf-8")).hexdigest()


def manifest(digests: Mapping[str, str]) -> str:
    """Return the manifest of files by path -> digest; it does not list itself."""
    return canonical({"schema_version": 2, "files": dict(digests)})


_DIFF_LINES = 40
_MODE = 0o644  # of what is generated, whoever generates it
_IGNORED = frozenset({"__pycache__"})
_DIGEST = re.compile(r"[0-9a-f]{64}\Z")


class OutputError(Exception):
    """The output folder cannot be written without losing what somebody else made."""


@dataclass(frozen=True, slots=True)
class Change:
    """A file that is not as it would be generated."""

    path: str
    kind: str  # changed | missing | orphaned
    diff: str = ""


def compare(out: Path, files: Mapping[str, str]) -> list[Change]:
    """Compare the whole tree with ``files``; nothing is written."""
    changes = []
    for path, text in files.items():
        target = _inside(out, path)
        if obstacle := _obstacle(out, path):
            changes.append(Change(path, "changed", f"--- {path}\n({obstacle} is in its place)"))
            continue
        try:
            current = target.read_bytes()
        except OSError:
            changes.append(Change(path, "missing"))
            continue
        if current != text.encode("utf-8"):
            changes.append(Change(path, "changed", _diff(path, current, text)))
    for path in _present(out):
        if path not in files:
            changes.append(Change(path, "orphaned"))
    return sorted(changes, key=lambda change: change.path)


def write(out: Path, files: Mapping[str, str], *, partial: bool = False) -> list[str]:
    """Write what differs and delete what is no longer generated; return the paths touched.

    :param partial: ``files`` are some targets only; what else stands in the folder is left alone, and
        the manifest keeps its entries.
    Raises :class:`OutputError`, before anything is written, when that would overwrite a file that the
    generator did not make, or delete one that it did not make or that was edited since. A file of its
    own that was edited is made anew: :func:`compare` shows the edits beforehand.
    """
    known = _listed(out)
    if partial:
        made = {path: digest(text) for path, text in files.items()}
        files = {**files, MANIFEST: manifest({**known, **made})}
    targets = {path: _inside(out, path) for path in files}
    foreign = [f"{path} ({what})" for path in files if (what := _obstacle(out, path))]
    needed = {parent.as_posix() for path in files for parent in PurePosixPath(path).parents}
    stale = []
    for path in _present(out):
        current = hashlib.sha256((out / path).read_bytes()).hexdigest()
        ours = known.get(path) == current or (path == MANIFEST and bool(known))
        if path not in files:
            if partial and path not in needed:
                continue
            if ours:
                stale.append(path)
            elif path in known:
                foreign.append(f"{path} (edited by hand, and no longer generated)")
            elif path in needed:
                foreign.append(f"{path} (a file where a folder belongs)")
            continue
        if not ours and path not in known and current != digest(files[path]):
            foreign.append(f"{path} (not made by the generator)")
    if foreign:
        listed = "\n  ".join(foreign)
        raise OutputError(
            f"nothing was written: {out} holds files that the generator did not make:\n  {listed}\n"
            "move them away, or choose another folder"
        )
    touched = []
    for path in stale:
        (out / path).unlink()
        touched.append(path)
        _prune(out, (out / path).parent)
    for path in sorted(files, key=lambda path: path == MANIFEST):  # it says what is done: last
        target, data = targets[path], files[path].encode("utf-8")
        if not target.is_file() or target.read_bytes() != data:
            target.parent.mkdir(parents=True, exist_ok=True)
            replace(target, data, _MODE)
            touched.append(path)
    return sorted(touched)


def _leaves(path: str) -> bool:
    """Whether a path would leave the folder, on any system."""
    parts = PurePosixPath(path).parts
    return not parts or path.startswith("/") or ".." in parts or "\\" in path or ":" in path


def _inside(out: Path, path: str) -> Path:
    if _leaves(path):
        raise OutputError(f"{path!r} would leave the output folder")
    return out / path


def _obstacle(out: Path, path: str) -> str:
    """Return what other than a file, or nothing, is in the place of a file; empty if it is none.

    What is written through a link, or read from a pipe, is outside the folder.
    """
    target = out
    for part in PurePosixPath(path).parts:
        target /= part
        if target.is_symlink():
            return f"the link {target.relative_to(out).as_posix()}"
    try:
        mode = target.stat().st_mode
    except OSError:
        return ""
    return "a folder" if stat.S_ISDIR(mode) else "" if stat.S_ISREG(mode) else "no regular file"


def _present(out: Path) -> list[str]:
    if not out.is_dir():
        return []
    return sorted(
        path.relative_to(out).as_posix()
        for path in out.rglob("*")
        if path.is_file()
        and not path.is_symlink()
        and not _IGNORED & set(path.relative_to(out).parts)
    )


def _listed(out: Path) -> dict[str, str]:
    """Return what the manifest in the folder lists; of one that cannot be read, nothing."""
    if _obstacle(out, MANIFEST):
        return {}
    with contextlib.suppress(OSError, ValueError, RecursionError):
        loaded = json.loads((out / MANIFEST).read_text(encoding="utf-8"))
        files = loaded.get("files") if isinstance(loaded, dict) else None
        if isinstance(files, dict):
            return {
                path: sha
                for path, sha in files.items()
                if not _leaves(path)
                and path.isprintable()
                and isinstance(sha, str)
                and _DIGEST.match(sha)
            }
    return {}


def _prune(out: Path, folder: Path) -> None:
    while folder != out:
        try:
            folder.rmdir()
        except OSError:
            return
        folder = folder.parent


def _diff(path: str, current: bytes, text: str) -> str:
    old = current.decode("utf-8", "replace").splitlines()
    lines = list(
        difflib.unified_diff(old, text.splitlines(), path, f"{path} (generated)", lineterm="")
    )
    if not lines:
        return f"--- {path}\n(only line ends differ)"
    if len(lines) > _DIFF_LINES:
        rest = len(lines) - _DIFF_LINES
        lines = [*lines[:_DIFF_LINES], f"... {rest} more lines of difference"]
    return "\n".join(lines)
