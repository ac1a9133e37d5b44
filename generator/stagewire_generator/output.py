"""Compare rendered files with an output directory, or write them to it.

``manifest.json`` in the directory lists every generated file and its digest. A file that is not listed is
never overwritten or deleted. The directory is not trusted: its manifest cannot point outside it, and links
are not followed.
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
    """Return the SHA-256 digest of a text, encoded as it is written to a file."""
    return hashlib.sha256(text.encode("utf-8")).hexdigest()


def manifest(digests: Mapping[str, str]) -> str:
    """Return the manifest for path -> digest; it does not list itself."""
    return canonical({"schema_version": 2, "files": dict(digests)})


_DIFF_LINES = 40
_MODE = 0o644  # permissions of generated files, whatever the umask
_IGNORED = frozenset({"__pycache__"})
_DIGEST = re.compile(r"[0-9a-f]{64}\Z")


class OutputError(Exception):
    """Writing the output directory would overwrite or delete files that the generator did not create."""


@dataclass(frozen=True, slots=True)
class Change:
    """A file that differs from what would be generated."""

    path: str
    kind: str  # changed | missing | orphaned
    diff: str = ""


def compare(out: Path, files: Mapping[str, str]) -> list[Change]:
    """Compare the whole tree with ``files`` without writing anything."""
    changes = []
    for path, text in files.items():
        target = _inside(out, path)
        if obstacle := _obstacle(out, path):
            changes.append(Change(path, "changed", f"--- {path}\n({obstacle} is in the way)"))
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
    """Write the files that differ, delete those no longer generated, and return the changed paths.

    :param partial: ``files`` belong to some targets only. Other files in the directory are left alone, and
        the manifest keeps its entries.
    Raises :class:`OutputError`, before anything is written, if that would overwrite a file that the generator
    did not create, or delete a file that it did not create or that was edited since. A generated file that
    was edited is overwritten: :func:`compare` shows the edits beforehand.
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
        of_ours = path == MANIFEST and bool(known)
        if path in files and (of_ours or path in known):
            continue  # it may be overwritten, even if it was edited
        current = hashlib.sha256((out / path).read_bytes()).hexdigest()
        if path in files:
            if current != digest(files[path]):
                foreign.append(f"{path} (not created by the generator)")
        elif partial and path not in needed:
            continue
        elif of_ours or known.get(path) == current:
            stale.append(path)
        elif path in known:
            foreign.append(f"{path} (edited by hand, and no longer generated)")
        elif path in needed:
            foreign.append(f"{path} (a file where a directory is needed)")
    if foreign:
        listed = "\n  ".join(foreign)
        raise OutputError(
            f"nothing was written: {out} contains files that the generator did not create:\n  {listed}\n"
            "move them away, or choose another directory"
        )
    touched = []
    for path in stale:
        (out / path).unlink()
        touched.append(path)
        _prune(out, (out / path).parent)
    for path in sorted(files, key=lambda path: path == MANIFEST):  # last: it lists finished files
        target, data = targets[path], files[path].encode("utf-8")
        if not target.is_file() or target.read_bytes() != data:
            target.parent.mkdir(parents=True, exist_ok=True)
            replace(target, data, _MODE)
            touched.append(path)
    return sorted(touched)


def _leaves(path: str) -> bool:
    """Whether a path would leave the directory, on any system."""
    parts = PurePosixPath(path).parts
    return not parts or path.startswith("/") or ".." in parts or "\\" in path or ":" in path


def _inside(out: Path, path: str) -> Path:
    if _leaves(path):
        raise OutputError(f"{path!r} is outside the output directory")
    return out / path


def _obstacle(out: Path, path: str) -> str:
    """Return what prevents writing a regular file at a path, or an empty text.

    Writing through a link, or reading from a pipe, would reach outside the directory.
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
    return "a directory" if stat.S_ISDIR(mode) else "" if stat.S_ISREG(mode) else "a special file"


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
    """Return the entries of the manifest in the directory; none if it cannot be read."""
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
        return f"--- {path}\n(only line endings differ)"
    if len(lines) > _DIFF_LINES:
        rest = len(lines) - _DIFF_LINES
        lines = [*lines[:_DIFF_LINES], f"... {rest} more diff lines"]
    return "\n".join(lines)
