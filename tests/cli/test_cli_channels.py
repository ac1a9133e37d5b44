"""The command for units whose channels are enabled one at a time, paddles, and units that move nothing."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

import pytest
from attached_controller import URL, Written, attached

import stagewire_virtual as virtual

if TYPE_CHECKING:
    from conftest import Stagewire

STEPS = bytes.fromhex("d408")  # an absolute move of an inertial motor
STATE = bytes.fromhex("cb04")  # MOT_SET_SOL_STATE
MOVE = bytes.fromhex("5304")
HOME = bytes.fromhex("4304")
ENABLED = bytes.fromhex("c0080600d0012b00")  # PZMOT_SET_KCUBECHANENABLEMODE

Attach = Callable[[virtual.VirtualController], Written]


@pytest.fixture
def attach(monkeypatch: pytest.MonkeyPatch) -> Attach:
    return partial(attached, monkeypatch)


@pytest.mark.parametrize("unit", ["KSC101", "TSC001"])
@pytest.mark.parametrize(
    "words", [("--counts", "--to", "1"), ("--counts", "--by", "1"), ("--to", "1")]
)
def test_a_move_does_not_open_a_shutter(
    stagewire: Stagewire, attach: Attach, unit: str, words: tuple[str, ...]
) -> None:
    with getattr(virtual, unit)() as shutter:
        line = attach(shutter)
        result = stagewire("move", URL, "--unit", unit, *words, "--yes")
    assert result.code == 2
    assert "does not support move" in result.err
    assert line.count(STATE) == line.count(MOVE) == 0


def test_enable_is_refused_for_a_unit_without_channels_to_enable(
    stagewire: Stagewire, attach: Attach
) -> None:
    with virtual.MLJ050() as jack:
        line = attach(jack)
        result = stagewire("home", URL, "--unit", "MLJ050", "--enable", "--yes")
    assert result.code == 2
    assert "no motor channel that can be enabled" in result.err
    assert line.count(HOME) == 0
