"""Asks the Python testee, and holds requests and answers against the schema of its protocol."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from jsonschema import Draft202012Validator

from stagewire_conformance.testee import serve

SCHEMA = json.loads(
    (Path(__file__).parents[2] / "spec/schema/testee.schema.json").read_text(encoding="utf-8")
)


def validator(name: str) -> Draft202012Validator:
    return Draft202012Validator({"$ref": f"#/$defs/{name}", "$defs": SCHEMA["$defs"]})


ANSWER = validator("answer")
REQUEST = validator("request")


def ask(*lines: bytes) -> list[dict[str, Any]]:
    written: list[str] = []
    serve(lines, written.append)
    assert all(text.endswith("\n") and text.count("\n") == 1 for text in written)
    answers = [json.loads(text) for text in written]
    for answer in answers:
        ANSWER.validate(answer)
        assert "internal error" not in answer.get("detail", "")
    return answers


def one(**request: Any) -> dict[str, Any]:
    request = {"id": 1, **request}
    REQUEST.validate(request)
    (answer,) = ask(json.dumps(request).encode())
    assert answer.pop("id") == 1
    return answer


def refused(**request: Any) -> str:
    answer = one(**request)
    assert answer["ok"] is False
    return str(answer["error"])


def code(line: bytes | str) -> tuple[Any, str]:
    (answer,) = ask(line.encode() if isinstance(line, str) else line)
    return answer["id"], answer.get("error", "")
