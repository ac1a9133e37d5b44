"""Channel Access: a client of libca reads, puts and monitors the records of an IOC in another process."""

from __future__ import annotations

import asyncio
import getpass
import os
import signal
import socket
import subprocess
import sys
import time
import xml.etree.ElementTree as ElementTree
from collections.abc import Awaitable, Callable, Iterator
from pathlib import Path
from typing import Any

import ca  # sets the addresses that aioca reads
import pytest
from aioca import FORMAT_CTRL, FORMAT_TIME, CANothing, caget, camonitor, caput, purge_channel_caches
from iocs import bench_of
from lines import COMMAND, Line, recorded

import stagewire_virtual as virtual
from stagewire_apt import stages

MOVE = bytes((0x53, 0x04, 0x06, 0x00, 0xD0, 0x01))
STOP = bytes((0x65, 0x04))
PREFIX = 'prefix = "LAB:"\n'


@pytest.fixture
def line() -> Iterator[Line]:
    with virtual.TDC001(stage=stages.Z8).tcp() as tdc, recorded(tdc.url) as found:
        yield found


@pytest.fixture
def one(line: Line, tmp_path: Path) -> Iterator[ca.IocProcess]:
    with ca.ioc(tmp_path, PREFIX + bench_of(line.url)) as found:
        yield found


def run(body: Callable[[], Awaitable[None]]) -> None:
    async def within() -> None:
        try:
            await body()
        finally:
            purge_channel_caches()

    asyncio.run(within())


async def refused(name: str, value: Any) -> None:
    with pytest.raises((CANothing, Exception)) as error:
        await caput(name, value, wait=True, timeout=10)
    assert isinstance(error.value, CANothing) or "Write access denied" in str(error.value)


def test_fields_have_units_limits_choices_and_alarms(one: ca.IocProcess) -> None:
    async def body() -> None:
        value = await caget("LAB:x", format=FORMAT_CTRL)
        assert (value.units, value.precision) == ("mm", 5)
        assert (value.lower_ctrl_limit, value.upper_ctrl_limit) == (0.0, 12.0)
        assert list((await caget("LAB:x.SPMG", format=FORMAT_CTRL)).enums) == [
            "Stop", "Pause", "Move", "Go",
        ]  # fmt: skip
        assert str(await caget("LAB:x.EGU")) == "mm"
        assert (await caget("LAB:x.RBV", format=FORMAT_TIME)).severity == 0
        assert (await caget("LAB:x.VELO", format=FORMAT_CTRL)).units == "mm/s"
        assert str(await caget("LAB:x.RTYP")) == "motor"

    run(body)


def test_a_put_completes_at_the_end_and_monitors_see_the_way(
    one: ca.IocProcess, line: Line
) -> None:
    async def body() -> None:
        seen: list[float] = []
        monitor = camonitor("LAB:x.RBV", lambda value: seen.append(float(value)), all_updates=True)
        await caput("LAB:x", 0.5, wait=True, timeout=10)
        assert abs(await caget("LAB:x.RBV") - 0.5) < 1e-4
        assert len({round(value, 2) for value in seen}) > 3
        monitor.close()

    run(body)
    assert line.sent.count(MOVE) == 1


def test_refused_and_stopped_puts_fail(one: ca.IocProcess, line: Line) -> None:
    async def body() -> None:
        await refused("LAB:x", 12.5)
        await refused("LAB:x.RBV", 1.0)
        await refused("LAB:x.SPMG", 7)
        assert MOVE not in line.sent
        moving = asyncio.create_task(refused("LAB:x", 8.0))
        await asyncio.sleep(0.5)
        await caput("LAB:x.STOP", 1)
        await moving
        assert (await caget("LAB:x.RBV", format=FORMAT_TIME)).severity == 1

    run(body)
    one.wait_for("a put failed: LAB:x.VAL: 12.5 mm is outside the limits, 0 to 12 mm")
    assert not any("Traceback" in text for text in one.log)


def test_a_client_of_caproto_gets_the_failure_of_a_put(one: ca.IocProcess) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "caproto.commandline.put", "--no-repeater", "-c", "LAB:x", "12.5"],
        capture_output=True,
        text=True,
        timeout=30,
        env={**os.environ, "EPICS_CA_SERVER_PORT": str(ca.PORT), "EPICS_CA_ADDR_LIST": "127.0.0.1"},
    )
    assert "ECA_PUTFAIL" in done.stdout + done.stderr, done


def test_sigterm_stops_the_axis_and_fails_the_put_first(one: ca.IocProcess, line: Line) -> None:
    async def body() -> None:
        moving = asyncio.create_task(refused("LAB:x", 8.0))
        await asyncio.sleep(0.5)
        one.process.send_signal(signal.SIGTERM)
        async with asyncio.timeout(3):
            await moving

    run(body)
    assert one.process.wait(10) == 0
    assert STOP in line.sent
    assert not any("Traceback" in text for text in one.log)


