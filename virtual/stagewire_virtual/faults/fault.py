"""Descriptions of faults: an action, and the bytes, frames or axis that it affects.

``ACTIONS`` has the actions with their keys, and ``KEYS`` has each key with its valid values. Command lines
and benches describe faults as text: ``to_host drop frame every=10``.
"""

from __future__ import annotations

import difflib
import enum
import math
from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass
from typing import Any, Final

from stagewire.protocols import Direction
from stagewire_virtual.errors import FaultError
from stagewire_virtual.options import several

_LONGEST: Final = 1_000_000.0  # seconds
_MOST: Final = 10**9
_MOST_OFTEN: Final = (
    10**6
)  # bounds a flood without a period, which sends all its frames at one instant
_MOST_SHOWN: Final = 20  # names in a message for people


class Action(enum.Enum):
    """The action of a fault."""

    DROP = "drop"
    INSERT = "insert"
    FLIP = "flip"
    DELAY = "delay"
    DUPLICATE = "duplicate"
    FLOOD = "flood"
    DISCONNECT = "disconnect"
    STICK = "stick"


class Piece(enum.Enum):
    """The pieces that a rule counts."""

    BYTE = "byte"
    FRAME = "frame"


@dataclass(frozen=True, slots=True)
class Key:
    """A key of a fault.

    :param attribute: its name in :class:`Fault`.
    :param read: converts text to a value; raises :class:`ValueError` or :class:`KeyError`.
    :param takes: a description of its values for people.
    :param allows: returns whether a value is valid.
    :param spell: converts a value to text.
    """

    attribute: str
    read: Callable[[str], Any]
    takes: str
    allows: Callable[[Any], bool]
    spell: Callable[[Any], str] = str

    def of(self, fault: object) -> Any:
        """Return its value in a fault; None if it is not given."""
        return getattr(fault, self.attribute)


@dataclass(frozen=True, slots=True)
class Kind:
    """The properties of an action.

    :param piece: the pieces that its rules count by default; None for an action without rules.
    :param keys: the names of its keys.
    """

    piece: Piece | None
    keys: tuple[str, ...]

    @property
    def has_direction(self) -> bool:
        """Whether it affects the bytes of one direction."""
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
    "bay": _whole("bay", 1),
    "axis": _name("axis", "the name of an axis"),
}
"""The keys of faults by their names in text, in the order in which they are printed."""

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
"""The properties of each action."""


def one_of(word: str, known: Collection[str]) -> str:
    """Return an unknown word, quoted, with suggestions and, unless there are many, all known words."""
    spelled = {name.lower(): name for name in known}
    close = difflib.get_close_matches(word[:40].lower(), spelled, n=2)
    hint = f"; did you mean {' or '.join(map(spelled.__getitem__, close))}?" if close else ""
    choices = "" if len(known) > _MOST_SHOWN else f" (choose from {', '.join(known)})"
    shown = word if len(word) <= 40 else f"{word[:40]}…"
    return f"{shown!r}{hint}{choices}"


