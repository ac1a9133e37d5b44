"""pylablib drives virtual inertial motors, piezos and quadrant detectors by TCP."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any

from pylablib_drives_virtual import address
from results import Results
from watched import on_tcp

import stagewire_virtual as virtual

KNOWN = {
    ("KIM101", "move_to while no channel is enabled"): (
        "it looks for its channel among the enabled channels, and raises if none is enabled"
    ),
    ("TIM101", "get_enabled_channels"): ("it asks for the enabled channels of a KIM101 (page 394)"),
    ("TPZ001", "get_status"): "it asks for 0x0660, which the list of the TPZ001 omits",
    ("TPZ001", "enable_channel"): "it asks for 0x0660, which the list of the TPZ001 omits",
    ("TPZ001", "is enabled"): "it asks for 0x0660, which the list of the TPZ001 omits",
    ("TPZ001", "is disabled"): "it asks for 0x0660, which the list of the TPZ001 omits",
    ("KPZ101", "is enabled"): "it reads bit 31, which the table of the KPZ101 omits (page 206)",
}
"""Unit and call -> why it fails."""


def expect(results: Results, unit: str, what: str, holds: bool, detail: str) -> None:
    """Record an expectation of a unit."""
    if (unit, what) in KNOWN:
        results.known(unit, what, holds, KNOWN[unit, what])
    else:
        results.check(unit, what, holds, detail)


def calls(results: Results, unit: str) -> Callable[[str, Callable[[], Any]], Any]:
    """Return the function that makes a named call of a unit."""
    return lambda what, function: results.call(unit, what, function, KNOWN.get((unit, what), ""))


def step(results: Results, unit: str, motor: Any) -> None:
    """Move two channels of an inertial controller, jog one, and stop it."""
    call = calls(results, unit)
    cube = unit == "KIM101"

    def at(what: str, channel: int, steps: int) -> None:
        found = call("get_position", lambda: motor.get_position(channel=channel))
        expect(results, unit, what, found == steps, f"{found} of {steps} steps")

    for what in ("device_info", "enabled_channels", "status", "drive_parameters", "jog_parameters"):
        call(f"get_{what}", getattr(motor, f"get_{what}"))
    if cube:
        call("move_to while no channel is enabled", lambda: motor.move_to(200, channel=1))
    for channel in (3, 1):
        if cube:
            call("enable_channels", lambda channel=channel: motor.enable_channels(channel))
        else:  # its class has no call for this
            motor.send_comm(0x0210, 1 << channel - 1, 1)
        go = {"channel": channel, "auto_enable": cube}
        call("move_to", lambda go=go: motor.move_to(200, **go))
        call("wait_move", lambda channel=channel: motor.wait_move(channel=channel, timeout=20))
        at(f"reaches the target of move_to on channel {channel}", channel, 200)
    call("move_by", lambda: motor.move_by(-50, **go))
    call("wait_move", lambda: motor.wait_move(channel=1, timeout=20))
    at("reaches the target of move_by", 1, 150)
    call("setup_jog", lambda: motor.setup_jog(mode="step", step_size_fw=30, channel=1))
    call("jog", lambda: motor.jog("+", kind="builtin", **go))
    call("wait_move", lambda: motor.wait_move(channel=1, timeout=20))
    at("jogs forward", 1, 180)
    call("move_to", lambda: motor.move_to(1_000_000, **go))
    call("stop", lambda: motor.stop(channel=1))
    found = call("get_position", lambda: motor.get_position(channel=1))
    expect(results, unit, "stops", found is not None and 180 <= found < 1_000_000, f"{found} steps")
    drive = call("setup_drive", lambda: motor.setup_drive(velocity=400, channel=1))
    expect(results, unit, "keeps its drive rate", drive and drive.velocity == 400, f"{drive}")
    call("set_position_reference", lambda: motor.set_position_reference(0, channel=1))
    at("is at 0 after set_position_reference", 1, 0)


def drive(results: Results, unit: str, piezo: Any) -> None:
    """Enable the output of a piezo, and set its voltage and its range."""
    call = calls(results, unit)

    for what in ("device_info", "status", "voltage_range", "voltage_source", "output_voltage"):
        call(f"get_{what}", getattr(piezo, f"get_{what}"))
    enabled = call("enable_channel", piezo.enable_channel)
    expect(results, unit, "is enabled", enabled is True, f"{enabled}")
    source = call("set_voltage_source", lambda: piezo.set_voltage_source("software"))
    expect(results, unit, "has a source", source == ["software"], f"{source}")
    for span in (150, 75):
        found = call("set_voltage_range", lambda span=span: piezo.set_voltage_range(span))
        expect(results, unit, f"has a range of {span} V", found == span, f"{found}")
        volts = call("set_output_voltage", lambda: piezo.set_output_voltage(30))
        near = volts is not None and abs(volts - 30) < 0.1
        expect(results, unit, f"has 30 V in a range of {span} V", near, f"{volts} V")
        call("set_output_voltage", lambda: piezo.set_output_voltage(0))
    enabled = call("enable_channel", lambda: piezo.enable_channel(False))
    expect(results, unit, "is disabled", enabled is False, f"{enabled}")


def sense(results: Results, unit: str, detector: Any) -> None:
    """Read a detector, and set its mode, gains and outputs."""
    call = calls(results, unit)

    for what in ("device_info", "pid_parameters", "output_parameters", "readings"):
        call(f"get_{what}", getattr(detector, f"get_{what}"))
    found = call("set_pid_parameters", lambda: detector.set_pid_parameters(p=0.5))
    expect(results, unit, "keeps its gain", found and abs(found.p - 0.5) < 1e-3, f"{found}")
    for mode in ("monitor", "closed_loop", "open_loop"):
        found = call("set_operation_mode", lambda mode=mode: detector.set_operation_mode(mode))
        expect(results, unit, f"is in mode {mode}", found == mode, f"{found}")
    found = call("set_manual_output", lambda: detector.set_manual_output(xpos=2, ypos=3))
    expect(results, unit, "keeps its outputs", found and abs(found.ypos - 3) < 1e-2, f"{found}")


UNITS: dict[str, tuple[str, Callable[[Results, str, Any], None]]] = {
    "KIM101": ("KinesisPiezoMotor", step),
    "TIM101": ("KinesisPiezoMotor", step),
    "KPZ101": ("KinesisPiezoController", drive),
    "TPZ001": ("KinesisPiezoController", drive),
    "KPA101": ("KinesisQuadDetector", sense),
    "TPA101": ("KinesisQuadDetector", sense),
    "TQD001": ("KinesisQuadDetector", sense),
}
"""Unit -> the class of pylablib for it, and the calls."""


def main() -> None:
    """Drive all units."""
    results = Results("pylablib-lightweight")
    if results.installed:
        from pylablib.devices.Thorlabs import kinesis

        warnings.simplefilter("ignore")  # pylablib warns that it cannot set RTS by TCP
        for unit, (name, use) in UNITS.items():
            with on_tcp(getattr(virtual, unit)()) as watched:
                opened = results.call(
                    unit, "open", lambda name=name: getattr(kinesis, name)(address(watched))
                )
                if opened is not None:
                    use(results, unit, opened)
                    results.call(unit, "close", opened.close)
    results.finish()


if __name__ == "__main__":
    main()
