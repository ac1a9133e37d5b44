"""What a module of message classes imports."""

from __future__ import annotations

from collections.abc import Sequence

from stagewire_generator.targets.python.class_view import ClassView
from stagewire_generator.targets.python.source import imported

__all__ = ["class_imports", "uses_self", "uses_struct"]

_MESSAGE = "stagewire.message"
_FRAMED = "stagewire.framed_message"
_COMMAND = "stagewire.commands.command"

# base of a class -> its module, and what else of it the template of such a class names
_BASES: dict[str, tuple[str, tuple[str, ...]]] = {
    "FramedMessage": (_FRAMED, ("check_addresses",)),
    "UndecidedMessage": (_FRAMED, ()),
    "UndocumentedMessage": (_FRAMED, ()),
    "Command": (_COMMAND, ()),
    "SetupCommand": (_COMMAND, ()),
    "Reply": (_COMMAND, ()),
    "PacketMessage": ("stagewire.packets", ()),
}
# function that a check may call -> its module
_CALLED = {
    "check_bytes": _MESSAGE,
    "check_integer": _MESSAGE,
    "check_text": _MESSAGE,
}
# kinds of classes
_WITH_STRUCT = {"plain", "undecided", "command", "payload"}
_WITH_SELF = {"plain", "command", "payload"}


def class_imports(package: str, views: Sequence[ClassView]) -> list[str]:
    """Return the statements by which a module imports what its classes stand on."""
    names = {"stagewire.direction": {"Direction"}, _MESSAGE: {"Layout"}}
    for view in views:
        module, named = _BASES[view.base]
        names.setdefault(module, set()).update((view.base, *named))
    checks = [field.check for view in views for field in view.fields]
    for function, module in _CALLED.items():
        if any(f"{function}(" in check for check in checks):
            names.setdefault(module, set()).add(function)
    flags = {field.flags for view in views for field in view.fields if field.flags}
    statements = [imported(module, list(names[module])) for module in sorted(names)]
    return statements + ([imported(f"{package}.flags", list(flags))] if flags else [])


def uses_struct(views: Sequence[ClassView]) -> bool:
    """Whether a class of the module packs or reads named fields."""
    return any(view.kind in _WITH_STRUCT for view in views)


def uses_self(views: Sequence[ClassView]) -> bool:
    """Whether a class of the module is made from named fields."""
    return any(view.kind in _WITH_SELF for view in views)
