"""The schemas of the files of a spec."""

from __future__ import annotations

from checkout import SCHEMAS

_OF_OTHER_FILES = {
    "changes", "conformance-changes", "conformance-report", "diagnostics", "manifest", "pics", "registry",
    "testee", "vectors",
}  # fmt: skip


def spec_kinds() -> set[str]:
    """Return the kinds of files that a spec may have, by the names of their schemas."""
    return {path.name.removesuffix(".schema.json") for path in SCHEMAS.iterdir()} - _OF_OTHER_FILES
