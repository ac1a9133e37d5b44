"""Requests for testees: all layouts, damaged streams, and lines that are almost JSON."""

from __future__ import annotations

import json
from collections.abc import Iterator
from random import Random

from testees import Json

from stagewire.protocols import (
    Command,
    CommandProtocol,
    CountedMessage,
    Message,
    Protocol,
    Reply,
    UndecidedMessage,
    UndocumentedMessage,
)
from stagewire_conformance.registry import registry_of

_PIECES = ('"', "\\", "{", "}", "[", "]", ":", ",", " ", "\t", "\x00", "\x7f", "0", "1", "-", ".", "e",
           "E", "+", "null", "true", "false", "NaN", "\\u00e9", "\\ud83d", "\\ude00", "\\u0000", "\\x",
           "é", "😀", "1.0", "1e5", "01", '"a":1', '"a"', "-0")  # fmt: skip


def _integer(rng: Random, field: Json) -> int:
    """Return a value of a field: a limit, a value next to a limit, or a random one."""
    low, high = field["minimum"], field["maximum"]
    near = [value for value in (low, low + 1, -1, 0, 1, high - 1, high) if low <= value <= high]
    return rng.choice(near) if rng.random() < 0.7 else rng.randint(low, high)


def _value(rng: Random, field: Json) -> int | str:
    """Return a value of a field that is not an array."""
    size = field["size"]
    if field["kind"] == "integer":
        return _integer(rng, field)
    length = rng.choice((0, 1, size))
    if field["kind"] == "text":
        text = "".join(chr(rng.randrange(0x100)) for _ in range(length))
        return text.rstrip("\0")
    return rng.randbytes(size).hex()


def _fields(rng: Random, protocol: Protocol, cls: type[Message]) -> Json:
    layout = cls.layout
    known = registry_of(protocol).fields(layout.message, layout.form)
    fields: Json = {}
    for name in layout.fields:
        if name not in layout.optional or rng.random() < 0.7:
            byte = {"kind": "integer", "size": 1, "minimum": 0, "maximum": 0xFF}
            field = known.get(name, byte)
            fields[name] = _array(rng, field, fields) if "array" in field else _value(rng, field)
    return fields


def _array(rng: Random, field: Json, fields: Json) -> list[int]:
    """Return the integers of an array, as many as the fields before it state."""
    array = field["array"]
    masks = [column["each"] for column in array["columns"]]
    width = sum(fields[mask].bit_count() if mask else 1 for mask in masks)
    return [_integer(rng, field) for _ in range(fields[array["rows"]] * width)]


def _shown(protocol: Protocol, cls: type[Message], fields: Json) -> Json:
    """Return the fields that a decoder returns: with optional fields, without unused ones."""
    layout = cls.layout
    known = registry_of(protocol).fields(layout.message, layout.form)
    shown = {}
    for name in layout.fields:
        field = known.get(name, {"kind": "integer", "size": 1})
        empty: Json = {"integer": 0, "text": "", "bytes": "00" * field["size"], "array": []}
        value = fields.get(name, layout.constants.get(name, empty[field["kind"]]))
        if name not in layout.unnamed or value or layout.constants.get(name):
            shown[name] = value
    return shown


def encodings(rng: Random, protocol: Protocol, each: int) -> Iterator[tuple[Json, Json]]:
    """Yield requests that encode every layout, and the answer of a decoder, without ``event``."""
    for cls in protocol.messages:
        layout = cls.layout
        if issubclass(cls, (UndecidedMessage, UndocumentedMessage)):
            continue  # made from bytes, which the cases and streams test
        for _ in range(each):
            fields = _fields(rng, protocol, cls)
            request: Json = {"message": layout.message, "form": layout.form, "fields": fields}
            said = {**request, "fields": _shown(protocol, cls, fields)}
            if isinstance(protocol, CommandProtocol):
                more: Json = {"kind": layout.kind}
                if issubclass(cls, Command):
                    more["axis"] = rng.choice([0, 1, 24, 0x39, 0x3B, 0xFE])
                    request["allow_dummy"] = layout.dummy
            else:
                more = {"dest": rng.randrange(0x80), "source": rng.randrange(0x100)}
            most = _most_extra(protocol, cls)
            if most and rng.random() < 0.2:
                more["extra"] = bytes(
                    rng.randrange(0x3A) for _ in range(rng.randint(1, most))
                ).hex()
            yield request | more, said | more


