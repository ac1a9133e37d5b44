"""One fault: what goes wrong with which bytes or frames, or with which axis."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from typing import Final

from stagewire.direction import Direction
from stagewire_virtual.errors import FaultError
from stagewire_virtual.faults.keys import ACTIONS, KEYS, Action, Kind, Piece, one_of

__all__ = ["DIRECTIONS", "Fault"]

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
