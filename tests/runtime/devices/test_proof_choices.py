"""Named choices: every argument with names, in every call of every unit, for threads and asyncio."""

from __future__ import annotations

import dataclasses
import itertools
import random
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from proof_calls import (
    Call,
    arguments,
    calls,
    facts_of,
    fields_of,
    givens,
    layouts,
    message_of,
    method,
    rating,
    registry,
    units,
)
from proof_controller import Parrot
from proof_line import SIDES, Side, settled

from stagewire.errors import BadValueError, OutOfRangeError, StagewireError
from stagewire.protocols import Flags
from stagewire_apt import enumerations, flags
from stagewire_apt.devices import tables

OPTIONS: dict[str, Any] = {"identify": False, "on_close": "leave"}
MOVING = {"_act", "_start", "_halt"}


def field_of(call: Call, given: Any) -> Any:
    """Return the registry entry of an argument."""
    [field] = [
        field
        for field in fields_of(layouts()[message_of(call).__name__], call.unit)
        if field["name"] == given.field
    ]
    return field


def named(unit: str) -> list[tuple[Call, Any]]:
    """Return every argument of a unit whose values or bits have names in the registry."""
    return [
        (call, given)
        for call in calls(unit)
        for given in givens(call)
        if not {"enum", "flags"}.isdisjoint(field_of(call, given))
    ]


def legal_numbers(field: Any) -> set[int]:
    """Return every number that the registry lists."""
    numbers = {0} if "flags" in field else set(field["enum"].values())
    added = set(field.get("flags", {}).values())
    for name in field.get("modifiers", ()):
        numbers.remove(field["enum"][name])
        added.add(field["enum"][name])
    for mask in added:
        numbers |= {number | mask for number in numbers}
    return numbers


def illegal(field: Any) -> Iterator[tuple[Any, type[StagewireError]]]:
    """Yield values to refuse: unlisted numbers, and values that are not a number, a name or a member."""
    yield from ((value, OutOfRangeError) for value in (-1, field["maximum"] + 1, 2**80))
    if not field.get("open"):
        legal = legal_numbers(field)
        numbers = range(field["maximum"] + 1)
        outside = itertools.filterfalse(legal.__contains__, numbers)
        downwards = itertools.filterfalse(legal.__contains__, reversed(numbers))
        first = list(itertools.islice(outside, 3))
        last = itertools.islice(downwards, 1)
        yield from ((value, OutOfRangeError) for value in (*first, *last))
        yield from ((np.uint16(value), OutOfRangeError) for value in first[:1])
    wrong = [
        "forwards",
        "",
        "1",
        b"FORWARD",
        True,
        np.True_,
        1.0,
        object(),
        [1],
        enumerations.BayState.EMPTY,
    ]
    yield from ((value, BadValueError) for value in wrong)
    for names in (field.get("enum", {}), field.get("flags", {})):
        yield from ((f"{name}|NONSENSE", BadValueError) for name in names)
    alone = [name for name in field.get("enum", ()) if name not in field.get("modifiers", ())]
    yield from (("|".join(pair), BadValueError) for pair in itertools.pairwise(alone))
    yield from ((name, BadValueError) for name in field.get("modifiers", ()))


@pytest.mark.parametrize("side", SIDES, ids=repr)
@pytest.mark.parametrize("unit", units())
def test_an_invalid_choice_is_refused_before_anything_is_sent(unit: str, side: Side) -> None:
    controller = Parrot(seed=3)
    draw = random.Random(unit)

    async def scenario(bench: Any) -> list[str]:
        wrong: list[str] = []
        async with bench.open(unit, **OPTIONS, **rating(unit)) as device:
            controller.heard.clear()
            for call, given in named(unit):
                field = field_of(call, given)
                first = next(iter({**field.get("enum", {}), **field.get("flags", {})}))
                for value, expected in illegal(field):
                    others = arguments(call, draw)
                    try:
                        await settled(method(device, call)(**{**others, given.keyword: value}))
                    except expected as error:
                        said = str(error)
                        if controller.heard:
                            wrong.append(f"{call}({value!r}) sent {controller.names()}")
                        if not (first in said and given.keyword in said) and not field.get("open"):
                            wrong.append(f"{call}({value!r}): {said}")
                    except Exception as error:
                        wrong.append(f"{call}({value!r}): {error!r}")
                    else:
                        wrong.append(f"{call}({value!r}) was accepted: {controller.names()}")
        return wrong

    assert side.run(controller, scenario) == []


