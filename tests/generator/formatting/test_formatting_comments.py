"""The canonical form of any tree, in any style and with comments anywhere, is complete and unique.

The tree is written in a random style: indentation, brackets, quotes, blank lines, line endings. Every key and
item is unique, and every comment names the one that it is above or next to.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any

import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from stagewire_generator import strict_yaml
from stagewire_generator.diagnostics import Diagnostics
from stagewire_generator.formatting import canonical
from stagewire_generator.formatting.rules import UNKNOWN

SCHEMA_LINE = "# yaml-language-server: $schema=x.json"
WORDS = st.lists(
    st.sampled_from(
        ["a", "is", "the", "of", "3.3", "0x41", "µm", "it's", '"so"', "x:", "-", "#7", "{b}"]
    ),
    min_size=1,
    max_size=40,
)


@dataclass
class Writer:
    """Writes a tree in a style drawn from ``data``, and records the comments that it inserts."""

    data: st.DataObject
    comments: dict[str, tuple[str, str]]  # comment -> its position, and the name that it belongs to

    def chance(self, percent: int) -> bool:
        return self.data.draw(st.integers(1, 100)) <= percent

    def above(self, name: str, indent: str) -> str:
        """Return blank lines and comments above an entry."""
        text = ""
        for _ in range(self.data.draw(st.integers(0, 2))):
            if self.chance(30):
                text += self.data.draw(st.sampled_from(["\n", "\n\n"]))
            if self.chance(30):
                text += f"{indent}{self.comment('above', name)}\n"
        return text

    def beside(self, name: str) -> str:
        """Return the end of a line, with or without a comment."""
        blanks = self.data.draw(st.sampled_from(["", "  "]))
        return (
            f"{blanks or ' '}{self.comment('beside', name)}\n" if self.chance(15) else f"{blanks}\n"
        )

    def comment(self, where: str, name: str) -> str:
        text = f"# {len(self.comments)} {where} {name}: - 'quote \"d [x, {{y"
        self.comments[text] = (where, name)
        return text

    def text(self, text: str) -> str:
        """Return a text in one of its possible styles."""
        styles = ["'" + text.replace("'", "''") + "'", '"' + text.replace('"', '\\"') + '"']
        if re.fullmatch(r"[a-z][\w ]*", text):
            styles.append(text)
        return self.data.draw(st.sampled_from(styles))

    def block(self, value: Any, indent: str, name: str) -> str:
        """Return the text after a colon or dash."""
        if isinstance(value, (dict, list)):
            if not value or self.chance(25):
                return f" {self.flow(value, indent + ' ', name)}{self.beside(name)}"
            deeper = indent + " " * self.data.draw(
                st.integers(0 if isinstance(value, list) else 1, 4)
            )
            inner = self.entries(value, deeper)
            return f"{self.beside(name)}{inner}"
        if isinstance(value, str):
            words = value.split(" ")
            if self.chance(20) and all(words):
                deeper = indent + " " * self.data.draw(st.integers(1, 4))
                end = self.data.draw(st.integers(1, len(words)))
                lines = [" ".join(words[:end]), " ".join(words[end:])]
                return f" >-{self.beside(name)}" + "".join(
                    f"{deeper}{line}\n" for line in lines if line
                )
            return f" {self.text(value)}{self.beside(name)}"
        return f" {self.number(value)}{self.beside(name)}"

    def number(self, value: int) -> str:
        return self.data.draw(st.sampled_from([f"{value}", f"0x{value:x}", f"0x{value:05X}"]))

    def entries(self, value: Any, indent: str) -> str:
        text = ""
        if isinstance(value, dict):
            for key, inner in value.items():
                text += self.above(key, indent)
                text += f"{indent}{self.text(key)}:{self.block(inner, indent, key)}"
            return text
        for item in value:
            name = item if isinstance(item, str) else next(iter(item))
            text += self.above(name, indent)
            text += f"{indent}-{self.block(item, indent + ' ', name)}"
        return text

    def flow(self, value: Any, indent: str, name: str) -> str:
        """Return a value in brackets, on one or more lines, with comments in between."""
        if isinstance(value, dict):
            items = [
                (key, f"{self.text(key)}: {self.flow(v, indent, key)}") for key, v in value.items()
            ]
            opening, closing = "{", "}"
        elif isinstance(value, list):
            names = [item if isinstance(item, str) else next(iter(item)) for item in value]
            items = [(n, self.flow(item, indent, n)) for n, item in zip(names, value, strict=True)]
            opening, closing = "[", "]"
        else:
            return self.text(value) if isinstance(value, str) else self.number(value)
        if self.chance(60):
            return opening + ", ".join(text for _, text in items) + closing
        text = f"{opening}{self.beside(name)}" if self.chance(50) else opening
        for number, (key, item) in enumerate(items):
            if text.endswith("\n"):
                text += self.above(key, indent) + indent
            comma = "," if number < len(items) - 1 else ""
            text += f"{item}{comma}{self.beside(key) if self.chance(50) else ' '}"
        return f"{text}{indent if text.endswith(chr(10)) else ''}{closing}"


@st.composite
def trees(draw: st.DrawFn) -> dict[str, Any]:
    """Mappings of texts, numbers, mappings and lists, with unique keys and items."""
    count = 0

    def name() -> str:
        nonlocal count
        count += 1
        return f"name{count}"

    def value(depth: int) -> Any:
        kind = draw(st.sampled_from(["text", "number", "text", "mapping", "list", "maps"]))
        if depth == 0 or kind in ("text", "number"):
            return draw(st.integers(0, 70_000)) if kind == "number" else " ".join(draw(WORDS))
        size = draw(st.integers(0, 4))
        if kind == "mapping":
            return {name(): value(depth - 1) for _ in range(size)}
        if kind == "list":
            return [name() * draw(st.sampled_from([1, 1, 4])) for _ in range(size * 4)]
        return [
            {name(): value(depth - 1) for _ in range(draw(st.integers(1, 3)))} for _ in range(size)
        ]

    return {name(): value(3) for _ in range(draw(st.integers(1, 4)))}


def load(text: str) -> Any:
    diagnostics = Diagnostics()
    document = strict_yaml.parse(text, "test.yaml", diagnostics)
    assert document is not None, list(map(str, diagnostics))
    assert not diagnostics, list(map(str, diagnostics))
    return document.data


def canonical_form(text: str) -> str:
    return canonical(text, load(text), UNKNOWN, "x.json")


def name_of(line: str) -> str:
    """Return the first key or item of a line."""
    found = re.search(r"(?:name\d+)+", line.split("#")[0])
    return found[0] if found else ""


@pytest.mark.matrix
@settings(max_examples=150, deadline=None, phases=[Phase.generate])
@given(tree=trees(), data=st.data())
def test_formatting_keeps_all_data_and_comments(tree: dict[str, Any], data: st.DataObject) -> None:
    writer = Writer(data, {})
    text = SCHEMA_LINE + "\n\n" + writer.entries(tree, "")
    if writer.chance(30):
        text = text.replace("\n", "\r\n")
    assert load(text) == tree
    made = canonical_form(text)
    assert load(made) == tree
    assert "\r" not in made
    assert not re.search(r"[ \t]\n|\n\n\n|\n\n\Z", made)
    assert str(load(made)) == str(tree)  # in the same order
    assert canonical_form(made) == made
    lines = made.splitlines()
    for comment, (where, name) in writer.comments.items():
        [place] = [number for number, line in enumerate(lines) if line.endswith(comment)]
        if where == "beside" and name_of(lines[place]):
            assert name_of(lines[place]) == name, made
            continue
        below = filter(None, map(name_of, lines[place + 1 :]))  # a text may begin below its dash
        assert next(below, "") == name, f"{comment}\n{text}\n{made}"
