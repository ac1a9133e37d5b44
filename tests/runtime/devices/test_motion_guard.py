"""No move is sent while an earlier one may be under way, even after the line was lost."""

from __future__ import annotations

import pytest
from hypothesis import settings
from hypothesis.stateful import run_state_machine_as_test
from motion_guard import MACHINES, MotionGuard, limits


@pytest.mark.parametrize("examples", [50, pytest.param(200, marks=pytest.mark.matrix)])
@pytest.mark.parametrize("machine", MACHINES)
def test_no_move_is_sent_while_another_may_be_under_way(
    machine: type[MotionGuard], examples: int
) -> None:
    run_state_machine_as_test(machine, settings=settings(limits(examples), derandomize=True))
