"""Find the files of a spec, load them strictly and hold them against their schemas.

A spec is a folder with one folder per protocol in it (a folder that holds ``protocol.yaml``), or such a
folder itself. Which kind a file is follows from where it stands; worked examples and captures stand
in a folder ``conformance`` beside the spec, in it, or in that of the protocol; the innermost counts.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

import jsonschema

from stagewire_generator import strict_yaml
from stagewire_generator.diagnostics import Diagnostics
from stagewire_generator.strict_yaml import Document

__all__ = ["Files", "protocol_folders", "read"]

Files = dict[str, list[Document]]

# kind -> pattern below the protocol's folder; the kind names the schema, too
_KINDS = {
    "protocol": "protocol.yaml",
    "quantities": "quantities.yaml",
    "stages": "stages.yaml",
    "units": "units.yaml",
    "messages": "messages/*.yaml",
    "errata": "errata/*.yaml",
    "printed": "printed/*.yaml",
}
_BESIDE = {"examples": "examples/{}.yaml", "captures": "captures/{}.yaml"}


def protocol_folders(spec: Path) -> list[Path]:
    """Return the folders of the protocols in ``spec``, sorted."""
    if (spec / "protocol.yaml").is_file():
        return [Path(os.path.abspath(spec))]  # "." has no name, and the examples go by the name
    return sorted(p.parent for p in spec.glob("*/protocol.yaml"))


def read(folder: Path, diagnostics: Diagnostics, progress: Callable[[str], None]) -> Files:
    """Load all files of the protocol in ``folder``."""
    files: Files = {}
    for kind, path, name in _find(folder):
        progress(name)
        document = strict_yaml.load(path, name, diagnostics, any_character=kind in _BESIDE)
        if document is not None and _valid(document, kind, diagnostics):
            files.setdefault(kind, []).append(document)
    return files


def _find(folder: Path) -> Iterator[tuple[str, Path, str]]:
    root = folder.parent
    for kind, pattern in _KINDS.items():
        for path in sorted(folder.glob(pattern)):
            yield kind, path, path.relative_to(root).as_posix()
    for beside in (folder / "conformance", root / "conformance", root.parent / "conformance"):
        if not beside.is_dir():
            continue
        for kind, pattern in _BESIDE.items():
            path = beside / pattern.format(folder.name)
            if path.is_file():
                yield kind, path, path.relative_to(beside.parent).as_posix()
        return


def _valid(document: Document, kind: str, diagnostics: Diagnostics) -> bool:
    valid = True
    for error in _validator(kind).iter_errors(document.data):
        valid = False
        while error.context:  # of several alternatives, say what is wrong with the nearest
            error = max(error.context, key=lambda e: (len(e.absolute_path), -len(str(e.message))))
        place = document.place(*error.absolute_path, *_culprit(error))
        where = ".".join(str(part) for part in error.absolute_path) or kind
        diagnostics.add(place, "SW010", f"{where}: {_plain(error)}")
    return valid


def _culprit(error: jsonschema.ValidationError) -> list[str]:
    """Return the key that an error about a whole mapping means, for its place."""
    if error.validator == "additionalProperties" and isinstance(error.instance, dict):
        return [key for key in error.instance if repr(key) in str(error.message)][:1]
    if "propertyNames" in error.absolute_schema_path and isinstance(error.instance, str):
        return [error.instance]
    return []


def _plain(error: jsonschema.ValidationError) -> str:
    described = error.schema.get("description") if isinstance(error.schema, dict) else None
    message = "not allowed here" if error.validator == "not" else str(error.message)
    if len(message) > 160:
        message = message[:157] + "..."
    return f"{message} ({described})" if described else message


@cache
def _validator(kind: str) -> Any:
    path = _schema_folder() / f"{kind}.schema.json"
    return jsonschema.Draft202012Validator(json.loads(path.read_text(encoding="utf-8")))


def _schema_folder() -> Path:
    """Return the schemas of an installed wheel or of the checkout, never those of the spec.

    Their patterns keep a text of the spec from becoming code; a spec must not bring looser ones.
    """
    here = Path(__file__).resolve().parent
    for candidate in (here / "schema", here.parents[1] / "spec" / "schema"):
        if (candidate / "protocol.schema.json").is_file():
            return candidate
    raise FileNotFoundError("the JSON Schemas of the registry are not installed")
