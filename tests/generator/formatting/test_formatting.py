"""The rules of the canonical form, one by one (``docs/how-to/formatting.md``)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from stagewire_generator import strict_yaml
from stagewire_generator.diagnostics import Diagnostics
from stagewire_generator.formatting import NotFormattedError, canonical
from stagewire_generator.formatting.files import kind_of, schema_for, schema_named
from stagewire_generator.formatting.rules import UNKNOWN, Shape, shape

FIRST = "# yaml-language-server: $schema=x.json\n"
NAMES = [f"MOT_MOVE_NUMBER_{number:02}" for number in range(12)]
PROSE = "Thirty words that a person wrote, " * 5 + "and an end."


def load(text: str) -> Any:
    diagnostics = Diagnostics()
    document = strict_yaml.parse(text, "test.yaml", diagnostics, any_byte=True)
    assert document is not None, list(map(str, diagnostics))
    assert not diagnostics, list(map(str, diagnostics))
    return document.data


def form(text: str, shape: Shape = UNKNOWN) -> str:
    """Return the canonical form of a text without the first line, and check that it is stable."""
    made = canonical(text, load(text), shape, "x.json")
    assert canonical(made, load(made), shape, "x.json") == made
    assert made.startswith(FIRST)
    return made.removeprefix(FIRST)


def rows(*sizes: int) -> str:
    """Return the twelve names in brackets below a key, with the given number on each line."""
    lines, start = [], 0
    for size in sizes:
        lines.append(", ".join(NAMES[start : start + size]))
        start += size
    return "a:\n  [" + ",\n   ".join(lines) + "]\n"


LAYOUT = [
    ("a:\n    b: 1\n    c:\n          d: 2\n", "a:\n  b: 1\n  c:\n    d: 2\n"),
    ("a:\n- 1\n-   - 2\n    - 3\n", "a:\n  - 1\n  - - 2\n    - 3\n"),
    ("a:\n-\n  b: 1\n  c: 2\n", "a:\n  - b: 1\n    c: 2\n"),
    ("---\na:   1\r\nb: 2   \r\n...\n", "a: 1\nb: 2\n"),
    ("a: 1", "a: 1\n"),
    ("\n\na: 1\n\n\n\nb: 2\n\n\n", "\na: 1\n\nb: 2\n"),
    ("a:\n\n  b: 1\n\n  c: 2\n\nd: 3\n", "a:\n  b: 1\n\n  c: 2\n\nd: 3\n"),
    ("? a\n: 1\n", "a: 1\n"),
    ("a:\nb: {c, d: }\n", "a: null\nb: {c: null, d: null}\n"),
    ("a: {}\nb: [ ]\n", "a: {}\nb: []\n"),
]
BRACKETS = [
    ("a: { b: 1 , c: [ x,z ] }\n", "a: {b: 1, c: [x, z]}\n"),
    ("a: {\n  b: 1,\n  c: 2\n}\n", "a: {b: 1, c: 2}\n"),
    ("a: [x,\n    z]\n", "a: [x, z]\n"),
    (f"a: [{', '.join(NAMES)}]\n", rows(5, 5, 2)),
    (rows(2, 5, 5), rows(2, 5, 5)),
    (rows(2, 10), rows(5, 5, 2)),
    (rows(1, 5, 6).replace("   MOT", " MOT"), rows(1, 5, 6)),
    (f"a: {{b: '{PROSE[:130]}', c: 1}}\n", f'a:\n  b: "{PROSE[:130]}"\n  c: 1\n'),
    (
        f"a: [{{b: {'z' * 60}}}, {{b: {'x' * 70}}}, 1]\n",
        f"a:\n  - {{b: {'z' * 60}}}\n  - {{b: {'x' * 70}}}\n  - 1\n",
    ),
]
COMMENTS = [
    ("a: 1 # x\n", "a: 1  # x\n"),
    ("# x\n\n# z\na: 1\n  # w\nb: 2\n", "# x\n\n# z\na: 1\n# w\nb: 2\n"),
    ("a:\n   # x\n   b: 1\n   # z\n\n   # w\nc: 1\n", "a:\n  # x\n  b: 1\n  # z\n\n  # w\nc: 1\n"),
    ("a: # x\n- 1\n# z\n- 2\n# w\nb: 1\n", "a:  # x\n  - 1\n  # z\n  - 2\n# w\nb: 1\n"),
    ("a: {b: 1, # x\n  c: 2} # z\n", "a:  # z\n  b: 1  # x\n  c: 2\n"),
    ("a: [ # x\n  1, # z\n  # w\n  2\n  # v\n]\n", "a:  # x\n  - 1  # z\n  # w\n  - 2\n  # v\n"),
    ("a:\n  - # x\n    b: 1\n", "a:\n  # x\n  - b: 1\n"),
    ("a:\n  b:\n  - 1\n  # x\nc: 1\n", "a:\n  b:\n    - 1\n  # x\nc: 1\n"),
    ("a: # x\n  text\n", "a: text  # x\n"),
    ("a: # x\n  # z\n  text # w\n", "# z\n# w\na: text  # x\n"),
    ("a: >- # x\n  text\n", "a: >-  # x\n  text\n"),
    ("a: 1\n# x\n", "a: 1\n# x\n"),
    ("a: { # x\n }\nb: 1\n", "a: {}  # x\nb: 1\n"),
    ("a: 'no # x' # no 'x\n", 'a: "no # x"  # no \'x\n'),
]
QUOTES = [
    ("a: 'word'\nb: \"some words (plain)\"\n", "a: word\nb: some words (plain)\n"),
    ("'a': 1\n\"MOT_MOVE\": 2\n", "a: 1\nMOT_MOVE: 2\n"),
    ("a: 'no'\nb: '10'\nc: '0x10'\nd: ''\n", 'a: "no"\nb: "10"\nc: "0x10"\nd: ""\n'),
    ("a: 'B0 04'\nb: 'C: d'\n", 'a: "B0 04"\nb: "C: d"\n'),
    ("a: 'say \"so\"'\nb: 'it''s \\ so'\n", "a: 'say \"so\"'\nb: 'it''s \\ so'\n"),
    ('a: "\\u0412\\x00"\n', 'a: "\\u0412\\x00"\n'),
    ("a: ['x', '10']\nb: ['x', 'z']\n", 'a: ["x", "10"]\nb: [x, z]\n'),
    ("a: [['x', '10'], ['z', w]]\n", 'a: [["x", "10"], ["z", w]]\n'),
    ("a: 'x\n\n  \"z\"'\n", 'a: "x\\n\\"z\\""\n'),
    ("a: ['10', 'x', {b: 'z'}]\n", 'a: ["10", "x", {b: z}]\n'),
]
NUMBERS = [
    ("a: 0x4d\nb: 0x453\nc: 0x0Ab\nd: -1\n", "a: 0x4D\nb: 0x0453\nc: 0x00AB\nd: -1\n"),
    ("a: {b: 1107, c: 0x00000001}\n", "a: {b: 1107, c: 0x00000001}\n"),
]
TEXTS = [
    ("a:\n  some\n  words\n", "a: some words\n"),
    ("a: >-\n     some\n     words\n", "a: >-\n  some\n  words\n"),
    ("a: |\n    x\n      z\n\n    w\n\nb: 1\n", "a: |\n  x\n    z\n\n  w\n\nb: 1\n"),
    ("a:\n    b: |4-\n          x\n        z\n", "a:\n  b: |2-\n      x\n    z\n"),
    ("a: |+\n  x\n\n\nb: 1\n", "a: |+\n  x\n\n\nb: 1\n"),
    ("a: >\n  x\n\n  z\n", "a: >\n  x\n\n  z\n"),
]


@pytest.mark.parametrize(
    ("before", "after"), [*LAYOUT, *BRACKETS, *COMMENTS, *QUOTES, *NUMBERS, *TEXTS]
)
def test_formatting_follows_the_rules(before: str, after: str) -> None:
    assert form(before) == after


@pytest.mark.parametrize(
    "before",
    [
        f"a: {PROSE}\n",
        f"a: '{PROSE}'\n",
        f'a: "{PROSE}"\n',
        f"a: >-\n  {PROSE}\n",
        f"a: >-\n  {PROSE[:20]}\n  {PROSE[20:]}\n",
    ],
)
def test_a_long_text_is_folded(before: str) -> None:
    made = form(before)
    assert load(made) == load(before)
    first, *lines = made.splitlines()
    assert first == "a: >-"
    assert all(line.startswith("  ") and len(line) <= 120 for line in lines)
    assert all(len(line) > 100 for line in lines[:-1])


def test_a_long_text_without_spaces_is_unchanged() -> None:
    text = f'a: "{"x" * 200}:"\n'
    assert form(text) == text


def test_keys_follow_the_order_of_the_schema() -> None:
    """Fields keep their order, which is that of the bytes, and so do unknown keys."""
    made = form(
        "messages:\n"
        "  # about A\n"
        "  A:\n"
        "    # its summary\n"
        "    summary: s  # short\n"
        "    unknown: 1\n"
        "    data: {fields: {z: {quantity: q, format: word}, b: {format: long}}, length: 6}\n"
        "    id: 1107\n"
        "title: t\n"
        "chapter: c\n",
        shape("messages"),
    )
    assert made == (
        "chapter: c\n"
        "title: t\n"
        "messages:\n"
        "  # about A\n"
        "  A:\n"
        "    id: 0x0453\n"
        "    # its summary\n"
        "    summary: s  # short\n"
        "    unknown: 1\n"
        "    data: {length: 6, fields: {z: {format: word, quantity: q}, b: {format: long}}}\n"
    )


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("# file\n\n# title\ntitle: t\nchapter: c\n", "# file\n\nchapter: c\n# title\ntitle: t\n"),
        ("# file\n# file\ntitle: t\nchapter: c\n", "# file\n# file\nchapter: c\ntitle: t\n"),
        ("# file\n\n\ntitle: t\nchapter: c\n", "# file\n\nchapter: c\ntitle: t\n"),
    ],
)
def test_comments_about_the_file_stay_at_the_top(before: str, after: str) -> None:
    """They end at the last blank line; a comment below it moves with its key."""
    assert form(before, shape("messages")) == after


@pytest.mark.parametrize(
    "line",
    ["", "# yaml-language-server: $schema=y.json\n", "# x\n#yaml-language-server:  $schema=y\n"],
)
def test_the_schema_is_in_the_first_line(line: str) -> None:
    made = canonical(f"{line}a: 1\n", {"a": 1}, UNKNOWN, "../x.json")
    assert made.splitlines()[0] == "# yaml-language-server: $schema=../x.json"
    assert made.count("$schema") == 1
    assert made.count("# x") == line.count("# x")


@pytest.mark.parametrize("text", ["- 1\n", "a word\n", "{}\n"])
def test_a_file_without_entries_is_not_formatted(text: str) -> None:
    with pytest.raises(NotFormattedError, match="not a mapping"):
        canonical(text, load(text), UNKNOWN, "x.json")


def test_a_result_with_other_data_or_comments_is_rejected(monkeypatch: pytest.MonkeyPatch) -> None:
    """The result is always read again, so no internal error can change a file."""
    text = "a: 1  # x\nb: true\n"
    module = "stagewire_generator.formatting.files.lay_out"
    for wrong in (["a: 1  # x"], ["a: 1  # x", "b: 1"], ["a: 1", "b: true"], ["a: 1 # x", "b: ["]):
        monkeypatch.setattr(module, lambda root, header, wrong=wrong: wrong)
        with pytest.raises(NotFormattedError, match="please report"):
            canonical(text, load(text), UNKNOWN, "x.json")


def test_the_kind_follows_from_the_location_or_else_from_the_named_schema(tmp_path: Path) -> None:
    spec = tmp_path / "spec"
    for name in ("toy/protocol.yaml", "toy/overlays/later/overlay.yaml"):
        (spec / name).parent.mkdir(parents=True)
        (spec / name).write_text("")
    expected = {
        "toy/protocol.yaml": "protocol",
        "toy/units.yaml": "units",
        "toy/messages/any.yaml": "messages",
        "toy/printed/any.yaml": "printed",
        "toy/overlays/later/overlay.yaml": "overlay",
        "toy/overlays/later/examples.yaml": "examples",
        "toy/overlays/later/errata/any.yaml": "errata",
        "toy/examples.yaml": "examples",
        "toy/captures.yaml": "captures",
        "conformance/examples/toy.yaml": "examples",
        "conformance/captures/toy.yaml": "captures",
        "toy/other.yaml": None,
        "units.yaml": None,
        "messages/any.yaml": None,
        "examples/any.yaml": None,
    }
    assert {name: kind_of(spec / name, "a: 1\n") for name in expected} == expected
    named = "# yaml-language-server: $schema=https://example.org/errata.schema.json\na: 1\n"
    assert kind_of(spec / "other.yaml", named) == "errata"
    assert kind_of(spec / "toy/units.yaml", named) == "units"
    assert kind_of(spec / "other.yaml", named.replace("errata", "people")) is None


def test_the_schema_is_in_the_nearest_schema_folder(tmp_path: Path) -> None:
    spec = tmp_path / "spec"
    messages, examples = spec / "toy/messages/a.yaml", tmp_path / "conformance/examples/toy.yaml"
    for path in (messages, examples):
        path.parent.mkdir(parents=True)
    (spec / "toy/protocol.yaml").write_text("")
    assert schema_for(messages, "messages", None) == "../../schema/messages.schema.json"
    assert schema_for(examples, "examples", None) == "../../spec/schema/examples.schema.json"
    (tmp_path / "schema").mkdir()
    for kind in ("messages", "examples"):
        (tmp_path / "schema" / f"{kind}.schema.json").write_text("{}")
    assert schema_for(messages, "messages", None) == "../../../schema/messages.schema.json"
    assert schema_for(examples, "examples", None) == "../../schema/examples.schema.json"
    # A named schema is kept if it exists and has the right kind.
    (spec / "toy/messages.schema.json").write_text("{}")
    assert (
        schema_for(messages, "messages", "./../messages.schema.json") == "../messages.schema.json"
    )
    assert schema_for(messages, "messages", "../lost/messages.schema.json").startswith("../../../")
    address = "https://example.org/messages.schema.json"
    assert schema_for(messages, "messages", address) == address
    assert schema_for(messages, "messages", "https://example.org/x.json").startswith("../../../")


def test_the_schema_may_be_named_on_any_line() -> None:
    assert schema_named("# x\n#  yaml-language-server:  $schema=a/b.json  \na: 1\n") == "a/b.json"
    assert schema_named("a: 1\n") is None
