"""The IOC: opens the controllers of a bench, keeps them open, and publishes their records."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Sequence
from contextlib import suppress
from importlib import import_module
from typing import Any, Final, Protocol

from stagewire.discovery import device_class
from stagewire.errors import SessionClosedError, StagewireError
from stagewire_epics.autosave import Autosave
from stagewire_epics.bench import Bench, BenchError, ControllerTable, PartTable
from stagewire_epics.motor import Motor
from stagewire_epics.part import Part
from stagewire_epics.records import Record

_log = logging.getLogger("stagewire")
_AGAIN: Final = 2.0
"""Seconds between two attempts to open a controller."""
_CHECK: Final = 0.5
"""Seconds between two checks whether the line is lost."""
_CLOSING: Final = 3.0
"""Seconds in which motions end when the IOC ends."""


class Server(Protocol):
    """Publishes records on a network."""

    async def start(self) -> None:
        """Begin to serve."""

    async def close(self) -> None:
        """Stop serving."""


class _Controller:
    """A controller of the bench, opened again after its line was lost."""

    def __init__(self, name: str, table: ControllerTable) -> None:
        self.name = name
        self.table = table
        package = device_class(table.unit).__module__.partition(".")[0]
        self.kind: Any = getattr(import_module(f"{package}.aio"), device_class(table.unit).__name__)
        self.parts: list[Part] = []
        self.device: Any = None
        self._lost = asyncio.Event()
        self._error: StagewireError = SessionClosedError(f"{table.url} is not open yet")

    def add(self, name: str, table: PartTable) -> Part:
        """Add a part; raise :class:`BenchError` for one that the controller lacks."""
        kind = self.kind
        for step, _ in table.steps:
            inside = getattr(kind, f"{step}_class", None)
            if inside is None:
                raise BenchError(f"{name}: a {kind.__name__} has no {step}")
            kind = inside
        self.parts.append(Part(name, kind, self.table, table, self.lost))
        return self.parts[-1]

    def lost(self, error: StagewireError) -> None:
        """Note that the line is lost."""
        if not self._lost.is_set():
            self._error = error
            self._lost.set()

    async def keep(self) -> None:
        """Open the controller, and open it again whenever it is lost.

        Nothing moves, and no move is repeated.
        """
        said = ""
        while True:
            self._lost.clear()
            try:
                await self._open()
                said = ""
                _log.warning("%s: %s at %s is open", self.name, self.table.unit, self.table.url)
                await self._watch()
            except StagewireError as error:
                self._error = error
            if str(self._error) != said:
                said = str(self._error)
                _log.warning("%s: %s", self.name, said)
            for one in self.parts:
                await one.detach(self._error)
            await asyncio.sleep(_AGAIN)

    async def _open(self) -> None:
        if self.device is None:
            self.device = await self.kind.open(self.table.url, **self.table.options)
        else:
            await self.device.reconnect()
        if hasattr(self.kind, "switch_to_low_level"):
            await self.device.switch_to_low_level()
        for one in self.parts:
            part = self.device
            for name, argument in one.steps:
                part = getattr(part, name)(argument)
            await one.attach(part)

    async def _watch(self) -> None:
        watching = [asyncio.create_task(one.watch()) for one in self.parts]
        try:
            while not self._lost.is_set():  # parts without a motor may request nothing
                with suppress(TimeoutError):
                    async with asyncio.timeout(_CHECK):
                        await self._lost.wait()
                session = self.device.session
                if session.lost or session.closed:
                    self.lost(SessionClosedError(f"{self.table.url} is lost"))
        finally:
            for task in watching:
                task.cancel()
            await asyncio.gather(*watching, return_exceptions=True)

    async def close(self) -> None:
        """Stop the motions that clients asked for, and close the line."""
        with suppress(TimeoutError):
            async with asyncio.timeout(_CLOSING):
                await asyncio.gather(*(one.close() for one in self.parts), return_exceptions=True)
        if self.device is not None:
            with suppress(StagewireError):
                await self.device.close()


class Ioc:
    """An IOC.

    :param bench: its controllers and motors.

    Raise :class:`~stagewire_epics.bench.BenchError` for parts that a controller does not have.
    """

    def __init__(self, bench: Bench) -> None:
        self.records: dict[str, Record] = {}
        """The records by each of their names."""
        self.motors: dict[str, Motor] = {}
        """The motors by the name of their record."""
        self._controllers = {
            name: _Controller(name, table) for name, table in bench.controllers.items()
        }
        for name, table in (*bench.motors.items(), *bench.parts.items()):
            controller = self._controllers[table.controller]
            part = controller.add(bench.prefix + name, table)
            self.records |= part.records()
            if part.motor is not None:
                self.motors[part.name] = part.motor

    async def run(
        self,
        servers: Sequence[Server],
        end: asyncio.Event,
        ready: Callable[[], None],
        autosave: Autosave | None = None,
    ) -> None:
        """Serve until an event is set; then fail open puts, stop the axes and end.

        :param servers: publish :attr:`records`.
        :param end: ends the IOC.
        :param ready: called when clients can connect.
        :param autosave: saves the coordinates of the motors.
        """
        started: list[Server] = []
        keeping = [asyncio.create_task(one.keep()) for one in self._controllers.values()]
        try:
            for server in servers:
                await server.start()
                started.append(server)
            ready()
            await end.wait()
        finally:
            for task in keeping:
                task.cancel()
            await asyncio.gather(
                *(one.close() for one in self._controllers.values()), return_exceptions=True
            )
            await asyncio.gather(*keeping, return_exceptions=True)
            for server in started:
                await server.close()
            if autosave is not None:
                await autosave.close()
