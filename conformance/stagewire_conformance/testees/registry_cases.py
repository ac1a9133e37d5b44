"""Cases from the registry: vectors, streams, oversized requests, worked examples and captures.

Each stream is also split at every byte. Only worked examples with bytes become cases, because a testee does
not have units, numbers and prose; ``stagewire conformance examples`` compares our own codec with those.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from stagewire.protocols import Protocol
from stagewire_conformance.frames import wanted_of
from stagewire_conformance.framings import codec_of
from stagewire_conformance.keyboard import keys_of
from stagewire_conformance.notation import octets
from stagewire_conformance.registry import Registry, registry_of
from stagewire_conformance.testees.case import Case, Step, ask

Json = Mapping[str, Any]

OPERATIONS = ("decode", "encode", "stream")


def stated_cases(protocol: Protocol) -> Iterator[Case]:
    """Yield the cases that are ready in the vectors."""
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
            needs=_needs(protocol, message, request, case["answer"]),
            field=field,
        )


def _needs(protocol: Protocol, message: str, request: Json, answer: Json) -> frozenset[str] | None:
    """Return the messages that a testee has to implement for a case; None for all.

    A stream of several messages needs all of them, including those that only begin a damaged frame. A context
    may be known only from other messages than the tested one.
    """
    if message:
        layouts = registry_of(protocol).messages[message]["layouts"]
        own = {key for layout in layouts for key in layout.get("when") or ()}
        foreign = answer["ok"] and not own.issuperset(request.get("context", ()))
        return None if foreign else frozenset({message})
    if request.get("op") != "stream":
        return frozenset()
    codec = codec_of(protocol)
    pending = [{"hex": answer["pending"]}] if answer.get("pending") else []
    pieces = [*answer.get("events", ()), *pending]
    found = set()
    for piece in pieces:
        name = piece.get("message") or codec.begun(bytes.fromhex(piece["hex"]))
        if name is None:
            return None
        found.add(name)
    return frozenset(found - {""})


_LONG = 1_000  # bytes of a stream that is still split at every position
_END = 128
_STRIDE = 64


def cut_cases(protocol: Protocol) -> Iterator[Case]:
    """Yield a case for each stream of the vectors: whole, split in two, and byte by byte."""
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
            about=f"{len(raw)} bytes: whole, split in two at {_which(raw)} positions, and byte by byte",
            protocol=protocol.name,
            operations=frozenset({"stream"}),
            message=message,
            needs=_needs(protocol, message, request, case["answer"]),
            field=field,
        )


def _cut(raw: bytes, rest: Json, wanted: Json) -> Iterator[Step]:
    yield ask({**rest, "chunks": [raw.hex()]}, wanted)
    for at in _splits(raw):
        yield ask({**rest, "chunks": [raw[:at].hex(), raw[at:].hex()]}, wanted)
    yield ask({**rest, "chunks": [f"{byte:02x}" for byte in raw]}, wanted)


def _splits(raw: bytes) -> Iterator[int]:
    """Yield the positions to split a stream at; not all of a long one, whose middle is one array."""
    for at in range(1, len(raw)):
        if len(raw) <= _LONG or at <= _END or at >= len(raw) - _END or at % _STRIDE == 0:
            yield at


def _which(raw: bytes) -> str:
    if len(raw) <= _LONG:
        return "all"
    return f"the first and last {_END} and every {_STRIDE}th of the other"


def _operations(request: Json) -> frozenset[str]:
    """Return the operations that a request needs; empty if it has no valid operation."""
    op = request.get("op")
    return frozenset({op} if op in OPERATIONS else ())


def _subject(registry: Registry, id: str) -> tuple[str, str]:
    """Return message and field of a case from its id; each may be empty."""
    message, *rest = id.split("/")
    if message not in registry.messages:
        return "", ""
    what = rest[-1].partition("=")[0].split(".")[0]
    return message, what if what in registry.fields(message, rest[0]) else ""


_MANY = 2_000
_BYTES = 100_000


def large_cases(protocol: Protocol, can: Callable[[Case], bool]) -> Iterator[Case]:
    """Yield the large requests of a protocol, if its vectors contain the cases to make them from.

    :param can: whether the testee supports a case; such cases are preferred.
    """
    stated = sorted(stated_cases(protocol), key=lambda case: not can(case))
    found = {name: next(filter(test, stated), None) for name, test in _MADE_OF.items()}
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
            needs=case.needs,
            field=case.field,
        )


def _is_stream(case: Case) -> bool:
    """Return whether a case is a stream of a single message, at an end that can receive it repeatedly."""
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


# name -> (case to start from, function, description)
_CHANGES = {
    "stream.repeated": ("stream", _repeated, f"a message {_MANY:,} times in one chunk"),
    "stream.bytes": ("stream", _bytes, f"a message {_MANY // 4} times, byte by byte"),
    "stream.empty": ("stream", _empty, f"{2 * _MANY:,} empty chunks around a message"),
    "decode": ("trailing", _trailing, f"{_BYTES:,} bytes after a message"),
    "number": ("above", _number, "a number with 31 digits as a field"),
    "nested": ("text", _nested, "a hundred nested arrays as a field"),
}


def example_cases(protocol: Protocol) -> Iterator[Case]:
    """Yield the cases of the examples and captures of a protocol, in the order of its vectors.

    Correct messages must encode to their bytes, and the bytes must decode to them. Misprinted bytes must
    decode to what they actually mean, or be refused.
    """
    vectors = protocol.vectors()
    for kind in ("examples", "captures"):
        for entry in vectors[kind]:
            for op, step in _steps(protocol, entry):
                message = entry.get("message", "")
                message = message if message in registry_of(protocol).messages else ""
                yield Case(
                    id=f"{protocol.name}/{kind}/{entry['id']}/{op}",
                    group=f"{protocol.name}/{kind}",
                    steps=(step,),
                    about=_about(protocol, entry),
                    protocol=protocol.name,
                    operations=frozenset({op.partition(".")[0]}),
                    message=message,
                    needs=frozenset({message} - {""}),
                )


def _steps(protocol: Protocol, entry: Json) -> Iterator[tuple[str, Step]]:
    """Yield the steps of an entry, each with its operation and, after a dot, its subject."""
    if "form" not in entry:
        if "rejected" in entry:
            yield "decode", _decode(protocol, octets(entry, "printed"), {}, _refused(entry))
        return
    wanted = wanted_of(protocol, entry)
    true = _true_bytes(entry)
    if true is not None:
        yield "encode", _encode(protocol, wanted, true)
        yield "decode", _decode(protocol, true, wanted, _said(protocol, wanted))
    if entry["verdict"] == "tolerated":
        printed = octets(entry, "printed")
        yield "decode.printed", _decode(protocol, printed, wanted, _said(protocol, wanted))
    printed_is = entry if "rejected" in entry else entry.get("printed_is", {})
    if "rejected" in printed_is:
        answer = _refused(printed_is)
        yield "decode.printed", _decode(protocol, octets(entry, "printed"), wanted, answer)
    elif printed_is:
        message = {key: entry[key] for key in ("message", "form")}
        said = wanted_of(protocol, {**message, **printed_is["decodes"]})
        answer = _said(protocol, said)
        yield "decode.printed", _decode(protocol, octets(entry, "printed"), said, answer)


def _true_bytes(entry: Json) -> bytes | None:
    """Return the correct bytes of an entry; None if it is text with missing bytes."""
    if "encoded" in entry:
        return octets(entry, "encoded")
    if "printed" in entry:
        return None if "rejected" in entry else octets(entry, "printed")
    if "typed" in entry:
        return bytes(key.byte for key in keys_of(entry.get("corrected", entry["typed"])))
    return None


def _encode(protocol: Protocol, wanted: Json, raw: bytes) -> Step:
    request = {"op": "encode", "protocol": protocol.name, **wanted}
    return ask(request, {"ok": True, "hex": raw.hex()})


def _decode(protocol: Protocol, raw: bytes, wanted: Json, answer: Json) -> Step:
    reading = codec_of(protocol).reading(wanted) if "message" in wanted else {}
    request = {"op": "decode", "protocol": protocol.name, "hex": raw.hex(), **reading}
    return ask(request, answer)


def _refused(entry: Json) -> Json:
    return {"ok": False, "error": entry["rejected"]}


def _said(protocol: Protocol, wanted: Json) -> Json:
    """Return the expected answer of a decoder: stated values, and defaults for reserved fields."""
    layout = protocol.message_class(wanted["message"], wanted.get("form")).layout
    known = registry_of(protocol).fields(layout.message, layout.form)
    fields = dict(wanted["fields"])
    for name in layout.optional:
        silent = layout.constants.get(name)
        if name not in fields and name in known and (silent or name not in layout.unnamed):
            empty = {"integer": 0, "text": "", "bytes": "00" * known[name]["size"]}
            fields[name] = empty[known[name]["kind"]] if silent is None else silent
    kind = {"kind": layout.kind} if layout.form in ("request", "reply") else {}
    said = {key: value for key, value in wanted.items() if key != "context"}
    return {"ok": True, **said, **kind, "form": wanted.get("form", layout.form), "fields": fields}


def _about(protocol: Protocol, entry: Json) -> str:
    """Return the subject and the page of an entry."""
    title = entry.get("title") or entry.get("note") or entry.get("says") or ""
    if "page" not in entry:
        return f"{title or entry['kind']}: {entry['reference']}"
    where = registry_of(protocol).where((entry["page"],), entry.get("overlay", ""))
    return f"{title} ({where})"
