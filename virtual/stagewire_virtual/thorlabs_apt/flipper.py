"""Filter flippers: a mount that moves between two positions (Issue 37, pages 20 and 182 to 185)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from stagewire import Frame
from stagewire_apt.enumerations import MoveDirection
from stagewire_apt.flags import DcStatusBits
from stagewire_virtual.clock import SECOND, Timer
from stagewire_virtual.errors import BadOptionError
from stagewire_virtual.options import Settings
from stagewire_virtual.thorlabs_apt.channel import Behaviour, Channel, LiveState, handles, live

_MILLISECOND: Final = SECOND // 1000
_TRANSIT_TIME: Final = 500
"""The transit time of a new flipper in ms; page 183 has it as an example, with 508 counts."""
_TRANSIT_COUNTS: Final = 508


class Flipper(Behaviour):
    """The channel of a filter flipper.

    ``MOT_MOVE_JOG`` forward moves it to one position and reverse to the other, in the transit time of
    ``MOT_MFF_OPERPARAMS``. The controller reports no end of a move: a host reads the status bits.

    Decisions where the document is silent:

    * Status bit 0 is set at the forward position and bit 1 at the reverse one, as a public driver expects
      (github QuTech-Delft/QMI/qmi/instruments/thorlabs/mff10x.py); both are clear during a move. Bits 4 and
      5 are the direction of a move, as on a motor.
    * A new flipper is at the forward position. A move to the present position has no effect. A move during
      another starts from the present time and takes the whole transit time.
    * The digital connectors are not simulated.

    :param channel: its channel.

    Raises :class:`~stagewire_virtual.errors.BadOptionError` for settings, because it has no stage.
    """

    def __init__(self, channel: Channel) -> None:
        super().__init__(channel)
        if channel.settings != Settings():
            raise BadOptionError(
                f"{channel.unit.name} has two positions and accepts no stage, travel or position"
            )
        self._position = int(MoveDirection.FORWARD)
        self._timer: Timer | None = None  # ends the move to the position

    @classmethod
    def defaults(cls, channel: Channel) -> Mapping[str, Mapping[str, Any]]:
        """Return the parameters of a new flipper."""
        return {
            "MOT_MFF_OPERPARAMS": {
                "transit_time": _TRANSIT_TIME,
                "transit_time_adc": _TRANSIT_COUNTS,
            }
        }

    def power_on(self) -> None:
        """Reset to the power-on state, at the position that it has reached or moves to."""
        self._arrive()

    @handles("MOT_MOVE_JOG")
    def move(self, frame: Frame) -> None:
        """Move to the position of the direction."""
        direction = getattr(frame.message, "direction", 0)
        if direction not in (MoveDirection.FORWARD, MoveDirection.REVERSE):
            self.channel.report_fault(frame, "the direction must be 1 or 2")
        elif direction != self._position:
            self._arrive()
            self._position = direction
            transit = self.channel.parameter("MOT_MFF_OPERPARAMS", "transit_time", _TRANSIT_TIME)
            self._timer = self.channel.clock.call_later(transit * _MILLISECOND, self._arrive)

    @live("MOT_STATUSBITS")
    def status_bits(self) -> dict[str, int]:
        """Return the position, or the direction of a move."""
        forward = self._position == MoveDirection.FORWARD
        moving = self._timer is not None
        bits = DcStatusBits.of(
            forward_hardware_limit=forward and not moving,
            reverse_hardware_limit=not forward and not moving,
            moving_forward=forward and moving,
            moving_reverse=not forward and moving,
        )
        return {"status_bits": bits}

    def row(self) -> LiveState:
        """Return the position and whether it moves."""
        name = MoveDirection(self._position).name.lower()
        return LiveState("", f"moving {name}") if self._timer is not None else LiveState(name)

    def _arrive(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
