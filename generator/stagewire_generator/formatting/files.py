"""Find the files of a spec, format them, and verify that nothing is lost."""

from __future__ import annotations

import difflib
import os
import re
import stat
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath
from typing import Any

from ruamel.yaml.error import YAMLError

from stagewire_generator.diagnostics import Diagnostic, Diagnostics
from stagewire_generator.files import replace
from stagewire_generator.formatting.layout import lay_out
from stagewire_generator.formatting.rules import Shape, canonicalise, shape
from stagewire_generator.formatting.tree import BLANK, Collection, comments, read
from stagewire_generator.reader import OF_WIRE, OLD_FOLDER, find_spec
from stagewire_generator.schemas import KINDS
from stagewire_generator.strict_yaml import parse, text_of

SCHEMA_LINE = re.compile(r"#\s*yaml-language-server:\s*\$schema=(\S+)\s*")
_HEADS = (
    "protocol.yaml",
    "overlay.yaml",
)  # in the directory of a protocol, or of one of its overlays


def kind_of(path: Path, text: str) -> str | None:
    """Return the kind of a file, from its location or else from the schema that it names."""
    folder = path.absolute().parent
    if path.name in _HEADS:
        return path.stem
    if path.stem in KINDS and _is_headed(folder):
        return path.stem
    if folder.name in OF_WIRE and folder.parent.name == OLD_FOLDER:
        return folder.name
    if folder.name in KINDS and _is_headed(folder.parent):
        return folder.name
    named = PurePosixPath(schema_named(text) or "").name.removesuffix(".schema.json")
    return named if named in KINDS else None


def schema_named(text: str) -> str | None:
    """Return the schema named in a comment of the file."""
    found = next(filter(None, map(SCHEMA_LINE.fullmatch, text.splitlines())), None)
    return found[1] if found else None


