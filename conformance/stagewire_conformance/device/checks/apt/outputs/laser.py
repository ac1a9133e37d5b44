"""Checks of lasers: status, output, source, mode and limit (Issue 37, pages 295 to 323).

Nothing is written to a laser whose output is on. Set points are low. At the end, also after a failure, the
set point is 0 and the output off.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from stagewire_conformance.device.causes import EFFECT, Cause
from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.apt.outputs.light import (
    FULL,
    Light,
    drawn,
    light_check,
    masks_of,
)
from stagewire_conformance.device.trial import EnoughError

if TYPE_CHECKING:
    from stagewire_conformance.device.targets import Target
    from stagewire_conformance.device.trial import Trial

_LOW: Final = FULL // 50  # 2 %
_HIGHER: Final = FULL // 20  # 5 %
_BRIGHT: Final = FULL // 10
"""A reading that is far above each set point of the checks."""
_NEAR: Final = FULL // 100
_SETTLED: Final = 0.5
"""Seconds for the current to settle."""
_PAUSE: Final = 0.5
"""Seconds between the messages of an adjustment: without them a TLD001 keeps the old limit."""
_LOWEST: Final = 20
"""The lowest limit that the vendor's program accepts, of 255."""
_TLD001: Final = "TLD001"
_MODES: Final = ("LD_OPENLOOP", "LD_CLOSEDLOOP")

STATUS = Kind(
    name="laser-status",
    title="The readings and the status of a laser agree",
    rules=("laser-status-readings", "laser-diode-status-readings"),
)
OUTPUT = Kind(
    name="laser-output",
    title="The light of a laser can be switched on and off, and follows its set point",
    rules=(
        "laser-output", "laser-status-readings", "laser-diode-status-readings", "get-answers-request",
    ),
)  # fmt: skip
SOURCE = Kind(
    name="laser-source",
    title="The source of the set point can be selected",
    rules=("laser-control-source", "laser-control-source-values"),
)
MODE = Kind(
    name="laser-mode",
    title="Constant current and constant power can be selected",
    rules=("tld001-modes",),
)
LIMIT = Kind(
    name="laser-limit",
    title="The limit of the current can be set, and is not exceeded",
    rules=("laser-setpoint-attempt", "get-answers-request"),
)


def _rule(light: Light) -> str:
    return "laser-diode-status-readings" if light.is_driver else "laser-status-readings"


@light_check(
    STATUS,
    "The status of {place.name} agrees with its readings",
    messages=("LA_REQ_STATUSBITS", "LA_GET_STATUSBITS"),
    seconds=0.1,
)
def _status(trial: Trial, place: Target) -> None:
    light = Light(trial, place)
    status, bits = light.status()
    name = light.status_name
    _ready(light, bits)
    trial.must(
        "output_enabled" in bits or not drawn(status),
        f"{name} reports a laser current of {status.laser_current} while the output is off",
        rule=_rule(light),
        cause=Cause(name, "laser_current"),
    )
    for group, what in (("tia_range_", "ranges of the photodiode"), ("display_", "displays")):
        shown = sorted(bit for bit in bits if bit.startswith(group))
        one = any(bit.startswith(group) for bit in masks_of(trial.declared, place, name))
        trial.must(
            not one or len(shown) == 1,
            f"{name} reports {len(shown)} {what} ({', '.join(shown) or 'none'}); it should report one",
            rule=_rule(light),
            cause=Cause(name, group),
        )
    if light.is_driver:
        maximum = light.ask("LD_REQ_MAXCURRENT").max_current
        trial.must(
            status.laser_current <= maximum + _NEAR,
            f"{name} reports a current of {status.laser_current}, above the maximum of {maximum}",
            rule=_rule(light),
            cause=Cause(name, "laser_current"),
        )
    _readings(light)


def _readings(light: Light) -> None:
    """Compare the readings with those of the status."""
    request = "LD_REQ_CURRENTANDPOWER" if light.is_driver else "LA_REQ_CURRENTANDPOWER"
    status, _ = light.status()
    told = light.ask(request)
    after, _ = light.status()
    power = "photo_current" if light.is_driver else "laser_power"
    for name, field in (("laser_current", "laser_current"), (power, "laser_power")):
        here = getattr(status, name), getattr(after, name)
        near = min(here) - _NEAR <= getattr(told, field) <= max(here) + _NEAR
        light.trial.must(
            near,
            f"{told.layout.message} returned {field} = {getattr(told, field)}, but {light.status_name} "
            f"{name} = {here[0]}; they should agree",
            rule=_rule(light),
            cause=Cause(told.layout.message, field),
        )


