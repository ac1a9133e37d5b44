"""One payload in one place: it is refused with plain diagnostics, or what is generated is harmless.

Every run tries one payload in each place with a pattern, and in each eighth of those that accept any
text: those have tests with all texts at once. The matrix tries all pairs, in parts.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import pytest
from outputs import blanked, faults, is_code, ruff, run_packages, write_tree
from payloads import EVERYWHERE
from places import Files, Place, changed, write

from stagewire_generator import TARGETS, check, render
from stagewire_generator.diagnostics import CODES, SpecError

STEP = 31  # has no divisor in common with the number of payloads
PARTS = 9
RUNS = [
    pytest.param(None, id="one payload"),
    *(pytest.param(n, id=f"part {n}", marks=pytest.mark.matrix) for n in range(PARTS)),
]


@dataclass
class Outcome:
    """What became of the pairs that were tried."""

    pairs: list[tuple[Place, str]]
    part: int | None  # its number; without one, places with a payload each
    refused: int = 0
    same: int = 0  # the code is the same but for its strings
    other: dict[str, dict[str, str]] = field(default_factory=dict)  # files by pair
    wrong: list[str] = field(default_factory=list)

    @property
    def tried(self) -> int:
        return self.refused + self.same + len(self.other)


def pairs(places: list[Place], part: int | None) -> list[tuple[Place, str]]:
    """Return a part of all pairs; without a number places with one payload each."""
    if part is not None:
        return [(place, text) for place in places for text in EVERYWHERE[part::PARTS]]
    chosen = [place for at, place in enumerate(places) if not place.free or at % 8 == 0]
    return [(p, EVERYWHERE[at * STEP % len(EVERYWHERE)]) for at, p in enumerate(chosen)]


@pytest.fixture(scope="module", params=RUNS)
def outcome(
    request: pytest.FixtureRequest,
    quick_checking: None,
    files: Files,
    places: list[Place],
    rendered: dict[str, str],
    tmp_path_factory: pytest.TempPathFactory,
) -> Outcome:
    """Try all pairs."""
    plain = {path: blanked(path, text) for path, text in rendered.items() if is_code(path)}
    spec = write(files, tmp_path_factory.mktemp("each") / "spec")
    found = Outcome(pairs(places, request.param), request.param)
    for place, text in found.pairs:
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
            yield f"{diagnostic.place.file} is no file of the spec"
        if diagnostic.code not in CODES or len(said) > 2000:
            yield f"no plain diagnostic: {said[:200]}"
        if not all(line.isprintable() for line in said.split("\n")) or said.count("\n") != 1:
            yield f"a diagnostic that could steer a terminal: {said!a}"


def test_every_place_was_tried(outcome: Outcome, places: list[Place]) -> None:
    print(
        f"{len(places)} places, {len(EVERYWHERE)} payloads, {outcome.tried} pairs: {outcome.refused} "
        f"refused, {outcome.same} the same code, {len(outcome.other)} other code"
    )
    assert outcome.tried == len(outcome.pairs)
    if outcome.part is None:
        assert outcome.tried >= len(places) // 2
    else:
        assert outcome.tried == len(places) * len(EVERYWHERE[outcome.part :: PARTS])
    assert min(outcome.refused, outcome.same) > 0


def test_the_parts_are_the_whole(places: list[Place]) -> None:
    parts = [pair for part in range(PARTS) for pair in pairs(places, part)]
    assert len(parts) == len(places) * len(EVERYWHERE)
    assert {(str(place), text) for place, text in parts} >= {
        (str(place), text) for place in places[::50] for text in EVERYWHERE
    }


def test_refused_plainly_or_harmless(outcome: Outcome) -> None:
    assert outcome.wrong == []


def test_formatting_is_final(outcome: Outcome, tmp_path: Path) -> None:
    for number, files in enumerate(outcome.other.values()):
        write_tree(files, tmp_path / str(number))
    assert ruff("format", "--diff", str(tmp_path)) == ""
    assert ruff("check", "--select", "F,E9", str(tmp_path)) == ""


def test_packages_work(outcome: Outcome, tmp_path: Path) -> None:
    folders = {}
    for number, (pair, files) in enumerate(outcome.other.items()):
        folders[str(write_tree(files, tmp_path / str(number)) / "python")] = pair
    wrong = run_packages([Path(folder).parent for folder in folders], tmp_path / "workplace")
    assert {folders[folder]: fault for folder, fault in wrong.items()} == {}
