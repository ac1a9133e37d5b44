"""Compare with an output directory and write to it without half-written files or lost work."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import pytest

from stagewire_generator.output import MANIFEST, Change, OutputError, compare, digest, write


def tree(texts: dict[str, str]) -> dict[str, str]:
    """Return ``texts`` with their manifest, as the generator renders it."""
    data = {"schema_version": 1, "files": {path: digest(text) for path, text in texts.items()}}
    return {**texts, MANIFEST: json.dumps(data, indent=2, sort_keys=True) + "\n"}


FILES = tree({"a/one.py": "one = 1\n", "a/b/two.py": "two = 2\n", "three.json": "{}\n"})


def present(out: Path) -> dict[str, str]:
    return {
        path.relative_to(out).as_posix(): path.read_bytes().decode("utf-8")
        for path in out.rglob("*")
        if path.is_file()
    }


@pytest.fixture
def out(tmp_path: Path) -> Path:
    folder = tmp_path / "out"
    write(folder, FILES)
    return folder


def kinds(changes: list[Change]) -> list[tuple[str, str]]:
    return [(change.kind, change.path) for change in changes]


# Comparing


def test_comparing_equal_trees_finds_no_changes(out: Path) -> None:
    assert compare(out, FILES) == []


def test_comparing_with_a_missing_folder_creates_nothing(tmp_path: Path) -> None:
    changes = compare(tmp_path / "nowhere", FILES)
    assert kinds(changes) == [("missing", path) for path in sorted(FILES)]
    assert not (tmp_path / "nowhere").exists()


def test_comparing_lists_the_differences_and_writes_nothing(out: Path) -> None:
    (out / "a" / "one.py").write_text("one = 1  # edited by hand\n")
    (out / "three.json").unlink()
    (out / "a" / "foreign.py").write_text("")
    before = present(out)
    changes = compare(out, FILES)
    assert kinds(changes) == [
        ("orphaned", "a/foreign.py"),
        ("changed", "a/one.py"),
        ("missing", "three.json"),
    ]
    assert changes[1].diff.splitlines() == [
        "--- a/one.py",
        "+++ a/one.py (generated)",
        "@@ -1 +1 @@",
        "-one = 1  # edited by hand",
        "+one = 1",
    ]
    assert present(out) == before


@pytest.mark.parametrize("data", [b"one = 1\r\n", b"one = 1"])
def test_a_difference_in_line_endings_is_found(out: Path, data: bytes) -> None:
    (out / "a" / "one.py").write_bytes(data)
    [change] = compare(out, FILES)
    assert change.kind == "changed"
    assert "line endings" in change.diff


def test_a_file_that_is_not_text_can_be_compared(out: Path) -> None:
    (out / "a" / "one.py").write_bytes(b"\xff\x00\n")
    [change] = compare(out, FILES)
    assert "+one = 1" in change.diff


def test_a_long_difference_is_shortened(out: Path) -> None:
    (out / "a" / "one.py").write_text("".join(f"line {n}\n" for n in range(1000)))
    [change] = compare(out, FILES)
    assert len(change.diff.splitlines()) < 50
    assert "more diff lines" in change.diff


def test_caches_are_ignored(out: Path) -> None:
    (out / "a" / "__pycache__").mkdir()
    (out / "a" / "__pycache__" / "one.pyc").write_bytes(b"\x00")
    assert compare(out, FILES) == []
    assert write(out, FILES) == []


# Writing


def test_writing_creates_the_folder(tmp_path: Path) -> None:
    assert write(tmp_path / "x" / "y", FILES) == sorted(FILES)
    assert present(tmp_path / "x" / "y") == FILES
    assert os.name != "posix" or (tmp_path / "x/y/three.json").stat().st_mode & 0o777 == 0o644


def test_writing_again_changes_nothing(out: Path) -> None:
    before = {path: (out / path).stat().st_mtime_ns for path in FILES}
    assert write(out, FILES) == []
    assert {path: (out / path).stat().st_mtime_ns for path in FILES} == before


def test_an_edited_file_is_restored(out: Path) -> None:
    (out / "a" / "one.py").write_text("one = 2\n")
    assert write(out, FILES) == ["a/one.py"]
    assert present(out) == FILES


def test_stale_files_and_empty_folders_are_removed(out: Path) -> None:
    fewer = tree({"three.json": "{}\n"})
    assert write(out, fewer) == ["a/b/two.py", "a/one.py", MANIFEST]
    assert present(out) == fewer
    assert sorted(p.name for p in out.iterdir()) == [MANIFEST, "three.json"]  # no empty folder


def test_a_folder_that_is_not_empty_is_kept(out: Path) -> None:
    (out / "a" / "__pycache__").mkdir()
    (out / "a" / "__pycache__" / "one.pyc").write_bytes(b"\x00")
    write(out, tree({"three.json": "{}\n"}))
    assert (out / "a" / "__pycache__" / "one.pyc").exists()
    assert not (out / "a" / "b").exists()


@pytest.mark.parametrize("path", ["foreign.txt", "a/foreign.py", "a/b/new/foreign.py"])
def test_a_foreign_file_is_never_deleted(out: Path, path: str) -> None:
    """The file stays in its folder, and only the comparison reports it."""
    (out / path).parent.mkdir(exist_ok=True)
    (out / path).write_text("mine\n")
    fewer = tree({"three.json": "changed\n"})
    assert write(out, fewer) == ["a/b/two.py", "a/one.py", MANIFEST, "three.json"]
    assert present(out) == {**fewer, path: "mine\n"}
    assert kinds(compare(out, fewer)) == [("orphaned", path)]


def test_a_foreign_file_is_never_overwritten(tmp_path: Path) -> None:
    (tmp_path / "three.json").write_text("mine\n")
    with pytest.raises(OutputError, match=r"three\.json"):
        write(tmp_path, FILES)
    assert present(tmp_path) == {"three.json": "mine\n"}


@pytest.mark.parametrize("text", ["mine\n", "{}", "[]", '{"files": 1}', '{"files": {}}'])
def test_a_foreign_manifest_is_never_overwritten(tmp_path: Path, text: str) -> None:
    (tmp_path / MANIFEST).write_text(text)
    with pytest.raises(OutputError, match=r"manifest\.json"):
        write(tmp_path, FILES)
    assert present(tmp_path) == {MANIFEST: text}


def test_a_foreign_file_with_the_same_text_is_accepted(tmp_path: Path) -> None:
    (tmp_path / "three.json").write_text(FILES["three.json"])
    write(tmp_path, FILES)
    assert present(tmp_path) == FILES


def test_an_edited_file_that_is_no_longer_generated_is_not_deleted(out: Path) -> None:
    (out / "a" / "one.py").write_text("one = 2\n")
    before = present(out)
    with pytest.raises(OutputError, match=r"a/one\.py \(edited by hand, and no longer generated\)"):
        write(out, tree({"three.json": "changed\n"}))
    assert present(out) == before


def test_the_error_lists_every_file_in_the_way(out: Path) -> None:
    (out / "a" / "one.py").write_text("one = 2\n")
    (out / "four.json").write_text("mine\n")
    before = present(out)
    with pytest.raises(OutputError) as caught:
        write(out, tree({"three.json": "changed\n", "four.json": "{}\n"}))
    assert "a/one.py (edited by hand" in str(caught.value)
    assert "four.json (not created by the generator)" in str(caught.value)
    assert present(out) == before


def test_a_folder_in_the_place_of_a_file_is_an_error(tmp_path: Path) -> None:
    (tmp_path / "three.json").mkdir()
    with pytest.raises(OutputError, match=r"three\.json \(a directory\)"):
        write(tmp_path, FILES)
    assert present(tmp_path) == {}


def test_a_folder_can_replace_a_generated_file(out: Path) -> None:
    files = tree({"three.json/four.json": "{}\n"})
    write(out, files)
    assert present(out) == files


def test_a_file_in_the_place_of_a_folder_is_an_error(tmp_path: Path) -> None:
    (tmp_path / "a").write_text("mine\n")
    with pytest.raises(OutputError, match=r"a \(a file where a directory is needed\)"):
        write(tmp_path, FILES)
    assert present(tmp_path) == {"a": "mine\n"}


@pytest.mark.parametrize("call", [1, 2, 3])
def test_a_failed_write_leaves_no_half_written_file(
    out: Path, monkeypatch: pytest.MonkeyPatch, call: int
) -> None:
    """Each file is the old or the new one, the manifest is written last, and the next run completes it."""
    new = tree({"a/one.py": "one = 11\n", "a/b/two.py": "two = 22\n", "four.json": "{}\n"})
    old_manifest = (out / MANIFEST).read_text()
    replace = os.replace
    calls = 0

    def failing(source: Any, target: Any) -> None:
        nonlocal calls
        calls += 1
        if calls == call:
            raise OSError(28, "No space left on device")
        replace(source, target)

    monkeypatch.setattr(os, "replace", failing)
    with pytest.raises(OSError, match="No space left"):
        write(out, new)
    monkeypatch.undo()
    for path, text in present(out).items():
        assert text in (FILES.get(path), new.get(path)), path
    assert (out / MANIFEST).read_text() == old_manifest
    write(out, new)
    assert present(out) == new


def test_a_half_written_file_is_hidden_and_in_the_same_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Another folder might be on another disk, and a file cannot be renamed across disks."""
    really = os.replace
    seen: dict[str, Path] = {}

    def watched(source: str, target: Path) -> None:
        seen[Path(target).relative_to(tmp_path).as_posix()] = Path(source)
        really(source, target)

    monkeypatch.setattr(os, "replace", watched)
    write(tmp_path, FILES)
    assert seen.keys() == FILES.keys()
    for path, source in seen.items():
        assert source.parent == (tmp_path / path).parent
        assert source.name.startswith(f".{Path(path).name}.")


