"""Links that cannot be opened: the error states the reason and what to do."""

from __future__ import annotations

import errno
import os
import socket
import subprocess
import sys
import types
from collections.abc import Callable, Iterator
from contextlib import closing
from importlib import metadata
from typing import Any

import pytest
from hosts import HOSTS

from stagewire._links import serial_port as refusal
from stagewire.errors import BadValueError, LinkOpenError

pytestmark = [
    pytest.mark.filterwarnings("ignore:set(Daemon|Name)\\(\\) is deprecated"),
    pytest.mark.parametrize("way", HOSTS),
]
posix = pytest.mark.skipif(os.name != "posix", reason="only POSIX ports are files")
Open = Callable[..., Any]
PORT = types.SimpleNamespace(
    device="/dev/ttyUSB7", description="APT Stepper Motor Controller", vid=0x0403, pid=0xFAF0
)


@pytest.fixture
def refused(way: str) -> Callable[..., str]:
    def refused(url: str, **options: object) -> str:
        with pytest.raises(LinkOpenError) as error:
            HOSTS[way](url, **options)
        text = str(error.value)
        assert text.startswith(f"{url} cannot be opened: ") or not url.strip()
        return text

    return refused


@pytest.fixture
def one_port(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(refusal, "ports_there_are", lambda: [PORT])


@pytest.fixture
def no_port(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(refusal, "ports_there_are", list)


@pytest.fixture
def pty() -> Iterator[str]:
    master, slave = os.openpty()
    yield os.ttyname(slave)
    os.close(master)
    os.close(slave)


@pytest.fixture
def failing(monkeypatch: pytest.MonkeyPatch) -> Callable[[OSError], None]:
    """Make the system refuse to open any port."""

    def fail(error: OSError) -> None:
        def refuse(*_: object, **__: object) -> int:
            raise error

        monkeypatch.setattr("serial.serialposix.os.open", refuse)

    return fail


class TestPorts:
    @posix
    def test_a_missing_port_is_reported_with_the_available_ports(
        self, refused: Open, one_port: None
    ) -> None:
        said = refused("/dev/ttyUSB9")
        assert "no such port" in said
        assert "available: /dev/ttyUSB7 (APT Stepper Motor Controller)" in said

    @posix
    def test_no_ports_are_available(self, refused: Open, no_port: None) -> None:
        assert "has no serial port: is the controller plugged in" in refused("/dev/ttyUSB9")

    @posix
    def test_no_permission(self, refused: Open, failing: Open, one_port: None) -> None:
        failing(PermissionError(errno.EACCES, "Permission denied"))
        said = refused("/dev/ttyUSB7")
        assert "belongs to the group dialout" in said
        assert 'ATTRS{idVendor}=="0403", ATTRS{idProduct}=="faf0", GROUP="dialout"' in said

    @posix
    def test_no_permission_for_a_port_without_usb(self, refused: Open, failing: Open) -> None:
        failing(PermissionError(errno.EACCES, "Permission denied"))
        assert 'SUBSYSTEM=="tty", KERNEL=="ttyS99"' in refused("/dev/ttyS99")

    @posix
    def test_a_port_open_in_this_program(self, refused: Open, way: str, pty: str) -> None:
        with closing(HOSTS[way](pty)):
            said = refused(pty)
        assert "it is in use by this program itself. Close it there" in said

    @posix
    def test_a_port_open_in_another_program(self, refused: Open, failing: Open) -> None:
        failing(OSError(errno.EBUSY, "Device or resource busy"))
        assert "it is in use by another program. Close it there" in refused("/dev/ttyUSB7")

    @posix
    def test_a_port_is_named_with_the_process_that_has_it_open(self, refused: Open) -> None:
        main, port = os.openpty()
        name = os.ttyname(port)
        os.close(port)
        program = (
            f"import serial; port = serial.Serial({name!r}, exclusive=True); input(print('open'))"
        )
        with subprocess.Popen(
            [sys.executable, "-uc", program],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        ) as holder:
            assert holder.stdin is not None
            assert holder.stdout is not None
            assert holder.stdout.readline() == "open\n"
            said = refused(name)
            holder.stdin.write("\n")
        os.close(main)
        assert f"(process {holder.pid}). Close it there" in said
        assert f"start stagewire serve {name} --tcp 4001" in said

    @posix
    @pytest.mark.parametrize("name", ["/dev/null", "/dev", __file__])
    def test_a_file_that_is_not_a_port(self, refused: Open, name: str) -> None:
        assert "it is not a serial port" in refused(name)

    @posix
    def test_other_errors_are_quoted_from_the_system(self, refused: Open, failing: Open) -> None:
        failing(OSError(errno.EIO, "Input/output error"))
        assert "the system says" in refused("/dev/ttyUSB7")

    @posix
    def test_a_refused_port_is_not_left_open(self, refused: Open, way: str, pty: str) -> None:
        with closing(HOSTS[way](pty)):
            refused(pty)
        HOSTS[way](pty).close()


class TestNetworks:
    @pytest.mark.parametrize("scheme", ["socket", "rfc2217"])
    def test_nothing_listens(self, refused: Open, scheme: str) -> None:
        with socket.socket() as unused:
            unused.bind(("127.0.0.1", 0))
            port = unused.getsockname()[1]
            said = refused(f"{scheme}://127.0.0.1:{port}")
        assert "the connection was refused" in said
        assert "nothing listens on that port" in said

    @pytest.mark.parametrize("scheme", ["socket", "rfc2217"])
    def test_an_unknown_host(
        self, refused: Open, scheme: str, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        def unknown(*_: object, **__: object) -> None:
            raise socket.gaierror(socket.EAI_NONAME, "Name or service not known")

        monkeypatch.setattr(socket, "getaddrinfo", unknown)
        said = refused(f"{scheme}://stage.invalid:4001")
        assert "unknown host 'stage.invalid' (Name or service not known)" in said

    def test_no_answer(self, refused: Open) -> None:
        """A listener whose queue is full does not answer."""
        with socket.socket() as full, socket.socket() as first, socket.socket() as second:
            full.bind(("127.0.0.1", 0))
            full.listen(0)
            for waiting in (first, second):
                waiting.setblocking(False)
                waiting.connect_ex(full.getsockname())
            url = f"socket://127.0.0.1:{full.getsockname()[1]}"
            assert "no answer within 0.1 s (open_timeout)" in refused(url, open_timeout=0.1)

    @pytest.mark.parametrize(
        "url",
        [
            "socket://",
            "socket://127.0.0.1",
            "socket://:4001",
            "socket://127.0.0.1:x",
            "socket://127.0.0.1:0",
            "socket://127.0.0.1:70000",
            "socket://127.0.0.1:1/x",
            "SOCKET://[::1",
            "socket://127.0.0.1:4001?logging=debug",
            "socket://me@127.0.0.1:1",
        ],
    )
    def test_an_invalid_url(self, refused: Open, url: str) -> None:
        assert "expected socket://HOST:PORT" in refused(url)

    def test_an_invalid_url_of_pyserial(self, refused: Open) -> None:
        assert "expected a string in the form" in refused("rfc2217://127.0.0.1:x")


class TestSchemes:
    def test_an_unknown_scheme(self, refused: Open) -> None:
        said = refused("tcp://127.0.0.1:4001")
        assert "unknown scheme tcp://. Available are socket://HOST:PORT" in said

    @pytest.mark.parametrize("url", ["", "  "])
    def test_an_empty_url(self, refused: Open, url: str) -> None:
        assert "the URL is empty" in refused(url)

    def test_a_url_that_is_not_a_string(self, way: str) -> None:
        with pytest.raises(BadValueError, match="a string, not 4001"):
            HOSTS[way](4001)

    def test_a_scheme_of_two_packages(self, refused: Open, monkeypatch: pytest.MonkeyPatch) -> None:
        brought = [metadata.EntryPoint("x", value, "stagewire.links") for value in ("one", "two")]
        monkeypatch.setattr(metadata, "entry_points", lambda **_: brought)
        assert "several packages provide x:// links: one, two; uninstall" in refused("x://1")

    def test_a_scheme_of_a_broken_package(
        self, refused: Open, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        broken = metadata.EntryPoint("x", "no_such_module_at_all", "stagewire.links")
        monkeypatch.setattr(metadata, "entry_points", lambda **_: [broken])
        assert "by no_such_module_at_all, which cannot be imported" in refused("x://1")
