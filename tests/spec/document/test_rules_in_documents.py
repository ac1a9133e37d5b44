"""Every requirement in the documents has a rule, and every rule quotes its page.

A program finds the sentences about required behaviour; people wrote the rules. A word such as "must" or
"will" that no rule quotes needs a reason in ``not_rules.yaml``. A quotation that is not on its page is also
an error.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import plain_yaml

from . import flow
from .conftest import SPEC

PROTOCOLS = ("thorlabs_apt", "asi_ms2000")
NOT_RULES = Path(__file__).parent / "not_rules.yaml"
CONTENTS = {"thorlabs_apt": 5, "asi_ms2000": 0}  # pages of contents before the text begins
SENTENCES = {"thorlabs_apt": 500, "asi_ms2000": 120}  # minimum number that the program finds
Entry = dict[str, Any]


def load(path: Any) -> Any:
    return plain_yaml.load(path.read_text(encoding="utf-8"))


@pytest.fixture(scope="module", params=PROTOCOLS)
def protocol(request: pytest.FixtureRequest) -> str:
    return request.param


@pytest.fixture(scope="module")
def read(protocol: str, request: pytest.FixtureRequest) -> flow.Flow:
    """Return the flow of a document, with its pages narrowed by its headings."""
    if protocol == "thorlabs_apt":
        return flow.Flow(request.getfixturevalue("reading").document, paged=True)
    return flow.Flow(request.getfixturevalue("command_document"), paged=False)


@pytest.fixture(scope="module")
def rules(protocol: str) -> dict[str, Entry]:
    return load(SPEC / protocol / "rules.yaml")["rules"]


@pytest.fixture(scope="module")
def not_rules(protocol: str) -> list[Entry]:
    return load(NOT_RULES)[protocol]


def quoted(read: flow.Flow, entries: dict[str, Entry]) -> tuple[bytearray, list[str]]:
    """Return a mark for each letter that quotations cover, and the quotations that were not found."""
    covered = bytearray(len(read.letters))
    lost = []
    for name, entry in entries.items():
        for page in (entry["page"], *entry.get("also", ())):
            spans = read.find(entry["says"], page)
            if isinstance(spans, str):
                lost.append(f"{name}: not on page {page}: {spans!r}")
                continue
            for start, end in spans:
                covered[start:end] = b"\1" * (end - start)
    return covered, lost


def words(read: flow.Flow, protocol: str) -> list[tuple[flow.Sentence, str, slice]]:
    """Return every normative word of a document with its sentence and place."""
    found = []
    for sentence in read.sentences():
        if sentence.pages[0] <= CONTENTS[protocol]:
            continue
        for match in flow.NORMATIVE.finditer(sentence.text):
            start = sentence.span[0] + len(flow.squeeze(sentence.text[: match.start()]))
            place = slice(start, start + len(flow.squeeze(match.group())))
            found.append((sentence, match.group(), place))
    return found


def named(entries: list[Entry]) -> dict[str, Entry]:
    return {f"not_rules: {entry['says'][:60]}": entry for entry in entries}


def test_the_program_finds_sentences(read: flow.Flow, protocol: str) -> None:
    found = {sentence.span for sentence, _, _ in words(read, protocol)}
    assert len(found) >= SENTENCES[protocol]


def test_every_quotation_is_on_its_page(read: flow.Flow, rules: dict[str, Entry]) -> None:
    _, lost = quoted(read, rules)
    assert not lost


def test_every_sentence_has_its_rule(
    read: flow.Flow, protocol: str, rules: dict[str, Entry], not_rules: list[Entry]
) -> None:
    by_rules, _ = quoted(read, rules)
    by_others, lost = quoted(read, named(not_rules))
    missing = [
        f"line {sentence.line}, page {sentence.pages[0]}: {word!r} in {sentence.text!r}"
        for sentence, word, place in words(read, protocol)
        if 0 in by_rules[place] and 0 in by_others[place]
    ]
    assert not lost
    assert not missing, "neither a rule nor not_rules.yaml quotes:\n" + "\n".join(missing)


def test_every_entry_of_not_rules_is_needed(
    read: flow.Flow, protocol: str, rules: dict[str, Entry], not_rules: list[Entry]
) -> None:
    """An entry is out of date if it quotes no normative word, or only words that a rule quotes."""
    by_rules, _ = quoted(read, rules)
    places = [place for _, _, place in words(read, protocol) if 0 in by_rules[place]]
    idle = []
    for name, entry in named(not_rules).items():
        for page in (entry["page"], *entry.get("also", ())):
            covered, _ = quoted(read, {name: {**entry, "page": page, "also": ()}})
            if not any(0 not in covered[place] for place in places):
                idle.append(f"{name}, page {page}")
    assert not idle
    assert all(entry["reason"].endswith(".") for entry in not_rules)
