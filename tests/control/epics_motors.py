"""Motors of both ophyds over EPICS, unmodified and checked, connected in this process."""

from __future__ import annotations

import itertools
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import ca  # sets the addresses that clients read
from lines import run
from ophyd import EpicsMotor
from ophyd_async.epics.motor import Motor

from stagewire_bluesky.classic import CheckedEpicsMotor
from stagewire_bluesky.epics import CheckedMotor

SETTLE = 0.05
"""Seconds after a move. Without them ophyd may lose the end of the next move: it forgets who waits for it."""
_numbers = itertools.count()


@contextmanager
def published(folder: Path, bench: str) -> Iterator[tuple[str, ca.IocProcess]]:
    """Run an IOC, and yield the name of its motor record and its process.

    The name is new each time, because libca searches for lost records ever more rarely, and because another
    IOC on this machine may have the same port of searches by pvAccess.
    """
    prefix = f"T{os.getpid()}N{next(_numbers)}:"
    with ca.ioc(folder, f'prefix = "{prefix}"\n' + bench, *ca.PVA) as one:
        yield prefix + "x", one


def _of_ophyd_async(kind: type[Motor], name: str) -> Motor:
    x = kind(name, name="x")
    run(lambda: x.connect(timeout=ca.FOUND))
    return x


def _of_ophyd(kind: type[Any], name: str, **options: Any) -> Any:
    x = kind(name, name="x", **options)
    x.wait_for_connection(timeout=10)
    return x


OF_OPHYD_ASYNC: dict[str, Callable[[str], Any]] = {
    "Motor": lambda name: _of_ophyd_async(Motor, name),
    "Motor by pvAccess": lambda name: _of_ophyd_async(Motor, f"pva://{name}"),
    "CheckedMotor": lambda name: _of_ophyd_async(CheckedMotor, name),
    "CheckedMotor by pvAccess": lambda name: _of_ophyd_async(CheckedMotor, f"pva://{name}"),
}
OF_OPHYD: dict[str, Callable[[str], Any]] = {
    "EpicsMotor": lambda name: _of_ophyd(EpicsMotor, name, settle_time=SETTLE),
    "CheckedEpicsMotor": lambda name: _of_ophyd(CheckedEpicsMotor, name),
}
MOTORS = OF_OPHYD_ASYNC | OF_OPHYD
"""Connects to a motor record, by the name of the class."""
