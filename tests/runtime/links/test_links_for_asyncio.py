"""Behaviour of links for asyncio only: callbacks, no threads, bytes kept for later."""

from __future__ import annotations

import asyncio
import contextlib
import os
import socket
import threading
from collections.abc import Awaitable, Callable, Iterator

import pytest
from far_ends import CAN_BE_LOST, KINDS, FarEnd
from hosts import PATIENCE

from stagewire.errors import TransportLostError
from stagewire.links import AsyncLink, open_async_link

pytestmark = pytest.mark.filterwarnings("ignore:set(Daemon|Name)\\(\\) is deprecated")
WITHOUT_THREADS = [kind for kind in KINDS if kind in ("socket", "pty")]


class Hearing:
    """The callbacks of a link, recorded."""

    def __init__(self) -> None:
        self.heard = bytearray()
        self.losses: list[TransportLostError] = []
        self.changed = asyncio.Event()

    def start(self, link: AsyncLink) -> None:
        link.start(self._received, self._lost)

    def _received(self, data: bytes) -> None:
        self.heard += data
        self.changed.set()

    def _lost(self, error: TransportLostError) -> None:
        self.losses.append(error)
        self.changed.set()

    async def until(self, condition: Callable[[], bool]) -> None:
        async with asyncio.timeout(PATIENCE):
            while not condition():
                await self.changed.wait()
                self.changed.clear()


def run(url: str, test: Callable[[AsyncLink], Awaitable[None]], **options: object) -> None:
    async def main() -> None:
        async with await open_async_link(url, **options) as link:
            await test(link)

    asyncio.run(main())


@pytest.mark.parametrize("kind", KINDS)
class TestCallbacks:
    def test_bytes_received_before_the_start(self, far_end: FarEnd) -> None:
        async def test(link: AsyncLink) -> None:
            hearing = Hearing()
            link.write(b"early")
            await asyncio.sleep(0.02)
            hearing.start(link)
            assert not hearing.heard  # only after start has returned
            await hearing.until(lambda: len(hearing.heard) == 5)
            assert hearing.heard == b"early"

        run(far_end.url, test)

    def test_closing_is_not_a_loss(self, far_end: FarEnd) -> None:
        async def test(link: AsyncLink) -> None:
            hearing = Hearing()
            hearing.start(link)
            await asyncio.gather(link.close(), link.close())
            await asyncio.sleep(0.01)
            assert not hearing.losses
            link.write_now(b"x")

        run(far_end.url, test)

    def test_closed_without_being_started(self, far_end: FarEnd) -> None:
        async def test(link: AsyncLink) -> None:
            await link.close()

        run(far_end.url, test)

    def test_write_now(self, far_end: FarEnd) -> None:
        async def test(link: AsyncLink) -> None:
            hearing = Hearing()
            hearing.start(link)
            link.write_now(b"stop")
            await hearing.until(lambda: len(hearing.heard) == 4)
            assert hearing.heard == b"stop"

        run(far_end.url, test)


@pytest.mark.parametrize("kind", CAN_BE_LOST)
def test_a_loss_before_the_start_is_reported_once(far_end: FarEnd) -> None:
    async def test(link: AsyncLink) -> None:
        hearing = Hearing()
        await asyncio.to_thread(far_end.hang_up)
        hearing.start(link)
        await hearing.until(lambda: bool(hearing.losses))
        with pytest.raises(TransportLostError):
            link.write(b"x")
        await asyncio.sleep(0.01)
        assert len(hearing.losses) == 1

    run(far_end.url, test)


@pytest.mark.parametrize("kind", WITHOUT_THREADS)
def test_no_thread(far_end: FarEnd) -> None:
    before = threading.active_count()

    async def test(link: AsyncLink) -> None:
        hearing = Hearing()
        hearing.start(link)
        link.write(b"hello")
        await hearing.until(lambda: len(hearing.heard) == 5)
        at_work = threading.active_count()
        await link.close()
        # the far end has one more thread, for the connection
        assert at_work <= before + ("socket" in far_end.url)

    run(far_end.url, test)


