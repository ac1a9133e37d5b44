"""Requests of a protocol that are larger than any frame; what they are made of stands in the vectors."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from stagewire.protocols import Protocol
from stagewire_conformance.testees.case import Case, ask
from stagewire_conformance.testees.vectors import stated

__all__ = ["large"]

Json = Mapping[str, Any]

_MANY = 2_000
_BYTES = 100_000


def large(protocol: Protocol) -> Iterator[Case]:
    """Yield the large requests of a protocol, as far as its vectors have what they are made of."""
    found = {name: next(filter(test, stated(protocol)), None) for name, test in _MADE_OF.items()}
    for name, (of, change, about) in _CHANGES.items():
        case = found[of]
        if case is None:
            continue
        (step,) = case.steps
        request, wanted = change(case, dict(step.request or {}), step.wanted)
        yield Case(
            id=f"{protocol.name}/large/{name}",
            group=f"{protocol.name}/large",
            steps=(ask(request, wanted),),
            about=about,
            protocol=protocol.name,
            operations=case.operations,
            message=case.message,
            field=case.field,
        )


def _is_stream(case: Case) -> bool:
    """Whether a case is a stream of one message alone, at an end that may hear it again."""
    (step,) = case.steps
    request, wanted = step.request or {}, step.wanted
    return (
        request.get("op") == "stream"
        and "command" not in request
        and wanted.get("pending") == ""
        and [event["event"] for event in wanted.get("events", ())] == ["message"]
    )


_MADE_OF = {
    "stream": _is_stream,
    "trailing": lambda case: case.id.endswith("/decode/trailing"),
    "above": lambda case: bool(case.field) and case.id.endswith(".above") and "/encode/" in case.id,
    "text": lambda case: bool(case.field) and case.id.endswith(".text") and "/encode/" in case.id,
}

_Changed = tuple[Json, Json]


def _repeated(case: Case, request: Json, wanted: Json) -> _Changed:
    whole = "".join(request["chunks"]) * _MANY
    return {**request, "chunks": [whole]}, {**wanted, "events": wanted["events"] * _MANY}


def _bytes(case: Case, request: Json, wanted: Json) -> _Changed:
    whole = bytes.fromhex("".join(request["chunks"])) * (_MANY // 4)
    chunks = [f"{byte:02x}" for byte in whole]
    return {**request, "chunks": chunks}, {**wanted, "events": wanted["events"] * (_MANY // 4)}


def _empty(case: Case, request: Json, wanted: Json) -> _Changed:
    nothing = [""] * _MANY
    return {**request, "chunks": [*nothing, *request["chunks"], *nothing]}, wanted


def _trailing(case: Case, request: Json, wanted: Json) -> _Changed:
    return {**request, "hex": request["hex"] + "00" * _BYTES}, wanted


def _with(case: Case, request: Json, value: object) -> Json:
    return {**request, "fields": {**request["fields"], case.field: value}}


def _number(case: Case, request: Json, wanted: Json) -> _Changed:
    return _with(case, request, 10**30), wanted


def _nested(case: Case, request: Json, wanted: Json) -> _Changed:
    value: list[Any] = []
    for _ in range(100):
        value = [value]
    return _with(case, request, value), wanted


# name -> (what it is made of, how, what it looks at)
_CHANGES = {
    "stream.repeated": ("stream", _repeated, f"a message {_MANY:,} times in one chunk"),
    "stream.bytes": ("stream", _bytes, f"a message {_MANY // 4} times, byte by byte"),
    "stream.empty": ("stream", _empty, f"{2 * _MANY:,} chunks of nothing around a message"),
    "decode": ("trailing", _trailing, f"{_BYTES:,} bytes behind a message"),
    "number": ("above", _number, "a number of 31 digits for a field"),
    "nested": ("text", _nested, "a hundred arrays in each other for a field"),
}
