"""Convert names of the registry to names in generated code, for lint rules and targets."""

from __future__ import annotations

import builtins
import keyword
import re
import sys

from stagewire_generator.model import Message
from stagewire_generator.model_fields import Enumeration, FlagTable

# Windows treats these as devices, whatever the file extension.
_DEVICES = frozenset({
    "aux", "con", "nul", "prn", *(f"{port}{n}" for port in ("com", "lpt") for n in range(10))
})  # fmt: skip
# Packages that a generated package would shadow, or that would shadow it; and the directory that all C
# packages share.
_PACKAGES = sys.stdlib_module_names | {
    "click", "jinja2", "jsonschema", "jsonschema_rs", "numpy", "pyarrow", "rich", "ruamel", "serial",
    "stagewire", "stagewire_cli", "stagewire_conformance", "stagewire_generator", "testing", "typer", "yaml",
}  # fmt: skip
# Names that the C code of every package defines, without the prefix.
C_OURS = frozenset({
    "address_of", "addresses", "addresses_are_two_bytes", "addresses_of", "append_extra", "array",
    "axis_of", "begin_array", "begin_header", "begin_packet", "begins", "bits", "cases", "check_array",
    "check_bytes", "check_command", "check_header", "check_of", "check_packet", "check_setup",
    "check_sub_message", "check_whole", "copy", "dummies_allowed", "end", "end_packet", "entry",
    "entry_for", "entry_is_four_bytes", "entry_is_six_bytes", "entry_name", "entry_of", "event",
    "event_kind", "examples", "from_counts", "give_size", "has_packet", "holds_setup", "host_to", "id_of",
    "identify_command", "identify_packet", "is_axis", "is_setup", "kind", "layout",
    "layout_count", "layouts", "leave_size_out", "longest_packet_is_too_small", "may_lack_flag", "name",
    "payload_of", "put_bytes",
    "put_length", "ratio", "refused", "replies", "reply_to", "scale", "scale_of_share",
    "signed_24", "status", "sub_message_count", "sub_message_of", "sub_messages", "table",
    "table_count", "to_counts", "to_host", "wide",
    *(f"{verb}_{bits}" for verb in ("get", "put") for bits in range(8, 65, 8)),
    *(f"parser{part}" for part in ("", "_abandon", "_init", "_next", "_pending", "_slot", "_take",
                                   "_take_indexed")),
    *(f"replies_{part}" for part in ("abandon", "drained", "init", "next", "outstanding", "pending",
                                     "poisoned", "sent")),
    *(f"to_counts_{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32)),
    *(f"wide_{part}" for part in ("add", "common_divisor", "divide", "half_product", "magnitude",
                                  "product", "signed")),
})  # fmt: skip
_PACKAGE = re.compile(r"[a-z][a-z0-9]*(_[a-z0-9]+)*\Z")  # as in the schema of a protocol
_LONGEST_PACKAGE = 40


def can_name_file(name: str) -> bool:
    """Whether a file can have this name, with any extension and on any system."""
    return name not in _DEVICES


def can_name_package(name: str) -> bool:
    """Whether a package can have this name without a clash, and its names in C can begin with it."""
    if not can_name_file(name) or keyword.iskeyword(name) or name in _PACKAGES:
        return False
    prefix = c_prefix(name)
    return prefix[0].isalpha() and not prefix.startswith(
        "stagewire"
    )  # the prefix of shared C names


def why_no_project(name: str) -> str:
    """Return why a third-party project cannot use this package name, or an empty text if it can."""
    if not _PACKAGE.match(name) or len(name) > _LONGEST_PACKAGE:
        least = "lower-case letters, digits and single underscores, and begin with a letter"
        return f"a package name must consist of {least} (at most {_LONGEST_PACKAGE} characters)"
    if name.startswith("stagewire"):
        return "names that begin with stagewire are reserved for its own packages"
    if not can_name_package(name):
        return "the name is already used by Python, an operating system or another package"
    return ""


def can_name_chapter(name: str) -> bool:
    """Whether a module of messages can have this name.

    The package ``messages`` gets it as an attribute, so it must not shadow ``decode`` or a built-in.
    """
    kept = keyword.iskeyword(name) or hasattr(builtins, name) or name == "decode"
    return can_name_file(name) and not kept


def camel(name: str) -> str:
    """Return ``jog_mode`` as ``JogMode``."""
    return "".join(part.capitalize() for part in name.split("_"))


def message_classes(message: Message) -> dict[str, str]:
    """Return form -> class name of a message.

    The layout with the form ``data`` or ``request``, or the only layout, gets the plain name. The others
    append their form.
    """
    suffixes = _suffixes(message)
    return {form: message.class_name + suffix.capitalize() for form, suffix in suffixes.items()}


def class_aliases(message: Message) -> list[tuple[str, str]]:
    """Return the other names of the classes of a message, each with the class that it means."""
    suffixes = {form: suffix.capitalize() for form, suffix in _suffixes(message).items()}
    return [
        (alias + suffix, message.class_name + suffix)
        for alias in message.class_aliases
        for suffix in suffixes.values()
    ]


def c_prefix(package: str) -> str:
    """Return the prefix of all names of a package in C: ``apt`` for ``stagewire_apt``."""
    return package.removeprefix("stagewire_")


def c_layouts(message: Message) -> dict[str, str]:
    """Return form -> name in C without the prefix, such as ``mot_move_absolute_header``.

    If a message is named like something that every package defines, such as ``STATUS``, a word is appended.
    """
    name = message.name.lower()
    suffixes = _suffixes(message)
    names = {form: f"{name}_{suffix}" if suffix else name for form, suffix in suffixes.items()}
    return {form: f"{n}_message" if n in C_OURS else n for form, n in names.items()}


def c_aliases(message: Message) -> list[tuple[str, str]]:
    """Return the other names in C of each layout, with the name that they mean; all without the prefix."""
    suffixes, names = _suffixes(message), c_layouts(message)
    return [
        ("_".join(filter(None, (alias.lower(), suffixes[form]))), name)
        for alias in message.aliases
        for form, name in names.items()
    ]


def c_table(table: Enumeration | FlagTable) -> str:
    """Return the name of an enumeration or a flag table in C, without the prefix."""
    kind = "bits" if isinstance(table, FlagTable) else "values"
    return f"{table.name}_{kind}" if table.name in C_OURS else table.name


def _suffixes(message: Message) -> dict[str, str]:
    """Return form -> the suffix of the layout's name."""
    forms = [layout.form for layout in message.layouts]
    plain = forms[0] if len(forms) == 1 else "request" if "request" in forms else "data"
    return {form: "" if form == plain else form.removeprefix("data:") for form in forms}
