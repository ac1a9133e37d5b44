"""Hostile texts and names that try to break out of strings, comments, folders, files and terminals.

A payload with code creates the file ``pwned`` in the working folder of the process that executes it.
"""

from __future__ import annotations

import builtins
import keyword
from typing import Any

import pytest
from _pytest.mark import ParameterSet


def part_or_all(part: Any, whole: Any) -> list[ParameterSet]:
    """Return the parameters of a test: some payloads in every run, all of them in the matrix."""
    return [
        pytest.param(part, id="a part"),
        pytest.param(whole, id="all", marks=pytest.mark.matrix),
    ]


SENTINEL = "pwned"
CODE = f'__import__("pathlib").Path("{SENTINEL}").touch()'

# Strings that could end a text or begin other syntax, tried at its start, in its middle and at its end.
ENDS = [
    '"',
    "'",
    '"""',
    "'''",
    '""""',
    '"""""""',
    '"\'"',
    "'\"'",
    "\\",
    "\\\\",
    '\\"',
    '\\"""',
    '"""\\',
    "*/",
    "/*",
    "*??/",
    "//",
    "#",
    "??/",
    "]]>",
    "--",
]
# Texts that are tried alone.
VISIBLE = [
    f'"""\n{CODE}\n"""'.replace("\n", "; "),
    f'"; {CODE} #',
    f"'+{CODE}+'",
    f'"); {CODE} #',
    f'"""; {CODE} #',
    f"\\n{CODE}",
    f"*/ system({SENTINEL!r}); /*",
    f"// {SENTINEL} ??/",
    f"#include <{SENTINEL}.h>",
    f"${{{CODE}}} $({CODE}) `{CODE}`",
    CODE,
    f"__import__('os').system('touch {SENTINEL}')",
    "{{ 7 * 7 }}",
    f"{{{{ cycler.__init__.__globals__.os.system('touch {SENTINEL}') }}}}",
    "{% raw %}",
    "{% include 'plain.py.j2' %}",
    "{# no #}",
    "{} {0} {x!r} {self.__class__}",
    "%s %(a)d %n %",
    "\\N{DASH} \\x4 \\u12 \\101 \\0",
    "# coding: rot13",
    "# -*- coding: utf-7 -*-",
    "# fmt: off",
    "# type: ignore # noqa",
    "<script>alert(1)</script> &amp; <!--",
    "[red]x[/red] [/] [link=file:///etc/passwd]y[/link] :boom:",
    "^[[31m \\x1b[31m \\033[2J",
    "../../x",
    "/etc/x",
    "C:\\x",
    "\\\\server\\share",
    "~/x",
    "file:///etc/passwd",
    "con",
    "NUL.txt",
    "__class__",
    "`` :class:`~x` |y|_",
    "a  b",
    " a ",
    "-",
    ".",
    "null",
    "010",
    "1:30",
    "!!python/object/apply:os.system [id]",
    "*alias &anchor <<",
    "é µ × ² ‑",
    "字字字 😀",
    "\uff41\uff42 \u212a \ufb01 e\u0301",  # in a name, Python reads these as ab, K and fi
    "ß ss ı i İ",
    "\u00a0x\u3000y",
    "x" * 10_000,
    "x, " * 3_000,
]
FORMS = [
    lambda nasty: nasty,
    lambda nasty: f"{nasty}x",
    lambda nasty: f"x{nasty}",
    lambda nasty: f"x {nasty} y",
    lambda nasty: f"{nasty} and " * 5 + nasty,
]
TEXTS = [*dict.fromkeys([form(nasty) for nasty in ENDS for form in FORMS] + VISIBLE)]

# Characters that no text may contain, raw or escaped.
HIDDEN = {
    "line feed and code": f"x\n{CODE}\n",
    "carriage return": f"x\r{CODE}",
    "tab": "x\ty",
    "form feed": f"x\f{CODE}",
    "nul": "x\0y",
    "escape": "x\x1b[31my\x1b]0;z\x07",
    "delete": "x\x7fy",
    "next line": f"x\x85{CODE}",
    "control sequence introducer": "x\x9b31my",
    "line separator": f"x\u2028{CODE}",
    "paragraph separator": f"x\u2029{CODE}",
    "right to left override": "x\u202ey",
    "isolate": "x\u2066y\u2069",
    "left to right mark": "x\u200ey",
    "arabic letter mark": "x\u061cy",
    "zero width joiner": "x\u200dy",
    "zero width space": "x\u200by",
    "byte order mark": "x\ufeffy",
    "byte order mark at the start": "\ufeffx",
    "word joiner": "x\u2060y",
    "soft hyphen": "x\u00ady",
    "annotation": "x\ufff9y",
    "tag": "x\U000e0041y",
}

