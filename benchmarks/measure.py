"""Timing for the benchmarks: interleaved contenders, medians of ratios, and bounds.

The speed of a shared machine varies from second to second. Each round therefore times all contenders one
after the other, starting with a different one each time. A ratio is taken within a round, and the median of
the ratios is the result. Code that only computes is timed by the processor time of this process, which
excludes other programs. Nanoseconds are for orientation; do not compare them between runs.
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
"""Run the work once and return its cost per operation, for example in seconds or bytes."""


@dataclass(frozen=True)
class Bound:
    """A bound on the cost of a contender, as a multiple of that of a reference or as a difference from it."""

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
        """Return whether a figure is within the bound."""
        return figure <= self.at_most if self.at_most else figure >= self.at_least

    @property
    def words(self) -> str:
        """The bound as text."""
        wanted = f"<= {self.at_most:g}" if self.at_most else f">= {self.at_least:g}"
        return f"{wanted} {self.unit}"


def statement(code: str, names: Mapping[str, Any], number: int) -> Runner:
    """Return a runner that times ``number`` executions of a statement, without call overhead."""
    timer = timeit.Timer(code, timer=time.process_time, globals=dict(names))
    return lambda: timer.timeit(number) / number


def interleave(contenders: Mapping[str, Runner], rounds: int = ROUNDS) -> list[dict[str, float]]:
    """Return the cost of every contender in every round, after a warm-up round."""
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
    """Print the medians and the bounds; return whether all bounds hold."""
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
    """Print a bound and whether it holds."""
    kept = figure <= at_most
    verdict = "" if kept else "     NOT KEPT"
    print(f"  {what:<52}{figure:>9.2f}  <= {at_most:g} {unit}{verdict}")
    return kept


def memory() -> float:
    """Return the resident memory of this process in MiB; needs ``/proc``."""
    status = Path("/proc/self/status").read_text()
    return (
        next(int(line.split()[1]) for line in status.splitlines() if line.startswith("VmRSS"))
        / 1024
    )
