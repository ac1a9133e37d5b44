"""Find the files of a spec, load them strictly and hold them against their schemas.

A spec is a folder with one folder per protocol in it (a folder that holds ``protocol.yaml``), or such a
folder itself. Which kind a file is follows from where it stands; worked examples and captures stand
in a folder ``conformance`` beside the spec, in it, or in that of the protocol; the innermost counts.
"""

from __future__ import annotations

import json
import os
import re
from collections.abc import Callable, Iterator
from functools import cache
from itertools import islice
from pathlib import Path
from typing import Any

import jsonschema

from stagewire_generator import strict_yaml
from stagewire_generator.diagnostics import MOST_OF_A_FILE, Diagnostics, Place
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
_LONG_PATTERN = 60  # characters; the description of a longer one says more
_LONGEST = 160  # characters of a place or a message
_BESIDE_A_REFERENCE = {"$ref", "title", "description", "maxLength"}
_BESIDE = {"examples": "examples/{}.yaml", "captures": "captures/{}.yaml"}


def protocol_folders(spec: Path) -> list[Path]:
    """Return the folders of the protocols in ``spec``, sorted."""
    if (spec / "protocol.yaml").is_file():
        return [Path(os.path.abspath(spec))]  # "." has no name, and the examples go by the name
    return sorted(p.parent for p in spec.glob("*/protocol.yaml"))


def read(folder: Path, diagnostics: Diagnostics, progress: Callable[[str], None]) -> Files:
    """Load all files of the protocol in ``folder``."""
    files: Files = {}
    for kind, path, root in _find(folder):
        name = path.relative_to(root).as_posix()
        progress(name)
        if _leads_out(path, root):
            diagnostics.add(Place(name), "SW008", "is a link out of the folder of the spec")
            continue
        document = strict_yaml.load(path, name, diagnostics, any_byte=kind in _BESIDE)
        if document is not None and _valid(document, kind, diagnostics):
            files.setdefault(kind, []).append(document)
    return files


def _find(folder: Path) -> Iterator[tuple[str, Path, Path]]:
    """Yield kind and path of each file, and the folder that it must not lead out of."""
    root = folder.parent
    for kind, pattern in _KINDS.items():
        for path in sorted(folder.glob(pattern)):
            yield kind, path, root
    for beside in (folder / "conformance", root / "conformance", root.parent / "conformance"):
        if not beside.is_dir():
            continue
        for kind, pattern in _BESIDE.items():
            path = beside / pattern.format(folder.name)
            if os.path.lexists(path):
                yield kind, path, beside.parent
        return


def _leads_out(path: Path, root: Path) -> bool:
    """Whether a link takes what is read from somewhere else.

    Diagnostics quote what they find, so a spec that is not trusted could show any file that its
    reader may read.
    """
    return not Path(os.path.realpath(path)).is_relative_to(os.path.realpath(root))


def _valid(document: Document, kind: str, diagnostics: Diagnostics) -> bool:
    valid = True
    for error in islice(_validator(kind).iter_errors(document.data), MOST_OF_A_FILE):
        valid = False
        while error.context:  # of several alternatives, say what is wrong with the nearest
            error = max(error.context, key=lambda e: (len(e.absolute_path), -len(str(e.message))))
        place = document.place(*error.absolute_path, *_culprit(error))
        where = ".".join(str(part) for part in error.absolute_path) or kind
        diagnostics.add(place, "SW010", f"{_short(where)}: {_plain(error)}")
    return valid


def _culprit(error: jsonschema.ValidationError) -> list[str]:
    """Return the key that an error about a whole mapping means, for its place."""
    if error.validator == "additionalProperties" and isinstance(error.instance, dict):
        schema = error.schema if isinstance(error.schema, dict) else {}
        known, patterns = schema.get("properties", ()), schema.get("patternProperties", ())
        for key in error.instance:
            if key not in known and not any(re.search(pattern, key) for pattern in patterns):
                return [key]
    if "propertyNames" in error.absolute_schema_path and isinstance(error.instance, str):
        return [error.instance]
    return []


def _plain(error: jsonschema.ValidationError) -> str:
    described = error.schema.get("description") if isinstance(error.schema, dict) else None
    message = "not allowed here" if error.validator == "not" else _short(str(error.message))
    if (
        error.validator == "pattern"
        and described
        and len(str(error.validator_value)) > _LONG_PATTERN
    ):
        message = f"{_short(repr(error.instance))} is not allowed"
    return f"{message} ({described})" if described else message


def _short(text: str) -> str:
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 3]}..."


@cache
def _validator(kind: str) -> Any:
    path = _schema_folder() / f"{kind}.schema.json"
    schema = json.loads(path.read_text(encoding="utf-8"))
    _inline(schema)
    return jsonschema.Draft202012Validator(schema)


def _inline(schema: Any) -> None:
    """Put the definitions of a schema where they are referred to.

    A spec meets tens of thousands of references, and each costs a validator of its own. Where more
    than a length stands beside a reference it stays one: some keywords look at their neighbours.
    """
    definitions = {f"#/$defs/{name}": part for name, part in schema.get("$defs", {}).items()}
    parts, seen = [schema], set()
    while parts:
        part = parts.pop()
        if id(part) in seen or not isinstance(part, (dict, list)):
            continue
        seen.add(id(part))
        if isinstance(part, dict):
            while (meant := definitions.get(str(part.get("$ref")))) is not None:
                if part.keys() - _BESIDE_A_REFERENCE or "maxLength" in part.keys() & meant.keys():
                    break
                del part["$ref"]
                part.update(meant)
        parts.extend(part.values() if isinstance(part, dict) else part)


def _schema_folder() -> Path:
    """Return the schemas of an installed wheel or of the checkout, never those of the spec.

    Their patterns keep a text of the spec from becoming code; a spec must not bring looser ones.
    """
    here = Path(__file__).resolve().parent
    for candidate in (here / "schema", here.parents[1] / "spec" / "schema"):
        if (candidate / "protocol.schema.json").is_file():
            return candidate
    raise FileNotFoundError("the JSON Schemas of the registry are not installed")
