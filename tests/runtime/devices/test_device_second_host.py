"""A line serves one host: a second host gets a helpful error, and the first is not disturbed."""

from __future__ import annotations

import asyncio
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import pytest

import stagewire
import stagewire_virtual as virtual
from stagewire.errors import LinkOpenError, TransportLostError
from stagewire_apt import TDC001, aio
from stagewire_ms2000 import MS2000

Call = Callable[..., Any]


def in_threads(url: str, call: str = "", **options: Any) -> None:
    with TDC001.open(url, **options) as tdc:
        if call:
            getattr(tdc, call)()


def without_a_thread(url: str, call: str = "", **options: Any) -> None:
    in_threads(url, call, background=False, **options)


def in_a_loop(url: str, call: str = "", **options: Any) -> None:
    async def use() -> None:
        async with aio.TDC001.open(url, **options) as tdc:
            if call:
                await getattr(tdc, call)()

    asyncio.run(use())


def of_an_unknown_unit(url: str) -> None:
    stagewire.open(url)


@contextmanager
def turning_away(notice: bytes) -> Iterator[str]:
    """Serve a port like a serial-to-Ethernet server whose line is in use: send a notice, then close."""
    with socket.create_server(("127.0.0.1", 0)) as listener:

        def serve() -> None:
            while True:
                connection, _ = listener.accept()
                with connection:
                    if not (opened := connection.recv(4096)):  # the identity request
                        continue
                    if opened == b"end":
                        return
                    connection.sendall(notice)
                    connection.shutdown(socket.SHUT_WR)
                    while connection.recv(
                        4096
                    ):  # closing with unread bytes would reset the connection
                        pass

        thread = threading.Thread(target=serve)
        thread.start()
        port = listener.getsockname()[1]
        try:
            yield f"socket://127.0.0.1:{port}"
        finally:
            with socket.create_connection(("127.0.0.1", port)) as last:
                last.sendall(b"end")
            thread.join()


sides = pytest.mark.parametrize("use", [in_threads, without_a_thread, in_a_loop])


@pytest.mark.parametrize("use", [in_threads, without_a_thread, in_a_loop, of_an_unknown_unit])
def test_a_second_host_gets_an_error_that_another_may_be_connected(use: Call) -> None:
    with virtual.TDC001().tcp() as served, TDC001.open(served.url) as first:
        with pytest.raises(LinkOpenError, match="Another host may be connected") as refused:
            use(served.url)
        text = str(refused.value)
        assert text.startswith(f"{served.url}: the other end closed the connection before it sent")
        assert "close that connection or wait until it ends" in text
        assert "carried out" not in text
        assert first.get_info().serial_number == first.serial_number
    with pytest.raises(LinkOpenError, match="refused"):
        use(served.url)


@sides
def test_the_next_host_can_connect_after_the_first_has_left(use: Call) -> None:
    with virtual.TDC001().tcp() as served:
        with TDC001.open(served.url), pytest.raises(LinkOpenError):
            use(served.url)
        use(served.url, "get_info")


@pytest.mark.parametrize("use", [in_threads, without_a_thread, in_a_loop, of_an_unknown_unit])
def test_the_error_quotes_the_notice_of_the_server(use: Call) -> None:
    with (
        turning_away(b"Port already in use\r\n") as url,
        pytest.raises(LinkOpenError, match=r"after the text 'Port already in use'\. Another host"),
    ):
        use(url)


@sides
def test_without_identification_the_first_call_raises_the_error(use: Call) -> None:
    """The request may have been received, so the error is also a TransportLostError."""
    with (
        virtual.TDC001().tcp() as served,
        TDC001.open(served.url),
        pytest.raises(TransportLostError, match="Another host may be connected") as refused,
    ):
        use(served.url, "home", identify=False)
    assert isinstance(refused.value, LinkOpenError)


def test_reconnecting_raises_the_error() -> None:
    with virtual.TDC001().tcp() as served, TDC001.open(served.url, reconnect_pause=0) as tdc:
        served.unplug()
        with pytest.raises(TransportLostError) as lost:
            tdc.get_info()
        assert not isinstance(lost.value, LinkOpenError)
        with (
            TDC001.open(served.url),
            pytest.raises(LinkOpenError, match="Another host may be connected"),
        ):
            tdc.reconnect()
        tdc.reconnect()
        assert tdc.get_info().serial_number == tdc.serial_number


def test_a_text_reply_is_not_taken_for_a_notice() -> None:
    controller = virtual.MS2000(strategies={"power_on_mode": "high"})
    with controller.tcp() as served, MS2000.open(served.url) as stage:
        with stage.low_level():
            pass
        assert stage.text("V")
        served.unplug()
        with pytest.raises(TransportLostError) as lost:
            stage.text("V")
        assert not isinstance(lost.value, LinkOpenError)
