"""Validate the files of a spec against their JSON Schemas.

Nearly all files are valid, so two libraries share the work: ``jsonschema_rs`` is fast and checks whether a
file is valid; ``jsonschema`` explains the errors of an invalid file. Importing ``jsonschema`` takes longer
than ``jsonschema_rs`` needs for a whole spec.
"""

from __future__ import annotations

import difflib
import json
import re
from collections.abc import Mapping, Sequence
from functools import cache
from itertools import islice
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import jsonschema_rs

from stagewire_generator.diagnostics import MOST_OF_A_FILE, Diagnostics, Place, meant
from stagewire_generator.strict_yaml import Document, KeyPath

if TYPE_CHECKING:
    import jsonschema

KINDS = (
    "protocol",
    "overlay",
    "additions",
    "quantities",
    "stages",
    "units",
    "messages",
    "errata",
    "rules",
    "decisions",
    "evidence",
    "printed",
    "examples",
    "captures",
)
"""The kinds of files; each has a schema with this name."""


def schema_texts() -> dict[str, str]:
    """Return file name -> text of each schema."""
    folder = schema_folder()
    names = [f"{kind}.schema.json" for kind in KINDS]
    return {name: (folder / name).read_text(encoding="utf-8") for name in names}


def schema_folder() -> Path:
    """Return the directory of the schemas in the wheel or checkout, never one in the spec.

    The patterns of the schemas prevent text in a spec from becoming code, so a spec must not be able to
    loosen them.
    """
    here = Path(__file__).resolve().parent
    for candidate in (here / "schema", here.parents[1] / "spec" / "schema"):
        if (candidate / "protocol.schema.json").is_file():
            return candidate
    raise FileNotFoundError("the JSON Schemas of the registry are not installed")


HERE = "x-here"
"""Key for a description that was next to a reference, which states the purpose of the key."""
HINT = "x-hint"
"""Key for what to do if a required key is missing, or if two alternatives are given."""

_LONGEST = 160  # characters of a quotation from the file, and of a location
_FORMS = {
    r"^[a-z][a-z0-9]*(_[a-z0-9]+)*$(?!\n)": "name in lower_snake_case",
    r"^[A-Z][A-Z0-9]*(_[A-Z0-9]+)*$(?!\n)": "name in UPPER_SNAKE_CASE",
    r"^[A-Z][A-Za-z0-9]*(_[A-Za-z0-9]+)*$(?!\n)": "name of letters, digits and underscores, a capital first",
    r"^[a-z0-9]+(-[a-z0-9]+)*$(?!\n)": "name in-lower-case-with-hyphens",
}
_TYPES = {
    "object": "a mapping",
    "array": "a list",
    "string": "text",
    "integer": "an integer",
    "boolean": "true or false",
}


def nearest(error: jsonschema.ValidationError) -> jsonschema.ValidationError:
    """Return the error of the closest match if several alternatives all fail."""
    while error.context:
        error = max(error.context, key=lambda e: (len(e.absolute_path), -len(str(e.message))))
    return error


def explained(error: jsonschema.ValidationError) -> tuple[Sequence[str], str, str]:
    """Return the key that an error about a mapping concerns, the message, and a hint.

    The key is empty if the error is about the value itself. The hint is empty if there is nothing more
    specific than the hint of the code.
    """
    schema = error.schema if isinstance(error.schema, dict) else {}
    described = schema.get("description", "")
    key: list[str] = []
    hint = ""
    if error.validator == "not":
        what = "not allowed here"
    elif error.validator == "required":
        what, described, hint = _missing(error, schema, described)
    elif error.validator == "oneOf" and not error.context:  # more than one alternative matches
        first = schema["oneOf"][0]
        what, described, hint = "", first.get("description", ""), first.get(HINT, "")
    elif error.validator == "dependentRequired":
        key, what, hint = _incomplete(error)
        described = ""
    elif error.validator == "additionalProperties":
        key, what, hint = _unexpected(error, schema)
    elif error.validator == "enum":
        what = _short(str(error.message))
        values: Any = error.validator_value
        hint = meant(str(error.instance), map(str, values)) or "write one of them"
    elif error.validator == "pattern":
        what = f"{_short(repr(error.instance))} is {_no(str(error.validator_value))}"
    elif error.validator == "type":
        what = _other_type(error)
        if error.validator_value == "string" and isinstance(error.instance, bool):
            described = schema.get(HERE, described)  # states the alternative
            hint = "write a text, or leave it out"
        elif error.validator_value == "string" and isinstance(error.instance, int):
            hint = "put it in quotes"
        elif error.validator_value == "integer" and str(error.instance).isdecimal():
            hint = "remove the quotes"
    else:
        what = _short(str(error.message))
    if "propertyNames" in error.absolute_schema_path and isinstance(error.instance, str):
        key = [error.instance]
    return key, f"{what} ({described})" if what and described else what or described, hint


