"""How names of the registry become names of classes; lint rules and targets agree on it here."""

from __future__ import annotations

import builtins
import keyword
import re
import sys

from stagewire_generator.model import Message

__all__ = [
    "camel", "can_name_chapter", "can_name_file", "can_name_package", "message_classes", "why_no_project",
]  # fmt: skip

# What Windows takes for a device, whatever the ending of the file is.
_DEVICES = frozenset({
    "aux", "con", "nul", "prn", *(f"{port}{n}" for port in ("com", "lpt") for n in range(10))
})  # fmt: skip
# Packages that a generated one would hide, or be hidden by.
_PACKAGES = sys.stdlib_module_names | {
    "click", "jinja2", "jsonschema", "numpy", "pyarrow", "rich", "ruamel", "serial", "stagewire",
    "stagewire_cli", "stagewire_conformance", "stagewire_generator", "typer", "yaml",
}  # fmt: skip
_PACKAGE = re.compile(r"[a-z][a-z0-9]*(_[a-z0-9]+)*\Z")  # as the schema of a protocol has it
_LONGEST_PACKAGE = 40


def can_name_file(name: str) -> bool:
    """Whether a file can have this name, with any ending and on any system."""
    return name not in _DEVICES


def can_name_package(name: str) -> bool:
    """Whether a package can have this name beside those that it needs."""
    return can_name_file(name) and not keyword.iskeyword(name) and name not in _PACKAGES


def why_no_project(name: str) -> str:
    """Return why a project of somebody else cannot have a package of this name; empty if it can."""
    if not _PACKAGE.match(name) or len(name) > _LONGEST_PACKAGE:
        least = "small letters, digits and single underscores, a letter first"
        return f"a package is named with {least}, at most {_LONGEST_PACKAGE} of them"
    if name.startswith("stagewire"):
        return "names that begin with stagewire are those of its own packages"
    if not can_name_package(name):
        return "Python, a system, or another package has this name already"
    return ""


def can_name_chapter(name: str) -> bool:
    """Whether a module of messages can have this name.

    The package ``messages`` gets it as an attribute: it must not hide ``decode``, or a built-in.
    """
    kept = keyword.iskeyword(name) or hasattr(builtins, name) or name == "decode"
    return can_name_file(name) and not kept


def camel(name: str) -> str:
    """Return ``jog_mode`` as ``JogMode``."""
    return "".join(part.capitalize() for part in name.split("_"))


def message_classes(message: Message) -> dict[str, str]:
    """Return form -> class name of a message.

    The layout with the plain form ``data`` or ``request``, or the only layout, takes the plain name;
    the others append their form.
    """
    forms = [layout.form for layout in message.layouts]
    plain = forms[0] if len(forms) == 1 else "request" if "request" in forms else "data"
    names = {}
    for form in forms:
        suffix = "" if form == plain else form.removeprefix("data:").capitalize()
        names[form] = message.class_name + suffix
    return names
