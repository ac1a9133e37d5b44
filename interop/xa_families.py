"""Calls of the vendor's XA SDK for shutters, piezos, inertial motors and NanoTraks.

Each function uses a device and keeps outcomes whose names begin with ``DOES``; their value is whether the
device did what the rest of the name says.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any, Protocol

from thorlabs_xa.shared import enums as e

DOES = "does: "
"""The beginning of the name of an outcome that is true or false."""
LONGEST = 5000
"""The longest wait for an answer, in ms."""
MOVE_LONGEST = 20_000
"""The longest wait for the end of a motion, in ms."""


class Session(Protocol):
    """The part of the client's session that these functions use."""

    def call(self, what: str, function: Callable[[], Any]) -> Any:
        """Call a function and keep its outcome."""


def use(session: Session, device: Any) -> None:
    """Use a device by what its class can do."""
    if hasattr(device, "set_solenoid_state"):
        _shutter(session, device)
    elif hasattr(device, "set_nano_trak_mode"):
        _tracker(session, device)
    elif hasattr(device, "set_output_voltage"):
        _piezo(session, device)
    elif hasattr(device, "set_kcube_channel_enable"):
        _inertial(session, device)
    elif hasattr(device, "get_stage_axis_params") and not hasattr(device, "get_home_params"):
        _inertial_stage(session, device)


def _until(holds: Callable[[], bool], seconds: float = 5) -> bool:
    """Return whether something holds within a time."""
    end = time.monotonic() + seconds
    while not holds():
        if time.monotonic() > end:
            return False
        time.sleep(0.05)
    return True


def _shutter(session: Session, device: Any) -> None:
    """Open and close a shutter by hand, and let it make two cycles."""
    mode, state = e.TLMC_SolenoidOperatingMode, e.TLMC_SolenoidState
    manual = mode.TLMC_SOL_OperatingMode_SolenoidManual
    on, off = state.TLMC_SolenoidState_On, state.TLMC_SolenoidState_Off

    def shown(wanted: Any) -> bool:
        return _until(lambda: device.get_solenoid_state(LONGEST) == wanted)

    device.set_solenoid_operating_mode(manual)
    device.set_solenoid_state(on)
    session.call(f"{DOES}opens the shutter", lambda: shown(on))
    device.set_solenoid_state(off)
    session.call(f"{DOES}closes the shutter", lambda: shown(off))
    params = device.get_solenoid_cycle_params(LONGEST)
    params.on_time, params.off_time, params.number_of_cycles = 200, 200, 2
    device.set_solenoid_cycle_params(params)
    device.set_solenoid_operating_mode(mode.TLMC_SOL_OperatingMode_SolenoidAuto)
    device.set_solenoid_state(on)
    session.call(f"{DOES}begins cycles", lambda: shown(on))
    time.sleep(1)
    session.call(f"{DOES}ends cycles", lambda: shown(off))


def _piezo(session: Session, device: Any) -> None:
    """Set a voltage in open loop, and a position in closed loop."""
    mode = e.TLMC_PZ_PositionControlMode
    open_loop = mode.TLMC_PZ_PositionControlMode_OpenLoop
    closed_loop = mode.TLMC_PZ_PositionControlMode_ClosedLoop
    target = 8000  # a quarter of the range

    def near(read: Callable[[int], int]) -> bool:
        return _until(lambda: abs(read(LONGEST) - target) < 100)

    device.set_enable_state(e.TLMC_EnableState.TLMC_Enabled)
    device.set_position_control_mode(open_loop, LONGEST)
    device.set_output_voltage(target)
    session.call(f"{DOES}sets a voltage", lambda: near(device.get_output_voltage))
    device.set_output_voltage(0)
    device.set_position_control_mode(closed_loop, LONGEST)
    device.set_position(target)
    session.call(f"{DOES}reaches a position", lambda: near(device.get_position))
    device.set_position(0)
    device.set_position_control_mode(open_loop, LONGEST)