def _most_extra(protocol: Protocol, cls: type[Message]) -> int:
    """Return how many bytes may follow a layout, which then have no other meaning."""
    layout = cls.layout
    if not layout.length or issubclass(cls, (Reply, CountedMessage)):
        return 0
    others = {
        each.layout.length for each in protocol.messages if each.layout.message == layout.message
    }
    return min([9, *(length - layout.length - 1 for length in others if length > layout.length)])


def decoding(protocol: Protocol, said: Json, raw: str) -> Json:
    """Return the request that decodes bytes, with the keys that depend on the request of the host."""
    request: Json = {"op": "decode", "hex": raw}
    if said["form"] == "reply":
        return request | {"direction": "reply", "command": said["message"]}
    layout = registry_of(protocol).layout(said["message"], said["form"])
    if layout and layout["when"]:
        request["context"] = layout["when"]
    return request


def streams(rng: Random, protocol: Protocol, frames: list[bytes], count: int) -> Iterator[Json]:
    """Yield requests with streams of the frames, complete and damaged, in chunks of all sizes."""
    asked = [cls.layout.message for cls in protocol.messages if issubclass(cls, Command)]
    for _ in range(count):
        stream = b"".join(_damaged(rng, rng.choice(frames)) for _ in range(rng.randint(0, 8)))
        request: Json = {"op": "stream", "chunks": [chunk.hex() for chunk in _cut(rng, stream)]}
        if isinstance(protocol, CommandProtocol):
            if rng.random() < 0.3:
                request |= {"end": "host", "command": rng.choice(asked)}
        else:
            request["end"] = rng.choice(("host", "device", "none"))
            if rng.random() < 0.5:
                request["context"] = {"status": rng.choice(("dc", "stepper"))}
        yield request


def _damaged(rng: Random, frame: bytes) -> bytes:
    made = bytearray(frame)
    at = rng.randrange(len(made))
    damage = rng.randrange(8)
    if damage == 0:
        made[at] ^= 1 << rng.randrange(8)
    elif damage == 1:
        del made[at : at + rng.randint(1, 3)]
    elif damage == 2:
        made[at:at] = rng.randbytes(rng.randint(1, 3))
    elif damage == 3:
        made[at] = rng.choice((0x00, 0x01, 0x3A, 0x80, 0xFF))
    return bytes(made)


def _cut(rng: Random, stream: bytes) -> Iterator[bytes]:
    longest = rng.choice((1, 2, 7, 50, 1000))
    at = 0
    while at < len(stream):
        size = rng.randint(0, longest)
        yield stream[at : at + size]
        at += size


def broken_lines(rng: Random, requests: list[Json], count: int) -> Iterator[bytes]:
    """Yield damaged requests, and values that may be JSON."""
    for _ in range(count):
        line = json.dumps(rng.choice(requests), ensure_ascii=rng.random() < 0.5)
        value = "".join(rng.choices(_PIECES, k=rng.randint(1, 6)))
        if rng.random() < 0.5:
            at = rng.randint(0, len(line))
            line = line[:at] + value + line[at + rng.choice((0, 0, 1, 5)) :]
        else:
            line = f'{{"id":1,"op":"hello","x":{value}}}'
        raw = bytearray(line.encode())
        if rng.random() < 0.2:
            raw[rng.randrange(len(raw))] = rng.randrange(0x100)
        yield bytes(raw).replace(b"\n", b" ")