def schema_for(path: Path, kind: str, named: str | None) -> str:
    """Return the schema for the first line of a file: a path relative to the file, or a URL.

    This is the schema that it already names, if that exists; or else the one in the nearest directory
    ``schema`` or ``spec/schema`` above it; or else its place next to the directory of the protocol.
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
    """Return the directory of the spec that a file in ``folder`` belongs to."""
    if kind in OF_WIRE and folder.parent.name == OLD_FOLDER:
        beside = folder.parent.parent
        return beside / "spec" if (beside / "spec").is_dir() else beside
    for above in (folder, *folder.parents):
        if (above / "protocol.yaml").is_file():
            return above.parent
    return folder


def _relative(path: Path, folder: Path) -> str:
    return Path(os.path.relpath(path, folder)).as_posix()


class NotFormattedError(Exception):
    """A file cannot be formatted; the text states why."""


def canonical(text: str, data: Any, shape: Shape, schema: str) -> str:
    """Return the canonical form of a file.

    :param text: text that the strict loader accepts.
    :param data: the data that the strict loader returns for it.
    :param shape: the shape from its schema.
    :param schema: the path or URL of its schema, for the first line.
    Raises :class:`NotFormattedError` if the result would have other data or lose a comment.
    """
    text = text.replace("\r\n", "\n").rstrip() + "\n"
    try:
        root = read(text)
    except YAMLError as error:
        raise NotFormattedError(f"YAML parsers disagree on it: {_first_line(error)}") from None
    if not (isinstance(root, Collection) and root.mapping and root.entries):
        raise NotFormattedError("it is not a mapping with entries")
    header = [f"# yaml-language-server: $schema={schema}", *_header(root)]
    canonicalise(root, shape)
    made = "\n".join(lay_out(root, header)) + "\n"
    _prove(made, text, data)
    return made


def _first_line(error: YAMLError) -> str:
    return str(getattr(error, "problem", None) or error).splitlines()[0]


def _header(root: Collection) -> list[str]:
    """Remove the comments about the file from its first entry, and return them.

    They end at the last blank line; without a blank line, all comments are about the file.
    """
    first = root.entries[0]
    lines = [line for line in first.before if not SCHEMA_LINE.fullmatch(line)]
    end = len(lines) - lines[::-1].index(BLANK) if BLANK in lines else len(lines)
    header, first.before = lines[:end], lines[end:]
    return header


def _prove(made: str, text: str, data: Any) -> None:
    """Verify that the canonical form has the same data and comments."""
    diagnostics = Diagnostics()
    document = parse(made, "", diagnostics, any_byte=True)
    if document is None or diagnostics or not _same(document.data, data):
        raise NotFormattedError("its canonical form would change the data; please report this bug")
    if made != text and _said(made) != _said(text):
        raise NotFormattedError("its canonical form would lose a comment; please report this bug")


def _said(text: str) -> Counter[str]:
    return Counter(comment for comment in comments(text) if not SCHEMA_LINE.fullmatch(comment))


def _same(one: Any, other: Any) -> bool:
    """Whether two values are equal, where 1 and true differ; the order of keys does not matter."""
    if type(one) is not type(other):
        return False
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(_same(one[key], other[key]) for key in one)
    if isinstance(one, list):
        return len(one) == len(other) and all(map(_same, one, other))
    return bool(one == other)


_DIFF_LINES = 40


@dataclass(frozen=True, slots=True)
class Outcome:
    """The result of formatting a file.

    :ivar state: ``kept`` if it is canonical; ``formatted`` if it was or would be changed; ``left`` if it
        cannot be formatted.
    :ivar diff: the difference between the file and its canonical form.
    :ivar reason: why it cannot be formatted, if no diagnostic explains it.
    :ivar no_schemas: the directory of the schema in its first line, if that schema is missing.
    """

    state: str
    diff: str = ""
    reason: str = ""
    diagnostics: list[Diagnostic] = field(default_factory=list)
    no_schemas: Path | None = None


def find(folder: Path) -> list[Path]:
    """Return the files of specs in a directory, and their worked examples and captures next to it.

    Hidden directories and links are skipped.
    """
    found = set()
    for above, folders, names in os.walk(folder):
        folders[:] = [name for name in folders if not name.startswith(".")]
        found |= {Path(above, name) for name in names if name.endswith(".yaml")}
    below = Path(os.path.abspath(folder))
    for path in map(Path, map(os.path.abspath, find_spec(folder).paths)):
        if not path.is_relative_to(below):
            found.add(path if folder.is_absolute() else Path(os.path.relpath(path)))
    return sorted(path for path in found if not path.is_symlink() and _is_of_a_spec(path))


def _is_of_a_spec(path: Path) -> bool:
    text = text_of(path, str(path), Diagnostics())
    return kind_of(path, text or "") is not None


def format_file(path: Path, *, write: bool) -> Outcome:
    """Format a file, or report how that would change it.

    A link, or a file that the strict loader rejects, is left unchanged. Raises ``OSError`` if the file cannot
    be written.
    """
    if path.is_symlink():
        return Outcome("left", reason="is a link; give the file that it points to")
    diagnostics = Diagnostics()
    text = text_of(path, str(path), diagnostics)
    if text is None:
        return Outcome("left", diagnostics=list(diagnostics))
    kind = kind_of(path, text)
    if kind is None:
        reason = "is not a file of a spec: neither its location nor a schema in its first line identifies it"
        return Outcome("left", reason=reason)
    document = parse(text, str(path), diagnostics, any_byte=kind in ("examples", "captures"))
    if document is None or diagnostics:
        return Outcome("left", diagnostics=list(diagnostics))
    try:
        schema = schema_for(path, kind, schema_named(text))
        made = canonical(text, document.data, shape(kind), schema)
    except NotFormattedError as error:
        return Outcome("left", reason=f"was not formatted: {error}")
    lacking = _lacking(path.parent, schema)
    if made == text:
        return Outcome("kept", no_schemas=lacking)
    if write:
        replace(path, made.encode("utf-8"), stat.S_IMODE(path.stat().st_mode))
    return Outcome("formatted", diff=_diff(str(path), text, made), no_schemas=lacking)


def _lacking(folder: Path, schema: str) -> Path | None:
    """Return the directory of a schema that is given by its path but does not exist."""
    if "://" in schema or (folder / schema).is_file():
        return None
    return Path(os.path.normpath(folder / schema)).parent


def _diff(name: str, old: str, new: str) -> str:
    lines = list(_unified(name, old, new))
    if len(lines) > _DIFF_LINES:
        lines[_DIFF_LINES:] = [f"... {len(lines) - _DIFF_LINES} more diff lines"]
    return "\n".join(lines) or f"--- {name}\n(only line endings differ)"


def _unified(name: str, old: str, new: str) -> Iterator[str]:
    before, after = old.splitlines(), new.splitlines()
    yield from difflib.unified_diff(before, after, name, f"{name} (canonical)", lineterm="")
