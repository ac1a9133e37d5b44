"""Requests that are none, whatever the protocol."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from stagewire_generator.targets.vectors.case import Case
from stagewire_generator.targets.vectors.subject import make_case

__all__ = ["bad_requests"]

_REQUESTS: dict[str, tuple[str, dict[str, Any], str]] = {
    "operation.missing": ("no operation", {}, "bad_request"),
    "operation.number": ("an operation that is a number", {"op": 1}, "bad_request"),
    "operation.unknown": ("an operation that there is not", {"op": "fly"}, "unsupported"),
    "decode.no_bytes": ("no bytes", {"op": "decode"}, "bad_request"),
    "decode.half": ("half a byte", {"op": "decode", "hex": "0"}, "bad_request"),
    "decode.letters": ("what is no hex", {"op": "decode", "hex": "zz"}, "bad_request"),
    "decode.blank": ("blanks between the bytes", {"op": "decode", "hex": "00 00"}, "bad_request"),
    "decode.number": ("a number and no bytes", {"op": "decode", "hex": 0}, "bad_request"),
    "decode.unknown": ("a key that it has not", {"op": "decode", "hex": "", "baud": 1}, "bad_request"),
    "encode.no_message": ("no message", {"op": "encode", "fields": {}}, "bad_request"),
    "encode.number": ("a message that is a number", {"op": "encode", "message": 1}, "bad_request"),
    "encode.form": (
        "a form that is a number", {"op": "encode", "message": "NO_SUCH_MESSAGE", "form": 1}, "bad_request"
    ),
    "encode.fields": (
        "fields in a list", {"op": "encode", "message": "NO_SUCH_MESSAGE", "fields": []}, "bad_request"
    ),
    "encode.extra": (
        "half a byte beyond the layout", {"op": "encode", "message": "NO_SUCH_MESSAGE", "extra": "0"},
        "bad_request",
    ),
    "encode.unknown": (
        "a key that it has not", {"op": "encode", "message": "NO_SUCH_MESSAGE", "baud": 1}, "bad_request"
    ),
    "stream.no_chunks": ("no chunks", {"op": "stream"}, "bad_request"),
    "stream.text": ("chunks that are a text", {"op": "stream", "chunks": ""}, "bad_request"),
    "stream.number": ("a chunk that is a number", {"op": "stream", "chunks": [0]}, "bad_request"),
    "stream.half": ("half a byte", {"op": "stream", "chunks": ["00", "0"]}, "bad_request"),
    "stream.end": ("an end that no line has", {"op": "stream", "chunks": [], "end": "left"}, "bad_request"),
}  # fmt: skip


def bad_requests() -> Iterator[Case]:
    """Yield requests that a testee refuses before it looks at any message."""
    for name, (about, request, code) in _REQUESTS.items():
        yield make_case(f"request/{name}", about, request, code)
