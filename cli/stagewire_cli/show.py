"""``stagewire show``: show an entry of the registry; for a message, also its framing."""

from __future__ import annotations

import json
import textwrap
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from stagewire.protocols import Protocol
from stagewire.quantities import Limit, Scale
from stagewire_cli import completion
from stagewire_cli.errors import CalledWronglyError
from stagewire_cli.framings import framing_of
from stagewire_cli.output import console, table
from stagewire_cli.protocols import one_or_all
from stagewire_cli.real_numbers import range_text, real_text
from stagewire_cli.registry_search import (
    KINDS,
    Entry,
    entries_of,
    labels,
    named,
    of_kind,
    similar,
    with_part,
)
from stagewire_cli.rendering import columns_text, spelled_id
from stagewire_cli.stages import StagesFile, own_stages
from stagewire_conformance.registry import Registry, registry_of

if TYPE_CHECKING:
    from rich.console import Console


EXAMPLE = """\b
Examples:
  stagewire show
  stagewire show stages
  stagewire show MOT_MOVE_ABSOLUTE
  stagewire show 0453
  stagewire show homing
"""

Json = dict[str, Any]

_WITH_EVIDENCE = ("enumeration", "flag table", "quantity", "unit", "stage", "list")
_OF_COMMANDS = ("title", "keyboard", "size", "dummy", "switches_to")


def show(
    name: Annotated[
        str | None,
        typer.Argument(
            metavar="NAME",
            help="Name or part of a name in any case, message id, prefix of serial numbers, or kind such as "
            "stages.  [default: count the entries of each kind]",
            autocompletion=completion.entries,
        ),
    ] = None,
    protocol: Annotated[
        str | None, typer.Option("--protocol", help="Search only this protocol.")
    ] = None,
    stages: StagesFile = None,
    as_json: Annotated[
        bool,
        typer.Option("--json", help="Print the entry as JSON, or one object per line of a list."),
    ] = False,
) -> None:
    """Show what the registry says about a name.

    Finds messages, fields, parameter sets, enumerations, flag tables, units, stages, quantities and errata. A
    stage may have its name in the catalogue of the vendor. If several entries contain the name, they are
    listed by kind.
    """
    protocols = {one.name: one for one in one_or_all(protocol)}
    registries = {known: registry_of(one) for known, one in protocols.items()}
    everything = [*entries_of(registries), *_of_user(stages)]
    if name is None:
        _counts(everything, as_json)
        return
    found = named(name, everything)
    if not found:
        listed = of_kind(name, everything) or with_part(name, everything)
        if len(listed) != 1:
            _list(name, listed, everything, as_json)
            return
        found = listed
    if as_json:
        for entry in found:
            typer.echo(json.dumps(entry.data, indent=2, sort_keys=True, ensure_ascii=False))
        return
    out = console()
    for entry in found:
        out.print(f"{entry.kind} {entry.name} ({entry.source})", style="bold", soft_wrap=True)
        if entry.source in protocols:
            _entry(out, entry, protocols[entry.source])
        else:
            _plain(out, entry.data)


def _of_user(file: Path | None) -> Iterator[Entry]:
    """Yield the stages of a file of the user."""
    for name, stage in own_stages(file).items():
        scales = {
            family or "every controller": {
                quantity: f"{scale.counts_per_unit} counts per {scale.unit}"
                for quantity, scale in found.items()
                if isinstance(scale, Scale)
            }
            for family, found in stage.scales.items()
        }
        limits = {
            limit: f"{float(found.value):.10g} {found.unit}"
            for limit, found in stage.limits.items()
            if isinstance(found, Limit)
        }
        kind = "rotary" if stage.rotary else "linear"
        data = {"title": stage.title, "kind": kind, "limits": limits, "controllers": scales}
        yield Entry(str(file), "stage", name, data)


def _counts(everything: list[Entry], as_json: bool) -> None:
    """Print the number of entries of each kind, and how to list them."""
    counts = Counter(entry.kind for entry in everything)
    if as_json:
        typer.echo(json.dumps({KINDS[kind]: counts[kind] for kind in KINDS if counts[kind]}))
        return
    shown = table("kind", "entries", "list them", right=("entries",))
    for kind, plural in KINDS.items():
        if counts[kind]:
            word = plural.replace(" ", "-")
            shown.add_row(plural, str(counts[kind]), f"stagewire show {word}")
    out = console()
    out.print(shown)
    out.print("\nstagewire show NAME shows an entry; a part of a name lists all entries with it.")


def _list(name: str, listed: list[Entry], everything: list[Entry], as_json: bool) -> None:
    """Print entries by kind; raise :class:`CalledWronglyError` if there are none."""
    if not listed:
        close = similar(name, everything)
        like = (
            f"did you mean {' or '.join(close)}?" if close else "stagewire show lists what there is"
        )
        raise CalledWronglyError(f"nothing in the registry is named {name}; {like}")
    if as_json:
        for entry in listed:
            line = {"kind": entry.kind, "name": entry.name, "protocol": entry.source}
            typer.echo(json.dumps(line, ensure_ascii=False))
        return
    out = console()
    for kind, plural in KINDS.items():
        found = (labels(entry, name) for entry in listed if entry.kind == kind)
        names = list(dict.fromkeys(label for of_entry in found for label in of_entry))
        if names:
            out.print(f"{plural} ({len(names)})", style="bold")
            lines = textwrap.wrap(", ".join(names), out.width - 2, break_on_hyphens=False)
            out.print(textwrap.indent("\n".join(lines), "  "), soft_wrap=True)
    out.print("\nstagewire show NAME shows one of them")


def _entry(out: Console, entry: Entry, protocol: Protocol) -> None:
    """Print an entry of a registry."""
    registry, data = registry_of(protocol), entry.data
    if entry.kind == "message":
        _message(out, registry, data)
        _evidence(out, registry, data)
        framing = framing_of(protocol)
        if framing is not None and data["id"] is not None:
            framing.show(out, data["id"])
        return
    placed = _placed(data, registry)
    if entry.kind in _WITH_EVIDENCE:
        placed = {key: value for key, value in placed.items() if key != "evidence"}
    if entry.kind == "enumeration":
        _values(out, placed)
    elif entry.kind == "flag table":
        _bits(out, placed)
    else:
        _plain(out, placed)
    if entry.kind in _WITH_EVIDENCE:
        _evidence(out, registry, data)


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
    if entry.get("without_flag"):
        out.print(f"also received without the data flag: {entry['without_flag']}")
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
        ranged = field.get("minimum") is not None and not _any_pattern(field)
        shown.add_row(
            place,
            str(field["name"]),
            str(field["format"]),
            range_text(field) if ranged else "",
            str(field.get("unit") or ""),
            "; ".join(_notes(field)),
        )
    out.print(shown)


def _any_pattern(field: Json) -> bool:
    """Return whether a field is a real number that may have every bit pattern."""
    return bool(field.get("real")) and field["maximum"] >> 8 * field["size"] - 1 != 0


def _notes(field: Json) -> Iterator[str]:
    if field.get("role") not in (None, "value"):
        yield str(field["role"])
    if field.get("real"):
        yield "real number"
    if field.get("constant") is not None:
        yield f"always {field['constant']}"
    if field.get("default") is not None:
        shown = real_text(field, field["default"]) if field.get("real") else field["default"]
        yield f"default {shown}"
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
