"""Parts of virtual controllers with their records, and the messages on their lines."""

from __future__ import annotations

from collections.abc import AsyncIterator, Awaitable, Callable, Iterator
from contextlib import asynccontextmanager
from pathlib import Path
from types import ModuleType
from typing import Any

import stagewire_apt.aio
import stagewire_ms2000.aio
from stagewire.devices import status_set
from stagewire_apt.devices.facts import FACTS
from stagewire_epics.parameters import ParameterRecords, Sets, StatusRecords
from stagewire_epics.records import Record
from stagewire_virtual import stepped

_INSIDE = ("bay_class", "channel_class", "axis_class")
Z8 = "virtual://TDC001?stage=Z8"
"""The URL of a virtual TDC001 with a linear stage."""
WRITES = frozenset(FACTS.writers())
"""The names of the messages that write a parameter set."""


def units() -> Iterator[type[Any]]:
    """Yield the classes of all units of both protocols."""
    packages: tuple[ModuleType, ...] = (stagewire_apt.aio, stagewire_ms2000.aio)
    for package in packages:
        for name in package.__all__:
            if hasattr(getattr(package, name), "unit"):
                yield getattr(package, name)


def kinds(kind: type[Any]) -> Iterator[type[Any]]:
    """Yield a class and the classes of the parts inside it."""
    yield kind
    for attribute in _INSIDE:
        if hasattr(kind, attribute):
            yield from kinds(getattr(kind, attribute))


def parts(device: Any) -> Iterator[Any]:
    """Yield an open device and the parts inside it; of axes only X."""
    yield device
    for inside in (getattr(type(device), attribute, None) for attribute in _INSIDE):
        if inside is not None:
            for name in ("bays", "channels"):
                for part in getattr(device, name, ()):
                    yield from parts(part)
    if hasattr(type(device), "axis_class"):
        yield device.axis("X")


def run(main: Callable[[], Awaitable[None]]) -> None:
    """Run a test in stepped time."""

    async def body() -> None:
        await main()

    stepped.run(body())


class Line:
    """The messages that were sent to a controller, from its capture, except keep-alive messages."""

    def __init__(self, log: Path) -> None:
        self._log = log
        self._seen = 0

    def sent(self) -> list[str]:
        """Return the names of the messages that were sent since the last call."""
        lines = self._log.read_text().splitlines()
        new, self._seen = lines[self._seen :], len(lines)
        names = [line.split("  # ")[-1] for line in new if " > " in line]
        return [name for name in names if name != "MOT_ACK_DCSTATUSUPDATE"]

    def writes(self) -> list[str]:
        """Return the names of those of them that write a parameter set."""
        return [name for name in self.sent() if name in WRITES]


class Published:
    """A part with its records, and its line."""

    def __init__(self, part: Any, records: ParameterRecords, line: Line) -> None:
        self.part = part
        self.parameters = records
        self.line = line
        self._records = {record.name: record for record in records.records}

    def __getitem__(self, name: str) -> Record:
        return self._records[f"LAB:x:{name}"]

    def of(self, name: str) -> list[Record]:
        """Return the records of a set."""
        return [one for one in self.parameters.records if one.name.startswith(f"LAB:x:{name}:")]


@asynccontextmanager
async def published(
    unit: type[Any],
    url: str,
    log: Path,
    sets: Sets = "all",
    part: Callable[[Any], Any] = lambda device: device,
    **options: Any,
) -> AsyncIterator[Published]:
    """Open a controller, and read the parameters of a part of it; by default of the controller itself."""
    async with unit.open(url, log=log, **options) as device:
        opened = part(device)
        records = ParameterRecords(type(opened), "LAB:x", sets)
        records.bind(opened)
        await records.refresh()
        line = Line(log)
        line.sent()
        yield Published(opened, records, line)
        await records.lost("the test has ended")


def all_records(kind: type[Any]) -> list[Record]:
    """Return all records of a class of a part."""
    records = list(ParameterRecords(kind, "LAB:x").records)
    if status_set(kind) is not None:
        records.extend(StatusRecords(kind, "LAB:x").records)
    return records
