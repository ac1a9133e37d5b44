"""The committed table of sizes: reading, writing with a reason, and comparing."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from pathlib import Path

TABLE = Path(__file__).with_name("sizes.toml")
GROWTH = 5  # per cent

Figures = Mapping[str, int]
"""Name (``apt/parser``, ``apt/mot_move_absolute/decode``) -> size in bytes."""


def read(path: Path = TABLE) -> tuple[str, Figures]:
    """Return the compiler of the table, and its figures."""
    table = tomllib.loads(path.read_text(encoding="utf-8"))
    figures: dict[str, int] = {}
    for prefix, section in table["bytes"].items():
        for name, value in section.items():
            one = value if isinstance(value, dict) else {"": value}
            figures.update({f"{prefix}/{name}/{part}".rstrip("/"): n for part, n in one.items()})
    return table["compiler"], figures


def write(figures: Figures, compiler: str, reason: str, path: Path = TABLE) -> None:
    """Write the table; the reasons of earlier versions are kept."""
    before = tomllib.loads(path.read_text(encoding="utf-8"))["reasons"] if path.exists() else []
    lines = [
        '# Bytes on a Cortex-M0. Written by: make c-sizes REASON="why"',
        f'compiler = "{compiler}"',
        "",
        "# Why the table was renewed, the last reason at the end.",
        "reasons = [",
        *(f"    {_quoted(one)}," for one in [*before, reason]),
        "]",
    ]
    sections: dict[str, dict[str, dict[str, int]]] = {}
    for key, size in figures.items():
        prefix, name, part = (*key.split("/"), "")[:3]
        sections.setdefault(prefix, {}).setdefault(name, {})[part] = size
    for prefix, section in sections.items():
        lines += ["", f"[bytes.{prefix}]"]
        for name, parts in section.items():
            inside = ", ".join(f"{part} = {size}" for part, size in parts.items())
            lines.append(f"{name} = {parts['']}" if "" in parts else f"{name} = {{ {inside} }}")
    path.write_text("\n".join([*lines, ""]), encoding="utf-8")


def _quoted(text: str) -> str:
    """Return a text as a basic string of TOML."""
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'


def grown(table: Figures, now: Figures) -> list[str]:
    """Return the names of figures that grew too much or are missing in one of the tables."""
    found = [f"{name}: not in the table" for name in now if name not in table]
    found += [f"{name}: only in the table" for name in table if name not in now]
    for name in table.keys() & now.keys():
        if now[name] * 100 > table[name] * (100 + GROWTH):
            found.append(f"{name}: {table[name]} -> {now[name]} bytes")
    return sorted(found)
