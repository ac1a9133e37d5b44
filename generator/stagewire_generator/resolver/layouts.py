"""Layouts of messages with a header: parameters of the header alone, or data behind it."""

from __future__ import annotations

from stagewire_generator.model import Field, Json, Layout
from stagewire_generator.resolver.fields import resolve_field, resolve_fields
from stagewire_generator.resolver.tables import Tables
from stagewire_generator.strict_yaml import Document, KeyPath

__all__ = ["header_layout", "resolve_layouts"]

_WITH_PARAMETERS = ("header",)  # kinds of framing whose messages have two bytes for parameters


def resolve_layouts(
    tables: Tables, document: Document, path: KeyPath, entry: Json
) -> tuple[Layout, ...]:
    """Return the layouts of a message or of a parameter set, in whichever way they are written."""
    page, name = entry["page"], str(path[-1])
    if "layouts" in entry:
        found = []
        for key, layout in entry["layouts"].items():
            at = (*path, "layouts", key)
            form = key.replace("_", ":", 1)
            if form == "header":
                found.append(header_layout(tables, document, at, layout, page))
            else:
                found.append(_data_layout(tables, document, at, layout, form, page, name))
        return tuple(found)
    if "header" in entry:
        return (header_layout(tables, document, (*path, "header"), entry["header"], page),)
    if "data" in entry:
        at = (*path, "data")
        return (_data_layout(tables, document, at, entry["data"], "data", page, name),)
    bare = {**entry, "note": ""}  # the note is the message's
    return (_data_layout(tables, document, path, bare, "data", page, name),)


def header_layout(
    tables: Tables, document: Document, path: KeyPath, entry: Json, page: int
) -> Layout:
    """Return the layout of a message that is a header alone; its two parameters may be fields."""
    params: list[Field | None] = []
    for offset, key in enumerate(("param1", "param2"), 2):
        param = entry.get(key)
        at = (*path, key)
        if param is not None and tables.head.data["framing"]["kind"] not in _WITH_PARAMETERS:
            hint = "a field of the payload says it instead"
            tables.diagnostics.add(document.place(*at), "SW038", f"{key} of a header", hint)
            param = None
        if param is None:
            params.append(None)
            continue
        spelled = {"format": "byte", "name": key, **param}
        if "constant" in param and "name" not in param:
            spelled["role"] = "constant"
        params.append(resolve_field(tables, document, at, spelled["name"], spelled, offset, page))
    place = document.place(*path)
    note = entry.get("note", "")
    only_zero = entry.get("only_zero", False)
    return Layout("header", {}, params[0], params[1], 0, (), note, place, only_zero)


def _data_layout(
    tables: Tables,
    document: Document,
    path: KeyPath,
    entry: Json,
    form: str,
    page: int,
    message: str,
) -> Layout:
    """Return a layout with data, its fields its own or those of a block.

    The length is written, so that it can be held against the fields; that is not done where some of
    them could not be made.
    """
    place = document.place(*path)
    length = entry.get("length")
    fields_path = (*path, "fields")
    entries = entry.get("fields")
    whole = True
    if "block" in entry:
        block = tables.look_up(tables.blocks, entry["block"], "block", place)
        if block is None:
            whole = False
        else:
            document, block_path, shared = block
            fields_path = (*block_path, "fields")
            entries, page = shared["fields"], shared.get("page", page)
            length = length if length is not None else shared["length"]
    fields, all_made = resolve_fields(tables, document, fields_path, entries or {}, page)
    taken = sum(field.format.size for field in fields)
    if whole and all_made and taken != length:
        what = f"{message}: the fields take {taken} bytes, the length is {length}"
        tables.diagnostics.add(place, "SW031", what)
    when, note = entry.get("when", {}), entry.get("note", "")
    return Layout(form, when, None, None, length or 0, fields, note, place)
