"""``actuator-stop`` and ``actuator-disabled``: a stop ends a move, and a disabled channel does not move."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from stagewire_conformance.device.causes import EFFECT, Cause
from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.apt.actuators.actuator import Actuator
from stagewire_conformance.device.checks.apt.actuators.actuator_check import actuator_check
from stagewire_conformance.device.checks.apt.actuators.families import move_to, stop_of
from stagewire_conformance.device.checks.apt.actuators.judgement import judge_bits, judge_end
from stagewire_conformance.device.checks.apt.actuators.readiness import disable, has_mode, set_mode

if TYPE_CHECKING:
    from stagewire_conformance.device.targets import Target
    from stagewire_conformance.device.trial import Trial

_SECONDS: Final = 1.5
"""The approximate duration of the move that is stopped."""
_LEAST: Final = 40
"""Counts of the shortest move that is stopped."""
_SHARE: Final = 10
"""A move is stopped after this part of its distance."""
_AFTER: Final = 1.0
"""Seconds in which a disabled actuator must not move."""
_BRIEF: Final = 0.2
"""The approximate duration of a move that only shows whether a channel is enabled."""
_STOPPED: Final = 0.1
"""Seconds in which a stop is reported."""

STOP = Kind(
    name="actuator-stop",
    title="A stop ends a move of an inertial drive or paddle",
    rules=("stop-any-move", "stop-completed", "pzmot-status-bits", "dc-status-bits-motion"),
)
DISABLED = Kind(
    name="actuator-disabled",
    title="An inertial drive or paddle that is disabled does not move",
    rules=("channel-enable", "pzmot-enable-mode"),
)


@actuator_check(
    STOP,
    "A stop ends a move of {actuator}, and is reported",
    messages=lambda family: (),
    does="stops a move of each inertial drive and paddle within {range}, and moves it back",
    seconds=2.7,
)
def _stop(trial: Trial, place: Target, channel: int) -> None:
    actuator = Actuator(trial, place, channel)
    target = actuator.target(_SECONDS, _LEAST)
    actuator.prepare()
    start, way = actuator.start, target - actuator.start

    def on_its_way(position: int) -> bool:
        return abs(position - start) * _SHARE >= abs(way)

    seen = actuator.move(target, on_its_way)
    if not seen.stopped:
        trial.inconclusive(f"{actuator.text}: {seen.told} ended before it could be stopped")
        return
    name = stop_of(place)
    stopped = trial.must(
        min(start, target) < seen.rest < max(start, target),
        f"{actuator.text}: after {name} during {seen.told} from {start}, it is at {seen.rest}; it should "
        "have stopped on its way",
        rule="stop-any-move",
        cause=Cause(name, EFFECT),
    )
    if stopped:
        told = trial.declared.registry.messages[name]["exchange"]["completes_with"]
        judge_end(actuator, seen, tuple(told), "stop-completed")
        judge_bits(actuator, seen)


@actuator_check(
    DISABLED,
    "{actuator} does not move while it is disabled",
    messages=lambda family: (),
    does="disables each inertial drive and paddle, and sends it a move within {range}",
    seconds=2.9,
)
def _disabled(trial: Trial, place: Target, channel: int) -> None:
    actuator = Actuator(trial, place, channel)
    target = actuator.target(_SECONDS)
    actuator.prepare()
    disable(trial, place, channel)
    start = actuator.start
    told, message = move_to(trial, place, channel, target, target - start)
    trial.line.suspect(place, channel)
    trial.line.send(message, place.address)
    trial.line.pause(_AFTER)
    now = actuator.position()
    actuator.stop()  # whatever happens to the move, it ends here
    trial.line.listen(_STOPPED)
    by_mode = has_mode(place)
    how = "PZMOT_SET_KCUBECHANENABLEMODE" if by_mode else "MOD_SET_CHANENABLESTATE"
    trial.must(
        abs(now - start) <= actuator.family.tolerance,
        f"{actuator.text} was disabled by {how}, but {told} moved it from {start} to {now}",
        rule="pzmot-enable-mode" if by_mode else "channel-enable",
        cause=Cause(how, EFFECT),
    )


def _pair_mode(place: Target, channel: int) -> int | None:
    """Return the enable mode of the pair with a channel; None if the target has none."""
    enabling = place.unit.enabling
    pairs = {} if enabling is None else enabling.channels
    number = channel.bit_length()
    return next((mode for mode, pair in pairs.items() if len(pair) > 1 and number in pair), None)


@actuator_check(
    DISABLED,
    "{actuator} moves while an enable mode enables it with another channel",
    messages=lambda family: (),
    does="enables pairs of channels, and moves each inertial drive within {range} and back",
    seconds=2.5,
    fits=lambda place: has_mode(place) and len(place.channels) > 1,
    name="pair",
)
def _pair(trial: Trial, place: Target, channel: int) -> None:
    actuator = Actuator(trial, place, channel)
    target = actuator.target(_BRIEF)
    mode = _pair_mode(place, channel)
    assert mode is not None  # every channel of a unit with several channels is in a pair
    actuator.prepare()
    set_mode(trial, place, mode)
    seen = actuator.move(target)
    trial.must(
        seen.rest != seen.start,
        f"{actuator.text}: PZMOT_SET_KCUBECHANENABLEMODE set the mode {mode}, which enables it with another "
        f"channel, but {seen.told} did not move it",
        rule="pzmot-enable-mode",
        cause=Cause("PZMOT_SET_KCUBECHANENABLEMODE", "pairs"),
        because=(Cause(actuator.family.command, EFFECT),),
    )
