"""A strict YAML loader.

PyYAML only parses. The values are built here, because PyYAML reads ``010`` as 8, ``1:30`` as 90 and ``on`` as
True, and keeps only the last of repeated keys. The only values are text, decimal and 0x integers, true, false
and null. Every node keeps its position for diagnostics.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml

from stagewire_generator.diagnostics import Diagnostics, Place
from stagewire_generator.files import NotReadError, content

_Loader: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
_Scalar = yaml.ScalarEvent

_DECIMAL = re.compile(r"-?(0|[1-9][0-9]*)\Z")
_HEX = re.compile(r"0x[0-9A-Fa-f]+\Z")
_WORDS = {"true": True, "false": False, "null": None}
_AMBIGUOUS = re.compile(  # anything not matched above; linear time for every text
    r"""(?: y|n|yes|no|on|off|~|=|<< | true|false|null              # YAML 1.1 words, odd spellings
    | [-+]?[0-9][0-9_]* | [-+]?0[oxb][0-9A-F_]*                     # octal, 1_000, +1
    | [-+]?[0-9][0-9_]*(?::[0-5]?[0-9])+(?:\.[0-9_]*)?              # sexagesimal
    | [-+]?[0-9][0-9_]*\.[0-9_]*(?:e[-+]?[0-9]+)? | [-+]?\.[0-9_]+(?:e[-+]?[0-9]+)?
    | [-+]?[0-9][0-9_]*e[-+]?[0-9]+ | [-+]?\.inf | \.nan            # floats
    | [0-9]{4}-[0-9]{1,2}-[0-9]{1,2}.*                              # dates
    )\Z""",
    re.VERBOSE | re.IGNORECASE | re.ASCII,
)
# First characters of the forms and words above and of ambiguous texts; most texts begin otherwise.
_MAY_BE_NO_TEXT = frozenset("0123456789+-.~=<yYnNoOtTfF")
_LONGEST_WORD = len("false")  # of those in YAML 1.1 that are not text
_LONGEST_NUMBER = 40  # characters
_DEEPEST = 64  # brackets and indentations around a value
_HIDDEN = frozenset({"Cc", "Cf", "Cs", "Zl", "Zp"})  # Cf: direction marks, joiners, byte order mark

KeyPath = tuple[str | int, ...]  # keys and indices, from the outermost in
_Mark = tuple[str, Any]
"""A file and a mark of PyYAML in it; converted to a Place only on demand, as most are never needed."""


@dataclass(slots=True)
class Document:
    """A loaded file: its data, and the position of every key and item."""

    name: str
    data: Any
    places: dict[KeyPath, _Mark]
    overlay: str = ""  # name of the overlay that the file belongs to
    sources: dict[str, str] = field(default_factory=dict)  # file that added to it -> its overlay

    def place(self, *path: str | int) -> Place:
        """Return the position of ``path``, or of its nearest known parent."""
        mark = self._mark(path)
        return _place(*mark) if mark else Place(self.name)

    def overlay_of(self, *path: str | int) -> str:
        """Return the overlay that ``path`` is from, or an empty text."""
        if not self.sources:
            return self.overlay
        mark = self._mark(path)
        return self.sources.get(mark[0] if mark else self.name, self.overlay)

    def _mark(self, path: KeyPath) -> _Mark | None:
        """Return the mark of ``path``, or of its nearest known parent."""
        mark = self.places.get(path)
        while mark is None and path:
            path = path[:-1]
            mark = self.places.get(path)
        return mark


def _place(name: str, mark: Any) -> Place:
    return Place(name, mark.line + 1, mark.column + 1)


def load(
    path: Path, name: str, diagnostics: Diagnostics, *, any_byte: bool = False
) -> Document | None:
    """Load a file strictly and add all errors to ``diagnostics``.

    :param any_byte: allow escaped control characters up to U+00FF in quoted texts. Worked examples need
        them, because text from a controller may contain any byte.
    Returns None if the file cannot be used.
    """
    text = text_of(path, name, diagnostics)
    return None if text is None else parse(text, name, diagnostics, any_byte=any_byte)


def text_of(path: Path, name: str, diagnostics: Diagnostics) -> str | None:
    """Return the text of a file, or None, with a diagnostic, if it cannot be read."""
    try:
        return content(path).decode("utf-8")
    except NotReadError as error:
        diagnostics.add(Place(name), "SW008", str(error))
    except OSError as error:
        diagnostics.add(Place(name), "SW006", f"cannot read the file: {error.strerror}")
    except UnicodeDecodeError as error:
        diagnostics.add(Place(name), "SW006", f"not UTF-8: invalid byte at offset {error.start}")
    return None


def parse(
    text: str, name: str, diagnostics: Diagnostics, *, any_byte: bool = False
) -> Document | None:
    """Load a text in the same way as :func:`load` loads a file."""
    if not _clean(text, name, diagnostics):
        return None
    reader = _Reader(name, text, diagnostics, any_byte)
    try:
        data = reader.document()
    except _TooDeepError as error:
        diagnostics.add(error.place, "SW001", "nested too deeply")
        return None
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        place = Place(name, mark.line + 1, mark.column + 1) if mark else Place(name)
        parts = [part for part in (error.context, error.problem) if part]
        lines = text.split("\n")
        if mark and mark.line < len(lines) and lines[mark.line].startswith("\t", mark.column):
            parts = ["a tab where YAML allows only spaces"]
        diagnostics.add(place, "SW001", ", ".join(parts) or "invalid YAML")
        return None
    except yaml.YAMLError as error:
        diagnostics.add(Place(name), "SW001", str(error).splitlines()[0])
        return None
    return Document(name, data, reader.places) if reader.fit else None


def is_plain_text(text: str) -> bool:
    """Whether every YAML reader reads unquoted ``text`` as text; syntax is not checked."""
    return text != "" and not _AMBIGUOUS.match(text)


def _harmful(char: str) -> bool:
    """Whether a character could hide, reverse or break the text around it."""
    return unicodedata.category(char) in _HIDDEN and char not in "\t\n"


def _clean(text: str, name: str, diagnostics: Diagnostics) -> bool:
    if text.replace("\n", "").isprintable():
        return True  # harmful characters are not printable
    clean = True
    for number, line in enumerate(text.split("\n"), 1):
        if line.isprintable():
            continue
        for column, char in enumerate(line, 1):
            if _harmful(char) and not (char == "\r" and column == len(line)):
                at_top = char == "\ufeff" and (number, column) == (1, 1)
                hint = "save the file as UTF-8 without a byte order mark" if at_top else ""
                found = f"the text contains {char!r}"
                diagnostics.add(Place(name, number, column), "SW007", found, hint)
                clean = False
    return clean


class _TooDeepError(Exception):
    """A value is nested more deeply than any spec needs."""

    def __init__(self, place: Place) -> None:
        super().__init__(place)
        self.place = place


class _Reader:
    """Builds the values of one file from the events of the parser, in one pass."""

    def __init__(self, name: str, text: str, diagnostics: Diagnostics, any_byte: bool) -> None:
        self.name = name
        self.diagnostics = diagnostics
        self.any_byte = any_byte
        self.places: dict[KeyPath, _Mark] = {}
        self.fit = True  # whether the values represent the file
        self.depth = 0
        self.event: Callable[[], yaml.Event] = _Loader(text).get_event

    def document(self) -> Any:
        """Return the value of the only document."""
        self.event()  # the stream begins
        if isinstance(self.event(), yaml.StreamEndEvent):
            self.problem(Place(self.name), "the file is empty")
            return None
        data = self.value(self.next(), ())
        if self.fit:
            self.event()  # the document ends
            event = self.event()
            if not isinstance(event, yaml.StreamEndEvent):
                self.problem(
                    self.at(event), "a second document begins here; a file must contain only one"
                )
        return data

    def problem(self, place: Place, text: str) -> None:
        """Report an error that makes the whole file unusable."""
        self.diagnostics.add(place, "SW001", text)
        self.fit = False

    def at(self, event: yaml.Event) -> Place:
        return _place(self.name, event.start_mark)

    def next(self) -> yaml.Event:
        """Return the next event of a value, after checking it for anchors, aliases and tags.

        An alias could refer to a value that contains it, or expand to far more than the file; and
        building a very deep value would exhaust the stack.
        """
        event = self.event()
        if event.__class__ is _Scalar and event.anchor is None and event.tag is None:
            return event  # nearly all of them
        self.depth += isinstance(event, yaml.CollectionStartEvent)
        self.depth -= isinstance(event, yaml.CollectionEndEvent)
        if self.depth > _DEEPEST:
            raise _TooDeepError(self.at(event))
        if isinstance(event, yaml.NodeEvent):
            if isinstance(event, yaml.AliasEvent):
                self.diagnostics.add(self.at(event), "SW003", f"alias *{event.anchor}")
                self.fit = False
            elif event.anchor:
                self.diagnostics.add(self.at(event), "SW003", f"anchor &{event.anchor}")
            if tag := getattr(event, "tag", None):
                self.diagnostics.add(self.at(event), "SW003", f"tag {tag}")
        return event

    def skip(self, event: yaml.Event) -> None:
        """Skip the rest of a value that is not used."""
        if isinstance(event, yaml.CollectionStartEvent):
            around = self.depth - 1
            while self.depth > around:
                self.next()

    def value(self, event: yaml.Event, path: KeyPath) -> Any:
        if event.__class__ is _Scalar:
            return self.scalar(event)
        if isinstance(event, yaml.AliasEvent):
            return None
        if isinstance(event, yaml.MappingStartEvent):
            return self.mapping(path)
        items: list[Any] = []
        while (event := self.next()).__class__ is not yaml.SequenceEndEvent:
            item = (*path, len(items))
            self.places[item] = self.name, event.start_mark
            items.append(self.value(event, item))
        return items

    def mapping(self, path: KeyPath) -> dict[str, Any]:
        result: dict[str, Any] = {}
        while (event := self.next()).__class__ is not yaml.MappingEndEvent:
            key = self.key(event, result, path)
            if key is None:
                self.skip(event)
                self.skip(self.next())
            else:
                inner = (*path, key)
                self.places[inner] = self.name, event.start_mark
                result[key] = self.value(self.next(), inner)
        return result

    def key(self, event: yaml.Event, before: dict[str, Any], path: KeyPath) -> str | None:
        """Return a key of a mapping, or None if it is invalid."""
        if event.__class__ is not _Scalar:
            self.diagnostics.add(
                self.at(event), "SW005", "a key must be a name, not a list or mapping"
            )
            return None
        text: str = event.value
        if not event.style and text and text[0] not in _MAY_BE_NO_TEXT and text not in before:
            return text  # nearly all of them
        if not event.style and event.value == "<<":
            self.diagnostics.add(self.at(event), "SW003", "merge key <<")
            return None
        key = self.scalar(event)
        if not isinstance(key, str):
            self.diagnostics.add(self.at(event), "SW005", f"the key {event.value} is not text")
            return None
        if key in before:
            _, first = self.places[(*path, key)]
            what = f"duplicate key {key} (first on line {first.line + 1})"
            self.diagnostics.add(self.at(event), "SW002", what)
            return None
        return key

    def scalar(self, event: yaml.ScalarEvent) -> Any:
        text: str = event.value
        if event.style:  # quoted or a block: always text
            if text.isprintable():
                return text  # harmful characters are not printable
            for char in filter(_harmful, text):
                if not self.any_byte or char > "\xff":
                    self.diagnostics.add(self.at(event), "SW007", f"the text contains {char!r}")
            return text
        if text == "":
            return None
        if text[0] not in _MAY_BE_NO_TEXT:
            return text
        if text in _WORDS:
            return _WORDS[text]
        if text[0].isalpha() and len(text) > _LONGEST_WORD:
            return text
        hexadecimal = text.startswith("0x") and _HEX.match(text)
        if hexadecimal or _DECIMAL.match(text):
            if len(text) > _LONGEST_NUMBER:
                found = f"a number of {len(text)} characters; at most {_LONGEST_NUMBER} are allowed"
                self.diagnostics.add(self.at(event), "SW004", found)
                return 0
            return int(text, 16 if hexadecimal else 10)
        if _AMBIGUOUS.match(text):
            shown = text if len(text) <= _LONGEST_NUMBER else f"{text[:_LONGEST_NUMBER]}..."
            what = (
                f"{shown}: YAML readers differ on whether this is text, a number, a date or yes/no"
            )
            small = text.lower()
            hint = f"write {small}, or quote it if it is text" if _HEX.match(small) else ""
            self.diagnostics.add(self.at(event), "SW004", what, hint)
        return text
