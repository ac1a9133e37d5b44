"""Suspenders of bluesky watch signals of ophyd-async through an adapter."""

from __future__ import annotations

import threading
import time
from typing import Any

import bluesky.plan_stubs as bps
import bluesky.plans as bp
import pytest
from bluesky import RunEngine
from bluesky.suspenders import SuspendCeil
from conftest import Documents
from lines import connected

import stagewire_virtual as virtual
from stagewire_apt.aio import TDC001, TSG001
from stagewire_bluesky import Controller, Motor, StrainGauge, Watched


def test_a_suspender_refuses_a_signal_without_the_adapter(plans: RunEngine) -> None:
    gauge = StrainGauge(Controller(TSG001, "virtual://TSG001"), "g")
    with connected(gauge), pytest.raises(TypeError):
        SuspendCeil(gauge.reading, 2).install(plans)


def test_a_suspender_stops_the_motor_and_the_plan_resumes_later(
    plans: RunEngine, documents: Documents
) -> None:
    with virtual.TSG001().tcp() as tsg:
        gauge = StrainGauge(Controller(TSG001, tsg.url), "g")
        motor = Motor(Controller(TDC001, "virtual://TDC001?stage=Z8", stage="Z8"), "x")
        instrument: Any = tsg.instrument
        behaviour = instrument.channel(1).behaviour
        seen: list[float] = []

        def disturb() -> None:
            time.sleep(0.6)
            tsg.call(setattr, behaviour, "signal", 0.9)
            time.sleep(1.5)
            seen.append(documents.data[-1]["x"])
            seen.append(len(documents.data))
            tsg.call(setattr, behaviour, "signal", 0.0)

        def plan() -> Any:
            yield from bps.checkpoint()
            yield from bp.list_scan([], motor, [0.0, 2.0])

        with connected(gauge, motor):
            suspender = SuspendCeil(Watched(gauge.reading, plans), 2)
            plans.install_suspender(suspender)
            thread = threading.Thread(target=disturb)
            thread.start()
            try:
                plans(plan())
            finally:
                thread.join()
                plans.remove_suspender(suspender)
            assert seen == [0.0, 1]
            assert [round(data["x"], 3) for data in documents.data] == [0.0, 2.0]


def test_a_removed_suspender_receives_nothing(plans: RunEngine) -> None:
    with virtual.TSG001().tcp() as tsg:
        gauge = StrainGauge(Controller(TSG001, tsg.url), "g")
        with connected(gauge):
            watched = Watched(gauge.reading, plans)
            seen: list[float] = []

            def add(value: float, **_: object) -> None:
                seen.append(value)

            watched.subscribe(add, event_type=None, run=True)
            deadline = time.monotonic() + 20
            while len(seen) < 2 and time.monotonic() < deadline:
                time.sleep(0.02)
            watched.clear_sub(add)
            count = len(seen)
            plans(bps.sleep(0.5))
            assert len(seen) == count >= 2
