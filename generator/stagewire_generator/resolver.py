"""From loaded YAML to the frozen model: references followed, sets opened, offsets counted.

Whatever cannot be resolved becomes a diagnostic and is left out of the model, so that one error does
not hide the next.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import replace
from fractions import Fraction
from typing import Any, TypeVar

from stagewire_generator import model
from stagewire_generator.diagnostics import Diagnostics, Place
from stagewire_generator.model import Json
from stagewire_generator.naming import can_name_chapter, can_name_file, can_name_package
from stagewire_generator.strict_yaml import Document, KeyPath

__all__ = ["resolve"]

_FORMAT = re.compile(r"([a-z][a-z0-9]*)(?:\[([1-9][0-9]{0,2})\])?\Z")
_FACTOR = re.compile(r"(?:counts_per_[a-z0-9_]+|[a-z0-9_]+_per_count)\Z")
_RATIONAL = re.compile(r"[1-9][0-9]*(?:/[1-9][0-9]*)?\Z")
_ROLES = ("set", "req", "get")

T = TypeVar("T")


def resolve(files: Mapping[str, list[Document]], diagnostics: Diagnostics) -> model.Protocol:
    """Make the model of one protocol from its files, sorted by kind."""
    return _Resolver(files, diagnostics).protocol()


class _Resolver:
    def __init__(self, files: Mapping[str, list[Document]], diagnostics: Diagnostics) -> None:
        self.files = files
        self.diagnostics = diagnostics
        self.head = files["protocol"][0]
        self.formats: Json = self.head.data["formats"]
        self.quantities: dict[str, model.Quantity] = {}
        self.enumerations: dict[str, model.Enumeration] = {}
        self.flags: dict[str, model.FlagTable] = {}
        self.blocks: dict[str, tuple[Document, KeyPath, Json]] = {}
        self.messages: dict[str, model.Message] = {}
        self.sets: dict[str, model.ParameterSet] = {}
        self.chapters: dict[str, model.Chapter] = {}
        self.errata: dict[str, model.Erratum] = {}
        self.errata_of: dict[str, list[str]] = {}  # MESSAGE.field -> slugs

    def protocol(self) -> model.Protocol:
        head = self.head.data
        self.names()
        for _, id, entry, place in self.entries("errata", "errata", self.errata):
            self.errata[id] = _erratum(id, entry, place)
            for field in self.errata[id].fields:
                self.errata_of.setdefault(field, []).append(id)
        for _, name, entry, place in self.entries("quantities", "quantities", self.quantities):
            self.quantities[name] = self.quantity(name, entry, place)
        self.definitions()
        for document in self.files.get("messages", []):
            self.contents(document)
        controllers, stages = self.stages()
        units: Json = self.files["units"][0].data if self.files.get("units") else {}
        ordered = sorted(self.messages.values(), key=lambda m: (m.id is None, m.id or 0, m.name))
        return model.Protocol(
            name=head["protocol"],
            title=head["title"],
            summary=head["summary"],
            document=head["document"],
            firmware=_firmware(head),
            package=head["python"]["package"],
            python_title=head["python"].get("title", head["title"]),
            name_prefix=head.get("name_prefix", ""),
            formats=self.formats,
            framing=head["framing"],
            contexts=head.get("contexts", {}),
            chapters=tuple(sorted(self.chapters.values(), key=lambda c: (c.order, c.name))),
            messages=tuple(ordered),
            sets=tuple(self.sets[name] for name in sorted(self.sets)),
            enumerations=tuple(self.enumerations.values()),
            flags=tuple(self.flags.values()),
            quantities=tuple(self.quantities.values()),
            controllers=controllers,
            stages=stages,
            units=units,
            errata=tuple(self.errata[id] for id in sorted(self.errata)),
            examples=self.files["examples"][0].data if self.files.get("examples") else {},
            captures=self.files["captures"][0].data if self.files.get("captures") else {},
        )

    # Helpers

    def entries(
        self, kind: str, section: str, table: Mapping[str, object]
    ) -> Iterator[tuple[Document, str, Json, Place]]:
        """Yield each entry of ``section`` in the files of a kind; a name counts once."""
        for document in self.files.get(kind, []):
            for name, entry in document.data.get(section, {}).items():
                place = document.place(section, name)
                if name in table:
                    self.diagnostics.add(place, "SW020", f"{name} is defined twice")
                else:
                    yield document, name, entry, place

    def look_up(self, table: Mapping[str, T], name: str, kind: str, place: Place) -> T | None:
        found = table.get(name)
        if found is None:
            self.diagnostics.add(place, "SW021", f"no {kind} is named {name}")
        return found

    def format(self, text: str, place: Place) -> model.Format | None:
        match = _FORMAT.match(text)
        entry = self.formats.get(match[1]) if match else None
        if match is None or entry is None:
            known = ", ".join(self.formats)
            self.diagnostics.add(place, "SW021", f"no format is named {text} (there are: {known})")
            return None
        count = int(match[2]) if match[2] else None
        if count is None:
            return model.Format(text, entry["size"], entry["signed"], "integer")
        kind = "text" if match[1] == "char" else "bytes"
        return model.Format(text, count * entry["size"], False, kind)

    def names(self) -> None:
        protocol, package = self.head.data["protocol"], self.head.data["python"]["package"]
        if not can_name_file(protocol):
            place = self.head.place("protocol")
            self.diagnostics.add(place, "SW023", f"{protocol} as the name of a file")
        if not can_name_package(package):
            place = self.head.place("python", "package")
            self.diagnostics.add(place, "SW023", f"{package} as the name of a package")

    # Quantities, stages

    def factor(self, entry: Json, place: Place) -> model.Factor | None:
        keys = [key for key in entry if _FACTOR.match(key)]
        if len(keys) != 1:
            self.diagnostics.add(
                place, "SW037", "a scale has one factor, counts_per_UNIT or UNIT_per_count"
            )
            return None
        text = str(entry[keys[0]])
        if not _RATIONAL.match(text):
            self.diagnostics.add(place, "SW037", f"{keys[0]}: {text} is no exact positive rational")
            return None
        printed = str(entry.get("printed", ""))
        source = entry.get("source", "")
        return model.Factor(keys[0], Fraction(text), printed, source, entry.get("page"))

    def quantity(self, name: str, entry: Json, place: Place) -> model.Quantity:
        scale = entry["scale"]
        found = self.scale(scale, place)
        factor, rule = (found, {}) if isinstance(found, model.Factor) else (None, found)
        unit = entry.get("unit", "")
        return model.Quantity(name, unit, entry["page"], entry["summary"], factor, rule, place)

    def scale(self, scale: Json, place: Place) -> model.Factor | Json:
        """Return an exact factor, or a scale that depends on something with its factors made exact."""
        if "by" not in scale and "unknown" not in scale:
            return self.factor(scale, place) or {}
        rule = dict(scale)
        if "units" in rule:
            factors = {unit: self.factor(entry, place) for unit, entry in rule["units"].items()}
            rule["units"] = {unit: factor for unit, factor in factors.items() if factor}
        if "cases" in rule:
            rule["cases"] = {
                name: {**case, "scale": self.scale(case["scale"], place)}
                for name, case in rule["cases"].items()
            }
        return rule

    def stages(self) -> tuple[tuple[model.Controller, ...], tuple[model.Stage, ...]]:
        controllers: dict[str, model.Controller] = {}
        stages: dict[str, model.Stage] = {}
        for document in self.files.get("stages", []):
            for name, entry in document.data["controllers"].items():
                place = document.place("controllers", name)
                controllers[name] = model.Controller(name, tuple(entry["units"]), place)
            for name, entry in document.data["stages"].items():
                path = ("stages", name)
                scales: dict[str, dict[str, model.Factor | str]] = {}
                for controller, quantities in entry["controllers"].items():
                    place = document.place(*path, "controllers", controller)
                    self.look_up(controllers, controller, "controller", place)
                    for quantity, scale in quantities.items():
                        place = document.place(*path, "controllers", controller, quantity)
                        self.look_up(self.quantities, quantity, "quantity", place)
                        factor: model.Factor | str | None
                        factor = scale.get("unknown") or self.factor(scale, place)
                        if factor:
                            scales.setdefault(controller, {})[quantity] = factor
                stages[name] = model.Stage(
                    name, entry["title"], entry["page"], scales, document.place(*path)
                )
        return tuple(controllers.values()), tuple(stages.values())

    # Messages

    def definitions(self) -> None:
        for document in self.files.get("messages", []):
            data = document.data
            chapter = data["chapter"]
            if not can_name_chapter(chapter):
                what = f"{chapter} as the name of a module"
                self.diagnostics.add(document.place("chapter"), "SW023", what)
            described = model.Chapter(
                chapter, data["title"], data["page"], data["order"], data.get("summary", "")
            )
            if self.chapters.setdefault(chapter, described) != described:
                what = f"the chapter {chapter} is described otherwise in another file"
                self.diagnostics.add(document.place("chapter"), "SW020", what)
        for _, name, entry, place in self.entries("messages", "enumerations", self.enumerations):
            values = tuple(
                model.EnumValue(
                    key,
                    value["value"],
                    value.get("note", ""),
                    value.get("keyboard", ""),
                    value.get("reserved", False),
                )
                for key, value in entry["values"].items()
            )
            summary = entry.get("summary", "")
            self.enumerations[name] = model.Enumeration(name, entry["page"], summary, values, place)
        for _, name, entry, place in self.entries("messages", "flags", self.flags):
            format = self.format(entry["format"], place)
            if format is None:
                continue
            bits = tuple(
                model.FlagBit(key, bit["bit"], bit.get("note", ""))
                for key, bit in entry["bits"].items()
            )
            summary = entry.get("summary", "")
            self.flags[name] = model.FlagTable(name, entry["page"], summary, format, bits, place)
        for document, name, entry, _ in self.entries("messages", "blocks", self.blocks):
            self.blocks[name] = (document, ("blocks", name), entry)

    def contents(self, document: Document) -> None:
        for name, entry in document.data.get("parameter_sets", {}).items():
            self.parameter_set(document, name, entry)
        for name, entry in document.data.get("messages", {}).items():
            self.single(document, name, entry)
        for name, entry in document.data.get("commands", {}).items():
            self.command(document, "commands", name, entry)
        for name, entry in document.data.get("setup_commands", {}).items():
            self.command(document, "setup_commands", name, entry)

    def words(
        self, group: str, verb: str, spelling: str, name: str, place: Place
    ) -> tuple[str, ...]:
        words = tuple(w for w in (group.lower(), verb, *spelling.split()) if w)
        if "".join(words) != name.lower().replace("_", ""):
            self.diagnostics.add(place, "SW024", f"{' '.join(words)} does not spell {name}")
        return words

    def group(self, name: str) -> tuple[str, str]:
        group, _, rest = name.partition("_")
        return (group, rest) if group in self.head.data.get("groups", ()) else ("", name)

    def parameter_set(self, document: Document, name: str, entry: Json) -> None:
        path = ("parameter_sets", name)
        place = document.place(*path)
        group, rest = self.group(name)
        if name in self.sets:
            self.diagnostics.add(place, "SW020", f"{name} is defined twice")
            return
        members = {
            role: "_".join(part for part in (group, role.upper(), rest) if part)
            for role in _ROLES
            if role in entry["ids"]
        }
        words = self.words(group, "", entry["spelling"], name, place)
        self.sets[name] = model.ParameterSet(name, words, members, place)
        for role, message in members.items():
            if role == "req":
                at = (*path, "req")
                layouts: tuple[model.Layout, ...]
                layouts = (self.header(document, at, entry.get("req", {}), entry["page"]),)
            else:
                layouts = self.layouts(document, path, entry, role)
            exchange = dict(entry.get("exchange", {}).get(role, {}))
            if role == "req" and "get" in members:
                exchange.setdefault("answered_by", [members["get"]])
            page = entry.get("pages", {}).get(role, entry["page"])
            self.message(
                document, path, message, entry, layouts, exchange,
                id=entry["ids"][role],
                words=self.words(group, role, entry["spelling"], message, place),
                pages=tuple(sorted({entry["page"], page})),
                direction="to_host" if role == "get" else "to_controller",
                set=(name, role),
            )  # fmt: skip

    def single(self, document: Document, name: str, entry: Json) -> None:
        path = ("messages", name)
        group, _ = self.group(name)
        layouts: tuple[model.Layout, ...] = ()
        if entry.get("layout") != "undocumented":
            layouts = self.layouts(document, path, entry, "")
        self.message(
            document, path, name, entry, layouts, dict(entry.get("exchange", {})),
            id=None if entry["id"] == "unknown" else entry["id"],
            words=self.words(group, "", entry["spelling"], name, document.place(*path)),
            pages=tuple(sorted({entry["page"], *entry.get("more_pages", ())})),
            direction=entry["direction"],
            set=None,
        )  # fmt: skip

    def command(self, document: Document, section: str, name: str, entry: Json) -> None:
        path = (section, name)
        layouts: list[model.Layout] = []
        whole = True
        for form in ("request", "reply"):
            if form in entry or form == "request":
                at = (*path, form) if form in entry else path
                layout, all_made = self.request_or_reply(document, at, entry, form)
                layouts.append(layout)
                whole = whole and all_made
        size = None if entry.get("size", "none") == "none" else entry["size"]
        if whole:
            self.check_size(name, size, {x.form: x.length for x in layouts}, document.place(*path))
        self.message(
            document, path, name, entry, tuple(layouts), dict(entry.get("exchange", {})),
            id=entry["byte"],
            words=tuple(name.lower().split("_")),
            pages=(entry["page"],),
            direction="to_controller",
            set=None,
            kind="command" if section == "commands" else "setup",
            title=entry["title"],
            keyboard=entry.get("keyboard", ""),
            size=size,
            dummy=entry.get("dummy", False),
            firmware=_firmware(entry),
        )  # fmt: skip

    def request_or_reply(
        self, document: Document, path: KeyPath, command: Json, form: str
    ) -> tuple[model.Layout, bool]:
        """Return the request or the reply of a command, and whether all its fields could be made.

        Its length is the sum of its fields.
        """
        entry, page = command.get(form, {}), command["page"]
        fields, all_made = self.fields(document, (*path, "fields"), entry.get("fields", {}), page)
        length = sum(field.format.size for field in fields)
        note, place = entry.get("note", ""), document.place(*path)
        return model.Layout(form, {}, None, None, length, fields, note, place), all_made

    def check_size(
        self, name: str, size: int | None, lengths: Mapping[str, int], place: Place
    ) -> None:
        """Check that a size is that of the data of the request, or else of the reply."""
        request, data = lengths["request"], lengths["request"] or lengths.get("reply", 0)
        if size is None and request:
            what = f"{name} has no size slot, and {request} bytes of data"
            hint = "only a command without data may lack it"
            self.diagnostics.add(place, "SW031", what, hint)
        elif size not in (None, data):
            what = f"{name}: the size is {size}, the fields take {data} bytes"
            self.diagnostics.add(place, "SW031", what, "correct the size or the fields")

    def message(
        self,
        document: Document,
        path: KeyPath,
        name: str,
        entry: Json,
        layouts: tuple[model.Layout, ...],
        exchange: Json,
        **facts: Any,
    ) -> None:
        place = document.place(*path)
        if name in self.messages:
            self.diagnostics.add(place, "SW020", f"{name} is defined twice")
            return
        errata = tuple(id for id, e in sorted(self.errata.items()) if name in e.messages)
        owners = {name} | ({facts["set"][0]} if facts["set"] else set())
        self.messages[name] = model.Message(
            name=name,
            chapter=document.data["chapter"],
            summary=entry["summary"],
            note=entry.get("note", ""),
            exchange=exchange,
            layouts=tuple(self.with_errata(layout, owners) for layout in layouts),
            errata=errata,
            place=place,
            **facts,
        )

    def layouts(
        self, document: Document, path: KeyPath, entry: Json, role: str
    ) -> tuple[model.Layout, ...]:
        page = entry["page"]
        message = path[-1]
        if "layouts" in entry:
            found = []
            for key, layout in entry["layouts"].items():
                at = (*path, "layouts", key)
                form = key.replace("_", ":", 1)
                if form == "header":
                    found.append(self.header(document, at, layout, page))
                else:
                    found.append(self.data(document, at, layout, form, page, str(message)))
            return tuple(found)
        if "header" in entry:
            return (self.header(document, (*path, "header"), entry["header"], page),)
        if "data" in entry:
            at = (*path, "data")
            return (self.data(document, at, entry["data"], "data", page, str(message)),)
        bare = {**entry, "note": ""}  # the note is the message's
        return (self.data(document, path, bare, "data", page, str(message)),)

    def header(self, document: Document, path: KeyPath, entry: Json, page: int) -> model.Layout:
        params: list[model.Field | None] = []
        for index, key in enumerate(("param1", "param2")):
            param = entry.get(key)
            if param is None:
                params.append(None)
                continue
            spelled = {"format": "byte", "name": key, **param}
            if "constant" in param and "name" not in param:
                spelled["role"] = "constant"
            params.append(
                self.field(document, (*path, key), spelled["name"], spelled, index + 2, page)
            )
        place = document.place(*path)
        note = entry.get("note", "")
        only_zero = entry.get("only_zero", False)
        return model.Layout("header", {}, params[0], params[1], 0, (), note, place, only_zero)

    def data(
        self,
        document: Document,
        path: KeyPath,
        entry: Json,
        form: str,
        page: int,
        message: str,
    ) -> model.Layout:
        place = document.place(*path)
        when = entry.get("when", {})
        note = entry.get("note", "")
        length = entry.get("length")
        fields_path = (*path, "fields")
        entries = entry.get("fields")
        whole = True
        if "block" in entry:
            block = self.look_up(self.blocks, entry["block"], "block", place)
            if block is None:
                whole = False
            else:
                document, fields_path, shared = block
                fields_path = (*fields_path, "fields")
                entries, page = shared["fields"], shared.get("page", page)
                length = length if length is not None else shared["length"]
        fields, all_made = self.fields(document, fields_path, entries or {}, page)
        taken = sum(field.format.size for field in fields)
        if whole and all_made and taken != length:
            self.diagnostics.add(
                place, "SW031", f"{message}: the fields take {taken} bytes, the length is {length}"
            )
        return model.Layout(form, when, None, None, length or 0, fields, note, place)

    def fields(
        self, document: Document, path: KeyPath, entries: Json, page: int
    ) -> tuple[tuple[model.Field, ...], bool]:
        """Return the fields, one after the other, and whether all could be made."""
        made: list[model.Field] = []
        offset = 0
        for name, spelled in entries.items():
            field = self.field(document, (*path, name), name, spelled, offset, page)
            if field is not None:
                made.append(field)
                offset += field.format.size
        return tuple(made), len(made) == len(entries)

    def field(
        self,
        document: Document,
        path: KeyPath,
        name: str,
        entry: Json,
        offset: int,
        page: int,
    ) -> model.Field | None:
        place = document.place(*path)
        format = self.format(entry["format"], place)
        if format is None:
            return None
        facts: Json = {}
        for key, table, kind in (
            ("quantity", self.quantities, "quantity"),
            ("enum", self.enumerations, "enumeration"),
            ("flags", self.flags, "flag table"),
        ):
            if key in entry:
                facts[key] = self.look_up(table, entry[key], kind, place)
        by_unit = {}
        for unit, table_name in entry.get("flags_by_unit", {}).items():
            found = self.look_up(self.flags, table_name, "flag table", place)
            if found:
                by_unit[unit] = found
        role = entry.get("role", "value")
        return model.Field(
            name=name,
            offset=offset,
            format=format,
            role=role,
            minimum=entry.get("minimum", format.minimum if format.kind == "integer" else 0),
            maximum=entry.get("maximum", format.maximum if format.kind == "integer" else 0),
            ranged="minimum" in entry or "maximum" in entry,
            open=entry.get("open", False),
            page=entry.get("page", page),
            place=place,
            default=entry.get("default"),
            constant=entry.get("constant", entry.get("value")),
            flags_by_unit=by_unit,
            note=entry.get("note", ""),
            **facts,
        )

    def with_errata(self, layout: model.Layout, owners: set[str]) -> model.Layout:
        """Return the layout with the errata of its fields, which name the message or its set."""

        def marked(field: model.Field) -> model.Field:
            names = [f"{owner}.{field.name}" for owner in owners]
            found = tuple(sorted({id for name in names for id in self.errata_of.get(name, ())}))
            return replace(field, errata=found) if found else field

        return replace(
            layout,
            param1=layout.param1 and marked(layout.param1),
            param2=layout.param2 and marked(layout.param2),
            fields=tuple(marked(field) for field in layout.fields),
        )


def _firmware(entry: Json) -> tuple[model.Firmware, ...]:
    return tuple(
        model.Firmware(fact["version"], fact["note"], fact.get("page"))
        for fact in entry.get("firmware", ())
    )


def _erratum(id: str, entry: Json, place: Place) -> model.Erratum:
    return model.Erratum(
        id=id,
        pages=tuple(entry["pages"]),
        subject=entry["subject"],
        messages=tuple(entry.get("messages", ())),
        fields=tuple(entry.get("fields", ())),
        printed=str(entry["printed"]),
        encoded=str(entry["encoded"]),
        evidence=entry["evidence"],
        kind=entry["class"],
        origin=entry["origin"],
        places=tuple(entry.get("places", ())),
        place=place,
    )
