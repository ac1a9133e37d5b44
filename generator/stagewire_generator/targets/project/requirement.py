"""Which versions of the runtime a generated package works with."""

from __future__ import annotations

import re

__all__ = ["requirement"]

_VERSION = re.compile(r"([0-9]+)\.([0-9]+)")


def requirement(version: str) -> str:
    """Return what a package made by this version of stagewire depends on.

    Classes call functions of the runtime that made them; before 1.0 another minor version may have
    others, from then on only another major one.
    """
    found = _VERSION.match(version)
    if found is None:
        raise ValueError(f"{version} is no version")
    major, minor = int(found[1]), int(found[2])
    following = f"{major + 1}" if major else f"0.{minor + 1}"
    return f"stagewire>={major}.{minor},<{following}"
