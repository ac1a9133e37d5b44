"""pvAccess: a server for records, by p4p, with the structures of :mod:`stagewire_epics.pvi`."""

from __future__ import annotations

import asyncio
import logging
import os
from collections.abc import Mapping, Sequence
from contextlib import suppress
from functools import partial
from typing import Any, Final

from p4p import Value
from p4p._p4p import logger_level_set
from p4p.nt import NTEnum, NTScalar
from p4p.server import Server, StaticProvider
from p4p.server.asyncio import SharedPV

from stagewire.errors import StagewireError
from stagewire_epics.access import Access
from stagewire_epics.pvi import structures
from stagewire_epics.records import Kind, PutRefusedError, Record

_log = logging.getLogger("stagewire")
_STOPPING: Final = 0.2
"""Seconds in which the answers of failed puts are sent before the server ends."""
_FILES: Final = 65_536
"""Open files, hence connections, that this process allows itself if the system does."""
_SILENT: Final = 1
"""A level of p4p's log below its highest."""


class PvAccessServer:
    """A server of pvAccess.

    It answers searches that arrive at its addresses. p4p binds the UDP port of searches at all addresses, and
    drops what arrives at others. Clients of pvAccess state a user but no host: the hosts of the access rules
    are the addresses from which they are connected.

    The number of connections is limited only by the open files of the process. Without a free one p4p accepts
    no client and fills the standard error with warnings, so :meth:`start` raises a limit that is low, as the
    usual 1,024. It also silences what p4p prints about invalid bytes from clients, unless PVXS_LOG is set.

    :param records: the records by name; a record may have several names.
    :param access: who may put values.
    :param addresses: addresses to listen on.
    :param port: TCP port; 0: a free one. p4p takes a free one also if the port is taken.
    :param search_port: UDP port of searches; 0: a free one.
    """

    def __init__(
        self,
        records: Mapping[str, Record],
        access: Access,
        addresses: Sequence[str],
        port: int = 5075,
        search_port: int = 5076,
    ) -> None:
        self._records = records
        self._puts = _Puts(access)
        self._addresses = " ".join(addresses)
        self._configuration = {
            "EPICS_PVAS_INTF_ADDR_LIST": self._addresses,
            "EPICS_PVAS_SERVER_PORT": str(port),
            "EPICS_PVAS_BROADCAST_PORT": str(search_port),
            "EPICS_PVAS_BEACON_ADDR_LIST": self._addresses,
            "EPICS_PVAS_AUTO_BEACON_ADDR_LIST": "YES" if "0.0.0.0" in addresses else "NO",
        }
        self._server: Server | None = None
        self._channels: list[SharedPV] = []

    async def start(self) -> None:
        """Begin to serve.

        Raise :class:`OSError` if that is impossible, as for an address that this machine does not have.
        """
        _allow_connections()
        if "PVXS_LOG" not in os.environ:
            logger_level_set("pvxs.tcp.io", _SILENT)
        provider = StaticProvider("stagewire")
        channels = {record: self._channel(record) for record in self._records.values()}
        self._channels = list(channels.values())
        for name, record in self._records.items():
            provider.add(name, channels[record])
        for name, value in structures(self._records.values()):
            self._channels.append(SharedPV(initial=value))
            provider.add(name, self._channels[-1])
        try:
            self._server = Server(
                providers=[provider], conf=self._configuration, useenv=False, isolate=False
            )
        except RuntimeError as error:
            raise OSError(f"pvAccess on {self._addresses}: {error}") from error

    @property
    def ports(self) -> tuple[int, int]:
        """The ports of TCP and of searches."""
        assert self._server is not None
        configuration = self._server.conf()
        return (
            int(configuration["EPICS_PVAS_SERVER_PORT"]),
            int(configuration["EPICS_PVAS_BROADCAST_PORT"]),
        )

    async def close(self) -> None:
        """Fail the puts that are open, and end the server after their answers. Records stay usable."""
        if self._server is not None:
            await self._puts.fail()
            await asyncio.sleep(_STOPPING)
            self._server.stop()
            self._server = None
            for channel in self._channels:
                channel.close(destroy=True)

    def _channel(self, record: Record) -> SharedPV:
        channel = SharedPV(handler=_Handler(record, self._puts), initial=_value(record))
        record.listen(partial(_publish, channel))
        return channel


