"""``stagewire show``: show an entry of the registry; for a message, also its framing."""

from __future__ import annotations

import json
import textwrap
from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated, Any

import typer

from stagewire_cli import completion
from stagewire_cli.entries import Entry, Json, containing, entries_of, named, similar
from stagewire_cli.errors import CalledWronglyError
from stagewire_cli.framings import framing_of
from stagewire_cli.output import console, table
from stagewire_cli.protocols import one_or_all
from stagewire_cli.rendering import columns_text, spelled_id
from stagewire_conformance.registry import Registry, registry_of

if TYPE_CHECKING:
    from rich.console import Console

    from stagewire.protocols import Protocol


EXAMPLE = """\b
Examples:
  stagewire show MOT_MOVE_ABSOLUTE
  stagewire show velocity
  stagewire show 0453
  stagewire show MTS25
  stagewire show
"""

_FEW, _MANY = 6, 60  # names of each kind that a list shows
_INDENTED: dict[str, Any] = {
    "initial_indent": "  ",
    "subsequent_indent": "  ",
    "break_long_words": False,
    "break_on_hyphens": False,
}
_PLURALS = {
    "alias": "aliases",
    "family": "families",
    "quantity": "quantities",
    "erratum": "errata",
    "prefix": "prefixes of serial numbers",
}
_WITH_EVIDENCE = ("enumeration", "flag table", "quantity", "unit", "stage", "list")
_OF_COMMANDS = ("title", "keyboard", "size", "dummy", "switches_to")


def show(
    words: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="NAME",
            help="A name or a part of it in any case, a message id such as 0453, or a prefix of serial "
            "numbers. Without it, everything is listed.",
            autocompletion=completion.entries,
        ),
    ] = None,
    protocol: Annotated[
        str | None, typer.Option("--protocol", help="Search only this protocol.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the entry as JSON.")] = False,
) -> None:
    """Show what the registry says about a name, or list what a part of a name fits.

    Finds messages, parameter sets, fields, enumerations, flag tables, units, stages, quantities and errata.
    A stage may have its name in the catalogue of the vendor.
    """
    name = " ".join(words) if words else None
    protocols = {one.name: one for one in one_or_all(protocol)}
    registries = {known: registry_of(one) for known, one in protocols.items()}
    everything = [
        entry for choice, registry in registries.items() for entry in entries_of(choice, registry)
    ]
    found = everything if name is None else named(name, everything)
    if name is not None and not found:
        found = containing(name, everything)
        if len(found) != 1:
            found = [entry for entry in found if entry.kind != "erratum"] or found
    if not found or name == "":
        raise CalledWronglyError(
            f"nothing in the registry is named {name}{_like(name, everything)}"
        )
    if name is None or (len(found) > 1 and not named(name, found)):
        _list(name, found, as_json=as_json)
    elif as_json:
        for entry in found:
            typer.echo(json.dumps(entry.facts, indent=2, sort_keys=True, ensure_ascii=False))
    else:
        for entry in found:
            _entry(entry, registries[entry.protocol], protocols[entry.protocol])


def _like(name: str | None, everything: list[Entry]) -> str:
    close = similar(name or "", everything)
    meant = f"; did you mean {' or '.join(close)}?" if close else ""
    return f"{meant or '.'}\nstagewire show, without a name, lists everything"


def _list(name: str | None, found: list[Entry], *, as_json: bool) -> None:
    """List names by kind; of everything, only some of each kind."""
    kinds: dict[str, list[str]] = {}
    for entry in found:
        kinds.setdefault(entry.kind, []).append(entry.name)
    if as_json:
        typer.echo(json.dumps(kinds, indent=2, ensure_ascii=False))
        return
    out = console()
    width = min(out.width, 100)
    for kind, names in kinds.items():
        out.print(f"{_PLURALS.get(kind, f'{kind}s')} ({len(names)})", style="bold")
        shown = names[:_FEW] if name is None else names[:_MANY]
        more = f", and {len(names) - len(shown)} more" if len(names) > len(shown) else ""
        out.print(textwrap.fill(f"{', '.join(shown)}{more}", width, **_INDENTED), soft_wrap=True)
    if name is None:
        out.print("\nstagewire show NAME shows an entry, or lists the names that contain a text.")
        out.print("--json lists all names.")


