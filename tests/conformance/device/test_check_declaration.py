"""Checks that a decorator declares: their cases, ids and texts."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from stagewire_conformance.device.check import Case, Check, Kind
from stagewire_conformance.device.declaration import Declaration, declare
from stagewire_conformance.device.permissions import Need, Permissions, Range
from stagewire_conformance.device.plans import Plan, plan
from stagewire_conformance.device.trial import Trial

DECLARED = declare("BSC102")
NOTHING = Permissions()


def two(declared: Declaration, allowed: Permissions) -> Iterator[Case]:
    """Give two cases; the second one differs in all that a case may change."""
    yield Case(name="one", arguments={"place": declared.places[0]}, messages=("MOD_IDENTIFY",))
    yield Case(
        name="two",
        arguments={"place": declared.places[1]},
        words={"verb": "asks"},
        needs=frozenset({Need.SETTINGS}),
        rules=("velocity-parameters",),
        seconds=3.0,
        skip="not claimed",
        lacks="out of range",
    )


def declared_checks(title: str, allowed: Permissions = NOTHING, does: str = "") -> list[Check]:
    """Return the checks of a kind with one function that is declared for two cases."""
    kind = Kind(name="made", title="Made for a test")

    @kind.check(
        title, messages=("MOD_IDENTIFY",), needs={Need.MOTION}, does=does, name="last", each=two
    )
    def look(trial: Trial, place: object) -> None:
        """Look at nothing."""

    return plan(DECLARED, allowed, kinds=[kind])


def test_each_case_makes_a_check_with_what_it_changes() -> None:
    one, two = declared_checks("It looks at {place.name}")
    assert [one.id, two.id] == ["made/one/last", "made/two/last"]
    assert [one.title, two.title] == ["It looks at 0x11", "It looks at 0x21"]
    assert one.messages == two.messages == ("MOD_IDENTIFY",)
    assert (one.needs, two.needs) == ({Need.MOTION}, {Need.MOTION, Need.SETTINGS})
    assert (one.seconds, one.skip, one.lacks) == (0.1, "", "")
    assert (two.seconds, two.skip, two.lacks) == (3.0, "not claimed", "out of range")
    assert two.rules == ("velocity-parameters",)


def test_texts_name_the_range_that_was_allowed() -> None:
    allowed = Permissions(motion=Range.parse("0..5mm"))
    assert (
        declared_checks("It moves", allowed, "moves within {range}")[0].does
        == "moves within 0..5mm"
    )
    assert (
        declared_checks("It moves", does="within {range}")[0].does
        == "within the range that is allowed"
    )


@pytest.mark.parametrize("title", ["It {verb}", "At {place.nowhere}", "An open {brace", "The {}"])
def test_a_title_that_its_case_cannot_fill_in_is_an_error(title: str) -> None:
    with pytest.raises(
        ValueError, match=r"a check of the kind made: .* cannot be filled in"
    ) as caught:
        declared_checks(title)
    assert "which has range, place" in str(caught.value)


def nothing(trial: Trial) -> None:
    """Look at nothing."""


async def later(trial: Trial) -> None:
    """Look at nothing, later."""


def parts(trial: Trial) -> Iterator[None]:
    """Look at nothing, part by part."""
    yield


@pytest.mark.parametrize(
    ("options", "function", "said"),
    [
        ({"messages": "MOD_IDENTIFY"}, nothing, r"messages is a tuple, such as \('MOD_IDENTIFY',\)"),
        ({"rules": "velocity-parameters"}, nothing, "rules is a tuple"),
        ({"needs": "motion"}, nothing, "needs is a tuple"),
        ({"needs": ("motion",)}, nothing, "needs has 'motion', and takes Need.SETTINGS"),
        ({}, later, "later is a plain function, without async and yield"),
        ({}, parts, "parts is a plain function"),
        ({"each": lambda declared, allowed: ["one"]}, nothing, "each gives 'one', which is not a Case"),
        (
            {"each": lambda declared, allowed: [Case(arguments={"axis": 1})]},
            nothing,
            r"arguments of its case \(axis\): got an unexpected keyword argument 'axis'",
        ),
        ({"each": lambda declared, allowed: [Case(messages="X")]}, nothing, "messages is a tuple"),
    ],
)  # fmt: skip
def test_what_cannot_be_a_check_is_an_error_that_names_the_kind(
    options: dict[str, Any], function: Any, said: str
) -> None:
    kind = Kind(name="made", title="Made for a test")

    def declare_and_plan() -> None:
        kind.check("It looks", **options)(function)
        plan(DECLARED, NOTHING, kinds=[kind])

    with pytest.raises(TypeError, match=f"^a check of the kind made: .*{said}"):
        declare_and_plan()


def test_a_declaration_without_a_title_is_an_error() -> None:
    with pytest.raises(TypeError, match="the kind made: write a title"):
        Kind(name="made", title="Made for a test").check(nothing)  # type: ignore[arg-type]


def test_rules_of_a_kind_are_a_tuple() -> None:
    with pytest.raises(TypeError, match="the kind made: rules is a tuple"):
        Kind(name="made", title="Made for a test", rules="no-padding")  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({}, "two checks have the id made; give their cases different names"),
        (
            {"messages": ("MOT_NOTHING",)},
            "the check made: the registry has no message 'MOT_NOTHING'",
        ),
        ({"rules": ("no-such-rule",)}, "the check made: the registry has no rule 'no-such-rule'"),
    ],
)
def test_a_plan_refuses_checks_that_it_could_not_tell_apart_or_look_up(
    options: dict[str, Any], said: str
) -> None:
    kind = Kind(name="made", title="Made for a test")
    for _ in range(2):
        kind.check("It looks", **options)(nothing)
    with pytest.raises(ValueError, match=said):
        Plan.of("BSC102", NOTHING, kinds=[kind])


def test_one_pattern_may_be_given_as_a_text() -> None:
    ids = [check.id for check in Plan.of("BSC102", NOTHING, only="identify*").checks]
    assert ids == [check.id for check in Plan.of("BSC102", NOTHING, only=["identify*"]).checks]
    assert ids
