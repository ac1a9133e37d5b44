"""Three IOCs and a client, each on its own machine: an IOC is killed, and the network is lost for a while."""

from __future__ import annotations

import itertools
import json
import re
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import ca
import namespaces
import pytest
from iocs import bench_of
from lines import COMMAND, Line
from namespaces import Machine

import stagewire_virtual as virtual
from stagewire_apt import stages

pytestmark = [
    pytest.mark.matrix,
    pytest.mark.skipif(
        bool(namespaces.reason_to_skip()), reason=namespaces.reason_to_skip() or "never"
    ),
]
MS2000 = """
[controllers.m]
unit = "MS2000"
url = "{url}"
[motors.x]
controller = "m"
axis = "X"
limits = [0, 50000]
"""
NAMES = ("A:x", "B:x", "C:x")
COUNTS = (1 / 34304.0, 0.1, 1 / 34304.0)
"""The length of a count of each axis: mm, um and mm."""
LOST, AGAIN = 10.0, 30.0
"""Seconds without a network, and seconds after it in which new puts work."""
MOVING = 10.0
"""Seconds that the motion of a new put may take."""
PATIENCE = 90.0


def targets(line: Line, at: int) -> list[bytes]:
    """Return the target of each move that was sent to a controller, in its bytes."""
    frame = rb"\x18\x54\x03(...)" if at == 1 else rb"\x53\x04\x06\x00\xd0\x01..(....)"
    return re.findall(frame, line.sent, re.DOTALL)


class Client:
    """The client; see ``network_client.py``."""

    def __init__(self, machine: Machine, servers: list[Machine]) -> None:
        addresses = " ".join(one.address for one in servers)
        setting = [
            f"EPICS_CA_ADDR_LIST={addresses}",
            "EPICS_CA_AUTO_ADDR_LIST=NO",
            "EPICS_CA_SERVER_PORT=5064",
        ]
        program = str(Path(__file__).with_name("network_client.py"))
        self.process = subprocess.Popen(
            machine.command(["env", *setting, sys.executable, program, *NAMES]),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        assert self.result()["error"] == ""

    def begin(self, **plan: Any) -> None:
        """Begin a plan."""
        assert self.process.stdin is not None
        self.process.stdin.write(json.dumps(plan) + "\n")
        self.process.stdin.flush()

    def result(self) -> dict[str, Any]:
        """Wait for the result of a plan."""
        assert self.process.stdout is not None
        found: dict[str, Any] = json.loads(self.process.stdout.readline())
        return found

    def close(self) -> None:
        """End the client."""
        self.process.kill()
        self.process.wait()
        for one in (self.process.stdin, self.process.stdout):
            assert one is not None
            one.close()


class Site:
    """Three machines with an IOC and a controller each, and the machine of the client."""

    def __init__(self, stack: ExitStack, folder: Path) -> None:
        self._folder = folder
        *self.servers, self.desk = stack.enter_context(namespaces.machines(4))
        self.lines: list[Line] = []
        self.iocs: list[ca.IocProcess] = []
        for at, machine in enumerate(self.servers):
            controller = virtual.MS2000() if at == 1 else virtual.TDC001(stage=stages.Z8)
            url = stack.enter_context(controller.tcp()).url
            with machine.inside():
                listener = socket.create_server(("127.0.0.1", 0))
            self.lines.append(Line(url, listener))
            stack.callback(self.lines[at].close)
            bench = (
                MS2000.format(url=self.lines[at].url) if at == 1 else bench_of(self.lines[at].url)
            )
            (folder / f"{at}.toml").write_text(f'prefix = "{NAMES[at][:2]}"\n{bench}')
            self.iocs.append(self.start(at))
            stack.callback(lambda at=at: self.iocs[at].close())
        self.client = Client(self.desk, self.servers)
        stack.callback(self.client.close)

    def start(self, at: int) -> ca.IocProcess:
        """Start an IOC."""
        machine = self.servers[at]
        words = [*COMMAND, "ioc", str(self._folder / f"{at}.toml"), "--bind", machine.address]
        one = ca.IocProcess(
            subprocess.Popen(machine.command(words), stderr=subprocess.PIPE, text=True)
        )
        one.wait_for("is open")
        return one

    def restart(self, at: int) -> None:
        """Kill an IOC, and start it again."""
        self.iocs[at].close()
        time.sleep(2)
        self.iocs[at] = self.start(at)

    def moves(self) -> list[int]:
        """Return how many moves were sent to each controller."""
        return [len(targets(line, at)) for at, line in enumerate(self.lines)]

    def run(self, **plan: Any) -> dict[str, Any]:
        """Run a plan."""
        self.client.begin(**plan)
        return self.client.result()


@pytest.fixture
def site(tmp_path: Path) -> Iterator[Site]:
    with ExitStack() as stack:
        yield Site(stack, tmp_path)


def grid(scan: list[list[float]]) -> list[tuple[float, ...]]:
    """Return the points of a grid scan of two points each."""
    return list(itertools.product(*((low, high) for low, high, _ in scan)))


def check(result: dict[str, Any], points: list[tuple[float, ...]]) -> None:
    """Check that each event is at its point."""
    for event, point in zip(result["events"], points, strict=False):
        for position, target, count in zip(event, point, COUNTS, strict=True):
            assert abs(position - target) <= count * 1.01, result


def test_a_scan_runs_again_after_an_ioc_was_killed_and_started(site: Site) -> None:
    first = [[0.1, 0.3, 2], [100, 400, 2], [0.2, 0.5, 2]]
    result = site.run(scan=first)
    assert result["error"] == ""
    assert len(result["events"]) == 8
    check(result, grid(first))
    assert site.moves() == [2, 4, 8]
    for at in (1, 0):
        site.restart(at)
        second = [[0.6, 0.8 + at, 2], [600 + at, 900, 2], [0.7 + at, 0.9, 2]]
        result = site.run(scan=second)
        assert result["error"] == ""
        assert len(result["events"]) == 8
        check(result, grid(second))
    assert not any("Traceback" in text for one in site.iocs for text in one.log)


def test_no_move_is_repeated_when_the_network_is_lost_for_a_while(site: Site) -> None:
    scan = [[1.0, 3.0, 2], [5000, 20000, 2], [1.0, 4.0, 2]]
    site.client.begin(scan=scan)
    time.sleep(4)
    begun = sum(site.moves())
    assert begun > 0
    site.desk.unplug()
    time.sleep(LOST)
    site.desk.plug()
    back = time.monotonic()
    result = site.client.result()
    check(result, grid(scan))
    assert result["error"] or len(result["events"]) == 8
    for at, line in enumerate(site.lines):
        sent = targets(line, at)
        assert sent == [target for target, _ in itertools.groupby(sent)]  # a grid never repeats one
    while site.run(move=[0.5, 500, 0.5])["error"]:
        assert time.monotonic() - back < AGAIN
        time.sleep(1)
    assert time.monotonic() - back < AGAIN + MOVING
    assert not any("Traceback" in text for one in site.iocs for text in one.log)
