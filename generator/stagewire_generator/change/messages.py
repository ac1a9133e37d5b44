"""Compare messages: ids, directions, names, exchanges, layouts and fields; parameter sets; modules."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from stagewire_generator.change.comparison import Comparison, Where
from stagewire_generator.change.matching import match_fields, match_layouts, pair, same_scale
from stagewire_generator.model import Firmware, Layout, Message, Protocol
from stagewire_generator.model_fields import Enumeration, Field, FlagTable, Format
from stagewire_generator.naming import message_classes


def compare_field(comparison: Comparison, where: Where, old: Field, new: Field) -> None:
    """Compare a field that is on both sides; the caller compares its name."""
    comparison.attributes(where, old, new)
    _format(comparison, where, old, new)
    _range(comparison, where, old, new)
    _quantity(comparison, where, old, new)
    _array(comparison, where, old, new)
    _by_unit(comparison, where, "flags", old.flags_by_unit, new.flags_by_unit)
    _by_unit(comparison, where, "enumeration", old.enums_by_unit, new.enums_by_unit)


def _by_unit(
    comparison: Comparison,
    where: Where,
    noun: str,
    old: Mapping[str, FlagTable | Enumeration],
    new: Mapping[str, FlagTable | Enumeration],
) -> None:
    """Compare the tables that apply to individual units."""
    before, after = (
        {unit: table.name for unit, table in sorted(tables.items())} for tables in (old, new)
    )
    if {unit: comparison.renamed(noun, name) for unit, name in before.items()} != after:
        comparison.add(f"field-{noun}-by-unit", where, before, after)


def _format(comparison: Comparison, where: Where, old: Field, new: Field) -> None:
    before, after = old.format, new.format
    if before == after:
        return
    if (before.size, before.signed, before.real) == (after.size, after.signed, after.real):
        if before.kind == after.kind:
            kind = "field-format-name"
        elif "integer" in (before.kind, after.kind):
            kind = "field-format"
        else:
            kind = "field-type"
    else:
        kind = "field-format"
    names = [before.name, after.name]
    if before.name == after.name:  # its entry in the table of formats changed
        names = [
            f"{f.name} ({f.size} bytes, {'real' if f.real else 'un' * (not f.signed) + 'signed'})"
            for f in (before, after)
        ]
    comparison.add(kind, where, *names)


def _range(comparison: Comparison, where: Where, old: Field, new: Field) -> None:
    if old.format != new.format and not (old.ranged or new.ranged):
        return  # the range is that of the format
    before, after = (
        {
            "": field.own_range,
            **{unit: field.ranges_by_unit[unit] for unit in sorted(field.ranges_by_unit)},
        }
        for field in (old, new)
    )
    if before != after:
        ends = (
            "; ".join(f"{unit} {low} to {high}".strip() for unit, (low, high) in ranges.items())
            for ranges in (before, after)
        )
        comparison.add("field-range", where, *ends)


def _quantity(comparison: Comparison, where: Where, old: Field, new: Field) -> None:
    before, after = old.quantity, new.quantity
    if before is None and after is None:
        return
    if before and after:
        if comparison.renamed("quantity", before.name) == after.name:
            return  # changes in it are reported with the quantity
        kind = "field-quantity" if same_scale(before, after) else "field-scale"
        comparison.add(kind, where, before.name, after.name)
    else:
        comparison.add("field-quantity", where, before and before.name, after and after.name)


def _array(comparison: Comparison, where: Where, old: Field, new: Field) -> None:
    """Compare the rows and columns of arrays."""
    before, after = (_rows(comparison, field, field is old) for field in (old, new))
    if before != after:
        comparison.add("field-array", where, before, after)
    notes = [
        {c.name: c.note for c in field.array.columns if c.note} if field.array else {}
        for field in (old, new)
    ]
    if before == after and notes[0] != notes[1]:
        comparison.add("text", where, str(notes[0]), str(notes[1]))


def _rows(comparison: Comparison, field: Field, is_old: bool) -> str | None:
    """Return the facts of an array that are the same on both sides unless something changed."""
    array = field.array
    if array is None:
        return None
    columns = []
    for column in array.columns:
        quantity = column.quantity.name if column.quantity else ""
        if quantity and is_old:
            quantity = comparison.renamed("quantity", quantity) or quantity
        parts = (column.name, column.each and f"for each bit of {column.each}", quantity)
        columns.append(" ".join(filter(None, parts)))
    item = array.item
    sign = "signed" if item.signed else "unsigned"
    rows = f"{array.rows} rows of {', '.join(columns)}"
    return f"{rows}; {item.name} ({item.size} bytes, {item.kind}, {sign})"


_BYTE = Format("byte", 1, False, "integer")


def compare_layouts(comparison: Comparison, where: Where, old: Message, new: Message) -> None:
    """Compare the layouts of a message that is on both sides."""
    pairs = match_layouts(old, new)
    for layout in pairs.removed:
        text = (
            "" if new.documented else "the message no longer has a layout; its bytes are kept raw"
        )
        comparison.add("layout-removed", {**where, "form": layout.form}, layout.form, None, text)
    for layout in pairs.added:
        text = _arrival(old, new, layout)
        comparison.add("layout-added", {**where, "form": layout.form}, None, layout.form, text)
    if pairs.reordered:
        comparison.add("order", {**where, "attribute": "layouts"})
    old_classes, new_classes = message_classes(old), message_classes(new)
    for before, after in pairs.kept:
        at = {**where, "form": after.form}
        was, is_ = old_classes[before.form], new_classes[after.form]
        if before.form != after.form:
            text = f"the class {was} is now {is_}" if was != is_ else f"the class stays {is_}"
            comparison.add(
                "layout-renamed", at, before.form, after.form, f"{text}; the bytes are the same"
            )
        elif was.removeprefix(old.class_name) != is_.removeprefix(new.class_name):
            comparison.add("class-renamed", at, was, is_)
        if dict(before.when) != dict(after.when):
            text = _context(new, before, after)
            comparison.add("layout-context", at, before.when, after.when, text)
        comparison.attributes(at, before, after)
        _parameters(comparison, at, before, after)
        _fields(comparison, at, before, after)


def _arrival(old: Message, new: Message, layout: Layout) -> str:
    """Return the effect of a new layout on bytes that could be read before."""
    if not old.documented:
        return "the message had no layout and its bytes were kept raw; this layout now reads them"
    return _ambiguity(new, layout) if layout.when else ""


def _context(new: Message, before: Layout, after: Layout) -> str:
    if before.when and after.when:
        return ""
    if before.when:
        return f"a context is no longer needed: {_packet(after)} can only be this layout"
    return _ambiguity(new, after)


def _ambiguity(message: Message, layout: Layout) -> str:
    rivals = " or ".join(other.form for other in _rivals(message, layout))
    said = ", ".join(f"{context}: {value}" for context, value in layout.when.items())
    return (
        f"the bytes alone are ambiguous: {_packet(layout)} may also be {rivals}, and only the context "
        f"({said}) decides"
    )


def _rivals(message: Message, layout: Layout) -> list[Layout]:
    """Return the other layouts of the message that match the same bytes."""
    header = layout.form == "header"
    return [
        other
        for other in message.layouts
        if other.form != layout.form
        and (other.form == "header") == header
        and other.length == layout.length
    ]


def _packet(layout: Layout) -> str:
    return f"a packet of {layout.length} bytes" if layout.length else "a header"


def _parameters(comparison: Comparison, where: Where, old: Layout, new: Layout) -> None:
    """Compare the parameter bytes; one without a name may have any value, and is zero when left out."""
    pairs = pair(_slots(old), _slots(new), lambda slot: slot[0])
    for _, gone in pairs.removed:
        if gone:
            comparison.add("field-removed", {**where, "field": gone.name}, gone.name, None)
    for _, come in pairs.added:
        if come:
            comparison.add("field-added", {**where, "field": come.name}, None, come.name)
    for (_, before), (slot, after) in pairs.kept:
        if before and after:
            at = {**where, "field": after.name}
            if before.name != after.name:
                comparison.add("field-renamed", at, before.name, after.name)
            compare_field(comparison, at, before, after)
        elif after:
            at = {**where, "field": after.name}
            if after.role == "value":
                comparison.add("parameter-named", at, None, after.name)
            elif not after.constant:
                comparison.add("parameter-zero", at, None, "0")
            compare_field(comparison, at, _nameless(slot, after), after)
        elif before:
            at = {**where, "field": before.name}
            if before.role == "value":
                comparison.add("parameter-unnamed", at, before.name, None)
            elif not before.constant:
                comparison.add("parameter-zero", at, "0", None)
            compare_field(comparison, at, before, _nameless(slot, before))


def _slots(layout: Layout) -> dict[str, tuple[str, Field | None]]:
    """Return the two parameter bytes by their names in code."""
    slots = (("param1", layout.param1), ("param2", layout.param2))
    return {field.name if field else slot: (slot, field) for slot, field in slots}


def _nameless(key: str, named: Field) -> Field:
    """Return a parameter byte without a name that otherwise differs from ``named`` as little as possible."""
    return replace(
        named,
        name=key,
        format=_BYTE,
        minimum=0,
        maximum=0xFF,
        ranged=False,
        open=False,
        default=None,
        omitted=None if named.omitted is None else 0,
        constant=None if named.constant else named.constant,
        quantity=None,
        enum=None,
        flags=None,
        flags_by_unit={},
        enums_by_unit={},
        note="",
    )


def _fields(comparison: Comparison, where: Where, old: Layout, new: Layout) -> None:
    pairs = match_fields(old, new)
    comparison.names("field", "field", pairs, where)
    for before, after in pairs.kept:
        compare_field(comparison, {**where, "field": after.name}, before, after)


def compare_messages(comparison: Comparison, old: Protocol, new: Protocol) -> None:
    """Compare all messages."""
    pairs = comparison.matches.message
    ids: dict[tuple[str, int | None, int | None], str] = {
        (m.kind, m.id, m.sub_message): m.name for m in old.messages if m.id is not None
    }
    for message in pairs.removed:
        kind = "mention-removed" if message.id is None else "message-removed"
        comparison.add(kind, {"message": message.name}, message.name, None)
    for message in pairs.added:
        text = ""
        owner = ids.get((message.kind, message.id, message.sub_message))
        if owner:
            text = f"new names; frames with this id were {owner} and are now this message"
        kind = "mention-added" if message.id is None else "message-added"
        comparison.add(kind, {"message": message.name}, None, message.name, text)
    for before, after in pairs.kept:
        _message(comparison, before, after)


def _message(comparison: Comparison, old: Message, new: Message) -> None:
    where = {"message": new.name}
    if old.name != new.name:
        comparison.add("message-renamed", where, old.name, new.name)
    elif old.words != new.words:
        words = (" ".join(old.words), " ".join(new.words))
        comparison.add("message-words", where, *words, _class_names(old, new))
    if old.id is None and new.id is not None:
        comparison.add("message-id-added", where, None, new.id)
    elif old.id != new.id:
        text = (
            ""
            if new.id is not None
            else "the message no longer has an id; its frames are no longer recognised"
        )
        comparison.add("message-id", where, old.id, new.id, text)
    comparison.attributes(where, old, new)
    compare_firmware(comparison, where, old.firmware, new.firmware)
    belonged = (comparison.renamed("set", old.set[0]), old.set[1]) if old.set else None
    if belonged != new.set:
        before, after = (m.set and " ".join(m.set) for m in (old, new))
        comparison.add("message-set", where, before, after)
    compare_layouts(comparison, where, old, new)


def compare_firmware(
    comparison: Comparison, where: Where, old: Sequence[Firmware], new: Sequence[Firmware]
) -> None:
    """Compare the notes on firmware versions."""
    if old != new:
        before, after = (
            [
                f"{fact.version}{f' (page {fact.page})' if fact.page else ''}: {fact.note}"
                for fact in facts
            ]
            for facts in (old, new)
        )
        comparison.add("firmware", where, before, after)


def _class_names(old: Message, new: Message) -> str:
    if old.class_name == new.class_name:
        return "names in other languages may change; the Python class keeps its name"
    return f"the class {old.class_name} is now {new.class_name}"


def compare_sets(comparison: Comparison) -> None:
    """Compare the parameter sets and their members."""
    pairs = comparison.matches.set
    comparison.names("set", "set", pairs)
    for old, new in pairs.kept:
        members = {r: comparison.renamed("message", m) for r, m in old.members.items()}
        if members != dict(new.members):
            comparison.add("set-members", {"set": new.name}, dict(old.members), dict(new.members))


def compare_chapters(comparison: Comparison, old: Protocol, new: Protocol) -> None:
    """Compare the chapters, and the modules generated for chapters with messages."""
    pairs = comparison.matches.chapter
    modules, new_modules = _modules(old), _modules(new)
    for chapter in pairs.removed:
        kind = "module-removed" if chapter.name in modules else "chapter-removed"
        comparison.add(kind, {"chapter": chapter.name}, chapter.name, None)
    for chapter in pairs.added:
        kind = "module-added" if chapter.name in new_modules else "chapter-added"
        comparison.add(kind, {"chapter": chapter.name}, None, chapter.name)
    for before, after in pairs.kept:
        where = {"chapter": after.name}
        was, is_ = before.name in modules, after.name in new_modules
        if was != is_:
            ends = (None, after.name) if is_ else (before.name, None)
            comparison.add("module-added" if is_ else "module-removed", where, *ends)
        elif before.name != after.name:
            kind = "module-renamed" if is_ else "chapter-renamed"
            comparison.add(kind, where, before.name, after.name)
        comparison.attributes(where, before, after)


def _modules(protocol: Protocol) -> set[str]:
    """Return the chapters that become modules: those that contain a message with an id."""
    return {message.chapter for message in protocol.messages if message.id is not None}
