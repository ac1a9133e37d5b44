"""Firmware that cannot be stopped, or only in some ways, and that applies velocities at once."""

from __future__ import annotations

from firmware_commands import CommandFirmware, FaultyCommandLink
from firmware_frames import Frame
from firmware_line import FaultyLink, Firmware

from stagewire.links import Link
from stagewire.protocols import CommandFrame
from stagewire_ms2000 import messages as m

_IMMEDIATE = 1


class Runaway(Firmware):
    """Ignores stops. A new velocity applies at once to a motion that is under way.

    :param obeys_immediate: whether an immediate stop is obeyed.
    :param obeys_disable: whether a disabled channel stops.
    :param reports_rest: whether the status never reports motion.
    :param freezes_position: whether the reported position stays the same during a motion.
    """

    def __init__(
        self,
        *,
        obeys_immediate: bool,
        obeys_disable: bool,
        reports_rest: bool = False,
        freezes_position: bool = False,
    ) -> None:
        self._obeys_immediate = obeys_immediate
        self._obeys_disable = obeys_disable
        self._reports_rest = reports_rest
        self._freezes_position = freezes_position
        self._frozen: dict[int, int] = {}
        self._runs: dict[tuple[int, int | None], bytes] = {}

    def takes(self, frame: Frame) -> None:
        key = frame.dest, frame.channel
        if frame.name == "MOT_MOVE_STOP" and not (
            self._obeys_immediate and frame["stop_mode"] == _IMMEDIATE
        ):
            return
        if frame.name == "MOD_SET_CHANENABLESTATE" and not self._obeys_disable:
            return
        if frame.name in ("MOT_MOVE_VELOCITY", "MOT_MOVE_STOP"):
            self._runs[key] = frame.raw
        elif frame.name.startswith("MOT_MOVE_"):
            self._runs.pop(key, None)
        self.pass_on(frame.raw)
        if frame.name == "MOT_SET_VELPARAMS" and key in self._runs:
            self.pass_on(self._runs[key])

    def says(self, frame: Frame) -> None:
        if self._reports_rest and "status_bits" in frame.fields:
            frame = frame.with_("status_bits", frame["status_bits"] & ~0x2F0)
        if self._freezes_position and "position" in frame.fields:
            if self._runs:
                frozen = self._frozen.setdefault(frame.source, frame["position"])
                frame = frame.with_("position", frozen)
            else:
                self._frozen.clear()
        self.say(frame.raw)


RUNAWAYS = {
    "obeys an immediate stop": lambda: Runaway(obeys_immediate=True, obeys_disable=True),
    "obeys when disabled": lambda: Runaway(obeys_immediate=False, obeys_disable=True),
    "obeys nothing": lambda: Runaway(obeys_immediate=False, obeys_disable=False),
    "obeys nothing and reports rest": lambda: Runaway(
        obeys_immediate=False, obeys_disable=False, reports_rest=True
    ),
    "obeys when disabled, with a frozen position": lambda: Runaway(
        obeys_immediate=False, obeys_disable=True, freezes_position=True
    ),
    "obeys nothing, with a frozen position": lambda: Runaway(
        obeys_immediate=False, obeys_disable=False, freezes_position=True
    ),
}


class RunawayAxis(CommandFirmware):
    """Ignores stops of an MS-2000. A new top speed applies at once to a motion that is under way."""

    def __init__(self) -> None:
        self._runs: dict[int, bytes] = {}

    def takes(self, frame: CommandFrame, raw: bytes) -> bytes:
        axis = frame.axis or 0
        if isinstance(frame.message, m.StopMotor):
            return b""
        if isinstance(frame.message, (m.WriteVectorSpeed, m.WriteTargetPosition)):
            self._runs[axis] = raw
        said = self.pass_on(raw)
        if isinstance(frame.message, m.WriteTopSpeed) and axis in self._runs:
            said += self.pass_on(self._runs[axis])
        return said


def with_runaway(name: str, link: Link, status: str) -> Link:
    """Return a line to a motor controller with one of the :data:`RUNAWAYS`."""
    return FaultyLink(link, RUNAWAYS[name](), status)


def with_runaway_axis(link: Link) -> Link:
    """Return a line to an MS-2000 that cannot be stopped."""
    return FaultyCommandLink(link, RunawayAxis())
