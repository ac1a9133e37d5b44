"""thorlabs-apt-device drives the virtual controllers of all its device classes, on pseudo-terminals."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from results import Results
from watched import Watched, on_pty

import stagewire_virtual as virtual
from stagewire_apt import stages

LONGEST = 60
"""The longest wait for a state, in seconds. With two bays, the client sends a command seconds late."""
INVERTED = (
    "its class inverts directions and sends 2 for forward, which is reverse in the document and in the "
    "vendor's simulation; the document leaves the sense to the device (Issue 37, page 86)"
)


@dataclass(frozen=True)
class Case:
    """A virtual controller for a class of the client.

    :param name: the class.
    :param unit: the unit.
    :param stage: its stage.
    :param counts: the target of a move.
    :param options: options of the class.
    :param known: call -> why it fails.
    """

    name: str
    unit: str
    stage: str
    counts: int
    options: Mapping[str, Any] = field(default_factory=dict)
    known: Mapping[str, str] = field(default_factory=dict)


CASES = (
    Case("KDC101", "KDC101", "Z825B", 20000, known={"move_jog forward": INVERTED}),
    Case("TDC001", "TDC001", "Z8", 20000, known={"move_jog forward": INVERTED}),
    Case("BSC201", "BSC201", "NRT100", 400000),
    Case("BSC", "BSC203", "NRT100", 400000, {"x": 3}),
    Case("BSC201_DRV250", "BSC201", "DRV250", 400000),
    Case("BBD201", "BBD201", "DDS100", 40000),
    Case("BBD202", "BBD202", "DDS100", 40000),
)


def client_class(name: str) -> Any:
    """Return a class of the client by name."""
    from thorlabs_apt_device.devices import bbd, bsc, kdc101, tdc001

    for module in (bbd, bsc, kdc101, tdc001):
        if hasattr(module, name):
            return getattr(module, name)
    raise LookupError(f"thorlabs-apt-device has no class {name}")


def wait(condition: Callable[[], bool], longest: float = LONGEST) -> None:
    """Wait until a condition holds.

    :raises TimeoutError: it does not hold within the longest wait.
    """
    end = time.monotonic() + longest
    while not condition():
        if time.monotonic() > end:
            raise TimeoutError(f"not within {longest} s")
        time.sleep(0.05)


def drive(results: Results, case: Case, watched: Watched) -> None:
    """Home and move the controller, and change its parameters."""

    def call(what: str, function: Callable[[], Any]) -> Any:
        return results.call(case.name, what, function, case.known.get(what, ""))

    make = client_class(case.name)
    device = call("opens", lambda: make(serial_port=watched.url, home=True, **case.options))
    if device is None:
        return
    status = device.status_[0][0]

    def at(counts: int) -> bool:
        moving = status["moving_forward"] or status["moving_reverse"]
        return not moving and abs(status["position"] - counts) < 5

    counts = case.counts
    call("homes", lambda: wait(lambda: status["homed"] and not status["homing"] and at(0)))
    device.move_absolute(counts)
    call("move_absolute", lambda: wait(lambda: at(counts)))
    device.move_relative(-counts // 4)
    call("move_relative", lambda: wait(lambda: at(counts * 3 // 4)))
    limits, jogging = device.velparams_[0][0], device.jogparams_[0][0]
    half = limits["max_velocity"] // 2
    device.set_velocity_params(limits["acceleration"], half)
    call("set_velocity_params", lambda: wait(lambda: limits["max_velocity"] == half))
    step = counts // 10
    device.set_jog_params(step, jogging["acceleration"], jogging["max_velocity"])
    call("set_jog_params", lambda: wait(lambda: jogging["step_size"] == step))
    device.move_jog("forward")
    call("move_jog forward", lambda: wait(lambda: at(counts * 3 // 4 + step), 10))
    device.stop()
    call("stop", lambda: wait(lambda: not status["moving_forward"]))
    device.set_move_params(500)
    general = device.genmoveparams_[0][0]
    call("set_move_params", lambda: wait(lambda: general["backlash_distance"] == 500))
    call("identify", device.identify)
    call("set_enabled", lambda: device.set_enabled(False))
    call("close", device.close)
    time.sleep(0.5)  # the client closes its port in another thread


def main() -> None:
    """Run all cases."""
    results = Results("thorlabs-apt-device")
    if results.installed:
        for case in CASES:
            stage = getattr(stages, case.stage)
            with on_pty(getattr(virtual, case.unit)(stage=stage)) as watched:
                drive(results, case, watched)
    results.finish()


if __name__ == "__main__":
    main()
