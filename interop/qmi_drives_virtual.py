"""QMI drives a virtual K10CR1 and MFF101 on pseudo-terminals, with all calls of its two drivers."""

from __future__ import annotations

import time
from typing import Any

from results import Results
from watched import Watched, on_pty

import stagewire_virtual as virtual

UNREAD = (
    "it does not read MOT_MOVE_STOPPED (Issue 37, page 89) after a stop, and takes too long to skip it "
    "before the reply to its next request"
)


def rotate(results: Results, context: Any, watched: Watched) -> None:
    """Make the calls of the K10CR1."""
    from qmi.instruments.thorlabs.k10cr1 import Thorlabs_K10CR1

    mount = Thorlabs_K10CR1(context, "mount", f"serial:{watched.url}")

    def call(what: str, function: Any) -> Any:
        return results.call("K10CR1", what, function)

    def at(what: str, degrees: float) -> None:
        found = call("get_absolute_position", mount.get_absolute_position)
        near = found is not None and abs(found - degrees) < 1e-3
        results.check("K10CR1", what, near, f"{found} of {degrees} degrees")

    call("open", mount.open)
    for name in ("get_idn", "get_velocity", "get_acceleration", "get_backlash_distance"):
        call(name, getattr(mount, name))
    call("get_home_params", mount.get_home_params)
    call("get_chan_enable_state", mount.get_chan_enable_state)
    call("move_home", mount.move_home)
    call("wait_move_complete", lambda: mount.wait_move_complete(30))
    at("is at 0 after homing", 0)
    for name, degrees, end in (("move_absolute", 12.5, 12.5), ("move_relative", -2.5, 10)):
        call(name, lambda name=name, degrees=degrees: getattr(mount, name)(degrees))
        call("wait_move_complete", lambda: mount.wait_move_complete(30))
        at(f"reaches the target of {name}", end)
    call("set_velocity_params", lambda: mount.set_velocity_params(8, 5))
    velocity = call("get_velocity", mount.get_velocity)
    results.check("K10CR1", "keeps its velocity", abs(velocity - 8) < 1e-3, f"{velocity} degrees/s")
    mount.move_absolute(90)
    time.sleep(0.5)
    call("move_stop", mount.move_stop)
    time.sleep(0.5)
    results.call(
        "K10CR1",
        "get_absolute_position after a stop",
        mount.get_absolute_position,
        UNREAD,
        always=False,
    )
    call("get_motor_status", mount.get_motor_status)
    call("close", mount.close)


def flip(results: Results, context: Any, watched: Watched) -> None:
    """Make the calls of the MFF101."""
    from qmi.instruments.thorlabs.mff10x import Thorlabs_MFF10X

    flipper = Thorlabs_MFF10X(context, "flipper", f"serial:{watched.url}")
    results.call("MFF101", "open", flipper.open)
    results.call("MFF101", "get_idn", flipper.get_idn)
    for position in (2, 1):
        results.call(
            "MFF101", "move_mount", lambda position=position: flipper.move_mount(position, True)
        )
        found = results.call("MFF101", "get_position", flipper.get_position)
        results.check("MFF101", f"is at position {position}", found == position, f"{found}")
    results.call("MFF101", "close", flipper.close)


def main() -> None:
    """Drive both units."""
    results = Results("qmi")
    if results.installed:
        from qmi.core.context import QMI_Context

        context = QMI_Context("interop")
        with on_pty(virtual.K10CR1(serial_number=55000001)) as watched:
            rotate(results, context, watched)
        with on_pty(virtual.MFF101(serial_number=37000001)) as watched:
            flip(results, context, watched)
    results.finish()


if __name__ == "__main__":
    main()
