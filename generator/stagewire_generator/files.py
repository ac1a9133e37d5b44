"""Read untrusted files, write files atomically, and find misplaced files of a spec."""

from __future__ import annotations

import contextlib
import os
import re
import stat
import tempfile
from collections.abc import Collection, Iterator
from pathlib import Path

_LARGEST = 1 << 20  # bytes in a file; the largest known file has a tenth of that
_NO_WAITING = getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)  # a system has one of them


class NotReadError(Exception):
    """A file cannot be read safely; the text states why."""


def content(path: Path) -> bytes:
    """Return the bytes of a regular file, without blocking on a pipe.

    Raises :class:`NotReadError` for anything but a regular file and for more than 1 MiB, and OSError in the
    same cases as ``open``.
    """
    descriptor = os.open(path, os.O_RDONLY | _NO_WAITING)
    try:
        if not stat.S_ISREG(os.fstat(descriptor).st_mode):
            raise NotReadError("is not a regular file")
        with open(descriptor, "rb", closefd=False) as file:
            data = file.read(_LARGEST + 1)
    finally:
        os.close(descriptor)
    if len(data) > _LARGEST:
        raise NotReadError(f"is larger than {_LARGEST} bytes")
    return data


def leads_out(path: Path, root: Path) -> bool:
    """Whether a link in ``path`` leads outside ``root``."""
    return not Path(os.path.realpath(path)).is_relative_to(os.path.realpath(root))


def replace(path: Path, data: bytes, mode: int) -> None:
    """Write to a temporary file next to ``path`` and rename it, so that no file is ever half-written.

    :param mode: the permissions of the file.
    Raises OSError and leaves ``path`` unchanged if that fails.
    """
    descriptor, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with os.fdopen(descriptor, "wb") as file:
            file.write(data)
        os.chmod(name, mode)
        os.replace(name, path)
    except BaseException:
        with contextlib.suppress(OSError):
            os.unlink(name)
        raise


_KEY = re.compile(rb"^([a-z]+):", re.MULTILINE)
_PATTERNS = ("*.y*ml", "*/*.y*ml", "*/*/overlay.y*ml")  # the last one for a misspelt `overlays`
_PLACES = {  # first key of a file, or second key of worked examples -> place for that kind of file
    b"quantities": "quantities.yaml",
    b"controllers": "stages.yaml",
    b"stages": "stages.yaml",
    b"units": "units.yaml",
    b"families": "units.yaml",
    b"chapter": "messages/",
    b"errata": "errata/",
    b"rules": "rules.yaml",
    b"decisions": "decisions.yaml",
    b"sources": "evidence.yaml",
    b"examples": "examples.yaml",
    b"captures": "captures.yaml",
}
_OF_PROTOCOL = {
    **_PLACES,
    b"protocol": "protocol.yaml",
    b"overlay": "overlays/NAME/overlay.yaml",
}
_OF_OVERLAY = {
    **_PLACES,
    b"protocol": "examples.yaml",
    b"overlay": "overlay.yaml",
}


def strays(
    folder: Path, read: Collection[Path], *, overlay: bool = False
) -> Iterator[tuple[Path, str]]:
    """Yield the misplaced spec files in ``folder`` or directly below it, with their right place.

    Other YAML files are allowed, so a file counts only if it begins like a file of a spec. The directories of
    overlays are skipped; call this function for each of them.

    :param read: the files that are read.
    :param overlay: whether the directory belongs to an overlay.
    """
    root, places = (folder.parents[2], _OF_OVERLAY) if overlay else (folder.parent, _OF_PROTOCOL)
    for path in sorted({path for pattern in _PATTERNS for path in folder.glob(pattern)}):
        of_overlay = path.parents[1] == folder / "overlays"
        if path in read or of_overlay or leads_out(path, root):
            continue
        try:
            keys = _KEY.findall(content(path))
        except (NotReadError, OSError):
            continue
        if keys[:1] and keys[0] in places:
            kind = next(key for key in (*keys[1:2], keys[0]) if key in places)
            yield path, places[kind]
