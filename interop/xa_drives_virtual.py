"""The vendor's XA SDK drives virtual controllers over TCP.

The KDC101, KST201 and LTS must open with all parameters, home, move and stop, with the same positions in
counts and in physical units as the virtual stage. For the other units, ``known`` says how far they go. The
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


@dataclass(frozen=True)
class Case:
    """A virtual controller for the SDK.

    :param unit: its unit.
    :param serial_number: its serial number, with the prefix by which the SDK chooses its class.
    :param opens_as: the class that the SDK makes for it.
    :param stage: the name of its stage; empty for a built-in one.
    :param options: further options of the virtual controller.
    :param known: expectation -> why it does not hold.
    """

    unit: str
    serial_number: int
    opens_as: str
    stage: str = ""
    options: Mapping[str, Any] = field(default_factory=dict)
    known: Mapping[str, str] = field(default_factory=dict)


CASES = (
    Case("KDC101", 27000001, "Kdc101", "Z825B"),
    Case("KST201", 26000001, "Kst201", "ZST213"),
    Case("LTS300", 45000001, "LinearTranslationStage"),
    Case("LTS150", 45000001, "LinearTranslationStage"),
)


def drive(case: Case) -> tuple[dict[str, Any], Watched]:
    """Let the SDK drive a virtual controller; return the outcomes of its calls and what it asked."""
    options = dict(case.options)
    if case.stage:
        options["stage"] = getattr(stages, case.stage)
    controller = getattr(virtual, case.unit)(serial_number=case.serial_number, **options)
    with on_tcp(controller) as watched, tempfile.TemporaryDirectory() as home:
        file = Path(home, "found.json")
        transport = watched.url.removeprefix("socket://")
        command = [sys.executable, str(CLIENT), str(case.serial_number), transport, str(file)]
        environment = {**os.environ, "HOME": home}
        try:
            subprocess.run(
                command,
                env=environment,
                stdout=subprocess.DEVNULL,
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
    expect(f"opens as {case.opens_as}", opened["value"] == case.opens_as, detail)
    if opened["value"] is None:
        return
    reads = {name: value for name, value in found.items() if name.startswith("get_")}
    failed = {name: value["error"] for name, value in reads.items() if value["error"]}
    expect("reads all parameters", not failed, f"{len(reads)} read; not read: {failed or '-'}")
    for what in ("home", "move to a position", "move by a distance", "jog", "start", "stop"):
        error = found.get(what, {"error": "not called"})["error"]
        expect(f"{what}s" if what in ("home", "jog", "stop") else what, not error, error)
    home = found.get("home: counts", {}).get("value")
    expect("is at 0 after homing", home == 0, f"{home} counts")
    moved = found.get("move to a position: counts", {}).get("value")
    target = found.get("target", {}).get("value")
    expect("reaches its target", moved == target, f"{moved} of {target} counts")
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
                found, watched = drive(case)
                judge(results, case, found, watched)
    results.finish()


if __name__ == "__main__":
    main()
