"""Payloads in the texts of overlays: the code generated with the overlay is harmless."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from outputs import blanked, faults, is_code, ruff, run_packages, write_tree
from payloads import EVERYWHERE, TEXTS, part_or_all
from text_places import Files, Place, all_changed, changed, write
from text_places import places as all_places

from parts import PROOF
from stagewire_generator import TARGETS, check, render
from stagewire_generator.diagnostics import SpecError

OVERLAYS = ["tiny/between", "tiny/later"]
EVERY = 25
"""A part tries one in this many payloads at each place; `make test` tries one part."""


@pytest.fixture(scope="module")
def laid_over(files: Files, tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """The files generated with the unchanged overlay."""
    spec = write(files, tmp_path_factory.mktemp("later") / "spec")
    return render(check(spec, overlays=OVERLAYS), TARGETS)


def pairs(files: Files, part: int) -> Iterator[tuple[Place, str]]:
    """Yield every place of an overlay with the payloads of a part."""
    found = [place for place in all_places(files) if "/overlays/" in place.file]
    assert {place.file.rpartition("/")[2] for place in found} == {
        "overlay.yaml",
        "additions.yaml",
        "extra.yaml",
        "units.yaml",
    }
    for index, place in enumerate(found):
        for text in EVERYWHERE[(index + part) % EVERY :: EVERY]:
            yield place, text


@pytest.mark.parametrize(
    "part", [0, *(pytest.param(part, marks=PROOF) for part in range(1, EVERY))]
)
def test_one_payload_in_an_overlay_is_refused_or_harmless(
    quick_checking: None, files: Files, laid_over: dict[str, str], tmp_path: Path, part: int
) -> None:
    plain = {path: blanked(path, text) for path, text in laid_over.items() if is_code(path)}
    spec = write(files, tmp_path / "spec")
    same, other = 0, {}
    for place, text in pairs(files, part):
        raw = text if text.isprintable() else ""
        write({place.file: changed(files, place, text)[place.file]}, spec, raw=raw)
        pair = f"{place} = {text[:60]!a}"
        try:
            made = render(check(spec, overlays=OVERLAYS), TARGETS)
        except SpecError as error:
            said = [line for d in error.diagnostics for line in str(d).split("\n")]
            assert said, pair
            assert all(line.isprintable() for line in said), pair
        else:
            assert list(faults(made, laid_over)) == [], pair
            if made.keys() == laid_over.keys() and all(
                made[path] == laid_over[path] or blanked(path, made[path]) == syntax
                for path, syntax in plain.items()
            ):
                same += 1
            else:
                other[pair] = made
        write({place.file: files[place.file]}, spec)
    assert same > 30
    folders = [write_tree(made, tmp_path / str(n)) for n, made in enumerate(other.values())]
    assert run_packages(folders, tmp_path / "workplace") == {}


@pytest.mark.parametrize("every", part_or_all(14, 1))
def test_payloads_in_all_texts_of_an_overlay_are_harmless(
    files: Files, laid_over: dict[str, str], tmp_path: Path, every: int
) -> None:
    """Only strings of the code change, the formatting is final, and no payload is executed."""
    free = [place for place in all_places(files) if "/overlays/" in place.file and place.unread]
    assert len(free) > 10
    folders = []
    for step in range(0, len(TEXTS), every):
        texts = [TEXTS[(step + index) % len(TEXTS)] for index in range(len(free))]
        hostile = all_changed(
            files, [(p, text[: p.longest]) for p, text in zip(free, texts, strict=True)]
        )
        raw = "".join(filter(str.isprintable, "".join(TEXTS)))
        made = render(
            check(write(hostile, tmp_path / f"spec{step}", raw=raw), overlays=OVERLAYS), TARGETS
        )
        for path, whole in laid_over.items():
            if is_code(path) and made[path] != whole:
                assert blanked(path, made[path]) == blanked(path, whole), (path, step)
        assert list(faults(made, laid_over)) == [], step
        folders.append(write_tree(made, tmp_path / f"out{step}"))
    assert len(folders) > 10
    assert ruff("format", "--diff", *map(str, folders)) == ""
    assert run_packages(folders, tmp_path / "workplace") == {}
