"""Words that C and C++ keep for themselves, and names of their headers that a member cannot have."""

from __future__ import annotations

__all__ = ["CPP_KEYWORDS", "C_KEYWORDS", "C_NAMES"]

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
C_NAMES = frozenset({  # macros in small letters, some of them of compilers; types of stddef.h and stdint.h
    "complex", "errno", "i386", "imaginary", "intmax_t", "intptr_t", "linux", "max_align_t", "noreturn",
    "nullptr_t", "ptrdiff_t", "size_t", "stderr", "stdin", "stdout", "uintmax_t", "uintptr_t", "unix",
    *(
        f"{sign}int{speed}{bits}_t"
        for sign in ("", "u") for speed in ("", "_fast", "_least") for bits in (8, 16, 32, 64)
    ),
})  # fmt: skip
