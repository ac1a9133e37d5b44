"""A client of three IOCs on its own machine: runs the plans that it reads, and writes their results.

Each line of the standard input is a plan in JSON, ``{"move": [1.0, 2.0, 3.0]}`` or
``{"scan": [[0.0, 1.0, 2], ...]}``, and each line of the standard output its result.
"""

from __future__ import annotations

import json
import sys
from typing import Any

import bluesky.plan_stubs as bps
import bluesky.plans as bp
from bluesky import RunEngine
from bluesky.run_engine import call_in_bluesky_event_loop

from stagewire_bluesky.epics import CheckedMotor


def main(names: list[str]) -> None:
    """Run plans with the motors of some names until the end of the input."""
    engine = RunEngine({}, call_returns_result=True)
    motors = [CheckedMotor(name, name=f"m{at}") for at, name in enumerate(names)]

    async def connect() -> None:
        for motor in motors:
            await motor.connect(timeout=20)

    call_in_bluesky_event_loop(connect(), timeout=60)
    print(json.dumps({"error": "", "events": []}), flush=True)
    for line in sys.stdin:
        events: list[list[float]] = []

        def note(_: str, document: dict[str, Any], events: list[list[float]] = events) -> None:
            events.append([document["data"][motor.name] for motor in motors])

        plan = json.loads(line)
        error = ""
        try:
            if "move" in plan:
                pairs = zip(motors, plan["move"], strict=True)
                engine(bps.mv(*(one for pair in pairs for one in pair)))
            else:
                axes = zip(motors, plan["scan"], strict=True)
                engine(
                    bp.grid_scan([], *(one for motor, axis in axes for one in (motor, *axis))),
                    {"event": [note]},
                )
        except Exception as failure:
            error = repr(failure)
            if engine.state != "idle":
                engine.abort()
        print(json.dumps({"error": error, "events": events}), flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