def _missing(error: Any, schema: Any, described: str) -> tuple[str, str, str]:
    """Return the message about a missing key, the description of the key, and a hint."""
    if error.parent is not None and "properties" not in schema and described:
        return "", described, ""  # the description names the alternatives
    key = next(key for key in error.validator_value if error.message.startswith(f"{key!r} "))
    missing = schema.get("properties", {}).get(key, {})
    described = missing.get(HERE) or missing.get("description", described)
    return f"{key} is missing", described, missing.get(HINT, f"add {key}")


def _incomplete(error: Any) -> tuple[list[str], str, str]:
    """Return a key that requires a missing key, the message, and a hint."""
    key, missing = next(
        (key, missing)
        for key, needed in error.validator_value.items()
        for missing in needed
        if str(error.message) == f"{missing!r} is a dependency of {key!r}"
    )
    needed = " and ".join(error.validator_value[key])
    return (
        [key],
        f"{missing} is missing: {key} requires {needed}",
        f"add {missing}, or remove {key}",
    )


def _unexpected(error: Any, schema: Any) -> tuple[list[str], str, str]:
    """Return the first unknown key, a message that names all unknown keys, and a hint."""
    known, patterns = list(schema.get("properties", ())), list(schema.get("patternProperties", ()))
    unknown = [
        key
        for key in error.instance
        if key not in known and not any(re.search(pattern, key) for pattern in patterns)
    ]
    if len(patterns) == 1 and not known:
        return unknown[:1], f"{_short(repr(unknown[0]))} is {_no(patterns[0])}", ""
    close = [name for key in unknown for name in difflib.get_close_matches(key[:80], known, n=1)]
    hint = f"did you mean {' and '.join(dict.fromkeys(close))}?" if close else ""
    noun = "key" if len(unknown) == 1 else "keys"
    return unknown[:1], f"unknown {noun} {_short(', '.join(unknown))}", hint


def _no(pattern: str) -> str:
    """Return the rest of a message about a text that does not match; rarer patterns have descriptions."""
    return f"not a {_FORMS[pattern]}" if pattern in _FORMS else "not allowed"


def _other_type(error: Any) -> str:
    wanted = error.validator_value
    names = [wanted] if isinstance(wanted, str) else wanted
    kinds = " or ".join(_TYPES.get(name, name) for name in names)
    if error.instance is None:
        return f"empty, but must be {kinds}"
    return f"{_short(repr(error.instance))} must be {kinds}"


def _short(text: str) -> str:
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 3]}..."


_WHOLE = ("required", "if", "then", "else")  # requirements for a whole file or section
_BESIDE_A_REFERENCE = {"$ref", "title", "description", "maxLength", HERE}
# UTF-16 surrogates, which Rust strings, and so its patterns, cannot contain.
_SURROGATES = r"\\uD800-\\uDFFF"


def fits_schema(
    document: Document,
    kind: str,
    diagnostics: Diagnostics,
    *,
    part: bool = False,
    places: Mapping[KeyPath, Place] = MappingProxyType({}),
) -> bool:
    """Validate a file against the schema of its kind, and add all errors to ``diagnostics``.

    :param part: whether the file may lack keys that the schema requires in a whole file.
    :param places: positions to report for entries as a whole, instead of those in the file.
    """
    if _is_valid(document.data, kind, part):
        return True
    valid = True
    for error in islice(_explainer(kind, part).iter_errors(document.data), MOST_OF_A_FILE):
        valid = False
        if error.validator == "oneOf" and not isinstance(error.instance, dict):
            continue  # the type is wrong, which is another error
        error = nearest(error)
        key, what, hint = explained(error)
        path = (*error.absolute_path, *key)
        place = places.get(path) or document.place(*path)
        where = ".".join(str(part) for part in error.absolute_path) or kind
        where = where if len(where) <= _LONGEST else f"{where[: _LONGEST - 3]}..."
        schema = f"see {kind}.schema.json; `stagewire schemas DIR` writes it to DIR"
        diagnostics.add(place, "SW010", f"{where}: {what}", hint or schema)
    return valid


def _is_valid(data: Any, kind: str, part: bool) -> bool:
    """Whether the data are certainly valid; otherwise the other library decides."""
    try:
        return _gate(kind, part).is_valid(data)
    except ValueError:  # a text that Rust cannot hold, or a value that JSON does not have
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
    """Replace the references in a schema by the definitions.

    Validating a spec follows tens of thousands of references, and each creates a validator. A reference with
    more than a length next to it is kept, because some keywords depend on their neighbours.
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
