"""Device classes drive the simulated controllers of the vendor's XA SDK, through a bridge to a TCP port.

Each class opens its controller, reads all its parameters, homes, moves, jogs and stops. ``silent`` names the
calls that the simulation does not answer although the document lists their messages for the unit; a call that
starts to be answered fails the program. A simulation is not hardware.
"""

from __future__ import annotations

import inspect
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import device_families
from results import Results
from xa_simulator import (
    BBD303,
    BPC301,
    KDC101,
    KIM001,
    KIM101,
    KNA101,
    KPC101,
    KSC101,
    KST201,
    LTS300C,
    PDXC2,
    NotStartedError,
    simulated,
)

import stagewire_apt
from stagewire.errors import MotionStoppedError, ReplyTimeoutError, StagewireError

NEAR = 1e-3
"""The largest difference between a target and the final position, in mm."""


@dataclass(frozen=True)
class Case:
    """A simulated controller for a device class.

    :param unit: the device class.
    :param description: the description of the simulation.
    :param options: options of ``open``.
    :param silent: the calls that the simulation does not answer.
    :param known: expectation -> why it does not hold.
    """

    unit: str
    description: Mapping[str, Any]
    options: Mapping[str, Any] = field(default_factory=dict)
    silent: frozenset[str] = frozenset()
    known: Mapping[str, str] = field(default_factory=dict)


CHANNEL = ("get_chan_enable_state", "get_home_params", "get_lim_switch_params")
"""The calls of a channel that the simulation of a KIM101 does not answer."""
COUNTER = "the position counter of the simulation stays at 0, also after its own moves"
STUCK = "a move ends at once at 0, also one that the SDK itself commands"

CASES = (
    Case(
        "KDC101",
        KDC101,
        {"stage": "MTS25_Z8"},
        silent=frozenset(
            (
                "get_av_modes",
                "get_bay_used",
                "get_button_params",
                "get_enc_counter",
                "get_pot_params",
            )
        ),
    ),
    Case(
        "KST201",
        KST201,
        {"stage": "ZST213B"},
        known=dict.fromkeys(
            ("moves to a position", "moves by a distance", "is where it was sent", "jogs"), STUCK
        ),
    ),
    Case(
        "LTS300",
        LTS300C,
        {"stage": "LTS300C"},
        silent=frozenset(("get_bow_index",)),
    ),
    Case(
        "KSC101",
        KSC101,
        silent=frozenset(("get_bay_used", "get_button_params", "get_kcube_pos_trig_params")),
    ),
    Case(
        "KIM101",
        KIM101,
        silent=frozenset(("get_bay_used", "get_status_update", *CHANNEL)),
        known={"counter follows": COUNTER},
    ),
    Case(
        "KIM001",
        KIM001,
        silent=frozenset(("get_home_params", "get_lim_switch_params", "get_status_update")),
        known={"counter follows": COUNTER},
    ),
    Case("PDXC2", PDXC2),
    Case(
        "BPC301",
        BPC301,
        silent=frozenset(("get_output_lut", "get_output_lut_params", "get_status_bits")),
    ),
    Case("KPC101", KPC101, silent=frozenset(("get_pz_status_update",))),
    Case(
        "KNA101",
        KNA101,
        silent=frozenset(
            (
                "get_bay_used",
                "get_dig_outputs",
                "get_nt_circ_centre_pos",
                "get_nt_tia_lp_filter_coeffs",
                "get_nt_tia_reading",
                "get_tna_disp_settings",
            )
        ),
    ),
    Case(
        "BBD303",
        BBD303,
        {"stage": "DDS600"},
        silent=frozenset(
            (
                "get_analog_monitor_config",
                "get_dig_outputs",
                "get_enc_counter",
                "get_lcd_display_params",
                "get_pmd_current_loop_params",
                "get_pmd_position_loop_params",
                "get_pmd_settled_current_loop_params",
                "get_trigger",
            )
        ),
    ),
)


def getters(device: Any) -> list[str]:
    """Return the calls of a device that read something and need no argument."""
    found = []
    for name, method in inspect.getmembers(type(device), inspect.isfunction):
        if name.startswith("get_"):
            needed = [
                each
                for each in list(inspect.signature(method).parameters.values())[1:]  # without self
                if each.default is each.empty
            ]
            if not needed:
                found.append(name)
    return found


