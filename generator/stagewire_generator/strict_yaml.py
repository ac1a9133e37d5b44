"""YAML without surprises: what is read is what stands there.

PyYAML parses; the values are made here, because its own rules turn ``010`` into 8, ``1:30`` into 90, ``on``
into True and a repeated key into its last value. Only text, decimal and 0x integers, true, false and null
exist. Every node keeps its place, so that whatever is wrong with it can be shown.
"""

from __future__ import annotations

import re
import unicodedata
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from stagewire_generator.diagnostics import Diagnostics, Place

__all__ = ["Document", "KeyPath", "load"]

_Loader: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)

_DECIMAL = re.compile(r"-?(0|[1-9][0-9]*)\Z")
_HEX = re.compile(r"0x[0-9A-Fa-f]+\Z")
_WORDS = {"true": True, "false": False, "null": None}
_AMBIGUOUS = re.compile(  # what is left after the forms above; linear, so that no text can stall it
    r"""(?: y|n|yes|no|on|off|~|=|<< | true|false|null              # YAML 1.1 words, odd spellings
    | [-+]?[0-9][0-9_]* | [-+]?0[oxb][0-9A-F_]*                     # octal, 1_000, +1
    | [-+]?[0-9][0-9_]*(?::[0-5]?[0-9])+(?:\.[0-9_]*)?              # sexagesimal
    | [-+]?[0-9][0-9_]*\.[0-9_]*(?:e[-+]?[0-9]+)? | [-+]?\.[0-9_]+(?:e[-+]?[0-9]+)?
    | [-+]?[0-9][0-9_]*e[-+]?[0-9]+ | [-+]?\.inf | \.nan            # floats
    | [0-9]{4}-[0-9]{1,2}-[0-9]{1,2}.*                              # dates
    )\Z""",
    re.VERBOSE | re.IGNORECASE | re.ASCII,
)
_LONGEST_NUMBER = 40  # characters
_DEEPEST = 64  # brackets and indentations around a value
_DIRECTION = frozenset("\u200e\u200f\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069\u061c")
_CONTROL = frozenset({"Cc", "Cs", "Zl", "Zp"})

KeyPath = tuple[str | int, ...]  # keys and indices, from the outermost in


@dataclass(slots=True)
class Document:
    """A loaded file: its data, and the place of every key and item."""

    name: str
    data: Any
    places: dict[KeyPath, Place]

    def place(self, *path: str | int) -> Place:
        """Return where ``path`` stands, or the nearest thing around it."""
        for end in range(len(path), 0, -1):
            found = self.places.get(path[:end])
            if found:
                return found
        return Place(self.name)


def load(
    path: Path, name: str, diagnostics: Diagnostics, *, any_character: bool = False
) -> Document | None:
    """Load a file strictly; everything that is wrong goes to ``diagnostics``.

    :param any_character: allow escaped control characters in quoted texts, which worked examples
        need: what a controller sends as text may hold anything.
    Returns None when nothing can be made of the file.
    """
    try:
        text = path.read_bytes().decode("utf-8")
    except OSError as error:
        diagnostics.add(Place(name), "SW006", f"cannot be read: {error.strerror}")
        return None
    except UnicodeDecodeError as error:
        diagnostics.add(Place(name), "SW006", f"byte {error.start} is not UTF-8")
        return None
    if not _clean(text, name, diagnostics):
        return None
    reader = _Reader(name, diagnostics, any_character)
    try:
        if not reader.scan(text):
            return None
        loader = _Loader(text)
        try:
            node = loader.get_single_node()
        finally:
            loader.dispose()
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        place = Place(name, mark.line + 1, mark.column + 1) if mark else Place(name)
        parts = [part for part in (error.context, error.problem) if part]
        diagnostics.add(place, "SW001", ", ".join(parts) or "not YAML")
        return None
    except yaml.YAMLError as error:
        diagnostics.add(Place(name), "SW001", str(error).splitlines()[0])
        return None
    if node is None:
        diagnostics.add(Place(name), "SW001", "the file is empty")
        return None
    data = reader.value(node, ())
    return Document(name, data, reader.places)


def _harmful(char: str) -> bool:
    """Whether a character could hide, reverse or break what stands around it."""
    return char in _DIRECTION or (unicodedata.category(char) in _CONTROL and char not in "\t\n")


