"""The JSON Schemas of the files that a spec is made of."""

from __future__ import annotations

from stagewire_generator.reader import schema_folder

__all__ = ["KINDS", "schema_texts"]

KINDS = (
    "protocol",
    "overlay",
    "quantities",
    "stages",
    "units",
    "messages",
    "errata",
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
