"""Trapezoidal motion for the firmware of the corpus: pieces of constant acceleration over time."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace


@dataclass(frozen=True)
class Piece:
    """A stretch of time with constant acceleration.

    :param start: the instant at which it begins, in seconds.
    :param lasts: its duration; infinite for a motion without an end.
    :param x: position at the start, in counts.
    :param v: velocity at the start, in counts per second.
    :param a: acceleration, in counts per second squared.
    """

    start: float
    lasts: float
    x: float
    v: float
    a: float

    @property
    def end(self) -> float:
        return self.start + self.lasts

    def position(self, at: float) -> float:
        t = min(at, self.end) - self.start
        return self.x + self.v * t + self.a * t * t / 2

    def speed(self, at: float) -> float:
        return self.v + self.a * (min(at, self.end) - self.start)


@dataclass(frozen=True)
class Path:
    """A motion that ends at rest, or never.

    :param pieces: its pieces in order; none for an axis at rest.
    :param rest: the position after the last piece.
    """

    pieces: tuple[Piece, ...]
    rest: float

    @property
    def end(self) -> float:
        return self.pieces[-1].end if self.pieces else -math.inf

    def piece(self, at: float) -> Piece | None:
        return next((piece for piece in self.pieces if at < piece.end), None)

    def position(self, at: float) -> float:
        piece = self.piece(at)
        return self.rest if piece is None else piece.position(at)

    def speed(self, at: float) -> float:
        piece = self.piece(at)
        return 0.0 if piece is None else piece.speed(at)

    def direction(self, at: float) -> int:
        """Return 1 forward, -1 in reverse, 0 at rest."""
        piece = self.piece(at)
        if piece is None:
            return 0
        v = piece.speed(at) or piece.a
        return (v > 0) - (v < 0)

    def within(self, low: float, high: float) -> Path:
        """Return the path with an abrupt stop where it leaves a range."""
        kept: list[Piece] = []
        for piece in self.pieces:
            found = [
                (after, bound)
                for bound, side in ((low, -1), (high, 1))
                if (after := _leaves(piece, bound, side)) is not None
            ]
            if found:
                after, bound = min(found)
                return Path((*kept, replace(piece, lasts=after)), bound)
            kept.append(piece)
        return self


def _leaves(piece: Piece, bound: float, side: int) -> float | None:
    """Return after how many seconds a piece passes a bound; ``side`` is 1 for an upper bound."""
    gap, v, a = side * (bound - piece.x), side * piece.v, side * piece.a
    if gap <= 1e-6 and (v > 0 or (v == 0 and a > 0)):
        return 0.0
    if a == 0:
        after = gap / v if v > 0 else math.inf
    else:
        root = v * v + 2 * a * gap
        if root < 0:
            return None
        times = [(-v + sign * math.sqrt(root)) / a for sign in (-1, 1)]
        after = min((t for t in times if t > 1e-9 and v + a * t > 0), default=math.inf)
    return after if after < piece.lasts - 1e-9 else None


def _chain(at: float, x: float, v: float, legs: list[tuple[float, float]]) -> list[Piece]:
    """Join legs, each a duration and an acceleration."""
    pieces = []
    for lasts, a in legs:
        if lasts <= 0:
            continue
        piece = Piece(at, lasts, x, v, a)
        pieces.append(piece)
        if math.isinf(lasts):
            break
        at, x, v = piece.end, piece.position(piece.end), piece.speed(piece.end)
    return pieces


def resting(x: float) -> Path:
    return Path((), x)


def to_rest(at: float, x: float, v: float, acceleration: float) -> Path:
    """Slow down and stop."""
    lasts = abs(v) / acceleration
    return Path(
        tuple(_chain(at, x, v, [(lasts, -math.copysign(acceleration, v))])), x + v * lasts / 2
    )


def at_speed(at: float, x: float, v: float, speed: float, acceleration: float) -> Path:
    """Change to a speed and keep it."""
    change = speed - v
    legs = [(abs(change) / acceleration, math.copysign(acceleration, change)), (math.inf, 0.0)]
    return Path(tuple(_chain(at, x, v, legs)), x)


def to_target(
    at: float, x: float, v: float, target: float, cap: float, acceleration: float
) -> Path:
    """Move to a target with a trapezoidal velocity, from any speed."""
    stop = x + v * abs(v) / (2 * acceleration)
    side = 1 if target >= stop else -1
    gap, v_side = side * (target - x), side * v
    peak = math.sqrt(max(0.0, (2 * acceleration * gap + v_side * v_side) / 2))
    peak = min(peak, cap)
    change = (peak - v_side) / acceleration
    used = (peak + v_side) * abs(change) / 2 + peak * peak / (2 * acceleration)
    legs = [
        (abs(change), math.copysign(acceleration, side * change)),
        (max(0.0, gap - used) / peak if peak > 0 else 0.0, 0.0),
        (peak / acceleration, -side * acceleration),
    ]
    return Path(tuple(_chain(at, x, v, legs)), target)


def then(first: Path, second: Path) -> Path:
    """Join two paths; the second begins where and when the first ends."""
    return Path((*first.pieces, *second.pieces), second.rest)
