"""What a SET must leave alone: all other parameter sets of its channel."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Self

from stagewire_conformance.device.checks.apt.settings.sets import Spot, Values, parameter_sets

if TYPE_CHECKING:
    from stagewire_conformance.device.trial import Trial


@dataclass(frozen=True)
class Neighbours:
    """The values of the other sets as they were.

    Left out is what lives by itself, such as counters and outputs, which two requests may see differently.
    """

    before: tuple[tuple[Spot, Values], ...]

    @classmethod
    def of(cls, trial: Trial, spot: Spot) -> Self:
        """Read the sets beside one; those that are not answered are left to the checks of answers."""
        before = []
        channel = spot.channel or next(iter(spot.place.channels), None)
        for one in parameter_sets(trial.declared, spot.place):
            is_still = one.effect == "settings" and not one.name.endswith("COUNTER")
            if is_still and one.name != spot.set.name and not one.skip:
                other = Spot(spot.place, channel if one.has_channel else None, one)
                values = _present(trial, other)
                if values is not None:
                    before.append((other, values))
        return cls(tuple(before))

    def judge(self, trial: Trial, after: str) -> None:
        """Say which of them have changed.

        :param after: for the sentence: ``MOT_SET_VELPARAMS was sent``.
        """
        for spot, was in self.before:
            now = _present(trial, spot)
            if now is not None and now != was:
                changed = {name: value for name, value in now.items() if value != was[name]}
                trial.must(
                    False,
                    f"{spot.text}: after {after}, {spot.set.get} said "
                    + ", ".join(
                        f"{name} = {value!r}, not {was[name]!r}" for name, value in changed.items()
                    )
                    + "; a SET changes its own parameters only",
                )


def _present(trial: Trial, spot: Spot) -> Values | None:
    request = trial.declared.make(spot.set.req, spot.channel)
    came = trial.line.ask(request, spot.place.address)
    return None if came is None else spot.values(came)
