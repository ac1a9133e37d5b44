"""Links that can be opened again, to get back into step with a controller.

Some controllers are confused by damaged frames and answer nothing until the connection is opened again. The
next checks should not fail for the same reason.
"""

from __future__ import annotations

import time
from abc import abstractmethod
from collections.abc import Callable
from functools import partial
from typing import Final

from stagewire.errors import LinkOpenError, TransportLostError
from stagewire.links import Link, open_link

_TRIES: Final = 5
_PAUSE: Final = 0.4
"""Seconds between two attempts: a server that serves one host must notice first that this one has left."""


class Reopenable(Link):
    """A link that may be opened again."""

    @abstractmethod
    def reopen(self) -> bool:
        """Close the link and open it again; return whether that is possible. Unread bytes are lost.

        Raises :class:`~stagewire.errors.TransportLostError` if the link could only be closed.
        """


class ReopeningLink(Reopenable):
    """A link to a URL that can be opened again, unless its controller exists only as long as the link.

    A controller at ``virtual://`` would be a new one after that.

    :param url: the URL or port.
    :param opened: opens the link; by default :func:`stagewire.links.open_link` with the URL.

    Raises the same errors as :func:`stagewire.links.open_link`.
    """

    def __init__(self, url: str, opened: Callable[[], Link] | None = None) -> None:
        self._open = opened or partial(open_link, url)
        self._link = self._open()
        self.url = self._link.url
        self.clock = self._link.clock

    def reopen(self) -> bool:
        """Close the link and open it again; see :meth:`Reopenable.reopen`."""
        if self.url.lower().startswith("virtual://"):
            return False
        self._link.close()
        for _ in range(_TRIES - 1):
            try:
                self._link = self._open()
            except LinkOpenError:
                time.sleep(_PAUSE)
            else:
                return True
        try:
            self._link = self._open()
        except LinkOpenError as error:
            raise TransportLostError(f"{self.url} could not be opened again: {error}") from error
        return True

    def read(self, timeout: float) -> bytes:
        """Read from the link; see :meth:`.Link.read`."""
        return self._link.read(timeout)

    def write(self, data: bytes) -> None:
        """Write to the link; see :meth:`.Link.write`."""
        self._link.write(data)

    def write_now(self, data: bytes) -> None:
        """Write immediately; see :meth:`.Link.write_now`."""
        self._link.write_now(data)

    def has_unread(self) -> bool:
        """Return whether there are unprocessed bytes; see :meth:`.Link.has_unread`."""
        return self._link.has_unread()

    def wake(self) -> None:
        """Make a waiting read return soon; see :meth:`.Link.wake`."""
        self._link.wake()

    def close(self) -> None:
        """Close the link; see :meth:`.Link.close`."""
        self._link.close()
