"""Links in the documentation lead to existing files and headings, also on the package index."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from block_runners import documents

from checkout import ROOT

REPOSITORY = "https://github.com/stagewire/stagewire/blob/main/"
FOLDER = "https://github.com/stagewire/stagewire/tree/main/"
PAGES = sorted({*documents(), *(path.name for path in ROOT.glob("*.md"))})

_FENCE = re.compile(r"^ *```.*?^ *```$", re.M | re.S)
_SPAN = re.compile(r"`[^`]*`")
_LINK = re.compile(r"\[[^\]]*\]\(([^)\s]+)\)")
_HEADING = re.compile(r"^#+ +(.*)$", re.M)
_ANCHOR = re.compile(r'<a (?:id|name)="([^"]+)"')
_PAGE_AS_CODE = re.compile(r"`(?:docs/)?[a-z/-]+\.md[^`]*`")


def prose(document: str) -> str:
    """Return the text of a document without its fenced blocks."""
    return _FENCE.sub("", (ROOT / document).read_text(encoding="utf-8"))


def anchors(path: Path) -> set[str]:
    """Return the anchors of a page: explicit ones, and those that GitHub makes of headings."""
    text = _FENCE.sub("", path.read_text(encoding="utf-8"))
    made = {
        re.sub(r"[^\w\- ]", "", heading.lower()).strip().replace(" ", "-")
        for heading in _HEADING.findall(text)
    }
    return made | set(_ANCHOR.findall(text))


@pytest.mark.parametrize("document", PAGES)
def test_links_lead_to_existing_files_and_headings(document: str) -> None:
    broken = []
    for link in _LINK.findall(_SPAN.sub("x", prose(document))):
        target, _, anchor = link.partition("#")
        if target.startswith((REPOSITORY, FOLDER)):
            path = ROOT / target.removeprefix(REPOSITORY).removeprefix(FOLDER)
        elif "://" in target or target.startswith("mailto:"):
            continue
        else:
            path = (ROOT / document).parent / target if target else ROOT / document
        if not path.exists() or (anchor and anchor not in anchors(path)):
            broken.append(link)
    assert broken == []


def test_the_readme_has_no_relative_links() -> None:
    relative = [link for link in _LINK.findall(prose("README.md")) if "://" not in link]
    assert relative == []


@pytest.mark.parametrize("document", [name for name in PAGES if name.startswith("docs/")])
def test_other_pages_are_linked_and_not_only_named(document: str) -> None:
    assert _PAGE_AS_CODE.findall(prose(document)) == []


@pytest.mark.parametrize("document", [name for name in PAGES if name.startswith("docs/")])
def test_the_index_links_every_page(document: str) -> None:
    name = document.removeprefix("docs/")
    assert name == "index.md" or f"]({name})" in (ROOT / "docs/index.md").read_text("utf-8")