def _ready(light: Light, bits: frozenset[str]) -> bool:
    """Report an output that is on although the key switch or the interlock is open; return whether not."""
    missing = {"keyswitch_enabled", "interlock_enabled"} - bits
    return light.trial.must(
        "output_enabled" not in bits or not missing,
        f"{light.status_name} reports an output that is on without {' and '.join(sorted(missing))}; the "
        "output can be on only if both are set",
        rule=_rule(light),
        cause=Cause(light.status_name, "status_bits"),
    )


def _dark_at_the_end(light: Light) -> None:
    """Switch off and set the set point to 0 at the end, also after a failure; switching off comes first."""
    point = light.set_of("LA_POWERSETPOINT")
    light.trial.undo(
        f"the set point 0 at {light.place.name}",
        lambda: point.put_back(light.trial, {"set_point": 0}),
    )
    light.undo(
        f"the output of {light.place.name}, off",
        "LA_DISABLEOUTPUT",
        lambda: light.send("LA_DISABLEOUTPUT"),
        lambda: not light.is_on(),
    )


def _software(light: Light) -> None:
    """Select the software as the source of the set point, and restore the source at the end."""
    source = light.set_of("LA_POWERCONTROLSOURCE")
    before = source.read(light.trial)
    number = _sources(light)["SOFTWARE"]
    if before["laser_source"] != number:
        source.undo(light.trial, before)
        light.keeps(source, {"laser_source": number})


def _sources(light: Light) -> dict[str, int]:
    registry = light.trial.declared.registry
    field = registry.fields("LA_SET_POWERCONTROLSOURCE", "data")["laser_source"]
    table = field["enums_by_unit"].get(light.place.unit.name, field["enumeration"])
    values = registry.table("enumerations")[table]["values"]
    return {name: each["value"] for name, each in values.items() if not each.get("reserved")}


def _prepare(light: Light, bits: frozenset[str]) -> None:
    """Set a low set point while the output is off, or end the check."""
    trial = light.trial
    if light.is_driver and "closed_loop" in bits:
        trial.inconclusive(
            f"{light.place.name} has constant power, in which the current depends on the photodiode, so the "
            "output was not switched on; select constant current and repeat"
        )
        raise EnoughError
    _dark_at_the_end(light)
    _software(light)
    point = light.set_of("LA_POWERSETPOINT")
    if light.place.unit.name == _TLD001 and point.read(trial)["set_point"] > _BRIGHT:
        trial.inconclusive(
            "a TLD001 may ignore a set point while its output is off, and the present one is above 10 %, so "
            "the output was not switched on"
        )
        raise EnoughError
    if not light.keeps(point, {"set_point": _LOW}):
        raise EnoughError  # the light would have another power


@light_check(
    OUTPUT,
    "The light of {place.name} is switched on at a low set point, and off",
    messages=(
        "LA_SET_POWERSETPOINT", "LA_REQ_POWERSETPOINT", "LA_GET_POWERSETPOINT", "LA_ENABLEOUTPUT",
        "LA_DISABLEOUTPUT", "LA_REQ_STATUSBITS", "LA_GET_STATUSBITS", "LA_SET_POWERCONTROLSOURCE",
        "LA_REQ_POWERCONTROLSOURCE", "LA_GET_POWERCONTROLSOURCE",
    ),
    does="switches the laser on at 2 % and 5 % of its full scale for about two seconds, and off; at the end "
    "the set point is 0",
    seconds=3.5,
    bound="the set point of a laser changes at once, up to 5 %",
)  # fmt: skip
def _output(trial: Trial, place: Target) -> None:
    light = Light(trial, place)
    light.begin()
    _prepare(light, light.status()[1])
    _judge_off(light, "LA_SET_POWERSETPOINT", "was sent with the output off")
    if not {"keyswitch_enabled", "interlock_enabled"} <= light.status()[1]:
        light.send("LA_ENABLEOUTPUT")
        light.wait(_SETTLED)
        if _ready(light, light.status()[1]):
            trial.inconclusive("the key switch or the interlock is open; close both and repeat")
        return
    light.send("LA_ENABLEOUTPUT")
    dim = _judge_on(light, _LOW)
    light.keeps(light.set_of("LA_POWERSETPOINT"), {"set_point": _HIGHER})
    bright = _judge_on(light, _HIGHER)
    trial.must(
        bright > dim,
        f"{light.status_name} reported {dim} with a set point of {_LOW} and {bright} with {_HIGHER}; the "
        "reading should rise",
        rule=_rule(light),
        cause=Cause("LA_SET_POWERSETPOINT", EFFECT),
    )
    light.send("LA_DISABLEOUTPUT")
    light.wait(_SETTLED)
    _judge_off(light, "LA_DISABLEOUTPUT", "was sent")
    light.wait(_SETTLED)
    _judge_off(light, "LA_DISABLEOUTPUT", "was sent a second ago")


