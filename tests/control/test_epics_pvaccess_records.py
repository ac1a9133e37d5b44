"""pvAccess: values, alarms, metadata and puts of records, without a motor."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest
from p4p.client.asyncio import Context
from p4p.client.thread import RemoteError
from p4p.nt import NTScalar
from pva import SOON, Puts, Served, put, serve

from stagewire.errors import StagewireError
from stagewire_epics.access import Access
from stagewire_epics.pvaccess import PvAccessServer
from stagewire_epics.records import Alarm, Kind, Record, Severity, Status


@pytest.mark.parametrize(
    ("kind", "value", "other", "type_code"),
    [
        (Kind.FLOAT, 1.5, -2.25, "d"),
        (Kind.INTEGER, -3, 2**53, "l"),
        (Kind.TEXT, "a \N{MICRO SIGN}m", "", "s"),
        (Kind.CHOICE, 1, 0, None),
    ],
)
def test_values_of_each_kind_are_read_put_and_posted(
    kind: Kind, value: Any, other: Any, type_code: str | None
) -> None:
    puts = Puts()
    record = Record("A:x.V", kind, value, put=puts, choices=("No", "Yes"), description="what")

    async def body(_: Served, client: Context) -> None:
        raw = (await client.get("A:x.V")).raw
        assert raw["display.description"] == "what"
        if type_code is None:
            assert raw.getID() == "epics:nt/NTEnum:1.0"
            assert list(raw["value.choices"]) == ["No", "Yes"]
        else:
            assert raw.getID() == "epics:nt/NTScalar:1.0"
            assert raw.type()["value"] == type_code
        field = "value.index" if type_code is None else "value"
        assert raw[field] == value
        await put(client, "A:x.V", other)
        assert puts == [other]
        await record.post(other)
        assert (await client.get("A:x.V")).raw[field] == other

    serve(body, record)


def test_alarms_times_and_changed_metadata_reach_clients() -> None:
    record = Record("A:x.V", Kind.FLOAT, unit="mm", precision=3, limits=(-1.0, 2.0))

    async def body(_: Served, client: Context) -> None:
        raw = (await client.get("A:x.V")).raw
        assert raw["alarm"].todict() == {"severity": 3, "status": 17, "message": "no value yet"}
        assert (raw["display.units"], raw["display.precision"]) == ("mm", 3)
        assert (raw["control.limitLow"], raw["control.limitHigh"]) == (-1.0, 2.0)

        record.unit, record.precision, record.limits = "deg", 1, (0.0, 360.0)
        await record.post(4.0, Alarm(Severity.MAJOR, Status.HW_LIMIT, "at the limit"))
        raw = (await client.get("A:x.V")).raw
        assert raw["alarm"].todict() == {"severity": 2, "status": 11, "message": "at the limit"}
        assert (raw["display.units"], raw["display.precision"]) == ("deg", 1)
        assert (raw["display.limitLow"], raw["display.limitHigh"]) == (0.0, 360.0)
        seconds = raw["timeStamp.secondsPastEpoch"] + raw["timeStamp.nanoseconds"] / 1e9
        assert abs(seconds - record.time) < 1e-6

    serve(body, record)


def test_a_put_completes_when_the_record_has_carried_it_out() -> None:
    puts = Puts(held=True)

    async def body(_: Served, client: Context) -> None:
        putting = asyncio.create_task(put(client, "A:x.V", 1.0))
        await puts.arrived.wait()
        await asyncio.sleep(0.1)
        assert not putting.done()
        puts.released.set()
        await putting

    serve(body, Record("A:x.V", Kind.FLOAT, 0.0, put=puts))


def test_puts_do_not_wait_for_each_other() -> None:
    moves, stops = Puts(held=True), Puts()

    async def body(served: Served, client: Context) -> None:
        with served.client() as other:
            putting = [
                asyncio.create_task(put(one, "A:x.V", float(number)))
                for number, one in enumerate((client, client, other))
            ]
            async with asyncio.timeout(SOON):
                while len(moves) < 3:
                    await asyncio.sleep(0.01)
            await put(client, "A:x.STOP", 1)
            assert stops == [1]
            assert not any(one.done() for one in putting)
            moves.released.set()
            await asyncio.gather(*putting)

    serve(
        body,
        Record("A:x.V", Kind.FLOAT, 0.0, put=moves),
        Record("A:x.STOP", Kind.INTEGER, 0, put=stops, stops=True),
    )


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (StagewireError("outside the limits, 0 to 12 mm"), "outside the limits, 0 to 12 mm"),
        (RuntimeError("a defect"), "a defect"),
    ],
)
def test_errors_of_the_record_are_the_error_of_the_put(
    error: Exception, said: str, caplog: pytest.LogCaptureFixture
) -> None:
    async def fail(_: Any) -> None:
        raise error

    async def body(_: Served, client: Context) -> None:
        with pytest.raises(RemoteError, match=said):
            await put(client, "A:x.V", 1.0)

    serve(body, Record("A:x.V", Kind.FLOAT, 0.0, put=fail))
    (failed,) = (one for one in caplog.records if "a put failed" in one.getMessage())
    assert (failed.exc_info is None) is isinstance(error, StagewireError)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("A:x.V", {}),
        ("A:x.V", {"alarm.severity": 1}),
        ("A:x.V", NTScalar.buildType("d")()),
        ("A:x.V", float("nan")),
        ("A:x.C", {"value.choices": ["No"]}),
        ("A:x.C", 7),
        ("A:x.R", 1.0),
        ("A:x:PVI", {"value.v.rw": "A:x.C"}),
    ],
)
def test_puts_that_are_not_a_value_do_not_reach_the_record(name: str, value: Any) -> None:
    puts = Puts()

    async def body(_: Served, client: Context) -> None:
        with pytest.raises(RemoteError):
            await put(client, name, value)
        assert puts == []

    serve(
        body,
        Record("A:x.V", Kind.FLOAT, 5.0, put=puts),
        Record("A:x.C", Kind.CHOICE, 1, put=puts, choices=("No", "Yes")),
        Record("A:x.R", Kind.FLOAT, 5.0),
    )


@pytest.mark.parametrize(
    ("access", "permitted"),
    [
        (Access(), True),
        (Access(read_only=True), False),
        (Access(hosts=frozenset({"127.0.0.1"})), True),
        (Access(hosts=frozenset({"192.0.2.1"})), False),
        (Access(users=frozenset({"nobody else"})), False),
    ],
)
def test_clients_without_access_can_only_stop(access: Access, permitted: bool) -> None:
    moves, stops = Puts(), Puts()

    async def body(_: Served, client: Context) -> None:
        if permitted:
            await put(client, "A:x.V", 1.0)
        else:
            with pytest.raises(RemoteError, match=r"A:x\.V: this client may not put values"):
                await put(client, "A:x.V", 1.0)
        await put(client, "A:x.STOP", 1)
        assert (moves, stops) == ([1.0] if permitted else [], [1])
        assert await client.get("A:x.V") == 0.0

    serve(
        body,
        Record("A:x.V", Kind.FLOAT, 0.0, put=moves),
        Record("A:x.STOP", Kind.INTEGER, 0, put=stops, stops=True),
        access=access,
    )


def test_monitors_see_posts_in_order_and_before_the_put_completes() -> None:
    async def post(value: float) -> None:
        await record.post(value)

    record = Record("A:x.V", Kind.FLOAT, 0.0, put=post)

    async def body(served: Served, client: Context) -> None:
        seen: list[list[float]] = []
        with served.client() as other:

            def follow(one: Context) -> Any:
                values: list[float] = []
                seen.append(values)

                async def note(value: Any) -> None:
                    values.append(float(value))

                return one.monitor("A:x.V", note)

            following = [follow(one) for one in (client, other, other)]
            for number in range(1, 101):
                await put(client, "A:x.V", float(number))
                assert await other.get("A:x.V") == number
            async with asyncio.timeout(SOON):
                while any(not values or values[-1] != 100 for values in seen):
                    await asyncio.sleep(0.01)
            for one in following:
                one.close()
        assert all(values == sorted(values) for values in seen)
        assert all(len(values) > 50 for values in seen)

    serve(body, record)


def test_a_put_is_carried_out_although_its_client_has_left() -> None:
    puts = Puts(held=True)

    async def body(served: Served, client: Context) -> None:
        with served.client() as leaving:
            putting = asyncio.create_task(put(leaving, "A:x.V", 1.0))
            await puts.arrived.wait()
            putting.cancel()
        puts.released.set()
        await put(client, "A:x.V", 2.0)
        assert puts == [1.0, 2.0]

    serve(body, Record("A:x.V", Kind.FLOAT, 0.0, put=puts))


def test_open_puts_fail_when_the_server_closes_and_records_stay_usable() -> None:
    puts = Puts(held=True)
    record = Record("A:x.V", Kind.FLOAT, 0.0, put=puts)

    async def body(served: Served, client: Context) -> None:
        putting = [asyncio.create_task(put(client, "A:x.V", 1.0)) for _ in range(20)]
        async with asyncio.timeout(SOON):
            while len(puts) < len(putting):
                await asyncio.sleep(0.01)
        await served.server.close()
        for one in putting:
            with pytest.raises(RemoteError, match=r"A:x\.V: the IOC has ended"):
                await one
        await record.post(2.0)

    serve(body, record)


def test_an_address_of_another_machine_is_an_error() -> None:
    async def body() -> None:
        server = PvAccessServer({}, Access(), ["192.0.2.1"], 0, 0)
        with pytest.raises(OSError, match=r"pvAccess on 192\.0\.2\.1: Cannot assign"):
            await server.start()
        await server.close()

    asyncio.run(body())
