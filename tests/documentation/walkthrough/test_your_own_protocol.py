"""Follow ``docs/tutorials/your-own-protocol.md`` from an empty folder.

The reader has no network and a new virtual environment with the stagewire of this checkout. pip builds the
package with the build tools of the test environment.
"""

from __future__ import annotations

import json
import os
import re
import sysconfig
import venv
from pathlib import Path

import pytest
from walk import Walk

from checkout import ROOT
from markdown_blocks import blocks

PAGE = ROOT / "docs" / "tutorials" / "your-own-protocol.md"
BLOCKS = tuple(blocks(PAGE))
LAST = "The next firmware"  # the last section with commands
ALONE = {
    "PIP_NO_INDEX": "1",
    "PIP_NO_DEPS": "1",
    "PIP_NO_BUILD_ISOLATION": "0",  # pip reads this as: no isolation
    "PIP_DISABLE_PIP_VERSION_CHECK": "1",
    "PYTHONUNBUFFERED": "1",  # keeps the output in order, as on a terminal
    "GIT_AUTHOR_NAME": "Reader",
    "GIT_AUTHOR_EMAIL": "reader@example.org",
    "GIT_COMMITTER_NAME": "Reader",
    "GIT_COMMITTER_EMAIL": "reader@example.org",
    "GIT_CONFIG_GLOBAL": os.devnull,
    "GIT_CONFIG_NOSYSTEM": "1",
}


def environment(folder: Path) -> dict[str, str]:
    """Create a virtual environment with the packages of the tests; return the variables that activate it."""
    venv.create(folder, symlinks=True)
    inside = {"base": str(folder), "platbase": str(folder)}
    scripts = Path(sysconfig.get_path("scripts", vars=inside))
    around = f"import site; site.addsitedir({sysconfig.get_path('purelib')!r})\n"
    Path(sysconfig.get_path("purelib", vars=inside), "around.pth").write_text(around)
    command = scripts / "stagewire"
    command.write_text(f"#!{scripts / 'python'}\nfrom stagewire_cli.main import run\nrun()\n")
    command.chmod(0o755)
    return {"PATH": os.pathsep.join([str(scripts), os.environ.get("PATH", os.defpath)]), **ALONE}


@pytest.fixture
def walk(tmp_path: Path) -> Walk:
    """A walkthrough in an empty folder."""
    folder = tmp_path / "mine"
    folder.mkdir()
    return Walk(folder, environment(tmp_path / "environment"))


@pytest.mark.matrix
def test_the_tutorial_works_as_shown(walk: Walk) -> None:
    assert BLOCKS[-1].section == LAST
    assert {block.language for block in BLOCKS if block.path is None} == {"console", "python"}
    for block in BLOCKS:
        walk.follow(block)


def test_the_page_lists_every_kind_of_framing() -> None:
    schema = json.loads((ROOT / "spec" / "schema" / "protocol.schema.json").read_bytes())
    kinds = schema["properties"]["framing"]["properties"]["kind"]["enum"]
    page = PAGE.read_text(encoding="utf-8")
    table = page[page.index("## Supported packet structures") :]
    assert sorted(re.findall(r"^\| `(\w+)` \|", table, re.M)) == sorted(kinds)