def test_an_interrupted_write_leaves_the_old_files(
    out: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def failing(*_: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(os, "chmod", failing)
    with pytest.raises(KeyboardInterrupt):
        write(out, tree({**FILES, "a/one.py": "one = 11\n"}))
    monkeypatch.undo()
    assert present(out) == FILES


@pytest.mark.parametrize(
    "path",
    [
        "../out.py",
        "a/../../out.py",
        "..",
        "/etc/out.py",
        "//server/out.py",
        "C:/out.py",
        "C:out.py",
        "a\\b.py",
        "..\\out.py",
        "a:stream",
        "",
        ".",
    ],
)
def test_a_path_that_leaves_the_folder_is_refused(tmp_path: Path, path: str) -> None:
    out = tmp_path / "out"
    with pytest.raises(OutputError, match="is outside the output directory"):
        write(out, {"fine.py": "", path: "x = 1\n", "zzz.py": ""})
    with pytest.raises(OutputError, match="is outside the output directory"):
        compare(out, {"fine.py": "", path: "x = 1\n"})
    assert list(tmp_path.iterdir()) == []


def test_a_manifest_cannot_point_outside(tmp_path: Path) -> None:
    out = tmp_path / "out"
    victim = tmp_path / "victim.py"
    victim.write_text("x = 1\n")
    out.mkdir()
    files = {"../victim.py": digest("x = 1\n"), "three.json": digest("{}\n")}
    (out / MANIFEST).write_text(json.dumps({"files": files}))
    write(out, FILES)
    assert victim.read_text() == "x = 1\n"
    assert present(out) == FILES


def test_writing_some_targets_keeps_other_files_and_updates_the_manifest(tmp_path: Path) -> None:
    write(tmp_path, tree({"a/one.txt": "1"}))
    assert write(tmp_path, {"b/two.txt": "2"}, partial=True) == ["b/two.txt", MANIFEST]
    assert (tmp_path / "a/one.txt").read_text() == "1"
    listed = json.loads((tmp_path / MANIFEST).read_text())["files"]
    assert listed == {"a/one.txt": digest("1"), "b/two.txt": digest("2")}
    write(tmp_path, tree({"a/one.txt": "1"}))
    assert not (tmp_path / "b").exists()


def test_a_file_in_the_place_of_a_folder_is_reported_when_writing_some_targets(
    tmp_path: Path,
) -> None:
    (tmp_path / "a").write_text("my own\n", encoding="utf-8")
    with pytest.raises(OutputError, match="a file where a directory is needed"):
        write(tmp_path, {"a/one.py": "one = 1\n"}, partial=True)
    assert present(tmp_path) == {"a": "my own\n"}


def test_the_manifest_is_written_last(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A manifest never lists files that an interrupted run did not write."""
    really = os.replace

    def fail(source: str, target: Path) -> None:
        if Path(target).name == "three.json":
            raise OSError("the disk is full")
        really(source, target)

    monkeypatch.setattr(os, "replace", fail)
    with pytest.raises(OSError, match="the disk is full"):
        write(tmp_path / "out", FILES)
    assert set(present(tmp_path / "out")) == {"a/one.py", "a/b/two.py"}


# Untrusted folders


HOSTILE = [
    "../victim.py",
    "/etc/passwd",
    "a/../../victim.py",
    "C:/victim.py",
    "..\\victim.py",
    "",
    "a\x1b[31m",
]


@pytest.mark.parametrize("partial", [False, True])
def test_entries_of_a_hostile_manifest_are_dropped(tmp_path: Path, partial: bool) -> None:
    out = tmp_path / "out"
    out.mkdir()
    (tmp_path / "victim.py").write_text("x = 1\n")
    entries = {
        **dict.fromkeys(HOSTILE, digest("x = 1\n")),
        "b.py": 7,
        "c.py": "../x",
        "d.py": None,
    }
    (out / MANIFEST).write_text(json.dumps({"files": {**entries, "gone.py": digest("")}}))
    write(out, {"three.json": "{}\n"} if partial else FILES, partial=partial)
    assert (tmp_path / "victim.py").read_text() == "x = 1\n"
    listed = set(json.loads((out / MANIFEST).read_text())["files"])
    assert listed == ({"gone.py", "three.json"} if partial else set(FILES) - {MANIFEST})


@pytest.mark.parametrize(
    "text", ["[" * 100_000, '{"files": ' * 50_000, "\x00", '{"files": {"a": {}}}', "1e999"]
)
def test_an_unreadable_manifest_is_kept_and_refused(tmp_path: Path, text: str) -> None:
    (tmp_path / MANIFEST).write_text(text)
    with pytest.raises(OutputError, match=r"manifest\.json"):
        write(tmp_path, FILES)
    assert present(tmp_path) == {MANIFEST: text}
    assert ("changed", MANIFEST) in kinds(compare(tmp_path, FILES))


def outside(tmp_path: Path) -> Path:
    folder = tmp_path / "outside"
    folder.mkdir()
    (folder / "one.py").write_text(FILES["a/one.py"])
    (folder / "old.py").write_text("old\n")
    return folder


@pytest.mark.parametrize("partial", [False, True])
@pytest.mark.parametrize("linked", ["a", "a/b", "a/one.py", "three.json", MANIFEST])
def test_links_are_not_written_through(tmp_path: Path, linked: str, partial: bool) -> None:
    """Files in a linked folder are not deleted either, even if a manifest lists them."""
    victim = outside(tmp_path)
    before = present(victim)
    out = tmp_path / "out"
    write(out, tree({**FILES, "a/old.py": "old\n"}))
    target = victim if linked in ("a", "a/b") else victim / "one.py"
    if (out / linked).is_dir():
        (out / linked).rename(tmp_path / "away")
    else:
        (out / linked).unlink()
    (out / linked).symlink_to(target)
    inside = present(out)
    with pytest.raises(OutputError, match=f"the link {linked}"):
        write(out, FILES, partial=partial)
    assert present(victim) == before
    assert present(out) == inside
    assert any(f"the link {linked}" in change.diff for change in compare(out, FILES))


def test_a_link_that_is_not_generated_is_left_alone(tmp_path: Path) -> None:
    victim = outside(tmp_path)
    before = present(victim)
    out = tmp_path / "out"
    write(out, tree({**FILES, "old.py": "old\n"}))
    (out / "old.py").unlink()
    (out / "old.py").symlink_to(victim / "old.py")
    (out / "more").symlink_to(victim)
    write(out, FILES)
    assert (out / "old.py").is_symlink()
    assert (out / "more").is_symlink()
    assert present(victim) == before


def test_the_folder_itself_may_be_a_link(tmp_path: Path) -> None:
    (tmp_path / "real").mkdir()
    (tmp_path / "out").symlink_to(tmp_path / "real")
    write(tmp_path / "out", FILES)
    assert present(tmp_path / "real") == FILES
    assert compare(tmp_path / "out", FILES) == []


@pytest.mark.parametrize("path", ["a/one.py", MANIFEST])
def test_a_pipe_in_the_place_of_a_file_is_refused(out: Path, path: str) -> None:
    (out / path).unlink()
    os.mkfifo(out / path)
    assert ("changed", path) in kinds(compare(out, FILES))
    with pytest.raises(OutputError, match=r"a special file"):
        write(out, FILES)


def test_a_loop_of_links_is_refused(out: Path) -> None:
    (out / "a" / "one.py").unlink()
    (out / "a" / "one.py").symlink_to("one.py")
    (out / "loop").symlink_to(".")
    assert ("changed", "a/one.py") in kinds(compare(out, FILES))
    with pytest.raises(OutputError, match=r"the link a/one\.py"):
        write(out, FILES)
