"""Which files decide on what is generated: what makes a build system run the generator again."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from stagewire_generator.reader import files_of, protocol_folders
from stagewire_generator.schemas import schema_folder
from stagewire_generator.targets.environment import COMPILED
from stagewire_generator.targets.templates import templates_in

__all__ = ["inputs"]

_OF_THE_GENERATOR = ("*.py", "*.j2", "*.[ch]")


def inputs(specs: Sequence[Path], templates: Path | None = None) -> list[Path]:
    """Return all files that decide on the output, sorted, whether they are right or wrong.

    These are the spec, its worked examples and captures, the templates of the user, and the generator
    itself, so that a later one runs, too. What could be added later cannot be among them.
    """
    found = {
        path for spec in specs for folder in protocol_folders(spec) for path in files_of(folder)
    }
    if templates is not None:
        found.update(templates_in(templates))
    here = Path(__file__).parent
    for pattern in _OF_THE_GENERATOR:
        found.update(path for path in here.rglob(pattern) if COMPILED not in path.parents)
    found.update(schema_folder().glob("*.schema.json"))
    return sorted(path for path in found if path.is_file())
