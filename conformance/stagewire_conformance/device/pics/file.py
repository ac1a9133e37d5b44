"""From a TOML file to a PICS; all mistakes are reported at once, each with its key and what was expected.

The keys stand in ``spec/schema/pics.schema.json``, too, for editors; what only the registry knows, such as
whether a unit has a message, is said here alone.
"""

from __future__ import annotations

import hashlib
import tomllib
from pathlib import Path

from stagewire_conformance.device.errors import PicsError
from stagewire_conformance.device.pics import Pics
from stagewire_conformance.device.pics.reader import PicsReader
from stagewire_virtual.toml_tables import Table

__all__ = ["parse_pics", "read_pics"]


def read_pics(path: str | Path) -> Pics:
    """Read a PICS from a TOML file.

    Raises :class:`.PicsError` with everything that is wrong with it.
    """
    try:
        contents = Path(path).read_bytes()
    except OSError as error:
        raise PicsError([f"{path}: cannot be read: {error.strerror or error}"]) from error
    return parse_pics(contents, str(path))


def parse_pics(contents: bytes, source: str = "pics.toml") -> Pics:
    """Read a PICS from what is in its file.

    :param source: where it comes from; begins each line of an error.

    Raises :class:`.PicsError` with everything that is wrong with it.
    """
    try:
        values = tomllib.loads(contents.decode("utf-8-sig"))
    except RecursionError as error:
        raise PicsError([f"{source}: is nested too deeply"]) from error
    except ValueError as error:  # of TOML or of UTF-8
        raise PicsError([f"{source}: is no TOML file: {error}"]) from error
    problems: list[str] = []
    pics = PicsReader(Table(values, source, problems), hashlib.sha256(contents).hexdigest()).read()
    if problems or pics is None:
        raise PicsError(problems)
    return pics
