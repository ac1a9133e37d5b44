"""Layouts of a message: which there are, how bytes choose between them, and what is in them."""

from __future__ import annotations

from dataclasses import replace

from stagewire_generator.change.comparison import Comparison, Where
from stagewire_generator.change.fields import compare_field
from stagewire_generator.change.matching import match_fields, match_layouts
from stagewire_generator.change.pairing import pair
from stagewire_generator.model import Field, Format, Layout, Message
from stagewire_generator.naming import message_classes

__all__ = ["compare_layouts"]

_BYTE = Format("byte", 1, False, "integer")


def compare_layouts(comparison: Comparison, where: Where, old: Message, new: Message) -> None:
    """Compare the layouts of a message that is on both sides."""
    pairs = match_layouts(old, new)
    for layout in pairs.removed:
        text = (
            "" if new.documented else "the message has no layout any more; its bytes are kept raw"
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
    """Return what a new layout does to bytes that could be read before."""
    if not old.documented:
        return (
            "the message had no layout, and its bytes were kept raw; now they are read by this one"
        )
    return _ambiguity(new, layout) if layout.when else ""


def _context(new: Message, before: Layout, after: Layout) -> str:
    if before.when and after.when:
        return ""
    if before.when:
        return f"no context is needed any more: {_packet(after)} can only be this layout"
    return _ambiguity(new, after)


def _ambiguity(message: Message, layout: Layout) -> str:
    rivals = " or ".join(other.form for other in _rivals(message, layout))
    said = ", ".join(f"{context}: {value}" for context, value in layout.when.items())
    return (
        f"bytes alone are ambiguous: {_packet(layout)} may be {rivals}, too, and only the context "
        f"({said}) decides"
    )


def _rivals(message: Message, layout: Layout) -> list[Layout]:
    """Return the other layouts of the message that the same bytes could have."""
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
    """Compare the parameter bytes. One without a name may hold any value, and is zero when left out."""
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
    """Return the two parameter bytes by the names that code has for them."""
    slots = (("param1", layout.param1), ("param2", layout.param2))
    return {field.name if field else slot: (slot, field) for slot, field in slots}


def _nameless(key: str, named: Field) -> Field:
    """Return a parameter byte without a name, which says as little as possible otherwise than ``named``."""
    return replace(
        named,
        name=key,
        format=_BYTE,
        minimum=0,
        maximum=0xFF,
        ranged=False,
        open=False,
        default=None,
        constant=None if named.constant else named.constant,
        quantity=None,
        enum=None,
        flags=None,
        flags_by_unit={},
        note="",
    )


def _fields(comparison: Comparison, where: Where, old: Layout, new: Layout) -> None:
    pairs = match_fields(old, new)
    comparison.names("field", "field", pairs, where)
    for before, after in pairs.kept:
        compare_field(comparison, {**where, "field": after.name}, before, after)
