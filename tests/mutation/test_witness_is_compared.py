"""Every fact in the witness is compared: a changed value or a lost row is a difference."""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import cache
from typing import Any

import pytest
from mutants import Proof, proof_of

from stagewire_generator.lint.witness.witness import compare_witness
from stagewire_generator.strict_yaml import Document

# Place in the files of the witness (* is any key or row) -> another value to try there.
CHANGED = {
    "addresses/*/1": "0x77",
    "formats/*/1": "quad",
    "formats/*/2": "9 bytes",
    "lists/*/page": 999,
    "lists/*/rows/*/id": "0x7777",
    "lists/*/rows/*/name": "MGMSG_NO_SUCH",
    "lists/*/rows/*/page": "999",
    "mentions/*/id": "0x7777",
    "mentions/*/name": "MGMSG_NO_SUCH",
    "messages/*/heading/id": "0x7777",
    "messages/*/heading/page": 999,
    "messages/*/ranges/*/default": "77",
    "messages/*/ranges/*/from": "77",
    "messages/*/ranges/*/to": "77",
    "messages/*/rows/*/0": "No Such Field",
    "messages/*/rows/*/1": "quad",
    "messages/*/tables/*/columns/*": "No Such Column",
    "messages/*/tables/*/header/*": "77",
    "messages/*/tables/*/last_offset": 777,
    "messages/*/tables/*/packet": 777,
    "messages/*/tables/*/structure": 777,
    "messages/*/values/*/rows/*/0": "0x77",
    "motor_controllers/*/1": "XYZ001",
    "piezo_controllers/*/1": "XYZ001",
    "rows/*/id": "0x7777",
    "rows/*/name": "MGMSG_NO_SUCH",
    "rows/*/page": "999",
    "usb_prefixes/*/1": "99 at the front",
    "usb_prefixes/*/3": "XYZ001",
}
# Changes that cannot be detected. Strings have no size, a note describes the parts of a byte string, a value
# for future use is undefined, and a limit may be the name of another field. Ranges under a name that no field
# has cannot be compared.
NAMES_IN_PROSE = ("SettleWnd", "TrackWnd")


def excused(printed: object, holder: Any) -> bool:
    if isinstance(holder, dict):
        field = re.fullmatch(r"[A-Z][a-z]+[A-Za-z]*[0-9]", str(printed))
        return field is not None or holder.get("of") in NAMES_IN_PROSE
    texts = [str(cell) for cell in holder]
    return "future" in texts[-1].lower() or texts[0].startswith("byte[") or texts[1].endswith("[N]")


LOST = ("addresses/*", "lists/*/rows/*", "usb_prefixes/*")
A_PART = 50  # of each kind, evenly spread

how_many = pytest.mark.parametrize(
    "number", [A_PART, pytest.param(0, marks=pytest.mark.matrix)], ids=["a part", "all"]
)

Found = tuple[dict[str, tuple[str, str]], list[str]]


def proof() -> Proof:
    return proof_of("thorlabs_apt")


def found(documents: list[Document]) -> Found:
    """Return the differences by place, and the unknown names."""
    comparison = compare_witness(proof().protocol, documents)
    differences = {d.place: (d.printed, d.encoded) for d in comparison.differences.values()}
    return differences, [name for _, name in comparison.unknown]


class Unchanged:
    """The differences before any change, in all documents and in each one alone."""

    def __init__(self) -> None:
        self.whole = found(proof().witness)
        self.alone = [found([document]) for document in proof().witness]

    def elsewhere(self, number: int) -> set[str]:
        """Return the places at which other documents differ."""
        others = (differences for at, (differences, _) in enumerate(self.alone) if at != number)
        return set().union(*others)


@cache
def unchanged() -> Unchanged:
    return Unchanged()


def noticed(number: int) -> bool:
    """Return whether the change of a document is a difference.

    Comparing one document is quick. A difference that only this document can cause also appears when all are
    compared.
    """
    (before, names), (after, other_names) = (
        unchanged().alone[number],
        found([proof().witness[number]]),
    )
    changed = {place for place, _ in before.items() ^ after.items()}
    if names != other_names or changed - unchanged().elsewhere(number):
        return True
    return found(proof().witness) != unchanged().whole


def places(node: Any, pattern: list[str]) -> Iterator[tuple[Any, Any]]:
    """Yield every place of a pattern as its container and its key."""
    step, *rest = pattern
    keys = dict(enumerate(node)) if isinstance(node, list) else node
    for key in keys if isinstance(keys, dict) else ():
        if step in ("*", str(key)):
            if rest:
                yield from places(node[key], rest)
            else:
                yield node, key


def chosen(pattern: str, number: int) -> list[tuple[int, Any, Any]]:
    """Return places of a pattern, each with its document number; all of them if ``number`` is 0."""
    whole = [
        (at, holder, key)
        for at, document in enumerate(proof().witness)
        for holder, key in places(document.data, pattern.split("/"))
    ]
    assert whole
    return whole[:: max(1, len(whole) // number)] if number else whole


@how_many
@pytest.mark.parametrize("pattern", CHANGED)
def test_a_changed_value_is_a_difference(pattern: str, number: int) -> None:
    unchanged()
    unnoticed = []
    for at, (document, holder, key) in enumerate(chosen(pattern, number)):
        printed = holder[key]
        holder[key] = CHANGED[pattern]
        try:
            seen = noticed(document)
            if not number and at % A_PART == 0:
                assert seen == (found(proof().witness) != unchanged().whole)
        finally:
            holder[key] = printed
        if not seen and not excused(printed, holder):
            unnoticed.append((printed, holder))
    assert unnoticed == []


@how_many
@pytest.mark.parametrize("pattern", LOST)
def test_a_lost_row_is_a_difference(pattern: str, number: int) -> None:
    unchanged()
    unnoticed = []
    for document, holder, key in chosen(pattern, number):
        row = holder.pop(key)
        try:
            if not noticed(document):
                unnoticed.append(row)
        finally:
            holder.insert(key, row)
    assert unnoticed == []
