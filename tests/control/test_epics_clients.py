"""Clients of EPICS report what the page says when a move goes wrong, and checked motors always fail."""

from __future__ import annotations

import asyncio
import json
import os
import queue
import re
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import ca  # sets the addresses that clients read
import pytest
from aioca import caput, purge_channel_caches
from iocs import SOON, bench_of
from lines import Line, recorded

import stagewire_virtual as virtual
from checkout import ROOT
from stagewire_apt import stages

PAGE = ROOT / "docs" / "control-systems.md"
PREFIX = f"C{os.getpid()}:"
"""Begins names, which other IOCs of this machine must not have: searches by pvAccess may share a port."""
PROGRAM = Path(__file__).with_name("clients.py")
MOVE = bytes((0x53, 0x04, 0x06, 0x00, 0xD0, 0x01))
STOP = bytes((0x65, 0x04, 0x01, 0x01, 0x50, 0x01))
LONG = 40.0
"""Seconds after which a client that has not reported anything counts as waiting, unless it takes longer."""
AGAIN = 14.0
"""Seconds in which clients of pvAccess connect to an IOC again."""
CLIENTS = {
    "ophyd-async `Motor`": "ophyd_async",
    "the same by pvAccess": "ophyd_async_pva",
    "ophyd `EpicsMotor`": "ophyd",
    "pyepics `Motor`": "pyepics",
    "aioca `caput`": "aioca",
}
CHECKED = ("checked_ophyd_async", "checked_ophyd_async_pva", "checked_ophyd")
OF_PLANS = {"ophyd_async", "ophyd_async_pva", "ophyd", *CHECKED}
QUICK = {("STOP by another client", client) for client in CLIENTS.values()} | {
    (case, client)
    for case in ("a stop by another program or a panel", "an IOC that is killed")
    for client in CHECKED
}
"""The cases that are always tested; the others take minutes."""


def bench(line: Line) -> str:
    return f'prefix = "{PREFIX}"\n' + bench_of(line.url)


@dataclass(frozen=True)
class Setting:
    """An IOC, the line of its controller, and what can happen to them during a move."""

    line: Line
    ioc: ca.IocProcess

    def put(self, field: str, value: float) -> None:
        """Put a value as another client."""

        async def put() -> None:
            try:
                await caput(f"{PREFIX}x.{field}", value, wait=True, timeout=5)
            finally:
                purge_channel_caches()

        asyncio.run(put())

    def suspend(self) -> None:
        os.kill(self.ioc.process.pid, signal.SIGSTOP)


CASES: dict[str, Callable[[Setting], None]] = {
    "STOP by another client": lambda here: here.put("STOP", 1),
    "a stop by another program or a panel": lambda here: here.line.inject(STOP),
    "a lost line": lambda here: here.line.cut(),
    "a controller that falls silent": lambda here: here.line.silence(),
    "an IOC that is killed": lambda here: here.ioc.process.kill(),
    "an IOC that ends by SIGTERM": lambda here: here.ioc.process.terminate(),
    "an IOC that falls silent": Setting.suspend,
    "a target outside the limits": lambda here: None,
    "a target that the IOC refuses": lambda here: here.put("CNEN", 0),
}
AT_ONCE = {"a target outside the limits", "a target that the IOC refuses"}
"""The cases that happen before the move."""


@dataclass(frozen=True)
class Report:
    """The report of a client.

    :param error: the error of the move; empty: success; None: nothing.
    :param seconds: time until then.
    :param plan: the error of the plan.
    :param positions: the positions in the events of the plan.
    """

    error: str | None
    seconds: float
    plan: str = ""
    positions: tuple[float, ...] = ()

    @property
    def word(self) -> str:
        """The word of the page."""
        if self.error is None:
            return "waits"
        if self.error:
            return "failure"
        return "wrong event" if len(self.positions) > 1 else "success"


class Client:
    """A client in another process."""

    def __init__(self, name: str, target: float) -> None:
        self._plans = name in OF_PLANS
        words = [sys.executable, str(PROGRAM), name, f"{PREFIX}x", "0", str(target)]
        self.process = subprocess.Popen(
            words,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
        )
        self._said: queue.Queue[tuple[float, dict[str, Any]]] = queue.Queue()
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()
        assert self._hear(30)[1]["what"] == "ready"

    def _read(self) -> None:
        assert self.process.stdout is not None
        for text in self.process.stdout:
            if text.endswith("\n"):  # not cut off by a kill
                self._said.put((time.monotonic(), json.loads(text)))

    def _hear(self, timeout: float) -> tuple[float, dict[str, Any]]:
        return self._said.get(timeout=timeout)

    def go(self) -> None:
        """Begin the move to the target."""
        assert self.process.stdin is not None
        self.process.stdin.write("\n")
        self.process.stdin.flush()

    def report(self, since: float, patience: float) -> Report:
        """Wait for the report of the move, and of the plan around it."""
        try:
            at, said = self._hear(patience)
        except queue.Empty:
            return Report(None, patience)
        error, seconds = said["report"], at - since
        if self._plans and said["what"] != "plan":
            _, said = self._hear(LONG)
        return Report(error, seconds, said["report"], tuple(said.get("positions", ())))

    def close(self) -> None:
        self.process.kill()
        self.process.wait()
        self._reader.join()
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self.process.stdin.close()
        self.process.stdout.close()


