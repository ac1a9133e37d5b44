"""What can be said of a fault: actions, what rules count, and every key with the values that it takes."""

from __future__ import annotations

import difflib
import enum
import math
from collections.abc import Callable, Collection
from dataclasses import dataclass
from typing import Any, Final

__all__ = ["ACTIONS", "KEYS", "Action", "Key", "Kind", "Piece", "one_of"]

_LONGEST: Final = 1_000_000.0  # seconds
_MOST: Final = 10**9
_MOST_OFTEN: Final = 10**6  # a flood without a period sends all at once, and has to come to an end
_MOST_SHOWN: Final = 20  # names in a message for people


class Action(enum.Enum):
    """What a fault does."""

    DROP = "drop"
    INSERT = "insert"
    FLIP = "flip"
    DELAY = "delay"
    DUPLICATE = "duplicate"
    FLOOD = "flood"
    DISCONNECT = "disconnect"
    STICK = "stick"


class Piece(enum.Enum):
    """What a rule counts."""

    BYTE = "byte"
    FRAME = "frame"


@dataclass(frozen=True, slots=True)
class Key:
    """A key of a fault.

    :param attribute: its name in :class:`Fault`.
    :param read: makes the value of a text; raises :class:`ValueError`.
    :param takes: what it takes, for people.
    :param allows: whether a value is one.
    :param spell: makes the text of a value.
    """

    attribute: str
    read: Callable[[str], Any]
    takes: str
    allows: Callable[[Any], bool]
    spell: Callable[[Any], str] = str

    def of(self, fault: object) -> Any:
        """Return its value in a fault, None where it is not given."""
        return getattr(fault, self.attribute)


@dataclass(frozen=True, slots=True)
class Kind:
    """What an action can have.

    :param piece: what its rules count unless it is said; None for one without rules.
    :param keys: the names of its keys.
    """

    piece: Piece | None
    keys: tuple[str, ...]

    @property
    def has_direction(self) -> bool:
        """Whether it befalls bytes that go one way."""
        return self.piece is not None


def _whole(attribute: str, least: int, most: int = _MOST) -> Key:
    def allows(value: Any) -> bool:
        return type(value) is int and least <= value <= most

    return Key(attribute, int, f"a whole number from {least} to {most:,}", allows)


def _seconds(attribute: str) -> Key:
    def allows(value: Any) -> bool:
        return type(value) in (int, float) and 0 <= value <= _LONGEST

    return Key(attribute, float, f"seconds from 0 to {_LONGEST:,.0f}", allows, repr)


def _is_share(value: Any) -> bool:
    return type(value) in (int, float) and math.isfinite(value) and 0 <= value <= 1


def _name(attribute: str, takes: str) -> Key:
    def allows(value: Any) -> bool:
        return type(value) is str and bool(value) and not any(map(str.isspace, value))

    return Key(attribute, str, takes, allows)


def _yes_or_no(text: str) -> bool:
    return {"yes": True, "no": False}[text]


KEYS: Final[dict[str, Key]] = {
    "every": _whole("every", 1),
    "at": _whole("at", 1),
    "p": Key("p", float, "a probability from 0 to 1", _is_share, repr),
    "seed": _whole("seed", 0),
    "message": _name("message", "the name of a message"),
    "hex": Key(
        "data",
        bytes.fromhex,
        "bytes in hex without blanks, such as 640401000150",
        lambda value: type(value) is bytes and bool(value),
        bytes.hex,
    ),
    "bit": _whole("bit", 0),
    "count": _whole("count", 1, _MOST_OFTEN),
    "by": _seconds("by"),
    "overtaken": Key(
        "overtaken",
        _yes_or_no,
        "yes or no",
        lambda value: type(value) is bool,
        lambda value: "yes" if value else "no",
    ),
    "period": _seconds("period"),
    "after": _seconds("after"),
    "for": _seconds("lasting"),
    "channel": _whole("channel", 1),
    "bay": _whole("bay", 0),
    "axis": _name("axis", "the name of an axis"),
}
"""What can be said of a fault, as it is spelled in text, in the order in which it is printed."""

_RULE: Final = ("every", "at", "p", "seed", "message")

ACTIONS: Final[dict[Action, Kind]] = {
    Action.DROP: Kind(Piece.FRAME, _RULE),
    Action.INSERT: Kind(Piece.FRAME, (*_RULE, "hex")),
    Action.FLIP: Kind(Piece.FRAME, (*_RULE, "bit")),
    Action.DELAY: Kind(Piece.FRAME, (*_RULE, "by", "overtaken")),
    Action.DUPLICATE: Kind(Piece.FRAME, (*_RULE, "count")),
    Action.FLOOD: Kind(Piece.FRAME, (*_RULE, "after", "hex", "count", "period")),
    Action.DISCONNECT: Kind(Piece.BYTE, (*_RULE, "after")),
    Action.STICK: Kind(None, ("channel", "bay", "axis", "after", "for")),
}
"""The actions, with what each can have."""


def one_of(word: str, known: Collection[str]) -> str:
    """Return a word that is not known, with what is like it and, unless they are many, what there is."""
    spelled = {name.lower(): name for name in known}
    close = difflib.get_close_matches(word[:40].lower(), spelled, n=2)
    hint = f"; did you mean {' or '.join(map(spelled.__getitem__, close))}?" if close else ""
    there = "" if len(known) > _MOST_SHOWN else f" (there are: {', '.join(known)})"
    shown = word if len(word) <= 40 else f"{word[:40]}…"
    return f"{shown!r}{hint}{there}"