def _entry(entry: Entry, registry: Registry, protocol: Protocol) -> None:
    """Print an entry."""
    out = console()
    out.print(f"{entry.kind} {entry.name} ({entry.protocol})", style="bold")
    if entry.kind == "message":
        _message(out, registry, entry.facts)
        _evidence(out, registry, entry.facts)
        framing = framing_of(protocol)
        if framing is not None and entry.facts["id"] is not None:
            framing.show(out, entry.facts["id"])
        return
    placed = _placed(entry.facts, registry)
    if entry.kind in _WITH_EVIDENCE:
        placed = {key: value for key, value in placed.items() if key != "evidence"}
    if entry.kind == "enumeration":
        _values(out, placed)
    elif entry.kind == "flag table":
        _bits(out, placed)
    else:
        _plain(out, placed)
    if entry.kind in _WITH_EVIDENCE:
        _evidence(out, registry, entry.facts)


def _message(out: Console, registry: Registry, entry: Json) -> None:
    id = "without an id" if entry["id"] is None else spelled_id(registry, entry)
    direction = str(entry["direction"]).replace("_", " ")
    out.print(f"{id}, {direction}, {registry.where(entry['pages'], entry.get('overlay', ''))}")
    _plain(out, {key: entry[key] for key in _OF_COMMANDS if entry.get(key) not in (None, False)})
    if entry["kind"] == "command" and entry["size"] is None:
        out.print("no size slot")
    if entry.get("aliases"):
        out.print(f"also named {' and '.join(entry['aliases'])}")
    for overlay, page in entry.get("later_pages", {}).items():
        out.print(f"also {registry.where([page], overlay)}")
    for fact in entry.get("firmware", ()):
        out.print(f"firmware {fact['version']}: {fact['note']}")
    for key in ("summary", "note"):
        if entry.get(key):
            out.print(entry[key])
    if entry.get("not_sent"):
        out.print(f"not sent: {entry['not_sent']}")
    _plain(out, {key: entry[key] for key in ("set", "exchange", "errata") if entry.get(key)})
    if not entry["layouts"]:
        out.print("the document gives no layout; received bytes are kept, and it cannot be encoded")
    for layout in entry["layouts"]:
        _layout(out, layout)


def _evidence(out: Console, registry: Registry, entry: Json) -> None:
    """Print the evidence of an entry: a line for each source."""
    for found in entry.get("evidence", ()):
        source = registry.table("sources")[found["source"]]["text"]
        part = f" ({found['part']})" if found.get("part") else ""
        kind = found["class"].replace("_", " ")
        out.print(f"evidence: {kind}: {source}: {found['shows']}{part}", soft_wrap=True)
    if not entry.get("evidence"):
        out.print("evidence: document only")


def _layout(out: Console, layout: Json) -> None:
    when = f" when {_text(layout['when'])}" if layout.get("when") else ""
    plural = "s" if layout["length"] > 1 else ""
    most = f" to {layout['longest']}" if layout.get("longest") else ""
    length = f", {layout['length']}{most} byte{plural}" if layout["length"] else ""
    out.print(f"\n{layout['form']}{when}{length}")
    if layout.get("note"):
        out.print(layout["note"])
    rows = [(key, layout[key]) for key in ("param1", "param2") if layout.get(key)]
    rows += [(str(field["offset"]), field) for field in layout["fields"]]
    if not rows:
        out.print("no fields")
        return
    shown = table("offset", "field", "format", "range", "unit", "values, notes", right=("offset",))
    for place, field in rows:
        ranged = field.get("minimum") is not None
        shown.add_row(
            place,
            str(field["name"]),
            str(field["format"]),
            f"{field['minimum']} to {field['maximum']}" if ranged else "",
            str(field.get("unit") or ""),
            "; ".join(_notes(field)),
        )
    out.print(shown)


