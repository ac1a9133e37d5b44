"""One payload in one place is refused with a printable diagnostic, or the generated code is harmless.

Every run tries one payload in each place with a pattern, and in one of eight places that accept any text,
since other tests cover those. `make proofs` tries all pairs, in parts.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import pytest
from outputs import blanked, faults, is_code, ruff, run_packages, write_tree
from payloads import EVERYWHERE
from text_places import Files, Place, changed, write

from parts import PROOF
from stagewire_generator import TARGETS, check, render
from stagewire_generator.codes import CODES
from stagewire_generator.diagnostics import SpecError

STEP = 31  # coprime to the number of payloads
PARTS = 27
RUNS = [
    pytest.param(None, id="one payload"),
    *(pytest.param(n, id=f"part {n}", marks=PROOF) for n in range(PARTS)),
]


@dataclass
class Outcome:
    """The result of all pairs."""

    refused: int = 0
    same: int = 0  # only strings of the code changed
    other: dict[str, dict[str, str]] = field(default_factory=dict)  # files by pair
    wrong: list[str] = field(default_factory=list)


def pairs(places: list[Place], part: int | None) -> list[tuple[Place, str]]:
    """Return a part of all pairs, or without a part number, a choice of places with one payload each."""
    if part is not None:
        return [(place, text) for place in places for text in EVERYWHERE[part::PARTS]]
    chosen = [place for at, place in enumerate(places) if not place.free or at % 8 == 0]
    return [(p, EVERYWHERE[at * STEP % len(EVERYWHERE)]) for at, p in enumerate(chosen)]


def outcome(
    tried: list[tuple[Place, str]], files: Files, rendered: dict[str, str], spec: Path
) -> Outcome:
    """Try the pairs in a copy of the spec."""
    plain = {path: blanked(path, text) for path, text in rendered.items() if is_code(path)}
    write(files, spec)
    found = Outcome()
    for place, text in tried:
        raw = text if text.isprintable() else ""
        write({place.file: changed(files, place, text)[place.file]}, spec, raw=raw)
        pair = f"{place} = {text[:60]!a}"
        try:
            made = render(check(spec), TARGETS)
        except SpecError as error:
            found.refused += 1
            found.wrong += [f"{pair}: {fault}" for fault in bad_refusal(error, files)]
        except Exception as error:
            found.wrong.append(f"{pair}: {error!r}")
        else:
            found.wrong += [f"{pair}: {fault}" for fault in faults(made, rendered)]
            if made.keys() == rendered.keys() and all(
                made[path] == rendered[path] or blanked(path, made[path]) == syntax
                for path, syntax in plain.items()
            ):
                found.same += 1
            else:
                found.other[pair] = made
        write({place.file: files[place.file]}, spec)
    return found


def bad_refusal(error: SpecError, files: Files) -> Iterator[str]:
    for diagnostic in error.diagnostics:
        said = str(diagnostic)
        if diagnostic.place.file not in files and diagnostic.place.file != "printed":
            yield f"{diagnostic.place.file} is not a file of the spec"
        if diagnostic.code not in CODES or len(said) > 2000:
            yield f"unknown code or too long: {said[:200]}"
        if not all(line.isprintable() for line in said.split("\n")) or said.count("\n") != 1:
            yield f"the diagnostic can control a terminal: {said!a}"


def test_the_parts_cover_all_pairs(places: list[Place]) -> None:
    parts = [pair for part in range(PARTS) for pair in pairs(places, part)]
    assert len(parts) == len(places) * len(EVERYWHERE)
    assert {(str(place), text) for place, text in parts} >= {
        (str(place), text) for place in places[::50] for text in EVERYWHERE
    }


@pytest.mark.parametrize("part", RUNS)
def test_one_payload_is_refused_or_harmless(
    part: int | None,
    quick_checking: None,
    files: Files,
    places: list[Place],
    rendered: dict[str, str],
    tmp_path: Path,
) -> None:
    tried = pairs(places, part)
    assert len(tried) >= len(places) // 2
    found = outcome(tried, files, rendered, tmp_path / "spec")
    assert found.wrong == []
    assert found.refused + found.same + len(found.other) == len(tried)
    assert min(found.refused, found.same) > 0
    trees = {
        write_tree(made, tmp_path / "made" / str(number)): pair
        for number, (pair, made) in enumerate(found.other.items())
    }
    if trees:
        _formatting_is_final(tmp_path / "made")
    wrong = run_packages(list(trees), tmp_path / "workplace")
    assert {trees[Path(folder).parent]: fault for folder, fault in wrong.items()} == {}


def _formatting_is_final(made: Path) -> None:
    assert ruff("format", "--diff", str(made)) == ""
    assert ruff("check", "--select", "F,E9", str(made)) == ""
