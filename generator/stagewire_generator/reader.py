"""Find the files of a spec, load them strictly and hold them against their schemas.

A spec is a folder with one folder per protocol in it (a folder that holds ``protocol.yaml``), or such a
folder itself. The place of a file in it decides its kind. An overlay is a folder in ``overlays`` with files
of the same kinds. Version 0.1 had worked examples and captures in a folder ``conformance`` beside the spec,
in it, or in that of the protocol; for one release they are still read there, with a warning.
"""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Collection, Iterable, Iterator
from pathlib import Path, PurePosixPath

from stagewire_generator import strict_yaml
from stagewire_generator.diagnostics import Diagnostics, Place
from stagewire_generator.files import leads_out, strays
from stagewire_generator.schemas import fits_schema
from stagewire_generator.strict_yaml import Document

Files = dict[str, list[Document]]

# kind -> pattern below the protocol's folder; the kind names the schema, too
_KINDS = {
    "protocol": "protocol.yaml",
    "quantities": "quantities.yaml",
    "stages": "stages.yaml",
    "units": "units.yaml",
    "messages": "messages/*.yaml",
    "errata": "errata/*.yaml",
    "rules": "rules.yaml",
    "printed": "printed/*.yaml",
    "examples": "examples.yaml",
    "captures": "captures.yaml",
}
# The same below the folder of an overlay
_KINDS_OF_OVERLAYS = {
    "overlay": "overlay.yaml",
    **{kind: pattern for kind, pattern in _KINDS.items() if kind != "protocol"},
}
_PARTS = frozenset({"stages", "units"})  # of these an overlay has what it changes
_LINK = "is a link out of the folder of the spec"
_OF_WIRE = frozenset({"examples", "captures"})  # their bytes are quoted as they came
_IN_0_1 = "conformance"  # the folder of examples and captures


def protocol_folders(spec: Path) -> list[Path]:
    """Return the folders of the protocols in ``spec``, sorted."""
    alone = (spec / "protocol.yaml").is_file()
    if alone or spec.name in ("", ".."):  # the folder is known by its name and its parent
        spec = Path(os.path.abspath(spec))
    if alone:
        return [spec]
    return sorted(p.parent for p in spec.glob("*/protocol.yaml"))


def overlay_folders(folder: Path) -> list[Path]:
    """Return the folders of the overlays of the protocol in ``folder``, sorted."""
    return sorted(path for path in folder.glob("overlays/*") if path.is_dir())


def read(folder: Path, diagnostics: Diagnostics, progress: Callable[[str], None]) -> Files:
    """Load all files of the protocol in ``folder``, without its overlays."""
    found = list(_find(folder))
    astray = strays(folder, {path for _, path, _ in found})
    _refuse_strays(astray, folder, folder.parent, diagnostics)
    _warn_of_old_places(found, folder, diagnostics)
    return _read(found, diagnostics, progress)


def read_overlay(folder: Path, diagnostics: Diagnostics, progress: Callable[[str], None]) -> Files:
    """Load all files of the overlay in ``folder``; every document is marked with its name."""
    root = folder.parents[2]
    place = Place(folder.relative_to(root).as_posix())
    if leads_out(folder, root):
        diagnostics.add(place, "SW008", _LINK)
        return {}
    if not (folder / "overlay.yaml").is_file():
        diagnostics.add(place, "SW006", "no overlay.yaml in it")
    found = list(_find_overlay(folder))
    astray = strays(folder, {path for _, path, _ in found}, overlay=True)
    _refuse_strays(astray, folder, root, diagnostics)
    files = _read(found, diagnostics, progress, parts=_PARTS)
    for document in files.get("overlay", ()):
        name = document.data["overlay"]
        if name != folder.name:
            what = f"the overlay {name} stands in a folder {folder.name}"
            diagnostics.add(document.place("overlay"), "SW062", what)
    marked = [document for documents in files.values() for document in documents]
    for document in marked:
        document.overlay = folder.name
    return files


