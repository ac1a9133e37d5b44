"""``digital-outputs``: each of the four digital outputs is switched, and told as it is (page 26)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from stagewire_apt.flags import RackDigitalOutputs
from stagewire_conformance.device.check import Case, Kind, Need
from stagewire_conformance.device.checks.apt.settings.sets import Spot, parameter_sets

if TYPE_CHECKING:
    from stagewire_conformance.device.declared import Declared
    from stagewire_conformance.device.permissions import Permissions
    from stagewire_conformance.device.trial import Trial


_SET = "RACK_DIGOUTPUTS"


KIND = Kind(
    name="digital-outputs",
    title="Digital outputs are switched one by one, and told as they are",
    rules=("digital-outputs", "digital-outputs-bits", "command-without-acknowledgement"),
)


def _outputs(declared: Declared, allowed: Permissions) -> Iterator[Case]:
    for place in declared.places:
        for one in parameter_sets(declared, place):
            if one.name == _SET:
                yield Case(
                    name=place.name,
                    words={"set": one.set, "place": place.name},
                    arguments={"spot": Spot(place, None, one)},
                    messages=one.messages,
                    skip=one.skip,
                )


@KIND.check(
    "{set} switches the digital outputs of {place}",
    needs={Need.MOTION},
    does="switches each of the four digital outputs for a moment, whatever is connected to them",
    each=_outputs,
)
def _run(trial: Trial, spot: Spot) -> None:
    (field,) = spot.set.fields
    before: int = spot.read(trial)[field]
    trial.undo(
        f"digital outputs of {spot.place.name}", lambda: spot.put_back(trial, {field: before})
    )
    for name, mask in RackDigitalOutputs.bits.items():
        value = before ^ mask
        came = spot.write_and_ask(trial, {field: value})
        told = spot.values(came)[field]
        trial.must(
            told == value,
            f"{spot.text}: {spot.set.set} switched {name.replace('_', ' ')} with {value:#04x}, and "
            f"{spot.set.get} then said {told:#04x}",
            wanted=spot.expected(trial, {field: value}, came),
            came=came.raw,
        )
