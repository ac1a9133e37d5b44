"""Whether commands that nothing answers are answered by nothing (pages 11 and 16)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Final

from stagewire_conformance.device.check import Case, Kind
from stagewire_conformance.device.checks.apt.clean import clean
from stagewire_conformance.device.checks.apt.wording import described, raw_of

if TYPE_CHECKING:
    from stagewire_conformance.device.declared import Declared, Target
    from stagewire_conformance.device.permissions import Permissions
    from stagewire_conformance.device.trial import Trial


_IDENTIFY: Final = "MOD_IDENTIFY"
_SILENCE: Final = 0.1


KIND = Kind(
    name="identify",
    title="A command is carried out without acknowledgement",
    rules=("command-without-acknowledgement",),
)


def _places(declared: Declared, allowed: Permissions) -> Iterator[Case]:
    for place in declared.places:
        if _IDENTIFY in place.listed:
            yield Case(
                name=place.name,
                words={"place": place.name},
                arguments={"place": place},
                skip=place.why_not(_IDENTIFY),
            )


@KIND.check(
    "{place} flashes its front panel when it is asked to, and says nothing",
    messages=(_IDENTIFY,),
    seconds=0.3,
    each=_places,
)
def _identify(trial: Trial, place: Target) -> None:
    trial.line.send(trial.declared.make(_IDENTIFY), place.address)
    came = trial.line.listen(_SILENCE)
    trial.must(
        not came,
        f"{_IDENTIFY} to {place.name} was answered with {described(trial, came)}; it is carried out without "
        "acknowledgement",
        came=raw_of(came),
    )
    clean(trial, f"after {_IDENTIFY}", place)
