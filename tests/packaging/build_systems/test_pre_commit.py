"""The hooks, run by the real pre-commit in repositories with a small spec."""

from __future__ import annotations

import re
import shutil
import sysconfig
import tomllib
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
import yaml
from build_systems_page import blocks

from checkout import ROOT

if TYPE_CHECKING:
    from conftest import Run

HOOKS: list[dict[str, Any]] = yaml.safe_load(
    (ROOT / ".pre-commit-hooks.yaml").read_text(encoding="utf-8")
)
PACKAGED = ("runtime", "generated", "generator", "conformance", "cli", "spec/schema")
WHO = {
    f"GIT_{who}_{what}": value
    for who in ("AUTHOR", "COMMITTER")
    for what, value in (("NAME", "nobody"), ("EMAIL", "nobody@example.invalid"))
}


@pytest.fixture
def git(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Run:
    """Run Git in the project, independently of the user's settings and environment."""
    for name, value in WHO.items():
        monkeypatch.setenv(name, value)
    monkeypatch.setenv("GIT_CONFIG_GLOBAL", str(tmp_path / "no-config"))
    monkeypatch.setenv("GIT_CONFIG_NOSYSTEM", "1")
    for name in ("GIT_DIR", "GIT_INDEX_FILE", "GIT_WORK_TREE"):  # set if a Git hook runs the tests
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("PRE_COMMIT_HOME", str(tmp_path / "pre-commit"))
    return lambda *words: run("git", *words)


@pytest.fixture(autouse=True)
def canonical(run: Run) -> None:
    """Format the spec: the path of the schemas in its comments depends on where they are."""
    assert run("stagewire", "format").returncode == 0


@pytest.fixture
def commit(project: Path, git: Run, run: Run) -> Run:
    """Commit everything in a repository with the hooks of the page, which run from this environment."""
    use(project, blocks("yaml")[0])
    assert git("init", "--quiet").returncode == 0
    assert run("pre-commit", "install").returncode == 0
    assert run("stagewire", "generate").returncode == 0

    def commit() -> Any:
        assert git("add", "--all").returncode == 0
        return git("commit", "--quiet", "--message", "a change")

    return commit


def use(project: Path, page: str) -> None:
    """Write a configuration of the page that runs the hooks from this environment.

    The repository is ``local``, so that nothing is installed. The hooks are copied from the manifest, except
    for the language.
    """
    config = yaml.safe_load(page)
    [repo] = config["repos"]
    known = {hook["id"]: hook for hook in HOOKS}
    repo["hooks"] = [
        {**known[hook["id"]], **hook, "language": "system", "additional_dependencies": []}
        for hook in repo["hooks"]
    ]
    repo["repo"] = "local"
    del repo["rev"]
    (project / ".pre-commit-config.yaml").write_text(yaml.safe_dump(config), encoding="utf-8")


def verdicts(said: str) -> dict[str, str]:
    return dict(re.findall(r"^(stagewire [a-z -]*?)\.+(?:\(.*\))?(\w+)$", said, re.M))


@pytest.mark.matrix
def test_a_clean_commit_passes(commit: Run) -> None:
    done = commit()
    assert done.returncode == 0, done.stdout
    assert verdicts(done.stdout) == {hook["name"]: "Passed" for hook in HOOKS}


@pytest.mark.matrix
def test_an_invalid_spec_cannot_be_committed(project: Path, commit: Run, git: Run) -> None:
    assert commit().returncode == 0
    path = project / "spec" / "tiny" / "messages" / "extra.yaml"
    right = path.read_text(encoding="utf-8")
    path.write_text(right.replace("length: 0x04", "length: 0x05", 1), encoding="utf-8")
    wrong = commit()
    assert wrong.returncode == 1
    assert verdicts(wrong.stdout)["stagewire check"] == "Failed"
    assert re.search(r"^spec/tiny/messages/extra\.yaml:\d+:\d+: SW031 ", wrong.stdout, re.M)
    assert len(git("log", "--oneline").stdout.splitlines()) == 1


@pytest.mark.matrix
def test_outdated_generated_files_cannot_be_committed(project: Path, commit: Run) -> None:
    assert commit().returncode == 0
    path = project / "spec" / "tiny" / "messages" / "core.yaml"
    path.write_text(
        path.read_text(encoding="utf-8").replace("the first", "the left one", 1), encoding="utf-8"
    )
    drifted = commit()
    assert drifted.returncode == 1
    assert verdicts(drifted.stdout)["stagewire generate --check"] == "Failed"
    assert verdicts(drifted.stdout)["stagewire check"] == "Passed"
    assert "changed: python/stagewire_tiny/registry.json" in drifted.stdout


@pytest.mark.matrix
def test_a_commit_formats_the_spec_and_fails(project: Path, commit: Run) -> None:
    assert commit().returncode == 0
    path = project / "spec" / "tiny" / "messages" / "core.yaml"
    right = path.read_text(encoding="utf-8")
    path.write_text(right.replace("title: Moving", "title:   'Moving'", 1), encoding="utf-8")
    bent = commit()
    assert bent.returncode == 1
    assert verdicts(bent.stdout)["stagewire format"] == "Failed"
    assert path.read_text(encoding="utf-8") == right


@pytest.mark.matrix
def test_a_commit_without_spec_files_skips_the_hooks(project: Path, commit: Run) -> None:
    assert commit().returncode == 0
    (project / "README.md").write_text("A positioner.\n", encoding="utf-8")
    done = commit()
    assert done.returncode == 0
    assert verdicts(done.stdout) == {hook["name"]: "Skipped" for hook in HOOKS}


@pytest.mark.matrix
def test_the_hooks_support_folders_of_other_names(project: Path, commit: Run, git: Run) -> None:
    use(project, blocks("yaml")[1])
    shutil.move(project / "spec", project / "protocols")
    (project / "src").mkdir()
    shutil.move(project / "generated", project / "src" / "made")
    (project / "templates").mkdir()
    (project / "templates" / "flags.py.j2").write_text(
        '{% include "stagewire/flags.py.j2" %}', encoding="utf-8"
    )
    done = commit()
    assert done.returncode == 0, done.stdout
    assert set(verdicts(done.stdout).values()) == {"Passed"}
    (project / "templates" / "flags.py.j2").write_text("# nothing\n", encoding="utf-8")
    assert verdicts(commit().stdout)["stagewire generate --check"] == "Failed"


def test_every_hook_requires_the_generator_extra() -> None:
    """The next test does not check this, because it finds the requirements elsewhere."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert "generator" in project["optional-dependencies"]
    for hook in HOOKS:
        assert hook["additional_dependencies"] == [".[generator]"]


@pytest.mark.matrix
def test_the_hooks_install_from_a_repository(
    project: Path, tmp_path: Path, git: Run, run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As for a user, pre-commit clones this repository and installs it with the extra.

    The requirements come from this environment instead of the network.
    """
    ours = tmp_path / "stagewire"
    for name in PACKAGED:
        ignored = shutil.ignore_patterns("__pycache__")
        shutil.copytree(ROOT / name, ours / name, ignore=ignored)
    for name in (
        "pyproject.toml",
        "hatch_build.py",
        "README.md",
        "LICENSE",
        ".pre-commit-hooks.yaml",
    ):
        shutil.copy(ROOT / name, ours / name)
    assert git("init", "--quiet", ours).returncode == 0
    assert git("-C", ours, "add", "--all").returncode == 0
    assert git("-C", ours, "commit", "--quiet", "--message", "all").returncode == 0
    revision = git("-C", ours, "rev-parse", "HEAD").stdout.strip()

    config = yaml.safe_load(blocks("yaml")[0])
    config["repos"][0] |= {"repo": str(ours), "rev": revision}
    (project / ".pre-commit-config.yaml").write_text(yaml.safe_dump(config), encoding="utf-8")
    assert git("init", "--quiet").returncode == 0
    assert run("stagewire", "generate").returncode == 0
    assert git("add", "--all").returncode == 0
    monkeypatch.setenv("PYTHONPATH", sysconfig.get_path("purelib"))
    monkeypatch.setenv("PIP_NO_INDEX", "1")
    monkeypatch.setenv("PIP_NO_BUILD_ISOLATION", "0")  # pip reads this as: no isolation
    done = run("pre-commit", "run", "--all-files")
    assert done.returncode == 0, done.stdout
    assert verdicts(done.stdout) == {hook["name"]: "Passed" for hook in HOOKS}
    installed = list((tmp_path / "pre-commit").glob("repo*/py_env*/**/stagewire_cli/main.py"))
    assert len(installed) == 1
