"""TCP for threads."""

from __future__ import annotations

import socket

from stagewire.links.descriptor import DescriptorLink
from stagewire.links.settings import LineSettings
from stagewire.links.tcp_address import (
    HUNG_UP,
    address_of,
    connect_refusal,
    set_options,
    stop_sending,
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
        try:
            set_options(connection, settings.stall_timeout)
        except OSError:  # where the other end has hung up by now, macOS takes no options
            connection.close()
            raise
    except socket.gaierror as error:
        raise unknown_host(url, host, error) from error
    except OSError as error:
        raise connect_refusal(url, error, settings.open_timeout) from error
    connection.setblocking(False)
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
    stop_sending(connection)
    connection.close()
