"""Print the release notes of a version, which are its section of CHANGELOG.md.

    python tools/release_notes.py 0.2.0

It fails if ``pyproject.toml`` has another version, or if the section is missing, empty or without a date.
"""

from __future__ import annotations

import argparse
import re
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[1]


def notes(version: str, root: Path = ROOT) -> str:
    """Return the section of a version without its heading; raise ValueError if it cannot be released."""
    project = tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    if version != project["version"]:
        raise ValueError(f"pyproject.toml has version {project['version']}, not {version}")
    changelog = (root / "CHANGELOG.md").read_text(encoding="utf-8")
    heading = re.search(rf"^## {re.escape(version)}(?: \((.*)\))?$", changelog, re.MULTILINE)
    if heading is None:
        raise ValueError(f"CHANGELOG.md has no section '## {version} (YYYY-MM-DD)'")
    if not re.fullmatch(r"\d{4}-\d\d-\d\d", heading[1] or ""):
        raise ValueError(f"CHANGELOG.md: '{heading[0]}' needs a date, such as '(2026-01-31)'")
    rest = changelog[heading.end() :]
    following = re.search(r"^## ", rest, re.MULTILINE)
    section = rest[: following.start() if following else None].strip()
    if not section:
        raise ValueError(f"CHANGELOG.md: the section '{heading[0]}' is empty")
    return f"{section}\n"


def main(arguments: list[str] | None = None, root: Path = ROOT) -> int:
    """Print the notes; return 1 if the version cannot be released."""
    parser = argparse.ArgumentParser(description="Print the notes of a release.")
    parser.add_argument("version", help="the version to release, such as 0.2.0")
    try:
        print(notes(parser.parse_args(arguments).version, root), end="")
    except ValueError as error:
        print(f"release_notes.py: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
