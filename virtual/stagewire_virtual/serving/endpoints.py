"""Where a virtual controller is served: the choices that a user has, as values."""

from __future__ import annotations

import ipaddress
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Protocol

from stagewire_virtual.errors import ServingError
from stagewire_virtual.serving.link import FarEnd, Observer, ServedLink

LOOPBACK: Final = "127.0.0.1"


class Endpoint(Protocol):
    """Makes the link of a far end; it is open when a server has opened it."""

    def link(
        self, far_end: FarEnd, *, label: str = "", observer: Observer | None = None
    ) -> ServedLink:
        """Return a new link."""


@dataclass(frozen=True, slots=True)
class TcpEndpoint:
    """A TCP port.

    :param port: 0 for one that the system chooses.
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
    """A pseudo-terminal, with a symbolic link to it if one is named."""

    symlink: Path | None = None

    def link(
        self, far_end: FarEnd, *, label: str = "", observer: Observer | None = None
    ) -> ServedLink:
        """Return a new link."""
        from stagewire_virtual.serving.pty import PtyLink

        return PtyLink(far_end, self.symlink, label=label, observer=observer)


def parse_tcp(text: str, bind: str | None = None) -> TcpEndpoint:
    """Return the port that ``127.0.0.1:4001``, ``[::1]:4001``, ``:4001`` or ``4001`` names.

    A virtual controller obeys whoever can reach it. So it listens to this machine alone, unless ``bind``
    says on which address of the network; the text then names that address, or none.

    Raises :class:`~stagewire_virtual.errors.ServingError` for what is no port, and for an address of the
    network without ``bind``.
    """
    if bind == "":  # the system would take it for every address that it has
        raise ServingError("an empty address was allowed to bind to; 0.0.0.0 is every one of IPv4")
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
            f"{text!r} is not an address of this machine alone, and virtual controllers obey whoever "
            f"reaches them; leave the address out, or allow it with --bind {host} (bind={host!r})"
        )
    return TcpEndpoint(int(digits), _numeric(host))


def _numeric(host: str) -> str:
    """Return the number of ``localhost``, which stands for two addresses where one port is meant."""
    return LOOPBACK if host.lower() == "localhost" else host


def _is_loopback(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False
