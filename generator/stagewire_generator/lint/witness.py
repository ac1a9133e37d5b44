"""What the document prints, held against what the registry encodes, place by place.

Every difference has a place name that an erratum can claim, such as ``table/MOT_REQ_AVMODES/id``. Two kinds
of difference are so common that they are one place each: ``names/blanks`` (underscores that the scan lost)
and ``headers/bar`` (the ``d|`` of a data frame that it shows as ``d``).
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

from stagewire_generator.diagnostics import Place
from stagewire_generator.model import Field, Layout, Message, Protocol
from stagewire_generator.strict_yaml import Document

__all__ = ["Comparison", "Difference"]

Json = dict[str, Any]
Path = tuple[str | int, ...]

_ID = re.compile(r"0x([0-9A-F]{4})\Z")
_BYTE = re.compile(r"[0-9A-F]{2}\Z")
_NUMBER = re.compile(r"(-?)(?:0x)?([0-9A-Fa-f][0-9A-Fa-f,]*)\Z")
_TIME = re.compile(r"([0-9][0-9,]*)(m?)s\Z")
_SYMBOL = re.compile(r"[A-Z][A-Z0-9]*_[A-Z0-9_]+\Z")
_NAME = re.compile(r"[A-Z][a-z]+[A-Za-z]*[0-9]*\Z")
_FILLERS = frozenset({"notused", "unused", "reserved", "futureuse", "na"})
_CHAPTER_KINDS = frozenset({"contents", "summary", "lists"})


@dataclass(frozen=True, slots=True)
class Difference:
    """One place where document and registry differ."""

    place: str
    at: Place
    printed: str
    encoded: str


def squash(text: str) -> str:
    """Reduce a name to its letters and digits, so that ``Jog Mode`` is ``jog_mode``."""
    return re.sub(r"[^a-z0-9]", "", text.lower())


class Comparison:
    """Compares the witness with the registry; ``differences`` holds the result."""

    def __init__(self, protocol: Protocol, printed: Iterable[Document]) -> None:
        self.protocol = protocol
        self.messages = {message.name: message for message in protocol.messages}
        self.by_id = {m.id: m for m in protocol.messages if m.id is not None}
        self.differences: dict[str, Difference] = {}
        self.compared = 0
        self.witnessed: set[str] = set()
        self.headed: set[str] = set()
        self.listed: set[str] = set()
        self.unknown: list[tuple[Place, str]] = []
        self.aliases: dict[str, Field] = {}
        self.document: Document
        documents = list(printed)
        for document in documents:
            self.document = document
            if document.data["chapter"] not in _CHAPTER_KINDS:
                for name, entry in document.data["messages"].items():
                    self.section(name, entry, ("messages", name))
        for document in documents:
            self.document = document
            {"contents": self.contents, "summary": self.summary, "lists": self.lists}.get(
                document.data["chapter"], lambda: None
            )()

    # Bookkeeping

    def same(self, place: str, path: Path, printed: object, encoded: object) -> bool:
        """Compare one place; note a difference."""
        self.compared += 1
        if printed == encoded:
            return True
        if place not in self.differences:
            self.differences[place] = Difference(
                place, self.document.place(*path), str(printed), str(encoded)
            )
        return False

    def differs(self, place: str, path: Path, printed: object, encoded: object) -> None:
        self.same(place, path, (printed,), None)
        at = self.differences[place].at
        self.differences[place] = Difference(place, at, str(printed), str(encoded))

    def canonical(self, printed: str, path: Path) -> str:
        """Return a printed message name as the registry spells it, noting lost underscores."""
        prefix = self.protocol.name_prefix
        name = printed.strip().replace("\t", " ")
        bare = name.rstrip(":;. ")
        self.same("names/punctuation", path, name, bare)
        joined = re.sub(r"[ _]+", "_", bare)
        self.same("names/blanks", path, bare, joined)
        return joined.removeprefix(prefix)

    def named(self, where: str, printed: str, id: str | None, path: Path) -> Message | None:
        """Find the message that a row means: by its name, else by its id."""
        name = self.canonical(printed, path)
        message = self.messages.get(name)
        if message is None and id and (match := _ID.match(id)):
            message = self.by_id.get(int(match[1], 16))
            if message is not None:
                self.same(f"{where}/{message.name}/name", path, name, message.name)
        if message is None:
            close = difflib.get_close_matches(name, self.messages, 1, 0.9)
            if close:
                self.same(f"{where}/{close[0]}/name", path, name, close[0])
                message = self.messages[close[0]]
        if message is None:
            self.unknown.append((self.document.place(*path), printed))
            return None
        self.witnessed.add(message.name)
        return message

    def id_of(self, message: Message) -> str:
        return "none" if message.id is None else f"0x{message.id:04X}"

    # The chapters

    def section(self, name: str, entry: Json, path: Path) -> None:
        message = self.messages.get(name)
        if message is None:
            self.unknown.append((self.document.place(*path), name))
            return
        self.witnessed.add(name)
        self.headed.add(name)
        heading = entry["heading"]
        at = (*path, "heading")
        self.same(f"heading/{name}/id", at, heading["id"], self.id_of(message))
        self.same(f"heading/{name}/page", at, heading["page"], message.pages[0])
        tables = entry.get("tables", [])
        for index, table in enumerate(tables):
            where = f"table/{name}" if index == 0 else f"table{index + 1}/{name}"
            self.table(where, message, table, (*path, "tables", index))
        if "rows" in entry:
            self.rows(message, entry["rows"], (*path, "rows"))
        self.aliases = self.by_row(message, entry.get("rows", []))
        for index, values in enumerate(entry.get("values", [])):
            self.values(message, values, (*path, "values", index))
        for index, limits in enumerate(entry.get("ranges", [])):
            self.limits(message, limits, (*path, "ranges", index))

    def layout(self, message: Message, table: Json) -> Layout | None:
        """Return the layout that a byte table shows."""
        header = next((x for x in message.layouts if x.form == "header"), None)
        data = next((x for x in message.layouts if x.form != "header"), None)
        packed = "columns" in table or "packet" in table or table.get("structure", 0) > 6
        return (data or header) if packed else (header or data)

    def table(self, where: str, message: Message, table: Json, path: Path) -> None:
        layout = self.layout(message, table)
        cells = table.get("header", [])
        at = (*path, "header")
        if message.id is not None and len(cells) == 6:
            id = f"{message.id & 0xFF:02X} {message.id >> 8:02X}"
            self.same(f"{where}/id", at, f"{cells[0]} {cells[1]}", id)
        if layout is None:
            return
        data = layout.form != "header"
        total = 6 + layout.length
        for key, encoded in (
            ("structure", total),
            ("packet", layout.length),
            ("last_offset", total - 1),
        ):
            if key in table:
                self.same(f"{where}/{key}", (*path, key), table[key], encoded)
        if len(cells) == 6:
            if data:
                length = f"{layout.length & 0xFF:02X} {layout.length >> 8:02X}"
                self.same(f"{where}/length", at, f"{cells[2]} {cells[3]}", length)
            else:
                self.param(f"{where}/param1", layout.param1, cells[2], at)
                self.param(f"{where}/param2", layout.param2, cells[3], at)
            dest = cells[4].replace(" ", "").replace("l", "|").replace("I", "|")
            if data:
                self.same("headers/bar", at, cells[4], "d|")
            self.same(f"{where}/dest", at, dest[:1], "d")
            self.same(f"{where}/source", at, cells[5].lower(), "s")
        else:
            self.same(f"{where}/cells", at, len(cells), 6)
        if "columns" in table and data:
            self.columns(where, layout, table["columns"], (*path, "columns"))

    def param(self, place: str, field: Field | None, cell: str, path: Path) -> None:
        if field is None:
            if cell != "0" and squash(cell) not in _FILLERS:
                self.same(place, path, cell, "00")
        elif field.constant is not None:
            self.same(place, path, cell, f"{field.constant:02X}")
        elif squash(cell) != squash(field.name):
            self.differs(place, path, cell, field.name)

    def columns(self, where: str, layout: Layout, columns: list[str], path: Path) -> None:
        if not self.same(f"{where}/columns", path, len(columns), len(layout.fields)):
            return
        for column, field in zip(columns, layout.fields, strict=True):
            if not _same_name(column, field):
                self.differs(f"{where}/columns/{field.name}", path, column, field.name)

    def fields(self, message: Message) -> tuple[Field, ...]:
        """Return the fields that a field table lists: of the packet, else of the header."""
        data = next((x for x in message.layouts if x.form != "header"), None)
        if data is not None:
            return data.fields
        return message.layouts[0].all_fields if message.layouts else ()

    def by_row(self, message: Message, rows: list[list[str]]) -> dict[str, Field]:
        """Return what each printed field name means, where the field table has a row for each."""
        fields = self.fields(message)
        if len(rows) != len(fields):
            return {}
        return {squash(row[0]): field for row, field in zip(rows, fields, strict=True)}

    def rows(self, message: Message, rows: list[list[str]], path: Path) -> None:
        fields = self.fields(message)
        place = f"rows/{message.name}"
        if len(rows) != len(fields):
            printed = ", ".join(row[0] for row in rows)
            self.differs(f"{place}/count", path, printed, ", ".join(f.name for f in fields))
            by_name = {squash(f.name): f for f in fields}
            pairs = [(row, by_name[squash(row[0])]) for row in rows if squash(row[0]) in by_name]
        else:
            pairs = list(zip(rows, fields, strict=True))
        for row, field in pairs:
            if not _same_name(row[0], field):
                self.differs(f"{place}/{field.name}/name", path, row[0], field.name)
            self.compared += 1
            printed = (row[1] or "").lower()
            if printed != field.format.name and (printed, field.format.name) != ("char", "byte"):
                self.differs(f"{place}/{field.name}/format", path, printed, field.format.name)

    def values(self, message: Message, printed: Json, path: Path) -> None:
        place = f"values/{message.name}/{squash(printed['of'])}"
        if "table" in printed:
            place += f"/{squash(printed['table'])}"
        field = self.aliases.get(squash(printed["of"]))
        if field is None or not (field.enum or field.flags):
            field = _find_field(self.all_fields(message), printed["of"], listed=True)
        if field is not None and field.format.kind == "bytes":
            return  # the parts of a byte string are told in its note
        if field is None or not (field.enum or field.flags):
            self.differs(place, path, printed["of"], "no list of values")
            return
        if field.flags:
            unit = printed.get("table", "").split(" ")[0]
            table = field.flags_by_unit.get(unit, field.flags)
            known = {bit.mask: bit.name for bit in table.bits}
        else:
            assert field.enum
            known = {value.value: value.name for value in field.enum.values}
        found: dict[int, str] = {}
        unread = []
        for row in printed["rows"]:
            if _future(row[-1]):
                continue
            number = _number(row[0], field.format.maximum)
            if number is None:
                unread.append(row[0])
            else:
                if row[0].startswith("to ") and found:  # "0x02 Bay 2 to 0x06 Bay 6"
                    found.update(dict.fromkeys(range(next(reversed(found)) + 1, number), ""))
                found[number] = row[1] if len(row) == 2 else ""
                if len(row) == 3 and row[1].isdigit():
                    self.same(
                        f"{place}/{number:#x}/bit",
                        path,
                        f"{1 << (int(row[1]) - 1):#x}",
                        f"{number:#x}",
                    )
        self.compared += len(printed["rows"])
        if set(found) != set(known) or unread:
            extra = [f"{n:#x}" for n in sorted(set(found) - set(known))] + unread
            missing = [known[n] for n in sorted(set(known) - set(found))]
            self.differs(
                place,
                path,
                f"{', '.join(extra) or 'nothing'} beyond the registry",
                f"{', '.join(missing) or 'nothing'} beyond the document",
            )
        for number, symbol in found.items():
            if _SYMBOL.match(symbol) and number in known:
                self.same(f"{place}/{symbol.lower()}", path, symbol.lower(), known[number].lower())

    def all_fields(self, message: Message) -> list[Field]:
        found = [field for layout in message.layouts for field in layout.all_fields]
        if (
            message.set
        ):  # a table may stand at one member of a set and mean the parameter of another
            for other in self.protocol.messages:
                if other.set and other.set[0] == message.set[0] and other is not message:
                    found += [f for layout in other.layouts for f in layout.all_fields]
        return found

    def limits(self, message: Message, printed: Json, path: Path) -> None:
        place = f"ranges/{message.name}/{squash(printed['of'])}"
        field = self.aliases.get(squash(printed["of"]))
        field = field or _find_field(self.all_fields(message), printed["of"], listed=False)
        if field is None:
            self.differs(place, path, printed["of"], "no such field")
            return
        place = f"ranges/{message.name}/{field.name}"
        encoded = {
            "from": field.minimum,
            "to": field.maximum,
            "default": field.default,
            "fixed": field.constant if field.constant is not None else field.default,
        }
        if encoded["fixed"] is None:
            del encoded["fixed"]  # fixed for some units only; the note says for which
        for key, value in encoded.items():
            if key not in printed:
                continue
            text = str(printed[key])
            if _NAME.match(text):
                continue  # a limit that is itself a field, such as Wnd0
            number = _number(text, field.format.maximum)
            factor = field.quantity.factor if field.quantity and field.unit == "ms" else None
            if factor and (time := _TIME.match(text)):  # a limit in time, such as 10,000s
                ms = int(time[1].replace(",", "")) * (1 if time[2] else 1000)
                number = int(ms * factor.counts_per_unit)
            self.compared += 1
            if value is None or value not in (number, _hex(text)):
                self.differs(f"{place}/{key}", path, text, value)

    # Contents, summary, lists

    def contents(self) -> None:
        for index, row in enumerate(self.document.data["rows"]):
            path = ("rows", index)
            if row.get("damaged"):
                self.differs(f"contents/line-{row['line']}", path, row["text"], "one row a message")
                self.listed |= {self.canonical(name, path) for name, _ in row.get("names", [])}
                continue
            message = self.named("contents", row["name"], row["id"], path)
            if message is None:
                continue
            self.listed.add(message.name)
            place = f"contents/{message.name}"
            self.same(f"{place}/id", path, row["id"], self.id_of(message))
            if "page" in row:
                self.same(f"{place}/page", path, row["page"], str(message.pages[0]))
            if row.get("run_together"):
                self.differs("contents/run-together", path, "id and page in one", "id, page")
        for name in sorted(self.headed - self.listed):
            self.differs(f"contents/{name}/missing", ("rows",), "nothing", name)

    def summary(self) -> None:
        for index, row in enumerate(self.document.data["rows"]):
            path: Path = ("rows", index)
            message = self.named("summary", row["name"], row["id"], path)
            if message:
                self.same(f"summary/{message.name}/id", path, row["id"], self.id_of(message))
        for index, row in enumerate(self.document.data["mentions"]):
            path = ("mentions", index)
            message = self.named("mention", row["name"], row.get("id"), path)
            if message and "id" in row:
                self.same(f"mention/{message.name}/id", path, row["id"], self.id_of(message))

    def lists(self) -> None:
        data = self.document.data
        for key, printed in data["lists"].items():
            entry = self.protocol.units.get("lists", {}).get(key)
            if entry is None:
                self.differs(f"lists/{key}", ("lists", key), printed["title"], "no such list")
                continue
            self.one_list(key, printed, entry)
        self.units(data)

    def one_list(self, key: str, printed: Json, entry: Json) -> None:
        seen: set[str] = set()
        self.same(f"lists/{key}/page", ("lists", key), printed["page"], entry["page"])
        rows = [
            (path, row, self.canonical(row["name"], path))
            for path, row in self.rows_of_list(key, printed)
        ]
        ids = {(name, row["id"]) for _, row, name in rows}
        right = {m.name for m in self.messages.values() if (m.name, self.id_of(m)) in ids}
        for path, row, name in rows:
            message = self.messages.get(name)
            match = _ID.match(row["id"])
            meant = self.by_id.get(int(match[1], 16)) if match else None
            if meant is not None and meant is not message:
                if name in right or name not in entry["messages"] or message is None:
                    self.same(f"lists/{key}/{meant.name}/name", path, name, meant.name)
                    message = meant
                else:
                    self.same(f"lists/{key}/{name}/id", path, row["id"], name)
            if message is None:
                self.unknown.append((self.document.place(*path), row["name"]))
                continue
            self.witnessed.add(message.name)
            seen.add(message.name)
            place = f"lists/{key}/{message.name}"
            if row["id"]:
                self.same(f"{place}/id", path, row["id"], self.id_of(message))
            if "page" in row:
                self.same(f"{place}/page", path, row["page"], str(message.pages[0]))
            if message.name not in entry["messages"]:
                self.differs(f"{place}/extra", path, message.name, "not in the list")
        for name in entry["messages"]:
            if name not in seen:
                self.differs(f"lists/{key}/{name}/missing", ("lists", key), "nothing", name)
        for name in entry.get("completes", []):
            self.differs(f"lists/{key}/{name}/missing", ("lists", key), "nothing", name)
        for name in entry.get("misprinted", {}):
            if f"lists/{key}/{name}/name" not in self.differences:
                self.differs(f"lists/{key}/{name}/misprinted", ("lists", key), name, "as printed")

    def rows_of_list(self, key: str, printed: Json) -> Iterator[tuple[Path, Json]]:
        """Yield the rows of a list; of a damaged one what can be read."""
        for index, row in enumerate(printed["rows"]):
            path = ("lists", key, "rows", index)
            if not row.get("damaged"):
                yield path, row
                continue
            self.differs(f"lists/{key}/line-{row['line']}", path, row["text"], "one row a message")
            for name, id in row["names"]:
                yield path, {"name": name, "id": id}

    def units(self, data: Json) -> None:
        units = self.protocol.units.get("units", {})
        for kind in ("motor_controllers", "piezo_controllers"):
            for index, row in enumerate(data.get(kind, [])):
                name = next((cell for cell in row if isinstance(cell, str) and cell in units), None)
                if name is None:
                    self.differs(f"units/{row[-2]}", (kind, index), row[-2], "no such unit")
                self.compared += 1
        prefixes = {
            int(unit[key]): name
            for name, unit in units.items()
            for key in ("usb_prefix", "card_usb_prefix")
            if key in unit
        }
        printed_prefixes = set()
        for index, row in enumerate(data.get("usb_prefixes", [])):
            prefix = int(row[1][:2])
            printed_prefixes.add(prefix)
            codes = row[3].split("/")
            numbers = [
                {units.get(c, {}).get(key) for key in ("usb_prefix", "card_usb_prefix")}
                for c in codes
            ]
            if not all(prefix in of_unit for of_unit in numbers):
                encoded = f"{prefix}: {prefixes.get(prefix, 'no unit')}"
                self.differs(f"prefixes/{prefix}", ("usb_prefixes", index), row[3], encoded)
            self.compared += 1
        for prefix in sorted(set(prefixes) - printed_prefixes):
            self.differs(f"prefixes/{prefix}/missing", ("usb_prefixes",), "nothing", prefix)
        seen: set[str] = set()
        devices = self.protocol.framing["devices"]
        known = {f"0x{a:02X}" for a in (self.protocol.framing["host"], *devices)}
        for index, row in enumerate(data.get("addresses", [])):
            if row[1] in seen:
                self.differs(f"addresses/{row[1]}/twice", ("addresses", index), row[1], "once")
            self.same(f"addresses/{row[1]}", ("addresses", index), row[1] in known, True)
            seen.add(row[1])
        if seen and known - seen:
            printed = ", ".join(sorted(seen))
            self.differs(
                "addresses/missing", ("addresses",), printed, ", ".join(sorted(known - seen))
            )


def _same_name(printed: str, field: Field) -> bool:
    if squash(printed) == squash(field.name):
        return True
    return field.role == "reserved" and squash(printed) in _FILLERS


def _find_field(fields: list[Field], printed: str, *, listed: bool) -> Field | None:
    """Find the field that a list of values, or a range, is printed for."""
    if listed:
        fields = [f for f in fields if f.enum or f.flags or f.format.kind == "bytes"]
    wanted = squash(printed)
    for field in fields:
        if squash(field.name) in (wanted, wanted.removesuffix("s")):
            return field
    for field in fields:
        if wanted.removesuffix("s") in squash(field.name) or squash(field.name) in wanted:
            return field
    return fields[0] if listed and len({field.name for field in fields}) == 1 else None


def _future(text: str) -> bool:
    return "future" in text.lower()


def _number(text: str, maximum: int) -> int | None:
    match = _NUMBER.match(text.strip().removeprefix("to "))
    if match is None:
        return None
    digits = match[2].replace(",", "")
    hexadecimal = "0x" in text or not digits.isdigit()
    value = int(digits, 16 if hexadecimal else 10)
    value = -value if match[1] else value
    if value < 0 and maximum == 0xFF and "0x" in text:
        return value & 0xFF
    return value


def _hex(text: str) -> int | None:
    try:
        return int(text.replace(",", ""), 16)
    except ValueError:
        return None


def iterate(differences: dict[str, Difference]) -> Iterator[Difference]:
    """Yield the differences by place."""
    for place in sorted(differences):
        yield differences[place]
