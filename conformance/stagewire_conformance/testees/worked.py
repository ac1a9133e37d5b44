"""Cases from the worked examples of a document, and from captures: whatever of them is bytes.

What they say of units, numbers and prose, a testee cannot be asked; ``stagewire conformance examples`` holds
our own codec to it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from stagewire.protocols import Protocol
from stagewire_conformance.codec import codec_of
from stagewire_conformance.frames import wanted_of
from stagewire_conformance.hexes import octets
from stagewire_conformance.keyboard import keys_of
from stagewire_conformance.registry import registry_of
from stagewire_conformance.testees.case import Case, Step, ask

__all__ = ["worked"]

Json = Mapping[str, Any]


def worked(protocol: Protocol) -> Iterator[Case]:
    """Yield the cases of the examples and captures of a protocol, in the order of its vectors.

    What is right encodes to its bytes, and they decode to it. Bytes that the document misprints decode to
    what they really say, or are refused.
    """
    vectors = protocol.vectors()
    for kind in ("examples", "captures"):
        for entry in vectors[kind]:
            for op, step in _steps(protocol, entry):
                message = entry.get("message", "")
                yield Case(
                    id=f"{protocol.name}/{kind}/{entry['id']}/{op}",
                    group=f"{protocol.name}/{kind}",
                    steps=(step,),
                    about=_about(protocol, entry),
                    protocol=protocol.name,
                    operations=frozenset({op.partition(".")[0]}),
                    message=message if message in registry_of(protocol).messages else "",
                )


def _steps(protocol: Protocol, entry: Json) -> Iterator[tuple[str, Step]]:
    """Yield what can be asked of an entry: the operation, and behind a dot what it is done to."""
    if "form" not in entry:
        if "rejected" in entry:
            yield "decode", _decode(protocol, octets(entry, "printed"), {}, _refused(entry))
        return
    wanted = wanted_of(protocol, entry)
    true = _true_bytes(entry)
    if true is not None:
        yield "encode", _encode(protocol, wanted, true)
        yield "decode", _decode(protocol, true, wanted, _said(protocol, wanted))
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
    """Return the bytes of what an entry states; None where it is text of which bytes are missing."""
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
    """Return the answer of a decoder: what is stated, and what is reserved as it is when nobody says it."""
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
    """Return what an entry shows, and where it stands."""
    title = entry.get("title") or entry.get("note") or entry.get("says") or ""
    if "page" not in entry:
        return f"{title or entry['kind']}: {entry['reference']}"
    where = registry_of(protocol).where((entry["page"],), entry.get("overlay", ""))
    return f"{title} ({where})"
