"""Records that are served by pvAccess, and clients of them."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from typing import Any

from p4p.client.asyncio import Context

from stagewire_epics.access import Access
from stagewire_epics.pvaccess import PvAccessServer
from stagewire_epics.records import Record

SOON = 5.0
"""Seconds within which every answer arrives."""


class Served:
    """A server of records.

    :param server: the server, started.
    """

    def __init__(self, server: PvAccessServer) -> None:
        self.server = server
        self.port, self.search_port = server.ports

    def client(self, **options: Any) -> Context:
        """Return a new client, which ends with its context."""
        configuration = {
            "EPICS_PVA_ADDR_LIST": f"127.0.0.1:{self.search_port}",
            "EPICS_PVA_AUTO_ADDR_LIST": "NO",
        }
        return Context("pva", conf=configuration, useenv=False, **options)


Body = Callable[[Served, Context], Awaitable[None]]


def serve(body: Body, *records: Record, access: Access | None = None) -> None:
    """Run a test while records are served, with a client."""

    async def run() -> None:
        named = {record.name: record for record in records}
        server = PvAccessServer(named, access or Access(), ["127.0.0.1"], 0, 0)
        await server.start()
        served = Served(server)
        try:
            with served.client() as client:
                await body(served, client)
        finally:
            await server.close()

    asyncio.run(run())


async def put(client: Context, name: str, value: Any) -> None:
    """Put a value; fail if the answer does not arrive soon."""
    await asyncio.wait_for(client.put(name, value), SOON)


class Puts(list[Any]):
    """Keeps the values that clients put.

    :param held: whether puts wait until :attr:`released` is set.
    """

    def __init__(self, *, held: bool = False) -> None:
        self.arrived = asyncio.Event()
        self.released = asyncio.Event()
        if not held:
            self.released.set()

    async def __call__(self, value: Any) -> None:
        self.append(value)
        self.arrived.set()
        await self.released.wait()
