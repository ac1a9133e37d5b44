"""How the timed proofs measure: contenders interleaved in one run, medians of ratios, bounds.

A machine is slow for a second and fast for the next. So every round times all contenders one after
the other, beginning with another one each time; a ratio is taken within a round, and the median of
the ratios counts. What only computes is timed by the processor time of this process, which does not
run while another has the core. Nanoseconds are for orientation, never to be compared with another run.
"""

from __future__ import annotations

import statistics
import sys
import time
import timeit
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

ROUNDS = 11

Runner = Callable[[], float]
"""Does the work once and returns what it cost, for one operation (seconds, say, or bytes)."""


@dataclass(frozen=True)
class Bound:
    """What the cost of one contender may be, as a multiple of another's, or beyond it."""

    contender: str
    reference: str
    at_most: float = 0.0
    at_least: float = 0.0
    difference: bool = False
    scale: float = 1.0
    unit: str = "x"

    def of(self, costs: Mapping[str, float]) -> float:
        """Return the figure of one round."""
        ours, theirs = costs[self.contender], costs[self.reference]
        return (ours - theirs) * self.scale if self.difference else ours / theirs

    def holds(self, figure: float) -> bool:
        """Whether the bound is kept."""
        return figure <= self.at_most if self.at_most else figure >= self.at_least

    @property
    def words(self) -> str:
        """The bound for people."""
        wanted = f"<= {self.at_most:g}" if self.at_most else f">= {self.at_least:g}"
        return f"{wanted} {self.unit}"


def statement(code: str, names: Mapping[str, Any], number: int) -> Runner:
    """Return a runner that times a statement ``number`` times, without the cost of a call."""
    timer = timeit.Timer(code, timer=time.process_time, globals=dict(names))
    return lambda: timer.timeit(number) / number


def interleave(contenders: Mapping[str, Runner], rounds: int = ROUNDS) -> list[dict[str, float]]:
    """Return the cost of every contender in every round, after one round that does not count."""
    names = list(contenders)
    for name in names:
        contenders[name]()
    costs = []
    for turn in range(rounds):
        first = turn % len(names)
        costs.append({name: contenders[name]() for name in names[first:] + names[:first]})
    return costs


def report(
    title: str,
    costs: list[dict[str, float]],
    bounds: Iterable[Bound],
    show: Callable[[float], str] = lambda seconds: f"{seconds * 1e9:,.0f} ns",
) -> bool:
    """Print the medians and the bounds; return whether all are kept."""
    rounds = f"median of {len(costs)} rounds" if len(costs) > 1 else "counted, not timed"
    print(f"\n{title} ({rounds})")
    for name in costs[0]:
        print(f"  {name:<44}{show(statistics.median(c[name] for c in costs)):>16}")
    kept = True
    for bound in bounds:
        figure = statistics.median(bound.of(c) for c in costs)
        holds = bound.holds(figure)
        kept &= holds
        what = f"{bound.contender} {'over' if bound.difference else ':'} {bound.reference}"
        print(f"  {what:<58}{figure:>9.2f}  {bound.words:<12}{'' if holds else 'NOT KEPT'}")
    sys.stdout.flush()
    return kept


def holds(what: str, figure: float, at_most: float, unit: str = "") -> bool:
    """Print a bound and whether it is kept."""
    kept = figure <= at_most
    verdict = "" if kept else "     NOT KEPT"
    print(f"  {what:<52}{figure:>9.2f}  <= {at_most:g} {unit}{verdict}")
    return kept


def memory() -> float:
    """Return the memory that this process holds, in MiB; needs ``/proc``."""
    status = Path("/proc/self/status").read_text()
    return (
        next(int(line.split()[1]) for line in status.splitlines() if line.startswith("VmRSS"))
        / 1024
    )
