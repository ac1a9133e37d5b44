"""Calls of our device classes for inertial motors, piezos and NanoTraks, on the vendor's simulations."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any, Protocol

from stagewire.errors import MotionStoppedError


class Trial(Protocol):
    """The part of a trial that these functions use."""

    def expect(self, what: str, holds: bool, detail: str = "") -> None:
        """Record an expectation."""

    def call(self, what: str, function: Callable[[], Any]) -> Any:
        """Call a function, and expect that it raises no error of the library."""


def use(trial: Trial, device: Any) -> None:
    """Use a device by what its class can do."""
    if hasattr(device, "set_nt_mode"):
        _tracker(trial, device)
    elif hasattr(device, "set_output_volts"):
        _piezo(trial, device)
    elif hasattr(device, "set_kcube_chan_enable_mode"):
        _inertial(trial, device)
    elif hasattr(device, "move_start"):
        _inertial_stage(trial, device)


def _inertial(trial: Trial, device: Any) -> None:
    """Move, jog and stop the last channel."""
    four = hasattr(device, "channel")
    channel = device.channel(4) if four else device
    device.set_kcube_chan_enable_mode(mode="CHANNEL_4" if four else "CHANNEL_1")
    end = trial.call("moves to a position", lambda: channel.move_absolute(counts=200))
    position = end and end.values.abs_position
    trial.expect("is where it was sent", position == 200, f"{position} steps")
    trial.call("jogs", lambda: channel.jog("FORWARD"))
    motion = channel.start_move_absolute(counts=100_000)
    time.sleep(0.3)
    trial.call("stops", channel.stop)
    trial.expect("ends its stopped motion", *_stopped(motion))
    counted = trial.call("counts steps", lambda: channel.get_pos_counters().position)
    trial.expect("counter follows", counted not in (0, None), f"{counted} steps")


def _inertial_stage(trial: Trial, device: Any) -> None:
    """Home, move, jog and stop a stage in open loop and in closed loop."""

    def ends(what: str, function: Callable[[], Any], wanted: int) -> None:
        end = trial.call(what, function)
        position = end and end.values.abs_position
        trial.expect(f"{what}: is where it was sent", position == wanted, f"{position} counts")

    device.enable()
    for loop, name in (("OPEN_LOOP", "open"), ("CLOSED_LOOP", "closed")):
        device.set_pos_control_mode(mode=loop)
        trial.call(f"homes in {name} loop", device.home)
        trial.expect(f"is homed in {name} loop", device.is_homed())
        device.change_open_move_params(step_size=3000)
        device.change_close_move_params(position=3000)
        ends(f"moves in {name} loop", device.move_start, 3000)
        trial.call(f"jogs in {name} loop", lambda: device.jog("FORWARD"))
    trial.call("stops", device.stop)


def _piezo(trial: Trial, device: Any) -> None:
    """Set a voltage in open loop, and a position in closed loop."""
    device.set_chan_enable_state(enable_state="ENABLE")
    device.set_pos_control_mode(mode="OPEN_LOOP")
    device.set_output_volts(voltage=8000)
    _reaches(trial, "sets a voltage", lambda: device.get_output_volts().voltage)
    device.set_output_volts(voltage=0)
    device.set_pos_control_mode(mode="CLOSED_LOOP")
    device.set_output_pos(position_sw=8000)
    _reaches(trial, "reaches a position", lambda: device.get_output_pos().position_sw)
    device.set_output_pos(position_sw=0)


def _tracker(trial: Trial, device: Any) -> None:
    """Latch, and read the circle."""
    device.set_nt_mode("LATCH")
    mode = trial.call("latches", device.get_nt_mode)
    trial.expect("is latched", mode is not None and mode.state.name == "LATCH", f"{mode}")
    status = trial.call("reads its circle", device.channel(1).get_nt_status_update)
    trial.expect("has a signal", status is not None and status.abs_reading >= 0, f"{status}")


def _reaches(trial: Trial, what: str, read: Callable[[], int]) -> None:
    """Expect a value near 8000 within five seconds."""
    end, found = time.monotonic() + 5, 0
    while time.monotonic() < end and abs(found - 8000) > 100:
        time.sleep(0.05)
        found = read()
    trial.expect(what, abs(found - 8000) <= 100, f"{found} of 8000 counts")


def _stopped(motion: Any) -> tuple[bool, str]:
    """Return whether a motion ended by a stop, and otherwise how."""
    try:
        return False, f"it reached {motion.wait(5)}"
    except MotionStoppedError:
        return True, ""
