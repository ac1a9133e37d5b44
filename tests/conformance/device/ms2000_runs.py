"""Runs of the suite on a virtual MS-2000 in stepped time, and the state of the controller."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import stagewire_virtual
from stagewire.links import Link
from stagewire_conformance.device.declaration import Declaration, declare
from stagewire_conformance.device.permissions import Permissions, Range
from stagewire_conformance.device.pics import ChannelPics, Pics, Timing
from stagewire_conformance.device.plans import plan
from stagewire_conformance.device.report import Report
from stagewire_conformance.device.results import Result
from stagewire_conformance.device.run import run
from stagewire_virtual import VirtualController
from stagewire_virtual.asi_ms2000.instrument import Ms2000Instrument
from stagewire_virtual.linking import SteppedLink

WIDE = Permissions(settings=True, motion=Range.parse("-20..20mm"))
"""A range that is large enough for every check."""
NOTHING = Permissions()
CHANGING = ["readback", "written-size", "marks-in-data", "joystick", "formats"]
MOVING = [
    "move-target", "move-increment", "move-together", "stop-start", "top-speed", "move-vector",
    "ramps", "counter",
]  # fmt: skip


def controller_of(
    unit: str = "MS2000", strategies: Mapping[str, str] | None = None, **settings: int
) -> VirtualController:
    """Return a virtual controller."""
    made: VirtualController = getattr(stagewire_virtual, unit)(strategies=strategies, **settings)
    return made


def declared_with(
    unit: str = "MS2000",
    *,
    axes: Sequence[str] = ("X", "Y"),
    travel: str = "",
    firmware: str = "",
    reply_p99_ms: float | None = None,
    unsupported: Mapping[str, str] | None = None,
) -> Declaration:
    """Return a controller as declared by a PICS."""
    span = Range.parse(travel) if travel else None
    return declare(
        Pics(
            unit=unit,
            channels=tuple(ChannelPics(axis=axis, travel=span) for axis in axes),
            firmware=firmware,
            timing=Timing(reply_p99_ms=reply_p99_ms),
            unsupported=unsupported or {},
        )
    )


def run_suite(
    link: Link,
    declared: Declaration | None = None,
    allowed: Permissions = WIDE,
    only: Sequence[str] = (),
    seed: int = 1,
) -> Report:
    """Run checks, and fail if the run does not finish."""
    declared = declared or declare("MS2000")
    report = run(link, plan(declared, allowed, only=only), declared, allowed, seed)
    assert not report.unfinished, report.unfinished
    return report


def found(report: Report, *results: Result) -> list[tuple[str, Result, str]]:
    """Return check id, result and text of the checks with certain results."""
    return [
        (outcome.check.id, outcome.result, "; ".join(each.text for each in outcome.findings))
        for outcome in report.outcomes
        if outcome.result in results
    ]


def state_of(controller: VirtualController) -> dict[str, dict[str, Any]]:
    """Return everything that a host can change in a controller, axis by axis."""
    instrument = controller.instrument
    assert isinstance(instrument, Ms2000Instrument)
    return {
        name: {
            "position": axis.position,
            "target": axis.target,
            "increment": axis.increment,
            "ramp_time": axis.ramp_time,
            "top_speed": axis.top_speed,
            "joystick": axis.joystick_enabled,
            "enabled": axis.enabled,
            "does": axis.words,
        }
        for name, axis in instrument.axes.items()
    }


def understands_commands(controller: VirtualController) -> bool:
    """Return whether a controller is in the command format."""
    controller.read()
    controller.write(b"\x18s\x02:")
    return len(controller.read(timeout=0.01)) == 2


def stepped(controller: VirtualController) -> SteppedLink:
    """Return a stepped line to a controller."""
    return SteppedLink(controller)
