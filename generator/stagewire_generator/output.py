"""Compare what was rendered with an output folder, or write it there.

``manifest.json`` in the folder lists every file that the generator made and its digest; whatever is not in
it was made by somebody else and is neither overwritten nor deleted.
"""

from __future__ import annotations

import contextlib
import difflib
import hashlib
import json
import os
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from stagewire_generator.manifest import MANIFEST, digest, render

__all__ = ["Change", "OutputError", "compare", "write"]

_DIFF_LINES = 40
_IGNORED = frozenset({"__pycache__"})


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
        files = {**files, MANIFEST: render({**known, **made})}
    targets = {path: _inside(out, path) for path in files}
    foreign = [f"{path} (a folder)" for path, target in targets.items() if target.is_dir()]
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
            "move them away, or choose another folder with --out"
        )
    touched = []
    for path in stale:
        (out / path).unlink()
        touched.append(path)
        _prune(out, (out / path).parent)
    for path in sorted(files, key=lambda path: path == MANIFEST):  # it says what is done: last
        target, data = targets[path], files[path].encode("utf-8")
        if not target.is_file() or target.read_bytes() != data:
            _replace(target, data)
            touched.append(path)
    return sorted(touched)


def _inside(out: Path, path: str) -> Path:
    parts = PurePosixPath(path).parts
    if not parts or path.startswith("/") or ".." in parts or "\\" in path or ":" in path:
        raise OutputError(f"{path!r} would leave the output folder")
    return out.joinpath(*parts)


def _present(out: Path) -> list[str]:
    if not out.is_dir():
        return []
    return sorted(
        path.relative_to(out).as_posix()
        for path in out.rglob("*")
        if path.is_file() and not _IGNORED & set(path.relative_to(out).parts)
    )


def _listed(out: Path) -> dict[str, str]:
    """Return what the manifest in the folder lists; of one that cannot be read, nothing."""
    with contextlib.suppress(OSError, ValueError):
        loaded = json.loads((out / MANIFEST).read_text(encoding="utf-8"))
        files = loaded.get("files") if isinstance(loaded, dict) else None
        if isinstance(files, dict):
            return {str(path): str(sha) for path, sha in files.items()}
    return {}


def _replace(target: Path, data: bytes) -> None:
    """Write to a temporary file beside ``target`` and rename it, so that nothing is half-written."""
    target.parent.mkdir(parents=True, exist_ok=True)
    descriptor, name = tempfile.mkstemp(dir=target.parent, prefix=f".{target.name}.")
    try:
        with os.fdopen(descriptor, "wb") as file:
            file.write(data)
        os.chmod(name, 0o644)
        os.replace(name, target)
    except BaseException:
        with contextlib.suppress(OSError):
            os.unlink(name)
        raise


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
