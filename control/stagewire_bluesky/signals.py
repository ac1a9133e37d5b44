"""Signals whose values are read from a controller."""

from __future__ import annotations

import asyncio
import logging
import math
import time
from collections.abc import Awaitable, Callable
from contextlib import suppress
from typing import Any, Final, Generic

from bluesky.protocols import Reading
from event_model import DataKey
from ophyd_async.core import (
    Callback,
    SignalBackend,
    SignalDatatypeT,
    SignalMetadata,
    SignalR,
    SignalRW,
    make_datakey,
)

from stagewire.errors import LimitError, MotionUnderWayError, StagewireError
from stagewire_bluesky.controller import Reference

_log = logging.getLogger("stagewire")

POLL: Final = 0.2
"""Seconds between two requests while a value is observed; controllers polled much faster have failed."""


_INVALID: Final = 3
"""The alarm severity of a value that is not known."""


def no_metadata(part: Any) -> SignalMetadata:
    """Return the metadata of a value without a unit."""
    return {}


class PartBackend(SignalBackend[SignalDatatypeT], Generic[SignalDatatypeT]):
    """Reads a value from a part of a controller, and may write it.

    Every reading is a request to the controller. An error is raised, and never replaced by an old value.
    Subscribers receive a value every :data:`POLL` seconds, and at the end of each motion. If the controller
    does not answer, they receive NaN once, if the value is a float: ophyd-async keeps the last value for
    them, and derived signals would be computed from it.

    :param reference: the part.
    :param datatype: type of the value.
    :param read: returns the value of an open part.
    :param write: writes the value; returns when the controller has it.
    :param metadata: returns the unit, precision and limits for an open part.
    """

    def __init__(
        self,
        reference: Reference,
        datatype: type[SignalDatatypeT],
        read: Callable[[Any], Awaitable[SignalDatatypeT]],
        write: Callable[[Any, SignalDatatypeT], Awaitable[None]] | None = None,
        metadata: Callable[[Any], SignalMetadata] = no_metadata,
    ) -> None:
        super().__init__(datatype)
        self._type = datatype
        self._reference = reference
        self._read = read
        self._write = write
        self._metadata = metadata
        self._setpoint: SignalDatatypeT | None = None
        self._callback: Callback[Reading[SignalDatatypeT]] | None = None
        self._poller: asyncio.Task[None] | None = None
        self._publishing = asyncio.Lock()

    def source(self, name: str, read: bool) -> str:
        """Return the URL of the line and the name of the part."""
        return f"stagewire {self._reference.source} {name}".rstrip()

    async def connect(self, timeout: float) -> None:
        """Open the controller, unless it is open."""
        async with asyncio.timeout(timeout):
            await self._reference.controller.connect()

    async def put(self, value: SignalDatatypeT | None) -> None:
        """Write a value, and return when the controller has it or the motion has ended."""
        if self._write is None or value is None:
            raise ValueError("this value cannot be set")
        before, self._setpoint = self._setpoint, value
        try:
            await self._write(self._reference.part, value)
        except (LimitError, MotionUnderWayError):  # nothing was sent
            self._setpoint = before
            raise

    async def get_datakey(self, source: str) -> DataKey:
        """Return the type, unit, precision and limits."""
        part = self._reference.part
        return make_datakey(self._type, await self._read(part), source, self._metadata(part))

    async def get_reading(self) -> Reading[SignalDatatypeT]:
        """Request the value."""
        value = await self._read(self._reference.part)
        return Reading(value=value, timestamp=time.time(), alarm_severity=0)

    async def get_value(self) -> SignalDatatypeT:
        """Request the value."""
        return await self._read(self._reference.part)

    async def get_setpoint(self) -> SignalDatatypeT:
        """Return the value that was set last, or the present one if none was."""
        return await self.get_value() if self._setpoint is None else self._setpoint

    def set_callback(self, callback: Callback[Reading[SignalDatatypeT]] | None) -> None:
        """Start or stop polling the value."""
        if self._poller is not None:
            self._poller.cancel()
            self._poller = None
        self._callback = callback
        if callback is not None:
            self._poller = asyncio.create_task(self._poll())

    async def refresh(self) -> None:
        """Request the value for subscribers now, such as at the end of a motion."""
        if self._callback is not None:
            async with self._publishing:  # otherwise an earlier value might be published later
                self._publish(await self.get_reading())

    async def _poll(self) -> None:
        failed = False
        while True:
            try:
                await self.refresh()
                failed = False
            except StagewireError as error:
                if not failed:
                    _log.warning("%s is not updated: %s", self._reference.source, error)
                    self._publish_nothing()
                failed = True
            await asyncio.sleep(POLL)

    def _publish_nothing(self) -> None:
        if self._type is float:
            nan: Any = math.nan
            self._publish(Reading(value=nan, timestamp=time.time(), alarm_severity=_INVALID))

    def _publish(self, reading: Reading[SignalDatatypeT]) -> None:
        if self._callback is not None:
            try:
                self._callback(reading)
            except Exception:  # one subscriber must not end the updates of the others
                _log.exception("%s: a subscriber failed", self._reference.source)


class SetpointBackend(PartBackend[SignalDatatypeT]):
    """The target of a motion; setting it moves, and returns at the end of the motion.

    :param target: returns the value to report, for an open part and the target that was set last, or None.
    """

    def __init__(
        self,
        reference: Reference,
        datatype: type[SignalDatatypeT],
        target: Callable[[Any, SignalDatatypeT | None], Awaitable[SignalDatatypeT]],
        write: Callable[[Any, SignalDatatypeT], Awaitable[None]],
        metadata: Callable[[Any], SignalMetadata] = no_metadata,
    ) -> None:
        async def read(part: Any) -> SignalDatatypeT:
            return await target(part, self._setpoint)

        super().__init__(reference, datatype, read, write, metadata)


def readable(
    reference: Reference,
    datatype: type[SignalDatatypeT],
    read: Callable[[Any], Awaitable[SignalDatatypeT]],
    metadata: Callable[[Any], SignalMetadata] = no_metadata,
) -> SignalR[SignalDatatypeT]:
    """Return a signal that can be read."""
    return SignalR(PartBackend(reference, datatype, read, None, metadata))


async def put(
    signal: SignalRW[SignalDatatypeT], value: SignalDatatypeT, timeout: float | None
) -> None:
    """Set a signal.

    A timeout of the library is raised unchanged. ophyd-async replaces it by one that only has the name of the
    signal.
    """
    try:
        await signal.set(value, timeout=timeout)
    except TimeoutError as error:
        if isinstance(error.__cause__, StagewireError):
            raise error.__cause__ from None
        raise


async def dropped(task: asyncio.Future[Any]) -> None:
    """Cancel a task, and wait until it has ended."""
    task.cancel()
    with suppress(asyncio.CancelledError, StagewireError):
        await task
