"""No move is sent while an earlier one may be under way, whatever becomes of the line in between."""

from __future__ import annotations

import pytest
from hypothesis import settings
from hypothesis.stateful import run_state_machine_as_test
from motion_guard import MACHINES, MotionGuard, limits


@pytest.mark.parametrize("machine", MACHINES)
def test_no_move_overtakes_another(machine: type[MotionGuard]) -> None:
    run_state_machine_as_test(machine, settings=settings(limits(200), derandomize=True))
