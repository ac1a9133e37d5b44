"""What TCP for threads and for asyncio have in common: addresses, options, and what is said of refusals."""

from __future__ import annotations

import contextlib
import errno
import socket
from typing import Final
from urllib.parse import urlsplit

from stagewire.errors import LinkOpenError

__all__ = [
    "HUNG_UP",
    "address_of",
    "connect_refusal",
    "set_options",
    "stop_sending",
    "unknown_host",
]

HUNG_UP = "the other end closed the connection"

_PROBES: Final = (
    # Where the platform has them: the first after 1 s without a byte, one a second, three at most.
    ("TCP_KEEPIDLE", 1),
    ("TCP_KEEPALIVE", 1),  # what macOS calls the one above
    ("TCP_KEEPINTVL", 1),
    ("TCP_KEEPCNT", 3),
)
_LEAST_UNANSWERED = 4.0  # seconds: what the probes above need


def address_of(url: str) -> tuple[str, int]:
    """Return host and port of ``socket://HOST:PORT``.

    Raises :class:`~stagewire.errors.LinkOpenError` when the URL is not so.
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
        raise LinkOpenError(
            f"{url} cannot be opened: a TCP line has no options in its URL; {expected}"
        )
    return host, port


def set_options(connection: socket.socket, stall_timeout: float) -> None:
    """Send every frame at once, and find out when the other end is there no more."""
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    for name, value in _PROBES:
        if (option := getattr(socket, name, None)) is not None:
            connection.setsockopt(socket.IPPROTO_TCP, option, value)
    if (option := getattr(socket, "TCP_USER_TIMEOUT", None)) is not None:
        # There is no probe while something that was sent is unanswered; Linux has another bound for that. It
        # holds for an end that is there and takes nothing, too, and so may not be below the user's.
        unanswered = round(max(_LEAST_UNANSWERED, stall_timeout) * 1000)
        connection.setsockopt(socket.IPPROTO_TCP, option, unanswered)


def stop_sending(connection: socket.socket) -> None:
    """Let the system send what it holds, after the connection is closed; the last may be a stop.

    It forgets all that when a socket is closed with bytes unread, so they are read.
    """
    with contextlib.suppress(OSError):
        connection.shutdown(socket.SHUT_WR)
        while connection.recv(65_536):
            pass


def connect_refusal(url: str, error: OSError, open_timeout: float) -> LinkOpenError:
    """Return what is said when nobody could be reached."""
    if isinstance(error, ConnectionRefusedError):
        why = (
            "the connection was refused: the host is there, and nothing listens on that port. "
            "Check the port, and that the server of the line runs"
        )
    elif isinstance(error, TimeoutError):
        why = (
            f"no answer within {open_timeout:g} s (open_timeout). Check the address, "
            "that the host is switched on, and that no firewall is between"
        )
    elif error.errno in (errno.EHOSTUNREACH, errno.ENETUNREACH):
        why = f"there is no way to that host ({error.strerror}). Check the address and the network"
    else:
        why = f"the system says: {error.strerror or error}"
    return LinkOpenError(f"{url} cannot be opened: {why}")


def unknown_host(url: str, host: str, error: socket.gaierror) -> LinkOpenError:
    """Return what is said of a name without an address."""
    return LinkOpenError(
        f"{url} cannot be opened: there is no host called {host!r} ({error.strerror}). Check the name, "
        "or give the number of its address"
    )
