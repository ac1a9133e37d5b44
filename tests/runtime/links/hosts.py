"""Two ways to use a link, threads and asyncio, with the same methods, so that one test covers both."""

from __future__ import annotations

import asyncio
import threading
import time

import pytest

from stagewire.errors import TransportLostError
from stagewire.links import AsyncLink, Link, open_async_link, open_link

PATIENCE = 10.0  # seconds; a test that waits this long fails


class Threads:
    """A link that one thread reads while the test writes."""

    def __init__(self, url: str, **options: object) -> None:
        self.link: Link = open_link(url, **options)
        self.heard = bytearray()
        self.loss: TransportLostError | None = None
        self._reader = threading.Thread(target=self._read)
        self._reader.start()

    def _read(self) -> None:
        try:
            while True:
                self.heard += self.link.read(PATIENCE)
        except TransportLostError as error:
            self.loss = error

    def write(self, data: bytes) -> None:
        self.link.write(data)

    def read(self, size: int) -> bytes:
        end = time.monotonic() + PATIENCE
        while len(self.heard) < size and self.loss is None and time.monotonic() < end:
            time.sleep(0.001)
        return bytes(self.heard)

    def wait_lost(self) -> TransportLostError:
        self._reader.join(PATIENCE)
        assert self.loss is not None
        return self.loss

    def close(self) -> None:
        self.link.close()
        self._reader.join()


class Loop:
    """A link in an event loop that runs while the test waits."""

    def __init__(self, url: str, **options: object) -> None:
        self.heard = bytearray()
        self.loss: TransportLostError | None = None
        self._runner = asyncio.Runner()
        self._changed = asyncio.Event()
        try:
            self.link: AsyncLink = self._runner.run(open_async_link(url, **options))
        except BaseException:
            self._runner.close()
            raise
        self._runner.get_loop().call_soon(self.link.start, self._received, self._lost)

    def _received(self, data: bytes) -> None:
        assert self.loss is None
        self.heard += data
        self._changed.set()

    def _lost(self, error: TransportLostError) -> None:
        assert self.loss is None
        self.loss = error
        self._changed.set()

    def write(self, data: bytes) -> None:
        async def write() -> None:
            self.link.write(data)

        self._runner.run(write())

    def read(self, size: int) -> bytes:
        async def read() -> None:
            while len(self.heard) < size and self.loss is None:
                await self._changed.wait()
                self._changed.clear()

        self._run(read())
        return bytes(self.heard)

    def wait_lost(self) -> TransportLostError:
        async def wait() -> None:
            while self.loss is None:
                await self._changed.wait()
                self._changed.clear()

        self._run(wait())
        assert self.loss is not None
        return self.loss

    def _run(self, waiting: object) -> None:
        try:
            self._runner.run(asyncio.wait_for(waiting, PATIENCE))  # type: ignore[arg-type]
        except TimeoutError:
            pytest.fail("nothing arrived in time")

    def close(self) -> None:
        self._runner.run(self.link.close())
        self._runner.close()


HOSTS = {"threads": Threads, "asyncio": Loop}
