"""Programs that move a motor record: ``python clients.py CLIENT PV START TARGET``.

A client connects, moves to a start, and prints ``ready``. It moves to the target when it reads a line, and
prints ``done`` when its user would see the end, with a report: an empty one for success, or the error.
Clients of bluesky also print ``plan``, with the positions in the events of their run.
"""

from __future__ import annotations

import asyncio
import json
import os
import sys
from collections.abc import Callable
from typing import Any

Done = Callable[[str], None]
REPORTS = os.dup(1)
os.dup2(2, 1)  # libraries also print


def say(what: str, **details: Any) -> None:
    """Write a report. Two threads may do so at the same time, and neither may split the line of the other."""
    os.write(REPORTS, (json.dumps({"what": what, **details}) + "\n").encode())


def described(error: BaseException | None) -> str:
    """Return the innermost cause of an error; an empty text for none."""
    if error is None:
        return ""
    while error.__cause__ is not None and type(error).__name__ == "FailedStatus":
        error = error.__cause__
    return f"{type(error).__name__}: {error}"


def moved_by_plan(make: Callable[[], Any], start: float, target: float) -> None:
    """Move a device by a plan of bluesky, which reads it before and after the move."""
    import bluesky.plan_stubs as bps
    from bluesky import RunEngine

    engine = RunEngine({})
    device = make()
    positions: list[float] = []
    engine.subscribe(lambda _, document: positions.append(document["data"]["x"]), "event")

    def plan() -> Any:
        yield from bps.open_run()
        yield from bps.mv(device, start)
        yield from bps.trigger_and_read([device])
        say("ready")
        sys.stdin.readline()
        status = yield from bps.abs_set(device, target, group="move")
        status.add_callback(
            lambda ended: say(
                "done", report="" if ended.success else described(ended.exception()) or "failed"
            )
        )
        yield from bps.wait("move")
        yield from bps.trigger_and_read([device])
        yield from bps.close_run()

    error: BaseException | None = None
    try:
        engine(plan())
    except Exception as failure:
        error = failure
    say("plan", report=described(error), positions=positions)


def of_ophyd_async(kind: type[Any]) -> Callable[[str, float, float], None]:
    def move(pv: str, start: float, target: float) -> None:
        from bluesky.run_engine import call_in_bluesky_event_loop

        def make() -> Any:
            x = kind(pv, "x")
            call_in_bluesky_event_loop(x.connect(timeout=10), timeout=20)
            return x

        moved_by_plan(make, start, target)

    return move


def ophyd_async(pv: str, start: float, target: float) -> None:
    from ophyd_async.epics.motor import Motor

    of_ophyd_async(Motor)(pv, start, target)


def of_ophyd(kind: type[Any]) -> Callable[[str, float, float], None]:
    def move(pv: str, start: float, target: float) -> None:
        def make() -> Any:
            x = kind(pv, name="x")
            x.wait_for_connection(timeout=10)
            return x

        moved_by_plan(make, start, target)

    return move


def ophyd_async_pva(pv: str, start: float, target: float) -> None:
    ophyd_async(f"pva://{pv}", start, target)


def ophyd(pv: str, start: float, target: float) -> None:
    from ophyd import EpicsMotor

    of_ophyd(EpicsMotor)(pv, start, target)


def checked_ophyd_async(pv: str, start: float, target: float) -> None:
    from stagewire_bluesky.epics import CheckedMotor

    of_ophyd_async(CheckedMotor)(pv, start, target)


def checked_ophyd_async_pva(pv: str, start: float, target: float) -> None:
    checked_ophyd_async(f"pva://{pv}", start, target)


def checked_ophyd(pv: str, start: float, target: float) -> None:
    from stagewire_bluesky.classic import CheckedEpicsMotor

    of_ophyd(CheckedEpicsMotor)(pv, start, target)


def pyepics(pv: str, start: float, target: float) -> None:
    from epics import Motor

    motor = Motor(pv, timeout=10)
    motor.move(start, wait=True)
    say("ready")
    sys.stdin.readline()
    code = motor.move(target, wait=True, timeout=300)
    say("done", report="" if code == 0 else f"returns {code}")


def aioca(pv: str, start: float, target: float) -> None:
    from aioca import caput

    async def main() -> None:
        await caput(pv, start, wait=True, timeout=30)
        say("ready")
        sys.stdin.readline()
        try:
            await caput(pv, target, wait=True, timeout=None)
        except Exception as error:
            say("done", report=described(error))
        else:
            say("done", report="")

    asyncio.run(main())


CLIENTS: dict[str, Callable[[str, float, float], None]] = {
    "ophyd_async": ophyd_async,
    "ophyd_async_pva": ophyd_async_pva,
    "ophyd": ophyd,
    "checked_ophyd_async": checked_ophyd_async,
    "checked_ophyd_async_pva": checked_ophyd_async_pva,
    "checked_ophyd": checked_ophyd,
    "pyepics": pyepics,
    "aioca": aioca,
}


def main() -> None:
    client, pv, start, target = sys.argv[1:]
    CLIENTS[client](pv, float(start), float(target))


if __name__ == "__main__":
    main()