def _judge_on(light: Light, set_point: int) -> int:
    """Report an output that is not on, or has another power; return the reading."""
    trial, name = light.trial, light.status_name
    light.wait(_SETTLED)
    status, bits = light.status()
    alone = light.bits("LA_GET_STATUSBITS", light.ask("LA_REQ_STATUSBITS"))
    field = "laser_current" if light.is_driver else "laser_power"
    reading = int(getattr(status, field))
    for message, found in ((name, bits), ("LA_GET_STATUSBITS", alone)):
        trial.must(
            "output_enabled" in found,
            f"LA_ENABLEOUTPUT was sent, but {message} does not report output_enabled",
            rule="laser-output",
            cause=Cause("LA_ENABLEOUTPUT", EFFECT),
        )
    _ready(light, bits)
    if not trial.must(
        reading <= _BRIGHT,
        f"{name} reports {field} = {reading} with a set point of {set_point}; it should not be much more",
        rule=_rule(light),
        cause=Cause(name, field),
    ):
        light.send("LA_DISABLEOUTPUT")
        raise EnoughError
    trial.must(
        reading > 0,
        f"{name} reports {field} = 0 with the output on and a set point of {set_point}",
        rule=_rule(light),
        cause=Cause(name, field),
    )
    trial.should(
        abs(reading - set_point) <= _NEAR,
        f"{name} reports {field} = {reading} with a set point of {set_point}; they should agree to 1 %",
        rule=_rule(light),
        cause=Cause(name, field),
    )
    _readings(light)
    return reading


def _judge_off(light: Light, message: str, when: str) -> None:
    """Report an output that is on, or has a current."""
    status, bits = light.status()
    alone = light.bits("LA_GET_STATUSBITS", light.ask("LA_REQ_STATUSBITS"))
    light.trial.need(
        "output_enabled" not in bits | alone and not drawn(status),
        f"{message} {when}, but {light.status_name} reports "
        f"{'an output that is on' if 'output_enabled' in bits | alone else 'a laser current'}; the output "
        "should be off",
        rule="laser-output",
        cause=Cause(message, EFFECT),
    )


@light_check(
    SOURCE,
    "LA_SET_POWERCONTROLSOURCE selects each source of {place.name}",
    messages=(
        "LA_SET_POWERCONTROLSOURCE", "LA_REQ_POWERCONTROLSOURCE", "LA_GET_POWERCONTROLSOURCE",
    ),
    does="selects each source of the set point while the output is off, and restores the previous one",
    seconds=0.3,
    bound="the output of the laser stays off",
)  # fmt: skip
def _source(trial: Trial, place: Target) -> None:
    light = Light(trial, place)
    light.begin()
    source = light.set_of("LA_POWERCONTROLSOURCE")
    before = source.read(trial)
    source.undo(trial, before)
    for number in _sources(light).values():
        light.keeps(source, {"laser_source": number}, "laser-control-source-values")
    trial.must(
        not light.is_on(),
        "LA_SET_POWERCONTROLSOURCE was sent with the output off, and then it was on",
        rule="laser-control-source",
        cause=Cause("LA_SET_POWERCONTROLSOURCE", EFFECT),
    )


@light_check(
    MODE,
    "LD_OPENLOOP and LD_CLOSEDLOOP select the mode of {place.name}",
    messages=_MODES,
    does="selects constant current and constant power while the output is off, and restores the mode",
    seconds=0.1,
    bound="the output of the laser stays off",
)
def _mode(trial: Trial, place: Target) -> None:
    light = Light(trial, place)
    light.begin()
    before = "closed_loop" in light.status()[1]
    light.undo(
        f"the mode of {place.name}",
        _MODES[before],
        lambda: light.send(_MODES[before]),
        lambda: ("closed_loop" in light.status()[1]) == before,
    )
    for closed in (not before, before):
        light.send(_MODES[closed])
        _, bits = light.status()
        trial.must(
            ("closed_loop" in bits) == closed and "output_enabled" not in bits,
            f"{_MODES[closed]} was sent with the output off, but then {light.status_name} reports "
            f"{'an output that is on' if 'output_enabled' in bits else 'the other mode'}",
            rule="tld001-modes",
            cause=Cause(_MODES[closed], EFFECT),
        )


