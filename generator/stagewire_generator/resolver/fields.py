"""Fields: their offsets counted, and the tables that they refer to found."""

from __future__ import annotations

from stagewire_generator.model import Field, Json
from stagewire_generator.resolver.tables import Tables
from stagewire_generator.strict_yaml import Document, KeyPath

__all__ = ["resolve_field", "resolve_fields"]


def resolve_fields(
    tables: Tables, document: Document, path: KeyPath, entries: Json, page: int
) -> tuple[tuple[Field, ...], bool]:
    """Return the fields, one after the other, and whether all could be made.

    :param path: where ``entries`` stand in ``document``.
    :param page: the page of a field that names none.
    """
    made: list[Field] = []
    offset = 0
    for name, entry in entries.items():
        field = resolve_field(tables, document, (*path, name), name, entry, offset, page)
        if field is not None:
            made.append(field)
            offset += field.format.size
    return tuple(made), len(made) == len(entries)


def resolve_field(
    tables: Tables,
    document: Document,
    path: KeyPath,
    name: str,
    entry: Json,
    offset: int,
    page: int,
) -> Field | None:
    """Return the field; None where its format is unknown.

    :param offset: bytes before the field, in the payload or in the header.
    """
    place = document.place(*path)
    format = tables.format(entry["format"], place)
    if format is None:
        return None
    facts: Json = {}
    for key, table, kind in (
        ("quantity", tables.quantities, "quantity"),
        ("enum", tables.enumerations, "enumeration"),
        ("flags", tables.flags, "flag table"),
    ):
        if key in entry:
            facts[key] = tables.look_up(table, entry[key], kind, place)
    by_unit = {}
    for unit, table_name in entry.get("flags_by_unit", {}).items():
        found = tables.look_up(tables.flags, table_name, "flag table", place)
        if found:
            by_unit[unit] = found
    return Field(
        name=name,
        offset=offset,
        format=format,
        role=entry.get("role", "value"),
        minimum=entry.get("minimum", format.minimum if format.kind == "integer" else 0),
        maximum=entry.get("maximum", format.maximum if format.kind == "integer" else 0),
        ranged="minimum" in entry or "maximum" in entry,
        open=entry.get("open", False),
        page=entry.get("page", page),
        place=place,
        default=entry.get("default"),
        constant=entry.get("constant", entry.get("value")),
        target=entry.get("target", ""),
        flags_by_unit=by_unit,
        note=entry.get("note", ""),
        overlay=document.overlay,
        **facts,
    )
