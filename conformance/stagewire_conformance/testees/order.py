"""Many lines at once: the answers have to come, and in the order of the requests."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from random import Random

from stagewire_conformance.testees.case import Case, Step

__all__ = ["at_once"]

_ROUNDS = 5
_LINES = 300


def at_once(cases: Sequence[Case], seed: int) -> Iterator[Case]:
    """Yield rounds of lines that are all sent before the first answer is read.

    :param cases: where they are taken from, by chance.
    """
    random = Random(f"order {seed}")
    short = [step for case in cases for step in case.steps if _is_short(step)]
    for number in range(_ROUNDS):
        chosen = tuple(random.choice(short) for _ in range(_LINES))
        yield Case(
            id=f"order/at_once.{number}",
            group="order",
            steps=chosen,
            about=f"{_LINES} lines are sent before the first answer is read",
            at_once=True,
        )


def _is_short(step: Step) -> bool:
    return len(step.line(0)) < 10_000
