"""How names of the registry become names of classes; lint rules and targets agree on it here."""

from __future__ import annotations

import builtins
import keyword
import re
import sys

from stagewire_generator.model import Enumeration, FlagTable, Message

# What Windows takes for a device, whatever the ending of the file is.
_DEVICES = frozenset({
    "aux", "con", "nul", "prn", *(f"{port}{n}" for port in ("com", "lpt") for n in range(10))
})  # fmt: skip
# Packages that a generated one would hide, or be hidden by; the folder of what all C packages share.
_PACKAGES = sys.stdlib_module_names | {
    "click", "jinja2", "jsonschema", "jsonschema_rs", "numpy", "pyarrow", "rich", "ruamel", "serial",
    "stagewire", "stagewire_cli", "stagewire_conformance", "stagewire_generator", "testing", "typer", "yaml",
}  # fmt: skip
# What the C of every package defines itself, without the prefix: functions, types, what they are named for.
C_OURS = frozenset({
    "address_of", "addresses", "addresses_are_two_bytes", "addresses_of", "append_extra",
    "axis_of", "begin_header", "begin_packet", "begins", "cases", "check_bytes",
    "check_command", "check_header", "check_of", "check_packet", "check_setup", "check_whole",
    "copy", "dummies_allowed", "end", "end_packet", "entry", "entry_is_four_bytes",
    "entry_is_six_bytes", "entry_name", "entry_of", "event", "event_kind", "examples",
    "from_counts", "give_size", "holds_setup", "host_to", "id_of", "identify_command",
    "identify_packet", "is_axis", "is_setup", "kind", "layout", "layout_count", "layouts",
    "leave_size_out", "name", "payload_of", "put_bytes", "put_length", "ratio", "refused",
    "replies", "reply_to", "scale", "scale_of_share", "signed_24", "status", "table", "table_count",
    "to_counts", "to_host", "wide",
    *(f"{verb}_{bits}" for verb in ("get", "put") for bits in range(8, 65, 8)),
    *(f"parser{part}" for part in ("", "_abandon", "_init", "_next", "_pending", "_slot", "_take",
                                   "_take_indexed")),
    *(f"replies_{part}" for part in ("abandon", "drained", "init", "next", "outstanding", "pending",
                                     "poisoned", "sent")),
    *(f"to_counts_{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32)),
    *(f"wide_{part}" for part in ("add", "common_divisor", "divide", "half_product", "magnitude",
                                  "product", "signed")),
})  # fmt: skip
_PACKAGE = re.compile(r"[a-z][a-z0-9]*(_[a-z0-9]+)*\Z")  # as the schema of a protocol has it
_LONGEST_PACKAGE = 40


def can_name_file(name: str) -> bool:
    """Whether a file can have this name, with any ending and on any system."""
    return name not in _DEVICES


def can_name_package(name: str) -> bool:
    """Whether a package can have this name beside those that it needs, and its names in C begin with it."""
    if not can_name_file(name) or keyword.iskeyword(name) or name in _PACKAGES:
        return False
    prefix = c_prefix(name)
    return prefix[0].isalpha() and not prefix.startswith(
        "stagewire"
    )  # so begins what all share in C


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
    suffixes = _suffixes(message)
    return {form: message.class_name + suffix.capitalize() for form, suffix in suffixes.items()}


def c_prefix(package: str) -> str:
    """Return what every name of a package begins with in C: ``apt`` for ``stagewire_apt``."""
    return package.removeprefix("stagewire_")


def c_layouts(message: Message) -> dict[str, str]:
    """Return form -> name in C, without the prefix: ``mot_move_absolute_header`` and the like.

    A message is often called as something that every package has, such as ``STATUS``; its name is then
    longer by a word.
    """
    name = message.name.lower()
    suffixes = _suffixes(message)
    names = {form: f"{name}_{suffix}" if suffix else name for form, suffix in suffixes.items()}
    return {form: f"{n}_message" if n in C_OURS else n for form, n in names.items()}


def c_table(table: Enumeration | FlagTable) -> str:
    """Return the name of an enumeration or a flag table in C, without the prefix."""
    kind = "bits" if isinstance(table, FlagTable) else "values"
    return f"{table.name}_{kind}" if table.name in C_OURS else table.name


def _suffixes(message: Message) -> dict[str, str]:
    """Return form -> what the name of a layout appends to that of its message."""
    forms = [layout.form for layout in message.layouts]
    plain = forms[0] if len(forms) == 1 else "request" if "request" in forms else "data"
    return {form: "" if form == plain else form.removeprefix("data:") for form in forms}
