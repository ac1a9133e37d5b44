"""PVI: ophyd-async fills devices from the structures, whatever the names of the records."""

from __future__ import annotations

from keyword import kwlist

import pytest
from ophyd_async.core import Device, SignalR, SignalRW, StrictEnum, init_devices
from ophyd_async.core._device import DEVICE_RESERVED_ATTRS
from ophyd_async.epics.core import PviDeviceConnector
from p4p.client.asyncio import Context
from p4p.client.thread import RemoteError
from pva import Puts, Served, serve

from stagewire.errors import StagewireError
from stagewire_epics.pvi import structures
from stagewire_epics.records import Kind, Record


def entries(*names: str) -> dict[str, dict[str, dict[str, str]]]:
    """Return the entries of the structures of records with names."""
    records = [Record(name, Kind.FLOAT) for name in names]
    return {name: value["value"].todict() for name, value in structures(records)}


def test_structures_follow_from_names() -> None:
    puts = Puts()
    records = [
        Record("LAB:x.VAL", Kind.FLOAT, put=puts),
        Record("LAB:x.RBV", Kind.FLOAT),
        Record("LAB:x:VEL_PARAMS:ACCEL", Kind.FLOAT),
    ]
    found = {name: value["value"].todict() for name, value in structures([*records, records[0]])}
    assert found == {
        "LAB:PVI": {"x": {"d": "LAB:x:PVI"}},
        "LAB:x:PVI": {
            "val": {"rw": "LAB:x.VAL"},
            "rbv": {"r": "LAB:x.RBV"},
            "vel_params": {"d": "LAB:x:VEL_PARAMS:PVI"},
        },
        "LAB:x:VEL_PARAMS:PVI": {"accel": {"r": "LAB:x:VEL_PARAMS:ACCEL"}},
    }


@pytest.mark.parametrize(
    ("names", "expected"),
    [
        (["L:1.V"], ["_1"]),
        (["L:a-b.V", "L:a_b.V", "L:A-B.V"], ["a_b", "a_b_", "a_b__"]),
        (["L:stop.V", "L:Stage.V"], ["stop_", "stage_"]),
        (["L:in.V"], ["in_"]),
        (["L:x", "L:x.V"], ["x", "x_"]),
    ],
)
def test_each_record_has_an_entry_of_its_own(names: list[str], expected: list[str]) -> None:
    assert list(entries(*names)["L:PVI"]) == expected


def test_no_entry_is_a_name_that_devices_or_python_reserve() -> None:
    reserved = {*DEVICE_RESERVED_ATTRS, *(name for name in dir(Device) if name[0] != "_"), *kwlist}
    found = entries(*(f"L:{name}.V" for name in sorted(reserved)))["L:PVI"]
    assert len(found) == len(reserved)
    assert not reserved & set(found)


class Mode(StrictEnum):
    """The choices of a record."""

    OFF = "Off"
    ON = "On"


class Part(Device):
    """A device that states a few of its signals; others are added."""

    position: SignalRW[float]
    mode: SignalRW[Mode]
    count: SignalR[int]


class Lab(Device):
    """A device that is filled from the structure of a whole IOC."""

    x: Part

    def __init__(self, prefix: str, name: str = "") -> None:
        super().__init__(name=name, connector=PviDeviceConnector(prefix))


def test_ophyd_async_fills_reads_and_sets_a_device(monkeypatch: pytest.MonkeyPatch) -> None:
    async def move(value: float) -> None:
        if value > 10:
            raise StagewireError("outside the limits, 0 to 10 mm")
        await position.post(value)

    async def switch(value: int) -> None:
        await mode.post(value)

    position = Record("L:x.POSITION", Kind.FLOAT, 0.5, put=move, unit="mm", precision=4)
    mode = Record("L:x.MODE", Kind.CHOICE, 0, put=switch, choices=("Off", "On"))
    records = [
        position,
        mode,
        Record("L:x.COUNT", Kind.INTEGER, 7),
        Record("L:x.STOP", Kind.INTEGER, 0, put=switch),
        Record("L:x:MORE:TEXT", Kind.TEXT, "a"),
        Record("L:1.V", Kind.FLOAT, 1.25),
    ]

    async def body(served: Served, client: Context) -> None:
        with served.client(nt=False) as plain:
            monkeypatch.setattr("ophyd_async.epics.core._p4p._context", plain)
            await use()

    async def use() -> None:
        async with init_devices():
            lab = Lab("L:", name="lab")
        x = lab.x
        assert {name for name, _ in x.children()} == {"position", "mode", "count", "stop_", "more"}
        await x.position.set(2.25, timeout=5)
        assert (position.value, await x.position.get_value()) == (2.25, 2.25)
        await x.mode.set(Mode.ON, timeout=5)
        assert (mode.value, await x.mode.get_value()) == (1, Mode.ON)
        assert await x.count.get_value() == 7
        assert not hasattr(x.count, "set")
        assert await x.more.text.get_value() == "a"  # type: ignore[attr-defined]
        assert await dict(lab.children())["_1"].v.get_value() == 1.25  # type: ignore[attr-defined]
        described = (await x.position.describe())["lab-x-position"]
        assert (described["units"], described["precision"]) == ("mm", 4)
        with pytest.raises(RemoteError, match="outside the limits"):
            await x.position.set(11.0, timeout=5)

    serve(body, *records)
