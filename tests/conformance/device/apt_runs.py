"""Runs of the changing checks of Thorlabs APT on virtual controllers in stepped time."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

from faulty_apt_link import FaultyAptLink, LinkFault

import allowances
import stagewire_virtual
from stagewire.links import Link
from stagewire.quantities import Limit
from stagewire_apt import PROTOCOL, stages
from stagewire_conformance.device.checks.apt.replies import requests_of
from stagewire_conformance.device.declaration import Declaration, declare
from stagewire_conformance.device.lines.apt_line import AptLine
from stagewire_conformance.device.permissions import Permissions, Range
from stagewire_conformance.device.pics import BayPics, ChannelPics, Pics
from stagewire_conformance.device.plans import plan
from stagewire_conformance.device.report import Outcome, Report
from stagewire_conformance.device.results import Result
from stagewire_conformance.device.run import run
from stagewire_virtual import VirtualController
from stagewire_virtual.factory import simulated_units
from stagewire_virtual.linking import SteppedLink
from stagewire_virtual.thorlabs_apt.motor.moves import Scales

UNITS = {
    entry["name"]: entry
    for entry in PROTOCOL.registry()["units"]
    if entry["name"] in simulated_units()
}

SETTINGS = ("readback", "counters", "channels", "bays-apart", "loops", "eeprom")
OUTPUTS = (
    "enable", "digital-outputs", "piezo-volts", "piezo-position", "piezo-mode", "piezo-slew", "piezo-lut",
    "piezo-limit", "piezo-zero", "strain-gauge", "solenoid-state", "solenoid-mode", "interlock-mode",
)  # fmt: skip
MOVES = (
    "move-absolute", "move-relative", "move-stored", "move-jog", "move-velocity", "move-stop", "suspend",
    "move-updates", "limits", "move-alone", "profile", "backlash", "in-motion", "disabled",
)  # fmt: skip
EVERY = (*SETTINGS, *OUTPUTS, "home", *MOVES)

_TRAVEL = {"MLS203": 110}
"""Travel on the bench, in the unit of the stage, for a stage without a travel in the registry."""
_OTHERS = 25


@dataclass
class Bench:
    """A virtual controller and its declaration.

    :param motion: the range to allow.
    """

    controller: VirtualController
    declared: Declaration
    motion: str

    @property
    def link(self) -> SteppedLink:
        return SteppedLink(self.controller)

    def allowed(self, motion: str | None = None) -> Permissions:
        return allowances.everything(Range.parse(motion or self.motion))

    def behaviour(self, channel: int = 1, bay: int | None = None) -> Any:
        instrument: Any = self.controller.instrument
        where = {} if bay is None else {"bay": bay}
        return instrument.channel(channel, **where).behaviour


def bench(
    unit: str, stage: str | None = None, seed: int = 0, *, ends: bool = True, **options: Any
) -> Bench:
    """Return a correctly declared unit on a bench; ``ends`` states whether its travel is also declared."""
    facts = UNITS[unit]
    motion = "0..2000000counts" if "MOT_MOVE_HOME" in facts["messages"] else "-10000..20000counts"
    if "built_in" in facts and stage is None:
        motion = "0..500000counts"
        options.setdefault("travel", 625_000)  # its own may be shorter, or too long to home in time
    pics = Pics(unit=unit)
    if stage is not None:
        options["stage"] = getattr(stages, stage)
        length = _travel_in_counts(unit, stage)
        travel = Range.parse(f"0..{length}counts") if ends else None
        fitted = [ChannelPics(number=n, stage=stage, travel=travel) for n in (1, 2)]
        pics = replace(pics, channels=tuple(fitted))
        top = length * 4 // 5  # positions count from the first place, a fifth of the travel
        motion = f"0..{min(top, _travel_in_counts(unit, stage, 12))}counts"
        options.setdefault("travel", length)
    if facts["address"] == "bay":
        pics = replace(pics, bays=(BayPics(number=1, unit=unit),))
    controller = getattr(stagewire_virtual, unit)(seed=seed, **options)
    return Bench(controller, declare(pics), motion)


def _travel_in_counts(unit: str, stage: str, length: int | None = None) -> int:
    """Return the travel of a stage, from the registry if possible, or another length in its unit."""
    limit = getattr(stages, stage).limits["travel"]
    value = limit.value if isinstance(limit, Limit) else _TRAVEL.get(stage, _OTHERS)
    fitted = tuple(ChannelPics(number=n, stage=stage) for n in (1, 2))
    place = declare(replace(Pics(unit=unit), channels=fitted)).places[-1]
    scale = place.position_scale(1)
    # If the sources of the scale contradict each other, it is that of the virtual controller.
    counts = scale.counts_per_unit if scale else Scales(getattr(stages, stage), unit).counts_per_mm
    assert counts is not None  # the suite is run with stages whose scale is known
    return int((value if length is None else length) * counts)


def run_on(
    on: Bench,
    only: Iterable[str],
    *,
    link: Link | None = None,
    allowed: Permissions | None = None,
    seed: int = 1,
) -> Report:
    """Run the checks of some kinds, or some checks by their ids."""
    allowed = on.allowed() if allowed is None else allowed
    wanted = set(only)
    checks = [
        check
        for check in plan(on.declared, allowed)
        if check.id in wanted or (check.kind is not None and check.kind.name in wanted)
    ]
    report = run(link or on.link, checks, on.declared, allowed, seed)
    if report.defect is not None:
        raise report.defect
    assert report.adrift or not report.unfinished, report.unfinished
    return report


def faulty_link(on: Bench, spoil: LinkFault) -> FaultyAptLink:
    """Return a line to a controller with a fault."""
    return FaultyAptLink(on.link, spoil)


def complaints(report: Report) -> dict[str, str]:
    """Return the problems that were found, by check."""
    return {
        outcome.check.id: words_of(outcome)
        for outcome in report.outcomes
        if outcome.result in (Result.FAIL, Result.NON_STRICT)
    }


def words_of(outcome: Outcome) -> str:
    return "; ".join(f"{finding.result}: {finding.text}" for finding in outcome.findings)


def readable(on: Bench, leave_out: Sequence[str] = ()) -> dict[str, str]:
    """Send every possible request, and return the answers by request."""
    line = AptLine(on.link, on.declared, Permissions())
    said = {}
    for place in on.declared.places:
        for request in requests_of(on.declared, place):
            if request.name not in leave_out:
                heard = line.ask(request.message, place.address)
                said[request.id] = "nothing" if heard is None else heard.text
    return said
