"""Checks declared with the decorator: their cases, ids and texts."""

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
    """Yield two cases; the second changes everything that a case may change."""
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
        """Do nothing."""

    return plan(DECLARED, allowed, kinds=[kind])


def test_each_case_makes_a_check_with_its_changes() -> None:
    one, two = declared_checks("It looks at {place.name}")
    assert [one.id, two.id] == ["made/one/last", "made/two/last"]
    assert [one.title, two.title] == ["It looks at 0x11", "It looks at 0x21"]
    assert one.messages == two.messages == ("MOD_IDENTIFY",)
    assert (one.needs, two.needs) == ({Need.MOTION}, {Need.MOTION, Need.SETTINGS})
    assert (one.seconds, one.skip, one.lacks) == (Check.seconds, "", "")
    assert (two.seconds, two.skip, two.lacks) == (3.0, "not claimed", "out of range")
    assert two.rules == ("velocity-parameters",)


def test_texts_name_the_allowed_range() -> None:
    allowed = Permissions(motion=Range.parse("0..5mm"))
    assert (
        declared_checks("It moves", allowed, "moves within {range}")[0].does
        == "moves within 0..5mm"
    )
    assert declared_checks("It moves", does="within {range}")[0].does == "within the allowed range"


@pytest.mark.parametrize("title", ["It {verb}", "At {place.nowhere}", "An open {brace", "The {}"])
def test_a_title_with_unknown_names_is_an_error(title: str) -> None:
    with pytest.raises(ValueError, match=r"a check of the kind made: cannot fill in") as caught:
        declared_checks(title)
    assert "which has range, place" in str(caught.value)


def nothing(trial: Trial) -> None:
    """Do nothing."""


async def later(trial: Trial) -> None:
    """Do nothing, asynchronously."""


def parts(trial: Trial) -> Iterator[None]:
    """Do nothing, as a generator."""
    yield


@pytest.mark.parametrize(
    ("options", "function", "said"),
    [
        ({"messages": "MOD_IDENTIFY"}, nothing, r"messages must be a tuple, such as \('MOD_IDENTIFY',\)"),
        ({"rules": "velocity-parameters"}, nothing, "rules must be a tuple"),
        ({"needs": "motion"}, nothing, "needs must be a tuple"),
        ({"needs": ("motion",)}, nothing, "unknown need 'motion' .choose from Need.SETTINGS"),
        ({}, later, "later must be a plain function, without async or yield"),
        ({}, parts, "parts must be a plain function"),
        ({"each": lambda declared, allowed: ["one"]}, nothing, "each yields 'one', which is not a Case"),
        (
            {"each": lambda declared, allowed: [Case(arguments={"axis": 1})]},
            nothing,
            r"arguments of its case \(axis\): got an unexpected keyword argument 'axis'",
        ),
        ({"each": lambda declared, allowed: [Case(messages="X")]}, nothing, "messages must be a tuple"),
    ],
)  # fmt: skip
def test_an_invalid_declaration_is_an_error_that_names_the_kind(
    options: dict[str, Any], function: Any, said: str
) -> None:
    kind = Kind(name="made", title="Made for a test")

    def declare_and_plan() -> None:
        kind.check("It looks", **options)(function)
        plan(DECLARED, NOTHING, kinds=[kind])

    with pytest.raises(TypeError, match=f"^a check of the kind made: .*{said}"):
        declare_and_plan()


def test_a_declaration_without_a_title_is_an_error() -> None:
    with pytest.raises(TypeError, match="the kind made: missing title"):
        Kind(name="made", title="Made for a test").check(nothing)  # type: ignore[arg-type]


def test_rules_of_a_kind_must_be_a_tuple() -> None:
    with pytest.raises(TypeError, match="the kind made: rules must be a tuple"):
        Kind(name="made", title="Made for a test", rules="no-padding")  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({}, "duplicate check id made: give the cases different names"),
        (
            {"messages": ("MOT_NOTHING",)},
            "check made: unknown message 'MOT_NOTHING'",
        ),
        ({"rules": ("no-such-rule",)}, "check made: unknown rule 'no-such-rule'"),
    ],
)
def test_a_plan_refuses_duplicate_ids_and_unknown_names(options: dict[str, Any], said: str) -> None:
    kind = Kind(name="made", title="Made for a test")
    for _ in range(2):
        kind.check("It looks", **options)(nothing)
    with pytest.raises(ValueError, match=said):
        Plan.of("BSC102", NOTHING, kinds=[kind])


def test_a_single_pattern_may_be_a_string() -> None:
    ids = [check.id for check in Plan.of("BSC102", NOTHING, only="identify*").checks]
    assert ids == [check.id for check in Plan.of("BSC102", NOTHING, only=["identify*"]).checks]
    assert ids
