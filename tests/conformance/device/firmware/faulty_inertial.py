"""Firmware of inertial drives and paddles: Issue 37 and programs of the vendor."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from firmware_defects import Change, Defect, Draw, Says, Takes, named, of
from firmware_frames import HOST, Frame
from firmware_line import Firmware

from stagewire_apt import messages as m

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


def _says(
    name: str,
    units: Sequence[str],
    found_by: str,
    message: str,
    change: Change,
    *,
    ends: str = "",
) -> Defect:
    """Return firmware that changes a message to the host."""

    def make(draw: Draw) -> tuple[Firmware, str]:
        return Says(named(message), change), message

    return Defect(1, name, of(found_by), make, units, ends=ends)


def _twice(frame: Frame) -> list[Frame]:
    return [frame, frame]


def _first_channel(frame: Frame) -> list[Frame]:
    return [frame.with_("chan_ident", 1)]


def _numbered(frame: Frame) -> list[Frame]:
    """Count the channels as page 404 does, from 1 to 4."""
    return [frame.with_("chan_ident", frame["chan_ident"].bit_length())]


def _in_all(frame: Frame) -> list[Frame]:
    return [frame.with_("chan_ident", ident) for ident in (1, 2)]


def _one_channel(frame: Frame) -> list[Frame]:
    """Leave out all channels of a status except the first one."""
    return [frame.with_packet(frame.packet[:14])]


def _in_all_four(frame: Frame) -> list[Frame]:
    return [frame.with_("chan_ident", ident) for ident in (1, 2, 4, 8)]


def _set_to(field: str, value: int) -> Change:
    return lambda frame: [frame.with_(field, value)]


def _cut(frame: Frame) -> list[bytes]:
    """Leave out the last two bytes of a packet."""
    return [frame.raw[:2] + (len(frame.packet) - 2).to_bytes(2, "little") + frame.raw[4:-2]]


def _dropped(frame: Frame) -> list[Frame]:
    return []


def _shifted(field: str, by: int) -> Change:
    return lambda frame: [frame.with_(field, frame[field] + by)]


def _times(field: str, factor: float) -> Change:
    def change(frame: Frame) -> list[Frame]:
        has = field in frame.fields  # a short form may lack it
        return [frame.with_(field, round(frame[field] * factor)) if has else frame]

    return change


def _at_rest(frame: Frame) -> list[Frame]:
    """Clear the bits of motion in every status of a message."""
    fields = [name for name in frame.fields if name.startswith("status_bits")]
    for field in fields:
        frame = frame.with_(field, frame[field] & ~0x2F0)
    return [frame]


def _counts_elsewhere(frame: Frame) -> list[Frame | bytes]:
    """Also set the counter of another channel to the target, if the move has one."""
    if not frame.has_packet:
        return [frame]
    other = 2 if frame["chan_ident"] == 1 else 1
    if frame.name == "PZMOT_MOVE_ABSOLUTE":
        message: m.FramedMessage = m.PzmotSetPosCounters(other, position=frame["abs_position"])
    else:
        message = m.MotSetPosCounter(other, frame["absolute_distance"] // 2)
    return [frame, message.pack(frame.dest, HOST)]


class _Stays(Firmware):
    """Reports that a channel is disabled, but leaves it enabled.

    :param setter: the message that disables.
    :param field: its field with the state.
    :param off: the value that disables.
    """

    def __init__(self, setter: str, field: str, off: int) -> None:
        self._setter, self._field, self._off = setter, field, off
        self._getter = setter.replace("_SET_", "_GET_")
        self._told: dict[int | None, int] = {}

    def takes(self, frame: Frame) -> None:
        if frame.name == self._setter:
            self._told.pop(frame.channel, None)
            if frame[self._field] == self._off:
                self._told[frame.channel] = self._off
                return
        self.pass_on(frame.raw)

    def says(self, frame: Frame) -> None:
        if frame.name == self._getter and frame.channel in self._told:
            frame = frame.with_(self._field, self._told[frame.channel])
        self.say(frame.raw)


def _stays(name: str, units: Sequence[str], setter: str, field: str, off: int) -> Defect:
    return Defect(
        1, name, of("actuator-disabled"), lambda draw: (_Stays(setter, field, off), setter), units
    )


class _Secretly(Firmware):
    """Uses other values than those of a SET, but its GET returns those of the SET.

    :param setter: the SET message.
    :param change: returns the values to use.
    """

    def __init__(self, setter: str, change: Callable[[Frame], Frame]) -> None:
        self._setter, self._change = setter, change
        self._getter = setter.replace("_SET_", "_GET_")
        self._told: dict[int | None, Frame] = {}

    def takes(self, frame: Frame) -> None:
        if frame.name == self._setter:
            self._told[frame.channel] = frame
            frame = self._change(frame)
        self.pass_on(frame.raw)

    def says(self, frame: Frame) -> None:
        if frame.name == self._getter and frame.channel in self._told:
            frame = frame.with_packet(self._told[frame.channel].packet)
        self.say(frame.raw)


def _secretly(
    name: str,
    units: Sequence[str],
    found_by: str,
    setter: str,
    about: str,
    change: Callable[[Frame], Frame],
) -> Defect:
    """Return firmware that uses other values than those of a SET."""
    return Defect(1, name, of(found_by), lambda draw: (_Secretly(setter, change), about), units)


class _JogsOn(Firmware):
    """Ignores a stop during a jog."""

    def __init__(self) -> None:
        self._jogs = False

    def takes(self, frame: Frame) -> None:
        if "_MOVE_STOP" not in frame.name:
            if "_MOVE_" in frame.name:
                self._jogs = frame.name == "PZMOT_MOVE_JOG"
        elif self._jogs:
            return
        self.pass_on(frame.raw)


class _Early(Firmware):
    """Reports the end of a move, with the target, when it begins."""

    def takes(self, frame: Frame) -> None:
        self.pass_on(frame.raw)
        if frame.name == "PZMOT_MOVE_ABSOLUTE" and frame.has_packet:
            done = m.PzmotMoveCompleted(frame["chan_ident"], frame["abs_position"], 0)
            self.say(done.pack(HOST, frame.dest))

    def says(self, frame: Frame) -> None:
        if frame.name != "PZMOT_MOVE_COMPLETED":
            self.say(frame.raw)


class _StoredIsAbsolute(Firmware):
    """Takes the stored distance for a position."""

    def __init__(self) -> None:
        self._stored: dict[int | None, int] = {}

    def takes(self, frame: Frame) -> None:
        if frame.name == "PZMOT_SET_KCUBEMOVERELATIVEPARAMS":
            self._stored[frame.channel] = frame["rel_distance"]
        if frame.name == "PZMOT_MOVE_RELATIVE" and not frame.has_packet:
            move = m.PzmotMoveAbsolute(frame["chan_ident"], self._stored[frame.channel])
            self.pass_on(move.pack(frame.dest, HOST))
        else:
            self.pass_on(frame.raw)


def _one_of_a_pair(frame: Frame) -> Frame:
    """Enable only the first channel of a pair."""
    return frame.with_("mode", {5: 1, 6: 3}.get(frame["mode"], frame["mode"]))


_MOVED = "actuator-move"
_ALL = (*_CUBES, "KIM001")

MOVING = (
    _takes("A drive stops one step before its target", _ALL, _MOVED, "PZMOT_MOVE_ABSOLUTE",
           _shifted("abs_position", -1)),
    _takes("A drive ignores absolute moves", _ALL, _MOVED, "PZMOT_MOVE_ABSOLUTE", _dropped),
    _takes("A relative move of a KIM goes twice as far", _KIM, _MOVED, "PZMOT_MOVE_RELATIVE",
           _times("rel_distance", 2)),
    _takes("A relative move goes in the other direction", _KIM, _MOVED, "PZMOT_MOVE_RELATIVE",
           _times("rel_distance", -1)),
    _takes("A move also counts on another channel", _CUBES, _MOVED, "PZMOT_MOVE_ABSOLUTE",
           _counts_elsewhere),
    _takes("A move counts channels from 1 to 4", _CUBES, _MOVED, "PZMOT_MOVE_ABSOLUTE", _numbered),
    _says("The end of a move of a drive is never reported", (*_ALL, "PDXC2"), _MOVED,
          "PZMOT_MOVE_COMPLETED", _dropped),
    _says("The end of a move of a drive is reported twice", (*_ALL, "PDXC2"), _MOVED,
          "PZMOT_MOVE_COMPLETED", _twice),
    _says("The end of a move counts channels from 1 to 4", _CUBES, _MOVED, "PZMOT_MOVE_COMPLETED",
          _numbered),
    _says("The end of a move has another position", (*_ALL, "PDXC2"), _MOVED,
          "PZMOT_MOVE_COMPLETED", _shifted("abs_position", 7)),
    _says("A drive reports a quarter of its rate", _ALL, _MOVED, "PZMOT_GET_DRIVEOPPARAMS",
          _times("step_rate", 0.25)),
    _says("A drive reports a quarter of its jog rate", _KIM, "actuator-jog",
          "PZMOT_GET_KCUBEJOGPARAMS", _times("jog_step_rate", 0.25)),
    _takes("A drive ignores jogs", (*_ALL, "PDXC2"), "actuator-jog", "PZMOT_MOVE_JOG", _dropped),
    _takes("A drive always jogs forward", (*_ALL, "PDXC2"), "actuator-jog", "PZMOT_MOVE_JOG",
           _set_to("jog_dir", 1)),
    _takes("A jog counts channels from 1 to 4", _CUBES, "actuator-jog", "PZMOT_MOVE_JOG",
           _numbered),
    _says("A drive reports another jog step", _KIM, "actuator-jog", "PZMOT_GET_KCUBEJOGPARAMS",
          _shifted("jog_step_size_fwd", 10)),
    _says("A TIM101 reports another jog step", ("TIM101",), "actuator-jog",
          "PZMOT_GET_TIMJOGPARAMS", _shifted("jog_step_size", -10)),
    _takes("A KIM ignores stops", _KIM, "actuator-stop", "PZMOT_MOVE_STOP", _dropped),
    _takes("A TIM101 or PDXC2 ignores stops", ("TIM101", "PDXC2"), "actuator-stop",
           "MOT_MOVE_STOP", _dropped),
    _says("The stop of a KIM is never reported", _KIM, "actuator-stop", "PZMOT_MOVE_STOPPED",
          _dropped),
    _says("The stop of a TIM101 or PDXC2 is never reported", ("TIM101", "PDXC2"),
          "actuator-stop", "MOT_MOVE_STOPPED", _dropped),
    _says("The status of a drive never reports motion", (*_ALL, "PDXC2"), "actuator-stop",
          "PZMOT_GET_STATUSUPDATE", _at_rest),
    _stays("A KIM in the mode NONE moves", _KIM, "PZMOT_SET_KCUBECHANENABLEMODE", "mode", 0),
    _stays("A disabled drive moves", ("TIM101", "PDXC2"), "MOD_SET_CHANENABLESTATE",
           "enable_state", 2),
    _takes("A PDXC2 does not start its stored move", ("PDXC2",), _MOVED, "PZMOT_MOVE_START",
           _dropped),
    Defect(1, "A jog of a drive ignores stops", of("actuator-jog"),
           lambda draw: (_JogsOn(), "MOVE_STOP"), (*_ALL, "PDXC2")),
    _secretly("A continuous jog of a KIM does a single step", _KIM, "actuator-jog",
              "PZMOT_SET_KCUBEJOGPARAMS", "PZMOT_MOVE_JOG",
              lambda frame: frame.with_("jog_mode", 2)),
    _secretly("A continuous jog of a TIM101 does a single step", ("TIM101",), "actuator-jog",
              "PZMOT_SET_TIMJOGPARAMS", "PZMOT_MOVE_JOG",
              lambda frame: frame.with_("jog_mode", 2)),
    _secretly("A reverse jog of a KIM has the step forward", _KIM, "actuator-jog",
              "PZMOT_SET_KCUBEJOGPARAMS", "PZMOT_MOVE_JOG",
              lambda frame: frame.with_("jog_step_size_rev", frame["jog_step_size_fwd"])),
    _secretly("A pair mode of a KIM enables one channel", ("KIM101",), "actuator-disabled",
              "PZMOT_SET_KCUBECHANENABLEMODE", "PZMOT_SET_KCUBECHANENABLEMODE", _one_of_a_pair),
    _takes("A KIM does not move at a velocity", _KIM, _MOVED, "PZMOT_MOVE_VELOCITY", _dropped),
    _takes("The position counter of a drive cannot be set", _ALL, "actuator-counter",
           "PZMOT_SET_POSCOUNTERS", _dropped),
    _takes("All position counters are set together", _CUBES, "actuator-counter",
           "PZMOT_SET_POSCOUNTERS", _in_all_four),
    Defect(1, "A KIM takes its stored distance for a position", of(_MOVED),
           lambda draw: (_StoredIsAbsolute(), "PZMOT_MOVE_RELATIVE"), _KIM),
    Defect(1, "The end of a move of a drive is reported when it begins", of(_MOVED),
           lambda draw: (_Early(), "PZMOT_MOVE_COMPLETED"), _ALL),
    _takes("A paddle misses its target by 40 counts", _PADDLES, _MOVED, "MOT_MOVE_ABSOLUTE",
           _shifted("absolute_distance", -40)),
    _takes("A move also counts on another paddle", _PADDLES, _MOVED, "MOT_MOVE_ABSOLUTE",
           _counts_elsewhere),
    _says("The end of a move of a paddle is never reported", _PADDLES, _MOVED,
          "MOT_MOVE_COMPLETED", _dropped),
    _says("A paddle reports a fifth of its velocity", _PADDLES, _MOVED, "POL_GET_PARAMS",
          _times("velocity", 0.2)),
    _takes("A paddle always jogs forward", _PADDLES, "actuator-jog", "MOT_MOVE_JOG",
           _set_to("direction", 1)),
    _says("Paddle 2 reports another jog step", _PADDLES, "actuator-jog", "POL_GET_PARAMS",
          _times("jog_step2", 3)),
    _takes("A paddle ignores homing", _PADDLES, "actuator-home", "MOT_MOVE_HOME", _dropped),
    _says("The end of homing of a paddle is never reported", _PADDLES, "actuator-home",
          "MOT_MOVE_HOMED", _dropped),
    _says("A paddle goes home to another position", _PADDLES, "actuator-home", "POL_GET_PARAMS",
          _shifted("home_position", 200)),
    _takes("A paddle ignores stops", _PADDLES, "actuator-stop", "MOT_MOVE_STOP", _dropped),
    _says("The stop of a paddle is never reported", _PADDLES, "actuator-stop", "MOT_MOVE_STOPPED",
          _dropped),
    _says("The status of a paddle never reports motion", _PADDLES, "actuator-stop",
          "MOT_GET_DCSTATUSUPDATE", _at_rest),
    _stays("A disabled paddle moves", _PADDLES, "MOD_SET_CHANENABLESTATE", "enable_state", 2),
)  # fmt: skip
"""Defects that only checks with motion find."""

INERTIAL = (
    *MOVING,
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
    _says("The status of a drive is too short", ("KIM001",), "status actuator-move",
          "PZMOT_GET_STATUSUPDATE", _cut,
          ends="0x50 channel 1 may still be moving: it does not answer after PZMOT_MOVE_STOP, "
          "PZMOT_SET_KCUBECHANENABLEMODE (disable)"),
    _says("The status of a KIM101 has one channel", ("KIM101",), "answers actuator-stop",
          "PZMOT_GET_STATUSUPDATE", _one_channel),
    _says("The drive voltage is reported as 0", (*_CUBES, "KIM001"), "registry readback",
          "PZMOT_GET_DRIVEOPPARAMS", _set_to("max_voltage", 0)),
    _says("The velocity of paddles is reported as 0", _PADDLES, "registry readback",
          "POL_GET_PARAMS", _set_to("velocity", 0)),
)  # fmt: skip
"""All defects of inertial drives and paddles."""
