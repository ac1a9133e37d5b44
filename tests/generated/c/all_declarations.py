"""A C file that uses all declarations of the headers of a package."""

from __future__ import annotations

import re

from toolchain import Package


def everything(package: Package) -> str:
    """Return a file that uses every function, initialiser and length of a package.

    The table of addresses makes a compiler emit all functions, which are ``static inline``.
    """
    text = "".join(path.read_text(encoding="utf-8") for path in package.headers())
    defined = set(re.findall(r"^#define (\w+)", text, re.MULTILINE))
    lines = [*map(package.include, package.headers())]
    for name in package.layouts():
        macro = name.upper()
        if f"{macro}_INIT" in defined:
            lines.append(f"extern const {name} {name}_initial;")
            lines.append(f"const {name} {name}_initial = {macro}_INIT;")
        for number in {f"{macro}_ID", f"{macro}_LENGTH", f"{macro}_SIZE"} & defined:
            lines.append(f"extern uint8_t of_{number.lower()}[{number} + 1];")
    lines += ["typedef void (*any_function)(void);", "extern const any_function functions[];"]
    lines += ["const any_function functions[] = {"]
    lines += [f"    (any_function){name}," for name in package.functions()]
    return "\n".join([*lines, "};", ""])
