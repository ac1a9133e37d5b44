"""Lazy imports for public modules: each name is imported when it is first used.

Public modules import the same names below ``if TYPE_CHECKING`` for type checkers and editors. There the name
is annotated as a ``bool``: jedi, which completes names in IPython and many editors, would otherwise see that
it is False and skip the block.
"""

from __future__ import annotations

import sys

TYPE_CHECKING = False  # importing typing would double the import time
if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from typing import Any


def lazy(
    module: str, places: Mapping[str, str], modules: str = ""
) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """Return the ``__getattr__`` and the ``__dir__`` of a public module.

    :param places: private module -> the names it defines, separated by spaces; ``here=there`` publishes
        ``here`` as ``there``.
    :param modules: the public modules of a package, separated by spaces.
    """
    found: dict[str, tuple[str, str]] = {}
    for place, names in places.items():
        for name in names.split():
            defined, _, published = name.partition("=")
            found[published or defined] = (f"stagewire.{place}", defined)

    inside = modules.split()

    def load(name: str) -> Any:
        if name in inside:
            return __import__(f"{module}.{name}", fromlist=[name])
        if name not in found:
            raise AttributeError(f"module {module!r} has no attribute {name!r}")
        place, defined = found[name]
        value = getattr(__import__(place, fromlist=[defined]), defined)
        setattr(sys.modules[module], name, value)
        return value

    def listed() -> list[str]:
        return sorted({*sys.modules[module].__all__, *inside})

    return load, listed