@contextmanager
def client(name: str, target: float) -> Iterator[Client]:
    one = Client(name, target)
    try:
        yield one
    finally:
        one.close()


def reported(folder: Path, case: str, name: str, patience: float = LONG) -> tuple[Report, Line]:
    """Let something happen during a move of a client, and return its report and the line."""
    target = 12.5 if case == "a target outside the limits" else 10.0
    with (
        virtual.TDC001(stage=stages.Z8).tcp() as tdc,
        recorded(tdc.url) as line,
        ca.ioc(folder, bench(line), *ca.PVA) as ioc,
        client(name, target) as one,
    ):
        here = Setting(line, ioc)
        if case in AT_ONCE:
            CASES[case](here)
            began = time.monotonic()
            one.go()
        else:
            one.go()
            _until(lambda: MOVE in line.sent)
            time.sleep(0.6)
            began = time.monotonic()
            CASES[case](here)
        return one.report(began, patience), line


def _until(condition: Callable[[], bool]) -> None:
    end = time.monotonic() + SOON
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.01)


def cells() -> Iterator[tuple[str, str, str]]:
    """Yield case, client and cell of the table of the page."""
    rows = [
        [cell.strip() for cell in line.strip("|").split("|")]
        for line in PAGE.read_text("utf-8").splitlines()
        if line.startswith("|")
    ]
    [header] = [row for row in rows if row[0] == "during a move"]
    table = rows[rows.index(header) + 2 :]
    for row in table[: [row[0] for row in table].index("remedy")]:
        for name, cell in zip(header[1:], row[1:], strict=True):
            yield row[0], CLIENTS[name], cell.replace("*", "")


def some(pairs: Iterator[tuple[str, ...]]) -> list[Any]:
    """Mark the cases that are not quick."""
    return [
        pytest.param(
            *one,
            id=f"{one[1]}: {one[0]}",
            marks=() if one[:2] in QUICK else pytest.mark.matrix,
        )
        for one in pairs
    ]


def test_the_table_of_the_page_has_each_case_and_each_client() -> None:
    assert {(case, name) for case, name, _ in cells()} == {
        (case, name) for case in CASES for name in CLIENTS.values()
    }


@pytest.mark.parametrize(("case", "name", "cell"), some(cells()))
def test_an_unmodified_client_reports_what_the_page_says(
    case: str, name: str, cell: str, tmp_path: Path
) -> None:
    found = re.fullmatch(r"([a-z ]+?)(?: after (\d+) to (\d+) s)?", cell)
    assert found is not None, cell
    low, high = (float(found[2]), float(found[3])) if found[2] else (0.0, SOON)
    report, _ = reported(tmp_path, case, name, max(LONG, high))
    assert report.word == found[1], report
    if report.error is not None:
        assert low <= report.seconds < high, report
    if report.word == "wrong event":
        assert report.positions[0] == 0
        assert report.positions[-1] < 9, report


@pytest.mark.parametrize(("case", "name"), some((case, name) for case in CASES for name in CHECKED))
def test_a_checked_motor_fails_soon_and_records_no_event(
    case: str, name: str, tmp_path: Path
) -> None:
    report, line = reported(tmp_path, case, name)
    assert report.error, report
    assert report.seconds < SOON, report
    assert report.plan, report
    assert report.positions == (0.0,)
    assert line.sent.count(MOVE) == (case not in AT_ONCE)


@pytest.mark.parametrize(
    ("name", "moves"),
    [
        ("checked_ophyd_async_pva", 1),
        pytest.param("ophyd_async_pva", 2, marks=pytest.mark.matrix),  # as the page says
        *(
            pytest.param(name, 1, marks=pytest.mark.matrix)
            for name in (*CLIENTS.values(), "checked_ophyd_async", "checked_ophyd")
            if name != "ophyd_async_pva"
        ),
    ],
)
def test_only_an_unmodified_client_of_pvaccess_sends_its_move_again_to_a_restarted_ioc(
    name: str, moves: int, tmp_path: Path
) -> None:
    with (
        virtual.TDC001(stage=stages.Z8).tcp() as tdc,
        recorded(tdc.url) as line,
        ca.ioc(tmp_path, bench(line), *ca.PVA) as first,
        client(name, 10.0) as one,
    ):
        one.go()
        _until(lambda: MOVE in line.sent)
        time.sleep(0.6)
        first.process.kill()
        first.process.wait()
        if name == "checked_ophyd_async_pva":  # before the IOC can be there again
            report = one.report(time.monotonic(), SOON)
            assert "the IOC disconnected" in str(report.error)
        host, port = tdc.url.removeprefix("socket://").split(":")
        with socket.create_connection((host, int(port))) as panel:
            panel.sendall(STOP)
            time.sleep(0.3)
        with ca.ioc(tmp_path, bench(line), *ca.PVA):
            end = time.monotonic() + (AGAIN if moves == 1 else ca.FOUND)
            while time.monotonic() < end and line.sent.count(MOVE) == 1:
                time.sleep(0.1)
        # An unmodified client of pvAccess moves again only if it finds the IOC before its own timeout.
        assert line.sent.count(MOVE) in {1, moves}
