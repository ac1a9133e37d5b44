"""Pieces of Python source: each is what a formatter would write, and means the text that it was made of."""

from __future__ import annotations

import ast

import pytest

from stagewire_generator.targets.documentation import sentence
from stagewire_generator.targets.python.source import (
    assigned,
    bracketed,
    call,
    docstring,
    imported,
    integer,
    list_of,
    literal,
    long_text,
    natural,
    paragraph,
    tuple_of,
    width,
)

TEXTS = [
    "",
    "a",
    'say "it"',
    "it's",
    '"it\'s"',
    "\\",
    "a\\",
    "\x00\x1b\x7f",
    "\u202e",
    "é字😀",
    "\n",
]


@pytest.mark.parametrize("text", TEXTS)
def test_a_literal_is_its_text(text: str) -> None:
    source = literal(text)
    assert ast.literal_eval(source) == text
    assert source.isprintable()


@pytest.mark.parametrize(
    ("text", "source"),
    [
        ("a", '"a"'),
        ("it's", '"it\'s"'),
        ('"', "'\"'"),
        ("'\"", '"\'\\""'),  # as many of each: the usual quotes
        ("\x1b", '"\\x1b"'),
    ],
)
def test_quotes_as_a_formatter_chooses_them(text: str, source: str) -> None:
    assert literal(text) == source


@pytest.mark.parametrize("text", [*TEXTS, '"""', 'a"""b', 'a""""', '"a', "\\x41", '\\"""'])
def test_a_docstring_is_its_text(text: str) -> None:
    if "\x00" not in text:  # no source can hold it; what prints nothing is refused before
        assert ast.literal_eval(f'"""{docstring(text)}"""') == text


def test_columns() -> None:
    assert [width(text) for text in ("abc", "é", "e\u0301", "字", "😀", "a字b")] == [
        3,
        1,
        1,
        2,
        2,
        4,
    ]


@pytest.mark.parametrize(
    ("value", "source"),
    [
        (0, "0"),
        (-1, "-1"),
        (255, "0xFF"),
        (256, "256"),
        (65535, "0xFFFF"),
        (32767, "0x7FFF"),
        (-32768, "-0x8000"),
        (2**31 - 1, "0x7FFFFFFF"),
        (-(2**31), "-0x80000000"),
        (2**32 - 1, "0xFFFFFFFF"),
    ],
)
def test_limits_of_a_width_are_hexadecimal(value: int, source: str) -> None:
    assert integer(value) == source


def test_tuples_and_lists() -> None:
    assert [tuple_of(items) for items in ([], ["1"], ["1", "2"])] == ["()", "(1,)", "(1, 2)"]
    assert list_of([]) == "[]"
    assert list_of(["1", "2"]) == "[1, 2]"
    longest = "x" * 88  # `__all__ = [` stands before it, and `]` behind it
    assert list_of([longest]) == f"[{longest}]"
    assert list_of([longest + "x"]) == f"[\n    {longest}x,\n]"


def test_brackets_break_beyond_the_limit() -> None:
    assert bracketed("f(", ["a", "b"], ")", 4, 12) == "f(a, b)"
    assert bracketed("f(", ["a", "b"], ")", 5, 12) == "f(a, b)"
    assert bracketed("f(", ["a", "b"], ")", 6, 12) == "f(\n          a,\n          b,\n      )"
    assert bracketed("f(", [], ")", 90, 0) == "f()"
    assert call("f", ["a"], ".x", 0) == "f(a).x"
    fits = "x" * 97
    assert call("f", [fits], "", 0) == f"f({fits})"
    assert call("f", [fits], "", 1) == f"f(\n     {fits},\n )"


def test_assignments_break_beyond_the_limit() -> None:
    assert assigned("a", "b", 8) == "a = b"
    fits = "x" * 88  # and 8 of indent, and `a = `
    assert assigned("a", fits, 8) == f"a = {fits}"
    assert assigned("a", fits + "x", 8) == f"a = (\n            {fits}x\n        )"


def test_paragraphs() -> None:
    text = "word " * 30
    lines = paragraph(text, 4).split("\n")
    assert [len(line) for line in lines] == [94, 58]
    assert lines[1].startswith("    word")
    assert paragraph(text, 4, 4).split("\n")[1].startswith("        word")
    assert paragraph(" a \n  b ", 0) == "a b"
    assert paragraph("", 4) == ""
    for whole in ("x" * 200, "a-b-" * 50):  # a name that is broken is none any more
        assert paragraph(whole, 4) == whole


def test_sentences() -> None:
    assert sentence("a note") == "A note."
    assert sentence("A note.") == "A note."
    assert sentence("aBC") == "ABC."


@pytest.mark.parametrize("text", ["x" * 85, "x" * 86, "x" * 300, "word " * 60, "字" * 100])
def test_long_texts_are_the_same_in_pieces(text: str) -> None:
    source = long_text("", text, 10)
    assert ast.literal_eval(f"({source})") == text
    assert source.startswith("(\n") is (10 + width(literal(text)) + 1 > 100)
    assert long_text("source=", "short", 10) == 'source="short"'


def test_names_in_the_order_of_a_linter() -> None:
    assert sorted(["Bay10", "Bay2", "Bay", "A"], key=natural) == ["A", "Bay", "Bay2", "Bay10"]
    assert imported("a.b", ["check_b", "Zed", "check_a", "Abc2", "Abc10"]) == (
        "from a.b import Abc2, Abc10, Zed, check_a, check_b"
    )
    longest = "x" * 83
    assert imported("a", [longest, "b"]) == f"from a import b, {longest}"
    assert imported("a", [longest + "x", "b"]) == f"from a import (\n    b,\n    {longest}x,\n)"
