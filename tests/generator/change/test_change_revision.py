"""Specs from a git repository: the right files, byte for byte, and no side effects."""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
from collections.abc import Callable
from pathlib import Path

import pytest

from stagewire_generator import SpecError, check
from stagewire_generator.change import RevisionError, compare, revision

Git = Callable[..., bytes]


@pytest.fixture
def temporary(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The directory for temporary files."""
    folder = tmp_path / "temporary"
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    return folder


@pytest.fixture
def git(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Git:
    """A function that runs git in a new repository, which is the current directory."""
    for name in [name for name in os.environ if name.startswith("GIT_")]:
        monkeypatch.delenv(name)
    monkeypatch.setenv("GIT_CONFIG_GLOBAL", os.devnull)
    monkeypatch.setenv("GIT_CONFIG_SYSTEM", os.devnull)
    repository = tmp_path / "repository"
    repository.mkdir()
    monkeypatch.chdir(repository)

    def run(*arguments: str, input: bytes = b"") -> bytes:
        config = ("-c", "user.name=Somebody", "-c", "user.email=somebody@example.org")
        config += ("-c", "core.autocrlf=false", "-c", "protocol.file.allow=always")
        command = ["git", *config, *arguments]
        return subprocess.run(command, input=input, check=True, capture_output=True).stdout

    run("init", "--quiet")
    return run


@pytest.fixture
def repository(git: Git, good_spec: Path) -> Path:
    """A repository with two commits: the good spec in a usual layout, and one with another title."""
    top = Path.cwd()
    shutil.copytree(good_spec / "tiny", top / "spec" / "tiny")
    commit(git)
    head = top / "spec" / "tiny" / "protocol.yaml"
    head.write_text(head.read_text(encoding="utf-8").replace("title: Tiny", "title: Small"))
    commit(git)
    return top


def commit(git: Git) -> None:
    git("add", "--all")
    git("commit", "--quiet", "--message", "a change")


def state(git: Git) -> tuple[bytes, dict[Path, bytes]]:
    """Return the status from git, and all files in the work tree."""
    files = {
        path: path.read_bytes()
        for path in Path.cwd().rglob("*")
        if path.is_file() and ".git" not in path.parts
    }
    return git("status", "--porcelain", "--ignored"), files


def title(name: str, *spec: str) -> str:
    with revision(name, *spec) as extracted:
        [protocol] = check(extracted.spec)
        assert protocol.examples
        assert protocol.captures
    return protocol.python_title


def refused(name: str, *spec: str) -> str:
    with pytest.raises(RevisionError) as caught, revision(name, *spec):
        pass
    return str(caught.value)


def test_each_revision_has_its_own_spec(repository: Path, git: Git) -> None:
    git("tag", "v1", "HEAD~1")
    assert [title("HEAD"), title("HEAD~1"), title("v1")] == ["Small", "Tiny", "Tiny"]


def test_a_revision_equals_the_committed_folder(repository: Path) -> None:
    with revision("HEAD") as extracted:
        assert compare(check(extracted.spec), check(repository / "spec")) == []


def test_the_work_tree_is_unchanged_and_temporary_files_are_removed(
    repository: Path, git: Git, temporary: Path
) -> None:
    (repository / "spec" / "tiny" / "units.yaml").write_text("half: done\n", encoding="utf-8")
    (repository / "note.txt").write_text("mine\n", encoding="utf-8")
    before = state(git)
    with revision("HEAD~1") as extracted:
        assert extracted.spec.is_relative_to(temporary)
        assert not (extracted.spec / "note.txt").exists()
        check(extracted.spec)
    assert state(git) == before
    assert list(temporary.iterdir()) == []


def test_temporary_files_are_removed_after_an_error(repository: Path, temporary: Path) -> None:
    with pytest.raises(KeyboardInterrupt), revision("HEAD"):
        raise KeyboardInterrupt
    assert list(temporary.iterdir()) == []


@pytest.mark.parametrize(
    ("folder", "name", "spec"),
    [
        (".", "HEAD", "spec"),
        (".", "HEAD", "./spec/"),
        (".", "HEAD:spec", "nowhere"),
        (".", "HEAD:./spec", "nowhere"),
        (".", "HEAD", "spec/tiny"),
        ("spec", "HEAD", "."),
        ("spec", "HEAD", "../spec"),
        ("spec/tiny", "HEAD", "."),
        ("spec/tiny", "HEAD", "../../spec"),
        ("spec/tiny", "HEAD:spec", "nowhere"),
        ("spec/tiny", "HEAD:../../spec", "nowhere"),
    ],
)
def test_folders_are_found_from_any_current_folder(
    repository: Path, monkeypatch: pytest.MonkeyPatch, folder: str, name: str, spec: str
) -> None:
    monkeypatch.chdir(repository / folder)
    assert title(name, spec) == "Small"


def test_a_revision_may_have_a_colon_in_braces(repository: Path) -> None:
    assert title("HEAD^{/a change}", "spec") == "Small"
    assert refused("HEAD^{/no: such}") == "the repository has no revision HEAD^{/no: such}"
    assert title("HEAD^{/a.change}:spec", "nowhere") == "Small"


def test_the_folder_may_be_an_absolute_path(repository: Path) -> None:
    assert title("HEAD~1", str(repository / "spec")) == "Tiny"


def test_examples_in_the_spec_are_found(git: Git, good_spec: Path) -> None:
    shutil.copytree(good_spec, "here", dirs_exist_ok=True)
    commit(git)
    assert title("HEAD:here") == "Tiny"


def test_a_bare_repository_can_be_read(
    repository: Path, git: Git, monkeypatch: pytest.MonkeyPatch
) -> None:
    git("clone", "--quiet", "--bare", ".", "../bare")
    monkeypatch.chdir(repository.parent / "bare")
    assert title("HEAD~1") == "Tiny"


def test_git_attributes_do_not_change_any_bytes(repository: Path, git: Git) -> None:
    """A checkout or an archive would rewrite or omit these files."""
    rules = "*.yaml text eol=crlf ident export-subst\nunits.yaml export-ignore\n"
    (repository / ".gitattributes").write_text(rules, encoding="utf-8")
    path = repository / "spec" / "tiny" / "stages.yaml"
    path.write_bytes(path.read_bytes() + b"# $Id$ $Format:%H$\n")
    wanted = path.read_bytes()
    commit(git)
    with revision("HEAD") as extracted:
        assert (extracted.spec / "tiny" / "stages.yaml").read_bytes() == wanted
        assert (extracted.spec / "tiny" / "units.yaml").is_file()


def test_file_names_may_contain_any_characters(repository: Path, git: Git) -> None:
    path = repository / "spec" / "tiny" / "messages"
    (path / "extra.yaml").rename(path / 'größe "1".yaml')
    commit(git)
    assert title("HEAD") == "Small"


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("HEAD~7", "the repository has no revision HEAD~7"),
        ("nonsense", "the repository has no revision nonsense"),
        ("HEAD:nowhere", "the revision HEAD has no directory nowhere"),
        ("HEAD:spec/tiny/units.yaml", "has no directory spec/tiny/units.yaml"),
        ("HEAD:../spec", "is outside the repository"),
        ("HEAD:/etc", "is outside the repository"),
        ("--output=x", "is not a revision"),
        ("-h", "is not a revision"),
        ("", "is not a revision"),
        (":spec", "is not a revision"),
        ("HEAD{", "is not a revision"),
        ("HEAD:spec\0", "is not a revision"),
        ("HEAD\n", "is not a revision"),
        ("HEAD\0", "is not a revision"),
    ],
)
def test_an_invalid_revision_is_reported(repository: Path, name: str, said: str) -> None:
    assert said in refused(name)
    assert not (repository / "x").exists()


def test_a_folder_outside_a_repository_is_reported(
    repository: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("GIT_CEILING_DIRECTORIES", str(tmp_path.parent))
    assert "is not in a git repository (fatal: not a git repository" in refused("HEAD")


def test_missing_git_is_reported(repository: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(repository))
    assert "requires git, which is not installed" in refused("HEAD")


def test_broken_git_is_reported(
    repository: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "bin").mkdir()
    (tmp_path / "bin" / "git").write_text("#!/nowhere/sh\n", encoding="utf-8")
    (tmp_path / "bin" / "git").chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path / "bin"))
    assert "cannot run git" in refused("HEAD")


@pytest.mark.parametrize(
    "path",
    [
        "spec", "spec/tiny/stages.yaml", "spec/tiny/messages", "spec/schema", "conformance",
        "conformance/examples",
    ],
)  # fmt: skip
def test_a_symbolic_link_is_refused(repository: Path, git: Git, path: str, tmp_path: Path) -> None:
    there = tmp_path / "there"
    if (repository / path).exists():
        (repository / path).rename(there)
    (repository / path).parent.mkdir(exist_ok=True)
    (repository / path).symlink_to(there)
    commit(git)
    assert f"HEAD:{path} is a symbolic link" in refused("HEAD")


def test_a_submodule_is_refused(repository: Path, git: Git) -> None:
    sha = git("rev-parse", "HEAD").decode().strip()
    git("update-index", "--add", "--cacheinfo", f"160000,{sha},spec/other")
    git("commit", "--quiet", "--message", "a submodule")
    assert "HEAD:spec/other is a submodule" in refused("HEAD")


@pytest.mark.parametrize("name", ["..", ".", "a\\b", "c:d"])
def test_a_path_that_leads_out_is_refused(
    repository: Path, git: Git, temporary: Path, name: str
) -> None:
    """Git never creates such a tree, but an attacker can write the objects by hand."""
    blob = bytes.fromhex(git("hash-object", "-w", "--stdin", input=b"evil: 1\n").decode().strip())
    for mode, entry in ((b"100644", b"evil.yaml"), (b"40000", name.encode()), (b"40000", b"spec")):
        tree = mode + b" " + entry + b"\0" + blob
        sha = git("hash-object", "-t", "tree", "-w", "--literally", "--stdin", input=tree)
        blob = bytes.fromhex(sha.decode().strip())
    made = git("commit-tree", "-m", "evil", blob.hex()).decode().strip()
    assert "leads out of the directory" in refused(made)
    assert list(temporary.iterdir()) == []


def test_a_missing_object_is_reported(repository: Path, git: Git) -> None:
    sha = git("rev-parse", "HEAD:spec/tiny/units.yaml").decode().strip()
    path = repository / ".git" / "objects" / sha[:2] / sha[2:]
    path.chmod(0o644)
    path.unlink()
    assert f"the object {sha} is missing" in refused("HEAD")


@pytest.mark.parametrize(
    ("path", "spec", "place"),
    [
        ("spec/tiny/units.yaml", "spec", "HEAD:spec/tiny/units.yaml:1:1"),
        ("spec/tiny/units.yaml", "spec/tiny", "HEAD:spec/tiny/units.yaml:1:1"),
        ("spec/tiny/examples.yaml", "spec", "HEAD:spec/tiny/examples.yaml:1:1"),
        ("conformance/examples/tiny.yaml", "spec", "HEAD:conformance/examples/tiny.yaml:1:1"),
        ("spec/conformance/examples/tiny.yaml", "spec", "HEAD:spec/conformance/examples/tiny.yaml:1:1"),
        ("spec/tiny/conformance/examples/tiny.yaml", "spec",
         "HEAD:spec/tiny/conformance/examples/tiny.yaml:1:1"),
    ],
)  # fmt: skip
def test_places_are_named_as_in_the_repository(
    repository: Path, git: Git, path: str, spec: str, place: str
) -> None:
    (repository / path).parent.mkdir(parents=True, exist_ok=True)
    if "conformance" in path:
        (repository / "spec" / "tiny" / "examples.yaml").unlink()
    (repository / path).write_text("", encoding="utf-8")
    commit(git)
    with revision("HEAD", spec) as extracted:
        with pytest.raises(SpecError) as caught:
            check(extracted.spec)
        named = [extracted.named(diagnostic) for diagnostic in caught.value.diagnostics]
    assert place in [str(diagnostic.place) for diagnostic in named]


def test_the_place_of_a_folder_without_a_protocol(repository: Path) -> None:
    with revision("HEAD:spec/tiny/messages") as extracted:
        with pytest.raises(SpecError) as caught:
            check(extracted.spec)
        [diagnostic] = caught.value.diagnostics
        assert str(extracted.named(diagnostic).place) == "HEAD:spec/tiny/messages:1:1"
