"""Check names in C: each name of a package is defined once, and none is reserved.

C has one namespace for types, functions and values, and another one, without scopes, for macros. A compiler
may ignore everything after the first 63 characters. Members cannot have reserved words or names from standard
headers.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace

from stagewire_generator.diagnostics import Diagnostics, Place
from stagewire_generator.model import (
    Message,
    Protocol,
)
from stagewire_generator.model_scales import (
    Factor,
)
from stagewire_generator.naming import C_OURS, c_aliases, c_layouts, c_prefix, c_table
from stagewire_generator.scales import scales_of

C_KEYWORDS = frozenset({  # C99 to C23
    "alignas", "alignof", "auto", "bool", "break", "case", "char", "const", "constexpr", "continue",
    "default", "do", "double", "else", "enum", "extern", "false", "float", "for", "goto", "if",
    "inline", "int", "long", "nullptr", "register", "restrict", "return", "short", "signed",
    "sizeof", "static", "static_assert", "struct", "switch", "thread_local", "true", "typedef",
    "typeof", "typeof_unqual", "union", "unsigned", "void", "volatile", "while"
})  # fmt: skip
CPP_KEYWORDS = frozenset({  # C++20, beyond those of C
    "and", "and_eq", "asm", "bitand", "bitor", "catch", "char16_t", "char32_t", "char8_t", "class",
    "co_await", "co_return", "co_yield", "compl", "concept", "const_cast", "consteval", "constinit",
    "decltype", "delete", "dynamic_cast", "explicit", "export", "friend", "mutable", "namespace",
    "new", "noexcept", "not", "not_eq", "operator", "or", "or_eq", "private", "protected", "public",
    "reinterpret_cast", "requires", "static_cast", "template", "this", "throw", "try", "typeid",
    "typename", "using", "virtual", "wchar_t", "xor", "xor_eq"
})  # fmt: skip
C_NAMES = frozenset({  # lower-case macros, some from compilers; types from stddef.h and stdint.h
    "complex", "errno", "i386", "imaginary", "intmax_t", "intptr_t", "linux", "max_align_t", "noreturn",
    "nullptr_t", "ptrdiff_t", "size_t", "stderr", "stdin", "stdout", "uintmax_t", "uintptr_t", "unix",
    *(
        f"{sign}int{speed}{bits}_t"
        for sign in ("", "u") for speed in ("", "_fast", "_least") for bits in (8, 16, 32, 64)
    ),
})  # fmt: skip


_SIGNIFICANT = 63  # significant characters of an internal name: C99 5.2.4.1
_OF_A_LAYOUT = (
    "", "_encode", "_encode_unchecked", "_decode", "_write_fields", "_holds_its_packet",
)  # fmt: skip
_MACROS = ("LENGTH", "SIZE", "INIT")
# Macros that every package defines, without the prefix.
OUR_MACROS = frozenset({
    "ALLOW_DUMMIES", "BRACED", "DAMAGED", "DATA_FLAG", "DUMMY", "END_DEVICE", "END_HOST",
    "END_NONE", "ENTRY_ARRAY", "ENTRY_HEADER", "ENTRY_ONLY_ZERO", "ENTRY_SHARED", "ENTRY_SHORTER",
    "ENTRY_TO_BOTH", "ENTRY_TO_CONTROLLER", "ENTRY_TO_HOST", "ENTRY_UNDOCUMENTED",
    "EVENT_BAD_LENGTH", "EVENT_GARBAGE", "EVENT_MESSAGE", "EVENT_NONE", "EVENT_UNDOCUMENTED",
    "EVENT_UNKNOWN", "HEADER_SIZE", "HIGHEST_ADDRESS", "HOST", "HOST_INDEX", "KIND_COMMAND",
    "KIND_SETUP", "LAYOUTS", "LENGTH_KNOWN", "LONGEST_COMMAND", "LONGEST_FRAME",
    "LONGEST_PACKET", "LONGEST_REPLY", "MAXIMUM_LENGTH", "NATIVE", "NO_ARRAYS", "NO_NAMES",
    "NO_RANGE_CHECKS", "NO_SPACE", "NO_SUB_MESSAGE", "NO_TABLE", "OK", "OUTSTANDING",
    "OUT_OF_RANGE", "OVERHEAD", "PAYLOAD", "POISONED", "PREFIX", "REMEMBERED", "SLOTS",
    "STATIC_ASSERT", "TERMINATOR", "TOO_SHORT", "TRAILING", "WRONG_ID", "WRONG_LENGTH",
})  # fmt: skip
_STANDARD = re.compile(  # stddef.h, stdbool.h, stdint.h and its future extensions
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
            what = f"{whose}: the first {_SIGNIFICANT} characters of {name} and {other} are the same in C"
        elif its_owner != owner:
            what = f"{owner} and {its_owner} would both be named {name} in C"
        else:
            continue
        if (code, owner, its_owner) not in noted:  # report one name of each thing
            diagnostics.add(place, code, what)
            noted.add((code, owner, its_owner))


def why_no_prefix(protocol: Protocol, package: str) -> str:
    """Return why a protocol cannot use the C prefix of this package, or an empty text if it can."""
    diagnostics = Diagnostics()
    check_c_names(replace(protocol, package=package), diagnostics)
    return next((found.message for found in diagnostics), "")


def _is_kept(name: str) -> bool:
    """Whether a name is reserved in C, C++ or their headers."""
    return name in C_KEYWORDS or name in CPP_KEYWORDS or _STANDARD.fullmatch(name) is not None


def defined(protocol: Protocol) -> Iterator[tuple[str, str, Place]]:
    """Yield every name that depends on the spec, its owner, and the position of the owner."""
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
    if any(layout.array for layout in message.layouts):
        for name in layouts:
            yield from (
                f"{prefix}_{name}_{more}" for more in ("at", "count", "put", "size", "stated")
            )
            yield f"{prefix.upper()}_{name.upper()}_LONGEST"
    macros = (*_MACROS, "SIZE_SLOT") if message.kind == "command" else _MACROS
    yield f"{prefix.upper()}_{message.name}_ID"
    if message.sub_message is not None:
        yield f"{prefix.upper()}_{message.name}_SUB_MESSAGE"
    yield from (f"{prefix.upper()}_LAYOUT_{name.upper()}" for name in layouts)  # of the tests
    for alias, _ in c_aliases(message):
        yield from (f"{prefix}_{alias}{more}" for more in _OF_A_LAYOUT[:-1])
        yield from (f"{prefix.upper()}_{alias.upper()}_{macro}" for macro in _MACROS)
    for alias in message.aliases:
        yield f"{prefix.upper()}_{alias}_ID"
        if message.sub_message is not None:
            yield f"{prefix.upper()}_{alias}_SUB_MESSAGE"
    for name in dict.fromkeys([message.name, *(name.upper() for name in layouts)]):
        yield from (f"{prefix.upper()}_{name}_{macro}" for macro in macros)
