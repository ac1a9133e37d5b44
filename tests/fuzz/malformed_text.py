"""Malformed input: unsuitable values, and damage to texts, bytes and trees."""

from __future__ import annotations

from collections.abc import Callable
from random import Random
from typing import Any

WORDS = (
    "", " ", "\t", "0", "-1", "1e9", "0x", "0x1F", "0o17", "010", "1:30", "1.5", ".inf", ".nan", "1_000",
    "+5", "--", "-", "--help", "null", "~", "yes", "off", "true", "2001-01-01", "[", "]", "{", "}", "{}",
    "[]", "'", '"', "'''", '"""', "#", ": ", "- ", "? ", "| ", ">", "&a", "*a", "<<: *a", "!!python/name:os",
    "!tag", "%YAML 1.1", "---", "...", "\\", "\\n", "\\x1b", "\x1b[31m", "\x07", "\x00", "\x7f", "\x85",
    "\u2028", "\u202e", "\u200d", "\ufeff", "é", "ß", "ı", "\uff21", "𝔘", "\ud83d", "a" * 300,
    "9" * 25, "9" * 5000, "1" + "0" * 400, "[" * 60, "{" * 60 + "}", "../x", "/etc/passwd", "/", ".", "..",
    "C:\\x", "con", "nul", "a/b", "*", "?", "{{ 7 * 7 }}", "{% raw %}", "${HOME}", "$(id)", "%s%n", "{0}",
    "__import__('os')", "class", "def", "None", "self", "[red]", "[/]", "*/", "//", "??/",
    "MOT_MOVE_ABSOLUTE", "data", "header", "word", "long", "dc", "status",
)  # fmt: skip


def word(rng: Random) -> str:
    """Return a word that may be unsuitable as a value."""
    if rng.random() < 0.7:
        return rng.choice(WORDS)
    if rng.random() < 0.5:
        return str(rng.choice((1, -1)) * (1 << rng.randrange(70)) + rng.randrange(-1, 2))
    return "".join(
        chr(rng.choice((rng.randrange(32, 127), rng.randrange(0xD800)))) for _ in range(6)
    )


# Text


def damaged_text(rng: Random, text: str) -> str:
    """Return a text with one mutation of its lines, words or characters."""
    return rng.choice(_TEXT)(rng, text)


def _lines(rng: Random, text: str) -> str:
    """Delete, duplicate, swap, indent or cut lines."""
    lines = text.split("\n")
    at = rng.randrange(len(lines))
    other = rng.randrange(len(lines))
    kind = rng.randrange(6)
    if kind == 0:
        del lines[at]
    elif kind == 1:
        lines.insert(other, lines[at])
    elif kind == 2:
        lines[at], lines[other] = lines[other], lines[at]
    elif kind == 3:
        lines[at] = rng.choice(("  ", " ", "\t", "    ", "- ")) + lines[at]
    elif kind == 4:
        lines[at] = lines[at][rng.randrange(3) :]
    else:
        lines = lines[:at]
    return "\n".join(lines)


_BREAKS = " ,:;=[]{}()\n\"'"


def _words(rng: Random, text: str) -> str:
    """Replace one word."""
    start = rng.randrange(len(text) + 1)
    while start and text[start - 1] not in _BREAKS:
        start -= 1
    stop = start
    while stop < len(text) and text[stop] not in _BREAKS:
        stop += 1
    return text[:start] + word(rng) + text[stop:]


def _characters(rng: Random, text: str) -> str:
    at = rng.randrange(len(text) + 1)
    lost = rng.choice((0, 0, 1, 1, 3))
    new = rng.choice((word(rng), rng.choice(_BREAKS), ""))
    return text[:at] + new + text[at + lost :]


def _twice(rng: Random, text: str) -> str:
    start = rng.randrange(len(text) + 1)
    piece = text[start : start + rng.randrange(1, 80)]
    return text[:start] + piece * rng.choice((2, 2, 3, 40)) + text[start + len(piece) :]


def _cut(rng: Random, text: str) -> str:
    return text[: rng.randrange(len(text) + 1)]


_TEXT: tuple[Callable[[Random, str], str], ...] = (
    _lines, _lines, _words, _words, _words, _characters, _characters, _twice, _cut,
)  # fmt: skip


def damaged_bytes(rng: Random, data: bytes) -> bytes:
    """Return bytes with one mutation, such as another encoding."""
    kind = rng.randrange(6)
    at = rng.randrange(len(data) + 1)
    if kind == 0:
        return data[:at] + bytes((rng.randrange(256),)) + data[at + 1 :]
    if kind == 1:
        return data[:at] + rng.randbytes(rng.randrange(1, 5)) + data[at:]
    if kind == 2:
        return data[:at]
    if kind == 3:
        return rng.choice((b"\xef\xbb\xbf", b"\xff\xfe", b"\0", b"\r\n")) + data
    if kind == 4:
        return data.replace(b"\n", rng.choice((b"\r\n", b"\r", b"\n\n", b"\0\n")))
    return data.decode("utf-8", "replace").encode(
        rng.choice(("utf-16", "utf-32", "utf-7")), "replace"
    )


# Trees of JSON and YAML


def damaged_tree(rng: Random, tree: Any) -> Any:
    """Change one value of ``tree``, in place if possible, and return the tree."""
    places = _places(tree) if isinstance(tree, (dict, list)) else []
    if not places:
        return _other(rng, tree)
    holder, key = rng.choice(places)
    old = holder[key]
    kind = rng.randrange(8)
    if kind <= 2:
        holder[key] = _other(rng, old)
    elif kind == 3:
        del holder[key]
    elif kind == 4:  # a value from elsewhere in the tree
        other, at = rng.choice(places)
        holder[key] = _copy(other[at])
    elif kind == 5 and isinstance(old, str):
        holder[key] = damaged_text(rng, old)
    elif isinstance(holder, dict):
        renamed = rng.choice((word(rng), f"{key}_", str(key).upper(), *map(str, holder)))
        if kind == 6:
            del holder[key]
        holder[renamed] = old
    else:
        holder.insert(rng.randrange(len(holder) + 1), _copy(old))
    return tree


def _places(tree: Any) -> list[tuple[Any, Any]]:
    """Return every value of a tree as its container and its key."""
    found: list[tuple[Any, Any]] = []
    waiting = [tree]
    while waiting:
        holder = waiting.pop()
        keys = list(holder) if isinstance(holder, dict) else range(len(holder))
        for key in keys:
            found.append((holder, key))
            if isinstance(holder[key], (dict, list)):
                waiting.append(holder[key])
    return found


def _other(rng: Random, old: Any) -> Any:
    """Return another value: an unsuitable one of the same type, or one of another type."""
    kind = rng.randrange(8)
    if kind == 0:
        return rng.choice((None, True, False, [], {}, 0, "", 1.5, float("inf")))
    if kind == 1:
        return rng.choice(([_copy(old)], {"a": _copy(old)}, [old, old] if old != [] else 0))
    if kind == 2:
        return rng.choice(
            (-1, 0, 1, 255, 256, 65535, 1 << 31, 1 << 32, 1 << 64, -(1 << 31), 10**30)
        )
    if isinstance(old, int) and kind < 6:
        return int(old) + rng.choice((-1, 1, 1 << 8, 1 << 16, -int(old)))
    return word(rng)


def _copy(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _copy(item) for key, item in value.items()}
    return [_copy(item) for item in value] if isinstance(value, list) else value
