"""Firmware of inertial drives and paddles: Issue 37 and programs of the vendor."""

from __future__ import annotations

from collections.abc import Sequence

from firmware_defects import Change, Defect, Draw, Says, Takes, named, of
from firmware_frames import Frame
from firmware_line import Firmware

_CUBES = ("KIM101", "TIM101")
_KIM = ("KIM101", "KIM001")
_PADDLES = ("MPC220", "MPC320")


def _keeps(name: str, units: Sequence[str], setter: str, *fields: str) -> Defect:
    """Return firmware that stores a SET except some fields, which keep their values."""
    getter = setter.replace("_SET_", "_GET_")

    class Keeps(Firmware):
        def __init__(self) -> None:
            self._present: dict[tuple[int | None, str], int] = {}

        def says(self, frame: Frame) -> None:
            if frame.name == getter:
                self._present.update({(frame.channel, field): frame[field] for field in fields})
            self.say(frame.raw)

        def takes(self, frame: Frame) -> None:
            for field in fields if frame.name == setter else ():
                frame = frame.with_(field, self._present.get((frame.channel, field), frame[field]))
            self.pass_on(frame.raw)

    return Defect(1, name, of("readback counters"), lambda draw: (Keeps(), setter), units)


def _takes(name: str, units: Sequence[str], found_by: str, message: str, change: Change) -> Defect:
    """Return firmware that changes or drops a message to the controller."""
    return Defect(
        1, name, of(found_by), lambda draw: (Takes(named(message), change), message), units
    )


def _says(name: str, units: Sequence[str], found_by: str, message: str, change: Change) -> Defect:
    """Return firmware that changes a message to the host."""

    def make(draw: Draw) -> tuple[Firmware, str]:
        return Says(named(message), change), message

    return Defect(1, name, of(found_by), make, units)


def _twice(frame: Frame) -> list[Frame]:
    return [frame, frame]


def _first_channel(frame: Frame) -> list[Frame]:
    return [frame.with_("chan_ident", 1)]


def _numbered(frame: Frame) -> list[Frame]:
    """Count the channels as page 404 does, from 1 to 4."""
    return [frame.with_("chan_ident", frame["chan_ident"].bit_length())]


def _in_all(frame: Frame) -> list[Frame]:
    return [frame.with_("chan_ident", ident) for ident in (1, 2)]


def _set_to(field: str, value: int) -> Change:
    return lambda frame: [frame.with_(field, value)]


def _cut(frame: Frame) -> list[bytes]:
    """Leave out the last two bytes of a packet."""
    return [frame.raw[:2] + (len(frame.packet) - 2).to_bytes(2, "little") + frame.raw[4:-2]]


INERTIAL = (
    _keeps("The drive voltage cannot be changed", (*_CUBES, "KIM001"), "PZMOT_SET_DRIVEOPPARAMS",
           "max_voltage"),
    _keeps("The step rate cannot be changed", _CUBES, "PZMOT_SET_DRIVEOPPARAMS", "step_rate"),
    _keeps("The acceleration of steps cannot be changed", _KIM, "PZMOT_SET_DRIVEOPPARAMS",
           "step_accn"),
    _keeps("The jog step forward cannot be changed", _KIM, "PZMOT_SET_KCUBEJOGPARAMS",
           "jog_step_size_fwd"),
    _keeps("The jog step in reverse cannot be changed", _KIM, "PZMOT_SET_KCUBEJOGPARAMS",
           "jog_step_size_rev"),
    _keeps("The jog mode of a KIM cannot be changed", _KIM, "PZMOT_SET_KCUBEJOGPARAMS", "jog_mode"),
    _keeps("The jog step of a TIM101 cannot be changed", ("TIM101",), "PZMOT_SET_TIMJOGPARAMS",
           "jog_step_size"),
    _keeps("The jog rate of a TIM101 cannot be changed", ("TIM101",), "PZMOT_SET_TIMJOGPARAMS",
           "jog_step_rate"),
    _keeps("The slider of a TIM101 keeps its rate", ("TIM101",), "PZMOT_SET_TIMPOTPARAMS",
           "max_step_rate"),
    _keeps("The buttons of a TIM101 keep their positions", ("TIM101",),
           "PZMOT_SET_TIMBUTTONPARAMS", "position1", "position2"),
    _keeps("The stored distance of a KIM cannot be changed", _KIM,
           "PZMOT_SET_KCUBEMOVERELATIVEPARAMS", "rel_distance"),
    _keeps("The stored position of a KIM cannot be changed", _KIM,
           "PZMOT_SET_KCUBEMOVEABSOLUTEPARAMS", "abs_distance"),
    _keeps("The limit switches of a KIM cannot be changed", _KIM, "PZMOT_SET_LIMSWITCHPARAMS",
           "fwd_hard_limit"),
    _keeps("The open loop step of a PDXC2 cannot be changed", ("PDXC2",),
           "PZMOT_SET_OPENMOVEPARAMS", "step_size"),
    _keeps("The closed loop position of a PDXC2 cannot be changed", ("PDXC2",),
           "PZMOT_SET_CLOSEMOVEPARAMS", "position"),
    _keeps("The closed loop speed of a PDXC2 cannot be changed", ("PDXC2",),
           "PZMOT_SET_CLOSEDLOOPPARAMS", "ref_speed"),
    _keeps("The reverse amplitude of a PDXC2 cannot be changed", ("PDXC2",),
           "PZMOT_SET_AMPOUTPARAMS", "reverse_amplitude"),
    _keeps("The velocity of paddles cannot be changed", _PADDLES, "POL_SET_PARAMS", "velocity"),
    _keeps("The home position of paddles cannot be changed", _PADDLES, "POL_SET_PARAMS",
           "home_position"),
    _keeps("The jog step of paddle 2 cannot be changed", _PADDLES, "POL_SET_PARAMS", "jog_step2"),
    _takes("Drive parameters change the channels 1 and 2", _CUBES, "readback channels",
           "PZMOT_SET_DRIVEOPPARAMS", _in_all),
    _takes("A set of drive parameters counts channels from 1 to 4", _CUBES, "readback channels",
           "PZMOT_SET_DRIVEOPPARAMS", _numbered),
    _takes("Jog parameters always change channel 1", ("KIM101",), "readback channels",
           "PZMOT_SET_KCUBEJOGPARAMS", _first_channel),
    _says("The status of a drive is repeated", ("KIM001", "PDXC2"), "status repeated",
          "PZMOT_GET_STATUSUPDATE", _twice),
    _says("The status of a drive is too short", ("KIM001", "PDXC2"), "status",
          "PZMOT_GET_STATUSUPDATE", _cut),
    _says("The drive voltage is reported as 0", (*_CUBES, "KIM001"), "registry readback",
          "PZMOT_GET_DRIVEOPPARAMS", _set_to("max_voltage", 0)),
    _says("The velocity of paddles is reported as 0", _PADDLES, "registry readback",
          "POL_GET_PARAMS", _set_to("velocity", 0)),
)  # fmt: skip
"""Defects whose checks need no motion."""
