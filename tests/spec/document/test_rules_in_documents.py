"""Every requirement in the documents has a rule, and every rule names its sentences.

A program finds the sentences about required behaviour; people wrote the rules. A sentence with a word such
as "must" or "will" that no rule names needs a reason in ``not_rules.yaml``. A reference to a sentence that is
not at its place in the document is also an error. ``python tests/spec/document sentences DOCUMENT PAGE``
prints the sentences of a page with their references.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import plain_yaml

from . import flow, sentences
from .conftest import SPEC, document, path_of
from .layout_sentences import LayoutSentences

PROTOCOLS = ("thorlabs_apt", "asi_ms2000")
NOT_RULES = Path(__file__).parent / "not_rules.yaml"
SENTENCES = {"thorlabs_apt": 500, "asi_ms2000": 120}  # minimum number that the program finds
RULED_PAGES = range(31, 413)  # those of Issue 37 whose rules the overlay has
Entry = dict[str, Any]


def load(path: Any) -> Any:
    return plain_yaml.load(path.read_text(encoding="utf-8"))


@pytest.fixture(scope="module", params=PROTOCOLS)
def protocol(request: pytest.FixtureRequest) -> str:
    return request.param


@pytest.fixture(scope="module")
def read(protocol: str) -> sentences.Sentences:
    return sentences.read(protocol, document(protocol))


@pytest.fixture(scope="module")
def rules(protocol: str) -> dict[str, Entry]:
    return load(SPEC / protocol / "rules.yaml")["rules"]


@pytest.fixture(scope="module")
def not_rules(protocol: str) -> dict[str, Entry]:
    return {f"not_rules: {entry['reason']}": entry for entry in load(NOT_RULES)[protocol]}


def claimed(
    read: sentences.Sentences, entries: dict[str, Entry]
) -> tuple[set[flow.Sentence], list[str]]:
    """Return the sentences that entries name, and the problems of their references."""
    found: set[flow.Sentence] = set()
    problems = []
    for name, entry in entries.items():
        named, wrong = read.claim(entry.get("sentences", ()))
        found |= named
        problems += [f"{name}: {problem}" for problem in wrong]
    return found, problems


def missing(read: sentences.Sentences, protocol: str, found: set[flow.Sentence]) -> list[str]:
    """Return every unclaimed normative sentence with the reference to enter."""
    return [
        f"{word!r} in line {sentence.line}: {read.reference(sentence)}"
        for word, sentence in read.normative(protocol)
        if sentence not in found
    ]


def test_the_program_finds_sentences(read: sentences.Sentences, protocol: str) -> None:
    assert len(list(read.normative(protocol))) >= SENTENCES[protocol]


def test_every_rule_names_its_sentences(read: sentences.Sentences, rules: dict[str, Entry]) -> None:
    _, problems = claimed(read, rules)
    without = [name for name, entry in rules.items() if "sentences" not in entry]
    assert not problems, "\n".join(problems)
    assert not without


def test_a_rule_begins_on_its_page(rules: dict[str, Entry]) -> None:
    """Each page of a rule has one of its sentences, or the page before if the sentence runs on."""
    wrong = []
    for name, entry in rules.items():
        pages = {entry["page"], *entry.get("also", ())}
        named = {reference["page"] for reference in entry["sentences"]}
        near = {page + step for page in pages for step in (-1, 0, 1)}
        if not named <= near or not all({page, page - 1} & named for page in pages):
            wrong.append((name, sorted(pages), sorted(named)))
    assert not wrong


def test_every_normative_sentence_has_a_rule(
    read: sentences.Sentences,
    protocol: str,
    rules: dict[str, Entry],
    not_rules: dict[str, Entry],
) -> None:
    by_rules, _ = claimed(read, rules)
    by_others, problems = claimed(read, not_rules)
    left = missing(read, protocol, by_rules | by_others)
    assert not problems, "\n".join(problems)
    assert not left, "neither a rule nor not_rules.yaml names:\n" + "\n".join(left)


def test_every_entry_of_not_rules_is_needed(
    read: sentences.Sentences,
    protocol: str,
    rules: dict[str, Entry],
    not_rules: dict[str, Entry],
) -> None:
    """An entry is out of date if its sentence has no normative word, or if a rule names it."""
    by_rules, _ = claimed(read, rules)
    needed = {sentence for _, sentence in read.normative(protocol)} - by_rules
    idle = [
        f"{name}: {reference}"
        for name, entry in not_rules.items()
        for reference in entry["sentences"]
        if not read.claim([reference])[0] & needed
    ]
    assert not idle, "\n".join(idle)
    assert all(entry["reason"].endswith(".") for entry in not_rules.values())


def test_a_wrong_reference_is_explained(read: sentences.Sentences, protocol: str) -> None:
    """The message has the sentence and the reference that is right."""
    first, second, *_ = read.on(6)
    right = {"page": 6, "number": second.number, "digest": second.digest}
    assert read.claim([right]) == ({second.sentence}, [])

    def problem(**changes: Any) -> str:
        found, problems = read.claim([right | changes])
        assert found == ({second.sentence} if "number" in changes else set())
        return problems[0]

    assert "at another position" in problem(number=first.number)
    assert str(second) in problem(number=first.number)
    assert "on another page" in problem(page=7)
    assert "no sentence of the document" in problem(digest="0" * 12)
    assert str(second) in problem(digest="0" * 12)


def test_an_unnamed_sentence_is_reported_with_its_reference(
    read: sentences.Sentences, protocol: str
) -> None:
    word, sentence = next(read.normative(protocol))
    text = missing(read, protocol, {one for _, one in read.normative(protocol)} - {sentence})[0]
    assert word in text
    assert sentence.text in text
    assert sentences.digest(sentence.text) in text


@pytest.fixture(scope="module")
def layout() -> LayoutSentences:
    return LayoutSentences(path_of("thorlabs_apt_issue_37"))


def rules_of_issue_37() -> dict[str, Entry]:
    return load(SPEC / "thorlabs_apt" / "overlays" / "issue_37" / "rules.yaml")["rules"]


def test_every_rule_of_issue_37_names_its_sentences(layout: LayoutSentences) -> None:
    rules = rules_of_issue_37()
    problems = {name: layout.problems(entry["sentences"]) for name, entry in rules.items()}
    assert not {name: found for name, found in problems.items() if found}
    near = [
        name
        for name, entry in rules.items()
        if any(
            all(abs(one["page"] - page) > 1 for page in (entry["page"], *entry.get("also", ())))
            for one in entry["sentences"]
        )
    ]
    assert not near
    assert len(rules) >= 160


def test_every_normative_sentence_of_issue_37_has_a_rule(layout: LayoutSentences) -> None:
    """Sentences that Issue 3 has with the same words belong to its own rules."""
    known = flow.squeeze(
        flow.plain(path_of("thorlabs_apt").read_text(encoding="utf-8", errors="replace"))
    ).lower()
    named = [*rules_of_issue_37().values(), *load(NOT_RULES)["thorlabs_apt_issue_37"]]
    found = {(one["page"], one["digest"]) for entry in named for one in entry["sentences"]}
    left = [
        (page, number, short, text)
        for on in RULED_PAGES
        for page, number, short, text in layout.on(on)
        if flow.NORMATIVE.search(text)
        and (page, short) not in found
        and flow.squeeze(text).lower() not in known
    ]
    assert not left
    assert not layout.problems([one for entry in named for one in entry["sentences"]])


def test_a_wrong_sentence_of_issue_37_is_found(layout: LayoutSentences) -> None:
    right = rules_of_issue_37()["flipper-transit-range"]["sentences"][0]
    assert not layout.problems([right])
    assert layout.problems([right | {"number": right["number"] + 1}])
    assert layout.problems([right | {"digest": "0" * 12}])
    assert layout.problems([right | {"page": right["page"] - 1}])
