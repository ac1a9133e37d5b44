"""The JSON Schemas of the files of a spec, and validation against them.

Nearly all files are valid, so two libraries share the work: ``jsonschema_rs`` quickly says whether a file
is, and ``jsonschema`` explains what is wrong with one that is not, and where. Importing the latter takes
longer than the former needs for a whole spec.
"""

from __future__ import annotations

import difflib
import json
import re
from collections.abc import Sequence
from functools import cache
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

import jsonschema_rs

from stagewire_generator.diagnostics import MOST_OF_A_FILE, Diagnostics
from stagewire_generator.strict_yaml import Document

if TYPE_CHECKING:
    import jsonschema

KINDS = (
    "protocol",
    "overlay",
    "quantities",
    "stages",
    "units",
    "messages",
    "errata",
    "rules",
    "printed",
    "examples",
    "captures",
)
"""The kinds of files; each has a schema of this name."""


def schema_texts() -> dict[str, str]:
    """Return the text of each schema by the name of its file."""
    folder = schema_folder()
    names = [f"{kind}.schema.json" for kind in KINDS]
    return {name: (folder / name).read_text(encoding="utf-8") for name in names}


def schema_folder() -> Path:
    """Return the schemas of an installed wheel or of the checkout, never those of the spec.

    Their patterns keep a text of the spec from becoming code; a spec must not bring looser ones.
    """
    here = Path(__file__).resolve().parent
    for candidate in (here / "schema", here.parents[1] / "spec" / "schema"):
        if (candidate / "protocol.schema.json").is_file():
            return candidate
    raise FileNotFoundError("the JSON Schemas of the registry are not installed")


HERE = "x-here"
"""Keeps, in a schema, the description that stood beside a reference: what the key is for."""

_LONGEST = 160  # characters of a message that quotes the file, and of a location
_FORMS = {
    r"^[a-z][a-z0-9]*(_[a-z0-9]+)*$(?!\n)": "name in lower_snake_case",
    r"^[A-Z][A-Z0-9]*(_[A-Z0-9]+)*$(?!\n)": "name in UPPER_SNAKE_CASE",
    r"^[A-Z][A-Za-z0-9]*(_[A-Za-z0-9]+)*$(?!\n)": "name of letters, digits and underscores, a capital first",
    r"^[a-z0-9]+(-[a-z0-9]+)*$(?!\n)": "name in-lower-case-with-hyphens",
}
_TYPES = {
    "object": "mapping",
    "array": "list",
    "string": "text",
    "integer": "integer",
    "boolean": "true or false",
}


def nearest(error: jsonschema.ValidationError) -> jsonschema.ValidationError:
    """Return, of several alternatives that all fail, what is wrong with the nearest."""
    while error.context:
        error = max(error.context, key=lambda e: (len(e.absolute_path), -len(str(e.message))))
    return error


def explained(error: jsonschema.ValidationError) -> tuple[Sequence[str], str, str]:
    """Return the key that an error about a whole mapping means, what is wrong, and how to mend it.

    The first is empty where the error is about what stands there, the last where nothing closer than the
    hint of the code is known.
    """
    schema = error.schema if isinstance(error.schema, dict) else {}
    described = schema.get("description", "")
    key: list[str] = []
    hint = ""
    if error.validator == "not":
        what = "not allowed here"
    elif error.validator == "required":
        what, described = _missing(error, schema, described)
    elif error.validator == "dependentRequired":
        key, what, hint = _incomplete(error)
        described = ""
    elif error.validator == "additionalProperties":
        key, what, hint = _unexpected(error, schema)
    elif error.validator == "pattern":
        what = f"{_short(repr(error.instance))} is {_no(str(error.validator_value))}"
    elif error.validator == "type":
        what = _other_type(error)
        if error.validator_value == "string" and isinstance(error.instance, bool):
            described = schema.get(HERE, described)  # what to write instead
            hint = "write it in words, or leave it out"
        elif error.validator_value == "string" and isinstance(error.instance, int):
            hint = "put it in quotes"
    else:
        what = _short(str(error.message))
    if "propertyNames" in error.absolute_schema_path and isinstance(error.instance, str):
        key = [error.instance]
    return key, f"{what} ({described})" if what and described else what or described, hint


def _missing(error: Any, schema: Any, described: str) -> tuple[str, str]:
    """Return what is said of a missing key, and what the key would be; each has an error of its own."""
    if error.parent is not None and "properties" not in schema and described:
        return "", described  # one of several alternatives, and the description names them
    key = next(key for key in error.validator_value if error.message.startswith(f"{key!r} "))
    missing = schema.get("properties", {}).get(key, {})
    return f"{key} is missing", missing.get(HERE) or missing.get("description", described)


def _incomplete(error: Any) -> tuple[list[str], str, str]:
    """Return the key that stands without one that it needs, what is said of that, and a hint."""
    key, missing = next(
        (key, missing)
        for key, needed in error.validator_value.items()
        for missing in needed
        if str(error.message) == f"{missing!r} is a dependency of {key!r}"
    )
    needed = " and ".join(error.validator_value[key])
    return (
        [key],
        f"{missing} is missing: {key} needs {needed}",
        f"add {missing}, or leave out {key}",
    )


def _unexpected(error: Any, schema: Any) -> tuple[list[str], str, str]:
    """Return the first key that the schema does not know, what is said of all of them, and a hint."""
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
    verb = "is" if len(unknown) == 1 else "are"
    return unknown[:1], f"{_short(', '.join(unknown))} {verb} not known here", hint


def _no(pattern: str) -> str:
    """Return what a text that does not match is not; the description says it of less common patterns."""
    return f"no {_FORMS[pattern]}" if pattern in _FORMS else "not allowed"


def _other_type(error: Any) -> str:
    wanted = error.validator_value
    names = [wanted] if isinstance(wanted, str) else wanted
    kinds = " or ".join(_TYPES.get(name, name) for name in names)
    if error.instance is None:
        return f"empty, and no {kinds}"
    return f"{_short(repr(error.instance))} is no {kinds}"


def _short(text: str) -> str:
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 3]}..."


_WHOLE = ("required", "if", "then", "else")  # what schemas ask of a whole file or section
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
