"""Format the files of a spec: find them, bring them into canonical form, prove that nothing is lost."""

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
_HEADS = ("protocol.yaml", "overlay.yaml")  # of the folder of a protocol, or of an overlay of it


def kind_of(path: Path, text: str) -> str | None:
    """Return the kind of a file by where it stands, else by the schema that it names."""
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
    """A file whose canonical form cannot be given; the text says why."""


def canonical(text: str, data: Any, shape: Shape, schema: str) -> str:
    """Return the canonical form of a file.

    :param text: what the strict loader takes.
    :param data: what the strict loader makes of it.
    :param shape: what its schema says.
    :param schema: where its schema lies, for the first line.
    Raises :class:`NotFormattedError` rather than to change data or to lose a comment.
    """
    text = text.replace("\r\n", "\n").rstrip() + "\n"
    try:
        root = read(text)
    except YAMLError as error:
        raise NotFormattedError(f"readers of YAML disagree on it: {_first_line(error)}") from None
    if not (isinstance(root, Collection) and root.mapping and root.entries):
        raise NotFormattedError("it is no mapping with entries")
    header = [f"# yaml-language-server: $schema={schema}", *_header(root)]
    canonicalise(root, shape)
    made = "\n".join(lay_out(root, header)) + "\n"
    _prove(made, text, data)
    return made


def _first_line(error: YAMLError) -> str:
    return str(getattr(error, "problem", None) or error).splitlines()[0]


def _header(root: Collection) -> list[str]:
    """Take the comments that are about the file from above its first entry.

    They end at the last blank line; where there is none, all are about the file.
    """
    first = root.entries[0]
    lines = [line for line in first.before if not SCHEMA_LINE.fullmatch(line)]
    end = len(lines) - lines[::-1].index(BLANK) if BLANK in lines else len(lines)
    header, first.before = lines[:end], lines[end:]
    return header


def _prove(made: str, text: str, data: Any) -> None:
    """Make sure that the canonical form says the same, in data and in comments."""
    diagnostics = Diagnostics()
    document = parse(made, "", diagnostics, any_byte=True)
    if document is None or diagnostics or not _same(document.data, data):
        raise NotFormattedError("its canonical form would not say the same; please report this")
    if made != text and _said(made) != _said(text):
        raise NotFormattedError("its canonical form would lose a comment; please report this")


def _said(text: str) -> Counter[str]:
    return Counter(comment for comment in comments(text) if not SCHEMA_LINE.fullmatch(comment))


def _same(one: Any, other: Any) -> bool:
    """Whether two values are the same; unlike ``==``, 1 is not true. The order of keys may differ."""
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
    below = Path(os.path.abspath(folder))
    for path in map(Path, map(os.path.abspath, find_spec(folder).paths)):
        if not path.is_relative_to(below):
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
