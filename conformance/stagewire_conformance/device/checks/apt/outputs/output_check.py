"""Checks of outputs: one for each channel, where what is claimed suffices."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import TYPE_CHECKING, Protocol

from stagewire_conformance.device.check import ALLOWED, Check, Kind
from stagewire_conformance.device.permissions import COUNTS, Need

if TYPE_CHECKING:
    from stagewire_conformance.device.declaration import Declaration
    from stagewire_conformance.device.permissions import Permissions
    from stagewire_conformance.device.targets import Target
    from stagewire_conformance.device.trial import Trial


class Running(Protocol):
    """Looks at a channel of a place."""

    def __call__(self, trial: Trial, place: Target, channel: int) -> None:
        """Look at it, and say to the trial what is found."""


def output_check(
    kind: Kind,
    title: str,
    *,
    messages: tuple[str, ...],
    does: str,
    settings: bool = False,
    seconds: float = 1.0,
    lacks: Callable[[Declaration, Permissions, Target], str] = lambda declared, allowed, place: "",
    also: Callable[[Target], tuple[str, ...]] = lambda place: (),
    skip: Callable[[Declaration, Target], str] = lambda declared, place: "",
) -> Callable[[Running], Running]:
    """Declare a function that looks at a channel as a check of each channel whose place has some messages.

    :param title: with ``{}`` for the channel.
    :param does: with ``{}`` for the range.
    :param settings: whether it changes settings, too.
    :param also: gives what else is used of what a place claims.
    :param skip: says why a place cannot be looked at, beside the messages, by the PICS.
    :param lacks: says why what was allowed does not suffice at a place.
    """
    needs = frozenset({Need.MOTION, Need.SETTINGS} if settings else {Need.MOTION})

    def checks(run: Running, declared: Declaration, allowed: Permissions) -> Iterator[Check]:
        for place in declared.places:
            if not place.listed.issuperset(messages):
                continue
            for channel in place.channels:
                yield Check(
                    id=f"{kind.name}/{place.name}/{channel}",
                    title=title.format(f"channel {channel} of {place.name}"),
                    messages=(*messages, *also(place)),
                    run=partial(run, place=place, channel=channel),
                    needs=needs,
                    does=does.format(allowed.motion or ALLOWED),
                    seconds=seconds,
                    skip=next(filter(None, map(place.why_not, messages)), "")
                    or skip(declared, place),
                    lacks=lacks(declared, allowed, place),
                )

    return kind.declare(checks)


def lacks_volts(declared: Declaration, allowed: Permissions, place: Target) -> str:
    """Return what is missing where the range that is allowed is of no voltages; empty where it is."""
    return lacks_unit(allowed, ("V", "mV"), "voltages")


def lacks_unit(allowed: Permissions, units: tuple[str, ...], what: str) -> str:
    """Return what is missing where the range that is allowed is in other units; empty where it is not."""
    motion = allowed.motion
    if motion is None or motion.unit in (*units, COUNTS):
        return ""
    return f"{motion} is no range of {what}: allow one in {units[0]} or in counts"
