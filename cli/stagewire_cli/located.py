"""Where files are for whoever reads a report: named so that a terminal, an editor or a program opens them.

The generator names the files of a spec from the folder above their protocol, wherever that is.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from stagewire_generator.diagnostics import Diagnostic

__all__ = ["from_here", "located"]


def located(diagnostics: Iterable[Diagnostic], spec: Path) -> list[Diagnostic]:
    """Return the diagnostics of a spec with every file as it is found from the current folder.

    :param spec: the folder, as the user named it.
    """
    from stagewire_generator.location import locate

    path = cache(lambda name: from_here(locate(spec, name)))  # a run may have thousands of a file
    return [
        replace(diagnostic, place=replace(diagnostic.place, file=path(diagnostic.place.file)))
        for diagnostic in diagnostics
    ]


def from_here(path: Path) -> str:
    """Return a path from the current folder if it is below it, else the whole path."""
    path, here = Path(os.path.abspath(path)), Path.cwd()
    return (path.relative_to(here) if path.is_relative_to(here) else path).as_posix()