class TestKept:
    """Bytes that the far end does not accept immediately."""

    @pytest.fixture
    def deaf(self) -> Iterator[tuple[str, socket.socket]]:
        with socket.create_server(("127.0.0.1", 0)) as listener:
            yield f"socket://127.0.0.1:{listener.getsockname()[1]}", listener

    def test_lost_after_the_stall_timeout(self, deaf: tuple[str, socket.socket]) -> None:
        async def test(link: AsyncLink) -> None:
            hearing = Hearing()
            hearing.start(link)
            link.write(bytes(50_000_000))
            await hearing.until(lambda: bool(hearing.losses))
            assert "it accepted no bytes for 0.05 s" in str(hearing.losses[0])

        run(deaf[0], test, stall_timeout=0.05)

    def test_closing_does_not_wait_indefinitely(self, deaf: tuple[str, socket.socket]) -> None:
        async def test(link: AsyncLink) -> None:
            link.write(bytes(50_000_000))
            async with asyncio.timeout(PATIENCE):
                await link.close()

        run(deaf[0], test, stall_timeout=3600)

    def test_closing_sends_kept_bytes(self, deaf: tuple[str, socket.socket]) -> None:
        size = 10_000_000
        heard = []

        def hear() -> None:
            with deaf[1].accept()[0] as far:
                while data := far.recv(65_536):
                    heard.append(len(data))

        async def test(link: AsyncLink) -> None:
            link.write(bytes(size))

        listening = threading.Thread(target=hear)
        listening.start()
        run(deaf[0], test)
        listening.join()
        assert sum(heard) == size

    def test_a_stop_written_before_closing_arrives(self, deaf: tuple[str, socket.socket]) -> None:
        """The host has unread bytes, and the controller has much to read before the stop."""
        far: list[socket.socket] = []

        async def test(link: AsyncLink) -> None:
            far.append(deaf[1].accept()[0])
            far[0].sendall(bytes(100_000))
            link.write(bytes(1_000_000) + b"stop")

        run(deaf[0], test)
        heard = bytearray()
        with far[0]:
            while data := far[0].recv(65_536):
                heard += data
        assert heard.endswith(b"stop")


@pytest.mark.skipif(os.name != "posix", reason="only POSIX ports are files")
class TestKeptOnPort:
    """A port whose far end accepts nothing, such as one that holds CTS."""

    @pytest.fixture
    def deaf(self) -> Iterator[tuple[str, int]]:
        master, slave = os.openpty()
        yield os.ttyname(slave), master
        os.close(master)
        os.close(slave)

    def test_lost_after_the_stall_timeout(self, deaf: tuple[str, int]) -> None:
        async def test(link: AsyncLink) -> None:
            hearing = Hearing()
            hearing.start(link)
            link.write(bytes(1_000_000))
            await hearing.until(lambda: bool(hearing.losses))
            assert "it accepted no bytes for 0.05 s" in str(hearing.losses[0])

        run(deaf[0], test, stall_timeout=0.05)

    def test_kept_bytes_are_sent_in_order(self, deaf: tuple[str, int]) -> None:
        data = bytes(range(256)) * 400
        heard = bytearray()
        os.set_blocking(deaf[1], False)  # a blocking read would keep the loop from writing

        async def test(link: AsyncLink) -> None:
            for at in range(0, len(data), 1000):
                link.write(data[at : at + 1000])
            while len(heard) < len(data):
                with contextlib.suppress(BlockingIOError):
                    heard.extend(os.read(deaf[1], 4096))
                await asyncio.sleep(0)

        run(deaf[0], test)
        assert heard == data

    def test_closing_sends_kept_bytes(self, deaf: tuple[str, int]) -> None:
        data = bytes(range(256)) * 400
        heard = bytearray()

        def hear() -> None:
            while len(heard) < len(data):
                heard.extend(os.read(deaf[1], 4096))

        async def test(link: AsyncLink) -> None:
            link.write(data)
            listening.start()

        listening = threading.Thread(target=hear, daemon=True)
        run(deaf[0], test)
        listening.join(PATIENCE)
        assert heard == data

    def test_closing_does_not_wait_indefinitely(self, deaf: tuple[str, int]) -> None:
        async def test(link: AsyncLink) -> None:
            link.write(bytes(1_000_000))
            async with asyncio.timeout(PATIENCE):
                await link.close()

        run(deaf[0], test, stall_timeout=3600)
