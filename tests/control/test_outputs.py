"""Piezos, shutters and strain gauges in plans."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import bluesky.plan_stubs as bps
import bluesky.plans as bp
import pytest
from bluesky import RunEngine, protocols
from bluesky.utils import FailedStatus
from conftest import Documents
from lines import Served, cause_of, connected, run, served

import stagewire_virtual as virtual
from stagewire.errors import (
    LimitError,
    MotionTimeoutError,
    NotReadyError,
    ReplyTimeoutError,
    TransportLostError,
)
from stagewire_apt.aio import BPC203, KSC101, TPZ001, TSC001, TSG001
from stagewire_bluesky import Controller, Piezo, Shutter, ShutterState, StrainGauge


def test_the_devices_have_the_protocols_of_bluesky() -> None:
    piezo = Piezo(Controller(TPZ001, "virtual://TPZ001"))
    shutter = Shutter(Controller(TSC001, "virtual://TSC001"))
    gauge = StrainGauge(Controller(TSG001, "virtual://TSG001"))
    for device in (piezo, shutter):
        assert isinstance(device, protocols.Readable)
        assert isinstance(device, protocols.Locatable)
        assert isinstance(device, protocols.Stoppable)
    assert isinstance(gauge, protocols.Readable)
    assert not isinstance(gauge, protocols.Movable)


def test_a_piezo_scans_volts(plans: RunEngine, documents: Documents) -> None:
    piezo = Piezo(Controller(TPZ001, "virtual://TPZ001"), "p")
    with connected(piezo):
        plans(bp.scan([], piezo, 0, 10, 3))
    assert [data["p"] for data in documents.data] == pytest.approx([0, 5, 10], abs=0.1)
    [descriptor] = documents.of("descriptor")
    assert descriptor["data_keys"]["p"]["units"] == "V"
    assert descriptor["data_keys"]["p"]["limits"]["control"] == {"low": 0.0, "high": 75.0}
    assert descriptor["configuration"]["p"]["data"] == {"p-control_mode": "OPEN_LOOP"}


def test_a_piezo_in_closed_loop_scans_micrometres(plans: RunEngine, documents: Documents) -> None:
    controller = Controller(TPZ001, "virtual://TPZ001", max_travel_um=20)
    piezo = Piezo(controller, "p", loop="closed")
    with connected(piezo):
        run(lambda: controller.part.set_pos_control_mode(mode="CLOSED_LOOP"))
        plans(bp.rel_scan([], piezo, 0, 4, 3))
    assert [data["p"] for data in documents.data] == pytest.approx([0, 2, 4], abs=0.1)
    assert documents.of("descriptor")[0]["data_keys"]["p"]["units"] == "um"


def test_bays_of_a_piezo_controller_move_alone(plans: RunEngine, documents: Documents) -> None:
    controller = Controller(BPC203, "virtual://BPC203")
    one, two = Piezo(controller.bay(1), "one"), Piezo(controller.bay(2), "two")
    with connected(one, two):
        plans(bp.scan([two], one, 0, 10, 2))
    assert [data["one"] for data in documents.data] == pytest.approx([0, 10], abs=0.1)
    assert [data["two"] for data in documents.data] == pytest.approx([0, 0], abs=0.1)


def test_a_piezo_in_the_other_mode_refuses_a_value(plans: RunEngine, documents: Documents) -> None:
    piezo = Piezo(Controller(TPZ001, "virtual://TPZ001", max_travel_um=20), "p", loop="closed")
    with connected(piezo), pytest.raises(FailedStatus) as failure:
        plans(bp.scan([], piezo, 1, 2, 2))
    assert isinstance(failure.value.__cause__, NotReadyError)
    assert "the mode OPEN_LOOP" in str(failure.value.__cause__)
    assert documents.data == []


def test_a_voltage_beyond_the_maximum_is_refused(plans: RunEngine) -> None:
    piezo = Piezo(Controller(TPZ001, "virtual://TPZ001"), "p")
    with connected(piezo), pytest.raises(FailedStatus) as failure:
        plans(bps.mv(piezo, 76))
    assert isinstance(failure.value.__cause__, LimitError)


def test_a_stuck_actuator_fails(plans: RunEngine, documents: Documents) -> None:
    with virtual.TPZ001(faults=["stick channel=1"]).tcp() as tpz:
        controller = Controller(TPZ001, tpz.url, max_travel_um=20)
        piezo = Piezo(controller, "p", loop="closed")
        with connected(piezo):
            run(lambda: controller.part.set_pos_control_mode(mode="CLOSED_LOOP"))
            with pytest.raises(FailedStatus) as failure:
                plans(bp.list_scan([], piezo, [5]))
            assert isinstance(failure.value.__cause__, MotionTimeoutError)
    assert documents.data == []


@pytest.mark.parametrize("unit", [TSC001, KSC101], ids=lambda unit: unit.__name__)
def test_a_shutter_opens_and_closes(unit: type, plans: RunEngine, documents: Documents) -> None:
    shutter = Shutter(Controller(unit, f"virtual://{unit.__name__}"), "s")
    with connected(shutter):
        plans(bp.list_scan([], shutter, [ShutterState.OPEN, ShutterState.CLOSED]))
        plans(bps.mv(shutter, "Open"))
        assert run(shutter.locate)["readback"] is ShutterState.OPEN
    assert [data["s"] for data in documents.data] == ["Open", "Closed"]


def test_an_open_interlock_keeps_the_shutter_closed_and_fails(
    plans: RunEngine, documents: Documents
) -> None:
    with virtual.TSC001().tcp() as tsc:
        shutter = Shutter(Controller(TSC001, tsc.url), "s")
        with connected(shutter):
            instrument: Any = tsc.instrument
            behaviour = instrument.channel(1).behaviour
            tsc.call(setattr, behaviour, "interlock_closed", False)
            with pytest.raises(FailedStatus) as failure:
                plans(bp.list_scan([], shutter, [ShutterState.OPEN]))
            assert isinstance(failure.value.__cause__, MotionTimeoutError)
    assert documents.data == []


def test_a_shutter_in_an_automatic_mode_is_refused(plans: RunEngine) -> None:
    shutter = Shutter(Controller(TSC001, "virtual://TSC001"), "s")
    with connected(shutter):
        run(lambda: shutter.reference.part.set_sol_operating_mode(operating_mode="SOLENOID_AUTO"))
        with pytest.raises(FailedStatus) as failure:
            plans(bps.mv(shutter, "Open"))
        assert isinstance(failure.value.__cause__, NotReadyError)
        assert run(shutter.locate)["readback"] is ShutterState.CLOSED


def test_a_strain_gauge_reads_in_the_unit_of_its_display_mode(
    plans: RunEngine, documents: Documents
) -> None:
    gauge = StrainGauge(Controller(TSG001, "virtual://TSG001"), "g")
    with connected(gauge):
        plans(bp.count([gauge]))
        run(lambda: gauge.reference.part.change_tsg_io_settings(display_mode="DISPUNITS_FORCE"))
        plans(bp.count([gauge]))
    units = [one["data_keys"]["g"]["units"] for one in documents.of("descriptor")]
    assert units == ["um", "N"]


def test_a_gauge_whose_line_is_lost_records_no_event(
    plans: RunEngine, documents: Documents
) -> None:
    with virtual.TSG001().tcp() as tsg:
        gauge = StrainGauge(Controller(TSG001, tsg.url), "g")
        with connected(gauge):
            plans(bp.count([gauge]))
            tsg.unplug()
            with pytest.raises(Exception, match=r"lost|closed|cut") as failure:
                plans(bp.count([gauge]))
            assert not isinstance(failure.value, ReplyTimeoutError)
    assert len(documents.data) == 1


OUTPUTS: dict[str, tuple[Any, list[Any]]] = {
    "BPC203": (lambda url: Piezo(Controller(BPC203, url).bay(2), "x"), [1, 20]),
    "TPZ001": (lambda url: Piezo(Controller(TPZ001, url), "x"), [1, 20]),
    "TSC001": (lambda url: Shutter(Controller(TSC001, url), "x"), ["Open", "Closed"]),
}


@pytest.mark.parametrize("end", [Served.kill, Served.silence])
@pytest.mark.parametrize("unit", OUTPUTS)
def test_an_output_fails_when_its_server_ends(
    unit: str, end: Callable[[Served], None], plans: RunEngine, documents: Documents
) -> None:
    make, (first, second) = OUTPUTS[unit]
    with served(f"virtual://{unit}") as line:
        device = make(line.url)
        with connected(device):
            plans(bp.list_scan([], device, [first]))
            end(line)
            began = time.monotonic()
            with pytest.raises(FailedStatus) as failure:
                plans(bp.list_scan([], device, [second]))
            assert time.monotonic() - began < 5
            assert isinstance(cause_of(failure.value), TransportLostError | ReplyTimeoutError)
    assert len(documents.data) == 1