def _refuse_strays(
    astray: Iterable[tuple[Path, str]], folder: Path, root: Path, diagnostics: Diagnostics
) -> None:
    for path, place in astray:
        name, above = (part.relative_to(root).as_posix() for part in (path, folder))
        hint = f"move it to {above}/{place}, with a name that ends in .yaml"
        diagnostics.add(Place(name), "SW008", "stands where nothing is read", hint)


def _warn_of_old_places(
    found: Iterable[tuple[str, Path, Path]], folder: Path, diagnostics: Diagnostics
) -> None:
    """Warn once of files in their places of 0.1; report those that also have a file in the new place."""
    moves = []
    for kind, path, root in found:
        if kind not in _OF_WIRE or path.parent == folder:
            continue
        name, place = path.relative_to(root).as_posix(), f"{folder.name}/{kind}.yaml"
        if os.path.lexists(folder / f"{kind}.yaml"):
            hint = f"move its entries to {place} and delete it"
            diagnostics.add(
                Place(name), "SW008", f"this file and {place} both hold the {kind}", hint
            )
        else:
            around = folder.parent.parent  # the old place may be beside the spec
            names = (p.relative_to(around).as_posix() for p in (path, folder / f"{kind}.yaml"))
            moves.append(" to ".join(names))
    if moves:
        text = f"move {' and '.join(moves)}; the next release will not read the old place"
        warnings.warn(text, FutureWarning, stacklevel=2)


def _read(
    found: Iterable[tuple[str, Path, Path]],
    diagnostics: Diagnostics,
    progress: Callable[[str], None],
    parts: Collection[str] = (),
) -> Files:
    files: Files = {}
    for kind, path, root in found:
        name = path.relative_to(root).as_posix()
        progress(name)
        if leads_out(path, root):  # diagnostics quote what they find: it could be any file
            diagnostics.add(Place(name), "SW008", _LINK)
            continue
        document = strict_yaml.load(path, name, diagnostics, any_byte=kind in _OF_WIRE)
        if document is not None and fits_schema(document, kind, diagnostics, part=kind in parts):
            files.setdefault(kind, []).append(document)
    return files


def files_of(folder: Path) -> list[Path]:
    """Return the files that are read of the protocol in ``folder`` and of its overlays, right or wrong."""
    overlays = (found for overlay in overlay_folders(folder) for found in _find_overlay(overlay))
    return [path for _, path, _ in (*_find(folder), *overlays)]


def _find(folder: Path) -> Iterator[tuple[str, Path, Path]]:
    """Yield kind and path of each file, and the folder that it must not lead out of."""
    root = folder.parent
    for kind, pattern in _KINDS.items():
        for path in sorted(folder.glob(pattern)):
            yield kind, path, root
    for kind in sorted(_OF_WIRE, reverse=True):
        for above in (folder, root, root.parent):
            path = above / _IN_0_1 / kind / f"{folder.name}.yaml"
            if os.path.lexists(path):
                yield kind, path, above
                break


def _find_overlay(folder: Path) -> Iterator[tuple[str, Path, Path]]:
    """Yield the same for each file of an overlay."""
    root = folder.parents[2]
    for kind, pattern in _KINDS_OF_OVERLAYS.items():
        for path in sorted(folder.glob(pattern)):
            yield kind, path, root


def locate(spec: Path, name: str) -> Path:
    """Return the path of the file that diagnostics of ``spec`` call ``name``.

    A file that is not read, such as one that is gone, is taken to be below ``spec``.
    """
    parts = PurePosixPath(name).parts
    folders = protocol_folders(spec)
    for path in (path for folder in folders for path in files_of(folder)):
        if path.parts[-len(parts) :] == parts:
            return path
    return Path(name) if Path(name) == spec else (folders[0].parent if folders else spec) / name
