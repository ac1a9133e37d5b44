"""TCP for threads."""

from __future__ import annotations

import contextlib
import socket

from stagewire.links.descriptor import CHUNK, DescriptorLink
from stagewire.links.settings import LineSettings
from stagewire.links.tcp_address import (
    HUNG_UP,
    address_of,
    connect_refusal,
    set_options,
    unknown_host,
)

__all__ = ["open_tcp"]


def open_tcp(url: str, settings: LineSettings) -> DescriptorLink:
    """Connect to ``socket://HOST:PORT``.

    Raises :class:`~stagewire.errors.LinkOpenError`.
    """
    host, port = address_of(url)
    try:
        connection = socket.create_connection((host, port), settings.open_timeout)
    except socket.gaierror as error:
        raise unknown_host(url, host, error) from error
    except OSError as error:
        raise connect_refusal(url, error, settings.open_timeout) from error
    connection.setblocking(False)
    set_options(connection, settings.stall_timeout)
    return DescriptorLink(
        url,
        connection.fileno(),
        connection.recv,
        connection.send,
        lambda: _hang_up(connection),
        HUNG_UP,
        settings.stall_timeout,
    )


def _hang_up(connection: socket.socket) -> None:
    # A socket that is closed with bytes unread forgets what is still to be sent, such as a stop.
    with contextlib.suppress(OSError):
        connection.shutdown(socket.SHUT_WR)
        while connection.recv(CHUNK):
            pass
    connection.close()
