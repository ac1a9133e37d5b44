"""Endpoints at which a virtual controller is served: a TCP port or a pseudo-terminal."""

from __future__ import annotations

import ipaddress
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Protocol

from stagewire_virtual.errors import ServingError
from stagewire_virtual.serving.link import FarEnd, Observer, ServedLink

LOOPBACK: Final = "127.0.0.1"


class Endpoint(Protocol):
    """A place to serve controllers at; it makes links, which a server then opens."""

    def link(
        self, far_end: FarEnd, *, label: str = "", observer: Observer | None = None
    ) -> ServedLink:
        """Return a new link."""


@dataclass(frozen=True, slots=True)
class TcpEndpoint:
    """A TCP port.

    :param port: the port; 0 for a free one.
    :param host: the address to listen on.
    """

    port: int = 0
    host: str = LOOPBACK

    def link(
        self, far_end: FarEnd, *, label: str = "", observer: Observer | None = None
    ) -> ServedLink:
        """Return a new link."""
        from stagewire_virtual.serving.tcp import TcpLink

        return TcpLink(far_end, self.host, self.port, label=label, observer=observer)


@dataclass(frozen=True, slots=True)
class PtyEndpoint:
    """A pseudo-terminal, with an optional symbolic link to it."""

    symlink: Path | None = None

    def link(
        self, far_end: FarEnd, *, label: str = "", observer: Observer | None = None
    ) -> ServedLink:
        """Return a new link."""
        from stagewire_virtual.serving.pty import PtyLink

        return PtyLink(far_end, self.symlink, label=label, observer=observer)


def parse_tcp(text: str, bind: str | None = None) -> TcpEndpoint:
    """Return the endpoint that ``127.0.0.1:4001``, ``[::1]:4001``, ``:4001`` or ``4001`` names.

    A virtual controller obeys every host that connects. It therefore listens only on this machine, unless
    ``bind`` is an address of the network; ``text`` must then name that address, or none.

    Raises :class:`~stagewire_virtual.errors.ServingError` for an invalid text, and for an address of the
    network without ``bind``.
    """
    if bind == "":  # the system would listen on all its addresses
        raise ServingError("the address to bind to is empty; use 0.0.0.0 for all IPv4 addresses")
    host, _, digits = text.strip().rpartition(":")
    host = host.removeprefix("[").removesuffix("]")
    if not (digits.isascii() and digits.isdigit() and int(digits) <= 0xFFFF):
        raise ServingError(
            f"{text!r} is not a TCP address: expected a port up to 65535 such as 4001, or an address and a "
            "port such as 127.0.0.1:4001; port 0 chooses a free one"
        )
    wanted = bind if bind is not None else LOOPBACK
    if not host or host == wanted:
        return TcpEndpoint(int(digits), _numeric(wanted))
    if not _is_loopback(_numeric(host)):
        raise ServingError(
            f"{text!r} may be reachable from the network, and every host that connects is obeyed; leave the "
            f"address out, or allow it with --bind {host} (bind={host!r})"
        )
    return TcpEndpoint(int(digits), _numeric(host))


def _numeric(host: str) -> str:
    """Replace ``localhost``, which may have two addresses, by the IPv4 loopback address."""
    return LOOPBACK if host.lower() == "localhost" else host


def _is_loopback(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False
