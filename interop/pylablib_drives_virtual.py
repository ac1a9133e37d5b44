"""pylablib drives the virtual motor controllers and flippers by TCP, with the calls of its two classes.

A pseudo-terminal refuses the RTS line that pylablib sets on a serial port, so it connects by TCP.
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from results import Results
from watched import Watched, on_tcp

import stagewire_virtual as virtual
from stagewire_apt import stages

TOO_SHORT = (
    "it sends 10 bytes and ignores the rest; the document prints a length of 12 and a table of 22 "
    "(Issue 37, page 140), so the setting does not change"
)
NO_DIRECTION = (
    "it accepts only 1 and 2 as home direction; the virtual controller reports the 0 of a field that is not "
    "used (Issue 37, page 77)"
)


@dataclass(frozen=True)
class Case:
    """A virtual controller for the class of motors.

    :param unit: the unit.
    :param counts: the target of a move.
    :param stage: its stage; empty for a built-in one.
    :param rack: whether its channels are bays.
    :param known: call -> why it fails.
    """

    unit: str
    counts: int
    stage: str = ""
    rack: bool = False
    known: Mapping[str, str] = field(default_factory=dict)


CUBE = {"setup_kcube_trigio": TOO_SHORT}
BRUSHLESS = dict.fromkeys(("get_homing_parameters",), NO_DIRECTION)

CASES = (
    Case("KDC101", 20000, "Z825B", known=CUBE),
    Case("TDC001", 20000, "Z8"),
    Case("KST101", 400000, "ZST225B", known=CUBE),
    Case("K10CR1", 400000),
    Case("LTS300", 400000),
    Case("BSC203", 400000, "NRT100", rack=True),
    Case("BBD202", 40000, "MLS203", rack=True, known=BRUSHLESS),
    Case("KBD101", 40000, "DDS100", known=CUBE | BRUSHLESS),
)


def address(watched: Watched) -> tuple[str, tuple[str, int]]:
    """Return the connection of pylablib for a served controller."""
    host, port = watched.url.removeprefix("socket://").split(":")
    return "network", (host, int(port))


def move(results: Results, case: Case, watched: Watched) -> None:
    """Make the calls of a motor."""
    from pylablib.devices.Thorlabs.kinesis import KinesisMotor

    def call(what: str, function: Any) -> Any:
        return results.call(case.unit, what, function, case.known.get(what, ""))

    def at(what: str, counts: int) -> None:
        found = call("get_position", motor.get_position)
        near = found is not None and abs(found - counts) < 5
        results.check(case.unit, what, near, f"{found} of {counts} counts")

    motor = call("open", lambda: KinesisMotor(address(watched), "step", is_rack_system=case.rack))
    if motor is None:
        return
    for what in ("device_info", "status", "velocity_parameters", "jog_parameters"):
        call(f"get_{what}", getattr(motor, f"get_{what}"))
    for what in ("homing_parameters", "gen_move_parameters", "limit_switch_parameters"):
        call(f"get_{what}", getattr(motor, f"get_{what}"))
    call("home", motor.home)
    call("wait_for_home", lambda: motor.wait_for_home(timeout=60))
    at("is at 0 after homing", 0)
    for name, counts, end in (
        ("move_to", case.counts, case.counts),
        ("move_by", -case.counts // 4, case.counts * 3 // 4),
    ):
        call(name, lambda name=name, counts=counts: getattr(motor, name)(counts))
        call("wait_move", lambda: motor.wait_move(timeout=60))
        at(f"reaches the target of {name}", end)
    call("jog", lambda: motor.jog("+"))
    time.sleep(0.3)
    call("stop", motor.stop)
    call("setup_velocity", lambda: motor.setup_velocity(max_velocity=case.counts / 2))
    call("setup_jog", lambda: motor.setup_jog(step_size=case.counts // 10))
    call("setup_gen_move", lambda: motor.setup_gen_move(backlash_distance=100))
    found = call("get_gen_move_parameters", motor.get_gen_move_parameters)
    kept = found is not None and found.backlash_distance == 100
    results.check(case.unit, "keeps its backlash distance", kept, f"{found}")
    if case.unit.startswith("K") and case.unit != "K10CR1":
        trigger(results, case, motor)
    call("close", motor.close)


def trigger(results: Results, case: Case, motor: Any) -> None:
    """Read and change the connectors of a K-Cube."""
    results.call(case.unit, "get_kcube_trigio_parameters", motor.get_kcube_trigio_parameters)
    motor.setup_kcube_trigio(trig1_mode="in_gpio")
    changed = motor.get_kcube_trigio_parameters().trig1_mode == "in_gpio"
    results.known(case.unit, "setup_kcube_trigio", changed, case.known["setup_kcube_trigio"])
    results.call(case.unit, "get_kcube_trigpos_parameters", motor.get_kcube_trigpos_parameters)


def flip(results: Results, watched: Watched) -> None:
    """Make the calls of a flipper."""
    from pylablib.devices.Thorlabs.kinesis import MFF

    flipper = results.call("MFF101", "open", lambda: MFF(address(watched)))
    if flipper is None:
        return
    results.call("MFF101", "get_device_info", flipper.get_device_info)
    for state in (1, 0):
        results.call("MFF101", "move_to_state", lambda state=state: flipper.move_to_state(state))
        time.sleep(1)
        found = results.call("MFF101", "get_state", flipper.get_state)
        results.check("MFF101", f"is in state {state}", found == state, f"{found}")
    results.call("MFF101", "get_flipper_parameters", flipper.get_flipper_parameters)
    results.call("MFF101", "setup_flipper", lambda: flipper.setup_flipper(transit_time=1.0))
    results.call("MFF101", "close", flipper.close)


def main() -> None:
    """Run all cases."""
    results = Results("pylablib-lightweight")
    if results.installed:
        warnings.simplefilter("ignore")  # pylablib warns that it cannot set RTS by TCP
        for case in CASES:
            options = {"stage": getattr(stages, case.stage)} if case.stage else {}
            with on_tcp(getattr(virtual, case.unit)(**options)) as watched:
                move(results, case, watched)
        with on_tcp(virtual.MFF101()) as watched:
            flip(results, watched)
    results.finish()


if __name__ == "__main__":
    main()