def test_read_only_refuses_all_puts_except_stop(line: Line, tmp_path: Path) -> None:
    async def body() -> None:
        await refused("LAB:x", 1.0)
        await refused("LAB:x.OFF", 1.0)
        await caput("LAB:x.STOP", 1, wait=True)
        assert await caget("LAB:x.RBV") == 0.0

    with ca.ioc(tmp_path, PREFIX + bench_of(line.url), "--read-only"):
        run(body)
    assert MOVE not in line.sent


@pytest.mark.parametrize("allowed", [True, False])
def test_only_stated_hosts_and_users_can_put(line: Line, tmp_path: Path, allowed: bool) -> None:
    user = getpass.getuser() if allowed else "operator"
    access = f'[access]\nhosts = ["{socket.gethostname()}"]\nusers = ["{user}"]\n'

    async def body() -> None:
        if allowed:
            await caput("LAB:x", 0.1, wait=True, timeout=10)
        else:
            await refused("LAB:x", 0.1)
            await caput("LAB:x.STOP", 1, wait=True)

    with ca.ioc(tmp_path, PREFIX + bench_of(line.url, motor=access)):
        run(body)
    assert (MOVE in line.sent) is allowed


def test_the_ioc_listens_on_loopback_only(one: ca.IocProcess) -> None:
    for address in {info[4][0] for info in socket.getaddrinfo(socket.gethostname(), ca.PORT)}:
        if not str(address).startswith("127."):
            with (
                pytest.raises(ConnectionRefusedError),
                socket.create_connection((address, ca.PORT), timeout=2),
            ):
                socket.create_connection((address, ca.PORT), timeout=2)


def test_each_pv_of_the_screens_and_of_the_list_is_there(
    one: ca.IocProcess, tmp_path: Path
) -> None:
    def command(*options: str) -> list[str]:
        words = [*COMMAND, "ioc", str(tmp_path / "bench.toml"), *options]
        done = subprocess.run(words, check=True, capture_output=True, text=True, timeout=30)
        return done.stdout.splitlines()

    [screen] = command("--screens", str(tmp_path / "screens"))
    tree = ElementTree.parse(screen)
    names = {str(element.text) for element in tree.iter("pv_name")}
    listed = set(command("--list-pvs"))
    assert len(names) > 20
    assert names < listed

    async def body() -> None:
        values = await caget(sorted(listed), timeout=10)
        assert all(value.ok for value in values)

    run(body)


def test_a_controller_that_is_off_is_invalid_until_it_is_there(tmp_path: Path) -> None:
    with virtual.TDC001(stage=stages.Z8).tcp() as tdc:
        url = tdc.url
    with ca.ioc(tmp_path, PREFIX + bench_of(url), opens=False) as one:

        async def off() -> None:
            one.wait_for("cannot be opened")
            assert (await caget("LAB:x.RBV", format=FORMAT_TIME)).severity == 3
            await refused("LAB:x", 1.0)

        async def there() -> None:
            await caput("LAB:x", 0.1, wait=True, timeout=10)
            assert (await caget("LAB:x.RBV", format=FORMAT_TIME)).severity == 0

        run(off)
        with virtual.TDC001(stage=stages.Z8).tcp(int(url.rpartition(":")[2])):
            one.wait_for("is open")
            time.sleep(0.2)
            run(there)


def test_an_address_or_a_port_that_cannot_be_used_is_named(
    one: ca.IocProcess, tmp_path: Path
) -> None:
    for options, said in (
        (("--bind", "192.0.2.1"), "cannot serve: cannot listen on 192.0.2.1: "),
        ((), f"another server has port {ca.PORT} on 127.0.0.1; choose another port"),
    ):
        words = [*COMMAND, "ioc", str(tmp_path / "bench.toml"), "--port", str(ca.PORT), *options]
        ended = subprocess.run(words, capture_output=True, text=True, timeout=30)
        assert ended.returncode == 1
        assert said in ended.stderr
        assert "Traceback" not in ended.stderr


def test_a_put_whose_client_has_gone_continues_and_fails_without_a_traceback(
    one: ca.IocProcess, line: Line
) -> None:
    words = [sys.executable, "-m", "caproto.commandline.put", "--no-repeater"]
    environment = {**os.environ, "EPICS_CA_ADDR_LIST": f"127.0.0.1:{ca.PORT}"}

    async def body() -> None:
        subprocess.run([*words, "LAB:x", "8"], env=environment, check=True, timeout=30)
        here = float(await caget("LAB:x.RBV"))
        while float(await caget("LAB:x.RBV")) < here + 0.1:
            await asyncio.sleep(0.05)
        await caput("LAB:x.STOP", 1, wait=True, timeout=10)

    run(body)
    one.wait_for("STOP was put")
    assert one.end() == 0
    assert "Traceback" not in "".join(one.log)
    assert line.sent.count(MOVE) == 1
