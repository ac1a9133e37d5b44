"""How a link is opened: by which module, in which steps, with which flow control."""

from __future__ import annotations

import asyncio
import ctypes
import os
import socket
import struct
import subprocess
import sys
import types
from collections.abc import Callable, Iterator
from contextlib import closing
from importlib import metadata
from typing import Any

import pytest
from far_ends import FAR_ENDS
from hosts import HOSTS, Loop, Threads

from stagewire._links import serial_port
from stagewire.errors import BadValueError
from stagewire.links import AsyncLink, Link, LinkSettings, open_async_link, open_link

pytestmark = pytest.mark.filterwarnings("ignore:set(Daemon|Name)\\(\\) is deprecated")
posix = pytest.mark.skipif(os.name != "posix", reason="only POSIX ports are files")
Open = Callable[..., Threads | Loop]


@pytest.fixture
def pty() -> Iterator[str]:
    with FAR_ENDS["pty"]() as far:
        yield far.url


@pytest.fixture
def steps(monkeypatch: pytest.MonkeyPatch) -> list[object]:
    """Return the operations on a port while it is opened, in order; pauses take no time."""
    import serial

    happened: list[object] = []

    def note(name: str) -> Callable[..., Any]:
        done = getattr(serial.Serial, name)

        def noted(self: object, *args: object) -> Any:
            happened.append(name)
            return done(self, *args)

        return noted

    for name in ("open", "reset_input_buffer", "reset_output_buffer"):
        monkeypatch.setattr(serial.Serial, name, note(name))
    rts = serial.Serial.rts
    flow = serial.Serial.rtscts
    monkeypatch.setattr(
        serial.Serial,
        "rts",
        rts.setter(lambda self, value: happened.append(f"rts {value}") or rts.fset(self, value)),
    )

    def set_flow(self: Any, value: bool) -> None:
        if self.is_open:
            happened.append(f"rtscts {value}")
        flow.fset(self, value)

    monkeypatch.setattr(serial.Serial, "rtscts", flow.setter(set_flow))

    async def pause(seconds: float) -> None:
        happened.append(seconds)

    loop_s = types.SimpleNamespace(sleep=pause)
    monkeypatch.setattr(serial_port, "time", types.SimpleNamespace(sleep=happened.append))
    monkeypatch.setattr(serial_port, "asyncio", loop_s)
    return happened


@pytest.fixture
def usb_chip(monkeypatch: pytest.MonkeyPatch) -> Callable[[int], None]:
    """Make the port a USB chip of the given vendor."""

    def of(vendor: int) -> None:
        chip = types.SimpleNamespace(vid=vendor)
        monkeypatch.setattr(serial_port, "port_called", lambda _: chip)

    return of


PURGED = [0.05, "reset_input_buffer", "reset_output_buffer", 0.05]
FLOW = ["rtscts True", "rts True"]


@posix
@pytest.mark.parametrize("way", HOSTS)
class TestSteps:
    """A pty has no RTS; the link works if it survives ENOTTY."""

    def opened(self, way: str, url: str, steps: list[object], **options: object) -> list[object]:
        with closing(HOSTS[way](url, **options)) as host:
            done = list(steps)
            host.write(b"hello")
            assert host.read(5) == b"hello"
        return done

    def test_an_ftdi_chip_is_opened_as_on_page_10(
        self, way: str, pty: str, steps: list[object], usb_chip: Callable[[int], None]
    ) -> None:
        usb_chip(0x0403)
        assert self.opened(way, pty, steps) == ["open", *PURGED, *FLOW]

    @pytest.mark.parametrize(
        ("options", "expected"),
        [
            ({"rtscts": False}, []),
            ({"rtscts": False, "purge": True}, PURGED),
            ({"purge": False}, FLOW),
            ({"purge_dwell": 0.2}, [0.2, *PURGED[1:3], 0.2, *FLOW]),
        ],
    )
    def test_an_ftdi_chip_with_options(
        self,
        way: str,
        pty: str,
        steps: list[object],
        usb_chip: Callable[[int], None],
        options: dict[str, object],
        expected: list[object],
    ) -> None:
        usb_chip(0x0403)
        assert self.opened(way, pty, steps, **options) == ["open", *expected]

    def test_other_ports_have_no_flow_control_and_no_pauses(
        self, way: str, pty: str, steps: list[object], usb_chip: Callable[[int], None]
    ) -> None:
        assert self.opened(way, pty, steps) == ["open"]
        usb_chip(0x067B)
        assert self.opened(way, pty, steps)[-1:] == ["open"]

    def test_other_ports_with_flow_control(self, way: str, pty: str, steps: list[object]) -> None:
        assert self.opened(way, pty, steps, rtscts=True) == ["open", *PURGED, *FLOW]


