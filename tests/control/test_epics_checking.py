"""The check of a move of a motor record, case by case."""

from __future__ import annotations

import pytest

from stagewire_bluesky.checking import Arrival, Check, MoveFailedError


@pytest.mark.parametrize(
    ("check", "arrival"),
    [
        (Check(), Arrival(3.009, 0, "mm")),
        (Check(), Arrival(3.05, 0, "deg")),
        (Check(), Arrival(3.2, 0, "mm", deadband=0.3)),
        (Check(tolerance=1), Arrival(2.1, 0, "mm")),
        (Check(tolerated=1), Arrival(3.0, 1, "mm")),
        (Check(), Arrival(3.0, 0)),
    ],
)
def test_a_move_that_ended_at_its_target_passes(check: Check, arrival: Arrival) -> None:
    check.reached("x", 3.0, arrival)


@pytest.mark.parametrize(
    ("check", "arrival", "text"),
    [
        (Check(), Arrival(3.02, 0, "mm", deadband=0.001), "not end within 0.01 mm of its target"),
        (Check(), Arrival(3.2, 0, "furlong", deadband=0.1), "not end within 0.1 furlong"),
        (Check(tolerance=0.001), Arrival(3.005, 0, "mm"), "not end within 0.001 mm"),
        (Check(), Arrival(float("nan"), 0, "mm"), "not end within"),
        (
            Check(),
            Arrival(3.0, 1, "mm"),
            "ended with an alarm: RBV is 3 mm with the severity MINOR",
        ),
        (Check(tolerated=1), Arrival(3.0, 2, "mm"), "the severity MAJOR"),
        (Check(tolerated=3), Arrival(3.0, 3, "mm"), "the position is not known"),
        (Check(), Arrival(3.0, 0, "mm", moving=True), "the axis still moves"),
    ],
)
def test_any_other_end_fails(check: Check, arrival: Arrival, text: str) -> None:
    with pytest.raises(MoveFailedError, match=text):
        check.reached("x", 3.0, arrival)


def test_homing_has_no_target_but_an_alarm() -> None:
    Check().reached("x", None, Arrival(7.0, 0, "mm"))
    with pytest.raises(MoveFailedError, match="homing ended with an alarm"):
        Check().reached("x", None, Arrival(7.0, 1, "mm"))
