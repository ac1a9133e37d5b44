"""What stands at a place of the bytes of a message: a field of its layout, or a part of its frame."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from stagewire.errors import CodecError
from stagewire.protocols import (
    HEADER_SIZE,
    SLOTS,
    CommandProtocol,
    Layout,
    PacketProtocol,
    Protocol,
)
from stagewire_conformance.registry import registry_of

__all__ = ["name_at"]

_Part = tuple[str, range]


def name_at(protocol: Protocol, request: Mapping[str, Any], raw: bytes, at: int) -> str:
    """Return the name of what stands at a place of an encoded message.

    :param request: what was to be encoded.
    :param raw: the right bytes.
    :param at: counted from zero.
    """
    try:
        layout = protocol.message_class(request["message"], request.get("form")).layout
    except CodecError:  # the context decides on the layout
        return "frame"
    parts = [*_fields(protocol, layout), *_frame(protocol, layout, raw)]
    return next((name for name, place in parts if at in place), "extra")


def _fields(protocol: Protocol, layout: Layout) -> Iterator[_Part]:
    start = HEADER_SIZE
    if isinstance(protocol, CommandProtocol):
        start = 0 if layout.form == "reply" else SLOTS
    elif isinstance(protocol, PacketProtocol):
        start = protocol.shape.place("payload", 0).start
    stated = registry_of(protocol).layout(layout.message, layout.form) or {}
    for key in ("param1", "param2"):  # counted from the beginning of the frame
        if stated.get(key):
            yield stated[key].get("name") or key, _place(stated[key]["offset"], 1)
    for field in stated.get("fields", ()):
        yield field["name"], _place(start + field["offset"], field["size"])


def _frame(protocol: Protocol, layout: Layout, raw: bytes) -> Iterator[_Part]:
    """Yield the parts of a frame that are no fields."""
    if isinstance(protocol, PacketProtocol):
        payload = len(raw) - protocol.shape.least
        for part in protocol.shape.order:
            if part != "payload":
                yield part, protocol.shape.place(part, payload)
    elif not isinstance(protocol, CommandProtocol):
        middle = [("param1", 1), ("param2", 1)] if layout.form == "header" else [("length", 2)]
        yield from _in_a_row(("id", 2), *middle, ("dest", 1), ("source", 1))
    elif layout.kind == "setup":
        yield from _in_a_row(("prefix", 1), ("command", 1))
    elif layout.form != "reply":
        yield "terminator", _place(len(raw) - 1, 1)
        yield from _in_a_row(("axis", 1), ("command", 1), ("size", 1))


def _in_a_row(*parts: tuple[str, int]) -> Iterator[_Part]:
    at = 0
    for name, size in parts:
        yield name, _place(at, size)
        at += size


def _place(start: int, size: int) -> range:
    return range(start, start + size)
