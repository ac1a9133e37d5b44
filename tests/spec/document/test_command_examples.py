"""examples.yaml has every example of the command document, line by line and byte by byte."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from typing import Any

import pytest

import plain_yaml

from . import text
from .text import Document

Json = dict[str, Any]

EXAMPLES = text.ROOT / "spec" / "asi_ms2000" / "examples.yaml"

SECTION = re.compile(r"SETUP CONTROL COMMANDS$|LOW LEVEL FORMAT$|COMMAND LISTING$|Command: [A-Z]")
COMMAND = re.compile(r"Command: (\d.*)$")
REPLY = re.compile(r" *Reply(?: in Dec)?: (\d[\d ]*)$")
SILENCE = re.compile(r" *(?:Reply|Response)(?: in Dec)?: (?:There is no|No) (?:reply|response)")
ANY_REPLY = re.compile(r" *(?:Reply|Response)\b.*:")
TERMINAL = re.compile(r"(?:Example: )?((?:Ctrl)?<X>.(?:<C>)?:)(.*?)(?: , .*)?$")
ARITHMETIC = re.compile(r"(\d+ *\+[\d *()+]+)= *(\d+)")
REMAINDER = re.compile(r"(lsb|mb|msb) = remainder of .*?= ?(\d+)(?=\D|$)")
PRODUCT = re.compile(r"(\d+) millimeters(?:/second)? \*([\d, ]+) to get .* ?= ?([\d,]+)")
AXIS = re.compile(r"\w+(?: Axis:)?\tDec: ?(\d+).*\(Hex: 0x..\)\tKeyboard: (\S+)$")
SETUP = re.compile(r"(255 \d+) (Alt\[255\] '.')\t")
HASH = re.compile(r"(#FF#..)\t")
BIT = re.compile(r"Bit (\d)\t")
BIT_OF_REPLY = re.compile(r"- B(\d): ([01]) ")
SPELLED = re.compile(r"lsb: ?(\d+), the mb: ?(\d+), and the msb: ?(\d+)")


@pytest.fixture(scope="module")
def entries() -> list[Json]:
    content: dict[str, dict[str, Json]] = plain_yaml.load(EXAMPLES.read_text(encoding="utf-8"))
    return [{"id": slug, **entry} for slug, entry in content["examples"].items()]


def matches(document: Document, pattern: re.Pattern[str]) -> Iterator[tuple[int, re.Match[str]]]:
    for number in document.numbers():
        match = pattern.match(document[number])
        if match:
            yield number, match


def ours(entries: list[Json], *keys: str, **wanted: Any) -> list[tuple[Any, ...]]:
    """Return line and values of the examples that have all of ``keys`` and match ``wanted``."""
    return sorted(
        (entry["line"], *(entry[key] for key in keys))
        for entry in entries
        if all(key in entry for key in keys)
        and all(entry.get(key) == value for key, value in wanted.items())
    )


def section_of(document: Document, line: int) -> int:
    return sum(number <= line for number, _ in matches(document, SECTION))


def test_sections(command_document: Document, entries: list[Json]) -> None:
    assert section_of(command_document, len(command_document.lines)) == 27
    wrong = [
        (entry["id"], entry["page"], section_of(command_document, entry["line"]))
        for entry in entries
        if entry["page"] != section_of(command_document, entry["line"])
    ]
    assert wrong == []


def test_examples_are_in_the_order_of_the_document(entries: list[Json]) -> None:
    lines = [entry["line"] for entry in entries]
    assert lines == sorted(lines)


def test_commands(command_document: Document, entries: list[Json], compared: Counter[str]) -> None:
    printed = sorted(
        (line, part)
        for line, match in matches(command_document, COMMAND)
        for part in match[1].split(" OR ")
    )
    assert len(printed) == 24
    found = ours(entries, "printed", kind="tx", notation="decimal")
    assert [(line, raw) for line, raw in found if line >= 100] == printed
    compared["command examples: bytes sent"] = len(printed)


def test_replies(command_document: Document, entries: list[Json], compared: Counter[str]) -> None:
    printed = [(line, match[1]) for line, match in matches(command_document, REPLY)]
    assert len(printed) == 10
    assert ours(entries, "printed", kind="rx") == printed
    compared["command examples: bytes answered"] = len(printed)


def test_silence(command_document: Document, entries: list[Json], compared: Counter[str]) -> None:
    """A statement that there is no reply belongs to the command of its section."""
    lines = [line for line, _ in matches(command_document, SILENCE)]
    assert len(lines) == 10
    silent = [entry for entry in entries if "unanswered" in entry.get("claim", {})]
    assert [entry["line"] for entry in silent] == lines
    sent = {entry["page"]: entry["message"] for entry in entries if entry["kind"] == "tx"}
    assert [entry["claim"]["unanswered"] for entry in silent] == [
        sent[entry["page"]] for entry in silent
    ]
    compared["command examples: no reply"] = len(lines)


def test_every_line_about_a_reply(command_document: Document, entries: list[Json]) -> None:
    lines = [line for line, _ in matches(command_document, ANY_REPLY)]
    assert len(lines) == 21
    assert set(lines) <= {entry["line"] for entry in entries}


def test_every_section_with_an_example(command_document: Document, entries: list[Json]) -> None:
    headed = [
        section_of(command_document, line)
        for line, _ in matches(command_document, re.compile("Example"))
    ]
    assert headed == [4, *range(4, 11), *range(12, 23), *range(24, 28)]
    assert {entry["page"] for entry in entries if entry["kind"] == "tx"} == {1, *headed}


def test_terminals(command_document: Document, entries: list[Json], compared: Counter[str]) -> None:
    printed = [(line, match[1], match[2]) for line, match in matches(command_document, TERMINAL)]
    assert [line for line, _, _ in printed] == [121, 153, 201]
    typed = ours(entries, "typed", kind="keyboard", page=4)
    typed += ours(entries, "typed", kind="keyboard", page=5)
    typed += ours(entries, "typed", kind="keyboard", page=7)
    assert typed == [(line, keys) for line, keys, _ in printed]
    converted = re.compile(r"Reply Converted to ASCII: (.*)")
    shown = [(line, answer) for line, _, answer in printed]
    shown += [(line, match[1]) for line, match in matches(command_document, converted)]
    assert ours(entries, "shown") == sorted(shown)
    compared["command examples: typed and shown"] = len(typed) + len(shown)


def test_conversions(
    command_document: Document, entries: list[Json], compared: Counter[str]
) -> None:
    printed = []
    for number in command_document.numbers():
        line = re.sub(r"\\\w+(\{[^}]*\})?|\$", "", command_document[number])
        match = ARITHMETIC.search(line)
        if match:
            printed.append((number, match[1].replace(" ", ""), int(match[2])))
    assert len(printed) == 11
    found = [
        (line, arithmetic.replace(" ", ""), value)
        for line, arithmetic, value in ours(entries, "arithmetic", "value", kind="scaling")
        if "+" in arithmetic
    ]
    assert found == printed
    compared["command examples: conversions"] = len(printed)


def test_reverse_conversions(
    command_document: Document, entries: list[Json], compared: Counter[str]
) -> None:
    printed: list[tuple[int, int]] = []
    for number in command_document.numbers():
        line = command_document[number].replace("$", "")
        printed += [(number, int(match[2])) for match in REMAINDER.finditer(line)]
        product = PRODUCT.match(line)
        if product:
            printed.append((number, int(product[3].replace(",", ""))))
    assert len(printed) == 3 * 4 + 3
    found = [
        (entry["line"], int(entry.get("printed_value", entry["value"])))
        for entry in entries
        if entry["kind"] == "scaling" and "+" not in entry["arithmetic"]
    ]
    assert found == printed
    compared["command examples: reverse conversions"] = len(printed)


def test_keys_of_the_axes(
    command_document: Document, entries: list[Json], compared: Counter[str]
) -> None:
    printed = [(line, match[1], match[2]) for line, match in matches(command_document, AXIS)]
    assert len(printed) == 7
    assert ours(entries, "printed", "typed", kind="keyboard") == printed
    compared["command examples: keys of axes"] = len(printed)


def test_setup_commands(
    command_document: Document, entries: list[Json], compared: Counter[str]
) -> None:
    printed = [(line, match[1], match[2]) for line, match in matches(command_document, SETUP)]
    assert len(printed) == 5
    sent = ours(entries, "printed", kind="tx", notation="decimal", page=1)
    assert sent == [(line, raw) for line, raw, _ in printed]
    assert ours(entries, "typed", page=1) == [(line, keys) for line, _, keys in printed]
    hashed = [(line, match[1]) for line, match in matches(command_document, HASH)]
    assert len(hashed) == 3
    assert ours(entries, "printed", notation="hash") == hashed
    compared["command examples: setup"] = 2 * len(printed) + len(hashed)


def test_bits(command_document: Document, entries: list[Json], compared: Counter[str]) -> None:
    claims = [(entry["line"], entry.get("claim", {})) for entry in entries]
    table = [(line, int(match[1])) for line, match in matches(command_document, BIT)]
    assert [bit for _, bit in table] == list(range(8))
    assert [(line, claim["bit"]) for line, claim in claims if "bit" in claim] == table
    reply = [
        (line, int(match[1]), match[2] == "1")
        for line, match in matches(command_document, BIT_OF_REPLY)
    ]
    assert [bit for _, bit, _ in reply] == list(range(7, -1, -1))
    assert sum(held << bit for _, bit, held in reply) == 138
    number = {claim["flag"]: claim["bit"] for _, claim in claims if "bit" in claim}
    of_138 = [
        (line, number[claim["flag"]], claim["set"])
        for line, claim in claims
        if claim.get("of") == 138
    ]
    assert of_138 == reply
    compared["command examples: bits"] = len(table) + len(reply)


def test_bytes_spelled_out_in_prose(
    command_document: Document, entries: list[Json], compared: Counter[str]
) -> None:
    """Three bytes spelled out in prose are those of the example above, with one exception."""
    lines = {number: command_document[number] for number in command_document.numbers()}
    whole = " ".join(lines.values())
    spelled = [match.groups() for match in SPELLED.finditer(re.sub(r"\s+", " ", whole))]
    right = ("160", "134", "01")
    assert [each for each in spelled if each != right] == [("10", "1", "2")]
    assert ours(entries, "printed", kind="stream") == [(220, "10 1 2")]
    compared["command examples: bytes in prose"] = len(spelled)
