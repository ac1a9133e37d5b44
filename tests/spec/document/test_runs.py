"""No file of the repository has ten consecutive words of a vendor's document."""

from __future__ import annotations

from itertools import islice

import pytest

from . import runs
from .conftest import document

Found = list[runs.Run]


@pytest.fixture(scope="module")
def known() -> runs.Grams:
    for protocol in ("thorlabs_apt", "asi_ms2000"):
        document(protocol)  # skips the tests without it
    return runs.of_documents(runs.available())


@pytest.fixture(scope="module")
def found(known: runs.Grams) -> Found:
    return runs.in_repository(known)


def test_no_run_is_left(found: Found) -> None:
    left = [str(run) for run in found if not runs.is_listed(run)]
    assert not left, "write it in your own words, or shorten it with …:\n" + "\n".join(left)


def test_every_exception_is_needed(found: Found) -> None:
    used = {(run.path, words) for run in found for words in runs.is_listed(run)}
    listed = {(entry["path"], words) for entry in runs.exceptions() for words in entry["begins"]}
    assert listed == used
    assert all(entry["reason"].endswith(".") for entry in runs.exceptions())
    assert all(len(words.split()) < runs.LENGTH for _, words in listed)


@pytest.fixture(scope="module", params=["thorlabs_apt", "asi_ms2000", "thorlabs_apt_issue_37"])
def sentence(request: pytest.FixtureRequest, known: runs.Grams) -> list[str]:
    """Return ten words of a document, read from it so that this file does not quote them."""
    if request.param not in runs.available():
        pytest.skip("the text of the later issue is not available")
    ours = (gram for gram, name in known.items() if name == request.param)
    return list(next(islice((gram for gram in ours if all(map(str.isalpha, gram))), 3, None)))


@pytest.mark.parametrize(
    ("before", "joint", "after"),
    [
        ("", " ", ""),
        ("# We read it:\n# ", "\n# ", "\n"),
        ('    says: "', ",  ", '"\n'),
        ('print("', '"\n    "', '")\n'),
        ('{"a": "', "\\n", '"}'),
        ("<p>", "</b> <b>", "</p>"),
    ],
)
def test_a_planted_run_is_found(
    known: runs.Grams, sentence: list[str], before: str, joint: str, after: str
) -> None:
    content = f"first\n{before}{joint.join(word.title() for word in sentence)}{after}"
    (run,) = runs.in_text("planted.txt", content, known)
    assert run.words.endswith(" ".join(sentence))
    assert run.line == content[: content.lower().index(sentence[0])].count("\n") + 1


def test_a_shorter_run_is_not_found(known: runs.Grams, sentence: list[str]) -> None:
    assert not list(runs.in_text("planted.txt", " ".join(sentence[1:]), known))


def test_rows_of_bytes_are_not_reported(known: runs.Grams) -> None:
    planted = "TX 50, 04, 06, 00, A2, 01, 01, 00, 40, 0D, 03, 00"
    assert not list(runs.in_text("planted.txt", planted, known))


def test_it_searches_the_repository(known: runs.Grams) -> None:
    paths = {path for path, _ in runs.tracked()}
    assert {"README.md", "spec/thorlabs_apt/rules.yaml"} < paths
    assert any(path.startswith("generated/") for path in paths)
    assert any(path.startswith("docs/") for path in paths)
    assert len(known) > 20_000
