"""Far ends and hosts of every kind, and a check that a test leaves no threads or descriptors open."""

from __future__ import annotations

import os
import threading
import time
import types
from collections.abc import Callable, Iterator
from contextlib import closing

import pytest
from far_ends import FAR_ENDS, FarEnd
from hosts import HOSTS, Loop, Threads

_DESCRIPTORS = "/proc/self/fd"


@pytest.fixture(autouse=True)
def _nothing_left() -> Iterator[None]:
    threads, descriptors = set(threading.enumerate()), _descriptors()
    yield
    assert set(threading.enumerate()) == threads
    assert _descriptors() == descriptors


def _descriptors() -> int:
    return len(os.listdir(_DESCRIPTORS)) if os.path.isdir(_DESCRIPTORS) else 0


@pytest.fixture(autouse=True)
def _pyserial_in_a_hurry(monkeypatch: pytest.MonkeyPatch) -> None:
    """Shorten the pauses of ``rfc2217://``: 50 ms between checks for an answer, 300 ms after closing."""
    hurried = types.SimpleNamespace(**vars(time))
    hurried.sleep = lambda _: time.sleep(0.001)
    monkeypatch.setattr("serial.rfc2217.time", hurried)


@pytest.fixture
def far_end(kind: str) -> Iterator[FarEnd]:
    with FAR_ENDS[kind]() as far:
        yield far


@pytest.fixture
def host(way: str, far_end: FarEnd) -> Iterator[Threads | Loop]:
    with closing(HOSTS[way](far_end.url)) as opened:
        yield opened


@pytest.fixture
def open_host(way: str) -> Callable[..., Threads | Loop]:
    return HOSTS[way]
