"""Reading files that somebody else may have put there, and writing them whole."""

from __future__ import annotations

import contextlib
import os
import stat
import tempfile
from pathlib import Path

__all__ = ["NotReadError", "content", "leads_out", "replace"]

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
