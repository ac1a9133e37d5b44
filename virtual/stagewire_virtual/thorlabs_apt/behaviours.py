"""Which behaviour the channels of a unit have."""

from __future__ import annotations

from typing import Final

from stagewire_virtual.thorlabs_apt.behaviour import Behaviour
from stagewire_virtual.thorlabs_apt.motor import Motor
from stagewire_virtual.thorlabs_apt.piezo import Piezo
from stagewire_virtual.thorlabs_apt.solenoid import Solenoid
from stagewire_virtual.thorlabs_apt.strain_gauge import StrainGauge
from stagewire_virtual.units import Unit

__all__ = ["behaviour_of"]

_BY_MESSAGE: Final[tuple[tuple[str, type[Behaviour]], ...]] = (
    ("MOT_SET_SOL_STATE", Solenoid),  # before the motor: its list has messages of motors, too
    ("MOT_MOVE_HOME", Motor),
    ("PZ_SET_OUTPUTVOLTS", Piezo),
    ("PZ_REQ_TSG_READING", StrainGauge),
)


def behaviour_of(unit: Unit) -> type[Behaviour]:
    """Return the behaviour by what the unit can be told; one that does nothing where it is none of these."""
    for message, behaviour in _BY_MESSAGE:
        if message in unit.messages:
            return behaviour
    return Behaviour
