"""Faulty controllers of Issue 37, each with the kinds of checks that find the fault and the broken rule."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from faulty_apt_link import (
    Change,
    LinkFault,
    byte,
    dropped,
    flip,
    followed_by,
    frame,
    name_of,
    of,
    plus,
    renamed,
    shorter,
    twice,
)


@dataclass(frozen=True)
class LaterFault:
    """A fault of a virtual controller.

    :param name: as in a bug report.
    :param units: the units that have it.
    :param make: makes the fault, for one run.
    :param kinds: the kinds of checks that find it.
    :param rule: the rule that a finding names.
    """

    name: str
    units: tuple[str, ...]
    make: Callable[[], LinkFault]
    kinds: tuple[str, ...]
    rule: str


def F(
    name: str, units: str, make: Callable[[], LinkFault], kinds: tuple[str, ...], rule: str
) -> LaterFault:
    """Return a fault; the names of its units have blanks between them."""
    return LaterFault(name, tuple(units.split()), make, kinds, rule)


def says(names: str, change: Change) -> Callable[[], LinkFault]:
    """Change messages from the controller; several names have blanks between them."""
    return lambda: LinkFault(to_host=of(names.split(), change))


def takes(names: str, change: Change) -> Callable[[], LinkFault]:
    """Change messages to the controller."""
    return lambda: LinkFault(to_controller=of(names.split(), change))


def cut(length: int) -> Change:
    """Shorten the packet to a length."""
    return lambda raw: raw[:2] + length.to_bytes(2, "little") + raw[4 : 6 + length]


def filled(length: int) -> Change:
    """Lengthen the packet to a length with zeros."""
    return lambda raw: (raw[:2] + length.to_bytes(2, "little") + raw[4:]).ljust(6 + length, b"\0")


def word(at: int, value: int) -> Change:
    """Replace two bytes."""
    return lambda raw: raw[:at] + value.to_bytes(2, "little") + raw[at + 2 :]


def long(at: int, value: int) -> Change:
    """Replace four bytes."""
    return lambda raw: raw[:at] + value.to_bytes(4, "little", signed=True) + raw[at + 4 :]


def scaled(at: int, factor: float) -> Change:
    """Multiply a signed number of four bytes."""

    def change(raw: bytes) -> bytes:
        value = int.from_bytes(raw[at : at + 4], "little", signed=True)
        return long(at, round(value * factor))(raw)

    return change


def reversed_bytes(at: int, size: int) -> Change:
    """Use the other byte order."""
    return lambda raw: raw[:at] + raw[at : at + size][::-1] + raw[at + size :]


def exchanged(first: int, second: int, size: int) -> Change:
    """Exchange two fields."""

    def change(raw: bytes) -> bytes:
        one, other = raw[first : first + size], raw[second : second + size]
        return raw[:first] + other + raw[first + size : second] + one + raw[second + size :]

    return change


def forgets(name: str, start: int, end: int) -> Callable[[], LinkFault]:
    """Never store some bytes of a parameter set: its GET keeps the first ones."""

    def make() -> LinkFault:
        first: list[bytes] = []

        def change(raw: bytes) -> bytes:
            first[:] = first or [raw[start:end]]
            return raw[:start] + first[0] + raw[end:]

        return LinkFault(to_host=of(f"MOT_GET_{name}", change))

    return make


def one_for_all(set_name: str, get_name: str, start: int) -> Callable[[], LinkFault]:
    """Store the settings of one connector for all of them."""

    def make() -> LinkFault:
        last: list[bytes] = []

        def note(raw: bytes) -> bytes:
            if name_of(raw) == set_name:
                last[:] = [raw[start:]]
            return raw

        def answer(raw: bytes) -> bytes:
            return raw[:start] + last[0] if name_of(raw) == get_name and last else raw

        return LinkFault(to_host=answer, to_controller=note)

    return make


def counted_from_one(raw: bytes) -> bytes:
    """Count bays from 1 in requests about bays."""
    return byte(2, raw[2] - 1)(raw) if raw[2] else b""


def in_both_bays(raw: bytes) -> bytes:
    """Also send to the other bay what is for one of the first two."""
    return raw + byte(4, raw[4] ^ 3)(raw)


__all__ = [
    "F", "LaterFault", "LinkFault", "byte", "counted_from_one", "cut", "dropped", "exchanged", "filled",
    "flip", "followed_by", "forgets", "frame", "in_both_bays", "long", "name_of", "of", "one_for_all",
    "plus", "renamed", "reversed_bytes", "says", "scaled", "shorter", "takes", "twice", "word",
]  # fmt: skip
