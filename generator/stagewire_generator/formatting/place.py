"""Which kind of file of a spec a file is, and where its schema lies."""

from __future__ import annotations

import os
import re
from pathlib import Path, PurePosixPath

from stagewire_generator.schemas import KINDS

__all__ = ["SCHEMA_LINE", "kind_of", "schema_for", "schema_named"]

SCHEMA_LINE = re.compile(r"#\s*yaml-language-server:\s*\$schema=(\S+)\s*")
_HEADS = ("protocol.yaml", "overlay.yaml")  # of the folder of a protocol, or of an overlay of it
_BESIDE = {"examples", "captures"}


def kind_of(path: Path, text: str) -> str | None:
    """Return the kind of a file by where it stands, else by the schema that it names."""
    folder = path.absolute().parent
    if path.name in _HEADS:
        return path.stem
    if path.stem in KINDS and _is_headed(folder):
        return path.stem
    if folder.name in _BESIDE and folder.parent.name == "conformance":
        return folder.name
    if folder.name in KINDS and _is_headed(folder.parent):
        return folder.name
    named = PurePosixPath(schema_named(text) or "").name.removesuffix(".schema.json")
    return named if named in KINDS else None


def schema_named(text: str) -> str | None:
    """Return the schema that a comment of the file names."""
    found = next(filter(None, map(SCHEMA_LINE.fullmatch, text.splitlines())), None)
    return found[1] if found else None


def schema_for(path: Path, kind: str, named: str | None) -> str:
    """Return what the first line of a file names as its schema: a path from the file, or an address.

    That is the schema which it names already, if it is there; else the one in the nearest folder ``schema``
    or ``spec/schema`` above it; else the place for it beside the folder of the protocol.
    """
    name = f"{kind}.schema.json"
    folder = Path(os.path.abspath(path)).parent
    if named and PurePosixPath(named).name == name:
        if re.match(r"(https?|file)://", named):
            return named
        if (folder / named).is_file():
            return _relative(folder / named, folder)
    for above in (folder, *folder.parents):
        for schemas in (above / "schema", above / "spec" / "schema"):
            if (schemas / name).is_file():
                return _relative(schemas / name, folder)
    return _relative(_spec(folder, kind) / "schema" / name, folder)


def _is_headed(folder: Path) -> bool:
    return any((folder / name).is_file() for name in _HEADS)


def _spec(folder: Path, kind: str) -> Path:
    """Return the folder of the spec that a file in ``folder`` belongs to."""
    if kind in _BESIDE and folder.parent.name == "conformance":
        beside = folder.parent.parent
        return beside / "spec" if (beside / "spec").is_dir() else beside
    for above in (folder, *folder.parents):
        if (above / "protocol.yaml").is_file():
            return above.parent
    return folder


def _relative(path: Path, folder: Path) -> str:
    return Path(os.path.relpath(path, folder)).as_posix()
