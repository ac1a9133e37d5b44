"""The Python testee: it reads one JSON object per line, and answers each in order.

An implementation in any language becomes testable if it supports this protocol on its standard input and
output; ``stagewire testee`` is the Python one. Requests and answers have a JSON Schema,
``spec/schema/testee.schema.json``. A line that violates it is answered with ``bad_request``. A value that the
schema allows but the registry does not is answered with the matching code.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any, BinaryIO, NoReturn

import stagewire
from stagewire.errors import CodecError, UnknownProtocolError
from stagewire.protocols import available_protocols, load_protocol
from stagewire_conformance.answers import RefusalError, refusal
from stagewire_conformance.framings import ENDS, KEYS, Codec, codec_of
from stagewire_conformance.notation import from_hex

Json = dict[str, Any]

TESTEE = 1
IMPLEMENTATION = "stagewire-python"
MAXIMUM_LINE = 16 * 1024 * 1024
"""The maximum length of a line in bytes. A longer line is refused."""


def serve(lines: Iterable[bytes], write: Callable[[str], None]) -> None:
    """Answer every line, in order. ``write`` is called with each answer, including its line end."""
    testee = Testee()
    for line in lines:
        write(json.dumps(testee.answer(line), allow_nan=False, separators=(",", ":")) + "\n")


def lines_of(stream: BinaryIO) -> Iterator[bytes]:
    """Yield the lines of a stream, truncated to :data:`MAXIMUM_LINE`."""
    while line := stream.readline(MAXIMUM_LINE + 1):
        rest = line
        while len(rest) > MAXIMUM_LINE and not rest.endswith(b"\n"):
            rest = stream.readline(MAXIMUM_LINE + 1)
        yield line


class Testee:
    """Answers requests. It keeps no state between lines except loaded protocols."""

    __test__ = False  # pytest must not collect it because of its name

    def __init__(self) -> None:
        self._codecs: dict[str, Codec] = {}

    def answer(self, line: bytes) -> Json:
        """Return the answer to one line. Never raises because of its contents."""
        id: int | str | None = None
        try:
            request = _parse(line)
            id = _id(request)
            return {"id": id, "ok": True} | _operation(self, request)(self, request)
        except (RefusalError, CodecError) as error:
            return {"id": id} | refusal(error)
        except RecursionError:
            return {"id": id} | refusal(RefusalError("bad_request", "nested too deeply"))
        except Exception as error:
            # A testee must survive any line. Tests ensure that no line leads here.
            text = f"internal error: {type(error).__name__}: {error}"
            return {"id": id} | refusal(RefusalError("unsupported", text))

    def hello(self, request: Json) -> Json:
        """Return its name, version, protocols and operations."""
        return {
            "testee": TESTEE,
            "implementation": IMPLEMENTATION,
            "version": stagewire.__version__,
            "protocols": available_protocols(),
            "operations": list(OPERATIONS),
        }

    def decode(self, request: Json) -> Json:
        """Decode one frame."""
        return self._codec(request["protocol"]).decode(_bytes(request["hex"]), request)

    def encode(self, request: Json) -> Json:
        """Encode one frame."""
        for key in ("data", "extra"):
            if request.get(key) is not None:
                _bytes(request[key])
        return {"hex": self._codec(request["protocol"]).encode(request).hex()}

    def stream(self, request: Json) -> Json:
        """Split a stream into events."""
        end = request.get("end", "none")
        if end not in ENDS:
            _bad(f"end must be one of {', '.join(ENDS)}, not {end!r}")
        chunks = request["chunks"]
        if not all(isinstance(chunk, str) for chunk in chunks):
            _bad("chunks must be a list of strings with bytes in hex")
        raw = [_bytes(chunk) for chunk in chunks]
        return self._codec(request["protocol"]).stream(raw, request)

    def keys(self, op: str, protocol: object) -> Mapping[str, type]:
        """Return the optional keys of a request, which depend on the protocol.

        For an unknown protocol, return the keys of all protocols.
        """
        if op not in KEYS:
            return {}
        try:
            return self._codec(protocol).keys_of(op)
        except RefusalError:
            return KEYS[op]

    def _codec(self, name: object) -> Codec:
        if not isinstance(name, str):
            raise RefusalError("unsupported", f"protocol must be a name, not {_short(name)}")
        if name not in self._codecs:
            try:
                self._codecs[name] = codec_of(load_protocol(name))
            except UnknownProtocolError as error:
                raise RefusalError("unsupported", str(error)) from None
        return self._codecs[name]


_Operation = Callable[[Testee, Json], Json]

# operation -> (method, required keys in addition to "id" and "op")
_PROTOCOL: dict[str, type] = {"protocol": str}
_OPERATIONS: dict[str, tuple[_Operation, dict[str, type]]] = {
    "hello": (Testee.hello, {}),
    "decode": (Testee.decode, {**_PROTOCOL, "hex": str}),
    "encode": (Testee.encode, {**_PROTOCOL, "message": str}),
    "stream": (Testee.stream, {**_PROTOCOL, "chunks": list}),
}
OPERATIONS = tuple(_OPERATIONS)
_NULLABLE = {"data"}  # null for an undocumented message that consists only of a header


def _operation(testee: Testee, request: Json) -> _Operation:
    """Return the operation of a request after checking the request's shape."""
    op = request.get("op")
    if not isinstance(op, str):
        _bad("op must be a string")
    if op not in _OPERATIONS:
        raise RefusalError(
            "unsupported", f"unknown operation {op!r} (choose one of {', '.join(_OPERATIONS)})"
        )
    operation, required = _OPERATIONS[op]
    for key in required:
        if key not in request:
            _bad(f"{op} requires {key}")
    optional = testee.keys(op, request.get("protocol"))
    types: Mapping[str, type] = {"id": object, "op": str, **required, **optional}
    for key, value in request.items():
        if key not in types:
            _bad(f"unknown key {key!r} for {op} (choose from {', '.join(types)})")
        if not isinstance(value, types[key]) and not (value is None and key in _NULLABLE):
            _bad(f"{key} must be {_JSON_NAMES[types[key]]}, not {_short(value)}")
    for key, value in request.get("context", {}).items():
        if not isinstance(value, str):
            _bad(f"context {key!r} must be a string, not {_short(value)}")
    return operation


