"""The check of a move of a motor record: position and alarm after the end, and answers of the IOC meanwhile.

Clients of EPICS trust the completion of a put or DMOV. Both also come after a stop, and neither comes from an
IOC that was killed.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from stagewire.errors import StagewireError
from stagewire_bluesky.axis import SILENCE, TOLERANCES

SEVERITIES: Final = ("NO_ALARM", "MINOR", "MAJOR", "INVALID")
"""The names of alarm severities by their number in EPICS."""


class MoveFailedError(StagewireError):
    """A move of a motor record was refused or stopped, or did not end at its target."""


@dataclass(frozen=True, slots=True)
class Arrival:
    """A fresh reading of a motor record.

    :param position: RBV.
    :param severity: the alarm severity of RBV, as a number of EPICS.
    :param unit: EGU.
    :param deadband: RDBD.
    :param moving: whether DMOV is 0.
    """

    position: float
    severity: int
    unit: str = ""
    deadband: float = 0.0
    moving: bool = False

    def __str__(self) -> str:
        return f"RBV is {self.position:g} {self.unit} with the severity {self.severity_name}"

    @property
    def severity_name(self) -> str:
        """The name of the severity."""
        return SEVERITIES[self.severity]


@dataclass(frozen=True, slots=True)
class Check:
    """The conditions for the end of a move.

    :param tolerance: how far from its target the motor may be; None: the larger of RDBD and the tolerance of
        native devices, 0.01 mm, 10 µm, 0.1 degrees or 500 counts.
    :param tolerated: the worst severity of RBV that passes, as a number of EPICS.
    """

    tolerance: float | None = None
    tolerated: int = 0

    def valid(self, name: str, arrival: Arrival) -> None:
        """Raise :class:`MoveFailedError` if the position is not known."""
        if SEVERITIES[arrival.severity] == "INVALID":
            raise MoveFailedError(f"{name}: the position is not known: {arrival}")

    def reached(self, name: str, target: float | None, arrival: Arrival) -> None:
        """Raise :class:`MoveFailedError` unless a move ended well.

        :param name: the motor, for errors.
        :param target: its target; None: only the alarm counts, as after homing.
        :param arrival: what was read after its end.
        """
        self.valid(name, arrival)
        if arrival.severity > self.tolerated:
            raise MoveFailedError(f"{name}: {_move(target)} ended with an alarm: {arrival}")
        if arrival.moving:
            raise MoveFailedError(
                f"{name}: {_move(target)} ended, but the axis still moves: {arrival}"
            )
        if target is None:
            return
        tolerance = self.tolerance
        if tolerance is None:
            tolerance = max(arrival.deadband, TOLERANCES.get(arrival.unit, 0.0))
        if not abs(arrival.position - target) <= tolerance:
            raise MoveFailedError(
                f"{name}: {_move(target)} did not end within {tolerance:g} {arrival.unit} of its target: "
                f"{arrival}"
            )

    def failed(
        self, name: str, target: float | None, arrival: Arrival | None, reason: str = ""
    ) -> MoveFailedError:
        """Return the error of a move that the client or the IOC reports as failed, for a reason."""
        state = "the IOC does not answer" if arrival is None else str(arrival)
        why = f" ({reason})" if reason else ""
        return MoveFailedError(
            f"{name}: {_move(target)} was refused, stopped or failed{why}: {state}"
        )


def _move(target: float | None) -> str:
    return "homing" if target is None else f"the move to {target:g}"


def silent(name: str, target: float | None) -> str:
    """Return the text of an error for an IOC that does not answer."""
    return (
        f"{name}: the IOC did not answer for {SILENCE:g} s during {_move(target)}, which may still be "
        "under way"
    )
