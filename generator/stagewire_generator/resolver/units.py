"""Units, and the aliases of those that are newer than the document."""

from __future__ import annotations

from collections.abc import Mapping

from stagewire_generator.model import Json
from stagewire_generator.strict_yaml import Document

__all__ = ["resolve_units"]

_OF_ALIASES = {"like": "like", "note": "title", "overlay": "overlay"}
"""Key of a prefix -> key of the alias that it makes in short."""


def resolve_units(files: Mapping[str, list[Document]]) -> Json:
    """Return the data about units, in which every name that a prefix leads to is a unit or an alias.

    A prefix may make an alias in short, by ``like``, or name a unit of which no more is known. A unit takes
    the place of an alias of its name: what an overlay describes is no longer newer than the document.
    """
    units: Json = files["units"][0].data if files.get("units") else {}
    if not units.keys() & {"aliases", "known_prefixes"}:
        return units
    described = units["units"]
    aliases = {n: entry for n, entry in units.get("aliases", {}).items() if n not in described}
    for entry in units.get("known_prefixes", {}).values():
        for name in (entry["unit"], *entry.get("shared_with", ())):
            if name not in described and name not in aliases:
                keys = _OF_ALIASES if name == entry["unit"] else {}
                aliases[name] = {keys[key]: entry[key] for key in keys if key in entry}
    prefixes = {
        prefix: {key: value for key, value in entry.items() if key != "like"}
        for prefix, entry in units.get("known_prefixes", {}).items()
    }
    return {**units, "aliases": aliases, "known_prefixes": prefixes}
