"""Lazy imports for public modules: each name is imported when it is first used."""

from __future__ import annotations

import sys

TYPE_CHECKING = False  # importing typing would double the import time
if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from typing import Any


def lazy(module: str, places: Mapping[str, str]) -> Callable[[str], Any]:
    """Return the ``__getattr__`` of a public module.

    :param places: private module -> the names it defines, separated by spaces; ``here=there`` publishes
        ``here`` as ``there``.
    """
    found: dict[str, tuple[str, str]] = {}
    for place, names in places.items():
        for name in names.split():
            defined, _, published = name.partition("=")
            found[published or defined] = (f"stagewire.{place}", defined)

    def load(name: str) -> Any:
        if name not in found:
            raise AttributeError(f"module {module!r} has no attribute {name!r}")
        place, defined = found[name]
        value = getattr(__import__(place, fromlist=[defined]), defined)
        setattr(sys.modules[module], name, value)
        return value

    return load
