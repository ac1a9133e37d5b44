"""The results of a check apart from diagnostics of content: counts, progress, and the places of files."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from stagewire_generator import check
from stagewire_generator.diagnostics import SpecError
from stagewire_generator.pipeline import Counts


def test_counts(good_spec: Path, good_commands: Path) -> None:
    assert check(good_spec).counts | check(good_commands).counts == {
        "tiny": Counts(
            messages=12, layouts=13, fields=32, errata=2, not_compared=1, places=52, examples=1
        ),
        "turtle": Counts(
            messages=10, layouts=14, fields=15, errata=8, not_compared=0, places=180, examples=35
        ),
    }


def test_two_protocols_in_one_spec(spec: Path, good_commands: Path) -> None:
    """One protocol with a header and one with slots; each is checked by its own rules."""
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
        "tiny/examples.yaml",
        "tiny/captures.yaml",
        "tiny: names and layouts",
        "tiny: witness and errata",
    ]


def first_lines(spec: Path) -> list[str]:
    with pytest.raises(SpecError) as caught:
        check(spec)
    return [str(d).splitlines()[0] for d in caught.value.diagnostics]


def test_missing_examples_are_reported_once_for_all_errata(spec: Path) -> None:
    path = spec / "tiny" / "errata" / "core.yaml"
    text = path.read_text(encoding="utf-8")
    start = text.index("  tiny-lamp-test:")
    more = text[start:].replace("tiny-lamp-test", "tiny-lamp-again")
    path.write_text(text + more, encoding="utf-8")
    assert first_lines(spec) == [
        "tiny/errata/core.yaml:24:3: SW041 tiny-lamp-again names no place, and no worked example refers "
        "to it"
    ]
    (spec / "tiny" / "examples.yaml").unlink()
    with pytest.raises(SpecError) as caught:
        check(spec)
    [found] = caught.value.diagnostics
    assert str(found) == (
        "tiny/errata/core.yaml:24:3: SW006 2 errata refer to worked examples, but examples.yaml is missing\n"
        "    hint: add examples.yaml to the directory tiny"
    )


def to_the_place_of_0_1(spec: Path, kind: str) -> Path:
    """Move the examples or captures of the good spec to their place in version 0.1."""
    old = spec / "conformance" / kind / "tiny.yaml"
    old.parent.mkdir(parents=True)
    return (spec / "tiny" / f"{kind}.yaml").rename(old)


@pytest.mark.parametrize("kind", ["examples", "captures"])
def test_examples_and_captures_in_the_places_of_0_1_are_read_with_a_warning(
    spec: Path, kind: str
) -> None:
    [new] = check(spec)
    to_the_place_of_0_1(spec, kind)
    said = rf"^move spec/conformance/{kind}/tiny\.yaml to spec/tiny/{kind}\.yaml; the next release"
    with pytest.warns(FutureWarning, match=said):
        [old] = check(spec)
    assert (old.examples, old.captures) == (new.examples, new.captures)


@pytest.mark.parametrize("place", [".", "spec", "spec/tiny"])
def test_one_warning_names_all_files_in_the_places_of_0_1(spec: Path, place: str) -> None:
    moves = []
    for kind in ("examples", "captures"):
        old = spec.parent / place / "conformance" / kind / "tiny.yaml"
        old.parent.mkdir(parents=True)
        (spec / "tiny" / f"{kind}.yaml").rename(old)
        name = old.relative_to(spec.parent).as_posix()
        moves.append(f"{name} to spec/tiny/{kind}.yaml")
    with pytest.warns(FutureWarning) as warned:
        check(spec)
    assert [str(warning.message) for warning in warned] == [
        f"move {moves[0]} and {moves[1]}; the next release will not read the old place"
    ]


def test_an_empty_conformance_folder_does_not_hide_a_file_in_the_place_of_0_1(spec: Path) -> None:
    to_the_place_of_0_1(spec, "examples")
    (spec / "tiny" / "conformance").mkdir()
    with pytest.warns(FutureWarning):
        [protocol] = check(spec)
    assert protocol.examples


@pytest.mark.parametrize("kind", ["examples", "captures"])
def test_a_file_in_both_places_is_refused(spec: Path, kind: str) -> None:
    old = to_the_place_of_0_1(spec, kind)
    shutil.copy(old, spec / "tiny" / f"{kind}.yaml")
    with pytest.raises(SpecError) as caught:
        check(spec)
    assert str(caught.value.diagnostics[0]) == (
        f"conformance/{kind}/tiny.yaml:1:1: SW008 this file and spec/tiny/{kind}.yaml both hold the {kind}\n"
        f"    hint: move its entries to spec/tiny/{kind}.yaml and delete it"
    )


@pytest.mark.parametrize("kind", ["examples", "captures"])
def test_a_second_file_in_a_place_of_0_1_is_refused(spec: Path, kind: str) -> None:
    outer = to_the_place_of_0_1(spec, kind)
    inner = spec / "tiny" / "conformance" / kind / "tiny.yaml"
    inner.parent.mkdir(parents=True)
    shutil.copy(outer, inner)
    with pytest.warns(FutureWarning), pytest.raises(SpecError) as caught:
        check(spec)
    assert [str(found) for found in caught.value.diagnostics] == [
        f"conformance/{kind}/tiny.yaml:1:1: SW008 this file and spec/tiny/conformance/{kind}/tiny.yaml both "
        f"hold the {kind}\n    hint: move its entries to spec/tiny/{kind}.yaml and delete it"
    ]


@pytest.mark.parametrize("name", ["units.yaml", "examples.yaml", "messages/more.yaml"])
def test_a_dangling_link_is_reported(spec: Path, name: str) -> None:
    link = spec / "tiny" / name
    link.unlink(missing_ok=True)
    link.symlink_to("nowhere.yaml")
    with pytest.raises(SpecError) as caught:
        check(spec)
    assert str(caught.value.diagnostics[0]).startswith(
        f"tiny/{name}:1:1: SW006 cannot read the file"
    )


def test_a_link_out_of_the_spec_is_not_followed_in_the_place_of_0_1(
    spec: Path, tmp_path: Path
) -> None:
    to_the_place_of_0_1(spec, "examples")
    (spec / "conformance" / "examples").rename(tmp_path / "outside")
    (spec / "conformance" / "examples").symlink_to(tmp_path / "outside")
    with pytest.warns(FutureWarning), pytest.raises(SpecError) as caught:
        check(spec)
    assert "SW008" in {found.code for found in caught.value.diagnostics}