@posix
@pytest.mark.parametrize("way", HOSTS)
class TestPort:
    @pytest.mark.parametrize("rtscts", [False, True])
    @pytest.mark.parametrize("baudrate", [9600, 115200])
    def test_the_settings_of_the_port(
        self, way: str, pty: str, baudrate: int, rtscts: bool
    ) -> None:
        import termios

        options = {"baudrate": baudrate, "rtscts": rtscts, "purge_dwell": 0}
        with closing(HOSTS[way](pty, **options)):
            port = os.open(pty, os.O_RDWR | os.O_NOCTTY)
            try:
                iflag, _, cflag, lflag, ispeed, ospeed, _ = termios.tcgetattr(port)
            finally:
                os.close(port)
        assert ispeed == ospeed == getattr(termios, f"B{baudrate}")
        assert cflag & termios.CSIZE == termios.CS8
        assert not cflag & (termios.PARENB | termios.CSTOPB)
        assert bool(cflag & termios.CRTSCTS) == rtscts
        assert not iflag & (termios.IXON | termios.IXOFF | termios.ICRNL | termios.INLCR)
        assert not lflag & (termios.ICANON | termios.ECHO | termios.ISIG)

    def test_opened_by_a_symbolic_link(self, way: str, pty: str, tmp_path: Any) -> None:
        link = tmp_path / "by-serial"
        link.symlink_to(pty)
        with closing(HOSTS[way](str(link))) as host:
            host.write(b"x")
            assert host.read(1) == b"x"


@posix
def test_cancelled_during_opening(pty: str) -> None:
    """The port can be opened again."""

    async def main() -> None:
        opening = asyncio.create_task(open_async_link(pty, rtscts=True, purge_dwell=10))
        await asyncio.sleep(0.02)
        opening.cancel()
        with pytest.raises(asyncio.CancelledError):
            await opening

    asyncio.run(main())
    open_link(pty).close()


def test_cancelled_while_connecting() -> None:
    """The other end does not answer as RFC 2217 requires; the half-open connection is closed."""

    async def main(url: str) -> None:
        opening = asyncio.create_task(open_async_link(url))
        await asyncio.sleep(0.05)
        opening.cancel()
        with pytest.raises(asyncio.CancelledError):
            await opening

    with socket.create_server(("127.0.0.1", 0)) as listener:
        asyncio.run(main(f"rfc2217://127.0.0.1:{listener.getsockname()[1]}?timeout=0.2"))
        listener.accept()[0].close()


def test_cancelled_when_already_open() -> None:
    """A network link that opened after the cancellation is closed."""

    async def main(url: str) -> None:
        opening = asyncio.create_task(open_async_link(url))
        await asyncio.sleep(0)
        await asyncio.sleep(0)
        opening.cancel()
        with pytest.raises(asyncio.CancelledError):
            await opening
        await asyncio.sleep(0.5)

    with FAR_ENDS["rfc2217"]() as far:
        asyncio.run(main(far.url))