def _clean(text: str, name: str, diagnostics: Diagnostics) -> bool:
    clean = True
    for number, line in enumerate(text.split("\n"), 1):
        if line.isascii() and line.isprintable():
            continue
        for column, char in enumerate(line, 1):
            if _harmful(char) and not (char == "\r" and column == len(line)):
                diagnostics.add(Place(name, number, column), "SW007", f"the text holds {char!r}")
                clean = False
    return clean


class _Reader:
    def __init__(self, name: str, diagnostics: Diagnostics, any_character: bool) -> None:
        self.name = name
        self.diagnostics = diagnostics
        self.any_character = any_character
        self.places: dict[KeyPath, Place] = {}

    def at(self, node: yaml.Node) -> Place:
        mark = node.start_mark
        return Place(self.name, mark.line + 1, mark.column + 1)

    def scan(self, text: str) -> bool:
        """Look for anchors, aliases and tags; return whether the values may be made.

        An alias could stand for something that holds itself, or for far more than the file; and
        whoever makes the values of a very deep file runs out of stack.
        """
        depth = 0
        fit = True
        for event in yaml.parse(text, Loader=_Loader):
            mark = event.start_mark
            place = Place(self.name, mark.line + 1, mark.column + 1) if mark else Place(self.name)
            if isinstance(event, yaml.CollectionStartEvent):
                depth += 1
                if depth > _DEEPEST:
                    self.diagnostics.add(place, "SW001", "nested too deeply")
                    return False
            elif isinstance(event, yaml.CollectionEndEvent):
                depth -= 1
            if isinstance(event, yaml.AliasEvent):
                self.diagnostics.add(place, "SW003", f"alias *{event.anchor}")
                fit = False
            elif isinstance(event, yaml.NodeEvent) and event.anchor:
                self.diagnostics.add(place, "SW003", f"anchor &{event.anchor}")
            if tag := getattr(event, "tag", None):
                self.diagnostics.add(place, "SW003", f"tag {tag}")
        return fit

    def value(self, node: yaml.Node, path: KeyPath) -> Any:
        if isinstance(node, yaml.MappingNode):
            return self.mapping(node, path)
        if isinstance(node, yaml.SequenceNode):
            items = []
            for index, item in enumerate(node.value):
                self.places[(*path, index)] = self.at(item)
                items.append(self.value(item, (*path, index)))
            return items
        assert isinstance(node, yaml.ScalarNode)
        return self.scalar(node)

    def mapping(self, node: yaml.MappingNode, path: KeyPath) -> dict[str, Any]:
        result: dict[str, Any] = {}
        for key_node, value_node in node.value:
            place = self.at(key_node)
            if not isinstance(key_node, yaml.ScalarNode):
                self.diagnostics.add(place, "SW005", "a key is a name, not a list or mapping")
                continue
            if not key_node.style and key_node.value == "<<":
                self.diagnostics.add(place, "SW003", "merge key <<")
                continue
            key = self.scalar(key_node)
            if not isinstance(key, str):
                self.diagnostics.add(place, "SW005", f"the key {key_node.value} is not text")
                continue
            if key in result:
                first = self.places[(*path, key)]
                self.diagnostics.add(
                    place, "SW002", f"{key} stands here again (first in line {first.line})"
                )
                continue
            self.places[(*path, key)] = place
            result[key] = self.value(value_node, (*path, key))
        return result

    def scalar(self, node: yaml.ScalarNode) -> Any:
        text: str = node.value
        if node.style:  # quoted or a block: text, whatever it looks like
            if not self.any_character:
                for char in filter(_harmful, text):
                    self.diagnostics.add(self.at(node), "SW007", f"the text holds {char!r}")
            return text
        if text in _WORDS:
            return _WORDS[text]
        if text == "":
            return None
        hexadecimal = _HEX.match(text)
        if hexadecimal or _DECIMAL.match(text):
            if len(text) > _LONGEST_NUMBER:
                found = f"a number of {len(text)} characters"
                self.diagnostics.add(self.at(node), "SW004", found)
                return 0
            return int(text, 16 if hexadecimal else 10)
        if _AMBIGUOUS.match(text):
            shown = text if len(text) <= _LONGEST_NUMBER else f"{text[:_LONGEST_NUMBER]}..."
            self.diagnostics.add(
                self.at(node), "SW004", f"{shown} is read as text, number, date or yes/no by turns"
            )
        return text
