"""Cases from the vectors of a protocol, and its streams once more, cut at every place."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import Any

from stagewire.protocols import Protocol
from stagewire_conformance.registry import Registry, registry_of
from stagewire_conformance.testees.case import Case, Step, ask

__all__ = ["OPERATIONS", "cuts", "stated"]

Json = Mapping[str, Any]

OPERATIONS = ("decode", "encode", "stream")


def stated(protocol: Protocol) -> Iterator[Case]:
    """Yield the cases that the vectors hold ready."""
    registry = registry_of(protocol)
    for case in protocol.vectors()["cases"]:
        request = {"protocol": protocol.name, **case["request"]}
        message, field = _subject(registry, case["id"])
        yield Case(
            id=f"{protocol.name}/{case['id']}",
            group=f"{protocol.name}/cases",
            steps=(ask(request, case["answer"]),),
            about=case.get("about", ""),
            protocol=protocol.name,
            operations=_operations(request),
            message=message,
            field=field,
        )


def cuts(protocol: Protocol) -> Iterator[Case]:
    """Yield a case for each stream of the vectors: whole, in two at every place, and byte by byte."""
    seen = set()
    for case in protocol.vectors()["cases"]:
        request = case["request"]
        if request.get("op") != "stream" or not case["answer"]["ok"]:
            continue
        raw = bytes.fromhex("".join(request["chunks"]))
        rest = {"protocol": protocol.name, **request, "chunks": []}
        key = (raw, json.dumps(rest, sort_keys=True))
        if len(raw) < 2 or key in seen:
            continue
        seen.add(key)
        message, field = _subject(registry_of(protocol), case["id"])
        yield Case(
            id=f"{protocol.name}/cut/{case['id']}",
            group=f"{protocol.name}/cut",
            steps=tuple(_cut(raw, rest, case["answer"])),
            about=f"{len(raw)} bytes, whole, in two at every place, and byte by byte",
            protocol=protocol.name,
            operations=frozenset({"stream"}),
            message=message,
            field=field,
        )


def _cut(raw: bytes, rest: Json, wanted: Json) -> Iterator[Step]:
    yield ask({**rest, "chunks": [raw.hex()]}, wanted)
    for at in range(1, len(raw)):
        yield ask({**rest, "chunks": [raw[:at].hex(), raw[at:].hex()]}, wanted)
    yield ask({**rest, "chunks": [f"{byte:02x}" for byte in raw]}, wanted)


def _operations(request: Json) -> frozenset[str]:
    """Return what a testee needs to be asked this; nothing where no operation is meant at all."""
    op = request.get("op")
    return frozenset({op} if op in OPERATIONS else ())


def _subject(registry: Registry, id: str) -> tuple[str, str]:
    """Return message and field of a case, as its id names them; each may be empty."""
    message, *rest = id.split("/")
    if message not in registry.messages:
        return "", ""
    what = rest[-1].partition("=")[0].split(".")[0]
    return message, what if what in registry.fields(message, rest[0]) else ""
