"""Formatting files: which of them, and what becomes of each."""

from __future__ import annotations

import difflib
import os
import stat
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from stagewire_generator.diagnostics import Diagnostic, Diagnostics
from stagewire_generator.files import replace
from stagewire_generator.formatting.form import NotFormattedError, canonical
from stagewire_generator.formatting.place import kind_of, schema_for, schema_named
from stagewire_generator.formatting.shape import shape
from stagewire_generator.reader import files_of, protocol_folders
from stagewire_generator.strict_yaml import parse, text_of

__all__ = ["Outcome", "find", "format_file"]

_DIFF_LINES = 40


@dataclass(frozen=True, slots=True)
class Outcome:
    """What becomes of a file.

    :ivar state: ``kept`` as it is; ``formatted``, or to be; ``left`` alone, because it cannot be.
    :ivar diff: from the file to its canonical form.
    :ivar reason: why it is left alone, where no diagnostic says it.
    :ivar no_schemas: the folder in which its first line names a schema that is not there.
    """

    state: str
    diff: str = ""
    reason: str = ""
    diagnostics: list[Diagnostic] = field(default_factory=list)
    no_schemas: Path | None = None


def find(folder: Path) -> list[Path]:
    """Return the files of specs in a folder, and their worked examples and captures beside it.

    Hidden folders and links are passed over.
    """
    found = set()
    for above, folders, names in os.walk(folder):
        folders[:] = [name for name in folders if not name.startswith(".")]
        found |= {Path(above, name) for name in names if name.endswith(".yaml")}
    for protocol in protocol_folders(folder):
        below = Path(os.path.abspath(folder))
        for path in files_of(protocol):
            if not Path(os.path.abspath(path)).is_relative_to(below):
                path = Path(os.path.abspath(path))
                found.add(path if folder.is_absolute() else Path(os.path.relpath(path)))
    return sorted(path for path in found if not path.is_symlink() and _is_of_a_spec(path))


def _is_of_a_spec(path: Path) -> bool:
    text = text_of(path, str(path), Diagnostics())
    return kind_of(path, text or "") is not None


def format_file(path: Path, *, write: bool) -> Outcome:
    """Bring a file into canonical form, or say what that would change.

    A file that the strict loader does not take is left alone; so is a link. Raises ``OSError`` when the
    file cannot be written.
    """
    if path.is_symlink():
        return Outcome("left", reason="is a link; name the file that it leads to")
    diagnostics = Diagnostics()
    text = text_of(path, str(path), diagnostics)
    if text is None:
        return Outcome("left", diagnostics=list(diagnostics))
    kind = kind_of(path, text)
    if kind is None:
        reason = (
            "is no file of a spec, neither by its place nor by a schema that its first line names"
        )
        return Outcome("left", reason=reason)
    document = parse(text, str(path), diagnostics, any_byte=kind in ("examples", "captures"))
    if document is None or diagnostics:
        return Outcome("left", diagnostics=list(diagnostics))
    try:
        schema = schema_for(path, kind, schema_named(text))
        made = canonical(text, document.data, shape(kind), schema)
    except NotFormattedError as error:
        return Outcome("left", reason=f"is left as it is: {error}")
    lacking = _lacking(path.parent, schema)
    if made == text:
        return Outcome("kept", no_schemas=lacking)
    if write:
        replace(path, made.encode("utf-8"), stat.S_IMODE(path.stat().st_mode))
    return Outcome("formatted", diff=_diff(str(path), text, made), no_schemas=lacking)


def _lacking(folder: Path, schema: str) -> Path | None:
    """Return the folder of a schema that is named by its path and is not there."""
    if "://" in schema or (folder / schema).is_file():
        return None
    return Path(os.path.normpath(folder / schema)).parent


def _diff(name: str, old: str, new: str) -> str:
    lines = list(_unified(name, old, new))
    if len(lines) > _DIFF_LINES:
        lines[_DIFF_LINES:] = [f"... {len(lines) - _DIFF_LINES} more lines of difference"]
    return "\n".join(lines) or f"--- {name}\n(only line ends differ)"


def _unified(name: str, old: str, new: str) -> Iterator[str]:
    before, after = old.splitlines(), new.splitlines()
    yield from difflib.unified_diff(before, after, name, f"{name} (canonical)", lineterm="")
