"""Check how device classes present the units of a family: messages, fields, values and names of methods."""

from __future__ import annotations

import keyword
from collections.abc import Iterable, Iterator, Mapping

from stagewire_generator.model import Json, Message


def wrong_classes(
    entry: Json, messages: Mapping[str, Message], sets: Iterable[str]
) -> Iterator[tuple[str, tuple[str, ...], str]]:
    """Yield the code, the keys and the text of each error in the `classes` of a family.

    :param sets: names of the parameter sets.
    """
    for part in ("methods", "without"):
        for key, value in entry.get(part, {}).items():
            name = value if part == "methods" else key
            if name not in messages and not (part == "without" and name in sets):
                yield "SW021", (part, key), f"unknown message {name}"
    for name in (*entry.get("methods", ()), entry.get("channel", "")):
        if keyword.iskeyword(name):
            yield "SW023", ("methods",), f"the method name {name} is reserved"
    enabling = entry.get("enabling", {})
    if "set" not in enabling:
        return
    owned = [m for m in messages.values() if m.set == (enabling["set"], "set")]
    fields = {f.name: f for m in owned for layout in m.layouts for f in layout.all_fields}
    field = fields.get(enabling["field"])
    if field is None or field.enum is None:
        text = f"{enabling['set']} has no field {enabling['field']} with an enumeration"
        yield "SW021", ("enabling", "field"), text
        return
    known = {value.name for value in field.enum.values}
    for name in enabling.get("channels", {}):
        if name not in known:
            yield "SW021", ("enabling", "channels", name), f"{field.name} has no value {name}"
