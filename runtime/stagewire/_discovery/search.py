"""``stagewire.discover``: the serial ports, and which of them are controllers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from stagewire._codec.protocol import load_protocol
from stagewire._discovery.identification import Identity, can_identify, identify, used_bays
from stagewire._discovery.ports import Port, serial_ports
from stagewire._discovery.products import Known, by_identity, by_serial_number
from stagewire.errors import StagewireError, TransportError

TYPE_CHECKING = False
if TYPE_CHECKING:
    from stagewire._framings.header.protocol import FramedProtocol
    from stagewire._links.link import Link


@dataclass(frozen=True, slots=True)
class Found:
    """A serial port and the controller on it, as far as known.

    :param port: port.
    :param known: units and aliases that the controller may be; exactly one if it is certain, empty if
        unknown.
    :param identity: identity that it reported; None if it was not asked or did not answer.
    :param bays: bays that hold a module, counted from 1; None if unknown.
    :param problem: why it could not be asked, or what was received instead of an answer; empty if no problem.
    """

    port: Port
    known: tuple[Known, ...] = ()
    identity: Identity | None = None
    bays: tuple[int, ...] | None = None
    problem: str = ""

    @property
    def url(self) -> str:
        """The URL to open."""
        return self.port.device

    @property
    def unit(self) -> str | None:
        """The name of the unit, if it is certain; it may be newer than the document."""
        return self.known[0].name if len(self.known) == 1 else None

    @property
    def serial_number(self) -> str:
        """The serial number that the controller reported, or else that of its USB plug; may be empty."""
        return self.identity.serial_number if self.identity else self.port.serial_number

    @property
    def is_controller(self) -> bool:
        """Whether the port has the USB plug of a controller, or a controller answered."""
        return self.port.plug is not None or self.identity is not None

    def __str__(self) -> str:
        return f"{self.url}: {self.what}"

    @property
    def what(self) -> str:
        """A description of the controller."""
        if len(self.known) == 1:
            return str(self.known[0])
        if self.known:
            names = " or ".join(known.name for known in self.known)
            which = (
                "request the identity to find out which"
                if self.identity is None
                else "the reported model does not show which it is"
            )
            return f"{names}: they share the prefix of their serial numbers; {which}"
        if self.identity is not None:
            model, number = self.identity.model or "no model number", self.identity.serial_number
            return f"{model}: no known unit reports this model with serial number {number}"
        if self.port.plug is not None:
            number = self.port.serial_number or "none"
            name = self.port.plug.protocol
            return f"a {name} controller with an unknown serial number ({number})"
        return "unknown device, possibly a controller on RS-232 such as an MS-2000"


NO_FRAME = "bytes without a valid frame"
ASK_TIMEOUT = 1.0
"""Seconds to wait for the answer of a controller."""


def discover(ask: bool = False, timeout: float = ASK_TIMEOUT) -> list[Found]:
    """Return every serial port with the controller on it, as far as known; controllers come first.

    Without ``ask`` no port is opened. The operating system reads the ids and the serial number from the USB
    plug. A controller on RS-232 has no USB plug, so its port is listed as unknown.

    :param ask: open the ports that are controllers by their USB plug, one after the other, and request
        identity (HW_REQ_INFO) and bays (RACK_REQ_BAYUSED). Nothing moves. Other ports are never opened,
        because unexpected bytes may have any effect there.
    :param timeout: timeout of each controller in seconds.
    """
    found = [look_at(port) for port in serial_ports()]
    if ask:
        found = [identified(one, timeout) for one in found]
    return sorted(found, key=lambda one: not one.is_controller)


def look_at(port: Port) -> Found:
    """Return the controller of a port by its USB plug and its serial number, without opening it."""
    plug = port.plug
    if plug is None:
        return Found(port)
    try:
        protocol = load_protocol(plug.protocol)
    except StagewireError:  # not installed, so its units are unknown
        return Found(port)
    return Found(port, tuple(by_serial_number(protocol, port.serial_number)))


def identified(found: Found, timeout: float = ASK_TIMEOUT) -> Found:
    """Open the port of a controller that was found by its plug, request its identity, and return the result.

    Other ports are returned unchanged.
    """
    from stagewire._links.opening import open_link

    plug = found.port.plug
    if plug is None:
        return found
    protocol = load_protocol(plug.protocol)
    if not can_identify(protocol):
        return found
    try:
        link = open_link(found.url)
    except TransportError as error:
        return replace(found, problem=str(error))
    try:
        return recognise(found, link, protocol, timeout)
    except TransportError as error:
        return replace(found, problem=str(error))
    finally:
        link.close()


def recognise(
    found: Found,
    link: Link,
    protocol: FramedProtocol,
    timeout: float,
    addresses: tuple[int, ...] | None = None,
) -> Found:
    """Request the identity on an open line, and return the result.

    :param addresses: addresses to ask, in order; None: those of :func:`addresses_of`.

    Raise :class:`~stagewire.errors.TransportLostError` if the line is lost.
    """
    addresses = addresses_of(protocol, found.known) if addresses is None else addresses
    identity, heard = identify(link, protocol, addresses, timeout)
    if identity is None:
        at = " and ".join(f"{address:#04x}" for address in addresses)
        came = f": received {len(heard.data)} {NO_FRAME}" if heard.is_garbage else ""
        return replace(found, problem=f"no answer to the identity request at {at}{came}")
    known = by_identity(protocol, int(identity.serial_number), identity.model)
    motherboard = _address(protocol, "motherboard")
    bays = None
    if identity.address == motherboard:
        bays = used_bays(link, protocol, motherboard, _bays(protocol, known))
    return replace(found, known=tuple(known), identity=identity, bays=bays, problem="")


def addresses_of(protocol: FramedProtocol, known: Sequence[Known] = ()) -> tuple[int, ...]:
    """Return the addresses for the identity request, in order.

    If the unit is known, this is only its own address, because some units freeze after a request to another
    address. Otherwise the address of units with their own USB plug comes first; a rack is asked only if that
    one does not answer.
    """
    own, rack = _address(protocol, "generic_usb"), _address(protocol, "motherboard")
    units = [facts for known_one in known if (facts := known_one.facts)]
    if not units:
        return (own, rack)
    alone = [facts for facts in units if facts["address"] == "generic_usb"]
    if not alone:
        return (rack,)
    preferred = {facts.get("also_at", {}).get("preferred", own) for facts in alone}
    return (preferred.pop() if len(preferred) == 1 else own,)


def _address(protocol: FramedProtocol, name: str) -> int:
    address: int = protocol.registry()["addresses"][name]["value"]
    return address


def _bays(protocol: FramedProtocol, known: Sequence[Known]) -> int:
    """Return the number of bays to ask for: those of the unit, or all with an address in the protocol."""
    most: int = protocol.registry()["addresses"]["bays"]["count"]
    return max((facts.get("bays", most) for one in known if (facts := one.facts)), default=most)
