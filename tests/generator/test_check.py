"""What a check tells beside its diagnostics: what it looked at, and what it is doing."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from stagewire_generator import check
from stagewire_generator.diagnostics import SpecError
from stagewire_generator.pipeline import Counts


def test_counts(good_spec: Path, good_commands: Path) -> None:
    assert check(good_spec).counts | check(good_commands).counts == {
        "tiny": Counts(messages=12, layouts=13, fields=32, errata=2, places=47, examples=1),
        "turtle": Counts(messages=10, layouts=14, fields=15, errata=8, places=177, examples=35),
    }


def test_two_protocols_in_one_spec(spec: Path, good_commands: Path) -> None:
    """One with a header and one with slots, each checked by its own rules."""
    shutil.copytree(good_commands, spec, dirs_exist_ok=True)
    assert [p.framing["kind"] for p in check(spec)] == ["header", "slots"]


def test_progress(good_spec: Path) -> None:
    said: list[str] = []
    check(good_spec, said.append)
    assert said == [
        "tiny/protocol.yaml",
        "tiny/quantities.yaml",
        "tiny/stages.yaml",
        "tiny/units.yaml",
        "tiny/messages/core.yaml",
        "tiny/messages/extra.yaml",
        "tiny/errata/core.yaml",
        "tiny/rules.yaml",
        "tiny/printed/core.yaml",
        "tiny/printed/extra.yaml",
        "conformance/examples/tiny.yaml",
        "conformance/captures/tiny.yaml",
        "tiny: names and layouts",
        "tiny: witness and errata",
    ]


def first_lines(spec: Path) -> list[str]:
    with pytest.raises(SpecError) as caught:
        check(spec)
    return [str(d).splitlines()[0] for d in caught.value.diagnostics]


def test_errata_that_rest_on_examples_that_are_not_there(spec: Path) -> None:
    """One diagnostic that says so, not one an erratum."""
    path = spec / "tiny" / "errata" / "core.yaml"
    text = path.read_text(encoding="utf-8")
    start = text.index("  tiny-lamp-test:")
    more = text[start:].replace("tiny-lamp-test", "tiny-lamp-again")
    path.write_text(text + more, encoding="utf-8")
    assert first_lines(spec) == [
        "tiny/errata/core.yaml:23:3: SW041 tiny-lamp-again names no place, and no worked example refers "
        "to it"
    ]
    shutil.rmtree(spec / "conformance" / "examples")
    with pytest.raises(SpecError) as caught:
        check(spec)
    [found] = caught.value.diagnostics
    assert str(found) == (
        "tiny/errata/core.yaml:23:3: SW006 2 errata rest on worked examples, and there are none\n"
        "    hint: put conformance/examples/tiny.yaml beside the spec"
    )
