"""Check layouts: ids, ranges, values, pages, framing rules, and whether bytes distinguish the forms."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping
from itertools import combinations
from typing import Any

from stagewire_generator.diagnostics import Diagnostics
from stagewire_generator.framing import rules_of
from stagewire_generator.model import Layout, Message, Protocol
from stagewire_generator.model_fields import Field
from stagewire_generator.strict_yaml import Document, KeyPath

_SHOWN = {"message": "a message", "command": "a command", "setup": "a setup command"}


def check_framing(protocol: Protocol, head: Document, diagnostics: Diagnostics) -> None:
    """Check the kind of every message, and the rules of the framing.

    :param head: the file of the protocol, for the positions of errors.
    """
    kind = protocol.framing["kind"]
    rules = rules_of(kind)
    for message in protocol.messages:
        if message.kind not in rules.kinds:
            what = (
                f"{message.name} is {_SHOWN[message.kind]}, which {kind} framing does not support"
            )
            diagnostics.add(message.place, "SW038", what)
        if message.sub_message is not None and not rules.has_sub_messages:
            what = f"{message.name} has a sub-message, which {kind} framing does not support"
            hint = "remove `sub_message`, and give each message its own id"
            diagnostics.add(message.place, "SW038", what, hint)
    rules.check(protocol, head, diagnostics)


_KINDS = (
    "protocol",
    "overlay",
    "additions",
    "quantities",
    "stages",
    "units",
    "messages",
    "errata",
    "rules",
)
_ROLES = {"set", "req", "get"}
_CONTAINERS = (dict, list)


def check_pages(
    protocol: Protocol, files: Mapping[str, list[Document]], diagnostics: Diagnostics
) -> None:
    """Check every page of the registry against the number of pages, or of sections."""
    document = protocol.document
    last = len(document["sections"]) if "sections" in document else document.get("pages")
    if last is None:
        return
    noun = "section" if "sections" in document else "page"
    for file in (file for kind in _KINDS for file in files.get(kind, ())):
        for path, page in _pages(file.data, ()):
            if page > last and path[0] != "document":  # there, `pages` is a count
                what = (
                    f"{'.'.join(map(str, path))}: {noun} {page} does not exist (the last is {last})"
                )
                diagnostics.add(file.place(*path), "SW039", what)


def _pages(node: Any, path: KeyPath) -> Iterator[tuple[KeyPath, int]]:
    """Yield every page in a part of a file; ``page`` may also be the name of something else."""
    for key, part in node.items() if isinstance(node, dict) else enumerate(node):
        if key == "page" and isinstance(part, int):
            yield (*path, key), part
        elif not isinstance(part, _CONTAINERS):
            continue
        elif key in ("pages", "more_pages", "also") and isinstance(part, list):
            yield from (((*path, key), page) for page in part)
        elif key == "later_pages" and isinstance(part, dict):
            yield from (((*path, key, overlay), page) for overlay, page in part.items())
        elif key == "pages" and isinstance(part, dict) and part.keys() <= _ROLES:
            yield from (((*path, key), page) for page in part.values())
        else:
            yield from _pages(part, (*path, key))


_SIZES = (1, 2, 3, 4, 8)
_REPLACE = (
    "to replace the message of the {}, give the new one the same name and list it under `overrides` in "
    "overlay.yaml; otherwise one of the ids is wrong"
)


def check_layouts(protocol: Protocol, diagnostics: Diagnostics) -> None:
    """Check ids, layouts and fields of all messages."""
    _ids(protocol, diagnostics)
    for message in protocol.messages:
        _undocumented(message, diagnostics)
        if message.kind == "message":  # a command has one layout in each direction
            _distinguishable(message, protocol, diagnostics)
            _sent(message, protocol, diagnostics)
        for layout in message.layouts:
            longest = protocol.framing["maximum_length"]
            if layout.length > longest:
                what = f"{message.name} ({layout.form}): {layout.length} bytes; the maximum is {longest}"
                hint = "correct the length of the layout, or maximum_length in protocol.yaml"
                diagnostics.add(layout.place, "SW033", what, hint)
            for field in layout.all_fields:
                _field(message, field, diagnostics)
                if field.array:
                    _array(message, layout, field, protocol, diagnostics)
            for param in (layout.param1, layout.param2):
                if param and param.format.size != 1:
                    what = (
                        f"{message.name}.{param.name}: the format {param.format.name} has "
                        f"{param.format.size} bytes, but a header parameter has 1"
                    )
                    diagnostics.add(param.place, "SW033", what)
    for enumeration in protocol.enumerations:
        values = [value.value for value in enumeration.values]
        for value in sorted({v for v in values if values.count(v) > 1}):
            diagnostics.add(
                enumeration.place, "SW034", f"{enumeration.name}: {value:#x} has two names"
            )
        for modifier in enumeration.modifiers:
            for other in enumeration.values:
                if other is not modifier and other.value & modifier.value:
                    what = f"{enumeration.name}: {modifier.name} and {other.name} share bits"
                    diagnostics.add(enumeration.place, "SW034", what)
        if len(enumeration.modifiers) == len(enumeration.values):
            what = f"{enumeration.name}: every value is a modifier"
            hint = "add the values that they modify"
            diagnostics.add(enumeration.place, "SW034", what, hint)
    for table in protocol.flags:
        bits = [bit.bit for bit in table.bits]
        for number in sorted({b for b in bits if bits.count(b) > 1}):
            diagnostics.add(table.place, "SW034", f"{table.name}: bit {number} has two names")
        for bit in table.bits:
            if bit.bit >= 8 * table.format.size:
                diagnostics.add(
                    table.place,
                    "SW033",
                    f"{table.name}.{bit.name}: the format {table.format.name} has no bit {bit.bit}",
                )


_LONGEST = 0xFFFF  # length that fits into a header


def _array(
    message: Message, layout: Layout, field: Field, protocol: Protocol, diagnostics: Diagnostics
) -> None:
    """Check that the fields before an array determine its length, which the parser must know."""
    where = f"{message.name}.{field.name}"

    def refuse(what: str, hint: str = "") -> None:
        diagnostics.add(field.place, "SW094", f"{where}: {what}", hint)

    array = field.array
    assert array is not None
    kind = protocol.framing["kind"]
    if not rules_of(kind).has_arrays or message.kind != "message":
        refuse(f"{kind} framing does not support arrays", "write a layout for each length")
        return
    if field is not layout.fields[-1]:
        refuse("fields follow the array", "an array is the last field of a packet")
    packets = [each for each in message.layouts if each.form != "header"]
    if len(packets) > 1 or message.sub_message is not None:
        refuse(
            "the message has other layouts or a sub-message, so its length does not show the array",
            "a message with an array has one layout with data, and an id of its own",
        )
    if field.role != "value" or field.enum or field.flags or field.quantity or field.target:
        refuse("the array has a role, table or quantity", "quantities belong to its columns")
    before = {each.name: each for each in layout.fields[:-1]}
    for name in (array.rows, *array.masks):
        other = before.get(name)
        if other is None or other.format.kind != "integer" or other.format.signed:
            hint = "name an unsigned integer before the array in the same packet"
            refuse(f"{name} is not a field that can be counted", hint)
            return
    if layout.longest > _LONGEST:
        what = f"up to {layout.longest} bytes; a header can state {_LONGEST}"
        refuse(what, f"add the `maximum` of {array.rows}, and of the fields with bits")


def _ids(protocol: Protocol, diagnostics: Diagnostics) -> None:
    # Setup commands have their own set of bytes.
    seen: dict[tuple[str, int, int | None], Message] = {}
    order = ["", *(overlay.name for overlay in protocol.overlays)]
    for message in protocol.messages:
        if message.id is None:
            continue
        key = message.kind, message.id, message.sub_message
        if other := seen.get(key):
            what = (
                f"{message.name} and {other.name} both have the id "
                f"0x{message.id:0{protocol.id_digits}x}"
            )
            if message.sub_message is not None:
                what += f" and the sub-message {message.sub_message}"
            hint = ""
            if message.overlay != other.overlay:
                below = min(message.overlay, other.overlay, key=order.index)
                hint = _REPLACE.format(f"overlay {below}" if below else "protocol")
            diagnostics.add(message.place, "SW030", what, hint)
        seen[key] = message


def _undocumented(message: Message, diagnostics: Diagnostics) -> None:
    if not message.documented and not message.errata:
        diagnostics.add(message.place, "SW036", f"{message.name} has no layout and no erratum")


def _distinguishable(message: Message, protocol: Protocol, diagnostics: Diagnostics) -> None:
    groups: dict[tuple[str, int], list[Layout]] = defaultdict(list)
    for layout in message.layouts:
        groups[("header" if layout.form == "header" else "data", layout.length)].append(layout)
    for (_, length), layouts in groups.items():
        for layout in layouts:
            for context, value in layout.when.items():
                known = protocol.contexts.get(context, {}).get("values", [])
                if value not in known:
                    diagnostics.add(
                        layout.place,
                        "SW021",
                        f"{message.name} ({layout.form}): unknown context {context}: {value}",
                    )
        if len(layouts) == 1:
            if layouts[0].when:
                form = layouts[0].form
                what = f"{message.name}: {form} has a `when`, but its length already identifies it"
                diagnostics.add(layouts[0].place, "SW032", what, "remove the `when`")
            continue
        if not all(_contradict(one, other) for one, other in combinations(layouts, 2)):
            forms = ", ".join(layout.form for layout in layouts)
            diagnostics.add(
                layouts[-1].place,
                "SW032",
                f"{message.name}: {forms} all have {length} bytes, and no context distinguishes them",
                rules_of(protocol.framing["kind"]).same_length,
            )
    decided = [alike for alike in groups.values() if len(alike) > 1]
    if len(decided) > 1:
        forms = " and ".join(", ".join(layout.form for layout in alike) for alike in decided)
        what = f"{message.name}: contexts select layouts of different lengths: {forms}"
        diagnostics.add(
            decided[-1][-1].place, "SW032", what, "give all but one length a single form"
        )


def _sent(message: Message, protocol: Protocol, diagnostics: Diagnostics) -> None:
    """Check the contexts in which a SET has a form other than the plain one; a GET may share the layouts."""
    chosen = [layout for layout in message.layouts if layout.sent_when]
    for layout in chosen:

        def refuse(what: str, hint: str, at: Layout = layout) -> None:
            what = f"{message.name} ({at.form}): sent_when {what}"
            diagnostics.add(at.place, "SW095", what, hint)

        for context, value in layout.sent_when.items():
            if value not in protocol.contexts.get(context, {}).get("values", []):
                refuse(
                    f"names the unknown context {context}: {value}", "define it in protocol.yaml"
                )
        if layout.form == "data" or layout.when or message.set is None:
            hint = "only a parameter set has it, in a form whose length differs from that of the plain form"
            refuse("does not belong here", hint)
        for other in chosen[chosen.index(layout) + 1 :]:
            both = {*layout.sent_when} & {*other.sent_when}
            if all(layout.sent_when[name] == other.sent_when[name] for name in both):
                refuse(f"does not exclude {other.form}", "let one of their contexts differ")


def _contradict(one: Layout, other: Layout) -> bool:
    """Whether no context selects both layouts."""
    return any(other.when.get(name, value) != value for name, value in one.when.items())


def _field(message: Message, field: Field, diagnostics: Diagnostics) -> None:
    where = f"{message.name}.{field.name}"
    format = field.array.item if field.array else field.format
    if format.kind != "integer":
        if field.ranged or field.enum or field.flags or field.quantity:
            diagnostics.add(
                field.place, "SW033", f"{where}: a {format.name} cannot have a range or unit"
            )
        return
    if format.real and (
        field.enum or field.flags or field.quantity or field.target or field.role == "constant"
    ):
        what = f"{where}: a {format.name} is a real number, without a table, a quantity or a target"
        hint = "name its unit in the `note`"
        diagnostics.add(field.place, "SW033", what, hint)
        return
    if format.size not in _SIZES:
        what = f"{where}: integers of {format.size} bytes are not supported"
        diagnostics.add(field.place, "SW033", what)
    if not format.minimum <= field.minimum <= field.maximum <= format.maximum:
        diagnostics.add(
            field.place,
            "SW033",
            f"{where}: the range {field.minimum} to {field.maximum} is invalid for the format {format.name} "
            f"({format.minimum} to {format.maximum})",
        )
    cases = field.quantity.rule.get("cases", {}) if field.quantity else {}
    for name, case in cases.items():
        low, high = case.get("minimum", field.minimum), case.get("maximum", field.maximum)
        if not field.minimum <= low <= high <= field.maximum:
            what = (
                f"{where}: the range {low} to {high} in the case {name} is invalid; the range of the field "
                f"is {field.minimum} to {field.maximum}"
            )
            diagnostics.add(field.place, "SW033", what)
    for name, value in (("default", field.default), ("constant", field.constant)):
        if value is not None and not field.minimum <= value <= field.maximum:
            diagnostics.add(field.place, "SW033", f"{where}: the {name} {value} is out of range")
    for enum in field.enumerations:
        for entry in enum.values:
            if not format.minimum <= entry.value <= format.maximum:
                diagnostics.add(
                    field.place,
                    "SW033",
                    f"{where}: {enum.name}.{entry.name} ({entry.value:#x}) does not fit a "
                    f"{format.name}",
                )
    if field.flags and field.flags.format.size != format.size:
        diagnostics.add(
            field.place,
            "SW033",
            f"{where}: a {format.name} field cannot hold {field.flags.name}, which has the format "
            f"{field.flags.format.name}",
        )


def check_contexts(protocol: Protocol, head: Document, diagnostics: Diagnostics) -> None:
    """Check that a unit states each context, or that it has the reason why none does.

    :param head: the file of the protocol, for the positions of errors.
    """
    data = protocol.units
    stated = {name for unit in data["units"].values() for name in unit.get("contexts", ())}
    stated |= {"status"} if any("status" in unit for unit in data["units"].values()) else set()
    for name, context in protocol.contexts.items():
        if name not in stated and "unstated" not in context:
            diagnostics.add(
                head.place("contexts", name), "SW092", f"no unit states the context {name}"
            )
        elif name in stated and "unstated" in context:
            place = head.place("contexts", name, "unstated")
            diagnostics.add(
                place, "SW092", f"a unit states the context {name}", "remove `unstated`"
            )
