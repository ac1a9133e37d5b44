"""The constants of simulated inertial drives.

Values without a page or a program are assumptions: no document states them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final


@dataclass(frozen=True, slots=True)
class Mechanics:
    """The mechanics of a kind of actuator or stage.

    :param step: the mean step forward at the reference amplitude, in nm.
    :param spread: how far the forward steps of single channels differ from the mean, as a fraction.
    :param reverse: the smallest and largest ratio of a reverse step to a forward step.
    :param travel: the travel in nm, unless the user sets another.
    """

    step: float
    spread: float
    reverse: tuple[float, float]
    travel: int


ACTUATOR: Final = Mechanics(step=20.0, spread=0.2, reverse=(0.7, 0.9), travel=13_000_000)
"""An actuator on a KIM101, KIM001 or TIM101. Page 396 states that steps of the two directions differ."""

STAGE: Final = Mechanics(step=1000.0, spread=0.1, reverse=(0.85, 0.95), travel=20_000_000)
"""A stage on a PDXC2.

The step is the quotient of the highest speed and the highest step rate in the vendor's header, 20,000,000
nm/s and 20,000 steps/s (Thorlabs.MotionControl.Benchtop.Piezo.PDXC2.h).
"""

REFERENCE_VOLTS: Final = 110
"""The drive voltage for the steps of :data:`ACTUATOR`; steps are proportional to the voltage."""

UNNOTICED: Final = 500_000_000
"""How long a blocked stage in closed loop goes unnoticed, in nanoseconds."""
