"""What an error of a JSON Schema says, in the words of whoever wrote the file."""

from __future__ import annotations

import difflib
import re
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import jsonschema

__all__ = ["HERE", "explained", "nearest"]

HERE = "x-here"
"""Keeps, in a schema, the description that stood beside a reference: what the key is for."""

_LONGEST = 160  # characters of a message that quotes the file
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