def forms(field: Any) -> Iterator[tuple[int, list[Any]]]:
    """Yield every listed number, with all equivalent values."""
    if "enum" in field:
        table: Any = getattr(enumerations, camel(field["enumeration"]))
        for name, number in field["enum"].items():
            if name not in field.get("modifiers", ()):
                yield number, [table(number), name, name.lower(), name.title(), np.int64(number)]
                for more in field.get("modifiers", ()):
                    both = number | field["enum"][more]
                    yield (
                        both,
                        [table[name] | table[more], f"{more}|{name}", f"{name} | {more}".lower()],
                    )
    else:
        bits: Any = getattr(flags, camel(field["flag_table"]))
        for name, number in field["flags"].items():
            yield number, [bits(number), name, name.upper(), np.int64(number)]
        whole = sum(field["flags"].values())
        yield whole, [bits(whole), "|".join(field["flags"]), " | ".join(field["flags"]).upper()]
        yield 0, [bits(0), np.int64(0)]


def camel(name: str) -> str:
    return "".join(word.capitalize() for word in name.split("_"))


METHODS = {
    (call.name, message_of(call).__name__, given.keyword): (call, given)
    for unit in units()
    for call, given in named(unit)
}
"""Each generated method and argument once, because classes of units share them."""


@pytest.mark.parametrize("side", SIDES, ids=repr)
@pytest.mark.parametrize("key", METHODS, ids="-".join)
def test_members_names_and_integers_send_the_same_bytes(
    key: tuple[str, str, str], side: Side
) -> None:
    call, given = METHODS[key]
    field = field_of(call, given)
    others = arguments(call, random.Random(5))

    def bytes_of(value: Any) -> bytes:
        controller = Parrot(seed=4)

        async def scenario(bench: Any) -> None:
            async with bench.open(call.unit, **OPTIONS, **rating(call.unit)) as device:
                controller.heard.clear()
                try:
                    limit = {} if call.kind == "_start" else {"timeout": 0.01}
                    arguments = {**others, given.keyword: value, **limit}
                    await settled(method(device, call)(**arguments))
                except StagewireError:  # the controller reports no end
                    assert call.kind in MOVING

        side.run(controller, scenario)
        return controller.raw

    for number, same in forms(field):
        expected = bytes_of(number)
        assert expected
        for value in same:
            assert bytes_of(value) == expected, value


def _message_of(table: Any) -> str:
    """Return the message that a table sends with arguments."""
    cls = next(filter(None, (getattr(table, name, None) for name in ("message", "set", "req"))))
    return str(cls.layout.message)


def test_the_choice_tests_cover_every_table_of_the_registry() -> None:
    """The tests above use each enumeration and flag table that a caller can pass to these units."""
    unsent = {entry["name"] for entry in registry()["messages"] if "not_sent" in entry}
    known = {message for unit in units() for message in facts_of(unit)["messages"]} - unsent
    seen = {given.choices for unit in units() for _, given in named(unit)}
    entries = [
        given
        for table in vars(tables).values()
        if dataclasses.is_dataclass(table) and not isinstance(table, type)
        for name in ("given", "asked")
        if _message_of(table) in known
        for given in getattr(table, name, ())
        if given.choices is not None
    ]
    assert seen == {given.choices for given in entries}
    assert {given.choices.__name__ for given in entries if given.open} >= {
        "OutputMaxVoltsFlags",
        "StageAxis",
    }
    assert sum(issubclass(given.choices, Flags) for given in entries) >= 5