class Trial:
    """The calls of one case.

    :param results: where the results go.
    :param case: the case.
    """

    def __init__(self, results: Results, case: Case) -> None:
        self._results = results
        self._case = case

    def expect(self, what: str, holds: bool, detail: str = "") -> None:
        """Record an expectation of the case."""
        if what in self._case.known:
            self._results.known(self._case.unit, what, holds, self._case.known[what])
        else:
            self._results.check(self._case.unit, what, holds, detail)

    def call(self, what: str, function: Callable[[], Any]) -> Any:
        """Call a function, and expect that it raises no error of the library; return its value or None."""
        try:
            value = function()
        except StagewireError as error:
            self.expect(what, False, f"{type(error).__name__}: {error}")
            return None
        self.expect(what, True, "")
        return value

    def run(self) -> None:
        """Start the simulation, and open and drive it."""
        case = self._case
        try:
            with simulated(case.description) as url:
                opened = getattr(stagewire_apt, case.unit).open
                device = self.call("opens", lambda: opened(url, motion_timeout=120, **case.options))
                if device is not None:
                    with device:
                        self._use(device)
        except NotStartedError as error:
            self.expect("opens", False, str(error))

    def _use(self, device: Any) -> None:
        one = device.bays[0] if hasattr(device, "bays") else device
        self._read(one)
        if hasattr(one, "home") and hasattr(one, "move_absolute"):
            self._drive(one)
        if hasattr(one, "set_sol_state"):
            one.set_sol_operating_mode(operating_mode="SOLENOID_MANUAL")
            for what, wanted in (
                ("opens the shutter", "SOLENOID_ON"),
                ("closes the shutter", "SOLENOID_OFF"),
            ):
                one.set_sol_state(state=wanted)
                state = one.get_sol_state().state.name
                self.expect(what, state == wanted, state)
        device_families.use(self, one)

    def _read(self, device: Any) -> None:
        silent, failed = set(), []
        channels = device.channels[:1] if hasattr(device, "channels") else []
        names = [(each, name) for each in (device, *channels) for name in getters(each)]
        for each, name in names:
            try:
                getattr(each, name)()
            except ReplyTimeoutError:
                silent.add(name)
            except StagewireError as error:
                failed.append(f"{name}: {error}")
        read = len(names) - len(silent) - len(failed)
        self.expect("reads its parameters", not failed, f"{read} read; {'; '.join(failed)}")
        self.expect(
            "leaves only known calls unanswered",
            silent == self._case.silent,
            ", ".join(sorted(silent)) or "none",
        )

    def _drive(self, device: Any) -> None:
        def near(what: str, mm: float) -> None:
            found = device.get_pos_counter().mm
            self.expect(what, abs(found - mm) <= NEAR, f"{found} mm of {mm} mm")

        if device.get_chan_enable_state().enable_state.name != "ENABLE":
            device.set_chan_enable_state(enable_state="ENABLE")
        self.call("homes", device.home)
        near("is at 0 after homing", 0)
        self.call("moves to a position", lambda: device.move_absolute(mm=2))
        self.call("moves by a distance", lambda: device.move_relative(mm=-0.5))
        near("is where it was sent", 1.5)
        self.call("jogs", lambda: device.jog("FORWARD"))
        motion = device.start_move_absolute(mm=12)
        time.sleep(0.1)
        self.call("stops", device.stop)
        try:
            end = f"it reached {motion.wait(5)}"
        except MotionStoppedError:
            end = ""
        self.expect("ends its stopped motion", not end, end)
        first = device.get_pos_counter().position
        time.sleep(0.5)
        second = device.get_pos_counter().position
        self.expect("rests after a stop", first == second, f"{first}, then {second} counts")


def main() -> None:
    """Run all cases, or those of the units named on the command line."""
    results = Results("thorlabs_xa")
    if results.installed:
        named = [argument for argument in sys.argv[1:] if argument.isalnum()]
        for case in CASES:
            if not named or case.unit in named:
                Trial(results, case).run()
    results.finish()


if __name__ == "__main__":
    main()
