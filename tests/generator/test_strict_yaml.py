"""Strict YAML: values are read exactly as written, and no bytes crash the reader."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from stagewire_generator.codes import CODES
from stagewire_generator.diagnostics import Diagnostics
from stagewire_generator.strict_yaml import Document, load

FAST = settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.too_slow])


def read(data: str | bytes, *, any_byte: bool = False) -> tuple[Document | None, list[str]]:
    """Load a text; return the document, and ``line:column code`` of each diagnostic."""
    raw = data.encode("utf-8") if isinstance(data, str) else data
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "x.yaml"
        path.write_bytes(raw)
        diagnostics = Diagnostics()
        document = load(path, "x.yaml", diagnostics, any_byte=any_byte)
    found = [f"{d.place.line}:{d.place.column} {d.code}" for d in diagnostics]
    assert all(d.code in CODES and d.message and "\n" not in d.message for d in diagnostics)
    return document, found


def value(text: str) -> Any:
    document, found = read(text)
    assert document is not None
    assert found == []
    return document.data


# Plain words

DIGITS = st.text("0123456789", min_size=1, max_size=8)
UNDERSCORED = st.text("0123456789_", min_size=1, max_size=8)
SIGNS = st.sampled_from(["", "-", "+"])
WORDS = ["yes", "no", "on", "off", "true", "false", "null", "y", "n", "~", "=", "<<"]


def spellings(word: str) -> list[str]:
    return sorted({word, word.upper(), word.capitalize()} - {"true", "false", "null"})


AMBIGUOUS = st.one_of(
    st.sampled_from([spelling for word in WORDS for spelling in spellings(word)]),
    st.builds("{}0{}".format, SIGNS, DIGITS),  # octal
    st.builds("{}0o{}".format, SIGNS, st.text("01234567", min_size=1, max_size=8)),
    st.builds("{}0b{}".format, SIGNS, st.text("01_", min_size=1, max_size=8)),
    st.builds("{}0x{}".format, st.sampled_from("+-"), st.text("0123456789abcdefABCDEF_")),
    st.builds("+{}".format, DIGITS),
    st.builds("{}1{}_{}".format, SIGNS, UNDERSCORED, UNDERSCORED),
    st.builds("{}{}:{}".format, SIGNS, st.integers(0, 10**6), st.integers(0, 59)),  # sexagesimal
    st.builds("{}:{}:{}.5".format, st.integers(0, 99), st.integers(0, 59), st.integers(0, 59)),
    st.floats(allow_nan=True, allow_infinity=True).map(lambda x: yaml.dump(x).split("\n")[0]),
    st.builds("{}{}.{}".format, SIGNS, DIGITS, DIGITS),
    st.builds("{}.{}".format, SIGNS, DIGITS),
    st.builds("{}{}.".format, SIGNS, DIGITS),
    st.builds("{}{}e{}{}".format, SIGNS, DIGITS, SIGNS, DIGITS),
    st.sampled_from([".inf", "-.Inf", "+.INF", ".nan", ".NaN"]),
    st.dates().map(str),
    st.datetimes().map(str),
    st.datetimes().map(lambda moment: moment.isoformat() + "Z"),
)


@FAST
@given(AMBIGUOUS)
def test_ambiguous_words_are_refused_when_plain(word: str) -> None:
    document, found = read(f"key: {word}\n")
    assert document is not None
    assert found == ["1:6 SW004"]


@pytest.mark.parametrize(
    "word",
    [
        *(
            "017",
            "0o17",
            "0O17",
            "0b11",
            "0X1F",
            "1_000",
            "+1",
            "-0x1",
            "1:30",
            "1:30:00",
            "190:20:30.15",
        ),
        *("yes", "Yes", "NO", "on", "Off", "y", "N", "True", "NULL", "~", ".inf", "-.INF", ".NaN"),
        *(
            "1.5",
            "1.",
            ".5",
            "1e5",
            "6.02e+23",
            "2020-01-31",
            "2020-01-31T10:00:00Z",
            "2020-1-1 1:2:3 +1",
        ),
    ],
)
@pytest.mark.parametrize("form", ["key: {}", "- {}", "[{}]", "{}: value"])
def test_a_word_that_readers_interpret_differently_is_refused(word: str, form: str) -> None:
    assert [line.split(" ")[1] for line in read(form.format(word))[1]] == ["SW004"]


@FAST
@given(AMBIGUOUS, st.sampled_from(["'{}'", '"{}"', "|-\n  {}", ">-\n  {}"]))
def test_ambiguous_words_are_text_when_quoted(word: str, quotes: str) -> None:
    assert value("key: " + quotes.format(word)) == {"key": word}


@settings(max_examples=500, deadline=None)
@given(st.text("0123456789abefinoxystrulNOYTF+-_.:~=<T Zz", min_size=1, max_size=12))
@example("1_0:30")
@example("1_0.")
@example("0x")
@example("=")
def test_agrees_with_yaml_1_1_or_refuses(word: str) -> None:
    """A value that YAML 1.1 does not read as text is read as the same value, or refused."""
    try:
        node = yaml.compose(f"- {word}\n", yaml.SafeLoader)
    except yaml.YAMLError:
        return
    assert isinstance(node, yaml.SequenceNode)
    item = node.value[0]
    if not isinstance(item, yaml.ScalarNode) or item.style or item.value != word.strip():
        return
    document, found = read(f"- {word}\n")
    assert document is not None
    [seen] = document.data
    try:
        other = yaml.SafeLoader(f"- {word}\n").get_data()[0]
    except (yaml.YAMLError, ValueError):
        other = ...
    if not found:
        assert type(seen) is type(other)
        assert seen == other


@FAST
@given(st.integers(-(10**38), 10**38))
def test_decimal_integers_are_read(number: int) -> None:
    assert value(f"- {number}") == [number]


@FAST
@given(st.integers(0, 2**64))
def test_hexadecimal_integers_are_read(number: int) -> None:
    assert value(f"- 0x{number:X}\n- 0x{number:08x}") == [number, number]


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("true", True),
        ("false", False),
        ("null", None),
        ("", None),
        ('""', ""),
        ("-0", 0),
        ("0x0E", 14),
        ('"0E"', "0E"),
        ("0E", "0E"),
        ("no such thing", "no such thing"),
        ("1.2.3", "1.2.3"),
        ("512/5", "512/5"),
        ("a:b", "a:b"),
        ("99 bottles", "99 bottles"),
        ("µ × ²", "µ × ²"),
    ],
)
def test_plain_values_are_read(text: str, wanted: object) -> None:
    seen = value(f"key: {text}\n")["key"]
    assert seen == wanted
    assert type(seen) is type(wanted)


@pytest.mark.parametrize("number", ["1" * 41, "-" + "1" * 5000, "0x" + "1" * 5000, "0x" + "F" * 40])
def test_huge_numbers_are_refused(number: str) -> None:
    document, found = read(f"key: {number}")
    assert document is not None
    assert found == ["1:6 SW004"]


@pytest.mark.parametrize("word", ["1_" * 100_000 + "x", "1" * 200_000 + "x", "1:3" * 50_000 + "x"])
def test_long_words_do_not_stall(word: str) -> None:
    """A pattern with backtracking for each character would take days."""
    assert value(f"key: {word}") == {"key": word}


# Structure


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("a: &x 1\nb: 2\n", ["1:4 SW003"]),
        ("a: &x 1\nb: *x\n", ["1:4 SW003", "2:4 SW003"]),
        ("a: *nothing\n", ["1:4 SW003"]),
        ("&x a: 1\n", ["1:1 SW003"]),
        ("a: &x [*x]\n", ["1:4 SW003", "1:8 SW003"]),  # contains itself
        ("a: {b: 1}\nc:\n  <<: {b: 1}\n", ["3:3 SW003"]),
        ("<<: [{a: 1}]\n", ["1:1 SW003"]),
        ("a: !!str 1\n", ["1:4 SW003"]),
        ("a: !!int '1'\n", ["1:4 SW003"]),
        ("a: !own 1\n", ["1:4 SW003"]),
        ("a: ! 1\n", ["1:4 SW003"]),
        ("a: !!python/object/apply:os.getcwd []\n", ["1:4 SW003"]),
        ("!!map\na: 1\n", ["1:1 SW003"]),
        ("a: 1\nb: 2\na: 3\n", ["3:1 SW002"]),
        ("{a: 1, 'a': 2}\n", ["1:8 SW002"]),
        ('a: 1\n"\\u0061": 2\n', ["2:1 SW002"]),
        ("a: 1\n? a\n: 2\n", ["2:3 SW002"]),
        ("a: 1\n? |-\n  a\n: 2\n", ["2:3 SW002"]),
        ("x: {a: 1, b: {a: 1}, a: {c: 1, c: 2}}\n", ["1:22 SW002"]),
        ("1: a\n", ["1:1 SW005"]),
        ("0x10: a\n", ["1:1 SW005"]),
        ("true: a\n", ["1:1 SW005"]),
        ("null: a\n", ["1:1 SW005"]),
        (": a\n", ["1:1 SW001"]),
        ("? \n: a\n", ["1:2 SW005"]),
        ("[a]: b\n", ["1:1 SW005"]),
        ("? {a: b}\n: c\n", ["1:3 SW005"]),
        ("yes: a\n", ["1:1 SW004"]),
        ("010: a\n", ["1:1 SW004"]),
        (
            "{1: a, 2: b, [c]: d, [e]: f, <<: g, <<: h, i: 1, i: 2, i: 3, 3: j}\n",
            [f"1:{n} SW00{k}" for n, k in ((2, 5), (8, 5), (14, 5), (22, 5), (30, 3), (37, 3))]
            + ["1:50 SW002", "1:56 SW002", "1:62 SW005"],
        ),
    ],
)
def test_invalid_structure_is_refused(text: str, found: list[str]) -> None:
    assert read(text)[1] == found


def test_a_quoted_merge_key_is_a_name() -> None:
    assert value('"<<": 1\n') == {"<<": 1}


def test_aliases_do_not_multiply() -> None:
    """These ten lines would expand to ten thousand million words."""
    lines = ["a0: &a0 [lol, lol, lol, lol, lol, lol, lol, lol, lol, lol]"]
    for n in range(1, 10):
        lines.append(f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 10)}]")
    document, found = read("\n".join(lines))
    assert document is None
    assert {line.split(" ")[1] for line in found} == {"SW003"}


@pytest.mark.parametrize("depth", [65, 1_100, 10_000, 200_000])
@pytest.mark.parametrize("brackets", ["[]", "{}", "{a:}"])
def test_deep_brackets_are_refused(depth: int, brackets: str) -> None:
    document, found = read(brackets[:-1] * depth + brackets[-1] * depth)
    assert document is None
    assert found[-1].split(" ")[1] == "SW001"


def test_deep_indentation_and_dashes_are_refused() -> None:
    assert read("".join(" " * n + "a:\n" for n in range(1_000)))[1] == ["65:65 SW001"]
    assert [line.split(" ")[1] for line in read("- " * 5_000 + "a")[1]] == ["SW001"]


def test_the_maximum_depth_is_accepted() -> None:
    assert value("[" * 64 + "]" * 64)


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("", ["1:1 SW001"]),
        ("# only a comment\n", ["1:1 SW001"]),
        ("---\n", None),
        ("a: 1\n---\nb: 1\n", ["2:1 SW001"]),
        ("a: b: c\n", ["1:5 SW001"]),
        ("a:\n\tb: 1\n", ["2:1 SW001"]),
        ("a: [1\n", ["2:1 SW001"]),
        ('a: "b\n', ["2:1 SW001"]),
        ('a: "\\ud800"\n', ["1:7 SW001"]),
        ('a: "\\q"\n', ["1:5 SW001"]),
        ("a: @b\n", ["1:4 SW001"]),
        ("a: \ufffe\n", ["1:1 SW001"]),
    ],
)
def test_invalid_yaml_is_refused(text: str, found: list[str] | None) -> None:
    document, seen = read(text)
    assert seen == (found or [])
    assert (document is None) == bool(found)


# Characters

CONTROL = [*map(chr, range(0x20)), *map(chr, range(0x7F, 0xA0)), *map(chr, range(0x2028, 0x202F))]
CONTROL += [*map(chr, range(0x2066, 0x206A)), "\u200e", "\u200f", "\u061c"]
CONTROL += ["\u200b", "\u200c", "\u200d", "\u2060", "\u00ad", "\ufeff", "\ufff9"]  # invisible


@pytest.mark.parametrize("char", [c for c in CONTROL if c not in "\t\n"], ids=ascii)
def test_control_and_direction_characters_are_refused(char: str) -> None:
    document, found = read(f"a: 1\nb: one{char}two\n")
    assert document is None
    assert found == ["2:7 SW007"]
    document, found = read(f"b: 1 # one{char}two\n")
    assert document is None
    assert found == ["1:11 SW007"]


@pytest.mark.parametrize("char", [c for c in CONTROL if c not in "\t\n"], ids=ascii)
def test_escaped_control_and_direction_characters_are_refused(char: str) -> None:
    text = f'a: 1\nb: "one\\u{ord(char):04x}two"\n'
    document, found = read(text)
    assert found == ["2:4 SW007"]
    document, found = read(text, any_byte=True)  # for text from a device
    assert document is not None
    assert document.data["b"] == f"one{char}two"
    assert found == ([] if char <= "\xff" else ["2:4 SW007"])


def test_a_byte_order_mark_is_refused() -> None:
    assert read("\ufeffa: 1\n") == (None, ["1:1 SW007"])


def test_windows_line_endings_are_accepted() -> None:
    assert value("a: 1\r\nb: one\r\n") == {"a": 1, "b": "one"}


@pytest.mark.parametrize("data", [b"a: \xff", b"a: \xc3", b"\xfe\xff\x00a", b"a: \xed\xa0\x80"])
def test_bytes_that_are_not_utf_8_are_refused(data: bytes) -> None:
    assert read(data) == (None, ["1:1 SW006"])


def test_a_document_gives_the_place_of_a_value_or_of_its_nearest_parent() -> None:
    document, found = read("a:\n  - b: 1\n    c: {d: 2}\n  - e\n")
    assert document is not None
    assert found == []
    assert str(document.place("a", 0, "c", "d")) == "x.yaml:3:9"
    assert str(document.place("a", 1)) == "x.yaml:4:5"
    assert str(document.place("a", 7, "nothing")) == "x.yaml:1:1"
    assert str(document.place()) == "x.yaml:1:1"


# Arbitrary input

PIECES = st.lists(
    st.sampled_from(
        [
            *(
                "\n",
                "\n",
                "\r",
                " ",
                "  ",
                "\t",
                ":",
                ": ",
                "-",
                "- ",
                "?",
                "? ",
                "[",
                "]",
                "{",
                "}",
            ),
            *(
                "#",
                "&",
                "&a ",
                "*",
                "*a",
                "!",
                "!!str ",
                "|",
                ">",
                "'",
                '"',
                "%",
                "@",
                "`",
                ",",
                "\\",
            ),
            *(
                "<<",
                "=",
                "~",
                "/",
                "a",
                "b",
                "key",
                "0",
                "0x1F",
                "1:30",
                "yes",
                "1e5",
                "2020-01-01",
            ),
            *(
                "...",
                "---\n",
                "%YAML 1.1\n",
                "\ufeff",
                "\\u202e",
                "\u202e",
                "é",
                "\U0001f600",
                "\x00",
            ),
        ]
    ),
    max_size=40,
).map("".join)


@settings(max_examples=400, deadline=None)
@given(PIECES)
def test_no_text_raises(text: str) -> None:
    document, found = read(text)
    assert document is not None or found


@settings(max_examples=300, deadline=None)
@given(st.binary(max_size=200))
def test_no_bytes_raise(data: bytes) -> None:
    document, found = read(data)
    assert document is not None or found


@settings(max_examples=150, deadline=None)
@given(
    st.recursive(
        st.one_of(
            st.none(),
            st.booleans(),
            st.integers(-(2**64), 2**64),
            st.text(st.characters(exclude_categories=["C", "Z"]) | st.just(" "), max_size=12),
        ),
        lambda inner: (
            st.lists(inner, max_size=4)
            | st.dictionaries(st.text("abcdef", min_size=2, max_size=6), inner, max_size=4)
        ),
        max_leaves=20,
    ).filter(lambda data: isinstance(data, list | dict))
)
def test_quoted_yaml_reads_as_itself(data: Any) -> None:
    """Data that PyYAML writes with all texts in quotes is read back unchanged."""

    class Dumper(yaml.SafeDumper):
        def ignore_aliases(self, data: Any) -> bool:
            return True

    Dumper.add_representer(str, lambda d, s: d.represent_scalar("tag:yaml.org,2002:str", s, '"'))
    seen, found = read(yaml.dump(data, Dumper=Dumper, allow_unicode=True))
    assert found == []
    assert seen is not None
    assert seen.data == data
