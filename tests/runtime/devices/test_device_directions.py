"""Jogs and velocity moves, without assuming that the position rises in direction 1."""

from __future__ import annotations

import re
from typing import Any

import pytest
from recording_link import RecordingLink

import stagewire_virtual as virtual
from checkout import ROOT
from stagewire.errors import LimitError
from stagewire_apt import TDC001, aio, devices, stages
from stagewire_apt.enumerations import MoveDirection
from stagewire_virtual import stepped

MM = 34304
STEP = MM // 10  # default of the controller
START, TRAVEL = 2 * MM, 5 * MM
FORWARD, REVERSE = MoveDirection.FORWARD, MoveDirection.REVERSE

ways = pytest.mark.parametrize(
    ("quirk", "direction", "way"),
    [
        ("", FORWARD, 1),
        ("", REVERSE, -1),
        ("clockwise_is_negative", FORWARD, -1),
        ("clockwise_is_negative", REVERSE, 1),
    ],
)


def controller(quirk: str) -> virtual.VirtualController:
    return virtual.TDC001(
        stage=stages.Z8, travel=TRAVEL, position=START, quirks=[quirk] if quirk else []
    )


def expected(way: int) -> list[int]:
    """Return where a jog ends, and where a velocity move to the end of the travel ends."""
    return [way * STEP, TRAVEL - START if way > 0 else -START]


@ways
def test_jogs_and_runs_for_threads(quirk: str, direction: MoveDirection, way: int) -> None:
    with TDC001.open(RecordingLink(controller(quirk)), stage="Z8") as tdc:
        ends = [tdc.jog(direction), tdc.move_velocity(direction)]
    assert [end.values.position for end in ends if end.values is not None] == expected(way)


@ways
def test_jogs_and_runs_for_asyncio(quirk: str, direction: MoveDirection, way: int) -> None:
    async def main() -> list[Any]:
        url = f"virtual://TDC001?stage=Z8&travel={TRAVEL}&position={START}"
        if quirk:
            url += f"&quirks={quirk}"
        async with aio.TDC001.open(url, stage="Z8") as tdc:
            return [await tdc.jog(direction), await tdc.move_velocity(direction)]

    ends = stepped.run(main())
    assert [end.values.position for end in ends] == expected(way)


@pytest.mark.parametrize("quirk", ["", "clockwise_is_negative"])
@pytest.mark.parametrize("direction", [FORWARD, REVERSE])
def test_a_jog_is_refused_only_if_both_directions_leave_the_travel(
    quirk: str, direction: MoveDirection
) -> None:
    line = RecordingLink(controller(quirk))
    with TDC001.open(line, stage="Z8", travel_mm=(0, "0.15")) as tdc:
        tdc.jog(direction)  # from 0 it may stay inside the travel or leave it
        tdc.set_pos_counter(mm="0.075")
        with pytest.raises(
            LimitError, match=r"jog: .* mm from the position 0\.075\d* mm is outside"
        ):
            tdc.jog(direction)


WARNING = "whether the position counter rises or falls in the direction FORWARD"


@pytest.mark.parametrize("package", [devices, aio])
@pytest.mark.parametrize("call", ["jog", "start_jog", "move_velocity", "start_move_velocity"])
def test_docstrings_warn_about_the_direction(package: Any, call: str) -> None:
    words = " ".join(getattr(package.TDC001, call).__doc__.split())
    assert WARNING in words
    assert "apt-clockwise-without-sign" in words


@pytest.mark.parametrize("message", ["MOT_MOVE_JOG", "MOT_MOVE_VELOCITY"])
def test_comments_in_c_warn_about_the_direction(message: str) -> None:
    header = (ROOT / "generated/c/stagewire_apt/messages/motor.h").read_text(encoding="utf-8")
    found = re.search(rf"/\*\*(?:(?!\*/).)*\n \* {message} \(.*?\*/", header, re.S)
    assert found is not None
    assert WARNING in " ".join(found[0].replace("\n * ", " ").split())
