"""Ctrl-C at every read: all locks are released, and the next reply is matched to its own request."""

from __future__ import annotations

from typing import Any

import pytest
from proof_controller import Parrot
from proof_interruptions import InterruptedLink

from stagewire_apt import TDC001
from stagewire_apt import messages as m

CALLS: dict[str, Any] = {
    "get": lambda tdc: tdc.get_vel_params(),
    "change": lambda tdc: tdc.change_vel_params(max_velocity=3),
    "set": lambda tdc: tdc.set_vel_params(min_velocity=0, acceleration=1, max_velocity=2),
}


@pytest.mark.parametrize("name", CALLS)
def test_the_device_works_after_an_interrupt_at_every_read(name: str) -> None:
    interrupted = 0
    for number in range(1, 20):
        controller = Parrot(seed=number)
        link = InterruptedLink(controller)
        with TDC001.open(link, identify=False, on_close="leave") as tdc:
            link.left = number
            try:
                CALLS[name](tdc)
            except KeyboardInterrupt:
                interrupted += 1
            link.left = 0
            for _ in range(2):
                controller.renew()
                values = tdc.get_vel_params()
                assert values.message == controller.state(m.MotGetVelParams, 0x50, 1)
    assert interrupted > 0 or name == "set"
