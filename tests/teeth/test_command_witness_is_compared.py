"""A changed place of the witness of commands is a difference, and so is a changed fact of their registry."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from stagewire_generator.diagnostics import Diagnostics
from stagewire_generator.lint.witness import compare_witness
from stagewire_generator.model import Message, Protocol
from stagewire_generator.reader import read
from stagewire_generator.resolver import resolve

FOLDER = Path(__file__).parents[2] / "spec" / "asi_ms2000"
DIAGNOSTICS = Diagnostics()
FILES = read(FOLDER, DIAGNOSTICS, lambda _: None)
PROTOCOL = resolve(FILES, DIAGNOSTICS)
WITNESS = FILES["printed"]


def found(protocol: Protocol = PROTOCOL) -> tuple[object, ...]:
    comparison = compare_witness(protocol, WITNESS)
    differences = {d.place: (d.printed, d.encoded) for d in comparison.differences.values()}
    return differences, [name for _, name in comparison.unknown], comparison.witnessed


AS_IT_IS = found()


def texts(node: Any) -> Iterator[tuple[Any, Any]]:
    """Yield every text: what holds it, and its key there."""
    for key, part in node.items() if isinstance(node, dict) else enumerate(node):
        if isinstance(part, str):
            yield node, key
        elif isinstance(part, dict | list):
            yield from texts(part)


# What cannot be noticed: headings of tables, words beside a key or a slot, and what a bit means when
# it is 0, since its name is of what it means when it is set.
# The name of a limit does not say that its switch is closed; which sizes are meant is seen by one word.
EXCUSED_TEXTS = {("one", "closed"), ("of", "supports")}
EXCUSED = {"chapter", "title of a table", "zero", "beside a key", "meaning of a slot"}


def kind(holder: Any, key: Any) -> str:
    if isinstance(holder, dict):
        return "title of a table" if key == "title" and "rows" in holder else str(key)
    if len(holder) == 2 and isinstance(holder[0], str) and key == 1:
        return "beside a key"
    return "meaning of a slot" if len(holder) == 3 and key == 2 else ""


@pytest.mark.parametrize("document", WITNESS, ids=lambda document: str(document.data["chapter"]))
def test_a_changed_text_is_a_difference(document: Any) -> None:
    unnoticed = []
    for holder, key in texts(document.data):
        if kind(holder, key) in EXCUSED:
            continue
        printed, holder[key] = holder[key], "77"
        if found() == AS_IT_IS and (key, printed) not in EXCUSED_TEXTS:
            unnoticed.append((key, printed))
        holder[key] = printed
    assert unnoticed == []


def changes(message: Message) -> Iterator[tuple[str, Message]]:
    """Yield the message with one fact changed."""
    assert message.id is not None
    yield "byte", replace(message, id=message.id + 1)
    yield "title", replace(message, title=f"{message.title} too")
    yield "keyboard", replace(message, keyboard="!")
    if message.kind == "command":
        yield "page", replace(message, pages=(message.pages[0] + 1,))
        yield "size", replace(message, size=None if message.size == 0 else (message.size or 0) - 1)
        yield "dummy", replace(message, dummy=not message.dummy)
    for at, layout in enumerate(message.layouts):
        for index, field in enumerate(layout.fields):
            others = []
            if field.format.kind == "integer" and field.format.size > 1:
                signed = replace(field.format, signed=not field.format.signed)
                others.append(("sign", replace(field, format=signed)))
            if not message.dummy and field.quantity:
                others.append(("unit", replace(field, quantity=None)))
            if field.ranged:
                others.append(("minimum", replace(field, minimum=field.minimum + 7)))
                others.append(("maximum", replace(field, maximum=field.maximum - 7)))
            for what, other in others:
                fields = (*layout.fields[:index], other, *layout.fields[index + 1 :])
                changed = replace(layout, fields=fields)
                layouts = (*message.layouts[:at], changed, *message.layouts[at + 1 :])
                yield f"{field.name}: {what}", replace(message, layouts=layouts)


@pytest.mark.parametrize("message", PROTOCOL.messages, ids=lambda message: str(message.name))
def test_a_changed_fact_is_a_difference(message: Message) -> None:
    unnoticed = []
    for what, other in changes(message):
        messages = tuple(other if m is message else m for m in PROTOCOL.messages)
        if found(replace(PROTOCOL, messages=messages)) == AS_IT_IS:
            unnoticed.append(what)
    assert unnoticed == []
