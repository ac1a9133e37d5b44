"""The module of facts: the units, the settings that decide on scales, and the rules of quantities."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from fractions import Fraction
from itertools import combinations
from typing import NamedTuple

from stagewire_generator.framing import rules_of
from stagewire_generator.model import Json, Protocol, firmware_parts
from stagewire_generator.model_fields import NO_BITS, Field, FlagTable
from stagewire_generator.model_scales import (
    Factor,
    Quantity,
)
from stagewire_generator.targets.documentation import where, where_all
from stagewire_generator.targets.python.brackets import (
    Nested,
    Source,
    Text,
    call,
    keyed,
    mapping,
)
from stagewire_generator.targets.python.devices.arguments import table_class
from stagewire_generator.targets.python.devices.classes_view import enabling_entries
from stagewire_generator.targets.python.devices.hindrances_view import (
    has_joint_status,
    hindrance_entries,
    hindrance_lists,
    said_by,
)
from stagewire_generator.targets.python.devices.needs_view import (
    farewell_entries,
    need_entries,
    order_entries,
    position_entries,
)
from stagewire_generator.targets.python.devices.parts import UnitPlan
from stagewire_generator.targets.python.devices.plan import Call, device_framing_of
from stagewire_generator.targets.python.devices.tables_view import TableWriter, class_of
from stagewire_generator.targets.python.named_view import scale_of
from stagewire_generator.targets.python.source import literal


def setting_entries(protocol: Protocol) -> tuple[Source, ...]:
    """Return an entry for each setting that a scale depends on."""
    return tuple(_setting(protocol, name, entry) for name, entry in protocol.settings.items())


def quantity_entries(protocol: Protocol) -> tuple[Source, ...]:
    """Return an entry for each quantity, with the rule of its scale."""
    quantities = sorted(protocol.quantities, key=lambda quantity: quantity.name)
    return tuple(
        keyed(literal(q.name), _by_stage(q) if q.rotary_unit else _rule(q.factor or q.rule, q.unit))
        for q in quantities
    )


def _by_stage(quantity: Quantity) -> str:
    return f"ByStage({literal(quantity.unit)}, rotary_unit={literal(quantity.rotary_unit)})"


def alias_entries(protocol: Protocol) -> tuple[Source, ...]:
    """Return an entry for each unit that is newer than the document."""
    return tuple(
        Nested(f"{literal(name)}: Alias(", tuple(_alias(protocol, name, entry)), ")")
        for name, entry in protocol.units.get("aliases", {}).items()
    )


def unsupported_entries(protocol: Protocol) -> tuple[Source, ...]:
    """Return an entry for each unit that is known but cannot be used."""
    return tuple(
        Nested(f"{literal(name)}: Unsupported(", tuple(_unsupported(protocol, name, entry)), ")")
        for name, entry in protocol.units.get("unsupported", {}).items()
    )


def _unsupported(protocol: Protocol, name: str, entry: Json) -> Iterator[Source]:
    yield literal(name)
    yield Text("", entry["title"])
    yield Text("reason=", entry["reason"])
    yield from prefixes_of(protocol, name, entry)


def prefixes_of(protocol: Protocol, name: str, entry: Json) -> Iterator[Source]:
    """Yield the known prefixes of the serial numbers of a unit, an alias or an unsupported unit."""
    printed = {entry[key] for key in ("usb_prefix", "card_usb_prefix") if key in entry}
    printed |= {*entry.get("prefixes", ())}
    known = {
        int(prefix)
        for prefix, found in protocol.units.get("known_prefixes", {}).items()
        if name in (found["unit"], *found.get("shared_with", ()))
    }
    if printed | known:
        yield Nested("prefixes=(", tuple(map(str, sorted(printed | known))), ")")
    alike = [
        prefix
        for prefix, found in protocol.units.get("known_prefixes", {}).items()
        if found.get("distinguished_by", "model") != "model" and int(prefix) in printed | known
    ]
    if alike:
        yield Nested("alike=(", tuple(sorted(alike)), ")")


def reported_as(entry: Json) -> Iterator[Source]:
    """Yield the models that a unit or alias is known to report besides its name."""
    if "reported_as" in entry:
        yield Nested("reported_as=(", tuple(map(literal, entry["reported_as"])), ")")


def _setting(protocol: Protocol, name: str, entry: Json) -> Nested:
    unit = entry.get("unit", "")
    told = [_told(protocol, unit, *teller) for teller in entry["told_by"].items()]
    items: list[Source] = [literal(name), literal(unit), Nested("(", tuple(told), ")")]
    if "quantity" in entry:
        items.append(f"quantity={literal(entry['quantity'])}")
    return Nested(f"{literal(name)}: Setting(", tuple(items), ")")


def _told(protocol: Protocol, unit: str, owner: str, teller: Json) -> Nested:
    """Return a source of a setting: a parameter set, its field, and the meaning of its values."""
    messages = {m.set[1]: m for m in protocol.messages if m.set and m.set[0] == owner}
    items: list[Source] = []
    for role in ("set", "req", "get"):
        member = messages.get(role)
        items.append(f"{role}={class_of(member, member.layouts[0])}" if member else f"{role}=None")
    items.append(f"field={literal(teller['field'])}")
    content = messages.get("get") or messages["set"]
    fields = {f.name: f for f in content.layouts[0].all_fields}
    if "while" in teller:
        table = fields[teller["while"]["field"]].enum
        assert table  # a lint rule ensures it
        active = [f"0x{v.value:02X}" for v in table.values if v.name in teller["while"]["values"]]
        state = (literal(teller["while"]["field"]), Nested("(", tuple(active), ")"))
        items.append(Nested("active=(", state, ")"))
    if "not_on" in teller:
        items.append(Nested("not_on=(", tuple(map(literal, teller["not_on"])), ")"))
    field = fields[teller["field"]]
    if field.enum:
        values = teller.get("values", {})
        named = [v for v in field.enum.values if not unit or v.name in values]
        pairs = [
            f"0x{v.value:02X}: {_number(values[v.name]) if unit else literal(v.name)}"
            for v in named
        ]
        items.append(Nested("values={", tuple(pairs), "}"))
    elif field.flags and unit:
        items.append(Nested("values={", tuple(_of_bits(field.flags, teller["values"])), "}"))
    elif field.quantity and unit:
        items.append(f"scale=quantities.{field.quantity.name.upper()}")
    return Nested("Told(", tuple(items), ")")


def _of_bits(table: FlagTable, values: Json) -> Iterator[str]:
    """Yield every combination of the bits of a table and its value: the highest of those of its bits."""
    for count in range(len(table.bits) + 1):
        for bits in combinations(table.bits, count):
            found = [values[bit.name] for bit in bits] or [values[NO_BITS]]
            yield f"0x{sum(bit.mask for bit in bits):02X}: {_number(max(found, key=Fraction))}"


def _number(value: int | str) -> str:
    """Return an exact value: an integer, or a fraction."""
    exact = Fraction(value)
    if exact.denominator == 1:
        return str(exact.numerator)
    return f"Fraction({exact.numerator}, {exact.denominator})"


def _rule(rule: Factor | Json, unit: str) -> Source:
    """Return the rule of a scale."""
    if isinstance(rule, Factor):
        return scale_of(rule, unit)
    if "unknown" in rule:
        return Nested("UnknownScale(", (literal(unit), literal(rule["unknown"])), ")")
    if rule["by"] == "stage":
        return f"ByStage({literal(unit)})"
    if rule["by"] == "unit":
        units = [
            keyed(literal(name), _rule(factor, unit)) for name, factor in rule["units"].items()
        ]
        return Nested("ByUnit(", (Nested("{", tuple(units), "}"), literal(unit)), ")")
    if "cases" in rule:
        cases = [
            keyed(literal(name), _rule(case["scale"], case["unit"]))
            for name, case in rule["cases"].items()
        ]
        items: list[Source] = [literal(rule["setting"]), Nested("{", tuple(cases), "}")]
        ranges = [
            f"{literal(name)}: ({case['minimum']}, {case['maximum']})"
            for name, case in rule["cases"].items()
            if "minimum" in case
        ]
        if ranges:
            items.append(Nested("ranges={", tuple(ranges), "}"))
        return Nested("ByCase(", tuple(items), ")")
    return Nested(
        "BySetting(", (literal(rule["setting"]), str(rule["counts_at_setting"]), literal(unit)), ")"
    )


def _alias(protocol: Protocol, name: str, entry: Json) -> Iterator[Source]:
    yield literal(name)
    yield Text("", entry.get("title", ""))
    if "like" in entry:
        yield f"like={literal(entry['like'])}"
    if "source" in entry:
        yield Text("source=", entry["source"])
    yield from prefixes_of(protocol, name, entry)
    yield from reported_as(entry)
    groups = {c.name: c.aliases[name] for c in protocol.controllers if name in c.aliases}
    if groups:
        scales = tuple(Text(f"{literal(group)}: ", source) for group, source in groups.items())
        yield Nested("scales={", scales, "}")


_TOLD = {"identity": "identity", "bays": "bay_used"}


class FactsView(NamedTuple):
    """The module of facts.

    :param lists: statements with the messages of units and the states that prevent motions.
    :param units: the statement of the units; the other parameters are also statements.
    """

    lists: tuple[Nested, ...]
    units: Nested
    settings: Nested
    quantities: Nested
    aliases: Nested
    unsupported: tuple[Nested, ...]
    facts: Nested

    @property
    def statements(self) -> tuple[Nested, ...]:
        """All statements."""
        return (
            *self.lists, self.units, self.settings, self.quantities, self.aliases,
            *self.unsupported, self.facts
        )  # fmt: skip


def facts_view(protocol: Protocol, units: tuple[UnitPlan, ...], tables: TableWriter) -> FactsView:
    """Make the view of the module."""
    lists = {unit.messages: _list_name(unit.entry) for unit in reversed(units)}
    carried = {"quantities=": _carried(protocol), "settable=": _carried(protocol, sent=True)}
    entries = [_unit(protocol, unit, lists[unit.messages], tables, carried) for unit in units]
    facts: list[Source] = [
        "protocol=PROTOCOL",
        f"package={literal(protocol.package)}",
        "units=UNITS",
        "settings=SETTINGS",
        "quantities=QUANTITIES",
        "aliases=ALIASES",
    ]
    for made in tables.calls:
        if made.message.tells in _TOLD:
            facts.append(f"{_TOLD[made.message.tells]}=t.{made.constant}")
    unsupported = unsupported_entries(protocol)
    if unsupported:
        facts.append("unsupported=UNSUPPORTED")
    if channels := _channels(protocol):
        facts.append(f"channels={channels}")
    return FactsView(
        lists=(
            *(
                _frozenset(f"{name} = ", sorted(names))
                for names, name in sorted(lists.items(), key=lambda x: x[1])
            ),
            *hindrance_lists(protocol),
        ),
        units=mapping("UNITS: dict[str, Unit] = ", entries),
        settings=mapping("SETTINGS: dict[str, Setting] = ", setting_entries(protocol)),
        quantities=mapping("QUANTITIES: dict[str, Rule] = ", quantity_entries(protocol)),
        aliases=mapping("ALIASES: dict[str, Alias] = ", alias_entries(protocol)),
        unsupported=tuple(
            mapping("UNSUPPORTED: dict[str, Unsupported] = ", entries)
            for entries in [unsupported]
            if entries
        ),
        facts=call("FACTS = Facts", facts),
    )


def _channels(protocol: Protocol) -> str:
    """Return the class that most messages use for the channel; empty if there is none."""
    channel = protocol.framing.get("channel")
    fields = (f for m in protocol.messages for layout in m.layouts for f in layout.all_fields)
    classes = Counter(table_class(f) for f in fields if f.name == channel and f.enum)
    return next((name for name, _ in classes.most_common(1)), "")


def _list_name(entry: Json) -> str:
    lists = [entry["list"], *entry.get("more_lists", ())] if "list" in entry else [entry["family"]]
    return f"_{'_AND_'.join(lists).upper()}"


def _frozenset(head: str, names: list[str]) -> Nested:
    inner = Nested("{", tuple(map(literal, names)), "}")
    return Nested(f"{head}frozenset(", (inner,), ")")


def messages_from(protocol: Protocol, entry: Json) -> str:
    """Return the source of the list of messages of a unit, as the end of a sentence."""
    units = protocol.units
    family = units["families"][entry["family"]]
    keys = protocol.lists_of(entry)
    if not keys:
        return f"those of its family {entry['family']}: {family.get('note', family['title'])}"
    places = ((units["lists"][key]["page"], units["lists"][key].get("overlay", "")) for key in keys)
    found = where_all(protocol, places)
    lists = "lists" if len(keys) > 1 else "list"
    if "list" in entry:
        return f"the printed {lists}, {found}"
    note = family.get("note", family["title"])
    return f"the printed {lists} of {family['like']}, {found}: {note}"


def _unit(
    protocol: Protocol,
    unit: UnitPlan,
    messages: str,
    tables: TableWriter,
    carried: Mapping[str, Mapping[str, set[str]]],
) -> Nested:
    """Return the facts of a unit.

    :param messages: the name of its list of messages.
    :param carried: argument -> the quantities of each message.
    """
    entry, family = unit.entry, protocol.units["families"][unit.entry["family"]]
    items: list[Source] = [
        f"name={literal(unit.name)}",
        f"title={literal(entry['title'])}",
        f"page={entry['page']}",
        Text("messages_from=", messages_from(protocol, entry)),
        *device_framing_of(protocol).addresses(protocol, entry),
        f"messages={messages}",
        f"family={literal(entry['family'])}",
    ]
    if "status" in entry:
        items.append(f"status={literal(entry['status'])}")
    if "contexts" in entry:
        items.append(mapping("contexts=", list(_contexts(entry["contexts"]))))
    keeper = entry.get("keep_alive", "none")
    by_name = {message.name: message for message in protocol.messages}
    if keeper != "none" and by_name[keeper].layouts:
        items.append(f"keep_alive={class_of(by_name[keeper], by_name[keeper].layouts[0])}")
    items += [
        f"{key}={entry[key]}"
        for key in ("update_rate_hz", "usb_prefix", "card_usb_prefix")
        if key in entry
    ]
    items += [*prefixes_of(protocol, unit.name, entry), *reported_as(entry)]
    if entry.get("stages"):
        items.append(_strings("stages=", entry["stages"]))
    if "built_in" in entry:
        items.append(f"built_in={literal(entry['built_in'])}")
    if "reports_stage" in family:
        items.append(_stage_report(protocol, family, tables))
    if "pause" in family:
        items += [
            f"pause_ms={family['pause']['ms']}",
            Text("pause_source=", family["pause"]["source"]),
        ]
    items += _moving(protocol, unit, tables)
    items += hindrance_entries(protocol, unit, tables)
    items += need_entries(protocol, unit, tables)
    items += enabling_entries(protocol, unit, tables)
    items += position_entries(protocol, unit, tables)
    items += farewell_entries(protocol, unit)
    items += order_entries(protocol, unit, tables)
    for argument, of_messages in carried.items():
        names = {q for message in unit.messages for q in of_messages.get(message, ())}
        if names:
            items.append(_strings(argument, sorted(names)))
    return Nested(f"{literal(unit.name)}: Unit(", tuple(items), ")")


def _stage_report(protocol: Protocol, family: Json, tables: TableWriter) -> Nested:
    """Return the field in which the units of a family report their stage, and the request for it."""
    report = family["reports_stage"]
    message = report["field"].partition(".")[0]
    query = next(c for c in tables.calls if any(m.name == message for m in c.members.values()))
    page = where(protocol, [report["page"]], family.get("overlay", "")) if "page" in report else ""
    source = "; ".join(filter(None, [page, report.get("source", "")]))
    items: list[Source] = [f"t.{query.constant}", literal(report["field"]), Text("source=", source)]
    return Nested("reports_stage=StageReport(", tuple(items), ")")


def _contexts(contexts: Json) -> Iterator[Source]:
    """Yield each context with its values, each with the firmware from which it applies, the latest first."""
    for name, given in contexts.items():
        values = [{"value": given}] if isinstance(given, str) else given
        rows = sorted(((firmware_parts(entry), entry["value"]) for entry in values), reverse=True)
        yield keyed(
            literal(name),
            call("", [call("", [call("", map(str, since)), literal(v)]) for since, v in rows]),
        )


def _strings(head: str, names: list[str]) -> Nested:
    return Nested(f"{head}(", tuple(map(literal, names)), ")")


def status_call(protocol: Protocol, unit: UnitPlan, tables: TableWriter) -> Call | None:
    """Return the request for the status that shows whether a unit moves; None if it has none.

    If the only status is that of several channels, it is the request for the position counter of one.
    """
    lengths: dict[str, int] = {}
    for name, length, _ in _statuses(protocol, unit):
        lengths[name] = max(length, lengths.get(name, 0))
    asked = {
        (lengths[name], call.constant): call
        for call in tables.calls
        if call.values
        and (name := call.values.message.name) in lengths
        and call.message.name in unit.messages | {name}
    }
    if asked:
        return asked[max(asked)]
    return _position_call(unit, tables) if has_joint_status(protocol, unit) else None


def _position_call(unit: UnitPlan, tables: TableWriter) -> Call | None:
    """Return the request for the position counter of a channel; None if it has none."""
    for one in tables.calls:
        members = {message.name for role, message in one.members.items() if role in ("req", "get")}
        names = {argument.field.name for argument in one.values.arguments} if one.values else set()
        counter = one.message.tells == "counter" and len(members) == 2 and not one.asked
        if counter and "position" in names and members <= unit.messages:
            return one
    return None


def _statuses(protocol: Protocol, unit: UnitPlan) -> Iterator[tuple[str, int, Source]]:
    """Yield the messages with bits that show motion: name, length, and the bits."""
    for message, layout in said_by(protocol, unit):
        for field in layout.fields:
            mask = _motion(field, unit.name)
            if mask:
                value = f"({literal(field.name)}, 0x{mask:0{2 * field.format.size}X})"
                yield message.name, layout.length, f"{class_of(message, layout)}: {value}"


def _moving(protocol: Protocol, unit: UnitPlan, tables: TableWriter) -> Iterator[Source]:
    """Yield how a motion is detected: the bits of a status, the request for it, or a poll."""
    found = list(_statuses(protocol, unit))
    if (
        found and not rules_of(protocol.framing["kind"]).polls
    ):  # otherwise a command polls whether an axis is idle
        yield Nested("moving={", tuple(source for *_, source in found), "}")
    status = status_call(protocol, unit, tables)
    if status is not None:
        yield f"status_query=t.{status.constant}"
    for message in protocol.messages:
        if message.name in unit.messages and "ends_when" in message.exchange:
            yield Nested("idle=Poll(", tables.poll(message.exchange["ends_when"]).items, ")")
            return


def _motion(field: Field, unit: str) -> int:
    """Return the bits of a field that mean motion."""
    table: FlagTable | None = field.flags_by_unit.get(unit, field.flags)
    return sum(bit.mask for bit in table.bits if bit.motion) if table else 0


def _carried(protocol: Protocol, *, sent: bool = False) -> dict[str, set[str]]:
    """Return the quantities of each message.

    :param sent: whether to include only messages to a unit.
    """
    return {
        message.name: {
            field.quantity.name
            for layout in message.layouts
            if not (sent and layout.form == "reply")
            for field in layout.all_fields
            if field.quantity
        }
        for message in protocol.messages
        if not (sent and message.direction == "to_host")
    }
