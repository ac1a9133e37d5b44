"""Find the files of a spec, load them strictly and validate them against their schemas.

A spec is a directory with one directory per protocol (with a ``protocol.yaml``), or the directory of a single
protocol. The path of a file in it determines its kind. An overlay is a directory in ``overlays`` with files
of the same kinds. Version 0.1 had worked examples and captures in a directory ``conformance`` next to the
spec, in it, or in that of the protocol. For one release they are still read there, with a warning.
"""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Collection, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from stagewire_generator import strict_yaml
from stagewire_generator.diagnostics import Diagnostics, Place
from stagewire_generator.files import leads_out, strays
from stagewire_generator.schemas import fits_schema
from stagewire_generator.strict_yaml import Document

Files = dict[str, list[Document]]

# kind -> pattern below the protocol's directory; the schema has the name of the kind
_KINDS = {
    "protocol": "protocol.yaml",
    "quantities": "quantities.yaml",
    "stages": "stages.yaml",
    "units": "units.yaml",
    "messages": "messages/*.yaml",
    "errata": "errata/*.yaml",
    "rules": "rules.yaml",
    "decisions": "decisions.yaml",
    "evidence": "evidence.yaml",
    "printed": "printed/*.yaml",
    "examples": "examples.yaml",
    "captures": "captures.yaml",
}
# The same below the directory of an overlay
_KINDS_OF_OVERLAYS = {
    "overlay": "overlay.yaml",
    "additions": "additions.yaml",
    **{kind: pattern for kind, pattern in _KINDS.items() if kind != "protocol"},
}
_PARTS = frozenset({"stages", "units"})  # an overlay contains only the changed parts of these
_LINK = "the link leads out of the spec"
OF_WIRE = ("examples", "captures")
"""Kinds of files that quote bytes from the wire."""
OLD_FOLDER = "conformance"
"""Directory in which version 0.1 had the files of these kinds, in one subdirectory per kind."""


@dataclass(frozen=True, slots=True)
class SourceFile:
    """A file of a spec.

    :param kind: the kind, which is also the name of its schema.
    :param root: the directory that the path must not leave; names in diagnostics are relative to it.
    """

    kind: str
    path: Path
    root: Path

    @property
    def name(self) -> str:
        """The name in diagnostics."""
        return self.path.relative_to(self.root).as_posix()


@dataclass(frozen=True, slots=True)
class SourceFolder:
    """The directory of a protocol or overlay with its files, valid or not."""

    path: Path
    files: tuple[SourceFile, ...]
    overlays: tuple[SourceFolder, ...] = ()

    @property
    def paths(self) -> list[Path]:
        """All files; those of overlays come last."""
        own = [file.path for file in self.files]
        return own + [path for overlay in self.overlays for path in overlay.paths]


@dataclass(frozen=True, slots=True)
class SpecFolder:
    """A spec: the directory as given, and the protocols in it, sorted."""

    path: Path
    protocols: tuple[SourceFolder, ...]

    @property
    def paths(self) -> list[Path]:
        """All files that are read."""
        return [path for protocol in self.protocols for path in protocol.paths]

    def locate(self, name: str) -> Path:
        """Return the path of the file with this name in diagnostics.

        A file that is not among those found is assumed to be below the directory of the spec.
        """
        parts = PurePosixPath(name).parts
        for path in self.paths:
            if path.parts[-len(parts) :] == parts:
                return path
        if Path(name) == self.path:
            return Path(name)
        return (self.protocols[0].path.parent if self.protocols else self.path) / name


def find_spec(path: Path) -> SpecFolder:
    """Find the files of a spec, valid or not, without reading them."""
    spec = path
    alone = (spec / "protocol.yaml").is_file()
    if alone or spec.name in ("", ".."):  # the name and the parent of the directory are needed
        spec = Path(os.path.abspath(spec))
    folders = [spec] if alone else sorted(found.parent for found in spec.glob("*/protocol.yaml"))
    return SpecFolder(path, tuple(_source_folder(folder) for folder in folders))


def _source_folder(folder: Path) -> SourceFolder:
    overlays = sorted(path for path in folder.glob("overlays/*") if path.is_dir())
    return SourceFolder(
        folder,
        tuple(_find(folder)),
        tuple(SourceFolder(overlay, tuple(_find_overlay(overlay))) for overlay in overlays),
    )


def read(source: SourceFolder, diagnostics: Diagnostics, progress: Callable[[str], None]) -> Files:
    """Load all files of a protocol, without its overlays."""
    folder = source.path
    _refuse_strays(source, folder.parent, diagnostics)
    _report_old_places(source, diagnostics)
    return _read(source.files, diagnostics, progress)


