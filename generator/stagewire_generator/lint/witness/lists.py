"""Compare the lists in the witness: contents, overview, mentions, cross-references, units, addresses."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator

from stagewire_generator.lint.witness.comparison import NOTHING, Comparison
from stagewire_generator.lint.witness.reading import sub_message
from stagewire_generator.model import Json, Message
from stagewire_generator.strict_yaml import KeyPath

_PREFIX = re.compile(r"[0-9]{2}")
_SERIES = re.compile(r"x|(?<=[0-9])X")
_SLASH = re.compile(r"/(?=[^/]*[0-9])")
_NO_LETTER = re.compile(r"[^A-Z]")
_COUNT = re.compile(r"([0-9]+) [Cc]hannel ")


def compare_contents(comparison: Comparison) -> None:
    """Compare the rows of the contents: name, id and page, and missing rows."""
    listed: set[str] = set()
    for index, row in enumerate(comparison.document.data["rows"]):
        path = ("rows", index)
        if row.get("damaged"):
            comparison.differs(
                f"contents/line-{row['line']}", path, row["text"], "one row per message"
            )
        names = row.get("names", []) if row.get("damaged") else [(row["name"], row["id"])]
        for name, id in names:
            printed = comparison.canonical(name, path)
            if comparison.messages.get(printed) is None and (
                parts := comparison.shared_by(printed, id)
            ):
                listed |= {message.name for message in parts}
                _shared(comparison, f"contents/{printed}", row, id, printed, path)
                continue
            message = comparison.named("contents", name, id, path)
            if message is None:
                continue
            listed.add(message.name)
            place = f"contents/{message.name}"
            comparison.same(f"{place}/id", path, id, comparison.id_of(message))
            if "page" in row:
                comparison.same(
                    f"{place}/page", path, row["page"], str(comparison.page_of(message))
                )
        if row.get("run_together"):
            comparison.differs("contents/run-together", path, "id and page in one", "id, page")
    for name in sorted(comparison.headed - listed):
        comparison.differs(f"contents/{name}/missing", ("rows",), "nothing", name)


def _shared(
    comparison: Comparison, place: str, row: Json, id: str, name: str, path: KeyPath
) -> None:
    """Compare a row with a heading that sub-messages share."""
    shared = comparison.shared.get(name)
    if shared is None:
        comparison.differs(f"{place}/name", path, name, "no such heading")
        return
    comparison.same(f"{place}/id", path, id, f"0x{shared.id:0{comparison.protocol.id_digits}X}")
    if "page" in row:
        comparison.same(f"{place}/page", path, row["page"], str(shared.page))


def compare_summary(comparison: Comparison) -> None:
    """Compare the overview of the command reference, and every mention in prose."""
    for index, row in enumerate(comparison.document.data["rows"]):
        path: KeyPath = ("rows", index)
        message = comparison.named("summary", row["name"], row["id"], path)
        if message:
            comparison.same(
                f"summary/{message.name}/id", path, row["id"], comparison.id_of(message)
            )
    for index, row in enumerate(comparison.document.data["mentions"]):
        path = ("mentions", index)
        message = comparison.named("mention", row["name"], row.get("id"), path)
        if message and "id" in row:
            comparison.same(
                f"mention/{message.name}/id", path, row["id"], comparison.id_of(message)
            )


def compare_lists(comparison: Comparison) -> None:
    """Compare the cross-reference lists, and the lists of units, prefixes, addresses and formats."""
    data = comparison.document.data
    for key, printed in data["lists"].items():
        entry = comparison.protocol.units.get("lists", {}).get(key)
        if entry is None:
            comparison.differs(f"lists/{key}", ("lists", key), printed["title"], "no such list")
            continue
        _list(comparison, key, printed, entry)
    _units(comparison, data)
    if "usb_prefixes" in data:
        _prefixes(comparison, data)
    _addresses(comparison, data)
    _formats(comparison, data)


def _list(comparison: Comparison, key: str, printed: Json, entry: Json) -> None:
    seen: set[str] = set()
    comparison.same(f"lists/{key}/page", ("lists", key), printed["page"], entry["page"])
    tables = _printed_units(comparison.document.data)
    units = {*entry["units"], *(name for _, name, _ in tables)}
    titled = _units_in(printed["title"], units)
    comparison.same(f"lists/{key}/units", ("lists", key), titled, sorted(entry["units"]))
    rows = [
        (path, row, row["name"] if "of" in row else comparison.canonical(row["name"], path))
        for path, row in _rows_of_list(comparison, key, printed)
    ]
    ids = {(name, row["id"]) for _, row, name in rows}
    right = {
        name
        for name, id in ids
        if (message := comparison.messages.get(name))
        and (message.name, comparison.id_of(message)) == (name, id)
    }
    has_parts = any("of" in row for _, row, _ in rows)
    for path, row, name in rows:
        message = comparison.messages.get(name)
        parts = _parts(comparison, row, name) if message is None else []
        if parts:
            mine = {part.name for part in parts if part.name in entry["messages"]}
            if "of" in row:
                for part in parts:
                    if part.name not in mine:
                        place = f"lists/{key}/{part.name}/extra"
                        comparison.differs(place, path, part.name, "not in the list")
            else:
                _shared(comparison, f"lists/{key}/{name}", row, row["id"], name, path)
                if not mine:
                    comparison.differs(f"lists/{key}/{name}/extra", path, name, "not in the list")
            if "of" in row or not has_parts:  # otherwise further rows have the sub-messages
                seen |= mine
            continue
        meant = comparison.with_id(row["id"])
        wrong_name = message is None or name in right or name not in entry["messages"]
        if meant is not None and meant is not message and wrong_name:  # otherwise the id is wrong
            comparison.same(f"lists/{key}/{meant.name}/name", path, name, meant.name)
            message = meant
        if message is None:
            comparison.unknown.append((comparison.document.place(*path), row["name"]))
            continue
        comparison.witnessed.add(message.name)
        seen.add(message.name)
        place = f"lists/{key}/{message.name}"
        if row["id"]:
            comparison.same(f"{place}/id", path, row["id"], comparison.id_of(message))
        if "page" in row:
            comparison.same(f"{place}/page", path, row["page"], str(comparison.page_of(message)))
        if message.name not in entry["messages"]:
            comparison.differs(f"{place}/extra", path, message.name, "not in the list")
    for name in entry["messages"]:
        if name not in seen:
            comparison.differs(f"lists/{key}/{name}/missing", ("lists", key), "nothing", name)
    comparison.tables |= {f"lists/{key}/{part}" for part in ("messages", "units", "completes")}
    for name in entry.get("completes", []):
        comparison.differs(f"lists/{key}/{name}/missing", ("lists", key), "nothing", name)
    for name in entry.get("misprinted", {}):
        if f"lists/{key}/{name}/name" not in comparison.differences:
            comparison.differs(f"lists/{key}/{name}/misprinted", ("lists", key), name, "as printed")


def _parts(comparison: Comparison, row: Json, name: str) -> list[Message]:
    """Return the sub-messages that a row stands for: one for each of its verbs, or all of an id."""
    if "of" in row:
        return comparison.sub_messages(row["of"], row["name"], sub_message(row["id"]))
    return comparison.shared_by(name, row["id"])


def _units_in(words: str, units: Iterable[str]) -> list[str]:
    """Return the units that words name, by their own names or that of their series, such as BPC20x."""
    named = {word.rstrip(",") for word in words.split()}
    series = [
        re.compile(_SERIES.sub("[0-9]", re.escape(word))) for word in named if _SERIES.search(word)
    ]
    return sorted(
        name for name in units if name in named or any(each.fullmatch(name) for each in series)
    )


def _rows_of_list(
    comparison: Comparison, key: str, printed: Json
) -> Iterator[tuple[KeyPath, Json]]:
    """Yield the rows of a list, and the legible parts of damaged rows."""
    for index, row in enumerate(printed["rows"]):
        path = ("lists", key, "rows", index)
        if not row.get("damaged"):
            yield path, row
            continue
        comparison.differs(
            f"lists/{key}/line-{row['line']}", path, row["text"], "one row per message"
        )
        for name, id in row["names"]:
            yield path, {"name": name, "id": id}


def _units(comparison: Comparison, data: Json) -> None:
    units = comparison.protocol.units.get("units", {})
    unsupported = comparison.protocol.units.get("unsupported", {})
    for path, name, says in _printed_units(data):
        if name in unsupported:
            comparison.compared += 1
            continue
        if name not in units:
            comparison.differs(f"units/{name}", path, name, "no such unit")
            continue
        comparison.compared += 1
        count = _COUNT.match(says)
        if count:
            channels = units[name].get("channels", 1) * units[name].get("bays", 1)
            comparison.same(f"units/{name}/channels", path, count[1], str(channels))


def _printed_units(data: Json) -> Iterator[tuple[KeyPath, str, str]]:
    """Yield the row, the name and the description of each printed unit."""
    for kind in ("motor_controllers", "piezo_controllers"):
        for index, (_, name, says) in enumerate(data.get(kind, [])):
            yield (kind, index), name, says


def _prefixes(comparison: Comparison, data: Json) -> None:
    """Compare the prefixes of serial numbers: each printed unit has its prefix, and no other unit.

    The registry may have further units with a printed prefix only under ``known_prefixes``, since the sources
    of these are not the document.
    """
    owned = {
        name: {entry[key] for key in ("usb_prefix", "card_usb_prefix") if key in entry}
        for name, entry in comparison.protocol.units.get("units", {}).items()
    }
    known = {name: set(prefixes) for name, prefixes in owned.items()}
    for prefix, entry in comparison.protocol.units.get("known_prefixes", {}).items():
        for name in (entry["unit"], *entry.get("shared_with", ())):
            known.setdefault(name, set()).add(int(prefix))
    for name, entry in comparison.protocol.units.get("unsupported", {}).items():
        known.setdefault(name, set()).update(entry.get("prefixes", ()))
    printed = set()
    for index, (line, text, _, codes) in enumerate(data.get("usb_prefixes", [])):
        path: KeyPath = ("usb_prefixes", index)
        digits = _PREFIX.match(text)
        if digits is None:
            comparison.differs(f"prefixes/line-{line}", path, text, "two leading digits")
            continue
        prefix = int(digits[0])
        printed.add(prefix)
        named = _coded(codes, known)
        for code in named:
            encoded = code if prefix in known.get(code, ()) else NOTHING
            comparison.same(f"prefixes/{prefix}/{code}", path, code, encoded)
        for name in sorted(owned.keys() - {*named}):
            if prefix in owned[name]:
                comparison.differs(f"prefixes/{prefix}/{name}", path, codes or NOTHING, name)
    for prefix in sorted(set().union(*owned.values()) - printed):
        comparison.differs(f"prefixes/{prefix}/missing", ("usb_prefixes",), "nothing", prefix)


def _coded(codes: str, units: Iterable[str]) -> list[str]:
    """Return the units that a cell names, such as ``BPC103/203`` or ``MFF10X``; others as printed.

    A part without digits belongs to the name before it, as in ``MNA601/IR``.
    """
    names: list[str] = []
    letters = ""
    for code in filter(None, _SLASH.split(codes)):
        full = letters + code if code.isdecimal() else code
        letters = _NO_LETTER.split(full, maxsplit=1)[0]
        names += _units_in(full, units) or [full]
    return names


def _addresses(comparison: Comparison, data: Json) -> None:
    framing = comparison.protocol.framing
    if "host" not in framing:
        if "addresses" in data:
            what = "addresses of host and devices, which this framing does not have"
            comparison.misplace(("addresses",), what)
        return
    known = {f"0x{address:02X}" for address in (framing["host"], *framing["devices"])}
    seen: set[str] = set()
    rows = data.get("addresses", [])
    for index, (_, address, _) in enumerate(rows):
        path = ("addresses", index)
        if address == "…" and 0 < index < len(rows) - 1:
            first, last = (int(rows[at][1], 16) for at in (index - 1, index + 1))
            seen |= {f"0x{between:02X}" for between in range(first + 1, last)}
            continue
        if address in seen:
            comparison.differs(f"addresses/{address}/twice", path, address, "once")
        comparison.same(f"addresses/{address}", path, address in known, True)
        seen.add(address)
    for address in sorted(known - seen) if seen else ():
        comparison.differs(f"addresses/{address}/missing", ("addresses",), NOTHING, address)


def _formats(comparison: Comparison, data: Json) -> None:
    formats = comparison.protocol.formats
    for index, (_, name, says) in enumerate(data.get("formats", [])):
        if not name.endswith("[N]"):
            size = f"{formats[name]['size']} byte" if name in formats else "no such format"
            path = ("formats", index)
            comparison.same(f"formats/{name}", path, says.removesuffix("s"), size)


MESSAGE_CHAPTERS = {
    "contents": compare_contents,
    "summary": compare_summary,
    "lists": compare_lists,
}
"""Chapters with their own form in a document of messages."""