class _Puts:
    """Carries out the puts of all clients at the same time, so that a stop waits for none of them."""

    def __init__(self, access: Access) -> None:
        self._access = access
        self._open: set[asyncio.Task[Any]] = set()
        self._ended = False

    async def put(self, record: Record, operation: Any) -> None:
        """Carry out a put, and answer it when it is done."""
        task = asyncio.current_task()
        assert task is not None
        self._open.add(task)
        failure: str | None = None
        try:
            await record.put(self._permitted(record, operation))
        except StagewireError as error:
            failure = str(error)
        except asyncio.CancelledError:
            failure = (
                f"{record.name}: the {'IOC has ended' if self._ended else 'put was cancelled'}"
            )
            raise
        except Exception as error:
            _log.exception("%s: a put failed", record.name)
            failure = f"{record.name}: {error!r}"
        finally:
            self._open.discard(task)
            operation.done(error=failure)

    async def fail(self) -> None:
        """Refuse new puts, and fail those that are open."""
        self._ended = True
        if tasks := set(self._open):
            for task in tasks:
                task.cancel()
            await asyncio.wait(tasks, timeout=_STOPPING)

    def _permitted(self, record: Record, operation: Any) -> Any:
        """Return the value that a client puts, or raise :class:`PutRefusedError`.

        A put can consist of other fields, such as the alarm; its value is then zero, which could move it.
        """
        if self._ended:
            raise PutRefusedError(f"{record.name}: the IOC has ended")
        host = operation.peer().rpartition(":")[0].strip("[]").removeprefix("::ffff:")
        if record.writable and not self._access.permits(record, operation.account(), host):
            raise PutRefusedError(f"{record.name}: this client may not put values")
        field = "value.index" if record.kind is Kind.CHOICE else "value"
        value = operation.value()
        if not value.changed(field):
            raise PutRefusedError(f"{record.name}: the put has no {field}")
        return value[field]


class _Handler:
    """Accepts the puts of clients for a record."""

    def __init__(self, record: Record, puts: _Puts) -> None:
        self._record = record
        self._puts = puts

    async def put(self, _: SharedPV, operation: Any) -> None:
        """Put a value, and answer when it is done."""
        await self._puts.put(self._record, operation)


def _allow_connections() -> None:
    try:
        import resource
    except ModuleNotFoundError:  # Windows has no such limit
        return
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    most = _FILES if hard == resource.RLIM_INFINITY else min(_FILES, hard)
    if soft != resource.RLIM_INFINITY and soft < most:
        with suppress(ValueError, OSError):
            resource.setrlimit(resource.RLIMIT_NOFILE, (most, hard))


async def _publish(channel: SharedPV, record: Record) -> None:
    if channel.isOpen():
        channel.post(_value(record))


def _value(record: Record) -> Value:
    """Return the value, the alarm and the metadata of a record."""
    alarm = {
        "timestamp": record.time,
        "severity": int(record.alarm.severity),
        "message": record.alarm.message,
    }
    if record.kind is Kind.CHOICE:
        enum = {"index": int(record.value), "choices": list(record.choices)}
        value = _ENUM.wrap(enum, **alarm)
    else:
        value = _SCALARS[record.kind].wrap(record.value, **alarm)
    if record.kind in (Kind.FLOAT, Kind.INTEGER):
        low, high = record.limits
        value["display.units"] = record.unit
        value["display.precision"] = record.precision
        value["display.form.choices"] = _FORMS
        value["display.limitLow"] = value["control.limitLow"] = low
        value["display.limitHigh"] = value["control.limitHigh"] = high
    value["display.description"] = record.description
    value["alarm.status"] = int(record.alarm.status)
    return value


_ENUM: Final = NTEnum(display=True)
_SCALARS: Final = {
    Kind.FLOAT: NTScalar("d", display=True, control=True, form=True),
    Kind.INTEGER: NTScalar("l", display=True, control=True, form=True),
    Kind.TEXT: NTScalar("s", display=True),
}
_FORMS: Final = [
    "Default",
    "String",
    "Binary",
    "Decimal",
    "Hex",
    "Exponential",
    "Engineering",
]
