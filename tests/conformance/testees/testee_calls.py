"""Calls of the Python testee, validated with its schema, and of the runner of the worked examples."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

from jsonschema_rs import Draft202012Validator

from checkout import SCHEMAS
from quick_command import entry_points_once
from stagewire.protocols import Protocol
from stagewire_conformance import Verdict
from stagewire_conformance.examples import run_example
from stagewire_conformance.testee import serve

SCHEMA = json.loads((SCHEMAS / "testee.schema.json").read_text(encoding="utf-8"))


def validator(name: str) -> Draft202012Validator:
    return Draft202012Validator({"$ref": f"#/$defs/{name}", "$defs": SCHEMA["$defs"]})


ANSWER = validator("answer")
REQUEST = validator("request")


def ask(*lines: bytes) -> list[dict[str, Any]]:
    written: list[str] = []
    with entry_points_once():
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


Runner = Callable[[Protocol, dict[str, Any]], Verdict]


def failure(protocol: Protocol, entry: dict[str, Any], runner: Runner = run_example) -> str:
    """Expect that a worked example fails, and return the reason."""
    verdict = runner(protocol, entry)
    assert verdict.outcome == "failed", verdict
    return verdict.detail


def passes(protocol: Protocol, entry: dict[str, Any], runner: Runner = run_example) -> str:
    """Expect that a worked example passes, and return its notes."""
    verdict = runner(protocol, entry)
    assert verdict.outcome == "passed", verdict
    return verdict.detail
