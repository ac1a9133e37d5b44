"""Pieces of Python source: formatted as a formatter would, with the meaning of the original text."""

from __future__ import annotations

import ast

import pytest

from stagewire_generator.targets.documentation import sentence
from stagewire_generator.targets.python.brackets import (
    Text,
    assigned,
    call,
    either,
    exported,
    imported,
    laid_out,
    listed,
    mapping,
    natural,
    strings,
    unpacked,
)
from stagewire_generator.targets.python.source import docstring, integer, literal, paragraph, width

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
def test_a_literal_evaluates_to_its_text(text: str) -> None:
    source = literal(text)
    assert ast.literal_eval(source) == text
    assert source.isprintable()


@pytest.mark.parametrize(
    ("text", "source"),
    [
        ("a", '"a"'),
        ("it's", '"it\'s"'),
        ('"', "'\"'"),
        ("'\"", '"\'\\""'),  # the same number of both: double quotes
        ("\x1b", '"\\x1b"'),
    ],
)
def test_quotes_as_a_formatter_chooses_them(text: str, source: str) -> None:
    assert literal(text) == source


@pytest.mark.parametrize("text", [*TEXTS, '"""', 'a"""b', 'a""""', '"a', "\\x41", '\\"""'])
def test_a_docstring_evaluates_to_its_text(text: str) -> None:
    if "\x00" not in text:  # no source can contain it; unprintable texts are refused earlier
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
def test_limits_of_a_width_are_in_hex(value: int, source: str) -> None:
    assert integer(value) == source


def test_tuples() -> None:
    assert [laid_out(strings("", names), 0) for names in ([], ["a"], ["a", "b"])] == [
        "()",
        '("a",)',
        '("a", "b")',
    ]
    assert laid_out(listed("T = ", ["A"]), 0) == "T = (A,)"
    assert laid_out(listed("T = ", ["A", "B"]), 0) == "T = (\n    A,\n    B,\n)"


def test_long_lists_of_exports_are_broken() -> None:
    assert exported([]) == "__all__ = []"
    assert exported(["b", "Aa", "C10", "C2x", "XY"]) == '__all__ = ["C10", "XY", "Aa", "C2x", "b"]'
    longest = "x" * 86
    assert exported([longest]) == f'__all__ = ["{longest}"]'
    assert exported([longest + "x"]) == f'__all__ = [\n    "{longest}x",\n]'


def test_long_brackets_are_broken() -> None:
    fits = "x" * 97
    assert laid_out(call("f", ["a"], ".x"), 0) == "f(a).x"
    assert laid_out(call("f", [fits]), 0) == f"f({fits})"
    assert laid_out(call("f", [fits]), 1) == f"f(\n     {fits},\n )"
    assert laid_out(call("f", []), 99) == "f()"
    assert laid_out(call("f", ["a"], broken=True), 0) == "f(\n    a,\n)"
    assert laid_out(call("f", [mapping("a=", ["b"], broken=True)]), 0) == (
        "f(\n    a={\n        b,\n    },\n)"
    )
    assert laid_out(call("f", [fits]), 0, head="return ") == f"return f(\n    {fits},\n)"
    assert laid_out(call("f", [fits]), 0, tail=",") == f"f(\n    {fits},\n),"


def test_long_conditions_and_targets_are_broken() -> None:
    assert either(["a", "b"], 4) == "if a or b:"
    assert either(["a" * 50, "b" * 50], 4) == (
        f"if (\n        {'a' * 50}\n        or {'b' * 50}\n    ):"
    )
    assert unpacked(["a"], "x", 8) == "(a,) = x"
    assert unpacked(["a", "b"], "x", 8) == "a, b = x"
    assert unpacked(["a" * 50, "b" * 50], "x", 0) == f"(\n    {'a' * 50},\n    {'b' * 50},\n) = x"


def test_long_assignments_are_broken() -> None:
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
    for whole in ("x" * 200, "a-b-" * 50):  # names must not be broken
        assert paragraph(whole, 4) == whole


def test_sentences() -> None:
    assert sentence("a note") == "A note."
    assert sentence("A note.") == "A note."
    assert sentence("aBC") == "ABC."


@pytest.mark.parametrize("text", ["x" * 85, "x" * 86, "x" * 300, "word " * 60, "字" * 100])
def test_long_texts_do_not_change_in_pieces(text: str) -> None:
    source = laid_out(Text("", text), 10, ",").removesuffix(",")
    assert ast.literal_eval(f"({source})") == text
    assert source.startswith("(\n") is (10 + width(literal(text)) + 1 > 100)
    assert laid_out(Text("source=", "short"), 10) == 'source="short"'


def test_names_are_in_the_order_of_a_linter() -> None:
    assert sorted(["Bay10", "Bay2", "Bay", "A"], key=natural) == ["A", "Bay", "Bay2", "Bay10"]
    assert imported("a.b", ["check_b", "Zed", "check_a", "Abc2", "Abc10"]) == (
        "from a.b import Abc2, Abc10, Zed, check_a, check_b"
    )
    longest = "x" * 83
    assert imported("a", [longest, "b"]) == f"from a import b, {longest}"
    assert imported("a", [longest + "x", "b"]) == f"from a import (\n    b,\n    {longest}x,\n)"
