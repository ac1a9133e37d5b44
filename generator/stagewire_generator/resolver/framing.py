"""The framing: what it refers to is found, so that whoever reads it needs no other table."""

from __future__ import annotations

from stagewire_generator.model import Json
from stagewire_generator.resolver.tables import Tables

__all__ = ["resolve_framing"]

_NUMBERS = ("length", "address", "id", "check")  # parts of a packet that have a format


def resolve_framing(tables: Tables) -> Json:
    """Return the framing, with the ``size`` in bytes beside every name of a format, and no default.

    Only packets name formats. Where one is unknown, a diagnostic says so and the size is left out.
    """
    framing: Json = dict(tables.head.data["framing"])
    if framing["kind"] != "packet":
        return framing
    for part in _NUMBERS:
        if part in framing:
            place = tables.head.place("framing", part)
            format = tables.format(framing[part]["format"], place)
            size = {} if format is None else {"size": format.size}
            framing[part] = {**framing[part], **size}
    if framing.get("check", {}).get("method") == "sum":
        framing["check"] = {"complement": "none", **framing["check"]}
    return framing
