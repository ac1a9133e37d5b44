"""The time that the suite for controllers takes: every unit, with all permissions, in real time.

Each virtual controller is in memory and runs in real time in its own thread. All run concurrently, since
nearly all of a run is waiting. A run has a bound, and must take as long as its plan announces, give or take a
fifth. The program exits with a non-zero status if a run exceeds this, if it does not finish, or if a check
fails.

    python benchmarks/conformance_time.py
    python benchmarks/conformance_time.py BSC103 TPZ001
"""

from __future__ import annotations

import sys
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from urllib.parse import urlencode

from stagewire.links import open_link
from stagewire_conformance.device.declaration import declare, known_units
from stagewire_conformance.device.permissions import Permissions, Range
from stagewire_conformance.device.pics import BayPics, ChannelPics, Pics
from stagewire_conformance.device.plans import Plan, plan
from stagewire_conformance.device.report import Report
from stagewire_conformance.device.results import Result
from stagewire_conformance.device.run import run
from stagewire_conformance.device.targets import RACK

AT_MOST = 150.0  # seconds for a run with all permissions
OFF = 0.2  # the most by which the announced time may differ, as a fraction of the time that a run takes
COUNTS = "0..100000counts"
RIGHT = (Result.PASS, Result.INFO, Result.SKIP)


@dataclass(frozen=True)
class Run:
    """A run that has ended.

    :param announced: the seconds that its plan announced.
    :param took: the seconds that it took.
    """

    report: Report
    announced: float
    took: float


@dataclass(frozen=True)
class Stand:
    """A unit with the declarations of a vendor.

    :param options: options of the virtual controller, for its URL.
    """

    pics: Pics
    motion: str = COUNTS
    options: tuple[tuple[str, str], ...] = ()

    @property
    def url(self) -> str:
        """The URL of the controller."""
        return f"virtual://{self.pics.unit}?{urlencode(self.options)}".rstrip("?")

    def run(self) -> Run:
        """Run the suite once."""
        declared = declare(self.pics)
        allowed = Permissions(
            settings=True,
            motion=Range.parse(self.motion),
            eeprom=True,
            shutter=True,
            piezo=True,
            zero=True,
        )
        checks = plan(declared, allowed)
        announced = Plan(declared=declared, allowed=allowed, checks=tuple(checks)).seconds
        link = open_link(self.url)
        try:
            began = time.monotonic()
            report = run(link, checks, declared, allowed, seed=1)
            return Run(report, announced, time.monotonic() - began)
        finally:
            link.close()


def staged(unit: str, stage: str, travel: str, motion: str, bays: int = 0) -> Stand:
    """Return a unit with a stage on each channel."""
    channels = tuple(
        ChannelPics(bay=bay, stage=stage, travel=Range.parse(travel))
        for bay in (range(1, bays + 1) if bays else (None,))
    )
    return Stand(Pics(unit=unit, channels=channels), motion, (("stage", stage),))


def stands() -> dict[str, Stand]:
    """Return every unit."""
    found = {unit: Stand(Pics(unit=unit)) for unit in known_units() if unit != RACK}
    found["TDC001"] = staged("TDC001", "Z8", "0..12mm", "0..5mm")
    for unit, bays in (("BBD101", 1), ("BBD102", 2), ("BBD103", 3)):
        found[unit] = staged(unit, "MLS203", "0..110mm", "0..40mm", bays)
    found["BSC103"] = Stand(
        Pics(
            unit="BSC103",
            bays=tuple(BayPics(number=number) for number in (1, 2, 3)),
            channels=tuple(ChannelPics(bay=bay, travel=Range.parse(COUNTS)) for bay in (1, 2, 3)),
        ),
        options=(("travel", "100000"),),
    )
    for unit in ("MS2000", "MFC2000"):
        found[unit] = Stand(Pics(unit=unit), "-20..20mm")
    return found


def judge(name: str, ended: Run) -> bool:
    """Print the times of a run; return whether they are within the bounds and nothing failed."""
    report, took = ended.report, ended.took
    seconds = {outcome.check.id: outcome.seconds for outcome in report.outcomes}
    wrong = [outcome.check.id for outcome in report.outcomes if outcome.result not in RIGHT]
    longest = max(seconds.items(), key=lambda pair: pair[1])
    is_announced = abs(ended.announced - took) <= OFF * took
    kept = took <= AT_MOST and is_announced and not wrong and not report.unfinished
    said = f"longest: {longest[0]}, {longest[1]:.1f} s"
    if wrong or report.unfinished:
        said = f"wrong: {', '.join(wrong[:3])} {report.unfinished}"
        said += "".join(
            f"\n    {finding.text}"
            for outcome in report.outcomes
            if outcome.check.id in wrong
            for finding in outcome.findings
            if finding.result not in RIGHT
        )
    announced = f"announced {ended.announced:5.1f} s ({ended.announced / took - 1:+4.0%})"
    print(
        f"{name:10} {len(seconds):4} checks  {took:5.1f} s  <= {AT_MOST:g} s  {announced}  "
        f"{'ok  ' if kept else 'OVER'}  {said}",
        flush=True,
    )
    return kept


def main(names: list[str]) -> bool:
    """Run all units concurrently; return whether the bounds hold."""
    chosen = stands()
    if unknown := sorted(set(names) - set(chosen)):
        sys.exit(f"unknown unit {', '.join(unknown)} (choose from {', '.join(chosen)})")
    chosen = {name: chosen[name] for name in names or chosen}
    with ThreadPoolExecutor(len(chosen)) as pool:
        runs = {name: pool.submit(stand.run) for name, stand in chosen.items()}
        kept = [judge(name, each.result()) for name, each in runs.items()]
    return all(kept)


if __name__ == "__main__":
    sys.exit(0 if main(sys.argv[1:]) else 1)
