"""QMI drives a virtual K10CR1, MFF101 and MPC320 on pseudo-terminals, with the calls of its drivers."""

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


def turn(results: Results, context: Any, watched: Watched) -> None:
    """Make the calls of the MPC320: home and move each paddle, and jog the last one."""
    from qmi.instruments.thorlabs.mpc320 import Thorlabs_Mpc320

    paddles = Thorlabs_Mpc320(context, "paddles", f"serial:{watched.url}")

    def call(what: str, function: Any) -> Any:
        return results.call("MPC320", what, function)

    def at(what: str, number: int, degrees: float) -> None:
        end = time.monotonic() + 10
        found = None
        while time.monotonic() < end and (found is None or abs(found - degrees) > 0.2):
            time.sleep(0.2)
            found = paddles.get_status_update(number).position
        results.check("MPC320", what, abs(found - degrees) < 0.2, f"{found} of {degrees} degrees")

    call("open", paddles.open)
    call("get_idn", paddles.get_idn)
    call("enable_channels", lambda: paddles.enable_channels([1, 2, 3]))
    for number in (1, 2, 3):
        state = call("get_channel_state", lambda number=number: paddles.get_channel_state(number))
        results.check("MPC320", f"paddle {number} is enabled", state and state.name == "ENABLE")
        call("home_channel", lambda number=number: paddles.home_channel(number))
        at(f"paddle {number} is at 0 after homing", number, 0)
        call("move_absolute", lambda number=number: paddles.move_absolute(number, 40 * number))
        at(f"paddle {number} reaches its target", number, 40 * number)
    call(
        "set_polarisation_parameters", lambda: paddles.set_polarisation_parameters(50, 0, 5, 5, 10)
    )
    found = call("get_polarisation_parameters", paddles.get_polarisation_parameters)
    kept = found is not None and found.velocity == 50 and abs(found.jog_step3 - 10) < 0.2
    results.check("MPC320", "keeps its parameters", kept, f"{found}")
    call("jog", lambda: paddles.jog(3))
    at("paddle 3 jogs forward", 3, 130)
    call("disable_all_channels", paddles.disable_all_channels)
    state = call("get_channel_state", lambda: paddles.get_channel_state(3))
    results.check("MPC320", "paddle 3 is disabled", state and state.name == "DISABLE")
    call("close", paddles.close)


def main() -> None:
    """Drive the three units."""
    results = Results("qmi")
    if results.installed:
        from qmi.core.context import QMI_Context

        context = QMI_Context("interop")
        with on_pty(virtual.K10CR1(serial_number=55000001)) as watched:
            rotate(results, context, watched)
        with on_pty(virtual.MFF101(serial_number=37000001)) as watched:
            flip(results, context, watched)
        with on_pty(virtual.MPC320(serial_number=38000001)) as watched:
            turn(results, context, watched)
    results.finish()


if __name__ == "__main__":
    main()
