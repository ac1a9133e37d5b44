"""Every call of every unit, found in the classes, with arguments from the registry."""

from __future__ import annotations

import ast
import inspect
import math
import random
import textwrap
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cache
from importlib import import_module
from typing import Any

from stagewire._devices import reals
from stagewire._devices.options import settable
from stagewire._devices.ratings import SETTING, has_rated
from stagewire.protocols import load_protocol
from stagewire_apt import TDC001

RAISED: dict[str, dict[str, Any]] = {
    "MLS203": {"max_velocity_mm_per_s": 10**9, "max_acceleration_mm_per_s2": 10**9},
    "Z8": {"max_velocity_mm_per_s": 10**9},
    "KDC101": {"max_velocity_mm_per_s": 10**9, "max_acceleration_mm_per_s2": 10**9},
}
"""Unit or stage -> options that raise the limits of the stage, for tests of other things."""
KINDS = {"_get", "_set", "_change", "_ask", "_tell", "_act", "_start", "_halt"}


@dataclass(frozen=True)
class Call:
    """One method of a part of a unit, with its kind and its table.

    :ivar argument: only argument of a short form, such as ``set_volts(volts)``; empty for other calls.
    :ivar keyword: keyword of the full call for the same value.
    """

    unit: str
    part: str  # device, bay, channel or axis
    name: str
    kind: str
    table: Any
    argument: str = ""
    keyword: str = ""

    def __str__(self) -> str:
        return f"{self.unit}.{self.part}.{self.name}"


@cache
def registry(protocol: str = "thorlabs_apt") -> Any:
    return load_protocol(protocol).registry()


FULL_SCALE = 32767
"""Counts of an output voltage that are the whole range of the controller."""
UNLIKE = {
    "K10CR1": "a built-in rotation stage, whose limits refuse most values in degrees",
    "KVS30": "a built-in stage, whose limits refuse most values",
    "LTS150": "a scale that depends on the hardware version",
    "LTS300": "as the LTS150",
    "MFF101": "two positions, and no status message",
    "MFF102": "as the MFF101",
    "MLJ050": "a scale on which the sources contradict each other",
    "MLJ150": "as the MLJ050",
}
"""Units of Issue 37 that the proofs leave out because of a premise that does not hold for them.

``tests/generator/test_issue_37_units.py`` and the conformance suite on virtual controllers cover them.
"""


def units(protocol: str = "thorlabs_apt") -> list[str]:
    return [unit["name"] for unit in registry(protocol)["units"] if unit["name"] not in UNLIKE]


def raised(unit: str) -> dict[str, Any]:
    """Return options that raise the limits of the first stage of a unit."""
    return RAISED.get(unit, RAISED.get(facts_of(unit)["stages"][0], {}))


def rating(unit: str, protocol: str = "thorlabs_apt") -> dict[str, Any]:
    """Return a rating and a full scale that allow every voltage of a unit, for tests of other things.

    ``test_ratings.py`` tests the refusals.
    """
    if protocol != "thorlabs_apt":
        return {}
    facts, described = TDC001.facts, TDC001.facts.units[unit]
    if not has_rated(facts, described):
        return {}
    scaled = SETTING in settable(facts, described)
    return {"max_volts": 100_000} | ({"settings": {SETTING: 100_000}} if scaled else {})


def facts_of(unit: str, protocol: str = "thorlabs_apt") -> Any:
    """Return the registry entry of a unit."""
    [facts] = [facts for facts in registry(protocol)["units"] if facts["name"] == unit]
    return facts


@cache
def layouts(protocol: str = "thorlabs_apt") -> dict[str, Any]:
    """Return the layouts of the registry by the name of their class."""
    return {
        layout["class"]: layout
        for message in registry(protocol)["messages"]
        for layout in message["layouts"]
    }


def parts(cls: type) -> dict[str, type]:
    """Return the class of a unit, and the class of its bays, channels or axes."""
    found = {"device": cls}
    for name in ("bay", "channel", "axis"):
        part = getattr(cls, f"{name}_class", None)
        if part is not None:
            found[name] = part
    return found


def calls(unit: str, package: str = "stagewire_apt") -> list[Call]:
    """Return every call of a unit that is generated from the registry, except those that are never sent.

    Those that report or set limits of the controller come last: random limits refuse later targets. Short
    forms of calls are in :func:`short_forms`.
    """
    return [call for call in _calls(unit, package) if not call.argument]


