"""Every change of the command witness or of the command registry is reported as a difference."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from typing import Any

import pytest
from mutants import Proof, proof_of

from stagewire_generator.lint.witness.witness import compare_witness
from stagewire_generator.model import Message, Protocol


def proof() -> Proof:
    return proof_of("asi_ms2000")


def found(protocol: Protocol | None = None) -> tuple[object, ...]:
    comparison = compare_witness(protocol or proof().protocol, proof().witness)
    differences = {d.place: (d.printed, d.encoded) for d in comparison.differences.values()}
    return differences, [name for _, name in comparison.unknown], comparison.witnessed


@cache
def as_it_is() -> tuple[object, ...]:
    return found()


def texts(node: Any) -> Iterator[tuple[Any, Any]]:
    """Yield every text as its container and its key."""
    for key, part in node.items() if isinstance(node, dict) else enumerate(node):
        if isinstance(part, str):
            yield node, key
        elif isinstance(part, dict | list):
            yield from texts(part)


CHAPTERS = {"commands", "document", "format", "setup", "statements", "wording"}
# The first is compared with the files of the registry (test_leaves.py), the other only by people
ELSEWHERE = {"statements", "wording"}

# Not compared: headings of tables, words next to a key or a slot, and the meaning of a bit that is 0, since
# the name of a bit describes the bit that is set. The name of a limit does not say that its switch is closed.
# One word is enough to identify the sizes of "supports".
EXCUSED_TEXTS = {("one", "closed"), ("of", "supports")}
EXCUSED = {"chapter", "title of a table", "zero", "beside a key", "meaning of a slot"}


def kind(holder: Any, key: Any) -> str:
    if isinstance(holder, dict):
        return "title of a table" if key == "title" and "rows" in holder else str(key)
    if len(holder) == 2 and isinstance(holder[0], str) and key == 1:
        return "beside a key"
    return "meaning of a slot" if len(holder) == 3 and key == 2 else ""


@pytest.mark.parametrize("chapter", sorted(CHAPTERS - ELSEWHERE))
def test_a_changed_text_in_the_witness_is_a_difference(chapter: str) -> None:
    as_it_is()
    [document] = [each for each in proof().witness if each.data["chapter"] == chapter]
    unnoticed = []
    for holder, key in texts(document.data):
        if kind(holder, key) in EXCUSED:
            continue
        printed, holder[key] = holder[key], "77"
        if found() == as_it_is() and (key, printed) not in EXCUSED_TEXTS:
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


def test_a_changed_fact_in_the_registry_is_a_difference() -> None:
    protocol = proof().protocol
    unnoticed = []
    for message in protocol.messages:
        for what, other in changes(message):
            messages = tuple(other if m is message else m for m in protocol.messages)
            if found(replace(protocol, messages=messages)) == as_it_is():
                unnoticed.append((message.name, what))
    assert unnoticed == []


def test_every_chapter_of_the_witness_is_tried() -> None:
    assert {document.data["chapter"] for document in proof().witness} == CHAPTERS
