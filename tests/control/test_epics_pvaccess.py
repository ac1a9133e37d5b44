"""pvAccess: clients of p4p and ophyd-async read, put and monitor the records of an IOC."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from typing import Any

import ca  # sets the addresses that ophyd-async reads
import pytest
from iocs import Running, bench_of, running
from lines import Line, recorded
from ophyd_async.core import Device, SignalR, SignalRW, StrictEnum, init_devices
from ophyd_async.epics.core import PviDeviceConnector
from ophyd_async.epics.motor import Motor
from p4p.client.asyncio import Context
from p4p.client.thread import RemoteError

import stagewire_virtual as virtual
from stagewire_apt import stages
from stagewire_epics.access import Access
from stagewire_epics.pvaccess import PvAccessServer

MOVE = bytes((0x53, 0x04, 0x06, 0x00, 0xD0, 0x01))


class Choice(StrictEnum):
    """The choices of SPMG."""

    STOP = "Stop"
    PAUSE = "Pause"
    MOVE = "Move"
    GO = "Go"


Body = Callable[[Context, Running, Line], Awaitable[None]]


def pva_test(body: Body, access: Access = Access()) -> Callable[[], None]:  # noqa: B008
    """Run a test with an IOC over a virtual TDC001, and a client."""

    async def within(line: Line) -> None:
        made: list[PvAccessServer] = []

        def servers(records: Any) -> PvAccessServer:
            made.append(PvAccessServer(records, access, ["127.0.0.1"], ca.PVA_PORT, 0))
            return made[0]

        async with running('prefix = "LAB:"\n' + bench_of(line.url), servers) as x:
            port, search = made[0].ports
            configuration = {
                "EPICS_PVA_ADDR_LIST": f"127.0.0.1:{search}",
                "EPICS_PVA_AUTO_ADDR_LIST": "NO",
                "EPICS_PVA_NAME_SERVERS": f"127.0.0.1:{port}",
            }
            with Context("pva", conf=configuration, useenv=False) as client:
                await body(client, x, line)

    def test() -> None:
        with virtual.TDC001(stage=stages.Z8).tcp() as tdc, recorded(tdc.url) as line:
            asyncio.run(within(line))

    test.__name__ = test.__qualname__ = body.__name__  # type: ignore[attr-defined]
    return test


@pva_test
async def test_fields_have_units_limits_choices_and_alarms(
    client: Context, x: Running, line: Line
) -> None:
    value = (await client.get("LAB:x")).raw
    assert (value["display.units"], value["display.precision"]) == ("mm", 5)
    assert (value["control.limitLow"], value["control.limitHigh"]) == (0.0, 12.0)
    assert (value["alarm.severity"], value["display.description"]) == (
        0,
        "target in user coordinates",
    )
    choice = (await client.get("LAB:x.SPMG")).raw
    assert list(choice["value.choices"]) == ["Stop", "Pause", "Move", "Go"]
    assert (await client.get("LAB:x.EGU")).raw["value"] == "mm"
    assert int(await client.get("LAB:x.DMOV")) == 1


@pva_test
async def test_a_put_completes_at_the_end_and_monitors_see_the_way(
    client: Context, x: Running, line: Line
) -> None:
    seen: list[float] = []

    async def note(value: Any) -> None:
        seen.append(float(value))

    with client.monitor("LAB:x.RBV", note):
        await client.put("LAB:x", 0.5)
        assert abs(float(await client.get("LAB:x.RBV")) - 0.5) < 1e-4
        assert int(await client.get("LAB:x.DMOV")) == 1
    assert len({round(value, 2) for value in seen}) > 3
    assert line.sent.count(MOVE) == 1


@pva_test
async def test_refused_and_stopped_puts_fail_with_the_reason(
    client: Context, x: Running, line: Line
) -> None:
    for field, value, said in (
        ("VAL", 12.5, "outside the limits, 0 to 12 mm"),
        ("RBV", 1.0, "is read-only"),
        ("VELO", -1.0, "is not above 0"),
    ):
        with pytest.raises(RemoteError, match=said):
            await client.put(f"LAB:x.{field}", value)
    assert MOVE not in line.sent
    moving = asyncio.create_task(client.put("LAB:x", 8.0))
    await x.beyond(0.1)
    await client.put("LAB:x.STOP", 1)
    with pytest.raises(RemoteError, match="STOP was put"):
        await moving
    assert (await client.get("LAB:x.RBV")).raw["alarm.severity"] == 1


@pva_test
async def test_a_choice_is_put_by_text(client: Context, x: Running, line: Line) -> None:
    await client.put("LAB:x.DIR", "Neg")
    assert (x["DIR"], x["LLM"], x["HLM"]) == (1, -12.0, 0.0)


@pva_test
async def test_the_structure_names_motors_and_their_fields(
    client: Context, x: Running, line: Line
) -> None:
    top = (await client.get("LAB:PVI"))["value"].todict()
    assert top == {"x": {"d": "LAB:x:PVI"}}
    fields = (await client.get("LAB:x:PVI"))["value"].todict()
    assert fields["val"] == {"rw": "LAB:x.VAL"}
    assert fields["rbv"] == {"r": "LAB:x.RBV"}
    assert fields["stop_"] == {"rw": "LAB:x.STOP"}
    assert len(fields) == len(x.motor.records)


class Filled(Device):
    """A device that is filled from the PVI structure, and states the types of a few signals."""

    val: SignalRW[float]
    rbv: SignalR[float]
    spmg: SignalRW[Choice]

    def __init__(self, prefix: str, name: str = "") -> None:
        super().__init__(name=name, connector=PviDeviceConnector(prefix))


@pva_test
async def test_ophyd_async_fills_devices_by_itself_and_its_motor_moves_without_changes(
    client: Context, x: Running, line: Line
) -> None:
    async with init_devices(timeout=ca.FOUND):
        device = Filled("LAB:x:")
        bench = Device(name="bench", connector=PviDeviceConnector("LAB:"))
        motor = Motor("pva://LAB:x", name="motor")
    assert {"velo", "dmov", "egu"} < {name for name, _ in device.children()}
    await device.val.set(0.25, timeout=10)
    assert abs(await device.rbv.get_value() - 0.25) < 1e-4
    assert await device.spmg.get_value() is Choice.GO
    assert isinstance(dict(bench.children())["x"], Device)

    await motor.set(0.5)
    assert abs((await motor.locate())["readback"] - 0.5) < 1e-4
    reading = await motor.read()
    assert abs(reading["motor"]["value"] - 0.5) < 1e-4
    assert (await motor.describe())["motor"]["units"] == "mm"


def test_read_only_refuses_all_puts_except_stop() -> None:
    async def body(client: Context, x: Running, line: Line) -> None:
        with pytest.raises(RemoteError, match="may not put values"):
            await client.put("LAB:x", 1.0)
        await client.put("LAB:x.STOP", 1)
        assert MOVE not in line.sent

    pva_test(body, Access(read_only=True))()


@pytest.mark.parametrize(
    ("user", "host", "allowed"),
    [("", "127.0.0.1", True), ("", "10.0.0.1", False), ("operator", "", False)],
)
def test_only_stated_hosts_and_users_can_put(user: str, host: str, allowed: bool) -> None:
    async def body(client: Context, x: Running, line: Line) -> None:
        if allowed:
            await client.put("LAB:x", 0.1)
        else:
            with pytest.raises(RemoteError, match="may not put values"):
                await client.put("LAB:x", 0.1)
        assert (MOVE in line.sent) is allowed

    access = Access(hosts=frozenset(filter(None, [host])), users=frozenset(filter(None, [user])))
    pva_test(body, access)()


def test_the_end_of_the_ioc_fails_the_put() -> None:
    moving: list[asyncio.Task[Any]] = []

    async def body(client: Context, x: Running, line: Line) -> None:
        moving.append(asyncio.create_task(client.put("LAB:x", 8.0)))
        await x.beyond(0.1)
        x.end.set()
        with pytest.raises(RemoteError, match="the IOC ends"):
            await moving[0]

    pva_test(body)()


@pva_test
async def test_a_put_without_a_value_moves_nothing(client: Context, x: Running, line: Line) -> None:
    await client.put("LAB:x", 0.3)
    sent = line.sent.count(MOVE)
    for name, put in (
        ("LAB:x", {}),
        ("LAB:x", {"alarm.severity": 1}),
        ("LAB:x.SPMG", {"value.choices": ["Go"]}),
    ):
        with pytest.raises(RemoteError, match="the put has no value"):
            await client.put(name, put)
    assert (line.sent.count(MOVE), x["VAL"], x["SPMG"]) == (sent, 0.3, 3)