def short_forms(unit: str, package: str = "stagewire_apt") -> list[tuple[Call, Call]]:
    """Return the calls of a unit with another argument than the message, each with its full call."""
    found = _calls(unit, package)
    return [
        (short, full)
        for short in found
        if short.argument
        for full in found
        if not full.argument
        and (full.part, full.kind, full.table) == (short.part, short.kind, short.table)
    ]


def _calls(unit: str, package: str) -> list[Call]:
    cls = getattr(import_module(f"{package}.devices"), unit)
    found = (call for part, its in parts(cls).items() for call in _methods(unit, part, its))
    sent = [call for call in found if not getattr(message_of(call).layout, "not_sent", "")]
    return sorted(sent, key=lambda call: _owner(call) in limiting(package.split("_", 1)[1]))


@cache
def limiting(prefix: str) -> set[str]:
    """Return the parameter sets with limits of the controller."""
    protocol = {"apt": "thorlabs_apt", "ms2000": "asi_ms2000"}[prefix]
    settings = registry(protocol)["settings"].values()
    return {owner for setting in settings if "quantity" in setting for owner in setting["told_by"]}


def _owner(call: Call) -> str:
    """Return the name of the parameter set of a call, if it has one."""
    name: str = message_of(call).layout.message  # type: ignore[attr-defined]
    return name.replace("_SET_", "_").replace("_REQ_", "_")


def _methods(unit: str, part: str, cls: type) -> Iterator[Call]:
    for name, function in inspect.getmembers(cls, inspect.isfunction):
        function = inspect.unwrap(function)
        names = function.__code__.co_names
        if name.startswith("_") or not names or names[0] not in KINDS:
            continue
        tables = function.__globals__[names[1]]
        call = Call(unit, part, name, names[0], getattr(tables, names[2]))
        takes = inspect.signature(function).parameters.keys() - {"self", "timeout"}
        keywords = {keyword for given in givens(call) for keyword in given.keywords}
        if keywords and not takes:
            continue  # it sends fixed values; see test_presets.py
        yield call if takes == keywords else replace(call, **_short_form(function))


def _short_form(function: Callable[..., Any]) -> dict[str, str]:
    """Return the only argument of a short form, and the keyword for its value in the full call."""
    [definition] = ast.parse(textwrap.dedent(inspect.getsource(function))).body
    [passed] = (
        (node.value.id, node.arg)
        for node in ast.walk(definition)
        if isinstance(node, ast.keyword) and isinstance(node.value, ast.Name) and node.arg
    )
    return {"argument": passed[0], "keyword": passed[1]}


def part_of(device: Any, part: str) -> Any:
    """Return the first part of a device of a kind, such as ``channel``."""
    if part == "device":
        return device
    return device.axis("X") if part == "axis" else getattr(device, part)(1)


def method(device: Any, call: Call) -> Callable[..., Any]:
    found: Callable[..., Any] = getattr(part_of(device, call.part), call.name)
    return found


# Arguments


def fields_of(layout: Any, unit: str = "") -> list[Any]:
    """Return the fields of a layout, with their ranges on a unit, or with ranges that fit every unit.

    They also fit every setting on which a range depends.
    """
    fields = (layout["param1"], layout["param2"], *layout["fields"])
    return [_ranged(field, unit) for field in fields if field]


def _ranged(field: Any, unit: str) -> Any:
    fitting = _ranges(field, unit)
    if not fitting:
        return field
    minimum = max(each["minimum"] for each in fitting)
    maximum = min(each["maximum"] for each in fitting)
    found = {**field, "minimum": minimum, "maximum": maximum}
    if "enum" in field:
        found["enum"] = {n: v for n, v in field["enum"].items() if minimum <= v <= maximum}
    return found


def _ranges(field: Any, unit: str) -> list[Any]:
    """Return the ranges of a field that depend on the unit or on a setting."""
    ranges = field.get("ranges_by_unit", {})
    by_unit = [ranges.get(unit, ranges["others"])] if unit and ranges else [*ranges.values()]
    cases = (field.get("scale") or {}).get("cases", {})
    return by_unit + [case for case in cases.values() if "minimum" in case]


def random_field(field: Any, draw: random.Random) -> Any:
    """Return a random value that a controller may send and a user may write."""
    if field["kind"] == "text":
        return "".join(draw.choice("ABCDEFGH") for _ in range(field["size"] - 1))
    if field["kind"] == "bytes":
        return draw.randbytes(field["size"])
    if field.get("enum"):
        alone = {**field["enum"]}
        added = [alone.pop(name) for name in field.get("modifiers", ())]
        return draw.choice(sorted(alone.values())) | some_of(added, draw)
    if field.get("flags") and not field.get("open"):
        return some_of(field["flags"].values(), draw)
    return draw.randint(field["minimum"], field["maximum"])