_JSON_NAMES: dict[type, str] = {
    str: "a string", dict: "an object", list: "a list", bool: "true or false"
}  # fmt: skip


def _parse(line: bytes) -> Json:
    if len(line) > MAXIMUM_LINE:
        _bad(f"the line is longer than {MAXIMUM_LINE} bytes")
    try:
        request = json.loads(
            line.decode("utf-8"), parse_constant=_constant, object_pairs_hook=_object
        )
    except UnicodeDecodeError as error:
        _bad(f"not UTF-8: byte {error.start} of the line")
    except ValueError as error:  # not JSON, or an integer with thousands of digits
        _bad(f"not JSON: {error}")
    if not isinstance(request, dict):
        _bad(f"a request must be a JSON object, not {_short(request)}")
    return request


def _constant(name: str) -> NoReturn:
    raise ValueError(f"{name} is not a JSON number")


def _object(pairs: list[tuple[str, Any]]) -> Json:
    made = dict(pairs)
    if len(made) < len(pairs):
        raise ValueError("duplicate key in an object")
    return made


def _id(request: Json) -> int | str:
    id = request.get("id")
    if isinstance(id, bool) or not isinstance(id, (int, str)):
        _bad("id must be an integer or a string")
    return id


def _bytes(text: str) -> bytes:
    try:
        return from_hex(text)
    except ValueError as error:
        _bad(str(error))


def _bad(detail: str) -> NoReturn:
    raise RefusalError("bad_request", detail)


def _short(value: Any) -> str:
    if isinstance(value, (dict, list)):
        return _JSON_NAMES[type(value)]
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:60]}…"
