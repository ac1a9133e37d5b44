"""Checks of outputs: one for each channel, where what is claimed suffices."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import TYPE_CHECKING, Protocol

from stagewire_conformance.device.check import Check, Need
from stagewire_conformance.device.permissions import COUNTS

if TYPE_CHECKING:
    from stagewire_conformance.device.declared import Declared, Target
    from stagewire_conformance.device.permissions import Permissions
    from stagewire_conformance.device.trial import Trial

__all__ = ["Running", "lacks_unit", "output_checks"]


class Running(Protocol):
    """Looks at a channel of a place."""

    def __call__(self, trial: Trial, place: Target, channel: int) -> None:
        """Look at it, and say to the trial what is found."""


def output_checks(
    declared: Declared,
    kind: str,
    *,
    title: str,
    messages: tuple[str, ...],
    run: Running,
    does: str,
    settings: bool = False,
    seconds: float = 1.0,
    lacks: Callable[[Target], str] = lambda place: "",
    also: Callable[[Target], tuple[str, ...]] = lambda place: (),
    skip: Callable[[Target], str] = lambda place: "",
) -> Iterator[Check]:
    """Make a check for each channel of each place whose list has some messages.

    :param title: with ``{}`` for the channel.
    :param run: looks at a channel of a place.
    :param settings: whether it changes settings, too.
    :param also: gives what else is used of what a place claims.
    :param skip: says why a place cannot be looked at, beside the messages, by the PICS.
    :param lacks: says why what was allowed does not suffice at a place.
    """
    needs = {Need.MOTION} | ({Need.SETTINGS} if settings else set())
    for place in declared.places:
        if not place.listed.issuperset(messages):
            continue
        for channel in place.channels:
            yield Check(
                id=f"{kind}/{place.name}/{channel}",
                title=title.format(f"channel {channel} of {place.name}"),
                messages=(*messages, *also(place)),
                run=partial(run, place=place, channel=channel),
                needs=frozenset(needs),
                does=does,
                seconds=seconds,
                skip=next(filter(None, map(place.why_not, messages)), "") or skip(place),
                lacks=lacks(place),
            )


def lacks_unit(allowed: Permissions, units: tuple[str, ...], what: str) -> str:
    """Return what is missing where the range that is allowed is in other units; empty where it is not."""
    motion = allowed.motion
    if motion is None or motion.unit in (*units, COUNTS):
        return ""
    return f"{motion} is no range of {what}: allow one in {units[0]} or in counts"
