"""An IOC within the test, whose records are put and read without a network."""

from __future__ import annotations

import asyncio
import tomllib
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Any

from stagewire_epics.autosave import Autosave
from stagewire_epics.bench import Bench
from stagewire_epics.ioc import Ioc, Server
from stagewire_epics.motor import Motor
from stagewire_epics.records import Record, Severity

SOON = 5.0
"""Seconds in which a motion must fail."""


class Posts(list[tuple[str, Any, Severity]]):
    """Posts of the records of a motor, in order: field, value, severity."""

    def of(self, *fields: str) -> list[tuple[str, Any]]:
        """Return the fields and values of some fields."""
        return [(field, value) for field, value, _ in self if field in fields]

    def follow(self, records: dict[str, Record]) -> None:
        """Note the posts of records by field."""
        for field, record in records.items():

            async def note(record: Record, field: str = field) -> None:
                self.append((field, record.value, record.alarm.severity))

            record.listen(note)


class Running:
    """An IOC that runs.

    :param ioc: the IOC, with one motor ``x``.
    """

    def __init__(self, ioc: Ioc) -> None:
        self.ioc = ioc
        [self.motor] = ioc.motors.values()
        self.end = asyncio.Event()
        self.posts = Posts()
        self.posts.follow(self.motor.records)

    def __getitem__(self, field: str) -> Any:
        return self.motor.records[field].value

    def severity(self, field: str = "RBV") -> Severity:
        return self.motor.records[field].alarm.severity

    async def put(self, field: str, value: Any) -> None:
        await self.motor.records[field].put(value)

    def begin(self, field: str, value: Any) -> asyncio.Task[None]:
        """Put without waiting."""
        return asyncio.create_task(self.put(field, value))

    async def until(self, field: str, value: Any, timeout: float = SOON) -> None:
        """Wait until a field has a value."""
        async with asyncio.timeout(timeout):
            while self[field] != value:
                await asyncio.sleep(0.005)

    async def beyond(self, position: float) -> None:
        """Wait until RBV is beyond a position."""
        async with asyncio.timeout(SOON):
            while self["RBV"] <= position:
                await asyncio.sleep(0.005)

    async def connected(self, *, now: bool = True) -> None:
        """Wait until the controller is connected, or lost."""
        async with asyncio.timeout(SOON):
            while (self.severity("SPMG") is not Severity.INVALID) is not now:
                await asyncio.sleep(0.005)


@asynccontextmanager
async def running(
    bench: str,
    server: Callable[[dict[str, Record]], Server] | None = None,
    *,
    connected: bool = True,
    autosave: Callable[[dict[str, Motor]], Autosave] | None = None,
) -> AsyncIterator[Running]:
    """Run an IOC with one motor ``x`` until the end of the block."""
    ioc = Ioc(Bench.model_validate(tomllib.loads(bench)))
    one = Running(ioc)
    end, ready = one.end, asyncio.Event()
    servers = [] if server is None else [server(ioc.records)]
    saving = None if autosave is None else autosave(ioc.motors)
    task = asyncio.create_task(ioc.run(servers, end, ready.set, saving))
    try:
        await ready.wait()
        if connected:
            await one.connected()
        yield one
    finally:
        end.set()
        await task


def bench_of(url: str, more: str = "", motor: str = "") -> str:
    """Return a bench with a TDC001 that moves a Z8, as motor ``x``."""
    return f"""
[controllers.t]
unit = "TDC001"
url = "{url}"
stage = "Z8"
travel_mm = 12
{more}
[motors.x]
controller = "t"
acceleration_time = 0.5
{motor}
"""
