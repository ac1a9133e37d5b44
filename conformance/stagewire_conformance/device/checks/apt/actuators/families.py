"""The families of actuators: which units they have, how they are moved, and the rules about that.

A KIM101, KIM001 or TIM101 counts steps. A PDXC2 counts steps in open loop and nm in closed loop, and moves by
a stored distance or to a stored position. Paddles of an MPC220 or MPC320 have encoders.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from stagewire_apt import messages as m
from stagewire_apt.enumerations import JogMode, PositionControlMode
from stagewire_conformance.device.checks.apt.settings.sets import PlacedSet, parameter_sets

if TYPE_CHECKING:
    from stagewire.protocols import FramedMessage
    from stagewire_conformance.device.declaration import Declaration
    from stagewire_conformance.device.targets import Target
    from stagewire_conformance.device.trial import Trial

FULL_TRAVEL: Final = 1370
"""The travel of a paddle in counts, which is 170 degrees (page 408)."""
_FASTEST: Final = 400 * FULL_TRAVEL / 170
"""The velocity of 100 % of a paddle in counts/s (page 408)."""
_SINGLE_STEP: Final = int(JogMode.SINGLE_STEP)
_CLOSED: Final = (PositionControlMode.CLOSED_LOOP, PositionControlMode.CLOSED_LOOP_SMOOTH)


@dataclass(frozen=True)
class Jog:
    """The jog of an actuator.

    :param steps: its step forward and its step in reverse.
    :param rate: in counts/s.
    :param single: whether a jog moves by its step, and does not last until it is stopped.
    """

    steps: tuple[int, int]
    rate: float
    single: bool


@dataclass(frozen=True)
class Rules:
    """The rules that a family breaks.

    :param move: a move goes to its target.
    :param starts_jog: a jog moves it.
    :param jog: a jog moves by its step.
    :param ends: the end of a move is reported.
    :param channel: only the channel of a message moves.
    :param pace: moves have the velocity that is set; empty if no document says so.
    :param bits: the status reports motion.
    """

    move: str
    starts_jog: str
    jog: str
    ends: str
    channel: str
    pace: str
    bits: str


@dataclass(frozen=True)
class Family:
    """How the actuators of a family are moved.

    :param command: the message that starts a move to a position.
    :param completed: the message at its end.
    :param stored: the parameter sets with its target or distance, which a move changes.
    :param jogs: the parameter sets with the jog step, of which a unit has one.
    :param paces: the parameter sets with the velocity of a move.
    :param tolerance: counts by which a position may miss its target.
    :param longest: the travel in counts; None if unknown.
    """

    command: str
    completed: str
    rules: Rules
    stored: tuple[str, ...] = ()
    jogs: tuple[str, ...] = ()
    paces: tuple[str, ...] = ()
    tolerance: int = 0
    longest: int | None = None


CUBE: Final = Family(
    command="PZMOT_MOVE_ABSOLUTE",
    completed="PZMOT_MOVE_COMPLETED",
    rules=Rules(
        move="pzmot-absolute-move",
        starts_jog="pzmot-jog",
        jog="pzmot-jog-mode",
        ends="pzmot-move-completed",
        channel="pzmot-channels",
        pace="pzmot-move-parameters",
        bits="pzmot-status-bits",
    ),
    jogs=("PZMOT_KCUBEJOGPARAMS", "PZMOT_TIMJOGPARAMS"),
    paces=("PZMOT_DRIVEOPPARAMS",),
)
PDXC2: Final = Family(
    command="PZMOT_MOVE_START",
    completed="PZMOT_MOVE_COMPLETED",
    rules=Rules(
        move="unit-messages",
        starts_jog="pzmot-jog",
        jog="pzmot-jog",
        ends="pzmot-move-completed",
        channel="pzmot-channels",
        pace="",
        bits="pzmot-status-bits",
    ),
    stored=("PZMOT_OPENMOVEPARAMS", "PZMOT_CLOSEMOVEPARAMS"),
    jogs=("PZMOT_PDXC2JOGPARAMS",),
    paces=("PZMOT_PDXC2JOGPARAMS", "PZMOT_CLOSEDLOOPPARAMS"),
)
PADDLE: Final = Family(
    command="MOT_MOVE_ABSOLUTE",
    completed="MOT_MOVE_COMPLETED",
    rules=Rules(
        move="absolute-move",
        starts_jog="jog-move",
        jog="pol-jog-step",
        ends="move-completed",
        channel="module-channels",
        pace="pol-global-settings",
        bits="dc-status-bits-motion",
    ),
    jogs=("POL_PARAMS",),
    paces=("POL_PARAMS",),
    tolerance=8,
    longest=FULL_TRAVEL,
)
_MARKS: Final = {
    "PZMOT_MOVE_ABSOLUTE": CUBE,
    "PZMOT_MOVE_START": PDXC2,
    "POL_SET_PARAMS": PADDLE,
}
"""Message in the list of a unit -> the family of its actuators."""


def family_of(place: Target) -> Family | None:
    """Return the family of the actuators of a target; None if it has none."""
    return next((family for mark, family in _MARKS.items() if mark in place.listed), None)


def stop_of(place: Target) -> str:
    """Return the message that stops an actuator of a target."""
    return "PZMOT_MOVE_STOP" if "PZMOT_MOVE_STOP" in place.listed else "MOT_MOVE_STOP"


def sets_of(declared: Declaration, place: Target, channel: int, *names: str) -> Iterator[PlacedSet]:
    """Yield those of some parameter sets that a target has."""
    for one in parameter_sets(declared, place):
        if one.name in names:
            yield PlacedSet(place, channel if one.has_channel else None, one)


def is_closed(trial: Trial, place: Target, channel: int) -> bool:
    """Return whether an actuator is in closed loop, so that its positions are not steps."""
    if "PZ_REQ_POSCONTROLMODE" not in place.messages:
        return False
    mode: int = trial.reply(m.PzReqPosControlMode(channel), place.address).message.mode
    return mode in _CLOSED


def span_of(
    trial: Trial, place: Target, channel: int, family: Family, low: int, high: int
) -> tuple[int, int]:
    """Return the part of a range of positions to which a move can be commanded."""
    first, last = (low, high) if family.longest is None else (0, family.longest)
    if family is PDXC2 and is_closed(trial, place, channel):
        [placed] = sets_of(trial.declared, place, channel, "PZMOT_CLOSEMOVEPARAMS")
        position = placed.set.fields["position"]
        first, last = position["minimum"], position["maximum"]
    return max(low, first), min(high, last)


def rate_of(trial: Trial, place: Target, channel: int, family: Family) -> float:
    """Return the velocity of a move in counts/s."""
    values: dict[str, Any] = {}
    for placed in sets_of(trial.declared, place, channel, *family.paces):
        values |= placed.read(trial)
    if "velocity" in values:
        return _FASTEST * float(values["velocity"]) / 100
    if family is PDXC2:
        closed = is_closed(trial, place, channel)
        return float(values["ref_speed" if closed else "open_loop_step_rate"])
    return float(values["step_rate"])


def jog_of(trial: Trial, place: Target, channel: int, family: Family) -> Jog:
    """Return the jog of an actuator."""
    [placed] = sets_of(trial.declared, place, channel, *family.jogs)
    values = placed.read(trial)
    if family is PADDLE:
        step = values[f"jog_step{channel.bit_length()}"]
        return Jog((step, step), rate_of(trial, place, channel, family), single=True)
    single = values["jog_mode"] == _SINGLE_STEP
    if family is PDXC2:
        loop = "closed_loop" if is_closed(trial, place, channel) else "open_loop"
        rate = values["closed_loop_speed" if loop == "closed_loop" else "open_loop_step_rate"]
        return Jog((values[f"{loop}_step_size"],) * 2, float(rate), single)
    names = ("jog_step_size_fwd", "jog_step_size_rev")
    forward, reverse = (values.get(name) or values["jog_step_size"] for name in names)
    return Jog((forward, reverse), float(values["jog_step_rate"]), single)


def move_to(
    trial: Trial, place: Target, channel: int, position: int, way: int
) -> tuple[str, FramedMessage]:
    """Return the command of a move to a position, and its description; write what it needs before.

    :param way: the distance to the position.
    """
    family = family_of(place)
    if family is PADDLE:
        return f"MOT_MOVE_ABSOLUTE to {position}", m.MotMoveAbsolute(channel, position)
    if family is CUBE:
        return f"PZMOT_MOVE_ABSOLUTE to {position}", m.PzmotMoveAbsolute(channel, position)
    closed = is_closed(trial, place, channel)
    name = "PZMOT_CLOSEMOVEPARAMS" if closed else "PZMOT_OPENMOVEPARAMS"
    [placed] = sets_of(trial.declared, place, channel, name)
    placed.write(trial, {"position" if closed else "step_size": position if closed else way})
    about = f"to {position}" if closed else f"by {way}"
    return f"PZMOT_MOVE_START {about}", trial.declared.make("PZMOT_MOVE_START", channel)
