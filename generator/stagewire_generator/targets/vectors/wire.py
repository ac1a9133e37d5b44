"""The bytes of a field's value, and of all fields of a layout; values as JSON has them."""

from __future__ import annotations

from collections.abc import Iterable

from stagewire_generator.model import Field, Json

__all__ = ["Value", "fields_from_bytes", "fields_to_bytes", "greatest_but"]

Value = int | str
"""An integer; text; bytes in hex."""


def fields_to_bytes(fields: Iterable[Field], values: Json) -> bytes:
    """Return the bytes of fields that follow one another; their formats hold the values."""
    return b"".join([_to_bytes(field, values[field.name]) for field in fields])


def fields_from_bytes(fields: Iterable[Field], raw: bytes) -> Json:
    """Return the values of fields that follow one another."""
    values: Json = {}
    at = 0
    for field in fields:
        values[field.name] = _from_bytes(field, raw[at : at + field.format.size])
        at += field.format.size
    return values


def greatest_but(taken: Iterable[int | None], size: int) -> int | None:
    """Return the greatest number of ``size`` bytes that is not taken; None when all are."""
    known = set(taken)
    return next((n for n in range((1 << 8 * size) - 1, -1, -1) if n not in known), None)


def _to_bytes(field: Field, value: Value) -> bytes:
    format = field.format
    if isinstance(value, int):
        return value.to_bytes(format.size, "little", signed=format.signed)
    if format.kind == "bytes":
        return bytes.fromhex(value)
    return value.encode("latin-1").ljust(format.size, b"\0")


def _from_bytes(field: Field, raw: bytes) -> Value:
    format = field.format
    if format.kind == "integer":
        return int.from_bytes(raw, "little", signed=format.signed)
    return raw.hex() if format.kind == "bytes" else raw.decode("latin-1").rstrip("\0")
