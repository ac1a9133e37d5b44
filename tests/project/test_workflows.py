"""The GitHub and pre-commit files pass their checkers and agree with the project."""

from __future__ import annotations

import re
import shutil
import subprocess
import sysconfig
import tomllib
from pathlib import Path
from typing import Any

import pytest
import yaml
from packaging.requirements import Requirement

from checkout import ROOT

GITHUB = ROOT / ".github"
WORKFLOWS = sorted((GITHUB / "workflows").glob("*.yml"))
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
ZIZMOR = ("zizmor", "--offline", "--no-progress", "--persona=auditor", "--strict-collection")
SCHEMAS = [
    ("vendor.github-workflows", "workflows/*.yml"),
    ("custom.github-workflows-require-timeout", "workflows/*.yml"),
    ("vendor.github-issue-forms", "ISSUE_TEMPLATE/[!c]*.yml"),
    ("vendor.github-issue-config", "ISSUE_TEMPLATE/config.yml"),
    ("vendor.dependabot", "dependabot.yml"),
]


def run(command: str, *words: object) -> subprocess.CompletedProcess[str]:
    """Run a command of this environment in the project."""
    found = shutil.which(command, path=sysconfig.get_path("scripts"))
    assert found is not None, f"{command} is not installed"
    return subprocess.run(
        [found, *map(str, words)], cwd=ROOT, capture_output=True, text=True, check=False
    )


def read(path: Path) -> Any:
    return yaml.safe_load(path.read_text(encoding="utf-8"))


@pytest.mark.matrix
def test_zizmor_has_no_findings() -> None:
    done = run(*ZIZMOR, ".")
    assert done.returncode == 0, done.stdout + done.stderr
    for path in WORKFLOWS:
        assert f"completed ./{path.relative_to(ROOT)}" in done.stderr


@pytest.mark.matrix
@pytest.mark.parametrize(
    ("old", "new", "finding"),
    [
        ("run: make demo", 'run: echo "${{ github.event.pull_request.title }}"', "template-inj"),
        ("@3d3c42e5aac5ba805825da76410c181273ba90b1 # v7.0.1", "@v7", "unpinned-uses"),
        ("persist-credentials: false", "fetch-depth: 1", "artipacked"),
        ("permissions: {}\n", "", "excessive-permissions"),
    ],
)
def test_zizmor_detects_a_weak_workflow(tmp_path: Path, old: str, new: str, finding: str) -> None:
    text = (GITHUB / "workflows" / "ci.yml").read_text(encoding="utf-8")
    assert old in text
    broken = tmp_path / ".github" / "workflows" / "ci.yml"
    broken.parent.mkdir(parents=True)
    broken.write_text(text.replace(old, new, 1), encoding="utf-8")
    done = run(*ZIZMOR, broken)
    assert done.returncode != 0
    assert f"[{finding}" in done.stdout


@pytest.mark.matrix
@pytest.mark.parametrize(("schema", "pattern"), SCHEMAS, ids=[schema for schema, _ in SCHEMAS])
def test_github_files_are_valid_under_their_schemas(schema: str, pattern: str) -> None:
    files = sorted(GITHUB.glob(pattern))
    assert files
    done = run("check-jsonschema", "--builtin-schema", schema, *files)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.matrix
def test_pre_commit_accepts_its_files() -> None:
    assert run("pre-commit", "validate-config", ".pre-commit-config.yaml").returncode == 0
    assert run("pre-commit", "validate-manifest", ".pre-commit-hooks.yaml").returncode == 0


def test_hooks_use_tool_versions_that_the_project_allows() -> None:
    wanted = {one.name: one for one in map(Requirement, PROJECT["optional-dependencies"]["dev"])}
    pins = {
        pin
        for repository in read(ROOT / ".pre-commit-config.yaml")["repos"]
        for hook in repository["hooks"]
        for pin in hook.get("additional_dependencies", ())
    }
    assert {pin.split("==")[0] for pin in pins} == {"ruff", "zizmor"}
    for pin in pins:
        name, version = pin.split("==")
        assert wanted[name].specifier.contains(version)


def test_every_workflow_uses_the_same_version_of_an_action() -> None:
    used: dict[str, set[str]] = {}
    for path in WORKFLOWS:
        for name, version in re.findall(r"uses: (\S+)@(\w+ # v\S+)", path.read_text("utf-8")):
            used.setdefault(name, set()).add(version)
    assert len(used) >= 5
    assert {name: len(versions) for name, versions in used.items()} == dict.fromkeys(used, 1)


def test_workflows_call_existing_targets_of_the_makefile() -> None:
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    targets = set(re.findall(r"^([a-z-]+):", makefile, re.MULTILINE))
    called = {
        target
        for path in WORKFLOWS
        for target in re.findall(r"run: make (\S+)$", path.read_text("utf-8"), re.MULTILINE)
    }
    assert {"demo", "test", "test-all", "coverage", "archives"} <= called
    assert called <= targets


def test_ci_runs_every_supported_python() -> None:
    named = [
        version
        for one in PROJECT["classifiers"]
        for version in re.findall(r"^Programming Language :: Python :: (3\.\d+)$", one)
    ]
    assert PROJECT["requires-python"] == f">={named[0]}"
    jobs = read(GITHUB / "workflows" / "ci.yml")["jobs"]
    for job in ("linux", "other_systems"):
        assert jobs[job]["strategy"]["matrix"]["python"] == named


def test_only_publication_jobs_have_more_than_read_permissions() -> None:
    allowed = {
        (path.stem, name): sorted(job["permissions"])
        for path in WORKFLOWS
        for name, job in read(path)["jobs"].items()
        if set(job["permissions"]) - {"contents"} or "write" in job["permissions"].values()
    }
    assert allowed == {("release", "pypi"): ["id-token"], ("release", "github"): ["contents"]}
    assert (
        read(GITHUB / "workflows" / "release.yml")["jobs"]["pypi"]["environment"]["name"] == "pypi"
    )
