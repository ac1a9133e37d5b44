"""Texts stay texts: all of them at once are hostile, and the code is the same but for its strings."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from outputs import blanked, faults, is_code, ruff, run_packages, strings, write_tree
from payloads import HIDDEN, TEXTS, part_or_all
from text_places import Files, KeyPath, Place, all_changed, places, write

from parts import every_nth
from stagewire_generator import TARGETS, check, render
from stagewire_generator.diagnostics import SpecError

Trees = dict[int, dict[str, str]]


# Texts of a protocol of commands that its witness has, too -> where else they stand.
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
    """The texts that nothing reads, and those that may be any as long as the witness has the same."""
    found = [p for p in places(files) if p.unread or (p.free and (p.file, p.path) in TOGETHER)]
    found = [p for p in found if "/overlays/" not in p.file]  # they have tests of their own
    assert {(p.file, p.path) for p in found} > TOGETHER.keys()
    return found


def filled(files: Files, free: list[Place], texts: list[str]) -> Files:
    """Return the files with a text in every free place, as long as it may be."""
    found = []
    for place, text in zip(free, texts, strict=True):
        found.append((place, text[: place.longest]))
        for file, path in TOGETHER.get((place.file, place.path), ()):
            other = Place(file, path, False, frozenset(), True, place.longest)
            found.append((other, text[: place.longest]))
    return all_changed(files, found)


def at_step(free: list[Place], step: int) -> list[str]:
    """Return one text for each place; over all steps every text stands in every place."""
    return [TEXTS[(step + index) % len(TEXTS)] for index in range(len(free))]


@pytest.fixture(scope="module", params=part_or_all(32, 1))
def trees(
    request: pytest.FixtureRequest,
    files: Files,
    free: list[Place],
    tmp_path_factory: pytest.TempPathFactory,
) -> Trees:
    """What is rendered at each step."""
    folder = tmp_path_factory.mktemp("texts")
    found = {}
    for step in range(0, len(TEXTS), request.param):
        spec = filled(files, free, at_step(free, step))
        raw = "".join(filter(str.isprintable, "".join(TEXTS)))
        found[step] = render(check(write(spec, folder / str(step), raw=raw)), TARGETS)
    return found


def test_there_are_enough(free: list[Place]) -> None:
    assert len(free) > 100
    assert len(TEXTS) > 100


def test_the_code_is_the_same_but_for_its_strings(trees: Trees, rendered: dict[str, str]) -> None:
    plain = {path: blanked(path, text) for path, text in rendered.items() if is_code(path)}
    for step, files in trees.items():
        assert files.keys() == rendered.keys()
        for path, syntax in plain.items():
            same = files[path] == rendered[path] or blanked(path, files[path]) == syntax
            assert same, f"step {step}: {path}"


def test_nothing_harmful_is_rendered(trees: Trees, rendered: dict[str, str]) -> None:
    for step, files in trees.items():
        assert list(faults(files, rendered)) == [], step


def test_formatting_is_final(trees: Trees, tmp_path: Path) -> None:
    for step, files in trees.items():
        write_tree(files, tmp_path / str(step))
    assert ruff("format", "--diff", str(tmp_path)) == ""


def test_packages_have_no_side_effects(trees: Trees, tmp_path: Path) -> None:
    folders = [write_tree(files, tmp_path / str(step)) for step, files in trees.items()]
    assert run_packages(folders, tmp_path / "workplace") == {}


def test_texts_arrive_unchanged(
    files: Files, free: list[Place], trees: Trees, tmp_path: Path
) -> None:
    """Wherever the JSON shows the text of a place, it shows every other text of this place, too."""
    marks = [f"=mark={index:03}" for index in range(len(free))]
    marked = render(check(write(filled(files, free, marks), tmp_path)), TARGETS)
    arrived = set()
    for path in (path for path in marked if path.endswith(".json")):
        at = {
            where: int(text[6:])
            for where, text in strings(json.loads(marked[path]))
            if text.startswith("=mark=")
        }
        arrived |= set(at.values())
        for step, rendered in trees.items():
            texts = at_step(free, step)
            shown = dict(strings(json.loads(rendered[path])))
            for where, index in at.items():
                assert shown[where] == texts[index][: free[index].longest], (step, free[index])
    missing = {str(free[index]) for index in range(len(free)) if index not in arrived}
    in_python = "tiny/stages.yaml:controllers.TPx.aliases.TP4"  # device classes say it, no JSON
    mark = marks[[*map(str, free)].index(in_python)]
    assert any(mark in text for path, text in marked.items() if path.endswith(".py"))
    # The others are for the readers of the spec alone
    assert missing - {in_python} == {
        "tiny/protocol.yaml:contexts.status.summary", "tiny/protocol.yaml:formats.dword.note",
        "tiny/protocol.yaml:python.title", "tiny/protocol.yaml:summary",
        "tiny/stages.yaml:controllers.TPx.note", "tiny/stages.yaml:stages.Slide.note",
        "turtle/protocol.yaml:formats.s24.note", "turtle/protocol.yaml:python.title",
        "turtle/protocol.yaml:summary", "carousel/protocol.yaml:formats.s24.note",
        "carousel/protocol.yaml:python.title", "carousel/protocol.yaml:summary",
        "spark/protocol.yaml:summary",
    }  # fmt: skip


def test_texts_arrive_in_docstrings(trees: Trees, free: list[Place]) -> None:
    """A text is in the docstrings as it is, but for blanks and what a backslash would do."""
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
            # A note begins with a capital
            assert " ".join(text[: place.longest].split())[1:] in " ".join(held.split()), place
            found += 1
    assert found == len(wanted) * len(trees)


@pytest.mark.parametrize("escaped", [False, True], ids=["raw", "escaped"])
@pytest.mark.parametrize("name", every_nth(HIDDEN, 4))
def test_what_cannot_be_seen_is_refused(
    files: Files, free: list[Place], tmp_path: Path, name: str, escaped: bool
) -> None:
    """In every text, and every text is named; a file with such a character in it is not read on."""
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