def some_of(masks: Iterable[int], draw: random.Random) -> int:
    """Return a random choice of masks, combined by bitwise OR."""
    return sum(mask for mask in masks if draw.random() < 0.5)


def fields_at_random(
    cls: type, draw: random.Random, protocol: str = "thorlabs_apt", **fixed: int
) -> dict[str, Any]:
    """Return fields of a message with random values, except the `fixed` ones."""
    return {
        field["name"]: fixed[field["name"]] if field["name"] in fixed else random_field(field, draw)
        for field in fields_of(layouts(protocol)[cls.__name__])
        if field["role"] == "value"
    }


def message_of(call: Call) -> type:
    """Return the message with the arguments of a call."""
    table = call.table
    for name in ("message", "set") if call.kind in ("_set", "_change") else ("message", "req"):
        if getattr(table, name, None) is not None:
            found: type = getattr(table, name)
            return found
    raise AssertionError(f"{call}: its table has no message")


def givens(call: Call) -> tuple[Any, ...]:
    """Return the arguments of a call; for a query, those of the request."""
    name = "asked" if call.kind in ("_get", "_ask") else "given"
    return tuple(getattr(call.table, name, ()))


def arguments(call: Call, draw: random.Random, protocol: str = "thorlabs_apt") -> dict[str, Any]:
    """Return random arguments that are valid according to the registry: raw counts, and real numbers.

    A short form takes a small value in its unit.
    """
    if call.argument:
        return {call.argument: draw.randint(0, 50)}
    by_name = {
        field["name"]: field for field in fields_of(layouts(protocol)[message_of(call).__name__])
    }
    found = {given.keyword: _argument(by_name[given.field], draw) for given in givens(call)}
    for given in givens(call):
        if given.quantity == "output_volts":  # a larger share of the range exceeds every rating
            found[given.keyword] = max(-FULL_SCALE, min(found[given.keyword], FULL_SCALE))
    return found


def _argument(field: Any, draw: random.Random) -> Any:
    if not field.get("real"):
        return random_field(field, draw)
    if _is_signed(field):  # most patterns are numbers, but not all
        return reals.number_of(
            reals.pattern_of(draw.uniform(-1e6, 1e6), field["size"]), field["size"]
        )
    return reals.number_of(random_field(field, draw), field["size"])


def _is_signed(field: Any) -> bool:
    """Whether a real number may be negative; then it has no range."""
    return bool(field["maximum"] >> (8 * field["size"] - 1))


def as_sent(message: Any, field: str, value: Any) -> Any:
    """Return an argument as a message carries it: a real number as its bit pattern."""
    found = fields_of(layouts()[type(message).__name__])
    [entry] = [each for each in found if each["name"] == field]
    return reals.pattern_of(value, entry["size"]) if entry.get("real") else value


def in_units(
    call: Call,
    draw: random.Random,
    protocol: str = "thorlabs_apt",
    *,
    rotary: bool | None = None,
) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield the keywords in units, each with valid counts for all other values.

    :param rotary: kind of the stage, to leave out the keywords for the other kind; None: all.
    """
    for given in givens(call):
        for way in given.ways:
            if rotary is not None and way[1].startswith("mm" if rotary else "deg"):
                continue
            others = arguments(call, draw, protocol)
            del others[given.keyword]
            yield way[0], others


def in_counts(
    call: Call, draw: random.Random, protocol: str = "thorlabs_apt"
) -> Iterator[tuple[str, dict[str, Any], tuple[Any, ...]]]:
    """Yield the keywords in counts, with values just outside their range and values that are not integers."""
    layout = layouts(protocol)[message_of(call).__name__]
    fields = {
        field["name"]: field
        for field in (layout["param1"], layout["param2"], *layout["fields"])
        if field
    }
    for given in givens(call):
        field = fields[given.field]
        if field["kind"] == "integer":
            others = arguments(call, draw, protocol)
            del others[given.keyword]
            yield given.keyword, others, (*_outside(field, call.unit), math.nan, math.inf)


def _outside(field: Any, unit: str) -> tuple[float, ...]:
    """Return values just outside the range of a number, and one that is not an integer.

    They are outside the range of every setting on which the range depends.
    """
    ranges = _ranges(field, unit) or [field]
    low = min(each["minimum"] for each in ranges)
    high = max(each["maximum"] for each in ranges)
    if not field.get("real"):
        return low - 1, high + 1, 0.5
    if _is_signed(field):
        return -1e39, 1e39
    return -1, reals.number_of(high + 1, field["size"])
