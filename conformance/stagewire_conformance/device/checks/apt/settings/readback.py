"""``readback``: REQ returns each value that SET writes, and SET changes nothing else.

Each value is near the current one, or documented; :mod:`.care` lists them with the reasons. It is written and
read back. At the end, the previous values are restored and read once more. A number that is returned rounded
is NON-STRICT: the document does not mention the resolution of values.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from stagewire_conformance.device.causes import EFFECT, Cause
from stagewire_conformance.device.check import Case, Kind
from stagewire_conformance.device.checks.apt import later_rules
from stagewire_conformance.device.checks.apt.broken_rules import rule_of_field, rule_of_set
from stagewire_conformance.device.checks.apt.replies import judge_message, need_positions
from stagewire_conformance.device.checks.apt.settings.care import CARE, Care, How, When
from stagewire_conformance.device.checks.apt.settings.sets import (
    Neighbours,
    PlacedSet,
    Values,
    placed_sets,
)
from stagewire_conformance.device.checks.apt.settings.variants import variants, why_not_now

if TYPE_CHECKING:
    from stagewire_conformance.device.declaration import Declaration
    from stagewire_conformance.device.permissions import Permissions
    from stagewire_conformance.device.trial import Trial


ELSEWHERE = frozenset(
    {
        "MOD_CHANENABLESTATE", "RACK_DIGOUTPUTS", "MOT_POSCOUNTER", "MOT_ENCCOUNTER",
        "MOT_SOL_OPERATINGMODE", "MOT_SOL_INTERLOCKMODE", "MOT_SOL_STATE",
        "PZ_POSCONTROLMODE", "PZ_OUTPUTVOLTS", "PZ_OUTPUTPOS",
        "LA_POWERSETPOINT", "LA_POWERCONTROLSOURCE", "LD_MAXCURRENTDIGPOT", "TEC_TEMPSETPOINT",
        "TEC_IOSETTINGS",
    }
)  # fmt: skip
"""Sets that have checks of their own, because they are live or take effect immediately."""


@dataclass(frozen=True)
class _Written:
    """A value that was written, and whether it took effect."""

    value: int
    taken: bool


def _does(placed: PlacedSet, care: Care) -> str:
    names = [name for name in care.fields if name in placed.set.fields]
    if not names:
        return f"writes {placed.set.set} with the current values"
    how = f", {care.when.value}" if care.when is not When.ALWAYS else ""
    return f"changes {', '.join(names)} with {placed.set.set}{how}, and restores them"


KIND = Kind(
    name="readback",
    title="Settings are read back as written, and the previous ones can be restored",
    rules=(
        "get-answers-request",
        "command-without-acknowledgement",
        "no-error-in-normal-operation",
        "velocity-parameters",
        "minimum-velocity-zero",
        "jog-parameters",
        "jog-mode-values",
        "jog-stop-mode-values",
        "jog-minimum-velocity-zero",
        "backlash-parameters",
        "relative-parameter-alone",
        "absolute-parameter-alone",
        "home-parameters",
        "home-parameters-mls203",
        "limit-switch-parameters",
        "limit-switch-values",
        "soft-limit-modes",
        "dc-pid-parameters",
        "led-modes",
        "pot-parameters",
        "pot-deflection-range",
        "pot-equal-velocities",
        "button-modes",
        "button-positions",
        "position-loop-parameters",
        "motor-output-parameters",
        "motor-bias-range",
        "settle-ranges",
        "profile-mode",
        "profile-values",
        "profile-jerk-range",
        "current-loop-parameters",
        "current-loop-phase",
        "settled-current-loop-parameters",
        "settled-current-loop-phase",
        "solenoid-cycle",
        "solenoid-cycle-times",
        "solenoid-cycle-count",
        "volts-source",
        "pi-constants",
        "pi-constants-range",
        "lut-waveform",
        "lut-index-range",
        "lut-output-range",
        "lut-parameters",
        "lut-modes-combined",
        "lut-cycle-length-range",
        "lut-cycle-count-range",
        "lut-delay-range",
        "lut-rest-ranges",
        "lut-trigger-start-range",
        "lut-trigger-repeat-range",
        "display-intensity",
        "display-intensity-range",
        "tpz-io-settings",
        "tpz-voltage-limits",
        "tpz-feedback-inputs",
        "io-settings",
        "current-limits",
        "low-pass-filters",
        "bnc-modes",
        "max-voltage",
        "max-voltage-range",
        "max-voltage-flags-unused",
        "max-voltage-answered",
        "max-travel-announced",
        "slew-rates",
        "slew-rate-range",
        "tsg-io-settings",
        "tsg-outputs",
        "tsg-display-modes",
        "tsg-force-range",
        *later_rules.OF_SETTINGS,
    ),
)


def _settings(declared: Declaration, allowed: Permissions) -> Iterator[Case]:
    for placed in placed_sets(declared):
        if placed.set.name not in ELSEWHERE and not placed.set.chooser:
            care = CARE.get(placed.set.name, Care())
            yield replace(
                placed.case(care=care),
                words={"effect": _does(placed, care)},
                needs=placed.set.needs,
            )


@KIND.check(
    "{placed.set.set} is read back by {placed.set.req} at {placed.text}",
    does="{effect}",
    each=_settings,
)
def _run(trial: Trial, placed: PlacedSet, care: Care) -> None:
    first = placed.ask(trial)
    judge_message(trial, placed.place, placed.channel, first)
    before = placed.values(first)
    for name in care.zero:
        trial.must(
            before[name] == 0,
            f"{placed.text}: {placed.set.get} returned {name} = {before[name]}; it is always zero",
            rule=rule_of_field(placed.set.get, name),
            cause=Cause(placed.set.get, name),
        )
    if placed.set.effect == "motion":
        need_positions(trial, placed.place)
    neighbours = Neighbours.of(trial, placed)
    placed.undo(trial, before)
    _write_same(trial, placed, care, before)
    why = why_not_now(trial, placed, care) if care.fields else "no check changes its values"
    if why:
        trial.info(f"{placed.set.set} only wrote back the current values: {why}")
    else:
        write_and_read(trial, placed, care, before, neighbours)


def write_and_read(
    trial: Trial, placed: PlacedSet, care: Care, before: Values, neighbours: Neighbours
) -> None:
    """Write one value after the other, and report the result of each."""
    looked = False
    for field, values in variants(placed.set, care, before, trial.random):
        written = []
        for value in values:
            written.append(_write(trial, placed, care, before, field, value))
            if written[-1].taken and not looked:
                looked = True
                neighbours.judge(trial, f"{placed.set.set} with {field} = {value} was sent")
        _judge_refusals(trial, placed, care, field, before[field], written)


def _write_same(trial: Trial, placed: PlacedSet, care: Care, before: Values) -> None:
    """Write the current values, which must change nothing."""
    came = placed.write_and_ask(trial, {**before, **dict.fromkeys(care.ignored, 0)})
    told = placed.values(came)
    (trial.should if care.doubtful else trial.must)(
        told == before,
        f"{placed.text}: {placed.set.set} wrote the current values, but {placed.set.get} then "
        f"returned {_differences(told, before)}",
        wanted=placed.expected(trial, before, came),
        came=came.raw,
        rule=rule_of_set(placed.set.set),
        cause=placed.differing(told, before),
    )


def _write(
    trial: Trial, placed: PlacedSet, care: Care, before: Values, field: str, value: int
) -> _Written:
    written = {**before, field: value}
    came = placed.write_and_ask(trial, written)
    says = placed.values(came)
    told, was = says[field], before[field]
    strict = trial.should if care.doubtful else trial.must
    text = (
        f"{placed.text}: {placed.set.set} wrote {field} = {value}, but {placed.set.get} then "
        f"returned {told}"
    )
    text += f" (before: {was})"
    if care.doubtful:
        text += f"; {care.doubtful}"
    wanted = placed.expected(trial, written, came)
    is_number = care.fields[field].how in (How.NEAR, How.LOWER, How.HIGHER, How.WIDE)
    if told != value and is_number and 2 * abs(told - value) <= abs(value - was):
        trial.should(
            False,
            f"{text}: the value was rounded",
            wanted=wanted,
            came=came.raw,
            rule=rule_of_set(placed.set.set),
        )
    else:
        strict(
            told in (value, was),
            text,
            wanted=wanted,
            came=came.raw,
            rule=rule_of_set(placed.set.set),
            cause=Cause(placed.set.set, field),
        )
    rest = {name: each for name, each in says.items() if name != field}
    strict(
        all(each == before[name] for name, each in rest.items()),
        f"{placed.text}: {placed.set.set} changed only {field}, but {placed.set.get} then "
        f"returned {_differences(rest, before)}",
        wanted=wanted,
        came=came.raw,
        rule=rule_of_set(placed.set.set),
        cause=placed.differing(rest, before),
    )
    return _Written(value, taken=told != was)


def _judge_refusals(
    trial: Trial, placed: PlacedSet, care: Care, field: str, was: object, written: list[_Written]
) -> None:
    """Report the values that did not take effect.

    A controller may have a reason to refuse one of several values, but not all of them. Each bit counts on
    its own.
    """
    refused = [str(each.value) for each in written if not each.taken]
    if not refused:
        return
    varied = care.fields[field]
    some = len(refused) < len(written) and varied.how is not How.BITS
    gently = care.doubtful or varied.advised or some
    (trial.should if gently else trial.must)(
        False,
        f"{placed.text}: {placed.set.set} did not set {field}: it wrote {', '.join(refused)}, "
        f"but {placed.set.get} still returned {was}"
        + (f"; {care.doubtful}" if care.doubtful else ""),
        rule=rule_of_set(placed.set.set),
        cause=Cause(placed.set.set, EFFECT),
        because=(Cause(placed.set.set, field),),
    )
    if not gently:
        trial.causes.report(Cause(placed.set.set, field), trial.check)


def _differences(says: Values, wanted: Values) -> str:
    return ", ".join(
        f"{name} = {value!r} (before: {wanted[name]!r})"
        for name, value in says.items()
        if value != wanted[name]
    )
