"""What a module of message classes imports."""

from __future__ import annotations

from collections.abc import Sequence

from stagewire_generator.targets.python.class_view import ClassView
from stagewire_generator.targets.python.source import SUPPORT, imported

__all__ = ["class_imports", "uses_self", "uses_struct"]

# base of a class -> what else its template names
_BESIDE = {"FramedMessage": ("check_addresses",)}
_CALLED = ("check_bytes", "check_integer", "check_text")
"""Functions that a check may call."""
# kinds of classes
_WITH_STRUCT = {"plain", "undecided", "command", "payload"}
_WITH_SELF = {"plain", "command", "payload"}


def class_imports(package: str, views: Sequence[ClassView]) -> list[str]:
    """Return the statements by which a module imports what its classes stand on."""
    names = {"Direction", "Layout"}
    for view in views:
        names.update((view.base, *_BESIDE.get(view.base, ())))
    checks = [field.check for view in views for field in view.fields]
    names.update(name for name in _CALLED if any(f"{name}(" in check for check in checks))
    flags = {field.flags for view in views for field in view.fields if field.flags}
    return [imported(SUPPORT, list(names))] + (
        [imported(f"{package}.flags", list(flags))] if flags else []
    )


def uses_struct(views: Sequence[ClassView]) -> bool:
    """Whether a class of the module packs or reads named fields."""
    return any(view.kind in _WITH_STRUCT for view in views)


def uses_self(views: Sequence[ClassView]) -> bool:
    """Whether a class of the module is made from named fields."""
    return any(view.kind in _WITH_SELF for view in views)
