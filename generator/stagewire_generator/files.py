"""Read untrusted files, write files as a whole, and find files of a spec that nothing reads."""

from __future__ import annotations

import contextlib
import os
import re
import stat
import tempfile
from collections.abc import Collection, Iterator
from pathlib import Path

_LARGEST = 1 << 20  # bytes of a file; the largest known has a tenth of it
_NO_WAITING = getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)  # systems have one of them


class NotReadError(Exception):
    """A file that is not worth reading, and why."""


def content(path: Path) -> bytes:
    """Return the bytes of a regular file; a pipe must not keep the reader waiting.

    Raises :class:`NotReadError` for anything else and for more than 1 MiB, OSError as ``open`` does.
    """
    descriptor = os.open(path, os.O_RDONLY | _NO_WAITING)
    try:
        if not stat.S_ISREG(os.fstat(descriptor).st_mode):
            raise NotReadError("is no regular file")
        with open(descriptor, "rb", closefd=False) as file:
            data = file.read(_LARGEST + 1)
    finally:
        os.close(descriptor)
    if len(data) > _LARGEST:
        raise NotReadError(f"has more than {_LARGEST} bytes")
    return data


def leads_out(path: Path, root: Path) -> bool:
    """Whether a link takes what is read from somewhere else than below ``root``."""
    return not Path(os.path.realpath(path)).is_relative_to(os.path.realpath(root))


def replace(path: Path, data: bytes, mode: int) -> None:
    """Write to a temporary file beside ``path`` and rename it, so that nothing is half-written.

    :param mode: the permissions that the file gets.
    Raises OSError, and leaves ``path`` as it was.
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
_PATTERNS = ("*.y*ml", "*/*.y*ml", "*/*/overlay.y*ml")  # the last where `overlays` is misspelt
_PLACES = {  # first key of a file, or second of worked examples -> where files of its kind are read
    b"quantities": "quantities.yaml",
    b"controllers": "stages.yaml",
    b"stages": "stages.yaml",
    b"units": "units.yaml",
    b"families": "units.yaml",
    b"chapter": "messages/",
    b"errata": "errata/",
    b"rules": "rules.yaml",
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
    """Yield files of a protocol in ``folder`` or right below it that are not read, and their place.

    Other YAML may lie there, so a file counts if it begins as one of a spec does. What stands in the folder
    of an overlay is asked for by itself.

    :param read: the files that are read.
    :param overlay: whether the folder is that of an overlay.
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
