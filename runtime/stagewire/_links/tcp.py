"""TCP for threads, and the parts shared with asyncio: addresses, socket options and errors."""

from __future__ import annotations

import contextlib
import errno
import socket
from typing import Final
from urllib.parse import urlsplit

from stagewire._links.descriptor import DescriptorLink
from stagewire._links.link import CLOSED, LinkSettings, lost
from stagewire.errors import LinkOpenError, TransportLostError, TurnedAwayError

HUNG_UP = "the other end closed the connection"

_PROBES: Final = (
    # If supported: the first after 1 s without a byte, then one per second, three at most.
    ("TCP_KEEPIDLE", 1),
    ("TCP_KEEPALIVE", 1),  # the name on macOS
    ("TCP_KEEPINTVL", 1),
    ("TCP_KEEPCNT", 3),
)
_LEAST_UNANSWERED = 4.0  # seconds; what the probes above need


_LONGEST_TEXT: Final = 256
"""Bytes; a longer text is not the notice of a server that turns a host away."""


class Beginning:
    """The first bytes of a connection, which may be all that the other end ever sends.

    A serial line has one host, so a server closes the connection of a second one immediately. Some servers
    send a line of text first.
    """

    __slots__ = ("_data", "was_reset")

    def __init__(self) -> None:
        self._data = b""
        self.was_reset = False
        """Whether the system reported that the other end reset the connection."""

    def add(self, data: bytes) -> None:
        """Note received bytes."""
        if len(self._data) <= _LONGEST_TEXT:
            self._data += data[: _LONGEST_TEXT + 1]

    def lost(self, url: str, why: str) -> TransportLostError:
        """Return a new error for the loss of the connection.

        Only the protocol, which a link does not know, decides whether text is the notice of a server or a
        reply.
        """
        text = self._data.decode("ascii", "replace").strip()
        is_text = len(self._data) <= _LONGEST_TEXT and all(
            letter.isascii() and (letter.isprintable() or letter in "\r\n\t") for letter in text
        )
        closed_there = why == HUNG_UP or (self.was_reset and why != CLOSED)
        if not (is_text and closed_there):
            return lost(url, why)
        when = f"after the text {text!r}" if text else "before it sent anything"
        turned_away = TurnedAwayError(
            f"{url}: the other end closed the connection {when}. Another host may be connected (stagewire "
            "serve names it in its log), and a line has one host at a time: close that connection or wait "
            "until it ends, then open this one again"
        )
        if not text:
            return turned_away
        error = lost(url, why)
        error.turned_away = turned_away
        return error


def address_of(url: str) -> tuple[str, int]:
    """Return host and port of ``socket://HOST:PORT``.

    Raises :class:`~stagewire.errors.LinkOpenError` for another URL.
    """
    expected = "expected socket://HOST:PORT, such as socket://127.0.0.1:4001"
    try:
        parts = urlsplit(url)
        host, port = parts.hostname, parts.port
    except ValueError as error:
        raise LinkOpenError(f"{url} cannot be opened: {error}; {expected}") from None
    if not host or not port or parts.path not in ("", "/"):
        raise LinkOpenError(f"{url} cannot be opened: {expected}, with a port of 1 to 65535")
    if parts.query or parts.fragment or parts.username is not None:
        raise LinkOpenError(f"{url} cannot be opened: a TCP URL has no options; {expected}")
    return host, port


def set_options(connection: socket.socket, stall_timeout: float) -> None:
    """Send every frame immediately, and detect when the other end disappears."""
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    for name, value in _PROBES:
        if (option := getattr(socket, name, None)) is not None:
            connection.setsockopt(socket.IPPROTO_TCP, option, value)
    if (option := getattr(socket, "TCP_USER_TIMEOUT", None)) is not None:
        # No probes are sent while sent data is unacknowledged; Linux has another limit for that. It also
        # applies to an end that is alive but accepts nothing, and so may not be below the user's limit.
        unanswered = round(max(_LEAST_UNANSWERED, stall_timeout) * 1000)
        connection.setsockopt(socket.IPPROTO_TCP, option, unanswered)


def stop_sending(connection: socket.socket) -> None:
    """Let the system send what it holds after the connection is closed; the last bytes may be a stop.

    The system discards them if a socket is closed with unread bytes, so read those.
    """
    with contextlib.suppress(OSError):
        connection.shutdown(socket.SHUT_WR)
        while connection.recv(65_536):
            pass


def connect_refusal(url: str, error: OSError, open_timeout: float) -> LinkOpenError:
    """Return the error for a host that could not be reached."""
    if isinstance(error, ConnectionRefusedError):
        why = (
            "the connection was refused: the host is reachable, but nothing listens on that port. "
            "Check the port, and that the server is running"
        )
    elif isinstance(error, TimeoutError):
        why = (
            f"no answer within {open_timeout:g} s (open_timeout). Check the address, "
            "that the host is switched on, and that no firewall blocks the connection"
        )
    elif error.errno in (errno.EHOSTUNREACH, errno.ENETUNREACH):
        why = f"no route to that host ({error.strerror}). Check the address and the network"
    else:
        why = f"the system says: {error.strerror or error}"
    return LinkOpenError(f"{url} cannot be opened: {why}")


def unknown_host(url: str, host: str, error: socket.gaierror) -> LinkOpenError:
    """Return the error for a host name without an address."""
    return LinkOpenError(
        f"{url} cannot be opened: unknown host {host!r} ({error.strerror}). Check the name, "
        "or give the numeric address"
    )


def open_tcp(url: str, settings: LinkSettings) -> DescriptorLink:
    """Connect to ``socket://HOST:PORT``.

    Raises :class:`~stagewire.errors.LinkOpenError`.
    """
    host, port = address_of(url)
    try:
        connection = socket.create_connection((host, port), settings.open_timeout)
        try:
            set_options(connection, settings.stall_timeout)
        except OSError:  # macOS refuses options if the other end has hung up
            connection.close()
            raise
    except socket.gaierror as error:
        raise unknown_host(url, host, error) from error
    except OSError as error:
        raise connect_refusal(url, error, settings.open_timeout) from error
    connection.setblocking(False)
    made = _Connection(connection)
    return DescriptorLink(
        url,
        connection.fileno(),
        made.take,
        made.give,
        made.hang_up,
        HUNG_UP,
        settings.stall_timeout,
        made.beginning.lost,
    )


class _Connection:
    """A socket, and how its connection began."""

    def __init__(self, connection: socket.socket) -> None:
        self.socket = connection
        self.beginning = Beginning()

    def take(self, size: int) -> bytes:
        try:
            data = self.socket.recv(size)
        except ConnectionError:
            self.beginning.was_reset = True
            raise
        self.beginning.add(data)
        return data

    def give(self, data: bytes | memoryview) -> int:
        try:
            return self.socket.send(data)
        except ConnectionError:
            self.beginning.was_reset = True
            raise

    def hang_up(self) -> None:
        stop_sending(self.socket)
        self.socket.close()
