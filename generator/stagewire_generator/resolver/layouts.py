"""Resolve layouts and fields: compute offsets, look up the tables that fields refer to."""

from __future__ import annotations

from dataclasses import replace

from stagewire_generator.diagnostics import Place
from stagewire_generator.framing import rules_of
from stagewire_generator.model import Json, Layout
from stagewire_generator.model_fields import Array, Column, Field, Format
from stagewire_generator.real import pattern_of
from stagewire_generator.resolver.tables import Tables
from stagewire_generator.strict_yaml import Document, KeyPath


def resolve_fields(
    tables: Tables, document: Document, path: KeyPath, entries: Json, page: int
) -> tuple[tuple[Field, ...], bool]:
    """Return the fields in order, and whether all could be resolved.

    :param path: the path of ``entries`` in ``document``.
    :param page: the page for fields that do not give one.
    """
    made: list[Field] = []
    offset = 0
    whole = True
    for name, entry in entries.items():
        for each, spelled in _repeated(tables, name, entry).items():
            field = resolve_field(tables, document, (*path, name), each, spelled, offset, page)
            whole = whole and field is not None
            if field is not None:
                made.append(field)
                offset += field.format.size
    return tuple(made), whole


def _repeated(tables: Tables, name: str, entry: Json) -> Json:
    """Return the fields of an entry: itself, or ``name_1`` to ``name_16`` for the format ``word[16]``."""
    repeated = tables.repeated(entry["format"])
    if repeated is None:
        return {name: entry}
    format, count = repeated
    return {f"{name}_{number}": {**entry, "format": format} for number in range(1, count + 1)}


def _array(tables: Tables, document: Document, path: KeyPath, entry: Json, item: Format) -> Array:
    """Return the array of a field."""
    place = document.place(*path)
    columns = []
    for name, column in entry["columns"].items():
        quantity = column.get("quantity")
        found = quantity and tables.look_up(tables.quantities, quantity, "quantity", place)
        each, note = column.get("for_each", ""), column.get("note", "")
        columns.append(Column(name, each, found or None, note))
    return Array(item, entry["rows"], tuple(columns))


def _limit(tables: Tables, place: Place, name: str, item: Format, entry: Json, key: str) -> int:
    """Return a limit as on the wire: an integer, or the bit pattern of a real number."""
    default: int = getattr(item, key) if item.kind == "integer" else 0
    limit = entry.get(key, default)
    if item.real and key in entry:
        if isinstance(limit, str) or limit >= 0:
            return pattern_of(limit, item.size)
        what = f"{name}: the {key} {limit} is negative, which real numbers with a range are not"
        tables.diagnostics.add(place, "SW033", what, "state the range in its `note`")
        return default
    if isinstance(limit, str):
        what = f"{name}: the {key} {limit} is a decimal, which only real numbers have"
        tables.diagnostics.add(place, "SW033", what, "write it in counts")
        return default
    return int(limit)


def resolve_field(
    tables: Tables,
    document: Document,
    path: KeyPath,
    name: str,
    entry: Json,
    offset: int,
    page: int,
) -> Field | None:
    """Return the field, or None if its format is unknown.

    :param offset: number of bytes before the field, in the payload or in the header.
    """
    place = document.place(*path)
    format = tables.format(entry["format"], place)
    if format is None:
        return None
    facts: Json = {}
    if "array" in entry:
        if format.kind != "integer":
            what = f"{name}: an array contains integers, not {format.name}"
            tables.diagnostics.add(place, "SW033", what, "use the format of an integer")
            return None
        facts["array"] = _array(tables, document, path, entry["array"], format)
        format = Format(format.name, 0, format.signed, "array")
    item = facts["array"].item if "array" in facts else format
    for key, table, kind in (
        ("quantity", tables.quantities, "quantity"),
        ("enum", tables.enumerations, "enumeration"),
        ("flags", tables.flags, "flag table"),
    ):
        if key in entry:
            facts[key] = tables.look_up(table, entry[key], kind, place)
    for key, table, kind in (
        ("flags_by_unit", tables.flags, "flag table"),
        ("enums_by_unit", tables.enumerations, "enumeration"),
    ):
        if key in entry:
            found = {
                unit: tables.look_up(table, table_name, kind, place)
                for unit, table_name in entry[key].items()
            }
            facts[key] = {unit: known for unit, known in found.items() if known}
    own = (
        _limit(tables, place, name, item, entry, "minimum"),
        _limit(tables, place, name, item, entry, "maximum"),
    )
    by_unit = {
        unit: (found["minimum"], found["maximum"])
        for unit, found in entry.get("ranges_by_unit", {}).items()
    }
    lowest, highest = zip(own, *by_unit.values(), strict=True)
    return Field(
        name=name,
        offset=offset,
        format=format,
        role=entry.get("role", "value"),
        minimum=min(lowest),
        maximum=max(highest),
        ranges_by_unit=by_unit,
        other_range=own if by_unit else None,
        ranged=bool({"minimum", "maximum", "ranges_by_unit"} & entry.keys()),
        open=entry.get("open", False),
        page=entry.get("page", page),
        place=place,
        default=entry.get("default"),
        constant=entry.get("constant", entry.get("value")),
        target=entry.get("target", ""),
        note=entry.get("note", ""),
        overlay=document.overlay_of(*path),
        **facts,
    )


def resolve_layouts(
    tables: Tables, document: Document, path: KeyPath, entry: Json, page: int, name: str
) -> tuple[Layout, ...]:
    """Return the layouts in an entry, in any of the ways to write them.

    :param page: the page for fields that do not give one.
    :param name: name of the message or parameter set, for errors.
    """
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


def with_sub_message(layout: Layout, value: int | None) -> Layout:
    """Return a layout whose first word, or first header parameter, is fixed to a sub-message."""
    header = layout.form == "header"
    first = layout.param1 if header else next(iter(layout.fields), None)
    if value is None or first is None or first.constant != value or first.role != "constant":
        return layout
    fixed = replace(first, minimum=value, maximum=value, selects=True)
    if header:
        return replace(layout, param1=fixed)
    return replace(layout, fields=(fixed, *layout.fields[1:]))


def header_layout(
    tables: Tables, document: Document, path: KeyPath, entry: Json, page: int
) -> Layout:
    """Return the layout of a header-only message; its two parameters may be fields."""
    params: list[Field | None] = []
    for offset, key in enumerate(("param1", "param2"), 2):
        param = entry.get(key)
        at = (*path, key)
        if param is not None and not rules_of(tables.head.data["framing"]["kind"]).has_parameters:
            hint = "use a field of the payload instead"
            what = f"{key}: headers of this framing have no parameter bytes"
            tables.diagnostics.add(document.place(*at), "SW038", what, hint)
            param = None
        if param is None:
            params.append(None)
            continue
        spelled = {"format": "byte", "name": key, **param}
        if "constant" in param and "name" not in param:
            spelled["role"] = "constant"
        field = resolve_field(tables, document, at, spelled["name"], spelled, offset, page)
        params.append(field and replace(field, omitted=field.default))
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
    """Return a layout with data, with its own fields or those of a block.

    Its stated length is compared with the fields, unless some of them could not be resolved.
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
        what = f"{message}: the fields take {taken} bytes, but the length is {length}"
        tables.diagnostics.add(place, "SW031", what)
    when, note = entry.get("when", {}), entry.get("note", "")
    sent_when = entry.get("sent_when", {})
    return Layout(form, when, None, None, length or 0, fields, note, place, sent_when=sent_when)
