"""``loops``: gains and current limits of a motor's loop are read back as well, while its channel is disabled.

The loop of an enabled channel would feel a change, so ``readback`` only writes there what is there. This
needs motion allowed: a stage that nothing holds may give way.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from stagewire_apt.enumerations import EnableState
from stagewire_conformance.device.check import Case, Kind, Need
from stagewire_conformance.device.checks.apt.enabling import ENABLED_SETS, switch
from stagewire_conformance.device.checks.apt.motion.axis import Axis
from stagewire_conformance.device.checks.apt.motion.motor_check import lacks_range, unseen
from stagewire_conformance.device.checks.apt.settings.care import CARE, When
from stagewire_conformance.device.checks.apt.settings.neighbours import Neighbours
from stagewire_conformance.device.checks.apt.settings.readback import write_and_read
from stagewire_conformance.device.checks.apt.settings.sets import Spot, spots

if TYPE_CHECKING:
    from stagewire_conformance.device.declared import Declared
    from stagewire_conformance.device.permissions import Permissions
    from stagewire_conformance.device.trial import Trial


KIND = Kind(
    name="loops",
    title="Gains and limits of a motor's loop are read back as they were written",
    rules=(
        "dc-pid-parameters",
        "dc-pid-ranges",
        "dc-pid-filter-bits",
        "position-loop-parameters",
        "position-loop-ranges",
        "motor-output-parameters",
        "motor-output-ranges",
        "motor-bias-range",
        "current-loop-parameters",
        "current-loop-ranges",
        "settled-current-loop-parameters",
        "settled-current-loop-ranges",
    ),
)


def _loops(declared: Declared, allowed: Permissions) -> Iterator[Case]:
    for spot in spots(declared):
        care = CARE.get(spot.set.name)
        if care is None or care.when is not When.DISABLED:
            continue
        if spot.place.messages >= ENABLED_SETS:
            yield Case(
                name=spot.name,
                words={"set": spot.set.set, "spot": spot.text, "fields": ", ".join(care.fields)},
                arguments={"spot": spot},
                messages=spot.set.messages,
                skip=spot.set.skip or unseen(spot.place),
                lacks=lacks_range(declared, allowed, (spot.place, spot.channel or 1)),
            )


@KIND.check(
    "{set} is read back while the channel is disabled, at {spot}",
    needs={Need.SETTINGS, Need.MOTION},
    does="disables each channel, makes {fields} of {set} a little smaller, puts them back, and enables it "
    "again",
    each=_loops,
)
def _run(trial: Trial, spot: Spot) -> None:
    care = CARE[spot.set.name]
    assert spot.channel is not None  # loops are those of channels
    Axis(trial, spot.place, spot.channel).inside()
    switch(trial, spot.place, spot.channel, EnableState.DISABLE)
    before = spot.read(trial)
    neighbours = Neighbours.of(trial, spot)
    trial.undo(f"{spot.set.set} at {spot.text}", lambda: spot.put_back(trial, before))
    write_and_read(trial, spot, care, before, neighbours)