def _inertial(session: Session, device: Any) -> None:
    """Move each channel by steps, jog it and stop it."""
    channels = list(device.get_all_subchannels()) if hasattr(device, "get_all_subchannels") else []
    for number, channel in enumerate(channels or [device], 1):
        mode = getattr(
            e.TLMC_PZIM_KcubeChannelEnableMode,
            f"TLMC_PZIM_KcubeChannelEnableMode_Channel{number}",
        )
        device.set_kcube_channel_enable(mode)
        _steps(session, channel, f" on channel {number}" if channels else "")


def _steps(session: Session, channel: Any, where: str) -> None:
    mode = e.TLMC_MoveMode

    def position() -> int:
        found: int = channel.get_position_counts(LONGEST).position
        return found

    def arrives(kind: Any, number: int, wanted: Callable[[int], bool]) -> bool:
        channel.move(kind, number, MOVE_LONGEST)
        return _until(lambda: wanted(position()))

    start = position()
    session.call(
        f"{DOES}moves to a position{where}",
        lambda: arrives(mode.TLMC_MoveMode_Absolute, start + 200, lambda now: now == start + 200),
    )
    session.call(
        f"{DOES}jogs{where}",
        lambda: arrives(mode.TLMC_MoveMode_JogForward, 0, lambda now: now > start + 200),
    )

    def stops() -> bool:
        channel.move(mode.TLMC_MoveMode_Absolute, start + 1_000_000, 0)
        time.sleep(0.3)
        channel.stop(e.TLMC_StopMode.TLMC_StopMode_Immediate, MOVE_LONGEST)
        time.sleep(0.2)
        first = position()
        time.sleep(0.5)
        return position() == first < start + 1_000_000

    session.call(f"{DOES}stops{where}", stops)


def _inertial_stage(session: Session, device: Any) -> None:
    """Jog a stage of inertial motors in open loop, and home and move it in closed loop.

    The library has no other moves for it.
    """
    mode, loops = e.TLMC_MoveMode, e.TLMC_PZ_PositionControlMode
    device.set_enable_state(e.TLMC_EnableState.TLMC_Enabled)
    device.set_position_control_mode(loops.TLMC_PZ_PositionControlMode_OpenLoop, LONGEST)

    def does(what: str, function: Callable[[], Any]) -> None:
        session.call(f"{DOES}{what}", lambda: function() is None)

    does("jogs", lambda: device.move(mode.TLMC_MoveMode_JogForward, 0, MOVE_LONGEST))
    device.set_position_control_mode(loops.TLMC_PZ_PositionControlMode_ClosedLoop, LONGEST)
    does("homes", lambda: device.home(60_000))
    does(
        "moves to its stored position",
        lambda: device.move(mode.TLMC_MoveMode_AbsoluteToProgrammedPosition, 0, MOVE_LONGEST),
    )
    does(
        "stops",
        lambda: device.stop(e.TLMC_StopMode.TLMC_StopMode_Immediate, MOVE_LONGEST),
    )


def _tracker(session: Session, device: Any) -> None:
    """Track, latch and move the circle home."""
    mode = e.TLMC_PZ_SetNanoTrakModeType
    latched = 2
    device.set_nano_trak_mode(mode.TLMC_PZ_SetNanoTrakModeType_TrackMode)
    session.call(f"{DOES}tracks", lambda: _until(lambda: _state(device) > latched))
    device.set_nano_trak_mode(mode.TLMC_PZ_SetNanoTrakModeType_LatchMode)
    session.call(f"{DOES}latches", lambda: _until(lambda: _state(device) == latched))
    session.call(
        f"{DOES}moves the circle home", lambda: device.nano_trak_circle_to_home_position() is None
    )


def _state(device: Any) -> int:
    """Return the state of a NanoTrak as a number; above 2, it tracks."""
    return int(device.get_nano_trak_mode(LONGEST).state)
