"""Instrumented links for tests of the suite, and checks made for a test."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import allowances
from stagewire.errors import TransportLostError
from stagewire.links import Link
from stagewire_conformance.device.check import Check, Kind
from stagewire_conformance.device.declaration import Declaration, declare
from stagewire_conformance.device.permissions import Need, Permissions, Range
from stagewire_conformance.device.pics import BayPics, Pics
from stagewire_conformance.device.report import Report
from stagewire_conformance.device.run import run
from stagewire_conformance.device.trial import Trial
from stagewire_virtual import VirtualController
from wrapped_links import WrappedLink

MOTION = Range.parse("0..100000counts")
ALL = allowances.everything(MOTION)
MODULES = ("MST601", None, "MPZ601")


class WatchedLink(WrappedLink):
    """A stepped line that records writes. Hooks are called before each read and write."""

    def __init__(self, link: Link) -> None:
        super().__init__(link)
        self.writes: list[bytes] = []
        self.reads = 0
        self.before_read: Callable[[], None] = lambda: None
        self.before_write: Callable[[bytes], None] = lambda data: None

    def read(self, timeout: float) -> bytes:
        self.reads += 1
        self.before_read()
        return self._link.read(timeout)

    def write(self, data: bytes) -> None:
        self.before_write(data)
        self.writes.append(data)
        self._link.write(data)

    def write_now(self, data: bytes) -> None:
        raise AssertionError("the suite never calls write_now here")


class DeadLink(Link):
    """A line with nothing at the other end, or with something that always sends the same bytes."""

    url = "socket://192.0.2.1:4001"

    def __init__(self, says: bytes = b"") -> None:
        self.now = 0.0
        self.clock = lambda: self.now
        self._says = says

    def read(self, timeout: float) -> bytes:
        self.now += timeout if timeout > 0 else 0.0
        said, self._says = self._says, b""
        return said

    def write(self, data: bytes) -> None:
        pass

    def write_now(self, data: bytes) -> None:
        pass

    def wake(self) -> None:
        pass

    def close(self) -> None:
        pass


def lost() -> None:
    raise TransportLostError("the other end hung up")


def made(
    body: Callable[[Trial], None],
    name: str = "made",
    needs: frozenset[Need] = frozenset(),
    skip: str = "",
    lacks: str = "",
) -> Check:
    """Return a check as in a plan."""
    check = Check(
        id=f"{name}/one",
        title="A check made for a test.",
        messages=(),
        run=body,
        needs=needs,
        skip=skip,
        lacks=lacks,
    )
    return replace(check, kind=Kind(name=name, title="Made for a test"))


def run_made(
    link: Link,
    *checks: Check | Callable[[Trial], None],
    declared: Declaration | None = None,
    allowed: Permissions = ALL,
    seed: int = 1,
) -> Report:
    """Run checks made for a test. A function becomes the body of a check."""
    planned = [
        check if isinstance(check, Check) else made(check, f"made{number}")
        for number, check in enumerate(checks)
    ]
    return run(link, planned, declared or declare("TDC001"), allowed, seed)


def controller_of(unit: str) -> VirtualController:
    """Return a virtual controller; ``RACK`` is a rack of modules with an empty bay."""
    import stagewire_virtual

    if unit == "RACK":
        return stagewire_virtual.rack(*MODULES)
    controller: VirtualController = getattr(stagewire_virtual, unit)()
    return controller


def declared_as(unit: str) -> Declaration:
    """Return the declaration of a controller from :func:`controller_of`."""
    if unit != "RACK":
        return declare(unit)
    bays = tuple(
        BayPics(number=number, unit=module) for number, module in enumerate(MODULES, 1) if module
    )
    return declare(Pics(unit="RACK", bays=bays))
