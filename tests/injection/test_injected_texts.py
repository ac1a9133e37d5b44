"""Payloads in all texts at once change only the strings of the generated code."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
from outputs import blanked, faults, is_code, ruff, run_packages, strings, write_tree
from payloads import HIDDEN, TEXTS, part_or_all
from text_places import Files, KeyPath, Place, all_changed, places, write

from parts import every_nth
from stagewire_generator import TARGETS, check, render
from stagewire_generator.diagnostics import SpecError

Trees = dict[int, dict[str, str]]


# Text of a command protocol that its witness also has -> the places of the text in the witness.
HEAD, WALK, SETUP = (
    f"turtle/{name}.yaml" for name in ("protocol", "messages/walk", "messages/setup")
)
PRINTED = {name: f"turtle/printed/{name}.yaml" for name in ("document", "setup", "commands")}
TOGETHER: dict[tuple[str, KeyPath], list[tuple[str, KeyPath]]] = {
    (HEAD, ("document", "title")): [(PRINTED["document"], ("title", 1))],
    (HEAD, ("document", "date")): [(PRINTED["document"], ("updated", 1))],
    (HEAD, ("document", "sections", 2)): [(PRINTED["document"], ("sections", 2, 1))],
    (WALK, ("commands", "MOOD", "title")): [
        (HEAD, ("document", "sections", 5)),
        (PRINTED["commands"], ("commands", 2, "title")),
    ],
    (SETUP, ("setup_commands", "WAKE", "title")): [
        (PRINTED["setup"], ("tables", 0, "rows", 0, "says")),
        (PRINTED["setup"], ("tables", 1, "rows", 0, "says")),
    ],
}


@pytest.fixture(scope="session")
def free(files: Files) -> list[Place]:
    """The places that accept any text, including those whose text must equal that of the witness."""
    found = [p for p in places(files) if p.unread or (p.free and (p.file, p.path) in TOGETHER)]
    found = [p for p in found if "/overlays/" not in p.file]  # tested in test_injected_overlays.py
    assert {(p.file, p.path) for p in found} > TOGETHER.keys()
    return found


def filled(files: Files, free: list[Place], texts: list[str]) -> Files:
    """Return the files with a text in every free place, cut to the allowed length."""
    found = []
    for place, text in zip(free, texts, strict=True):
        found.append((place, text[: place.longest]))
        for file, path in TOGETHER.get((place.file, place.path), ()):
            other = Place(file, path, False, frozenset(), True, place.longest)
            found.append((other, text[: place.longest]))
    return all_changed(files, found)


def at_step(free: list[Place], step: int) -> list[str]:
    """Return one text for each place. Over all steps, every text is tried in every place."""
    return [TEXTS[(step + index) % len(TEXTS)] for index in range(len(free))]


@pytest.fixture(scope="module", params=part_or_all(32, 1))
def trees(
    request: pytest.FixtureRequest,
    files: Files,
    free: list[Place],
    tmp_path_factory: pytest.TempPathFactory,
) -> Trees:
    """The files rendered at each step."""
    folder = tmp_path_factory.mktemp("texts")
    found = {}
    for step in range(0, len(TEXTS), request.param):
        spec = filled(files, free, at_step(free, step))
        raw = "".join(filter(str.isprintable, "".join(TEXTS)))
        found[step] = render(check(write(spec, folder / str(step), raw=raw)), TARGETS)
    return found


def test_there_are_enough_places_and_payloads(free: list[Place]) -> None:
    assert len(free) > 100
    assert len(TEXTS) > 100


def test_payloads_change_only_strings_of_the_code(trees: Trees, rendered: dict[str, str]) -> None:
    plain = {path: blanked(path, text) for path, text in rendered.items() if is_code(path)}
    for step, files in trees.items():
        assert files.keys() == rendered.keys()
        for path, syntax in plain.items():
            same = files[path] == rendered[path] or blanked(path, files[path]) == syntax
            assert same, f"step {step}: {path}"


def test_rendered_files_are_valid_and_harmless(trees: Trees, rendered: dict[str, str]) -> None:
    for step, files in trees.items():
        assert list(faults(files, rendered)) == [], step


def test_the_formatting_is_final(trees: Trees, tmp_path: Path) -> None:
    for step, files in trees.items():
        write_tree(files, tmp_path / str(step))
    assert ruff("format", "--diff", str(tmp_path)) == ""


def test_packages_have_no_side_effects(trees: Trees, tmp_path: Path) -> None:
    folders = [write_tree(files, tmp_path / str(step)) for step, files in trees.items()]
    assert run_packages(folders, tmp_path / "workplace") == {}


def test_texts_are_unchanged_in_json(
    files: Files, free: list[Place], trees: Trees, tmp_path: Path
) -> None:
    """If a JSON file contains the text of a place, it contains any text of that place unchanged."""
    marks = [f"=mark={index:03}" for index in range(len(free))]
    marked = render(check(write(filled(files, free, marks), tmp_path)), TARGETS)
    arrived = set()
    for path in (path for path in marked if path.endswith(".json")):
        at = {
            where: int(text[6:])
            for where, text in strings(json.loads(marked[path]))
            if re.fullmatch(r"=mark=\d+", text)  # other texts consist of several
        }
        arrived |= set(at.values())
        for step, rendered in trees.items():
            texts = at_step(free, step)
            shown = dict(strings(json.loads(rendered[path])))
            for where, index in at.items():
                assert shown[where] == texts[index][: free[index].longest], (step, free[index])
    missing = {str(free[index]) for index in range(len(free)) if index not in arrived}
    in_python = (
        "tiny/stages.yaml:controllers.TPx.aliases.TP4"  # in device classes, but not in the JSON
    )
    mark = marks[[*map(str, free)].index(in_python)]
    assert any(mark in text for path, text in marked.items() if path.endswith(".py"))
    # The others are only for readers of the spec.
    assert missing - {in_python} == {
        "tiny/protocol.yaml:contexts.status.summary", "tiny/protocol.yaml:formats.dword.note",
        "tiny/protocol.yaml:python.title", "tiny/protocol.yaml:summary",
        "tiny/stages.yaml:controllers.TPx.note", "tiny/stages.yaml:stages.Slide.note",
        "turtle/protocol.yaml:formats.s24.note", "turtle/protocol.yaml:python.title",
        "turtle/protocol.yaml:summary", "carousel/protocol.yaml:formats.s24.note",
        "carousel/protocol.yaml:python.title", "carousel/protocol.yaml:summary",
        "spark/protocol.yaml:summary", "spark/protocol.yaml:contexts.mood.summary",
        "spark/protocol.yaml:contexts.mood.unstated", "tiny/evidence.yaml:sources.sheet.cited_as",
        "tiny/decisions.yaml:decisions.plain-family.reason",
        "tiny/decisions.yaml:decisions.plain-family.source",
        "turtle/decisions.yaml:decisions.longest.reason", "turtle/decisions.yaml:decisions.longest.source",
    }  # fmt: skip


def test_texts_are_in_docstrings(trees: Trees, free: list[Place]) -> None:
    """Docstrings contain the text, except that white space is normalised."""
    import ast

    tiny, turtle = "stagewire_tiny", "stagewire_turtle"
    firmware, title = ("WAKE", "firmware", 0, "note"), ("commands", "MOOD", "title")
    wanted = {
        ("tiny/messages/core.yaml", ("messages", "POS_MOVE", "note")): f"{tiny}/messages/core.py",
        ("tiny/protocol.yaml", ("title",)): f"{tiny}/__init__.py",
        ("tiny/protocol.yaml", ("python", "title")): f"{tiny}/stages.py",
        ("turtle/messages/setup.yaml", ("setup_commands", *firmware)): f"{turtle}/messages/setup.py",
        ("turtle/messages/walk.yaml", ("commands", "GO_TO", "note")): f"{turtle}/messages/walk.py",
        ("turtle/messages/walk.yaml", ("commands", "WHERE", "reply", "note")): f"{turtle}/messages/walk.py",
        ("turtle/messages/walk.yaml", title): f"{turtle}/messages/walk.py",
        ("turtle/quantities.yaml", ("quantities", "distance", "summary")): f"{turtle}/quantities.py",
    }  # fmt: skip
    found = 0
    for step, files in trees.items():
        for place, text in zip(free, at_step(free, step), strict=True):
            module = wanted.get((place.file, place.path))
            if module is None:
                continue
            tree = ast.parse(files[f"python/{module}"])
            held = " ".join(
                node.value
                for node in ast.walk(tree)
                if isinstance(node, ast.Constant) and isinstance(node.value, str)
            )
            # A note starts with a capital.
            assert " ".join(text[: place.longest].split())[1:] in " ".join(held.split()), place
            found += 1
    assert found == len(wanted) * len(trees)


@pytest.mark.parametrize("escaped", [False, True], ids=["raw", "escaped"])
@pytest.mark.parametrize("name", every_nth(HIDDEN, 4))
def test_invisible_characters_are_refused(
    files: Files, free: list[Place], tmp_path: Path, name: str, escaped: bool
) -> None:
    """Every file with such a text is reported, and every place if the characters are escaped."""
    text = HIDDEN[name]
    spec = write(filled(files, free, [text] * len(free)), tmp_path, raw="" if escaped else text)
    with pytest.raises(SpecError) as caught:
        check(spec)
    assert {d.code for d in caught.value.diagnostics} <= {"SW007", "SW010"}
    written = {place.file for place in free} | {f for same in TOGETHER.values() for f, _ in same}
    assert {d.place.file for d in caught.value.diagnostics} == written
    assert all(line.isprintable() for d in caught.value.diagnostics for line in str(d).split("\n"))
    if escaped:
        refused = {d.place for d in caught.value.diagnostics}
        assert len(refused) >= len(free)
