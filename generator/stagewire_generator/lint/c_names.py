"""Names in C: what the package of a protocol defines, each once, and nothing that C keeps for itself.

C has one room for the names of types, functions and values, and another, without walls, for macros; a
compiler need not look further than 63 characters.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace

from stagewire_generator.diagnostics import Diagnostics, Place
from stagewire_generator.lint.keywords import C_KEYWORDS, CPP_KEYWORDS
from stagewire_generator.model import Factor, Message, Protocol
from stagewire_generator.naming import C_OURS, c_layouts, c_prefix, c_table
from stagewire_generator.scales import scales_of

__all__ = ["OUR_MACROS", "check_c_names", "defined", "why_no_prefix"]

_SIGNIFICANT = 63  # characters of a name that is not linked: C99 5.2.4.1
_OF_A_LAYOUT = (
    "", "_encode", "_encode_unchecked", "_decode", "_write_fields", "_holds_its_packet",
)  # fmt: skip
_MACROS = ("LENGTH", "SIZE", "INIT")
# Macros of every package, without the prefix.
OUR_MACROS = frozenset({
    "ALLOW_DUMMIES", "BRACED", "DAMAGED", "DATA_FLAG", "DUMMY", "END_DEVICE", "END_HOST",
    "END_NONE", "ENTRY_HEADER", "ENTRY_ONLY_ZERO", "ENTRY_SHORTER", "ENTRY_TO_BOTH",
    "ENTRY_TO_CONTROLLER", "ENTRY_TO_HOST", "ENTRY_UNDOCUMENTED", "EVENT_BAD_LENGTH",
    "EVENT_GARBAGE", "EVENT_MESSAGE", "EVENT_NONE", "EVENT_UNDOCUMENTED", "EVENT_UNKNOWN",
    "HEADER_SIZE", "HIGHEST_ADDRESS", "HOST", "HOST_INDEX", "KIND_COMMAND", "KIND_SETUP",
    "LAYOUTS", "LENGTH_KNOWN", "LONGEST_COMMAND", "LONGEST_FRAME", "LONGEST_PACKET", "LONGEST_REPLY",
    "MAXIMUM_LENGTH", "NATIVE", "NO_NAMES", "NO_RANGE_CHECKS", "NO_SPACE", "NO_TABLE", "OK",
    "OUTSTANDING", "OUT_OF_RANGE", "OVERHEAD", "PAYLOAD", "POISONED", "PREFIX", "REMEMBERED",
    "SLOTS", "STATIC_ASSERT", "TERMINATOR", "TOO_SHORT", "TRAILING", "WRONG_ID", "WRONG_LENGTH",
})  # fmt: skip
_STANDARD = re.compile(  # stddef.h, stdbool.h and stdint.h, and what may be added to the last
    r"u?int\w*_t|(size|ptrdiff|max_align|nullptr|wchar|wint|sig_atomic)_t|"
    r"U?INT\w*_(MIN|MAX|WIDTH|C)|(SIZE|PTRDIFF|SIG_ATOMIC|WCHAR|WINT)_(MIN|MAX|WIDTH)"
)


def check_c_names(protocol: Protocol, diagnostics: Diagnostics) -> None:
    """Check the names of the C package of a protocol."""
    prefix = c_prefix(protocol.package)
    ours = [*(f"{prefix}_{n}" for n in C_OURS), *(f"{prefix.upper()}_{n}" for n in OUR_MACROS)]
    seen = {name[:_SIGNIFICANT]: (name, "") for name in ours}
    noted = set()
    for name, owner, place in defined(protocol):
        other, its_owner = seen.setdefault(name[:_SIGNIFICANT], (name, owner))
        code = "SW022"
        if not its_owner or _is_kept(name):
            code, what = "SW023", f"{owner}: in C, {name} is reserved"
        elif other != name:
            whose = owner if owner == its_owner else f"{owner} and {its_owner}"
            what = f"{whose}: {name} and {other} in C do not differ in the first {_SIGNIFICANT} characters"
        elif its_owner != owner:
            what = f"{owner} and {its_owner} would both be {name} in C"
        else:
            continue
        if (code, owner, its_owner) not in noted:  # one of its names says enough
            diagnostics.add(place, code, what)
            noted.add((code, owner, its_owner))


def why_no_prefix(protocol: Protocol, package: str) -> str:
    """Return why the names of a protocol cannot begin with those of another package; empty if they can."""
    diagnostics = Diagnostics()
    check_c_names(replace(protocol, package=package), diagnostics)
    return next((found.message for found in diagnostics), "")


def _is_kept(name: str) -> bool:
    """Whether C, C++ or their headers keep a name for themselves."""
    return name in C_KEYWORDS or name in CPP_KEYWORDS or _STANDARD.fullmatch(name) is not None


def defined(protocol: Protocol) -> Iterator[tuple[str, str, Place]]:
    """Yield every name that depends on the spec, whose it is, and where that stands."""
    prefix = c_prefix(protocol.package)
    for message in protocol.messages:
        if message.id is not None:
            for name in _of_message(message, prefix):
                yield name, message.name, message.place
    for enumeration in protocol.enumerations:
        table = f"{prefix}_{c_table(enumeration)}"
        yield table, enumeration.name, enumeration.place
        for value in enumeration.values:
            owner = f"{enumeration.name}.{value.name}"
            yield f"{table}_{value.name}".upper(), owner, enumeration.place
    for flags in protocol.flags:
        table = f"{prefix}_{c_table(flags)}"
        for bit in flags.bits:
            yield f"{table}_{bit.name}".upper(), f"{flags.name}.{bit.name}", flags.place
    for scale in scales_of(protocol):
        if scale.is_known:
            name = f"{prefix}_scale_{scale.name}"
            constant = isinstance(scale.scale, Factor)
            yield name.upper() if constant else name, ".".join(scale.words), scale.place


def _of_message(message: Message, prefix: str) -> Iterator[str]:
    layouts = c_layouts(message).values()
    for name in layouts:
        yield from (f"{prefix}_{name}{more}" for more in _OF_A_LAYOUT)
    macros = (*_MACROS, "SIZE_SLOT") if message.kind == "command" else _MACROS
    yield f"{prefix.upper()}_{message.name}_ID"
    yield from (f"{prefix.upper()}_LAYOUT_{name.upper()}" for name in layouts)  # of the tests
    for name in dict.fromkeys([message.name, *(name.upper() for name in layouts)]):
        yield from (f"{prefix.upper()}_{name}_{macro}" for macro in macros)
