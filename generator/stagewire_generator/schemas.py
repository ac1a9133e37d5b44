"""The JSON Schemas of the files that a spec is made of."""

from __future__ import annotations

from pathlib import Path

__all__ = ["KINDS", "schema_folder", "schema_texts"]

KINDS = (
    "protocol",
    "overlay",
    "quantities",
    "stages",
    "units",
    "messages",
    "errata",
    "rules",
    "printed",
    "examples",
    "captures",
)
"""The kinds of files; each has a schema of this name."""


def schema_texts() -> dict[str, str]:
    """Return the text of each schema by the name of its file."""
    folder = schema_folder()
    names = [f"{kind}.schema.json" for kind in KINDS]
    return {name: (folder / name).read_text(encoding="utf-8") for name in names}


def schema_folder() -> Path:
    """Return the schemas of an installed wheel or of the checkout, never those of the spec.

    Their patterns keep a text of the spec from becoming code; a spec must not bring looser ones.
    """
    here = Path(__file__).resolve().parent
    for candidate in (here / "schema", here.parents[1] / "spec" / "schema"):
        if (candidate / "protocol.schema.json").is_file():
            return candidate
    raise FileNotFoundError("the JSON Schemas of the registry are not installed")