def read_overlay(
    source: SourceFolder, diagnostics: Diagnostics, progress: Callable[[str], None]
) -> Files:
    """Load all files of an overlay, and mark every document with its name."""
    folder = source.path
    root = folder.parents[2]
    place = Place(folder.relative_to(root).as_posix())
    if leads_out(folder, root):
        diagnostics.add(place, "SW008", _LINK)
        return {}
    if not (folder / "overlay.yaml").is_file():
        diagnostics.add(place, "SW006", "the directory of this overlay has no overlay.yaml")
    _refuse_strays(source, root, diagnostics, overlay=True)
    files = _read(source.files, diagnostics, progress, parts=_PARTS)
    for document in files.get("overlay", ()):
        name = document.data["overlay"]
        if name != folder.name:
            what = f"the overlay {name} is in the directory {folder.name}"
            diagnostics.add(document.place("overlay"), "SW062", what)
    marked = [document for documents in files.values() for document in documents]
    for document in marked:
        document.overlay = folder.name
    return files


def _refuse_strays(
    source: SourceFolder, root: Path, diagnostics: Diagnostics, *, overlay: bool = False
) -> None:
    for path, place in strays(source.path, set(source.paths), overlay=overlay):
        name, above = (part.relative_to(root).as_posix() for part in (path, source.path))
        hint = f"move it to {above}/{place}, with a name that ends in .yaml"
        diagnostics.add(
            Place(name), "SW008", "this file is in the wrong place and is not read", hint
        )


def _report_old_places(source: SourceFolder, diagnostics: Diagnostics) -> None:
    """Warn once about files in the places of 0.1; report those that another file shadows."""
    around = source.path.parent.parent  # the old place may be next to the spec
    moves = []
    for kind in OF_WIRE:
        new = source.path / f"{kind}.yaml"
        there = [file.path for file in source.files if file.kind == kind]
        for old in _old_files(source.path, kind):
            new_name, old_name = (path.relative_to(around).as_posix() for path in (new, old.path))
            if old.path in there:
                moves.append(f"{old_name} to {new_name}")
                continue
            other = there[0].relative_to(around).as_posix()
            what = f"this file and {other} both hold the {kind}"
            hint = f"move its entries to {new_name} and delete it"
            diagnostics.add(Place(old.name), "SW008", what, hint)
    if moves:
        text = f"move {' and '.join(moves)}; the next release will not read the old place"
        warnings.warn(text, FutureWarning, stacklevel=2)


def _read(
    found: Iterable[SourceFile],
    diagnostics: Diagnostics,
    progress: Callable[[str], None],
    parts: Collection[str] = (),
) -> Files:
    files: Files = {}
    for file in found:
        kind, name = file.kind, file.name
        progress(name)
        if leads_out(file.path, file.root):  # diagnostics quote text, which must not be any file's
            diagnostics.add(Place(name), "SW008", _LINK)
            continue
        document = strict_yaml.load(file.path, name, diagnostics, any_byte=kind in OF_WIRE)
        if document is not None and fits_schema(document, kind, diagnostics, part=kind in parts):
            files.setdefault(kind, []).append(document)
    return files


def _find(folder: Path) -> Iterator[SourceFile]:
    """Yield each file of a protocol."""
    for kind, pattern in _KINDS.items():
        found = _matching(folder, pattern)
        for path in found:
            yield SourceFile(kind, path, folder.parent)
        if kind in OF_WIRE and not found:
            yield from _old_files(folder, kind)[:1]


def _old_files(folder: Path, kind: str) -> list[SourceFile]:
    """Return the files of a protocol in the places of version 0.1, the innermost first."""
    places = (folder, folder.parent, folder.parent.parent)
    files = [
        SourceFile(kind, above / OLD_FOLDER / kind / f"{folder.name}.yaml", above)
        for above in places
    ]
    return [file for file in files if os.path.lexists(file.path)]


def _find_overlay(folder: Path) -> Iterator[SourceFile]:
    """Yield each file of an overlay."""
    for kind, pattern in _KINDS_OF_OVERLAYS.items():
        for path in _matching(folder, pattern):
            yield SourceFile(kind, path, folder.parents[2])


def _matching(folder: Path, pattern: str) -> list[Path]:
    """Return the files of a kind, including dangling links, so that they are reported."""
    if "*" in pattern:
        return sorted(folder.glob(pattern))
    path = folder / pattern
    return [path] if os.path.lexists(path) else []
