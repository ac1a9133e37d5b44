"""``docs/tutorials/your-own-protocol.md`` does as it says, from an empty folder on.

The reader has a virtual environment of his own, in which the stagewire of this checkout is installed, and no
network; pip builds his package with what the tests have.
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
LAST = "The next firmware"  # the last section that does anything
ALONE = {
    "PIP_NO_INDEX": "1",
    "PIP_NO_DEPS": "1",
    "PIP_NO_BUILD_ISOLATION": "0",  # as pip reads it: none
    "PIP_DISABLE_PIP_VERSION_CHECK": "1",
    "PYTHONUNBUFFERED": "1",  # what is printed comes in order, as on a terminal
    "GIT_AUTHOR_NAME": "Reader",
    "GIT_AUTHOR_EMAIL": "reader@example.org",
    "GIT_COMMITTER_NAME": "Reader",
    "GIT_COMMITTER_EMAIL": "reader@example.org",
    "GIT_CONFIG_GLOBAL": os.devnull,
    "GIT_CONFIG_NOSYSTEM": "1",
}


def environment(folder: Path) -> dict[str, str]:
    """Make a virtual environment that sees what is installed for the tests; return how it is entered."""
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
    """A reader in an empty folder."""
    folder = tmp_path / "mine"
    folder.mkdir()
    return Walk(folder, environment(tmp_path / "environment"))


@pytest.mark.matrix
def test_the_page_does_as_it_says(walk: Walk) -> None:
    assert BLOCKS[-1].section == LAST
    assert {block.language for block in BLOCKS if block.path is None} == {"console", "python"}
    for block in BLOCKS:
        walk.follow(block)


def test_every_kind_of_framing_is_named() -> None:
    schema = json.loads((ROOT / "spec" / "schema" / "protocol.schema.json").read_bytes())
    kinds = schema["properties"]["framing"]["properties"]["kind"]["enum"]
    page = PAGE.read_text(encoding="utf-8")
    table = page[page.index("## Supported packet structures") :]
    assert sorted(re.findall(r"^\| `(\w+)` \|", table, re.M)) == sorted(kinds)