DIRECTIONS: Final = {"to_host": Direction.TO_HOST, "to_controller": Direction.TO_CONTROLLER}
"""The directions by their names in text."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Fault:
    """A fault; :func:`~stagewire_virtual.faults.fault.parse_fault` makes one from text.

    A rule selects pieces: every ``every``-th piece, the piece number ``at`` (from 1), or each piece with
    probability ``p``; without a rule, all pieces. With ``message`` only frames of that message, or their
    bytes, are counted.

    :param action: the action.
    :param direction: the direction of the bytes; None for a stuck axis.
    :param piece: the pieces that the rule counts; by default frames, or bytes for a cut. None for a fault
        that happens at an instant.
    :param seed: the seed of its random choices; None derives it from the seed of the unit.
    :param message: the name of a message; replies without a name have that of their command.
    :param data: the bytes of ``insert`` and ``flood``; by default one random byte, or a status message.
    :param bit: the bit to flip, where 0 is the lowest bit of the first byte; by default a random one.
    :param count: the number of repetitions (``duplicate``) or of frames (``flood``).
    :param by: the delay in seconds.
    :param overtaken: whether later bytes may arrive first; otherwise they wait, as on a serial line.
    :param period: the time between frames of a flood, in seconds.
    :param after: the time from the start to a flood, a cut or a stuck axis, in seconds; excludes a rule.
    :param lasting: the time until the axis moves again, in seconds; None: never. The key in text is ``for``.
    :param channel: the channel that is stuck, in bay ``bay`` of a rack, counted from 1.
    :param axis: the axis that is stuck, for controllers with named axes.

    Raises :class:`~stagewire_virtual.errors.FaultError` for an invalid fault.
    """

    action: Action
    direction: Direction | None = None
    piece: Piece | None = None
    every: int | None = None
    at: int | None = None
    p: float | None = None
    seed: int | None = None
    message: str | None = None
    data: bytes | None = None
    bit: int | None = None
    count: int | None = None
    by: float | None = None
    overtaken: bool | None = None
    period: float | None = None
    after: float | None = None
    lasting: float | None = None
    channel: int | None = None
    bay: int | None = None
    axis: str | None = None

    def __post_init__(self) -> None:
        kind = ACTIONS.get(self.action)
        if kind is None:
            raise FaultError(f"{self.action!r} is not an Action")
        if (self.direction in DIRECTIONS.values()) is not kind.has_direction:
            raise FaultError(
                f"{self.action.value} requires a direction, {' or '.join(DIRECTIONS)}"
                if kind.has_direction
                else f"{self.action.value} has no direction"
            )
        given = {name: key for name, key in KEYS.items() if key.of(self) is not None}
        for name, key in given.items():
            if name not in kind.keys:
                raise FaultError(f"{self.action.value} has no key {one_of(name, kind.keys)}")
            if not key.allows(key.of(self)):
                raise FaultError(f"{name} must be {key.takes}, not {key.of(self)!r}")
        self._check_together(given)
        self._check_piece(kind)

    def _check_piece(self, kind: Kind) -> None:
        """Raise for an invalid piece; without one, use that of the action."""
        if self.piece is None:
            object.__setattr__(self, "piece", None if self.is_timed else kind.piece)
        elif not isinstance(self.piece, Piece):
            raise FaultError(f"{self.piece!r} is neither byte nor frame")
        elif kind.piece is None:
            raise FaultError(f"{self.action.value} accepts neither byte nor frame")
        elif self.is_timed:
            raise FaultError(f"{self.piece.value} requires a rule: every, at, p or message")
        if self.piece is Piece.BYTE and self.bit is not None and self.bit > 7:
            raise FaultError(f"bit must be from 0 to 7 for a byte, not {self.bit}")
        if self.action is Action.INSERT and self.piece is Piece.FRAME and self.data is None:
            raise FaultError("insert frame requires hex=BYTES; insert byte inserts a random byte")

    def _check_together(self, given: Collection[str]) -> None:
        """Raise for keys that exclude each other, and for missing keys."""
        rules = [name for name in ("every", "at", "p", "after") if name in given]
        if len(rules) > 1:
            raise FaultError(f"{' and '.join(rules)} exclude each other; give only one of them")
        if "after" in rules and "message" in given:
            raise FaultError("message requires every, at or p, and excludes after")
        if self.action is Action.DELAY and self.by is None:
            raise FaultError("delay requires by=SECONDS")
        if self.seed is not None and not self._has_chance:
            raise FaultError(
                "seed requires a random choice: p, flip without bit, or insert byte without hex"
            )
        if self.action is Action.STICK and (self.axis is None) is (self.channel is None):
            raise FaultError("stick requires channel=N, with bay=N in a rack, or axis=NAME")
        if self.axis is not None and self.bay is not None:
            raise FaultError("bay requires channel and excludes axis")

    @property
    def _has_chance(self) -> bool:
        return (
            self.p is not None
            or (self.action is Action.FLIP and self.bit is None)
            or (self.action is Action.INSERT and self.data is None)
        )

    @property
    def is_timed(self) -> bool:
        """Whether it happens at an instant instead of at a piece that a rule selects."""
        if self.action is Action.FLOOD:
            return not (self.every or self.at or self.message) and self.p is None
        return self.action is Action.STICK or self.after is not None

    def __str__(self) -> str:
        words = [name for name, direction in DIRECTIONS.items() if direction is self.direction]
        words.append(self.action.value)
        if self.piece is not None:
            words.append(self.piece.value)
        for name, key in KEYS.items():
            if (value := key.of(self)) is not None:
                words.append(f"{name}={key.spell(value)}")
        return " ".join(words)


_ACTIONS = {action.value: action for action in Action}
_PIECES = {piece.value: piece for piece in Piece}


def parse_fault(text: str) -> Fault:
    """Return the fault that a text describes: ``DIRECTION ACTION [byte|frame] [KEY=VALUE …]``.

    ``stick`` has no direction. ``str`` of a fault returns such a text. Raises
    :class:`~stagewire_virtual.errors.FaultError` for an invalid text.
    """
    try:
        return _parse(text.split())
    except FaultError as error:
        shown = text if len(text) <= 100 else f"{text[:100]}…"
        raise FaultError(f"fault {shown!r}: {error}") from None


def parse_faults(faults: Iterable[Fault | str]) -> tuple[Fault, ...]:
    """Return faults that are given as text or as :class:`Fault`.

    Raises :class:`~stagewire_virtual.errors.VirtualError` for anything else, and for a single fault.
    """
    made: list[Fault] = []
    for fault in several("faults", faults):
        if not isinstance(fault, (Fault, str)):
            raise FaultError(f"a fault must be a string or a Fault, not {fault!r}")
        made.append(parse_fault(fault) if isinstance(fault, str) else fault)
    return tuple(made)


def _parse(words: list[str]) -> Fault:
    known = (*DIRECTIONS, Action.STICK.value)
    first = words[0] if words else ""
    if first not in known:
        raise FaultError(f"unknown direction {one_of(first, known)}")
    values: dict[str, Any] = {}
    if first in DIRECTIONS:
        values["direction"] = DIRECTIONS[first]
        del words[0]
    action = words.pop(0) if words else ""
    if action not in _ACTIONS:
        raise FaultError(f"unknown action {one_of(action, _ACTIONS)}")
    if words and words[0] in _PIECES:
        values["piece"] = _PIECES[words.pop(0)]
    for word in words:
        name, equals, value = word.partition("=")
        if not equals:
            raise FaultError(f"{word!r} is not KEY=VALUE; byte or frame comes before all keys")
        key = KEYS.get(name)
        if key is None:
            raise FaultError(f"unknown key {one_of(name, KEYS)}")
        if key.attribute in values:
            raise FaultError(f"{name} is given more than once")
        try:
            values[key.attribute] = key.read(value)
        except (ValueError, KeyError):
            shown = value if len(value) <= 40 else f"{value[:40]}…"
            raise FaultError(f"{name} must be {key.takes}, not {shown!r}") from None
    return Fault(action=_ACTIONS[action], **values)