@light_check(
    LIMIT,
    "LD_SET_MAXCURRENTDIGPOT limits the current of {place.name}",
    messages=(
        "LD_MAXCURRENTADJUST", "LD_SET_MAXCURRENTDIGPOT", "LD_REQ_MAXCURRENTDIGPOT",
        "LD_GET_MAXCURRENTDIGPOT", "LD_REQ_MAXCURRENT", "LD_GET_MAXCURRENT",
        "LA_SET_POWERSETPOINT", "LA_REQ_POWERSETPOINT", "LA_GET_POWERSETPOINT", "LA_ENABLEOUTPUT",
        "LA_DISABLEOUTPUT", "LA_SET_POWERCONTROLSOURCE", "LA_REQ_POWERCONTROLSOURCE",
        "LA_GET_POWERCONTROLSOURCE",
    ),
    does="sets the lowest limit of the current, switches the laser on for a second with a higher set point, "
    "and restores the limit; at the end the set point is 0",
    seconds=5.5,
    bound="the limit of the current changes at once, to about 18 mA",
)  # fmt: skip
def _limit(trial: Trial, place: Target) -> None:
    light = Light(trial, place)
    light.begin()
    limit = light.set_of("LD_MAXCURRENTDIGPOT")
    before: int = limit.read(trial)["max_current"]
    light.undo(
        f"the limit of the current of {place.name}",
        "LD_SET_MAXCURRENTDIGPOT",
        lambda: _adjust(light, before),
        lambda: limit.read(trial)["max_current"] == before,
    )
    wanted = min(before, _LOWEST)
    _adjust(light, wanted)
    told = limit.read(trial)["max_current"]
    if not trial.must(
        told == wanted,
        f"LD_SET_MAXCURRENTDIGPOT wrote {wanted}, but LD_GET_MAXCURRENTDIGPOT then returned {told}",
        rule="get-answers-request",
        cause=Cause("LD_SET_MAXCURRENTDIGPOT", EFFECT),
    ):
        return
    maximum: int = light.ask("LD_REQ_MAXCURRENT").max_current
    trial.must(
        0 < maximum <= _BRIGHT,
        f"LD_SET_MAXCURRENTDIGPOT wrote {wanted} of 255, but LD_GET_MAXCURRENT then returned {maximum} of "
        f"{FULL}",
        rule="get-answers-request",
        cause=Cause("LD_GET_MAXCURRENT", "max_current"),
    )
    _, bits = light.status()
    _prepare(light, bits)
    if not {"keyswitch_enabled", "interlock_enabled"} <= bits:
        trial.inconclusive("the key switch or the interlock is open; close both and repeat")
        return
    light.send("LA_ENABLEOUTPUT")
    light.wait(_SETTLED)
    light.keeps(light.set_of("LA_POWERSETPOINT"), {"set_point": maximum + _HIGHER})
    light.wait(_SETTLED)
    status, bits = light.status()
    light.send("LA_DISABLEOUTPUT")
    trial.must(
        status.laser_current <= maximum + _NEAR,
        f"LD_SET_MAXCURRENTDIGPOT limited the current to {maximum}, but {light.status_name} then reported "
        f"laser_current = {status.laser_current} with a set point of {maximum + _HIGHER}",
        rule="laser-setpoint-attempt",
        cause=Cause("LD_SET_MAXCURRENTDIGPOT", "limit"),
    )
    trial.must(
        "current_limit" in bits,
        f"{light.status_name} does not report current_limit while the limit reduces the current",
        rule="laser-setpoint-attempt",
        cause=Cause(light.status_name, "current_limit"),
    )


def _adjust(light: Light, limit: int) -> None:
    """Set the limit of the current with the laser off, as pages 314 and 315 describe."""
    light.send("LD_MAXCURRENTADJUST", adjust=2, diode=1)
    light.wait(_PAUSE)
    light.send("LD_SET_MAXCURRENTDIGPOT", max_current=limit)
    light.wait(_PAUSE)
    light.send("LD_MAXCURRENTADJUST", adjust=1, diode=1)
    light.wait(_PAUSE)