# Names that are reserved by a language, an operating system or the generated code.
_PYTHON = [
    *keyword.kwlist,
    *keyword.softkwlist,
    "self",
    "cls",
    "mro",
    "real",
    "__class__",
    "TypeError",
]
_PYTHON += [name for name in dir(builtins) if name.islower()]
_C = [
    "auto", "break", "case", "char", "const", "continue", "default", "do", "double", "else", "enum",
    "extern", "float", "for", "goto", "if", "inline", "int", "long", "register", "restrict", "return",
    "short", "signed", "sizeof", "static", "struct", "switch", "typedef", "union", "unsigned", "void",
    "volatile", "while", "_Alignas", "_Alignof", "_Atomic", "_Bool", "_Complex", "_Generic", "_Imaginary",
    "_Noreturn", "_Static_assert", "_Thread_local", "alignas", "alignof", "bool", "constexpr", "false",
    "nullptr", "static_assert", "thread_local", "true", "typeof", "typeof_unqual", "asm", "fortran",
    "NULL", "EOF", "errno", "stdin", "stdout", "assert", "offsetof", "size_t", "int8_t", "uint32_t",
    "main", "va_list", "linux", "unix",
]  # fmt: skip
_CPP = [
    "and", "and_eq", "asm", "atomic_cancel", "bitand", "bitor", "catch", "char8_t", "char16_t",
    "char32_t", "class", "co_await", "co_return", "co_yield", "compl", "concept", "const_cast",
    "consteval", "constinit", "decltype", "delete", "dynamic_cast", "explicit", "export", "final",
    "friend", "import", "module", "mutable", "namespace", "new", "noexcept", "not", "not_eq", "operator",
    "or", "or_eq", "override", "private", "protected", "public", "reinterpret_cast", "requires",
    "static_cast", "std", "template", "this", "throw", "try", "typeid", "typename", "using", "virtual",
    "wchar_t", "xor", "xor_eq",
]  # fmt: skip
_OURS = [
    "layout", "pack", "unpack", "values", "keep", "replace", "shared", "data", "param1", "param2", "raw",
    "draft", "value", "frame", "dest", "source", "_draft", "_new", "_pack", "_unpack", "__slots__",
    "__match_args__", "__init_subclass__", "Message", "Layout", "Direction", "ClassVar", "Self", "Struct",
    "UndecidedMessage", "UndocumentedMessage", "Protocol", "Frame", "Bit", "Flags", "Enumeration",
    "Scale", "Stage", "UnknownScale", "check_integer", "check_text", "check_bytes", "check_addresses",
    "MESSAGES", "PROTOCOL", "decode", "messages", "enumerations", "flags", "stages", "registry",
    "vectors", "bits", "of", "names", "unnamed", "layout_flags", "stagewire", "struct", "typing", "sys",
    "os", "enum", "fractions", "serial", "Command", "Reply", "SetupCommand", "setup_command",
    "FramedMessage", "framed_message", "FramedProtocol", "framed_protocol", "CommandProtocol",
    "command_protocol", "undecided_message", "undocumented_message", "marks", "axis", "allow_dummy",
    "from_bytes", "to_bytes", "little", "M_E_S_S_A_G_E_S", "P_R_O_T_O_C_O_L", "quantities",
    "PacketMessage", "packet_message", "packet_protocol", "Packet", "shape", "Shape", "crc", "sum", "xor",
]  # fmt: skip
_SYSTEM = [
    "con",
    "prn",
    "aux",
    "nul",
    "com1",
    "lpt9",
    "CON",
    "desktop.ini",
    ".git",
    "..",
    ".",
    "-rf",
]
_UNICODE = ["ｉｄ", "ﬁeld", "K", "ß", "ı", "İ", "naïve", "аbc", "x\u0301"]
_SHAPES = [
    "x", "x_", "_x", "__x", "_X", "x__y", "x-y", "x y", "x.y", "x/y", "x\\y", "x:y", "0x", "0", "1e5",
    "Foo", "FOO", "foo", "f_oo", "x" * 79, "x" * 10_000, "",
]  # fmt: skip
NAMES = [*dict.fromkeys([*_PYTHON, *_C, *_CPP, *_OURS, *_SYSTEM, *_UNICODE, *_SHAPES])]

# Payloads for one place at a time: texts, and names that are valid in some places only.
EVERYWHERE = [
    *VISIBLE, *HIDDEN.values(), "", "x", "X", "X1", "x_y", "X_Y", "x-y", "x__y", "class", "CLASS", "None",
    "layout", "__init__", "_X", "ｉｄ", "ß", "ı", "0x1F", "1", "1/3", "00", "00 " * 800 + "00", "1**9**9**9",
]  # fmt: skip
