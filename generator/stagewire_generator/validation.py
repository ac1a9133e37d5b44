"""Hold a file against the JSON Schema of its kind.

Nearly all files are right, so two libraries share the work: ``jsonschema_rs`` says in no time whether one
is, and of one that is not ``jsonschema`` says what is wrong with it, and where. To import the latter takes
longer than the former needs for a whole spec.
"""

from __future__ import annotations

import json
from functools import cache
from itertools import islice
from typing import Any

import jsonschema_rs

from stagewire_generator.diagnostics import MOST_OF_A_FILE, Diagnostics
from stagewire_generator.schema_errors import HERE, explained, nearest
from stagewire_generator.schemas import schema_folder
from stagewire_generator.strict_yaml import Document

__all__ = ["fits_schema"]

_WHOLE = ("required", "if", "then", "else")  # what schemas ask of a whole file or section
_LONGEST = 160  # characters of a place
_BESIDE_A_REFERENCE = {"$ref", "title", "description", "maxLength", HERE}
# Half of a pair of UTF-16, which Rust has in no text, and so in no pattern either.
_SURROGATES = r"\\uD800-\\uDFFF"


def fits_schema(
    document: Document, kind: str, diagnostics: Diagnostics, *, part: bool = False
) -> bool:
    """Hold a file against the schema of its kind; what is wrong goes to ``diagnostics``.

    :param part: whether it may lack what the schema asks of a whole file.
    """
    if _is_valid(document.data, kind, part):
        return True
    valid = True
    for error in islice(_explainer(kind, part).iter_errors(document.data), MOST_OF_A_FILE):
        valid = False
        error = nearest(error)
        key, what, hint = explained(error)
        place = document.place(*error.absolute_path, *key)
        where = ".".join(str(part) for part in error.absolute_path) or kind
        where = where if len(where) <= _LONGEST else f"{where[: _LONGEST - 3]}..."
        diagnostics.add(place, "SW010", f"{where}: {what}", hint)
    return valid


def _is_valid(data: Any, kind: str, part: bool) -> bool:
    """Whether data are right for certain; where they are not, the other library has the last word."""
    try:
        return _gate(kind, part).is_valid(data)
    except ValueError:  # a text that is none in Rust, or what JSON has not
        return False


@cache
def _gate(kind: str, part: bool) -> jsonschema_rs.Draft202012Validator:
    text = _text(kind).replace(_SURROGATES, "")
    return jsonschema_rs.Draft202012Validator(_schema(text, part))


@cache
def _explainer(kind: str, part: bool) -> Any:
    import jsonschema  # see above

    schema = _schema(_text(kind), part)
    _inline(schema)
    return jsonschema.Draft202012Validator(schema)


def _text(kind: str) -> str:
    return (schema_folder() / f"{kind}.schema.json").read_text(encoding="utf-8")


def _schema(text: str, part: bool) -> Any:
    """Return the schema of a whole file, or of a part of one."""
    schema = json.loads(text)
    for whole in (schema, *schema["properties"].values()) if part else ():
        for keyword in _WHOLE:
            whole.pop(keyword, None)
    return schema


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
                here = part.get(HERE) or part.get("description", "")
                part.update(meant, **{HERE: here})
        parts.extend(part.values() if isinstance(part, dict) else part)
