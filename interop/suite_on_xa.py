"""Run ``stagewire conformance device`` on the simulated controllers of the vendor's XA SDK.

For each controller the program drafts a PICS from its answers and runs the suite. ``known`` lists the checks
that do not pass, with the reason, and ``at_times`` those that pass in some runs only. A check that fails and
is in neither list fails the program, and so does one in ``known`` that passes. A simulation is not hardware:
the lists say nothing about real controllers.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from fnmatch import fnmatch
from pathlib import Path
from typing import Any

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

LONGEST = 800
"""The seconds after which a run of the suite is ended."""
COMMAND = [str(Path(sys.executable).with_name("stagewire")), "conformance"]


@dataclass(frozen=True)
class Case:
    """A simulated controller for the suite.

    :param unit: the unit of the registry.
    :param description: the description of the simulation.
    :param stage: the lines of the PICS that declare the stage of channel 1.
    :param permissions: the options that permit more than reading.
    :param known: pattern of check ids -> why they do not pass.
    :param at_times: pattern of check ids -> why they do not always pass.
    """

    unit: str
    description: Mapping[str, Any]
    stage: str = ""
    permissions: tuple[str, ...] = ("--allow-settings",)
    known: Mapping[str, str] = field(default_factory=dict)
    at_times: Mapping[str, str] = field(default_factory=dict)


PIEZO = ("--allow-settings", "--allow-tuning", "--allow-piezo", "--allow-motion=0..65535counts")
INERTIAL = ("--allow-settings", "--allow-tuning", "--allow-motion=0..1000counts")
BYTES = {
    "wrong-length/*": "it takes a packet of another length, and does not mask 0x80 in the address",
    "truncated/*": "a part of a frame costs the next requests; a real link carries bytes, the bridge packets",
}
VERSION = {
    "identification/*": "the fourth byte of its software version is not 0 (Issue 37, page 52)"
}
UPDATES = {
    "keep-alive": "it continues after 65 updates without a keep-alive message (pages 130, 280 and 406)"
}
BUSY = {
    "updates/rate": "on a busy computer, a simulation sends fewer than 9 updates a second instead of 10"
}
"""The checks that any simulation may fail."""
STEP_RATE = {
    "answers/*/PZMOT_REQ_DRIVEOPPARAMS/1": "its step rate is 10000; the document allows 1 to 2000"
}
VOLTS = {"piezo-volts/*": "it reports a voltage late, and a position in open loop changes it"}
LIMITS = {
    "answers/*/MOT_REQ_LIMSWITCHPARAMS/1": "software limit mode 0 (Issue 37, page 79)",
    "readback/*/MOT_SET_LIMSWITCHPARAMS/1": "it keeps its own limit switches",
}
TWICE = dict.fromkeys(
    ("answers/*/MOT_REQ_DCSTATUSUPDATE/1", "status/*", "back-to-back"),
    "it answers with two equal messages; the second may arrive too late to be noticed",
)
TRIGGERS = dict.fromkeys(
    (
        "answers/*/PZMOT_REQ_KCUBETRIGIOCONFIG",
        "readback/*/PZMOT_SET_KCUBETRIGIOCONFIG",
        "back-to-back",
    ),
    "it answers a request for the triggers once for each channel; an answer may arrive in another check",
)
MOTION = {
    "move-*": "the end message of a move still has a moving bit; continuous jogs end after a step",
    "profile/*": "moves and jogs do not follow the velocity parameters",
    "backlash/*": "it stores no negative backlash distance, or does not move by it",
    "disabled/*": "a disabled channel moves on to its target",
    "home-again/*": "moves and homing do not follow the velocity parameters",
}

CASES = (
    Case(
        "KDC101",
        KDC101,
        'stage = "MTS25_Z8"\ntravel = "0..25mm"',
        ("--allow-settings", "--allow-motion=0..5mm"),
        known={
            **BYTES,
            **VERSION,
            **UPDATES,
            **MOTION,
            "soft-limits/*": "a move passes a software limit (Issue 37, page 79)",
        },
        at_times={
            **TWICE,
            "suspend/*": "end messages of moves come although they are suspended, or moving bits stay",
        },
    ),
    Case(
        "KST201",
        KST201,
        known={
            **BYTES,
            **VERSION,
            "counters/*/MOT_SET_ENCCOUNTER/1": "it converts the encoder count with a scale of its own",
        },
    ),
    Case(
        "LTS300",
        LTS300C,
        permissions=("--allow-settings", "--allow-motion=0..2000000counts"),
        known={**BYTES, **VERSION, **LIMITS, **MOTION},
    ),
    Case(
        "KSC101",
        KSC101,
        permissions=("--allow-settings", "--allow-shutter", "--allow-motion=0..1counts"),
        known=BYTES,
    ),
    Case(
        "KIM101",
        KIM101,
        permissions=INERTIAL,
        known={
            **BYTES,
            "identification/*": "it answers HW_REQ_INFO once for itself and once for each channel",
            **STEP_RATE,
            "actuator-move/*": "its position counter stays at 0, also after its own moves",
            "actuator-counter/*": "its position counter stays at 0, also after a counter is written",
        },
        at_times=TRIGGERS,
    ),
    Case(
        "KIM001",
        KIM001,
        permissions=INERTIAL,
        known={
            **BYTES,
            **UPDATES,
            **STEP_RATE,
            "readback/*/PZMOT_SET_KCUBECHANENABLEMODE": (
                "it does not answer PZMOT_REQ_STATUSUPDATE, so it is not known to be at rest"
            ),
        },
    ),
    Case(
        "PDXC2",
        PDXC2,
        permissions=INERTIAL,
        known={
            **BYTES,
            **UPDATES,
            "actuator-move/*": "in open loop, it takes the number of steps for a position",
        },
        at_times={"back-to-back": "of ten status requests without pauses, it answers about six"},
    ),
    Case(
        "BPC301",
        BPC301,
        permissions=PIEZO,
        known={
            **BYTES,
            **VERSION,
            **UPDATES,
            **VOLTS,
            "answers/*/PZ_REQ_INPUTVOLTSSRC/1": "the source has a bit that the document does not define",
            "readback/*/PZ_SET_OUTPUTMAXVOLTS/1": "it does not report the new maximum by itself",
            "piezo-slew/*": "the voltage does not follow the slew rate",
        },
    ),
    Case(
        "KPC101",
        KPC101,
        permissions=PIEZO,
        known={
            **BYTES,
            **UPDATES,
            "identification/*": "the model number is empty (Issue 37, page 52)",
            "answers/*/PZ_REQ_OUTPUTLUTPARAMS/1": "cycles and delay are 0, which the document excludes",
            **VOLTS,
            "readback/*/PZ_SET_OUTPUTLUTPARAMS/1": "it keeps its mode, cycles and delay",
        },
    ),
    Case(
        "KNA101",
        KNA101,
        permissions=PIEZO,
        known={
            **BYTES,
            **UPDATES,
            "readback/*/PZ_SET_NTFEEDBACKSRC": "once set, the feedback source is read back as 0",
            "nanotrak-tracking/*": "the circle moves to its home position on one axis only",
        },
        at_times=dict.fromkeys(
            ("answers/*/PZ_REQ_NTSTATUSUPDATE/*", "status/*"),
            "its relative signal is 32768, above the range (page 277)",
        ),
    ),
    Case(
        "BBD303",
        BBD303,
        known={
            **BYTES,
            **UPDATES,
            **LIMITS,
            "identification/*": "the model number is empty (Issue 37, page 52)",
            "readback/*/MOT_SET_GENMOVEPARAMS/1": "it keeps a backlash distance of 0",
            "readback/*/MOT_SET_HOMEPARAMS/1": "it keeps an offset distance of 0",
            "readback/*/MOT_SET_PMDPROFILEMODEPARAMS/1": "it keeps the trapezoidal profile",
        },
        at_times=TWICE,
    ),
)


def failures(case: Case, folder: Path) -> dict[str, str]:
    """Run the suite on the simulation of a case; return the checks that did not pass, with their findings.

    :raises NotStartedError: the simulation did not start, or the suite did not run.
    """
    pics, report = folder / f"{case.unit}.toml", folder / f"{case.unit}.json"
    with simulated(case.description) as url:
        run("pics", "--from", url, "--unit", case.unit, "--out", str(pics))
        text = pics.read_text(encoding="utf-8")
        pics.write_text(
            re.sub(r"^number = 1$", f"number = 1\n{case.stage}", text, count=1, flags=re.MULTILINE),
            encoding="utf-8",
        )
        run("device", url, "--pics", str(pics), *case.permissions, "--json", str(report))
    if not report.exists():
        raise NotStartedError("the suite wrote no report")
    found = json.loads(report.read_text(encoding="utf-8"))
    return {
        check["id"]: "; ".join(finding["text"] for finding in check["findings"])
        for group in found["groups"]
        for check in group["cases"]
        if check["result"] in ("FAIL", "NON-STRICT", "FRAGILE")
    }


def run(*arguments: str) -> None:
    """Run a command of the suite; its exit status says no more than its report."""
    subprocess.run([*COMMAND, *arguments], stdout=subprocess.DEVNULL, timeout=LONGEST, check=False)


def judge(results: Results, case: Case, failed: Mapping[str, str]) -> None:
    """Compare the checks that did not pass with the known ones."""
    listed = {**case.known, **case.at_times, **BUSY}
    for pattern, reason in listed.items():
        found = [check for check in failed if fnmatch(check, pattern)]
        results.known(case.unit, pattern, not found, reason, always=pattern in case.known)
    for check, finding in failed.items():
        if not any(fnmatch(check, pattern) for pattern in listed):
            results.check(case.unit, check, False, finding)
    results.check(case.unit, "finishes the suite", True)


def main() -> None:
    """Run all cases at the same time, or those of the units named on the command line."""
    results = Results("thorlabs_xa")
    if results.installed:
        named = [argument for argument in sys.argv[1:] if argument.isalnum()]
        cases = [case for case in CASES if not named or case.unit in named]
        with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(len(CASES)) as pool:
            runs = [pool.submit(failures, case, Path(folder)) for case in cases]
            for case, each in zip(cases, runs, strict=True):
                try:
                    judge(results, case, each.result())
                except (NotStartedError, subprocess.TimeoutExpired) as error:
                    results.check(case.unit, "finishes the suite", False, str(error))
    results.finish()


if __name__ == "__main__":
    main()
