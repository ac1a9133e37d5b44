"""The vendor's XA SDK drives virtual controllers over TCP.

The KDC101, KST201 and LTS must open with all parameters, home, move and stop, with the same positions in
counts and in physical units as the virtual stage. Shutters, piezos, inertial motors and NanoTraks do what
``xa_families`` asks of them. For the other units, ``known`` says how far they go. The
SDK refuses the K10CR1 and the MFF101.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from results import Results
from watched import Watched, on_tcp

import stagewire_virtual as virtual
from stagewire_apt import stages

CLIENT = Path(__file__).with_name("xa_client.py")
LONGEST = 300
"""The seconds after which the client is ended."""
NEAR = 1e-4
"""The largest difference of positions in mm or degrees, which the live table shows with four digits."""


DOES = "does: "  # as in xa_families, which needs the SDK
OPENS = "opens"
READS = "reads all parameters"
NO_DIRECTION = (
    "the Python wrapper has no direction 0, which the example of the document (Issue 3, page 38) "
    "has for brushless stages"
)
NO_TRIGGER = "the Python wrapper takes the bits of the mode for a number, and has no 0 (no trigger)"


@dataclass(frozen=True)
class Case:
    """A virtual controller for the SDK.

    :param unit: its unit.
    :param serial_number: its serial number, with the prefix by which the SDK chooses its class.
    :param opens_as: the class that the SDK makes for it.
    :param stage: the name of its stage; empty for a built-in one, or without one.
    :param product: the connected product to set, in the words of the SDK, if the unit does not report it.
    :param moves: whether it has a motor of its own; the base of a rack has none.
    :param known: expectation -> why it does not hold.
    """

    unit: str
    serial_number: int
    opens_as: str
    stage: str = ""
    product: str = ""
    moves: bool = True
    known: Mapping[str, str] = field(default_factory=dict)


REFUSED = "the SDK does not support this unit; it disconnects after HW_GET_INFO"
CASES = (
    Case("KDC101", 27000001, "Kdc101", "Z825B"),
    Case("KST201", 26000001, "Kst201", "ZST213"),
    Case("LTS300", 45000001, "LinearTranslationStage"),
    Case("LTS150", 45000002, "LinearTranslationStage"),
    Case("KBD101", 28000001, "Kbd101", "DDS100", known={"get_home_params": NO_DIRECTION}),
    Case(
        "TBD001",
        67000001,
        "Tbd001",
        "DDS220",
        known={
            "get_home_params": NO_DIRECTION,
            "get_trigger_params_for_dc_brushless": NO_TRIGGER,
        },
    ),
    Case(
        "BSC201",
        40000001,
        "Bsc201",
        "NRT100",
        product="NRT100",
        known={"get_profile_mode_params": "it asks for 0x04E4, which only brushless units have"},
    ),
    Case("KSC101", 68000001, "Ksc101", moves=False),
    Case(
        "KIM101",
        97000001,
        "Kim101",
        moves=False,
        known={
            f"channel {number}: get_dc_pid_params": "the SDK does not support this call on a KIM101"
            for number in range(1, 5)
        },
    ),
    Case("PDXC2", 112000001, "Pdxc2", moves=False),
    Case(
        "KIM001",
        74000001,
        "Kim001",
        moves=False,
        known={"get_dc_pid_params": "the SDK does not support this call on a KIM001"},
    ),
    Case("BPC301", 41000001, "Bpc301", moves=False),
    Case("KPC101", 113000001, "Kpc101", moves=False),
    Case(
        "KNA101",
        57000001,
        "Kna101",
        moves=False,
        known={"get_kna_scan_data": "data exist only after a scan"},
    ),
    Case(
        "BSC203",
        70000001,
        "Bsc20x",
        "NRT100",
        moves=False,
        known={"get_digital_output_states": "the list of page 16 has no RACK_REQ_DIGOUTPUTS"},
    ),
    Case(
        "BBD302",
        103000001,
        "Bbd30x",
        "DDS220",
        moves=False,
        known={OPENS: "it asks the motherboard for 0x0270; ours has these messages in its bays"},
    ),
    Case(
        "BBD202",
        73000001,
        "Bbd20x",
        "DDS220",
        moves=False,
        known={OPENS: REFUSED},
    ),
    Case(
        "KST101",
        26000002,
        "Kst101",
        "ZST213",
        known={OPENS: "it refuses firmware 1, and takes a KST101 with firmware 2 for a KST201"},
    ),
    Case("K10CR1", 55000001, "", known={OPENS: REFUSED}),
    Case("MFF101", 37000001, "", known={OPENS: REFUSED}),
)
"""The units in the order of their value for users."""

ACTIONS = {
    "home": "homes",
    "move to a position": "moves to a position",
    "move by a distance": "moves by a distance",
    "jog": "jogs",
    "start": "moves on",
    "stop": "stops",
}
"""Calls of the client, and the expectations that they meet."""


def drive(case: Case) -> tuple[dict[str, Any], Watched]:
    """Let the SDK drive a virtual controller; return the outcomes of its calls and what it asked."""
    stage = getattr(stages, case.stage) if case.stage else None
    controller = getattr(virtual, case.unit)(serial_number=case.serial_number, stage=stage)
    with on_tcp(controller) as watched, tempfile.TemporaryDirectory() as home:
        file = Path(home, "found.json")
        arguments = [str(case.serial_number), watched.url.removeprefix("socket://"), str(file)]
        if case.product:
            arguments.append(case.product)
        try:
            subprocess.run(
                [sys.executable, str(CLIENT), *arguments],
                env={**os.environ, "HOME": home},  # it writes a log there
                stdout=subprocess.DEVNULL,  # it prints its errors
                timeout=LONGEST,
                check=False,
            )
        except subprocess.TimeoutExpired:
            print(f"{case.unit}: the SDK did not finish in {LONGEST} s")
        found = json.loads(file.read_text(encoding="utf-8")) if file.exists() else {}
        found["position"] = watched.position
    return found, watched


def judge(results: Results, case: Case, found: Mapping[str, Any], watched: Watched) -> None:
    """Compare the outcomes with the expectations of a case."""

    def expect(what: str, holds: bool, detail: str) -> None:
        if what in case.known:
            results.known(case.unit, what, holds, case.known[what])
        else:
            results.check(case.unit, what, holds, detail)

    opened = found.get("open", {"value": None, "error": "the SDK ended"})
    detail = opened["value"] or f"{opened['error']}; refused: {'; '.join(watched.refused) or '-'}"
    expect(OPENS, opened["value"] is not None and opened["value"] == case.opens_as, detail)
    if opened["value"] is None:
        return
    reads = {
        name: value for name, value in found.items() if name.split(": ")[-1].startswith("get_")
    }
    failed = {name: value["error"] for name, value in reads.items() if value["error"]}
    detail = f"{len(reads)} calls; failed: {failed or '-'}"
    results.check(case.unit, READS, not failed.keys() - case.known.keys(), detail)
    for name in sorted(case.known.keys() & reads.keys()):
        results.known(case.unit, name, name not in failed, case.known[name])
    for name, outcome in found.items():
        if name.startswith(DOES):
            expect(name.removeprefix(DOES), outcome["value"] is True, outcome["error"])
    if error := found.get("use", {}).get("error"):
        expect("can be used", False, error)
    if not case.moves:
        return
    for call, what in ACTIONS.items():
        error = found.get(call, {"error": "not called"})["error"]
        expect(what, not error, error)
    home = found.get("home: counts", {}).get("value")
    expect("is at 0 after homing", home == 0, f"{home} counts")
    moved = found.get("move to a position: counts", {}).get("value")
    target = found.get("target", {}).get("value")
    expect(
        "reaches its target", target is not None and moved == target, f"{moved} of {target} counts"
    )
    expect("rests after a stop", found.get("at rest", {}).get("value") is True, "")
    physical = (found.get("rest: physical", {}).get("value") or [None])[0]
    own, unit = found["position"].split()
    same = physical is not None and abs(physical - float(own)) <= NEAR
    expect("has the same physical position", same, f"{physical} {unit}, the virtual stage {own}")


def main() -> None:
    """Run all cases, or those of the units named on the command line."""
    results = Results("thorlabs_xa")
    if results.installed:
        named = [argument for argument in sys.argv[1:] if argument.isalnum()]
        for case in CASES:
            if not named or case.unit in named:
                judge(results, case, *drive(case))
    results.finish()


if __name__ == "__main__":
    main()
