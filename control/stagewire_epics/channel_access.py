"""Channel Access: a server for records, by caproto."""

from __future__ import annotations

import asyncio
import errno
import logging
import os
from collections.abc import Mapping, Sequence
from typing import Any, Final

from caproto import (
    AccessRights,
    CaprotoRuntimeError,
    ChannelData,
    ChannelDouble,
    ChannelEnum,
    ChannelInteger,
    ChannelString,
    SubscriptionType,
)

from stagewire_epics.access import Access
from stagewire_epics.circuits import Circuits
from stagewire_epics.records import Kind, PutRefusedError, Record

_log = logging.getLogger("stagewire")
_BACKLOG: Final = 100
"""Events of a monitor that are kept for its client."""
_STOPPING: Final = 0.2
"""Seconds in which the answers of failed puts are sent before the server ends."""


class ChannelAccessServer:
    """A server of Channel Access.

    :param records: the records by name; a record may have several names.
    :param access: who may put values.
    :param addresses: addresses to listen on.
    :param port: UDP port of searches, and TCP port of connections.
    """

    def __init__(
        self, records: Mapping[str, Record], access: Access, addresses: Sequence[str], port: int
    ) -> None:
        self._records = records
        self._access = access
        self._addresses = addresses
        self._port = port
        self._task: asyncio.Task[None] | None = None

    async def start(self) -> None:
        """Begin to serve, and return when clients can connect.

        Raise :class:`OSError` for an address of another computer and for a port that another server on this
        computer has. Several servers can share a port only where searches are broadcast, so not on loopback.
        """
        channels: dict[int, ChannelData] = {}
        for record in self._records.values():
            if id(record) not in channels:
                channels[id(record)] = channel = _CHANNELS[record.kind](
                    record, self._access, reported_record_type=record.record_type
                )
                record.listen(channel.publish_record)
        environment = {
            "EPICS_CA_SERVER_PORT": str(self._port),
            "EPICS_CAS_BEACON_ADDR_LIST": " ".join(self._addresses),
            "EPICS_CAS_AUTO_BEACON_ADDR_LIST": "NO",
        }
        if "0.0.0.0" in self._addresses:
            environment |= {
                "EPICS_CAS_BEACON_ADDR_LIST": "",
                "EPICS_CAS_AUTO_BEACON_ADDR_LIST": "YES",
            }
        os.environ.update(environment)
        context = Circuits(
            {name: channels[id(record)] for name, record in self._records.items()},
            list(self._addresses),
        )
        started = asyncio.Event()

        async def when_started(_: Any) -> None:
            started.set()

        self._task = asyncio.create_task(context.run(startup_hook=when_started))
        waiting = asyncio.ensure_future(started.wait())
        await asyncio.wait({self._task, waiting}, return_when=asyncio.FIRST_COMPLETED)
        waiting.cancel()
        listening = ", ".join(self._addresses)
        if self._task.done():
            try:
                await self._task
            except CaprotoRuntimeError as error:
                why = getattr(error.__cause__, "strerror", None) or error
                raise OSError(errno.EADDRNOTAVAIL, f"cannot listen on {listening}: {why}") from None
        logging.getLogger("caproto").setLevel(logging.CRITICAL)
        if context.port != self._port:
            taken = f"another server has port {self._port} on {listening}"
            if all(address.startswith("127.") for address in self._addresses):
                await self.close()
                raise OSError(errno.EADDRINUSE, f"{taken}; choose another port")
            _log.warning("%s: connections are accepted on port %d", taken, context.port)

    async def close(self) -> None:
        """End the server. Fail open puts first, so that their clients receive the error."""
        if self._task is not None:
            await asyncio.sleep(_STOPPING)
            self._task.cancel()
            await asyncio.wait({self._task})


class _Channel(ChannelData):  # type: ignore[misc]
    """The channel of a record."""

    def __init__(self, record: Record, access: Access, **options: Any) -> None:
        super().__init__(value=_plain(record), max_subscription_backlog=_BACKLOG, **options)
        self._record = record
        self._access = access

    def check_access(self, hostname: str, username: str) -> AccessRights:
        if self._access.permits(self._record, username, hostname):
            return AccessRights.READ | AccessRights.WRITE
        return AccessRights.READ

    async def write(self, value: Any, *, flags: int = 0, **metadata: Any) -> None:
        """Put the value of a client into the record; the record publishes the result."""
        await self._record.put(self.preprocess_value(value))

    async def subscribe(self, queue: Any, sub_spec: Any, sub: Any) -> None:
        """Subscribe a client, unless its type cannot hold the value: no later event could be published."""
        try:
            await super().subscribe(queue, sub_spec, sub)
        except Exception:
            await self.unsubscribe(queue, sub_spec)
            raise

    async def publish_record(self, record: Record) -> None:
        """Publish the value and alarm of the record."""
        alarm = record.alarm
        await self.alarm.write(
            status=alarm.status,
            severity=alarm.severity,
            alarm_string=alarm.message[:39],
            publish=False,
        )
        await self._write_published(_plain(record), flags=_CHANGED, **self._metadata())

    async def _write_published(self, value: Any, **metadata: Any) -> None:
        await ChannelData.write(self, value, verify_value=False, **metadata)

    def _metadata(self) -> dict[str, Any]:
        return {"timestamp": self._record.time}


class _Number(_Channel):
    def _metadata(self) -> dict[str, Any]:
        low, high = self._record.limits
        return {
            **super()._metadata(),
            "units": self._record.unit,
            "lower_ctrl_limit": low,
            "upper_ctrl_limit": high,
            "lower_disp_limit": low,
            "upper_disp_limit": high,
        }


class _Float(_Number, ChannelDouble):  # type: ignore[misc]
    def _metadata(self) -> dict[str, Any]:
        return {**super()._metadata(), "precision": self._record.precision}


class _Integer(_Number, ChannelInteger):  # type: ignore[misc]
    pass


class _Text(_Channel, ChannelString):  # type: ignore[misc]
    async def subscribe(self, queue: Any, sub_spec: Any, sub: Any) -> None:
        """Subscribe a client to texts; a later text may not be a number."""
        if "STRING" not in sub_spec.data_type_name:
            raise PutRefusedError(f"{self._record.name} is a text")
        await super().subscribe(queue, sub_spec, sub)


class _Choice(_Channel, ChannelEnum):  # type: ignore[misc]
    def __init__(self, record: Record, access: Access, **options: Any) -> None:
        super().__init__(record, access, enum_strings=record.choices, **options)


_CHANNELS: Final = {
    Kind.FLOAT: _Float,
    Kind.INTEGER: _Integer,
    Kind.TEXT: _Text,
    Kind.CHOICE: _Choice,
}
_CHANGED: Final = (
    SubscriptionType.DBE_VALUE
    | SubscriptionType.DBE_LOG
    | SubscriptionType.DBE_ALARM
    | SubscriptionType.DBE_PROPERTY
)


def _plain(record: Record) -> Any:
    """Return the value of a record as one of caproto."""
    if record.kind is Kind.CHOICE:
        return record.choices[int(record.value)] if record.choices else record.value
    if record.kind is Kind.TEXT:
        return str(record.value)[:39]
    return record.value
