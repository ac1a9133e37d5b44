"""From the text of a file to its canonical form, with the proof that nothing is lost."""

from __future__ import annotations

from collections import Counter
from typing import Any

from ruamel.yaml.error import YAMLError

from stagewire_generator.diagnostics import Diagnostics
from stagewire_generator.formatting.layout import lay_out
from stagewire_generator.formatting.place import SCHEMA_LINE
from stagewire_generator.formatting.reading import comments, read
from stagewire_generator.formatting.rules import canonicalise
from stagewire_generator.formatting.shape import Shape
from stagewire_generator.formatting.tree import BLANK, Collection
from stagewire_generator.strict_yaml import parse

__all__ = ["NotFormattedError", "canonical"]


class NotFormattedError(Exception):
    """A file whose canonical form cannot be given; the text says why."""


def canonical(text: str, data: Any, shape: Shape, schema: str) -> str:
    """Return the canonical form of a file.

    :param text: what the strict loader takes.
    :param data: what the strict loader makes of it.
    :param shape: what its schema says.
    :param schema: where its schema lies, for the first line.
    Raises :class:`NotFormattedError` rather than to change data or to lose a comment.
    """
    text = text.replace("\r\n", "\n").rstrip() + "\n"
    try:
        root = read(text)
    except YAMLError as error:
        raise NotFormattedError(f"readers of YAML disagree on it: {_first_line(error)}") from None
    if not (isinstance(root, Collection) and root.mapping and root.entries):
        raise NotFormattedError("it is no mapping with entries")
    header = [f"# yaml-language-server: $schema={schema}", *_header(root)]
    canonicalise(root, shape)
    made = "\n".join(lay_out(root, header)) + "\n"
    _prove(made, text, data)
    return made


def _first_line(error: YAMLError) -> str:
    return str(getattr(error, "problem", None) or error).splitlines()[0]


def _header(root: Collection) -> list[str]:
    """Take the comments that are about the file from above its first entry.

    They end at the last blank line; where there is none, all are about the file.
    """
    first = root.entries[0]
    lines = [line for line in first.before if not SCHEMA_LINE.fullmatch(line)]
    end = len(lines) - lines[::-1].index(BLANK) if BLANK in lines else len(lines)
    header, first.before = lines[:end], lines[end:]
    return header


def _prove(made: str, text: str, data: Any) -> None:
    """Make sure that the canonical form says the same, in data and in comments."""
    diagnostics = Diagnostics()
    document = parse(made, "", diagnostics, any_byte=True)
    if document is None or diagnostics or not _same(document.data, data):
        raise NotFormattedError("its canonical form would not say the same; please report this")
    if made != text and _said(made) != _said(text):
        raise NotFormattedError("its canonical form would lose a comment; please report this")


def _said(text: str) -> Counter[str]:
    return Counter(comment for comment in comments(text) if not SCHEMA_LINE.fullmatch(comment))


def _same(one: Any, other: Any) -> bool:
    """Whether two values are the same; unlike ``==``, 1 is not true. The order of keys may differ."""
    if type(one) is not type(other):
        return False
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(_same(one[key], other[key]) for key in one)
    if isinstance(one, list):
        return len(one) == len(other) and all(map(_same, one, other))
    return bool(one == other)