def _notes(field: Json) -> Iterator[str]:
    if field.get("role") not in (None, "value"):
        yield str(field["role"])
    if field.get("constant") is not None:
        yield f"always {field['constant']}"
    if field.get("default") is not None:
        yield f"default {field['default']}"
    if field.get("enumeration"):
        yield f"enumeration {field['enumeration']}"
    if field.get("flag_table"):
        yield f"flags {field['flag_table']}"
    for unit, name in (field.get("enums_by_unit") or {}).items():
        yield f"enumeration {name} on {unit}"
    for unit, name in (field.get("flags_by_unit") or {}).items():
        yield f"flags {name} on {unit}"
    for unit, found in (field.get("ranges_by_unit") or {}).items():
        on = "other units" if unit == "others" else unit
        yield f"{found['minimum']} to {found['maximum']} on {on}"
    if field.get("array"):
        yield f"{field['array']['rows']} rows of {columns_text(field)}"
    if field.get("note"):
        yield str(field["note"])


def _values(out: Console, entry: Json) -> None:
    _plain(out, {key: value for key, value in entry.items() if key != "values"})
    values = sorted(entry["values"].items(), key=lambda item: item[1]["value"])
    typed = ["typed"] if any("keyboard" in value for _, value in values) else []
    shown = table("value", "name", *typed, "note", right=("value",))
    for name, value in values:
        keys = [value.get("keyboard", "")] if typed else []
        shown.add_row(str(value["value"]), name, *keys, str(value["note"]))
    out.print(shown)


def _bits(out: Console, entry: Json) -> None:
    _plain(out, {key: value for key, value in entry.items() if key != "bits"})
    digits = 2 + 2 * -(-max(bit["bit"] + 1 for bit in entry["bits"].values()) // 8)
    shown = table("bit", "mask", "name", "note", right=("bit",))
    for name, bit in sorted(entry["bits"].items(), key=lambda item: item[1]["bit"]):
        shown.add_row(str(bit["bit"]), f"{bit['mask']:#0{digits}x}", name, str(bit["note"]))
    out.print(shown)


def _plain(out: Console, entry: Json, indent: str = "") -> None:
    """Print any entry of the registry: one line per fact, nested facts indented."""
    for key, value in entry.items():
        if value is None or value in ("", [], {}) or key == "name":
            continue
        label = f"{indent}{key}"
        if isinstance(value, dict) and not _is_small(value):
            out.print(f"{label}:", soft_wrap=True)
            _plain(out, value, indent + "  ")
        else:
            out.print(f"{label}: {_text(value)}", soft_wrap=True)


def _placed(value: Any, registry: Registry) -> Any:
    """Return an entry with references in place of pages, if there are several documents or no pages."""
    if not registry.document().keys() & {"name", "sections"}:
        return value
    if isinstance(value, list):
        return [_placed(item, registry) for item in value]
    if not isinstance(value, dict):
        return value
    overlay = registry.overlay_of(value)
    placed: Json = {}
    for key, item in value.items():
        if key == "page" and isinstance(item, int):
            placed["place"] = registry.where([item], overlay)
        elif key == "pages":
            placed["place"] = registry.where(item, overlay)
        elif key != "document" or isinstance(item, dict):  # a source of scales can have this name
            placed[key] = _placed(item, registry)
    return placed


def _is_small(value: Json) -> bool:
    return all(not isinstance(v, (dict, list)) for v in value.values()) and len(value) <= 3


def _text(value: Any) -> str:
    if isinstance(value, dict):
        if set(value) == {"numerator", "denominator"}:
            over = "" if value["denominator"] == 1 else f"/{value['denominator']}"
            return f"{value['numerator']}{over}"
        return ", ".join(f"{key} {_text(item)}" for key, item in value.items() if item != "")
    if isinstance(value, list):
        return ", ".join(_text(item) for item in value)
    return str(value)
