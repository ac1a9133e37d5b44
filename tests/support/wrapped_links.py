"""A link around another link, for tests that observe or change the traffic."""

from __future__ import annotations

from stagewire.links import Link


class WrappedLink(Link):
    """A link that passes everything on. Subclasses override what they observe or change."""

    def __init__(self, link: Link) -> None:
        self.url = link.url
        self.clock = link.clock
        self._link = link

    def read(self, timeout: float) -> bytes:
        return self._link.read(timeout)

    def write(self, data: bytes) -> None:
        self._link.write(data)

    def write_now(self, data: bytes) -> None:
        self.write(data)

    def wake(self) -> None:
        self._link.wake()

    def close(self) -> None:
        self._link.close()
