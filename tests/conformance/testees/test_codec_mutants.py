"""A codec with one mistake fails, and the failure names the message and the field."""

from __future__ import annotations

import sys
from collections import defaultdict
from functools import cache

import broken_codecs
import pytest
from broken_codecs import NAMES, Mistake, broken, drawn

from parts import chosen
from stagewire.protocols import load_protocol
from stagewire_conformance.comparison import Outcome
from stagewire_conformance.testee import Testee
from stagewire_conformance.testees import Case, Result, run
from stagewire_conformance.testees.runner import plan
from stagewire_conformance.testees.session import Session

PROTOCOLS = [load_protocol(name) for name in NAMES]
OVER_EVERYTHING = {
    "thorlabs_apt": "decoded: channel from source",
    "asi_ms2000": "decoded: from axis",
}
"""Mistakes that are tested in a child process, among all other cases."""


@cache
def cases_about() -> dict[tuple[str, str], list[Case]]:
    """The cases of each message."""
    found = defaultdict(list)
    for case in plan(PROTOCOLS, seed=1):
        found[case.protocol, case.message].append(case)
    return dict(found)


def failures(mistake: Mistake) -> list[Result]:
    session = Session(lambda: broken(mistake), timeout=1)
    session.hello()
    about = cases_about()[mistake.protocol, mistake.message]
    return [result for case in about if (result := session.ask(case)).failed]


def test_two_hundred_mistakes_cover_everything() -> None:
    chosen = drawn()
    assert len({*chosen}) == 200
    assert {mistake.kind for mistake in chosen} == {*broken_codecs.KINDS}
    assert len({mistake.message for mistake in chosen}) > 80
    assert {mistake.protocol for mistake in chosen} == {*NAMES}


@pytest.mark.parametrize("mistake", drawn(), ids=str)
def test_a_mistake_is_found_and_named(mistake: Mistake) -> None:
    found = failures(mistake)
    assert found, "the mistake was not noticed"
    assert all(mistake.message in result.text for result in found)
    assert any(mistake.field in result.text for result in found)
    assert all(result.line and result.wanted is not None for result in found)


def test_without_a_mistake_nothing_is_found() -> None:
    """Run the cases of all messages with mistakes."""
    session = Session(lambda: broken_codecs.InProcess(Testee().answer), timeout=1)
    session.hello()
    for mistake in drawn():
        for case in cases_about()[mistake.protocol, mistake.message][:5]:
            assert session.ask(case).outcome is Outcome.PASSED


@pytest.mark.parametrize("name", chosen(NAMES, lambda name: name == "asi_ms2000"))
def test_a_mistake_fails_only_its_cases_among_all_others(name: str) -> None:
    """Only the cases that involve the message fail."""
    number, mistake = next(
        (number, mistake)
        for number, mistake in enumerate(drawn())
        if (mistake.protocol, mistake.kind) == (name, OVER_EVERYTHING[name])
    )
    command = [sys.executable, broken_codecs.__file__, str(number)]
    groups = [f"{name}/cases", f"{name}/examples", "lines"]
    report = run(command, [load_protocol(name)], only=groups, timeout=30)
    assert report.unfinished == ""
    found = report.failures()
    assert found
    assert all(mistake.message in result.text for result in found)
    assert any(mistake.field in result.text for result in found)
    assert len(found) < 100 < len(report.results)
