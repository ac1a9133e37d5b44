"""TCP for threads."""

from __future__ import annotations

import socket

from stagewire.links.descriptor import DescriptorLink
from stagewire.links.settings import LineSettings
from stagewire.links.tcp_address import (
    HUNG_UP,
    Beginning,
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
    """A socket, and how its conversation began."""

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
