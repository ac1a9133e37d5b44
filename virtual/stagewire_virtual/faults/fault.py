"""One fault: what goes wrong with which bytes or frames, or with which axis.

``ACTIONS`` and ``KEYS`` say what can be said of a fault: actions, what rules count, and every key with the
values that it takes. Command lines and benches write faults as text: ``to_host drop frame every=10``.
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


DIRECTIONS: Final = {"to_host": Direction.TO_HOST, "to_controller": Direction.TO_CONTROLLER}
"""How directions are spelled."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Fault:
    """Something that goes wrong; :func:`~stagewire_virtual.faults.parse_fault` makes one of a text.

    A rule chooses the pieces that are hit: each ``every``-th, the one that is number ``at`` (from 1), or each
    with the probability ``p``; without a rule, all of them. With ``message`` only frames of that message, or
    their bytes, are counted.

    :param action: what is done.
    :param direction: which way the bytes go; None for an axis that sticks.
    :param piece: what the rule counts; by default frames, and bytes where the line is cut. None for what
        comes at an instant, and not with a piece.
    :param seed: of what is left to chance; None takes it from the line.
    :param message: name of a message; of a protocol of commands, a reply is named by what it answers.
    :param data: the bytes of ``insert`` and ``flood``; by default one byte by chance, and a status message.
    :param bit: the bit that is flipped, from 0, the lowest of the first byte; by default one by chance.
    :param count: how many times more (``duplicate``), or how many frames (``flood``).
    :param by: seconds of delay.
    :param overtaken: whether what follows goes on in the meantime; otherwise it waits, as on a serial line.
    :param period: seconds between frames of a flood.
    :param after: seconds from the beginning to a flood, a cut or an axis that sticks, where no rule is given.
    :param lasting: seconds until the axis moves again; None: never. Spelled ``for`` in text.
    :param channel: the channel that sticks, in the bay ``bay`` of a rack.
    :param axis: the axis that sticks, where axes have names.

    Raises :class:`~stagewire_virtual.errors.FaultError` for a fault that makes no sense.
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
            raise FaultError(f"{self.action!r} is no action")
        if (self.direction in DIRECTIONS.values()) is not kind.has_direction:
            raise FaultError(
                f"{self.action.value} needs a direction, {' or '.join(DIRECTIONS)}"
                if kind.has_direction
                else f"{self.action.value} has no direction"
            )
        given = {name: key for name, key in KEYS.items() if key.of(self) is not None}
        for name, key in given.items():
            if name not in kind.keys:
                raise FaultError(f"{self.action.value} has no key {one_of(name, kind.keys)}")
            if not key.allows(key.of(self)):
                raise FaultError(f"{name} takes {key.takes}, not {key.of(self)!r}")
        self._check_together(given)
        self._check_piece(kind)

    def _check_piece(self, kind: Kind) -> None:
        """Raise for a piece that nothing counts; without one, take that of the action."""
        if self.piece is None:
            object.__setattr__(self, "piece", None if self.is_timed else kind.piece)
        elif not isinstance(self.piece, Piece):
            raise FaultError(f"{self.piece!r} is neither byte nor frame")
        elif kind.piece is None:
            raise FaultError(f"{self.action.value} has neither byte nor frame")
        elif self.is_timed:
            raise FaultError(f"{self.piece.value} goes with a rule: every, at, p or message")
        if self.piece is Piece.BYTE and self.bit is not None and self.bit > 7:
            raise FaultError(f"the bits of a byte are 0 to 7, not {self.bit}")
        if self.action is Action.INSERT and self.piece is Piece.FRAME and self.data is None:
            raise FaultError("insert frame needs hex=BYTES; insert byte puts one in by chance")

    def _check_together(self, given: Collection[str]) -> None:
        """Raise for keys that contradict each other, or that lack another."""
        rules = [name for name in ("every", "at", "p", "after") if name in given]
        if len(rules) > 1:
            raise FaultError(f"{' and '.join(rules)} exclude each other; give one of them")
        if "after" in rules and "message" in given:
            raise FaultError("message goes with every, at or p, not with after")
        if self.action is Action.DELAY and self.by is None:
            raise FaultError("delay needs by=SECONDS")
        if self.seed is not None and not self._has_chance:
            raise FaultError(
                "seed goes with p, with flip without bit, or with insert byte without hex; "
                "nothing else is left to chance"
            )
        if self.action is Action.STICK and (self.axis is None) is (self.channel is None):
            raise FaultError("stick needs channel=N, perhaps with bay=N, or axis=NAME")
        if self.axis is not None and self.bay is not None:
            raise FaultError("bay goes with channel, not with axis")

    @property
    def _has_chance(self) -> bool:
        return (
            self.p is not None
            or (self.action is Action.FLIP and self.bit is None)
            or (self.action is Action.INSERT and self.data is None)
        )

    @property
    def is_timed(self) -> bool:
        """Whether it comes at an instant, ``after`` so long, and not with a piece that a rule chooses."""
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

    ``stick`` has no direction. ``str`` of a fault is such a text. Raises
    :class:`~stagewire_virtual.errors.FaultError`, which says what was expected.
    """
    try:
        return _parse(text.split())
    except FaultError as error:
        shown = text if len(text) <= 100 else f"{text[:100]}…"
        raise FaultError(f"fault {shown!r}: {error}") from None


def parse_faults(faults: Iterable[Fault | str]) -> tuple[Fault, ...]:
    """Return the faults that are given as text or as values.

    Raises :class:`~stagewire_virtual.errors.VirtualError` for what is neither, and for one alone.
    """
    made: list[Fault] = []
    for fault in several("faults", faults):
        if not isinstance(fault, (Fault, str)):
            raise FaultError(f"a fault is a text or a Fault, not {fault!r}")
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
        raise FaultError(f"there is no action {one_of(action, _ACTIONS)}")
    if words and words[0] in _PIECES:
        values["piece"] = _PIECES[words.pop(0)]
    for word in words:
        name, equals, value = word.partition("=")
        if not equals:
            raise FaultError(f"{word!r} is neither byte or frame, before all keys, nor KEY=VALUE")
        key = KEYS.get(name)
        if key is None:
            raise FaultError(f"there is no key {one_of(name, KEYS)}")
        if key.attribute in values:
            raise FaultError(f"{name} is there twice")
        try:
            values[key.attribute] = key.read(value)
        except (ValueError, KeyError):
            shown = value if len(value) <= 40 else f"{value[:40]}…"
            raise FaultError(f"{name} takes {key.takes}, not {shown!r}") from None
    return Fault(action=_ACTIONS[action], **values)