class TestOtherSchemes:
    @pytest.fixture
    def module(self, monkeypatch: pytest.MonkeyPatch) -> types.ModuleType:
        module = types.ModuleType("lines_of_others")
        monkeypatch.setitem(sys.modules, module.__name__, module)
        entry = metadata.EntryPoint("acme", module.__name__, "stagewire.links")
        given = {("stagewire.links", "acme"): [entry]}
        monkeypatch.setattr(
            metadata, "entry_points", lambda group, name: given.get((group, name), [])
        )
        return module

    def test_threads(self, module: types.ModuleType) -> None:
        opened = open_link("loop://")
        module.open_link = lambda *asked: (asked, opened)[1]  # type: ignore[attr-defined]
        assert open_link("ACME://1") is opened
        asked = []
        module.open_link = lambda *args: asked.append(args)  # type: ignore[attr-defined]
        open_link("acme://1?x=2", baudrate=9600)
        assert asked == [("acme://1?x=2", LinkSettings(baudrate=9600))]
        opened.close()

    def test_asyncio(self, module: types.ModuleType) -> None:
        asked = []

        async def open_one(*args: object) -> None:
            asked.append(args)

        module.open_async_link = open_one  # type: ignore[attr-defined]
        asyncio.run(open_async_link("acme://1"))
        assert asked == [("acme://1", LinkSettings())]


class TestOpenLinks:
    def test_an_open_link_is_returned_unchanged(self) -> None:
        async def main() -> None:
            link = await open_async_link("loop://")
            assert await open_async_link(link, baudrate=9600) is link
            with pytest.raises(
                BadValueError, match="a link for asyncio; expected a link for threads"
            ):
                open_link(link)  # type: ignore[arg-type]
            await link.close()

        asyncio.run(main())
        with open_link("loop://") as link:
            assert open_link(link) is link
            with pytest.raises(
                BadValueError, match="a link for threads; expected a link for asyncio"
            ):
                asyncio.run(open_async_link(link))  # type: ignore[arg-type]

    def test_the_bases_of_links_are_abstract_and_have_no_clock(self) -> None:
        for base in (Link, AsyncLink):
            with pytest.raises(TypeError, match="abstract"):
                base()  # type: ignore[abstract]
            assert base.clock is None


def test_tcp_sends_immediately_and_probes_the_other_end() -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        url = f"socket://127.0.0.1:{listener.getsockname()[1]}"
        with open_link(url) as link:
            connection = link._take.__self__.socket  # type: ignore[attr-defined]
            assert connection.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY)
            assert connection.getsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE)
            for name, value in (("TCP_KEEPIDLE", 1), ("TCP_KEEPINTVL", 1), ("TCP_KEEPCNT", 3)):
                if hasattr(socket, name):
                    option = getattr(socket, name)
                    assert connection.getsockopt(socket.IPPROTO_TCP, option) == value


@pytest.mark.matrix  # the system needs seconds to notice
@pytest.mark.skipif(
    sys.platform != "linux", reason="only Linux can make a connection drop its input"
)
def test_a_disconnected_cable() -> None:
    """The other end neither answers nor hangs up. Both a listening and a writing host detect it."""
    with socket.create_server(("127.0.0.1", 0)) as listener:
        url = f"socket://127.0.0.1:{listener.getsockname()[1]}"
        hosts, far = [], []
        for way in HOSTS.values():
            hosts.append(way(url, stall_timeout=0.5))
            far.append(listener.accept()[0])
            deafen(far[-1])
        hosts[0].write(b"move")
        for host in hosts:
            assert "is lost" in str(host.wait_lost())
            host.close()
        for connection in far:
            connection.close()


def deafen(connection: socket.socket) -> None:
    """Make the system drop all input of a connection: a filter of one instruction, "keep 0 bytes"."""
    attach_filter = 26
    instruction = ctypes.create_string_buffer(struct.pack("HBBI", 0x06, 0, 0, 0))
    program = struct.pack("HL", 1, ctypes.addressof(instruction))
    connection.setsockopt(socket.SOL_SOCKET, attach_filter, program)


def test_pyserial_is_not_needed_for_tcp() -> None:
    program = (
        "import sys, socket, stagewire.links as links;"
        "far = socket.create_server(('127.0.0.1', 0));"
        "links.open_link(f'socket://127.0.0.1:{far.getsockname()[1]}').close(); far.close();"
        "print(any(name.split('.')[0] == 'serial' for name in sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.stdout.strip() == "False", done.stderr
