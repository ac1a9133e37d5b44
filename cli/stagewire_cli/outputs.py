"""Where ``stagewire decode`` writes: standard output, or a file that appears when it is whole."""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

from stagewire_cli.errors import CalledWronglyError

__all__ = ["check_output", "output"]


def check_output(path: Path, source: Path | None, option: str = "--output") -> None:
    """Raise :class:`CalledWronglyError` where no file can be made or the input would be lost.

    :param option: by which the file was named.

    A file that is there already is replaced, as by ``cp``; but never the capture itself, and nothing
    that is no regular file.
    """
    if not path.name:
        raise CalledWronglyError(f"{option}: give the name of a file")
    if source is not None and path.exists() and path.samefile(source):
        raise CalledWronglyError(f"{option}: {path} is the capture that is read")
    if path.exists() and not path.is_file():
        instead = "; without --output text goes to standard output" if option == "--output" else ""
        raise CalledWronglyError(f"{option}: {path} is no regular file{instead}")
    folder = path.absolute().parent
    if not folder.is_dir():
        raise CalledWronglyError(f"{option}: there is no folder {folder}")
    if not os.access(folder, os.W_OK):
        raise CalledWronglyError(f"{option}: no file can be made in {folder}, which is not yours")


@contextmanager
def output(path: Path | None, *, binary: bool = False) -> Iterator[IO[Any]]:
    """Give a stream to write to; a file gets its name when the block ends without an exception.

    Until then it stands beside its place under a temporary name, which is removed if the block fails.
    """
    if path is None:
        yield sys.stdout
        return
    target = Path(os.path.realpath(path))  # through links: what they point to is replaced
    part = target.with_name(f".{target.name}.{os.getpid()}.part")
    encoding = None if binary else "utf-8"
    try:
        with part.open("xb" if binary else "x", encoding=encoding) as file:
            yield file
        part.replace(target)
    except BaseException:
        with contextlib.suppress(OSError):
            part.unlink()
        raise
