"""What a check found, for every format."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from stagewire_generator.diagnostics import Diagnostic
    from stagewire_generator.pipeline import Counts

__all__ = ["Report"]


@dataclass(frozen=True, slots=True)
class Report:
    """A check of one spec.

    :param spec: the folder, as the user named it.
    :param diagnostics: what is wrong, with files named from the current folder.
    :param counts: what was looked at, by protocol; empty when something is wrong with the spec itself.
    :param against: what it was compared with, as the user named it; "" for nothing.
    :param changes: class -> number of changes, the gravest first; empty when nothing was compared.
    """

    spec: Path
    diagnostics: Sequence[Diagnostic] = ()
    counts: Mapping[str, Counts] = field(default_factory=dict)
    against: str = ""
    changes: Mapping[str, int] = field(default_factory=dict)

    def files(self) -> dict[str, list[Path]]:
        """Return the files that were read, by the folder of the protocol."""
        from stagewire_generator.reader import files_of, protocol_folders

        return {folder.name: files_of(folder) for folder in protocol_folders(self.spec)}
